"""Parts of a press at finite strain: mixing, shortened steps, linearisation, the path of the load, the readout."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp

from papilla.fem.finite import newton, pressing
from papilla.fem.finite.body import Card
from papilla.fem.finite.newton import Linearisation, State, StepError
from papilla.fem.finite.pressing import Scene
from papilla.fem.reduction.gauges import SHARES
from papilla.model.finger import Layer
from papilla.model.materials import NeoHookean
from papilla.model.specimen import HalfSpace


@pytest.fixture(scope="module")
def scene(coarse):
    return Scene.of(*coarse, HalfSpace(0.5), {}, (0.0, 0.0))


def test_mixing_solves_a_linear_fixed_point_in_as_many_steps_as_it_has_unknowns():
    random = np.random.default_rng(4)
    A, b = 0.4 * random.normal(size=(4, 4)), random.normal(size=4)
    wanted = np.linalg.solve(np.eye(4) - A, b)
    mixing, point = newton._Mixing(4), np.zeros(4)
    for _ in range(6):
        point = mixing.next(point, A @ point + b - point)
    assert point == pytest.approx(wanted, abs=1e-9)
    assert len(mixing.steps) == newton.MIXED == 5
    assert np.array_equal(newton._Mixing(4).next(b, b), 2 * b), "the first step is not mixed"


def test_mixing_leaves_out_the_step_over_which_the_map_changed():
    mixing = newton._Mixing(1)
    mixing.next(np.zeros(1), np.ones(1))
    assert mixing.next(np.ones(1), np.full(1, 0.5), same=False) == pytest.approx([1.5]) and not mixing.steps
    # Two points of one map: its changes 0.5 at 1 and 0.25 at 1.5 vanish at 2
    assert mixing.next(np.full(1, 1.5), np.full(1, 0.25)) == pytest.approx([2.0])


def test_mixing_measures_by_the_displacements_alone():
    mixing = newton._Mixing(1)
    mixing.next(np.zeros(2), np.array([1.0, 5.0]))
    found = mixing.next(np.array([1.0, 5.0]), np.array([0.5, -40.0]))
    assert found[0] == pytest.approx(2.0)


def test_a_step_is_halved_until_every_cell_keeps_its_volume():
    def forces(displacement, pressure):
        return SimpleNamespace(smallest_jacobian=1 - displacement.max())

    body, active = SimpleNamespace(forces=forces), np.array([True])
    rest = State(np.zeros((1, 3)), np.zeros(1), np.zeros(1), np.array([False]), 0.0)
    far = State(np.full((1, 3), 2.0), np.full(1, 4.0), np.full(1, 8.0), active, 0.4)
    state, after, whole = newton._right_side_out(body, rest, far, forces(rest.displacement, None))
    assert not whole and state.displacement == pytest.approx(0.5) and after.smallest_jacobian == 0.5
    assert (state.pressure[0], state.contact[0], state.indentation) == (1.0, 2.0, 0.1) and state.active is active
    near = dataclasses.replace(far, displacement=np.full((1, 3), 0.89))
    assert newton._right_side_out(body, rest, near, forces(rest.displacement, None))[2], "a tenth of the volume is left"
    hopeless = dataclasses.replace(far, displacement=np.full((1, 3), 60.0))
    with pytest.raises(StepError, match="a cell would turn inside out"):
        newton._right_side_out(body, rest, hopeless, forces(rest.displacement, None))
    # 2^5 halvings of a step of 28 leave 0.875
    assert newton._right_side_out(body, rest, dataclasses.replace(far, displacement=np.full((1, 3), 28.0)),
                                  forces(rest.displacement, None))[1].smallest_jacobian == 0.125  # fmt: skip


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


def test_unknowns_are_scaled_by_the_stiffness_and_the_size_of_a_cell(scene):
    body, shear = scene.body, {"outer": 0.136, "inner": 0.034}
    mu = math.sqrt(math.prod(modulus / (2 * 1.4999) for modulus in shear.values()))
    length = np.cbrt(body._weights.sum() / len(body._weights))
    assert body.scale[0] == pytest.approx((mu * length) ** -0.5, rel=1e-3)
    assert body.scale[-1] == pytest.approx((mu / length**3) ** 0.5, rel=1e-3)
    assert len(body.scale) == body.free.sum() and body.free_pressures == body.space.pressures
    mass = sum(body.pressure_mass(number) for number in body.cards)
    whole = mass + mass.T
    assert (whole.sum() - mass.diagonal().sum()) == pytest.approx(body._weights.sum())


@pytest.mark.parametrize("nu", [0.3, 0.49, 0.5])
def test_a_card_has_the_compressibility_of_its_poissons_ratio(nu):
    assert Card(NeoHookean(0.2), nu).compressibility == pytest.approx((1 - 2 * nu) / (2 * nu * 0.2))


def test_the_largest_stretch_of_a_body_is_that_of_its_deformation(scene):
    places = scene.body.space.displacement.doflocs.T
    least, largest = scene.body.stability(places * (np.array([1.3, 1 / 1.3, 1.0]) - 1))
    assert largest == pytest.approx(1.3)
    card = scene.body.cards[0].material
    assert least == pytest.approx(float(card.stability(np.array([1.3, 1 / 1.3, 1.0]))))


@pytest.mark.parametrize("friction", [0.0, 0.2])
@pytest.mark.parametrize("name, begun", [("force", 0.0), ("force", 0.5), ("indentation", 0.0), ("indentation", 0.5)])
def test_with_friction_a_load_rises_by_three_tenths_a_step(monkeypatch, friction, name, begun):
    given = []
    balance = newton.Balance(0.0, 0.0, 0.0)

    def raised(scene, name, load, state, held, tolerance, progress):
        given.append((name, load, tolerance))
        return state, [1], balance, held

    monkeypatch.setattr(pressing, "raise_load", raised)
    start = SimpleNamespace(force=begun, indentation=begun)
    fake = SimpleNamespace(touching=SimpleNamespace(friction=friction), at_rest=start, force=lambda state: state.force)
    aims = {"force": None, "indentation": None, name: 1.0}
    _, steps, *_ = pressing.press_path(fake, *aims.values(), tolerance=1e-7)
    loads = [load for _, load, _ in given]
    assert {one for one, _, _ in given} == {name} and len(steps) == len(loads) and loads[-1] == 1.0
    assert given[-1][2] == 1e-7 and all(tolerance == 1e-5 for _, _, tolerance in given[:-1])
    if not friction:
        assert loads == [1.0]
        return
    assert np.diff(np.log(loads)) == pytest.approx(math.log(1.3))
    assert (begun < loads[0] <= 1.3 * begun) if begun else (0.02 / 1.3 < loads[0] <= 0.02)


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
