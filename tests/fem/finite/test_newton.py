"""Parts of a press at finite strain: mixing, shortened steps, linearisation, the path of the load, the readout."""

import dataclasses

import numpy as np
import pytest
import scipy.sparse as sp

from papilla.fem.finite.body import Card
from papilla.fem.finite.newton import Linearisation, State
from papilla.fem.finite.pressing import Scene
from papilla.fem.reduction.gauges import SHARES
from papilla.model.finger import Layer
from papilla.model.materials import NeoHookean
from papilla.model.specimen import HalfSpace


@pytest.fixture(scope="module")
def scene(coarse):
    return Scene.of(*coarse, HalfSpace(0.5), {}, (0.0, 0.0))


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


@pytest.mark.parametrize("nu", [0.3, 0.49, 0.5])
def test_a_card_has_the_compressibility_of_its_poissons_ratio(nu):
    assert Card(NeoHookean(0.2), nu).compressibility == pytest.approx((1 - 2 * nu) / (2 * nu * 0.2))


def test_the_largest_stretch_of_a_body_is_that_of_its_deformation(scene):
    places = scene.body.space.displacement.doflocs.T
    least, largest = scene.body.stability(places * (np.array([1.3, 1 / 1.3, 1.0]) - 1))
    assert largest == pytest.approx(1.3)
    card = scene.body.cards[0].material
    assert least == pytest.approx(float(card.stability(np.array([1.3, 1 / 1.3, 1.0]))))


def test_gauges_read_a_homogeneous_stretch_exactly_and_no_turn(coarse):
    finger, mesh = coarse
    whole = Scene.of(finger, dataclasses.replace(mesh, mirrors=()), HalfSpace(0.5), {}, (0.0, 0.0))
    places = whole.body.space.displacement.doflocs.T
    stretch = np.array([1.2, 0.9, 0.95])
    values = whole.readout(places * (stretch - 1))
    assert values.shape == (2, len(finger.gauges))
    for functional, strain in zip(whole.readout.functionals, values[0], strict=False):
        chords = np.diff(functional.points.reshape(-1, 2, 3), axis=1)[:, 0]
        longer = np.linalg.norm(chords * stretch, axis=1) / np.linalg.norm(chords, axis=1) - 1
        assert strain == pytest.approx(SHARES @ longer)
    bends = whole.readout.functionals[len(finger.gauges) :]
    assert values[1] == pytest.approx([(one.weights * one.points * (stretch - 1)).sum() for one in bends])
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    assert whole.readout(places @ (turn - np.eye(3)).T)[0] == pytest.approx(0, abs=1e-13)
    quarter = Scene.of(finger, mesh, HalfSpace(0.5), {}, (0.0, 0.0))
    mirrored = quarter.readout(quarter.body.space.displacement.doflocs.T * (stretch - 1))
    assert mirrored == pytest.approx(values, abs=1e-12), "a symmetric field, seen through the mirrors"


def test_a_scene_takes_the_material_of_each_layer_and_the_force_of_its_part(coarse):
    finger, mesh = coarse
    scene = Scene.of(dataclasses.replace(finger, outer=Layer(0.3, 0.4)), mesh, HalfSpace(0.5), {}, (0.0, 0.0))
    assert scene.body.cards[0].material.shear_modulus == pytest.approx(0.3 / 2.8) and scene.body.cards[0].nu == 0.4
    n = len(scene.touching.patch.mass)
    state = State(None, None, np.arange(3.0 * n), np.zeros(n, dtype=bool), 0.0)
    assert scene.force(state) == pytest.approx(scene.touching.patch.mass @ np.arange(n))
