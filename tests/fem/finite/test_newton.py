"""Parts of a press at finite strain: its linearisation, and what gauges read of large strains and turns."""

import dataclasses

import numpy as np
import pytest
import scipy.sparse as sp

from papilla.fem.finite.newton import Linearisation
from papilla.fem.finite.pressing import PressProblem
from papilla.fem.reduction.gauges import LINE_SHARES
from papilla.model.specimen import HalfSpace


@pytest.fixture(scope="module")
def scene(coarse):
    return PressProblem.of(*coarse, HalfSpace(0.5), {}, (0.0, 0.0))


def test_a_linearisation_is_the_inverse_of_the_tangent(scene):
    held = Linearisation.at(scene.body, scene.touching, scene.at_rest)
    rest = scene.at_rest
    lower = scene.body.tangent(rest.displacement, rest.pressure)
    tangent = (lower + lower.T - sp.diags(lower.diagonal())).tocsr()
    assert tangent @ held.response == pytest.approx(held.loads.toarray(), abs=1e-9)
    force = np.random.default_rng(0).normal(size=len(held.scale))
    assert tangent @ held.solve(force) == pytest.approx(force, abs=1e-8)
    assert np.array_equal(held.compliance, held.compliance.T)
    assert held.compliance == pytest.approx(held.response.T @ tangent @ held.response, abs=1e-9)


def test_gauges_read_a_homogeneous_stretch_exactly_and_no_turn(coarse):
    finger, mesh = coarse
    whole = PressProblem.of(finger, dataclasses.replace(mesh, mirrors=()), HalfSpace(0.5), {}, (0.0, 0.0))
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
    quarter = PressProblem.of(finger, mesh, HalfSpace(0.5), {}, (0.0, 0.0))
    mirrored = quarter.readout(quarter.body.space.displacement.doflocs.T * (stretch - 1))
    assert mirrored == pytest.approx(values, abs=1e-12), "a symmetric field, seen through the mirrors"
