"""`press` on the reference finger: symmetry, balance, specimens, fidelity and refusals; small strain alone."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import brentq

from papilla.core.errors import ContactRangeError, InputError
from papilla.fem import FingerModel, press
from papilla.fem.pressing.contact import contact_press
from papilla.mesh import build
from papilla.model.finger import Finger, Slab
from papilla.model.specimen import Block, Grating, HalfSpace, Specimen, Sphere

BLOCK = Block(0.51, 10)


@pytest.fixture(scope="module")
def reference(linear_reference):
    """Here all presses are linear."""
    return linear_reference


@pytest.mark.parametrize("fidelity", ["hertz", "contact"])
@pytest.mark.parametrize("force", [0.05, 0.3, 0.9])
def test_an_apex_press_is_symmetric_and_balanced(reference, fidelity, force):
    found = press(reference, BLOCK, force=force, fidelity=fidelity)
    assert found.force == force and found.fidelity == fidelity and found.resolved
    assert found.force_balance <= 1e-9
    assert 4 * reference.patch.mass @ found.pressure == pytest.approx(force, rel=1e-9)
    for quantity in (found.strain, found.curvature, found.reading):
        assert quantity[:2] == pytest.approx(quantity[:2:-1], rel=1e-10)
    assert found.strain[2] > 0 > found.strain[1], "the skin is stretched below the contact and compressed beside it"
    assert found.reading == pytest.approx(1e6 * found.strain), "gain 1 and lever 0 until a finger is identified"
    mean = found.reading.mean()
    assert found.sd == pytest.approx(np.sqrt(((found.reading - mean) ** 2).sum() / 5)), "population, not sample"
    by_depth = press(reference, BLOCK, indentation=found.indentation, fidelity=fidelity)
    assert by_depth.indentation == pytest.approx(found.indentation, rel=1e-9)
    assert [by_depth.force, *by_depth.reading] == pytest.approx([force, *found.reading], rel=1e-8)


def test_gains_and_levers_make_the_reading(reference):
    gains, levers = np.array([1.0, 2, 0.5, -1, 1]), np.array([0.0, -1, 0.3, 0.2, 1])
    finger = dataclasses.replace(reference, weights=np.array([gains, levers]))
    found, plain = press(finger, BLOCK, force=0.3), press(reference, BLOCK, force=0.3)
    assert found.strain == pytest.approx(plain.strain) and found.curvature == pytest.approx(plain.curvature)
    assert found.reading == pytest.approx(1e6 * (gains * plain.strain + levers * plain.curvature))


@pytest.mark.parametrize("fidelity", ["hertz", "contact"])
def test_limits_of_the_specimens(reference, fidelity, force=0.4):
    flat = press(reference, HalfSpace(0.2), force=force, fidelity=fidelity)
    for specimen, tolerance in ((Block(0.2, 1000), 2e-3), (Sphere(0.2, 1e5), 2e-3), (Block(0.2, 1e5), 2e-5)):
        found = press(reference, specimen, force=force, fidelity=fidelity)
        for name in ("sd", "indentation", "contact_area", "peak_pressure"):
            assert getattr(found, name) == pytest.approx(getattr(flat, name), rel=tolerance)
    thin = press(reference, Block(0.2, 2), force=force, fidelity=fidelity)
    ball = press(reference, Sphere(0.2, 20), force=force, fidelity=fidelity)
    assert thin.indentation < flat.indentation < ball.indentation
    assert thin.contact_area < flat.contact_area, "a thin block is a hard one"
    assert ball.contact_area < flat.contact_area and ball.peak_pressure > flat.peak_pressure


@pytest.mark.slow
@pytest.mark.parametrize("indentation", [0.5, 1.2])
def test_a_ball_is_a_sphere_and_not_a_paraboloid(disc, stand_in, indentation):
    """A hard ball of 6 mm on a flat half-space: Hertz's force is 1 and 2 % too large, the exact sphere's is met."""
    flat = stand_in(disc(4.0, 24), 0.2)
    found = press(flat, Sphere(1e6, 6.0), indentation=indentation, fidelity="contact")
    # Sneddon (1965), doi:10.1016/0020-7225(65)90019-4
    a = brentq(lambda a: a * math.atanh(a / 6.0) - indentation, 0.1, 5.9)
    exact = 0.2 * ((a * a + 36.0) * math.atanh(a / 6.0) - 6.0 * a)
    assert found.force == pytest.approx(exact, rel=0.003)


@pytest.mark.parametrize("tolerance", [1e-6, 0.02, 0.05, 0.5])
@pytest.mark.parametrize("modulus, force", [(0.05, 0.2), (0.51, 0.08), (0.51, 0.6)])
def test_auto_keeps_its_tolerance_and_says_why(reference, modulus, force, tolerance):
    """The measured error bounds the true one between the forces where it was measured, up to a tenth."""
    specimen = Block(modulus, 10)
    found = press(reference, specimen, force=force, tolerance=tolerance)
    truth = press(reference, specimen, force=force, fidelity="contact")
    for name in ("sd", "indentation", "contact_area"):
        assert getattr(found, name) == pytest.approx(getattr(truth, name), rel=max(1.1 * tolerance, 1e-12))
    assert found.status.startswith(f"{found.fidelity}: ")
    if found.fidelity == "hertz":
        assert f", within {100 * tolerance:g} %" in found.status
    assert tolerance > 1e-6 or found.fidelity == "contact"
    assert tolerance < 0.5 or found.fidelity == "hertz"


@pytest.mark.parametrize("force", [1e-4, 5e-3])
def test_a_press_too_light_for_the_mesh_says_so(reference, force):
    found = press(reference, BLOCK, force=force, fidelity="contact")
    assert not found.resolved
    assert found.status.startswith("mesh too coarse for this light press: a contact radius of ")
    assert "mesh with size_mm <= " in found.status
    auto = press(reference, BLOCK, force=force)
    assert auto.fidelity == "hertz" and auto.force == force
    assert "the contact is smaller than this mesh resolves" in auto.status
    assert auto.sd == press(reference, BLOCK, force=force, fidelity="hertz").sd


@pytest.mark.parametrize(
    "values, message",
    [
        ({"force": -1.0}, r"force \(N\) must be greater than 0, got -1"),
        ({"force": np.nan}, r"force \(N\) must be finite, got nan"),
        ({"force": "0.1"}, r"force \(N\) must be a number, got '0.1'"),
        ({"indentation": np.inf}, r"indentation \(mm\) must be finite, got inf"),
        ({}, "give exactly one of force and indentation"),
        ({"force": 1.0, "indentation": 1.0}, "give exactly one of force and indentation"),
        ({"force": 1.0, "fidelity": "finest"}, "fidelity must be one of hertz, contact or auto, got 'finest'"),
        ({"force": 1.0, "tolerance": 0}, "tolerance must be greater than 0, got 0"),
        ({"force": 1.0, "specimen": Grating(1.0, 1.0, 0.5)}, "takes a HalfSpace, .* or another Specimen, got Grating"),
    ],
)
def test_unusable_values(reference, values, message):
    with pytest.raises(InputError, match=message):
        press(reference, **{"specimen": BLOCK, **values})


def test_a_slab_is_pressed_along_a_line(tmp_path, monkeypatch):
    """Its skin is flat along y: the hertz rung refuses, `auto` answers by contact and keeps what was asked."""
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path))
    slab = Slab((24.0, 20.0), (21.0, 17.0), (10.0, 6.0), 10.0)
    finger = dataclasses.replace(Finger.default(), shape=slab)
    reduced = FingerModel(finger, build(finger, size_mm=1.4)).reduce()
    with pytest.raises(ContactRangeError, match="hertz fidelity needs a "):
        press(reduced, BLOCK, force=0.3, fidelity="hertz")
    found = press(reduced, BLOCK, force=0.3)
    assert found.fidelity == "contact" and found.resolved and found.force_balance <= 1e-9
    assert found.reading[:2] == pytest.approx(found.reading[:2:-1], rel=1e-10)
    light = press(reduced, BLOCK, indentation=0.05)
    assert light.fidelity == "contact" and light.indentation == 0.05 and not light.resolved


class MeasuredBall(Specimen):
    """A rigid ball of 20 mm whose profile is a table over the distance from its tip, as of a measurement."""

    distance = np.linspace(0, 14, 400)

    def gap(self, points):
        return np.interp(np.hypot(*points.T), self.distance, 20.0 - np.sqrt(20.0**2 - self.distance**2))

    def compliance(self, surface):
        return 0 * surface.half_space

    @property
    def contact_modulus(self):
        return np.inf


def test_a_measured_indenter_presses_as_the_ball_that_it_is_and_has_no_hertz(reference):
    measured = MeasuredBall(1e6)
    for force in (0.05, 0.5):
        found, ball = (contact_press(reference, one, (force, None), 0.0) for one in (measured, Sphere(1e6, 20.0)))
        assert found.indentation == pytest.approx(ball.indentation, rel=1e-3)
        assert found.reading == pytest.approx(ball.reading, rel=1e-3, abs=1e-3 * np.abs(ball.reading).max())
    with pytest.raises(ContactRangeError, match="needs a specimen with a curvature; a MeasuredBall has none"):
        press(reference, measured, force=0.1, fidelity="hertz")
    for force in (0.5, 1e-3):
        found = press(reference, measured, force=force)
        assert found.fidelity == "contact" and found.resolved == (force > 0.1)


@dataclass(frozen=True)
class Wedge(Block):
    """A block that is turned about y by a slope."""

    slope_x: float = 0.02

    def gap(self, points):
        return self.slope_x * points[:, 0]


def test_a_specimen_without_symmetry_is_not_mirrored(reference, coarse_model):
    with pytest.raises(InputError, match=r"not symmetric about x and y does not fit a finger reduced at its apex"):
        press(reference, Wedge(0.5, 10), force=0.3, fidelity="contact")
    whole = coarse_model.reduce((1e-6, 1e-6))
    found, flat = (press(whole, one, force=0.3, fidelity="contact") for one in (Wedge(0.5, 10), Block(0.5, 10)))
    assert whole.patch.mass @ (found.pressure * whole.patch.xy[:, 0]) < -0.3 * 0.2, "it is felt where it comes nearer"
    assert np.abs(found.reading - found.reading[::-1]).max() > 10 * np.abs(flat.reading - flat.reading[::-1]).max()
