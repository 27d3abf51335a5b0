"""From a sweep to a calibration: recovery between the points, missing presses, mesh scatter, what it confesses."""

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
    resolved = np.tile(forces > 0.06, 12)
    notes = fit(truth.sweep(np.geomspace(0.05, 1, 12), forces, resolved=resolved)).notes
    assert any(note.startswith("12 of 144 presses are too light for the mesh") for note in notes)


def test_presses_beyond_measured_strain_are_in_sigma_and_counted(truth):
    moduli, forces = np.geomspace(0.05, 1, 12), np.geomspace(0.05, 1, 12)
    status = tuple(f"contact, {BEYOND_STRAIN_TABLES}: S_d within 2 %" if k % 4 == 0 else "contact" for k in range(144))
    plain, found = (fit(truth.sweep(moduli, forces, status=one), strain=0.002) for one in (("contact",) * 144, status))
    assert plain.surface.uncertainty.strain == pytest.approx(0.002)
    assert found.surface.uncertainty.strain == pytest.approx(np.hypot(0.002, 0.01 / 2))
    for one, other in zip(plain.gauges, found.gauges, strict=True):
        size = one.uncertainty.strain / 0.002
        assert other.uncertainty.strain == pytest.approx(np.hypot(0.002, 0.03 / 2) * size)
    assert any(note.startswith(f"36 of 144 presses are {BEYOND_STRAIN_TABLES}") for note in found.notes)
    assert found.invert(truth.sd(0.3, 0.3), 0.3).sigma_MPa > plain.invert(truth.sd(0.3, 0.3), 0.3).sigma_MPa


@pytest.mark.slow
def test_intervals_include_mesh_scatter_and_cover_as_often_as_they_say(truth):
    """Meshes whose S_d differs by smooth random 1 %: 40 families of a nominal mesh, 4 others, and one held out."""
    rng = np.random.default_rng(8)
    moduli, forces = np.geomspace(0.03, 3, 12), np.geomspace(0.05, 1, 16)

    def another_mesh():
        phase, pitch = rng.uniform(0, 2 * np.pi), rng.uniform(1.5, 3)
        return lambda force, modulus: 1 + 0.01 * np.sqrt(2) * np.sin(pitch * np.log(force * modulus**0.3) + phase)

    inside = []
    for _ in range(40):
        sweeps = [truth.sweep(moduli, forces, change=another_mesh()) for _ in range(5)]
        calibration = fit(sweeps[0], scatter=sweeps[1:])
        held_out = another_mesh()
        force, modulus = np.exp(rng.uniform(-2.5, -0.1, 40)), np.exp(rng.uniform(-3, -0.4, 40))
        answer = calibration.invert(truth.sd(force, modulus) * held_out(force, modulus), force)
        inside.append((answer.lower_MPa <= modulus) & (modulus <= answer.upper_MPa))
    assert calibration.surface.uncertainty.meshes == 4
    assert np.mean(inside) == pytest.approx(0.95, abs=0.03)


def test_scatter_of_another_sensor_is_refused(made_up, truth):
    one = truth.sweep([0.1, 0.2], [0.1, 0.2])
    other = type(one)(**{**one.__dict__, "reading": one.reading[:, :3]})
    with pytest.raises(InputError, match="a scatter sweep has 3 gauges, not 5"):
        fit(made_up, scatter=[other])


def test_sweeps_that_cannot_be_fitted_are_refused(truth):
    moduli, forces = [0.1, 0.3, 0.6], [0.1, 0.3, 0.6]
    nothing = truth.sweep(moduli, forces, change=lambda force, modulus: np.nan)
    with pytest.raises(InputError, match="no press of the sweep has readings; the first says: made up"):
        fit(nothing)
    with pytest.raises(InputError, match="S_d is 0 at 0.1 N on 0.1 MPa"):
        fit(truth.sweep(moduli, forces, change=lambda force, modulus: 0.0))
    with pytest.raises(InputError, match="do not determine the terms"):
        fit(truth.sweep([0.3], forces + [0.7, 0.8]))


def test_a_small_sweep_gets_polynomials(truth):
    """5 moduli x 6 forces: low order, and still right to a few per cent."""
    calibration = fit(truth.sweep(np.geomspace(0.05, 0.8, 5), np.geomspace(0.1, 1, 6)))
    force, modulus = RNG_FORCE[:50], RNG_MODULUS[:50]
    answer = calibration.invert(truth.sd(force, modulus), force)
    assert np.abs(answer.modulus_MPa / modulus - 1).max() < 0.03


@pytest.mark.slow
def test_real_presses_between_the_points_and_on_another_mesh():
    """The default finger on two of its reference meshes, noise-free: the figures that the README states."""
    from papilla.calibration import sweep
    from papilla.fem import press
    from papilla.fem.preparing import prepare
    from papilla.model.finger import Finger
    from papilla.model.specimen import Block

    meshes = [prepare(Finger.default(), variant=variant) for variant in range(3)]
    few = np.geomspace(0.02, 5, 12), np.geomspace(0.05, 1, 20)
    calibration = fit(sweep(meshes[0]), scatter=[sweep(meshes[2], *few)])
    force, modulus = RNG_FORCE[:60], RNG_MODULUS[:60]
    points = list(zip(force, modulus, strict=True))
    presses = [[press(mesh, Block(E, 10), force=f) for f, E in points] for mesh in meshes[:2]]
    sd = np.array([[found.sd for found in row] for row in presses])
    same, other = (calibration.invert(row, force) for row in sd)
    assert np.abs(same.modulus_MPa / modulus - 1).max() < 0.02
    inside = (other.lower_MPa <= modulus) & (modulus <= other.upper_MPa)
    assert inside.mean() > 0.8
