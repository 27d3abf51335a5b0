"""Parts of a press at finite strain: its linearisation, and what gauges read of large strains and turns."""

import dataclasses

import numpy as np
import pytest
import scipy.sparse as sp

from papilla.fem.finite.newton import Linearisation
from papilla.fem.finite.pressing import PressProblem
from papilla.fem.finite.touching import Touching
from papilla.fem.reduction.gauges import LINE_SHARES
from papilla.mesh import build
from papilla.model.finger import Finger
from papilla.model.specimen import Block, HalfSpace, Sphere


@pytest.fixture(scope="module")
def scene(coarse):
    """The finger without mirrors, so that its skin may move to any side."""
    finger, mesh = coarse
    return PressProblem.of(finger, dataclasses.replace(mesh, mirrors=()), HalfSpace(0.5), {}, (0.0, 0.0))


@pytest.fixture(scope="module")
def quarter(coarse):
    return PressProblem.of(*coarse, HalfSpace(0.5), {}, (0.0, 0.0))


def test_a_linearisation_is_the_inverse_of_the_tangent(quarter):
    scene = quarter
    held = Linearisation.at(scene.body, scene.touching, scene.at_rest)
    rest = scene.at_rest
    lower = scene.body.tangent(rest.displacement, rest.pressure)
    tangent = (lower + lower.T - sp.diags(lower.diagonal())).tocsr()
    assert tangent @ held.response == pytest.approx(held.loads.toarray(), abs=1e-9)
    force = np.random.default_rng(0).normal(size=len(held.scale))
    assert tangent @ held.solve(force) == pytest.approx(force, abs=1e-8)
    assert np.array_equal(held.compliance, held.compliance.T)
    assert held.compliance == pytest.approx(held.response.T @ tangent @ held.response, abs=1e-9)


def test_gauges_read_a_homogeneous_stretch_exactly_and_no_turn(scene, quarter):
    whole, finger = scene, scene.finger
    places = whole.body.space.displacement.doflocs.T
    stretch = np.array([1.2, 0.9, 0.95])
    values = whole.readout(places * (stretch - 1))
    assert values.shape == (2, len(finger.gauges))
    for functional, strain in zip(whole.readout.functionals, values[0], strict=False):
        chords = np.diff(functional.points.reshape(-1, 2, 3), axis=1)[:, 0]
        longer = np.linalg.norm(chords * stretch, axis=1) / np.linalg.norm(chords, axis=1) - 1
        assert strain == pytest.approx(LINE_SHARES @ longer)
    bends = whole.readout.functionals[len(finger.gauges) :]
    assert values[1] == pytest.approx([(one.weights * one.points * (stretch - 1)).sum() for one in bends])
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    assert whole.readout(places @ (turn - np.eye(3)).T)[0] == pytest.approx(0, abs=1e-13)
    mirrored = quarter.readout(quarter.body.space.displacement.doflocs.T * (stretch - 1))
    assert mirrored == pytest.approx(values, abs=1e-12), "a symmetric field, seen through the mirrors"


@pytest.fixture(scope="module")
def bulge(scene):
    """A smooth displacement (nodes, 3) of about 0.1 mm, different in each direction."""
    x, y, z = scene.body.space.displacement.doflocs / 10
    return 0.1 * np.column_stack([np.sin(x) + y * y, np.cos(y) * z + x, np.sin(x - y) + 0.5 * z])


@pytest.mark.parametrize("specimen", [HalfSpace(0.5), Sphere(0.5, 12.0)], ids=repr)
def test_loads_are_the_derivative_of_the_gap(scene, bulge, specimen):
    touching = Touching(scene.touching.loaded, specimen, 0.3)
    along, n = np.roll(bulge, 1, axis=1)[::-1], len(touching.patch.xy)
    nothing = np.zeros(3 * n)
    after, before = (touching.at(bulge + sign * 1e-4 * along, nothing).gap for sign in (1, -1))
    loads = touching.at(bulge, nothing).loads
    slope = loads[:, :n].T @ along.ravel()
    assert slope == pytest.approx((after - before) / 2e-4, abs=1e-6 * np.abs(slope).max())
    assert loads.shape == (bulge.size, 3 * n)
    for axis in (1, 2):
        pulled = loads[:, axis * n : (axis + 1) * n].toarray().reshape(-1, 3, n).sum(axis=0)
        expected = np.outer(touching.loaded.frame.axes[axis - 1], touching.patch.mass)
        assert pulled == pytest.approx(expected, abs=1e-12), "traction of 1 MPa over each node's area"
    smooth = Touching(scene.touching.loaded, specimen)
    assert touching.at(bulge, nothing).gap == pytest.approx(smooth.at(bulge, nothing[:n]).gap)


