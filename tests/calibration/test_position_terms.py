"""Contact positions of a calibration: fitted to presses that were moved, and left out with a reason."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.calibration.fitting import position_terms as position
from papilla.calibration.fitting.position_terms import CELLS, ERROR, fit_positions, with_positions
from papilla.core.errors import ContactRangeError, InputError
from papilla.fem.pressing import fidelity
from papilla.fem.reduction.finger_model import FingerModel
from papilla.model.finger import Finger

GAUGES_MM = np.array([-13.0, -7.0, 0.0, 7.0, 13.0])
PLACES = np.linspace(-4, 4, 2 * CELLS + 1)


def seen(force, modulus, x):
    """(..., g) readings per newton: a bell over the distance from each gauge."""
    size = 5e4 * force**-0.3 * (modulus / (modulus + 0.1)) ** 0.4
    return np.asarray(size)[..., None] * np.exp(-(((np.asarray(x)[..., None] - GAUGES_MM) / 5) ** 2))


def moved(noise=0.0):
    modulus, force = (part.ravel() for part in np.meshgrid(np.geomspace(0.02, 5, 12), np.geomspace(0.05, 1, 10)))
    reading = force[:, None] * seen(force, modulus, PLACES[:, None])
    reading = reading + noise * force[:, None] * np.random.default_rng(0).normal(size=reading.shape)
    return {"force_N": force, "modulus_MPa": modulus, "place_mm": PLACES, "reading": reading}


def test_a_smooth_change_is_given_back():
    terms = fit_positions(moved())
    assert terms.reach_mm == 4.0 and terms.cells == (4, 6, CELLS)
    rng = np.random.default_rng(1)
    force, modulus, x = np.exp(rng.uniform(np.log(0.05), 0, 200)), np.exp(rng.uniform(-3.9, 1.6, 200)), PLACES[3]
    expected = seen(force, modulus, x) - seen(force, modulus, 0.0)
    np.testing.assert_allclose(terms.change(force, modulus, x), expected, atol=0.01 * np.abs(expected).max())
    between = seen(0.3, 0.3, 1.3) - seen(0.3, 0.3, 0.0)
    np.testing.assert_allclose(terms.change(0.3, 0.3, 1.3), between, atol=0.01 * np.abs(between).max())
    assert np.abs(terms.change(force, modulus, 0.0)).max() < 1e-9 * np.abs(expected).max()


def test_its_error_is_a_share_of_the_change_and_what_the_fit_misses():
    smooth, rough = fit_positions(moved()), fit_positions(moved(noise=300.0))
    data = moved()
    change = (data["reading"][-1] - data["reading"][CELLS]) / data["force_N"][:, None]
    np.testing.assert_allclose(smooth.error[:, -1], ERROR * np.sqrt((change**2).mean(axis=0)), rtol=0.05)
    assert (smooth.error[:, CELLS // 2] < 1e-6).all()
    assert (rough.error[:, 1] ** 2 > smooth.error[:, 1] ** 2 + 200.0**2).all()


def stand_in_reduced(text):
    return SimpleNamespace(to_arrays=lambda: {"meta": np.array(text)}, mesh_size_mm=0.7)


def test_a_finger_gets_its_positions(calibration, monkeypatch, tmp_path):
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path))
    calls = []

    def move(model, reduced, domain, friction):
        assert friction == "stick"
        assert isinstance(model, FingerModel) and reduced is stand_in and domain == calibration.domain
        calls.append(1)
        return moved()

    monkeypatch.setattr(position, "move_presses", move)
    finger = Finger.default()
    stand_in = stand_in_reduced("ab")
    for _ in range(2):
        assert with_positions(calibration, finger, stand_in, "stick").position.reach_mm == 4.0
    assert len(calls) == 1, "the second time they come from the cache"
    few = replace(finger, gauges=finger.gauges[:2])
    assert with_positions(calibration, few, stand_in) is calibration
    known = with_positions(calibration, finger, stand_in, "stick").position.error
    free = replace(calibration.surface.surface, coefficients=np.full((4, 4), 0.03))
    unknown = replace(calibration.surface.uncertainty, friction=free)
    doubtful = replace(calibration, surface=replace(calibration.surface, uncertainty=unknown))
    assert (with_positions(doubtful, finger, stand_in, "stick").position.error[:, -1] > 1.5 * known[:, -1]).all()


def test_where_contacts_leave_the_skin_a_note_says_so(calibration, monkeypatch, tmp_path):
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path))

    def fail(*_):
        raise InputError("no skin to touch at x 4, y 0 mm")

    monkeypatch.setattr(position, "move_presses", fail)
    found = with_positions(calibration, Finger.default(), stand_in_reduced("cd"))
    assert found.position is None
    assert found.notes[-1] == "the apex alone is calibrated: no skin to touch at x 4, y 0 mm"


def test_presses_beyond_the_model_are_left_out(monkeypatch):
    """A force that takes the contact to the rim ends its modulus, and the rest is fitted."""
    reduced = type("Reduced", (), {"patch": None})
    mesh = type("Mesh", (), {"points": np.array([[-24.0, 0, 0], [24.0, 0, 0]])})
    model = type("Model", (), {"mesh": mesh, "finger": Finger.default()})

    def press(_, block, force, **options):
        if block.modulus < 0.03 and force > 0.5:
            raise ContactRangeError("the rim")
        assert options["friction"] == "stick"
        traction = np.array([[force, block.modulus]] * 3)
        return SimpleNamespace(force=force, modulus=block.modulus, traction=traction)

    def readings(_, patch, traction, places):
        force, modulus = traction[:, 0].T
        return force[:, None] * seen(force, modulus, np.array(places)[:, None])

    monkeypatch.setattr(fidelity, "press", press)
    monkeypatch.setattr(position, "transported_readings", readings)
    found = position.move_presses(model, reduced, {"force_N": (0.05, 1.0), "modulus_MPa": (0.02, 5.0)}, "stick")
    assert len(found["force_N"]) == position.FORCES * position.MODULI - 3
    assert found["place_mm"][[0, -1]] == pytest.approx([-4, 4]) and found["place_mm"][CELLS] == 0
    assert fit_positions(found).force_N == (0.05, 1.0)
