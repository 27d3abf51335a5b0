"""A calibration whose S_d is that of two springs in a row, in closed form."""

import numpy as np

from papilla.calibration import Calibration, GaugeSurface, Quadratic, SdSurface, Uncertainty
from papilla.calibration.surface import BicubicSurface

FORCE, MODULUS = (0.05, 1.0), (0.02, 5.0)
TRUE = np.array([10.4, 0.4, -0.07, -3.5, 0.2])


def knots(limits, cells):
    """Logarithms at which a bicubic surface of so many cells has its values."""
    return np.log(limits[0]) + (np.arange(cells + 3) - 1) * np.log(limits[1] / limits[0]) / cells


def assembled(surface, known, name="", nodes=None) -> Calibration:
    """A calibration all of whose surfaces are alike."""
    m, n = np.array(surface.coefficients.shape) - 3
    forward = Quadratic(np.array([-3.0, 500, -9000, 12000, 900]), np.ones(5), np.eye(5), 1.0, 2.0, (0.089, 0.72), 9.0)
    nodes = np.tile([0, n], (m, 1)) if nodes is None else nodes
    sd = SdSurface(surface, nodes, np.full((m, 2), np.nan), known)
    gauges = tuple(GaugeSurface(f"g{k}", surface, known) for k in range(1, 6))
    return Calibration({"name": name, "sha256": ""}, {}, forward, forward.inverse, sd, gauges, {})


def calibration(modulus=MODULUS, falling=False) -> Calibration:
    """A surface that samples the form itself, or that falls with the modulus."""
    x, y = knots(FORCE, 12)[:, None], knots(modulus, 40)
    a, b, c, d, e = TRUE
    table = a + b * x + c * x**2 - np.log1p(np.exp(d + e * x - y))
    known = Uncertainty(1e-3, 1.96, 1e-3, np.array(FORCE), np.full(2, 0.01), 2.0, 3)
    return assembled(BicubicSurface(FORCE, modulus, -table if falling else table), known, "toy */ finger")
