"""Gauge functionals on the exact interface: what they must ignore, and what they must return."""

import dataclasses

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.fem.reduction.gauges import curvature_functional, gauge_frame, gauge_site, strain_functional
from papilla.mesh.body import surfaces_of
from papilla.model.finger import Finger, Gauge, Slab

FINGER = Finger.default()
INTERFACE = surfaces_of(FINGER)["interface"]
GAUGES = (
    *FINGER.gauges,
    Gauge("turned", angle_deg=25.0, y_mm=6.0, direction_deg=35.0),
    Gauge("across", x_mm=-4.0, y_mm=-9.0, direction_deg=90.0, length_mm=1.0, backing_mm=(3.0, 1.5)),
)
each_gauge = pytest.mark.parametrize("gauge", GAUGES, ids=lambda gauge: gauge.name)


def both(gauge):
    frame = gauge_frame(FINGER, gauge, INTERFACE)
    return strain_functional(gauge, frame, INTERFACE), curvature_functional(gauge, frame, INTERFACE), frame


def value(functional, field):
    return float((functional.weights * field(functional.points)).sum())


@each_gauge
def test_rigid_motions_are_not_read(gauge):
    strain, curvature, _ = both(gauge)
    for k in range(3):
        axis = np.eye(3)[k]
        assert value(strain, lambda x, axis=axis: np.tile(axis, (len(x), 1))) == pytest.approx(0, abs=1e-14)
        assert value(curvature, lambda x, axis=axis: np.tile(axis, (len(x), 1))) == pytest.approx(0, abs=1e-13)
        assert value(strain, lambda x, axis=axis: np.cross(axis, x)) == pytest.approx(0, abs=1e-13)
        assert value(curvature, lambda x, axis=axis: np.cross(axis, x)) == pytest.approx(0, abs=1e-12)


@each_gauge
def test_uniform_strain_is_read_along_the_grid(gauge):
    strain, _, frame = both(gauge)
    assert value(strain, lambda x: 0.01 * x) == pytest.approx(0.01, rel=1e-12)
    tensor = np.array([[0.03, 0.01, -0.02], [0.01, -0.01, 0.015], [-0.02, 0.015, 0.02]])
    ends = strain.points
    grid = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    # Lines across a curved interface are not parallel
    assert value(strain, lambda x: x @ tensor) == pytest.approx(grid @ tensor @ grid, abs=3e-4)
    # The chord between two points of the curved interface is the grid's direction, nearly
    assert grid @ frame.along == pytest.approx(1, abs=2e-3)


@each_gauge
def test_strain_is_the_mean_over_length_and_width(gauge):
    """A strain that grows as t^2 across the grid is width^2 / 12 of it in the mean, and nothing at its middle line."""
    strain, _, frame = both(gauge)

    def field(x):
        s, t = (x - frame.site) @ frame.along, (x - frame.site) @ frame.across
        return (s * t**2)[:, None] * frame.along

    assert value(strain, field) == pytest.approx(gauge.width_mm**2 / 12, rel=2e-2)


@each_gauge
def test_grid_and_backing_lie_on_the_interface(gauge):
    strain, curvature, frame = both(gauge)
    for functional in (strain, curvature):
        assert np.abs(INTERFACE.level(functional.points)).max() < 1e-10
    ends = (strain.points - frame.site) @ np.column_stack([frame.along, frame.across])
    assert ends[:, 0] == pytest.approx(3 * [-gauge.length_mm / 2, gauge.length_mm / 2], rel=1e-12)
    assert ends[::2, 1] == pytest.approx(gauge.width_mm * np.sqrt(0.15) * np.array([-1, 0, 1]), abs=1e-12)
    spread = (curvature.points - frame.site) @ np.column_stack([frame.along, frame.across])
    assert np.ptp(spread, axis=0) == pytest.approx(gauge.backing_mm, rel=1e-9)
    steps = [np.unique(column.round(9)) for column in spread.T]
    assert [len(one) for one in steps] == [9, 5] and len(spread) == 45, "a grid of points, even in both directions"
    assert all(np.ptp(np.diff(one)) < 1e-8 for one in steps)


@each_gauge
def test_a_quadratic_displacement_has_its_curvature_along_the_grid(gauge):
    _, curvature, frame = both(gauge)

    def bend(along, across, mixed):
        def field(x):
            s, t = (x - frame.site) @ frame.along, (x - frame.site) @ frame.across
            return (along * s**2 / 2 + across * t**2 / 2 + mixed * s * t)[:, None] * frame.normal

        return field

    assert value(curvature, bend(0.04, 0, 0)) == pytest.approx(0.04, rel=1e-10)
    assert value(curvature, bend(0, 0.04, 0)) == pytest.approx(0, abs=1e-12)
    assert value(curvature, bend(0, 0, 0.04)) == pytest.approx(0, abs=1e-12)
    assert value(curvature, bend(0.04, -0.3, 0.7)) == pytest.approx(0.04, rel=1e-9)


