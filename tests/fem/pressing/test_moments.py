"""Contact area and peak pressure from the moments of a nodal pressure."""

import numpy as np
import pytest

from papilla.fem.pressing.contact import contact_shape
from papilla.fem.pressing.contact_path import ContactProblem
from papilla.fem.pressing.contact_step import contact_step, first_touch
from papilla.fem.reduction.compliance import half_space_compliance
from papilla.references import hertz_ellipse


def pressure_of(patch, force):
    problem = ContactProblem(half_space_compliance(patch), patch.mass, patch.gap)
    return contact_step(problem, first_touch(problem), force=force).traction[0]


@pytest.mark.parametrize("angle", [0.0, 30.0, 45.0, -70.0])
def test_an_ellipse_off_the_middle_and_turned(disc, angle):
    """Off-centre contact: no plane of symmetry, and the middle is not where the specimen touched down."""
    exact, turn = hertz_ellipse(1.5, 6.0, 14.0, 1.0), np.radians(angle)

    def gap(x, y):
        x, y = x - 0.5, y + 0.3
        along, across = np.cos(turn) * x + np.sin(turn) * y, -np.sin(turn) * x + np.cos(turn) * y
        return along**2 / 12 + across**2 / 28

    patch = disc(3.5, 14, gap, quarter=False)
    shape = contact_shape(patch, pressure_of(patch, 1.5))
    assert shape.elliptic
    assert shape.area == pytest.approx(exact.area, rel=0.03)
    assert shape.peak_pressure == pytest.approx(exact.peak_pressure, rel=0.03)


@pytest.mark.parametrize("q", [-0.8, -0.3, 0.4, 0.7])
def test_the_layer_term_is_recovered(disc, q):
    """F/(pi a b) [(1 - q) 3/2 t + q 5/2 t^3], t = sqrt(1 - r^2/a^2): flatter or more pointed than Hertz's."""

    def profile(t):
        return 0.1 * ((1 - q) * 1.5 * t + q * 2.5 * t**3)

    patch = disc(4.0, 30)
    shape = contact_shape(patch, profile(np.sqrt(np.maximum(0, 1 - (patch.xy**2).sum(axis=1) / 9))))
    assert shape.elliptic
    assert shape.area == pytest.approx(np.pi * 9, rel=0.02)
    assert shape.peak_pressure == pytest.approx(profile(np.linspace(0, 1, 100_001)).max(), rel=0.02)


@pytest.mark.parametrize("half_length", [2.0, 3.0])
def test_a_line_contact_is_no_ellipse_though_its_low_moments_are(disc, half_length):
    """Hertz's line contact of a slab, 2 mm wide: the ellipse of the same moments is a third too large."""
    patch = disc(4.0, 24)
    x, y = patch.xy.T
    pressure = np.sqrt(np.maximum(0, 1 - x**2)) * (np.abs(y) < half_length)
    shape = contact_shape(patch, pressure)
    assert not shape.elliptic
    assert shape.area == pytest.approx(4 * half_length, rel=0.05)
    assert shape.peak_pressure == 1
