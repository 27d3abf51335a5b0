"""A calibration whose S_d is that of two springs in a row, in closed form."""

import numpy as np

from papilla.calibration import Calibration, GaugeSurface, Quadratic, SdSurface, Uncertainty
from papilla.calibration.surface import BicubicSurface

FORCE, MODULUS = (0.05, 1.0), (0.02, 5.0)
TRUE = np.array([10.4, 0.4, -0.07, -3.5, 0.2])


def calibration(modulus=MODULUS, falling=False) -> Calibration:
    """A surface that samples the form itself, or that falls with the modulus."""
    m, n = 12, 40
    x = np.log(FORCE[0]) + (np.arange(m + 3) - 1) * np.log(FORCE[1] / FORCE[0]) / m
    y = np.log(modulus[0]) + (np.arange(n + 3) - 1) * np.log(modulus[1] / modulus[0]) / n
    a, b, c, d, e = TRUE
    table = a + b * x[:, None] + c * x[:, None] ** 2 - np.log1p(np.exp(d + e * x[:, None] - y))
    surface = BicubicSurface(FORCE, modulus, -table if falling else table)
    known = Uncertainty(1e-3, 1.96, 1e-3, np.array(FORCE), np.full(2, 0.01), 2.0, 3)
    forward = Quadratic(np.array([-3.0, 500, -9000, 12000, 900]), np.ones(5), np.eye(5), 1.0, 2.0, (0.089, 0.72), 9.0)
    sd = SdSurface(surface, np.tile([0, n], (m, 1)), np.full((m, 2), np.nan), known)
    gauges = tuple(GaugeSurface(f"g{k}", surface, known) for k in range(1, 6))
    return Calibration({"name": "toy */ finger", "sha256": ""}, {}, forward, forward.inverse, sd, gauges, {})
