"""The contact patch: its rim and outline, its mirror images, and frames off the apex."""

from dataclasses import dataclass

import numpy as np
import pytest

from papilla.fem.discrete.elements import TaylorHood
from papilla.fem.reduction.loaded_patch import build_patch
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
