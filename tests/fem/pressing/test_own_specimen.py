"""A user's own specimen: it says its gap and what else differs from a flat half-space, and every fidelity takes it."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from papilla.core.errors import ContactRangeError, InputError
from papilla.fem import FingerModel, press, press_finite
from papilla.fem.pressing.contact import contact_press
from papilla.mesh import build
from papilla.model.finger import Finger
from papilla.model.specimen import Block, HalfSpace, Specimen, Sphere


@dataclass(frozen=True)
class CurvedBlock(Block):
    """A bonded block whose face is a cylinder of `radius` mm along y."""

    radius: float = 50.0

    def gap(self, points):
        return points[:, 0] ** 2 / (2 * self.radius)

    @property
    def curvature(self):
        return 1 / self.radius, 0.0


@dataclass(frozen=True)
class SteppedBlock(Block):
    """A bonded block that is `step` mm lower beside a bar of half `width` mm along y."""

    width: float = 3.0
    step: float = 0.5

    def gap(self, points):
        return np.where(np.abs(points[:, 0]) < self.width, 0.0, self.step)


@dataclass(frozen=True, eq=False)
class MeasuredIndenter(Specimen):
    """A rigid indenter whose profile (mm) over the distance from its tip (mm) was measured."""

    distance: np.ndarray = field(default_factory=lambda: np.zeros(1))
    height: np.ndarray = field(default_factory=lambda: np.zeros(1))

    def __post_init__(self):
        """Arrays are not checked as numbers are."""

    def gap(self, points):
        return np.interp(np.hypot(*points.T), self.distance, self.height)

    def compliance(self, surface):
        return 0 * surface.half_space

    @property
    def contact_modulus(self):
        return np.inf


def measured(ball: float) -> MeasuredIndenter:
    distance = np.linspace(0, 14, 400)
    return MeasuredIndenter(1e6, distance, ball - np.sqrt(ball**2 - distance**2))


@pytest.mark.parametrize("force", [0.05, 0.5])
def test_a_measured_indenter_presses_as_the_ball_that_it_is(reference, force):
    found, ball = (contact_press(reference, one, (force, None), 0.0) for one in (measured(20.0), Sphere(1e6, 20.0)))
    assert found.indentation == pytest.approx(ball.indentation, rel=1e-3)
    assert found.reading == pytest.approx(ball.reading, rel=1e-3, abs=1e-3 * np.abs(ball.reading).max())
    assert found.modulus == 1e6


def test_what_is_kept_of_one_specimen_is_not_taken_for_another(reference):
    blunt, sharp = (press(reference, measured(ball), force=0.3, fidelity="contact") for ball in (40.0, 15.0))
    assert sharp.contact_area < 0.8 * blunt.contact_area
    assert CurvedBlock(0.5, 10, radius=30.0) == CurvedBlock(0.5, 10, radius=30.0) != CurvedBlock(0.5, 10, radius=31.0)
    assert Block(0.5, 10) != HalfSpace(0.5) and hash(Block(0.5, 10)) == hash(Block(0.5, 10.0))


@dataclass(frozen=True)
class Wedge(Block):
    """A block that is turned about y by a slope."""

    slope_x: float = 0.02

    def gap(self, points):
        return self.slope_x * points[:, 0]


@pytest.mark.slow
def test_a_specimen_without_symmetry_is_not_mirrored(reference):
    with pytest.raises(InputError, match=r"not symmetric about x and y does not fit a finger reduced at its apex"):
        press(reference, Wedge(0.5, 10), force=0.3, fidelity="contact")
    whole = FingerModel(Finger.default(), build(Finger.default(), size_mm=2.0)).reduce((1e-6, 1e-6))
    found, flat = (press(whole, one, force=0.3, fidelity="contact") for one in (Wedge(0.5, 10), Block(0.5, 10)))
    assert whole.patch.mass @ (found.pressure * whole.patch.xy[:, 0]) < -0.3 * 0.2, "it is felt where it comes nearer"
    assert np.abs(found.reading - found.reading[::-1]).max() > 10 * np.abs(flat.reading - flat.reading[::-1]).max()


@pytest.mark.slow
def test_a_block_that_slides_on_its_table_is_softer(reference):
    bonded, sliding = Block(0.1, 10), Block(0.1, 10, bonded=False)
    found = [press(reference, one, force=0.98, fidelity="contact") for one in (bonded, sliding)]
    assert 1.01 < found[1].indentation / found[0].indentation < 1.2 and found[1].sd < found[0].sd
    thick = [press(reference, Block(0.1, 2000, bonded=one), force=0.3, fidelity="contact").sd for one in (True, False)]
    assert thick[0] == pytest.approx(thick[1], rel=1e-3)
    with pytest.raises(InputError, match="friction needs a block that is bonded"):
        press(reference, sliding, force=0.3, friction=0.5, fidelity="contact")


def test_without_a_curvature_hertz_refuses_and_auto_takes_contact(reference):
    with pytest.raises(ContactRangeError, match="needs a specimen with a curvature; a MeasuredIndenter has none"):
        press(reference, measured(20.0), force=0.1, fidelity="hertz")
    found = press(reference, measured(20.0), force=0.5)
    assert found.fidelity == "contact" and found.resolved
    light = press(reference, measured(20.0), force=1e-3)
    assert light.fidelity == "contact" and not light.resolved


@pytest.mark.parametrize("force", [0.05, 0.3])
def test_a_curved_block_presses_deeper_on_less_area(reference, force):
    flat, wide, narrow = (
        press(reference, specimen, force=force, fidelity="contact")
        for specimen in (Block(0.51, 10), CurvedBlock(0.51, 10, radius=100.0), CurvedBlock(0.51, 10, radius=30.0))
    )
    assert flat.indentation < wide.indentation < narrow.indentation
    assert flat.contact_area > wide.contact_area > narrow.contact_area
    gentle = press(reference, CurvedBlock(0.51, 10, radius=1e7), force=force, fidelity="contact")
    assert gentle.sd == pytest.approx(flat.sd, rel=1e-4)
    hertz = press(reference, CurvedBlock(0.51, 10, radius=100.0), force=force, fidelity="hertz")
    assert hertz.sd == pytest.approx(wide.sd, rel=0.02) and hertz.indentation == pytest.approx(
        wide.indentation, rel=0.02
    )


def test_a_step_shows_only_when_the_contact_reaches_it(reference):
    for force, same in ((0.05, True), (0.8, False)):
        flat, stepped = (
            contact_press(reference, one, (force, None), 0.0) for one in (Block(0.51, 10), SteppedBlock(0.51, 10))
        )
        assert (stepped.indentation == pytest.approx(flat.indentation, rel=1e-9)) == same
    x = np.abs(reference.patch.xy[stepped.active, 0])
    assert stepped.indentation > 1.02 * flat.indentation and x.max() < np.abs(reference.patch.xy[flat.active, 0]).max()


def test_limits_of_the_kind_are_inherited(reference):
    with pytest.raises(ContactRangeError, match="mm off a block of 1 mm: more than 50 % is beyond the model"):
        press(reference, CurvedBlock(0.005, 1.0, 0.3), force=0.3, fidelity="contact")
    with pytest.raises(ContactRangeError, match="too coarse for a block 0.001 mm thick"):
        press(reference, SteppedBlock(0.5, 0.001), force=0.3, fidelity="contact")


@pytest.mark.slow
def test_finite_strain_takes_them_too(dome):
    finger = Finger.default()
    mesh = dome(finger)
    ball, flat = (press_finite(finger, mesh, one, force=0.2) for one in (Sphere(1e6, 20.0), HalfSpace(1e6)))
    found = press_finite(finger, mesh, measured(20.0), force=0.2)
    assert found.indentation == pytest.approx(ball.indentation, rel=2e-3) and found.fidelity == "finite"
    assert found.indentation > 1.2 * flat.indentation


def test_slopes_are_those_of_the_gap():
    points = np.random.default_rng(3).uniform(-5, 5, (20, 2))
    for specimen in (HalfSpace(1.0), Sphere(1.0, 9.0), CurvedBlock(1.0, 10)):
        step = 1e-5
        sides = [specimen.gap(points + step * axis) - specimen.gap(points - step * axis) for axis in np.eye(2)]
        assert specimen.slope(points) == pytest.approx(np.stack(sides, axis=1) / (2 * step), abs=1e-7)
    ball = Sphere(1.0, 2.0)
    assert (ball.gap(np.array([[3.0, 0.0]])) > 100).all() and (ball.slope(np.array([[3.0, 0.0]])) == 0).all()
    assert ball.gap(np.array([[1e-9, 0.0]])) == pytest.approx(0.25e-18, rel=1e-9), "no cancellation near the tip"


def test_big_objects_have_a_short_repr(reference, reference_model):
    texts = [repr(reference), repr(press(reference, Block(0.51, 10), force=0.3)), repr(reference_model)]
    assert all(len(text) < 400 for text in texts), texts
    assert "0.3 N" in texts[1] and "156 nodes" in texts[0] and "Taylor-Hood" in texts[2]


@dataclass(frozen=True)
class SaggingBlock(Block):
    """A bonded block whose surface sags by its own weight: the softer it is, the rounder."""

    def gap(self, points):
        return 1e-4 / self.modulus * (points**2).sum(axis=1)


@pytest.mark.parametrize("friction", [0, "stick"])
def test_a_gap_that_depends_on_the_modulus_is_that_of_the_specimens_own(reference, friction):
    """Presses take compliances from the specimen of 1 MPa, whose gap here is twenty times as flat."""
    sagging, same = SaggingBlock(0.05, 10.0), RoundBlock(0.05, 10.0)
    one, other = (
        press(reference, block, force=0.3, fidelity="contact", friction=friction) for block in (sagging, same)
    )
    flat = press(reference, Block(0.05, 10.0), force=0.3, fidelity="contact", friction=friction)
    assert one.indentation == pytest.approx(other.indentation, rel=1e-12)
    assert one.indentation > 1.01 * flat.indentation


@dataclass(frozen=True)
class RoundBlock(Block):
    """The same of 0.05 MPa, said without the modulus."""

    def gap(self, points):
        return 2e-3 * (points**2).sum(axis=1)


@dataclass(frozen=True)
class Stiffening(Block):
    """A block whose compliance is not proportional to 1 / modulus."""

    def compliance(self, surface):
        return surface.half_space / (1 + self.modulus**2)


@pytest.mark.parametrize("specimen", [HalfSpace(0.5), Stiffening(2.0, 10), Stiffening(3.0, 10), Block(0.2, 10)])
def test_a_surface_moves_by_its_compliance_times_the_pressure(disc, stand_in, specimen):
    finger = stand_in(disc(5.0, 4, lambda x, y: x**2 / 40 + y**2 / 40), 0.2)
    pressure = np.linspace(0.0, 0.1, len(finger.patch.xy))
    expected = finger.specimen_compliance(specimen) @ pressure
    assert finger.specimen_displacement(specimen, pressure) == pytest.approx(expected, rel=1e-12)
    if isinstance(specimen, Stiffening):
        assert expected == pytest.approx(finger.half_space @ pressure / (1 + specimen.modulus**2))
