"""The contact patch: its weak integrals, its rim and outline, its mirror images, and frames off the apex."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.fem.discrete.elements import SYMMETRIC, TaylorHood
from papilla.fem.reduction.finger_model import build_patch
from papilla.fem.reduction.patch import Frame, gap_of
from papilla.mesh.surfaces import Ellipsoid

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


def triangle_areas(patch):
    a, b, c = patch.xy[patch.triangles].transpose(1, 0, 2)
    return np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]) / 2


@pytest.fixture(scope="module")
def flat_patch(box):
    """Function: the patch of a radius around the middle of a box's top, with its space."""
    mesh = box((8, 8, 2))
    space = TaylorHood(mesh)

    def make(radius):
        return build_patch(space, mesh, Flat(), Frame.at(Flat(), 0.5, 0.5), radius, False)

    make.space = space
    return make


def test_mass_is_the_projected_area_of_the_triangles(reference, coarse):
    straight, patch = coarse.patch, reference.patch
    assert straight.mass.sum() == pytest.approx(triangle_areas(straight).sum(), rel=1e-12)
    # Bent edges bulge at the patch's outline
    assert patch.mass.sum() == pytest.approx(triangle_areas(patch).sum(), rel=2e-3)
    assert (patch.mass > 0).all()
    # Whole triangles only: the patch is the disc but for half an element at its rim
    whole = len(patch.images) * patch.mass.sum() / (np.pi * 15**2)
    assert 0.85 < whole < 1


def test_gap_is_that_of_the_exact_skin(reference):
    """At the nodes, and weakly: against z = c sqrt(1 - (x/a)^2 - (y/b)^2) on a much finer quadrature."""
    patch = reference.patch

    def exact(x, y):
        return 20 * (1 - np.sqrt(1 - (x / 24) ** 2 - (y / 30) ** 2))

    n = 12
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    up, down = (i + j < n), (i + j < n - 1)
    thirds = np.concatenate([[i[up] + 1 / 3, j[up] + 1 / 3], [i[down] + 2 / 3, j[down] + 2 / 3]], axis=1).T / n
    hats = np.column_stack([thirds, 1 - thirds.sum(axis=1)])
    points = np.einsum("qk,tkj->tqj", hats, patch.xy[patch.triangles])
    weak = np.einsum("tq,qk,t->tk", exact(*np.moveaxis(points, 2, 0)), hats, triangle_areas(patch) / len(hats))
    expected = np.zeros(len(patch.xy))
    np.add.at(expected, patch.triangles, weak)
    # The quadrature of the patch is exact to fourth order; the finer one errs by h^2 / 144
    assert patch.gap == pytest.approx(expected, rel=6e-3, abs=1e-4)
    assert patch.gap.sum() == pytest.approx(expected.sum(), rel=3e-3), "bent edges bulge at the outline"


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


@pytest.mark.parametrize("at", [(24.5, 0.0), (20.0, 20.0)])
def test_there_is_no_patch_where_there_is_no_skin(coarse_model, at):
    with pytest.raises(InputError, match=f"no skin to touch at x {at[0]:g}, y {at[1]:g} mm"):
        coarse_model.reduce(at)


@pytest.mark.parametrize("at, message", [((np.nan, 0), "at x"), ((0, "left"), "at y")])
def test_a_touch_down_that_is_no_point_is_refused(coarse_model, at, message):
    with pytest.raises(InputError, match=rf"{message} \(mm\) must be"):
        coarse_model.reduce(at)


def test_a_patch_smaller_than_an_element_is_refused(flat_patch):
    with pytest.raises(InputError, match="no skin within 0.1 mm of the touch-down point"):
        flat_patch(0.1)


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


def test_the_outline_leaves_out_the_mirror_planes(disc):
    for quarter in (True, False):
        patch = disc(2.0, 5, quarter=quarter)
        assert (patch.outline == patch.rim).all()
        assert 0 < patch.rim.sum() < len(patch.rim) / 2


def test_edge_length_is_that_of_the_elements(flat_patch):
    inside = ~flat_patch(0.4).patch.rim
    found = flat_patch(0.4).patch.edge_length[inside]
    # Squares of 1/8 cut once: four sides, and none to four diagonals
    assert (found >= 0.125 - 1e-12).all() and (found <= 0.125 * np.sqrt(2)).all()


def test_loads_carry_the_pressure_to_the_mesh(flat_patch):
    loaded = flat_patch(0.4)
    loads = loaded.loads(SYMMETRIC).toarray().reshape(-1, 3, len(loaded.patch.xy))
    assert loads.sum(axis=0)[2] == pytest.approx(-loaded.patch.mass, rel=1e-12)
    assert np.abs(loads[:, :2]).max() == 0
    # Moments about the box's origin too: where the pressure acts, not only how much
    x = flat_patch.space.displacement.doflocs[:2]
    linear = loaded.patch.xy + 0.5
    assert x @ loads[:, 2] @ np.ones(len(linear)) == pytest.approx(-loaded.patch.mass @ linear, rel=1e-12)


def test_quarter_and_whole_patch_are_the_same_disc(coarse_model):
    space, mesh, skin = coarse_model.space, coarse_model.mesh, coarse_model.surfaces["skin"]
    frame = Frame.at(skin, 0.0, 0.0)
    quarter = build_patch(space, mesh, skin, frame, 15.0, True).patch
    whole = build_patch(space, mesh, skin, frame, 15.0, False).patch
    assert quarter.images.tolist() == [[1, 1], [1, -1], [-1, 1], [-1, -1]]
    assert whole.images.tolist() == [[1, 1]]
    assert len(whole.triangles) == 4 * len(quarter.triangles)
    for name in ("mass", "gap"):
        assert getattr(whole, name).sum() == pytest.approx(4 * getattr(quarter, name).sum(), rel=1e-12)
    # A node on a plane is shared by its images, in the plane of both by all four
    copies = 4 / 2.0 ** (quarter.xy == 0).sum(axis=1)
    assert copies.sum() == len(whole.xy)
    assert (copies * quarter.rim).sum() == whole.rim.sum()


@dataclass(frozen=True)
class Leaning(Flat):
    """The same plane, whose normal is said to lean towards x so that its z is `cosine`."""

    cosine: float = 1.0

    def normal(self, points):
        return np.tile([np.sqrt(1 - self.cosine**2), 0.0, self.cosine], (len(points), 1))


@pytest.mark.parametrize("cosine, chosen", [(0.21, True), (0.19, False)])
@pytest.mark.parametrize("facets", [True, False], ids=["its own facets", "the exact skin"])
def test_skin_is_part_of_a_patch_up_to_a_cosine_of_a_fifth(box, cosine, chosen, facets):
    """Both the facets' normals and those of the exact skin count, and neither alone is enough."""
    mesh = box((4, 4, 2))
    if facets:
        slope = np.sqrt(1 / cosine**2 - 1)
        points = mesh.points + np.outer(mesh.points[:, 0] - 0.5, [0.0, 0.0, slope])
        mesh, skin = replace(mesh, points=points), Flat()
    else:
        skin = Leaning(cosine)
    frame = Frame(np.array([0.5, 0.5, 1.0]), np.eye(3))
    space = TaylorHood(mesh)
    if chosen:
        patch = build_patch(space, mesh, skin, frame, 0.45, False).patch
        assert 0 < patch.mass.sum() < 1 and not patch.rim.all()
    else:
        with pytest.raises(InputError, match="no skin within 0.45 mm of the touch-down point faces the specimen"):
            build_patch(space, mesh, skin, frame, 0.45, False)
