"""A user's own specimen: it says its gap and what else differs from a flat half-space, and every fidelity takes it."""

from dataclasses import dataclass

import numpy as np
import pytest

from papilla.core.errors import ContactRangeError, InputError
from papilla.fem import press
from papilla.fem.pressing.contact import contact_press
from papilla.model.specimen import Block, Specimen, Sphere


@dataclass(frozen=True)
class CurvedBlock(Block):
    """A bonded block whose face is a cylinder of `radius` mm along y."""

    radius: float = 50.0

    def gap(self, points):
        return points[:, 0] ** 2 / (2 * self.radius)

    @property
    def curvature(self):
        return 1 / self.radius, 0.0


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


MEASURED = MeasuredBall(1e6)


@pytest.mark.parametrize("force", [0.05, 0.5])
def test_a_measured_indenter_presses_as_the_ball_that_it_is(reference, force):
    found, ball = (contact_press(reference, one, (force, None), 0.0) for one in (MEASURED, Sphere(1e6, 20.0)))
    assert found.indentation == pytest.approx(ball.indentation, rel=1e-3)
    assert found.reading == pytest.approx(ball.reading, rel=1e-3, abs=1e-3 * np.abs(ball.reading).max())


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


def test_without_a_curvature_hertz_refuses_and_auto_takes_contact(reference):
    with pytest.raises(ContactRangeError, match="needs a specimen with a curvature; a MeasuredBall has none"):
        press(reference, MEASURED, force=0.1, fidelity="hertz")
    found = press(reference, MEASURED, force=0.5)
    assert found.fidelity == "contact" and found.resolved
    light = press(reference, MEASURED, force=1e-3)
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
    assert (hertz.sd, hertz.indentation) == pytest.approx((wide.sd, wide.indentation), rel=0.02)
