"""The whole pipeline on a log of five gauges as a finger makes it, and with two of them exchanged."""

import numpy as np
import pytest

from papilla.estimators import Doubts, Pipeline

PLACES = np.array([-13.5, -7.2, 0.0, 7.2, 13.5])
WAVELENGTH, STIFFNESS, FRICTION = 1.8, 0.3, 0.6


def slid(calibration, seconds, texture=60.0, seed=0):
    """(n, 9) rows t_s, g1 ... g5, force_N, velocity_mm_s, tangential_N: to and fro over a grating, pressing harder."""
    rng, time = np.random.default_rng(seed), np.arange(round(seconds * 1000)) / 1000
    velocity, position = 100 * np.sin(np.pi * time), 100 / np.pi * (1 - np.cos(np.pi * time))
    force = 0.45 + 0.01 * np.sin(2 * time)
    readings = calibration.predict_readings(force, STIFFNESS)
    readings = readings + texture * np.sin(2 * np.pi * (position[:, None] - PLACES) / WAVELENGTH)
    readings = readings + 6 * rng.normal(size=readings.shape)
    tangential = FRICTION * force * np.tanh(velocity / 2) + 0.005 * rng.normal(size=len(time))
    return np.column_stack([time, readings, force + 0.002 * rng.normal(size=len(time)), velocity, tangential])


def make_pipeline(calibration):
    return Pipeline(calibration, gauge_sigma=20.0, force_sigma_N=0.002, doubts=Doubts(thickness_mm=10.0))


def right(answer, rows=slice(-200, None)):
    """The last answers are those of what was touched."""
    assert answer.wavelength_mm[rows] == pytest.approx(np.full(200, WAVELENGTH), rel=5e-3)
    assert np.abs(answer.modulus_MPa[rows] - STIFFNESS).max() < 2 * answer.modulus_sigma_MPa[rows].max() < 0.6
    assert answer.mu_kinetic[rows] == pytest.approx(np.full(200, FRICTION), rel=0.02)


def test_two_gauges_exchanged_in_the_log(five):
    """The softness says who they are and does without them; a wavelength does not ask where a gauge is."""
    five = five(0.01)
    rows = slid(five, 1.6)
    clean, exchanged = make_pipeline(five).process(rows), rows.copy()
    exchanged[:, [2, 3]] = rows[:, [3, 2]]
    answer = make_pipeline(five).process(exchanged)
    right(clean)
    right(answer)
    assert "g2 left out: swapped with another, g3 left out: swapped with another" in answer.status[-1]
    assert "left out" not in clean.status[-1]
    assert answer.modulus_sigma_MPa[-1] > clean.modulus_sigma_MPa[-1]
    for name in ("frequency_Hz", "wavelength_mm", "wavelength_sigma_mm", "mu_kinetic", "mu_static"):
        np.testing.assert_allclose(getattr(answer, name), getattr(clean, name), rtol=1e-9)
