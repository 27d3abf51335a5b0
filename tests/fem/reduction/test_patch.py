"""The contact patch: its rim and outline, its mirror images, and frames off the apex."""

from dataclasses import dataclass

import numpy as np
import pytest

from papilla.fem.discrete.elements import TaylorHood
from papilla.fem.reduction.gauges import curvature_functional, gauge_frame, strain_functional
from papilla.fem.reduction.loaded_patch import build_patch
from papilla.fem.reduction.patch import Frame, Patch, gap_of
from papilla.mesh.body import surfaces_of
from papilla.mesh.surfaces import Ellipsoid
from papilla.model.finger import Finger, Gauge

DOME = Ellipsoid((24.0, 30.0, 20.0))


@dataclass(frozen=True)
class Flat:
    """The plane z = 1 over the unit square."""

    def level(self, points):
        return points[:, 2] - 1

    def project(self, points):
        return np.column_stack([points[:, :2], np.ones(len(points))])

    project_in_base = project

    def height(self, xy):
        return np.where(((xy >= 0) & (xy <= 1)).all(axis=1), 1.0, np.nan)

    def normal(self, points):
        return np.tile([0.0, 0.0, 1.0], (len(points), 1))


@pytest.fixture(scope="module")
def flat_patch(box):
    """Function: the patch of a radius around the middle of a box's top, with its space."""
    mesh = box((8, 8, 2))
    space = TaylorHood(mesh)

    def make(radius):
        return build_patch(space, mesh, Flat(), Frame.at(Flat(), 0.5, 0.5), radius, False)

    make.space = space
    return make


@pytest.mark.parametrize("at", [(0.0, 0.0), (7.0, 0.0), (-6.0, 9.0)])
def test_gap_off_the_apex_leads_to_the_surface(at):
    frame = Frame.at(DOME, *at)
    x, y = np.random.default_rng(0).uniform(-5, 5, (2, 40))
    plane = frame.origin + x[:, None] * frame.axes[0] + y[:, None] * frame.axes[1]
    # From any point of the plane's normal, and from points near the facets
    for start in (plane, plane - np.linspace(0, 0.8, 40)[:, None] * frame.axes[2]):
        foot = plane - gap_of(DOME, frame, start)[:, None] * frame.axes[2]
        assert np.abs(((foot / DOME.axes) ** 2).sum(axis=1) - 1).max() < 1e-5
    assert gap_of(DOME, frame, frame.origin[None]) == pytest.approx(0, abs=1e-13)


def test_frame_is_the_tangent_plane():
    frame = Frame.at(DOME, -6.0, 9.0)
    assert frame.axes @ frame.axes.T == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(frame.axes) == pytest.approx(1)
    assert frame.axes[2] == pytest.approx(DOME.normal(frame.origin[None])[0])
    assert DOME.level(frame.origin[None]) == pytest.approx(0, abs=1e-12)
    assert frame.axes[0, 1] == 0, "the first axis stays in an x-z plane"
    apex = Frame.at(DOME, 0.0, 0.0)
    assert apex.axes == pytest.approx(np.eye(3)) and apex.local(np.array([1.0, 2, 23])) == pytest.approx([1, 2, 3])


def test_the_rim_is_where_skin_goes_on(flat_patch):
    small = flat_patch(0.4).patch
    assert small.rim.any() and not small.rim.all()
    assert (small.rim == small.outline).all()
    distance = np.hypot(*small.xy.T)
    assert distance[small.rim].min() > 0.2 and distance[~small.rim].max() < 0.4
    everything = flat_patch(1.0).patch
    assert everything.mass.sum() == pytest.approx(1, rel=1e-12)
    assert not everything.rim.any(), "at the edge of the skin there is nothing to leave the patch for"
    assert (everything.outline == (np.abs(everything.xy).max(axis=1) > 0.5 - 1e-9)).all()


def test_the_edges_at_a_node_are_those_of_its_triangles():
    """A triangle of 3, 4 and 5 mm: two edges meet at each node."""
    xy = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]])
    patch = Patch(
        xy, np.array([[0, 1, 2]]), np.full(3, 2.0), np.array([0.0, 2.0, 4.0]), np.zeros(3, bool), np.ones((1, 2))
    )
    assert patch.edge_length.tolist() == [3.5, 4.0, 4.5] and patch.finest_edge == 4.0
    assert patch.node_gap.tolist() == [0, 1, 2] and patch.outline.all()


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


def test_the_gradient_of_a_linear_field_is_exact():
    x, y = np.random.default_rng(4).uniform(0, 5, (2, 12))
    corners = np.array([(i, i + 1, i + 2) for i in range(10)])
    unknown = np.zeros(12)
    patch = Patch(np.column_stack([x, y]), corners, unknown, unknown, unknown > 0, np.array([[1, 1]]))
    for derivative, expected in zip(patch.gradient, (0.3, -1.2), strict=True):
        assert derivative @ (0.3 * x - 1.2 * y + 2) == pytest.approx(np.full(12, expected), abs=1e-9)
