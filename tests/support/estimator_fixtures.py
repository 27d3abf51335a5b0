"""A calibration with a known, nearly separable S_d: what the estimators are tested on."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.calibration import Calibration, GaugeSurface, Quadratic, SdSurface, Uncertainty
from papilla.calibration.surface import BicubicSurface

FORCE, MODULUS, GAUGES = (0.05, 1.0), (0.02, 5.0), 5


def make_calibration(fit_rms=0.0, scatter=0.0, usable=None) -> Calibration:
    """ln S_d saturates like the default finger's: its slope in ln E is about 0.2 at 0.05 and 0.04 at 0.72 MPa."""
    m, n = 8, 24
    x = np.log(FORCE[0]) + (np.arange(m + 3) - 1) * np.log(FORCE[1] / FORCE[0]) / m
    y = np.log(MODULUS[0]) + (np.arange(n + 3) - 1) * np.log(MODULUS[1] / MODULUS[0]) / n
    knee = np.log(0.1) + 0.2 * x[:, None]
    table = 10.4 + 0.6 * x[:, None] - 0.35 * np.log1p(np.exp(knee - y[None, :]))
    surface = BicubicSurface(FORCE, MODULUS, table)
    known = Uncertainty(fit_rms, 1.96, fit_rms, np.array(FORCE), np.full(2, scatter), 2.0, 4 if scatter else 0)
    forward = Quadratic(np.array([-3.0, 500, -9000, 12000, 900]), np.ones(5), np.eye(5), 1.0, 2.0, (0.089, 0.72), 9.0)
    nodes = np.tile([0, n], (m, 1)) if usable is None else usable
    gauges = tuple(GaugeSurface(f"g{k}", surface, known) for k in range(1, GAUGES + 1))
    sd = SdSurface(surface, nodes, np.full((m, 2), np.nan), known)
    return Calibration({"name": "", "sha256": ""}, {}, forward, forward.inverse, sd, gauges, {})


@pytest.fixture(scope="session")
def calibration():
    """Without any error of its own."""
    return make_calibration()


@pytest.fixture(scope="session")
def make():
    """Makes calibrations with errors of their own."""
    return make_calibration


def readings_of(sd):
    """(n, 5) readings of the given population standard deviations, with a common part."""
    pattern = np.array([-0.9, -0.4, 1.7, -0.6, -0.3])
    return np.asarray(sd)[:, None] * ((pattern - pattern.mean()) / pattern.std() - 0.2)


@pytest.fixture(scope="session")
def touch(calibration):
    """touch(modulus, force (n,), gauge_sigma, force_sigma_N, rng) -> samples (n, 6) with noise."""

    def samples(modulus, force, gauge_sigma=0.0, force_sigma_N=0.0, rng=None):
        rng = rng or np.random.default_rng(0)
        readings = readings_of(calibration.predict(force, modulus))
        readings = readings + gauge_sigma * rng.normal(size=readings.shape)
        return np.column_stack([readings, force + force_sigma_N * rng.normal(size=len(force))])

    return samples


def gauge_tables():
    """Readings / force of three different gauges, alike the default finger's: the outer ones feel the force alone."""
    x, y = (
        np.log(low) + (np.arange(cells + 3) - 1) * np.log(high / low) / cells
        for (low, high), cells in zip((FORCE, MODULUS), (12, 24), strict=True)
    )
    soft = 1 / (1 + np.exp(y[None, :] - np.log(0.1) - 0.2 * x[:, None]))
    outer = -17500 - 300 * x[:, None] + 0 * soft
    middle = 54000 * np.exp(-0.47 * x[:, None]) * (1 - 0.35 * soft)
    return outer, (-29000 + 9500 * x[:, None]) * (1 - 0.25 * soft), middle


@pytest.fixture(scope="session")
def five(make):
    """five(error) -> a calibration whose gauges have that relative error."""

    def build(error=0.0):
        outer, next_to_it, middle = gauge_tables()
        gauges = []
        for number, table in enumerate((outer, next_to_it, middle, next_to_it, outer), start=1):
            own = error * float(np.abs(table).mean())
            known = Uncertainty(0.0, 1.96, 0.0, np.array(FORCE), np.full(2, own), 2.0, 4)
            gauges.append(GaugeSurface(f"g{number}", BicubicSurface(FORCE, MODULUS, table), known))
        return replace(make(), gauges=tuple(gauges))

    return build


@pytest.fixture(scope="session")
def five_gauges(five):
    """Five gauges without any error of their calibration."""
    return five()
