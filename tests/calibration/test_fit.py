"""From a sweep to a calibration: recovery between the points, missing presses, mesh scatter, what it confesses."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.calibration import SoftnessStatus, fit
from papilla.core.errors import InputError
from papilla.fem.pressing.large_strain import BEYOND_STRAIN_TABLES

RNG_FORCE = np.exp(np.random.default_rng(1).uniform(np.log(0.196), np.log(0.98), 300))
RNG_MODULUS = np.exp(np.random.default_rng(2).uniform(np.log(0.05), np.log(0.72), 300))


def test_gauges_follow_their_readings(calibration, truth):
    found = calibration.predict_readings(RNG_FORCE, RNG_MODULUS)
    expected = truth.readings(RNG_FORCE, RNG_MODULUS)
    assert found.shape == (300, 5)
    np.testing.assert_allclose(found, expected, atol=2e-4 * np.abs(expected).max())
    assert np.isfinite([gauge.uncertainty.fit_rms for gauge in calibration.gauges]).all()


def test_presses_without_readings_are_neither_dropped_nor_bridged(truth):
    moduli, forces = np.geomspace(0.02, 5, 30), np.geomspace(0.05, 1, 30)
    lost = lambda force, modulus: np.where((force > 0.6) & (modulus < 0.04), np.nan, 1.0)  # noqa: E731
    sweep = truth.sweep(moduli, forces, change=lost)
    missing = int((~sweep.valid).sum())
    calibration = fit(sweep)
    assert missing and calibration.provenance["left_out"] == missing
    assert any(note.startswith(f"{missing} of 900 presses left") for note in calibration.notes)
    assert calibration.invert(truth.sd(0.9, 0.03), 0.9).status is SoftnessStatus.SOFTER
    assert calibration.invert(truth.sd(0.3, 0.03), 0.3).modulus_MPa == pytest.approx(0.03, rel=1e-3)
    assert calibration.invert(truth.sd(0.9, 0.3), 0.9).modulus_MPa == pytest.approx(0.3, rel=1e-3)


def test_coarse_presses_are_confessed(truth):
    forces = np.geomspace(0.05, 1, 12)
    notes = fit(truth.sweep(np.geomspace(0.05, 1, 12), forces, resolved=np.tile(forces > 0.06, 12))).notes
    assert any(note.startswith("12 of 144 presses are too light for the mesh") for note in notes)


def test_presses_beyond_measured_strain_are_in_sigma_and_counted(truth):
    moduli, forces = np.geomspace(0.05, 1, 12), np.geomspace(0.05, 1, 12)
    status = tuple(f"contact, {BEYOND_STRAIN_TABLES}: S_d within 2 %" if k % 4 == 0 else "contact" for k in range(144))
    plain, found = (fit(truth.sweep(moduli, forces, status=one), strain=0.002) for one in (("contact",) * 144, status))
    assert plain.surface.uncertainty.strain == pytest.approx(0.002)
    assert found.surface.uncertainty.strain == pytest.approx(np.hypot(0.002, 0.026 / 2))
    for one, other in zip(plain.gauges, found.gauges, strict=True):
        size = one.uncertainty.strain / 0.002
        assert other.uncertainty.strain == pytest.approx(np.hypot(0.002, 0.03 / 2) * size)
    assert any(note.startswith(f"36 of 144 presses are {BEYOND_STRAIN_TABLES}") for note in found.notes)
    assert found.invert(truth.sd(0.3, 0.3), 0.3).sigma_MPa > plain.invert(truth.sd(0.3, 0.3), 0.3).sigma_MPa


def test_sweeps_that_cannot_be_fitted_are_refused(made_up, truth):
    moduli, forces = [0.1, 0.3, 0.6], [0.1, 0.3, 0.6]
    other = truth.sweep(moduli, forces)
    other = replace(other, reading=other.reading[:, :3])
    with pytest.raises(InputError, match="a scatter sweep has 3 gauges, not 5"):
        fit(made_up, scatter=[other])
    for swept, message in (
        (truth.sweep(moduli, forces, change=lambda force, modulus: np.nan), "the first says: made up"),
        (truth.sweep(moduli, forces, change=lambda force, modulus: 0.0), "S_d is 0 at 0.1 N on 0.1 MPa"),
        (truth.sweep([0.3], [*forces, 0.7, 0.8]), "do not determine the terms"),
    ):
        with pytest.raises(InputError, match=message):
            fit(swept)


def test_a_small_sweep_gets_polynomials(truth):
    """5 moduli x 6 forces: low order, and still right to a few per cent."""
    calibration = fit(truth.sweep(np.geomspace(0.05, 0.8, 5), np.geomspace(0.1, 1, 6)))
    force, modulus = RNG_FORCE[:50], RNG_MODULUS[:50]
    answer = calibration.invert(truth.sd(force, modulus), force)
    assert np.abs(answer.modulus_MPa / modulus - 1).max() < 0.03
