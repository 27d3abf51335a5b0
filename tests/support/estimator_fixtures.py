"""A calibration with a known, nearly separable S_d: what the estimators are tested on."""

from dataclasses import replace

import numpy as np
import pytest
from spring_calibration import FORCE, MODULUS, assembled, knots

from papilla.calibration import Calibration, GaugeSurface, Uncertainty
from papilla.calibration.surface import BicubicSurface

PATTERN = np.array([-0.9, -0.4, 1.7, -0.6, -0.3])


def uncertainty(fit_rms=0.0, scatter=0.0):
    return Uncertainty(fit_rms, 1.96, fit_rms, np.array(FORCE), np.full(2, scatter), 2.0, 4 if scatter else 0)


@pytest.fixture(scope="session")
def make():
    """make(fit_rms, scatter, usable) -> a calibration with errors of its own. ln S_d saturates like the default
    finger's: its slope in ln E is about 0.2 at 0.05 and 0.04 at 0.72 MPa."""

    def build(fit_rms=0.0, scatter=0.0, usable=None) -> Calibration:
        x, y = knots(FORCE, 8)[:, None], knots(MODULUS, 24)
        table = 10.4 + 0.6 * x - 0.35 * np.log1p(np.exp(np.log(0.1) + 0.2 * x - y))
        return assembled(BicubicSurface(FORCE, MODULUS, table), uncertainty(fit_rms, scatter), nodes=usable)

    return build


@pytest.fixture(scope="session")
def calibration(make):
    """Without any error of its own."""
    return make()


@pytest.fixture(scope="session")
def touch(calibration):
    """touch(modulus, force (n,), gauge_sigma, force_sigma_N, rng) -> samples (n, 6) with noise."""

    def samples(modulus, force, gauge_sigma=0.0, force_sigma_N=0.0, rng=None):
        rng = rng or np.random.default_rng(0)
        sd = np.asarray(calibration.predict(force, modulus))[:, None]
        readings = sd * ((PATTERN - PATTERN.mean()) / PATTERN.std() - 0.2)
        readings = readings + gauge_sigma * rng.normal(size=readings.shape)
        return np.column_stack([readings, force + force_sigma_N * rng.normal(size=len(force))])

    return samples


@pytest.fixture(scope="session")
def five(calibration):
    """five(error) -> a calibration whose gauges have that relative error; as in the default finger, they differ, and
    the outer ones feel the force alone."""
    x, y = knots(FORCE, 12)[:, None], knots(MODULUS, 24)
    soft = 1 / (1 + np.exp(y - np.log(0.1) - 0.2 * x))
    outer, beside = -17500 - 300 * x + 0 * soft, (-29000 + 9500 * x) * (1 - 0.25 * soft)
    middle = 54000 * np.exp(-0.47 * x) * (1 - 0.35 * soft)

    def build(error=0.0):
        gauges = []
        for number, table in enumerate((outer, beside, middle, beside, outer), start=1):
            known = replace(uncertainty(scatter=error * float(np.abs(table).mean())), meshes=4)
            gauges.append(GaugeSurface(f"g{number}", BicubicSurface(FORCE, MODULUS, table), known))
        return replace(calibration, gauges=tuple(gauges))

    return build


@pytest.fixture(scope="session")
def five_gauges(five):
    """Five gauges without any error of their calibration."""
    return five()