def _around(touching):
    """Squared distance (n,) from a place beside the apex, over that of a few edges."""
    return (((touching.patch.xy - [1.0, 0.5]) / (2.5 * touching.patch.edge_length.mean())) ** 2).sum(axis=1)


def _weak_gap(touching, displacement, contact):
    size = len(touching.patch.xy)
    return touching.at(displacement, contact).gap + (touching.compliance @ contact)[:size]


@pytest.mark.parametrize("specimen", [HalfSpace(0.2), Block(0.2, 6.0), Sphere(0.2, 40.0)], ids=repr)
def test_turned_pressure_and_gap_derive_from_one_potential(scene, bulge, specimen):
    """int p dgap over a growing pressure is a potential: its derivative by the skin's displacement is the load."""
    touching = Touching(scene.touching.loaded, specimen)
    pressure, along = 0.03 * np.exp(-_around(touching)), np.roll(bulge, 1, axis=1)[::-1]
    shares, weights = np.polynomial.legendre.leggauss(5)

    def potential(displacement):
        return sum(
            w / 2 * pressure @ _weak_gap(touching, displacement, (1 + s) / 2 * pressure)
            for s, w in zip(shares, weights, strict=True)
        )

    expected = (potential(bulge + 1e-3 * along) - potential(bulge - 1e-3 * along)) / 2e-3
    loads = touching.at(bulge, pressure).loads
    assert loads @ pressure @ along.ravel() == pytest.approx(expected, rel=1e-6)
    upright = touching.at(bulge, 0 * pressure).loads
    assert upright @ pressure @ along.ravel() != pytest.approx(expected, rel=1e-3), "the specimen turns the pressure"


def test_a_half_space_gives_way_by_less_as_the_skin_spreads():
    """Nodal pressures per area of the skin at rest, over places that are 1 + e times as far apart: 1 / (1 + e)."""
    finger, spread = Finger.default(), 0.02
    scene = PressProblem.of(finger, build(finger, 1.4), HalfSpace(0.5), {}, (0.0, 0.0))
    touching, places = scene.touching, scene.body.space.displacement.doflocs.T
    lateral, distance = touching.loaded.frame.axes[:2], np.hypot(*touching.patch.xy.T)
    pressure = 1e-6 * np.exp(-((distance / 4) ** 2))

    def answer(displacement):
        risen = [_weak_gap(touching, displacement, contact) for contact in (pressure, 0 * pressure)]
        return ((risen[0] - risen[1]) / touching.patch.mass)[distance < 4]

    stretched = answer(spread * (places - touching.loaded.frame.origin) @ lateral.T @ lateral)
    assert stretched / answer(0 * places) == pytest.approx(1 / (1 + spread), abs=0.15 * spread)


def test_nodes_on_a_mirror_stay_on_it_and_have_no_friction_across(quarter):
    """Also where the displacement of the quarter is not that of a mirrored body: the mean over its images is."""
    loaded = quarter.touching.loaded
    rough, smooth = Touching(loaded, HalfSpace(0.5), 0.3), Touching(loaded, HalfSpace(0.5))
    on_plane = rough.patch.xy == 0
    assert smooth.fixed is None and np.array_equal(rough.fixed, on_plane.T) and on_plane.any(axis=0).all()
    moved = np.random.default_rng(0).normal(0, 0.1, (quarter.body.space.nodes, 3))
    current = smooth.current_patch(moved)
    assert (current.xy[on_plane] == 0).all() and (current.xy[~on_plane] != rough.patch.xy[~on_plane]).all()
    still = smooth.current_patch(np.zeros_like(moved))
    assert np.array_equal(still.xy, rough.patch.xy) and still.mass == pytest.approx(rough.patch.mass)
    stretched = smooth.current_patch(0.05 * quarter.body.space.displacement.doflocs.T @ np.diag([1, 1, 0]))
    inside = rough.patch.mass > 0
    assert np.median(stretched.mass[inside] / rough.patch.mass[inside]) == pytest.approx(1.05**2, rel=2e-2)