def test_directions_turn_from_x_towards_y():
    def along(direction, angle=0.0):
        return gauge_frame(FINGER, Gauge("g", angle_deg=angle, direction_deg=direction), INTERFACE).along

    assert along(0) == pytest.approx([1, 0, 0], abs=1e-15)
    assert along(90) == pytest.approx([0, 1, 0], abs=1e-15)
    assert along(30) == pytest.approx([np.cos(np.pi / 6), 0.5, 0], abs=1e-15)
    assert along(0, angle=40)[2] < 0 < along(0, angle=40)[0], "down the far side"
    for angle in (-40, 10, 80):
        assert along(0, angle)[1] == 0
        assert np.linalg.norm(along(17, angle)) == pytest.approx(1)


@each_gauge
def test_frames_are_right_handed_and_point_out(gauge):
    frame = gauge_frame(FINGER, gauge, INTERFACE)
    assert np.cross(frame.along, frame.across) == pytest.approx(frame.normal, abs=1e-14)
    assert frame.normal == pytest.approx(INTERFACE.normal(frame.site[None])[0])
    # Flattened: the middle sinks, the ends stay, and the outward displacement curves upwards
    functional = curvature_functional(gauge, frame, INTERFACE)
    assert value(functional, lambda x: ((x - frame.site) ** 2).sum(axis=1)[:, None] * frame.normal) > 0


def test_sites_follow_the_ellipse_parameter():
    for gauge in FINGER.gauges:
        site = gauge_site(FINGER, gauge, INTERFACE)
        angle = np.radians(gauge.angle_deg)
        assert site == pytest.approx([21 * np.sin(angle), 0, 17 * np.cos(angle)], abs=1e-12)
    off = gauge_site(FINGER, Gauge("g", angle_deg=30.0, y_mm=10.0), INTERFACE)
    shrink = np.sqrt(1 - (10 / 27) ** 2)
    assert off == pytest.approx([21 * shrink / 2, 10, 17 * shrink * np.cos(np.pi / 6)], abs=1e-12)
    by_x = gauge_site(FINGER, Gauge("g", x_mm=float(off[0]), y_mm=10.0), INTERFACE)
    assert by_x == pytest.approx(off, abs=1e-12)
    slab = dataclasses.replace(FINGER, shape=Slab((24.0, 20.0), (21.0, 17.0), (10.0, 6.0), 10.0))
    at = gauge_site(slab, Gauge("g", angle_deg=30.0, y_mm=2.0), surfaces_of(slab)["interface"])
    assert at == pytest.approx([10.5, 2, 17 * np.cos(np.pi / 6)], abs=1e-12)


def test_mirrored_gauges_read_mirrored_fields_alike():
    random = np.random.default_rng(5)
    linear, square = random.standard_normal((3, 3)), random.standard_normal((3, 3, 3)) / 20

    def field(x):
        return x @ linear + np.einsum("ki,kj,ijm->km", x, x, square)

    def mirror(x):
        return x * [-1, 1, 1]

    for gauge, image in ((FINGER.gauges[1], FINGER.gauges[3]), (FINGER.gauges[0], FINGER.gauges[4])):
        for here, there in zip(both(gauge)[:2], both(image)[:2], strict=True):
            assert value(here, field) == pytest.approx(value(there, lambda x: mirror(field(mirror(x)))), rel=1e-10)


def test_a_gauge_off_the_interface_is_refused():
    """An interface smaller than the finger says, as a surface file may be."""
    small = surfaces_of(dataclasses.replace(FINGER, gauges=(Gauge("g", x_mm=0.0),)))["bone"]
    with pytest.raises(InputError, match="gauge far lies outside the interface: nothing at x 12, y 0 mm"):
        gauge_site(FINGER, Gauge("far", x_mm=12.0), small)


def test_a_gauge_that_was_moved_lies_as_far_along_the_interface():
    """Arc lengths of a dense polygon through the section; moved there and back it is where it was."""
    gauge = Gauge("g", angle_deg=20.0, y_mm=2.0)
    start = gauge_site(FINGER, gauge, INTERFACE)
    along = gauge_site(FINGER, dataclasses.replace(gauge, moved_mm=(1.5, 0.0)), INTERFACE)
    assert along[1] == 2.0 and along[0] > start[0]
    x = np.linspace(start[0], along[0], 500)
    z = INTERFACE.height(np.column_stack([x, np.full(500, 2.0)]))
    assert np.hypot(np.diff(x), np.diff(z)).sum() == pytest.approx(1.5, rel=1e-3)
    across = gauge_site(FINGER, dataclasses.replace(gauge, moved_mm=(0.0, -1.5)), INTERFACE)
    assert across[0] == start[0] and across[1] < 2.0 and np.linalg.norm(across - start) == pytest.approx(1.5, rel=1e-3)
    back = Gauge("g", x_mm=float(along[0]), y_mm=2.0, moved_mm=(-1.5, 0.0))
    assert gauge_site(FINGER, back, INTERFACE) == pytest.approx(start, abs=1e-3)
    with pytest.raises(InputError, match="gauge g was moved off the interface"):
        gauge_site(FINGER, dataclasses.replace(gauge, moved_mm=(90.0, 0.0)), INTERFACE)
