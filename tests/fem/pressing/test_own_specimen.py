"""A user's own specimen: it says its gap and what else differs from a flat half-space, and every fidelity takes it."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from papilla.core.errors import ContactRangeError, InputError
from papilla.fem import FingerModel, press
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


def test_slopes_are_those_of_the_gap():
    points = np.random.default_rng(3).uniform(-5, 5, (20, 2))
    for specimen in (HalfSpace(1.0), Sphere(1.0, 9.0), CurvedBlock(1.0, 10)):
        step = 1e-5
        sides = [specimen.gap(points + step * axis) - specimen.gap(points - step * axis) for axis in np.eye(2)]
        assert specimen.slope(points) == pytest.approx(np.stack(sides, axis=1) / (2 * step), abs=1e-7)
    ball = Sphere(1.0, 2.0)
    assert (ball.gap(np.array([[3.0, 0.0]])) > 100).all() and (ball.slope(np.array([[3.0, 0.0]])) == 0).all()
    assert ball.gap(np.array([[1e-9, 0.0]])) == pytest.approx(0.25e-18, rel=1e-9), "no cancellation near the tip"
