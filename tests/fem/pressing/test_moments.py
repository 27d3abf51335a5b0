"""Contact area and peak pressure from the moments of a nodal pressure."""

import numpy as np
import pytest

from papilla.fem.pressing.contact import contact_shape
from papilla.fem.pressing.contact_path import ContactProblem
from papilla.fem.pressing.contact_step import contact_step, first_touch
from papilla.fem.reduction.compliance import half_space_compliance
from papilla.references import HertzContact, hertz_ellipse


def pressure_of(patch, force):
    problem = ContactProblem(half_space_compliance(patch), patch.mass, patch.gap)
    return contact_step(problem, first_touch(problem), force=force).traction[0]


@pytest.mark.slow
@pytest.mark.parametrize("radii", [(10.0, 10.0), (6.0, 16.0), (14.0, 7.0)])
def test_pressure_of_a_hertzian_contact(disc, radii):
    rx, ry = radii
    exact = hertz_ellipse(1.5, rx, ry, 1.0)
    patch = disc(3.5, 24, lambda x, y: x**2 / (2 * rx) + y**2 / (2 * ry))
    shape = contact_shape(patch, pressure_of(patch, 1.5 / 4))
    assert shape.elliptic
    assert shape.area == pytest.approx(exact.area, rel=0.01)
    assert shape.peak_pressure == pytest.approx(exact.peak_pressure, rel=0.01)


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


def test_scaling_and_units(disc):
    patch = disc(4.0, 12)
    pressure = HertzContact(0.7, 0.1, 2.0, 3.0).pressure(*patch.xy.T)
    shape, scaled = contact_shape(patch, pressure), contact_shape(patch, 1e-9 * pressure)
    assert scaled.area == pytest.approx(shape.area, rel=1e-12)
    assert scaled.peak_pressure == pytest.approx(1e-9 * shape.peak_pressure, rel=1e-12)


def test_a_quarter_reads_as_the_whole(disc):
    patches = disc(4.0, 10), disc(4.0, 10, quarter=False)
    # The moments agree to rounding; the mean element size counts nodes of the planes once or four times
    shapes = [contact_shape(p, HertzContact(0.7, 0.1, 1.5, 2.5).pressure(*p.xy.T)) for p in patches]
    assert shapes[0].area == pytest.approx(shapes[1].area, rel=2e-3)
    assert shapes[0].peak_pressure == pytest.approx(shapes[1].peak_pressure, rel=2e-3)


@pytest.mark.parametrize("quarter", [True, False])
def test_a_line_contact_is_counted(disc, quarter):
    """A stripe along the whole patch, as on a slab, is no ellipse: nodes are counted, and the shape says so."""
    patch = disc(4.0, 12, quarter=quarter)
    pressure = np.where(np.abs(patch.xy[:, 0]) < 0.5, 0.2, 0.0)
    shape = contact_shape(patch, pressure)
    assert not shape.elliptic
    assert shape.area == pytest.approx((1 if not quarter else 4) * patch.mass[pressure > 0].sum())
    assert shape.peak_pressure == 0.2


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


def test_a_square_is_no_ellipse_though_its_low_moments_are(disc):
    """A flat square punch presses hardest near its edge; the ellipse of the same moments is a tenth too large."""
    patch = disc(4.0, 40)
    square = 1 - ((patch.xy / 2) ** 8).sum(axis=1)
    shape = contact_shape(patch, np.maximum(0, square) ** 0.25)
    assert not shape.elliptic
    assert shape.area == pytest.approx(15.66, rel=0.03)


@pytest.mark.parametrize("radius, elliptic", [(3.9, True), (4.2, False)])
def test_an_ellipse_that_the_outline_cuts_off_is_none(disc, radius, elliptic):
    patch = disc(4.0, 20)
    shape = contact_shape(patch, np.sqrt(np.maximum(0, 1 - (patch.xy**2).sum(axis=1) / radius**2)))
    assert shape.elliptic == elliptic
    assert shape.area == pytest.approx(np.pi * min(radius, 4.0) ** 2, rel=0.03)


def rings(patch):
    return np.where(np.hypot(*patch.xy.T) > 3.0, 1.0, 0.0)


def dot_in_a_ring(patch):
    distance = np.hypot(*patch.xy.T)
    return np.where(distance < 1, 2.0, 0.0) + np.where(distance > 2.6, 0.4, 0.0)


def two_spots(patch):
    return np.exp(-((np.abs(patch.xy[:, 0]) - 2) ** 2 + patch.xy[:, 1] ** 2) / 0.3)


@pytest.mark.parametrize("pressure", [rings, dot_in_a_ring, two_spots])
def test_other_shapes_are_counted(disc, pressure):
    patch = disc(4.0, 16)
    shape = contact_shape(patch, pressure(patch))
    assert not shape.elliptic
    assert shape.area == pytest.approx(4 * patch.mass[pressure(patch) > 0].sum())
