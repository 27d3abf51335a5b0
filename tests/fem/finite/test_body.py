"""The assembled body: its tangent, the linear limit, rigid motions, and closed forms of the three classical tests."""

import numpy as np
import pytest

from papilla.fem.discrete.assembly import lame
from papilla.fem.discrete.elements import TaylorHood
from papilla.fem.finite.body import Body, Card
from papilla.model.finger import Layer
from papilla.model.materials import TEST_MODES, NeoHookean, Ogden, Yeoh, principal_pair

CARDS = [NeoHookean(0.3), Yeoh(0.17, -0.004, 0.002), Ogden(0.11, 3.3)]


def _full(lower):
    dense = lower.toarray()
    return dense + np.tril(dense, -1).T


def _state(body, free_values):
    full = np.zeros(body.space.unknowns)
    full[body.free] = free_values
    size = 3 * body.space.nodes
    return full[:size].reshape(-1, 3), full[size:]


@pytest.fixture(scope="module")
def space(box):
    return TaylorHood(box((2, 2, 2)))


@pytest.mark.parametrize("card", CARDS, ids=repr)
def test_force_and_tangent_are_derivatives_of_the_energy(space, card, energy_of):
    body = Body(space, {0: Card(card, 0.499), 1: Card(NeoHookean(0.02), 0.3)}, space.free((1, 1), ()))
    rng = np.random.default_rng(5)
    at, along = rng.normal(size=(2, int(body.free.sum()))) * 0.01
    here, tangent = body.forces(*_state(body, at)), body.tangent(*_state(body, at))
    assert 0 < here.smallest_jacobian < 1
    upper, lower = (energy_of(body, *_state(body, at + sign * 1e-5 * along)) for sign in (1, -1))
    assert here.force @ along == pytest.approx((upper - lower) / 2e-5, rel=1e-7)
    up, down = (body.forces(*_state(body, at + sign * 1e-4 * along)).force for sign in (1, -1))
    change = _full(tangent) @ along
    assert (up - down) / 2e-4 == pytest.approx(change, abs=1e-7 * np.abs(change).max())


@pytest.mark.parametrize("nu", [pytest.param(0.3, marks=pytest.mark.slow), 0.4999, 0.5])
def test_at_rest_the_tangent_is_the_matrix_of_the_linear_rungs(space, nu):
    layers = {0: Layer(0.136, nu), 1: Layer(0.034, nu)}
    cards = {number: Card(NeoHookean(lame(layer)[0]), nu) for number, layer in layers.items()}
    body = Body(space, cards, np.ones(space.unknowns, dtype=bool))
    rest = np.zeros((space.nodes, 3)), np.zeros(space.pressures)
    linear = space.matrix(layers).toarray()
    assert body.tangent(*rest).toarray() == pytest.approx(linear, abs=1e-13 * np.abs(linear).max())
    assert np.array_equal(body.forces(*rest).force, np.zeros(space.unknowns))


@pytest.mark.parametrize("card", CARDS, ids=repr)
def test_a_rigid_rotation_makes_no_force(space, card):
    body = Body(space, {0: Card(card, 0.5), 1: Card(card, 0.4999)}, np.ones(space.unknowns, dtype=bool))
    c, s = np.cos(2.0), np.sin(2.0)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    displacement = space.displacement.doflocs.T @ (turn - np.eye(3)).T + [1.0, -2.0, 0.5]
    forces = body.forces(displacement, np.zeros(space.pressures)).force
    assert np.abs(forces).max() < 1e-14


def test_a_state_turned_inside_out_has_no_forces(space):
    body = Body(space, {0: Card(CARDS[0], 0.5), 1: Card(CARDS[0], 0.5)}, np.ones(space.unknowns, dtype=bool))
    flipped = body.forces(-2 * space.displacement.doflocs.T, np.zeros(space.pressures))
    assert np.isnan(flipped.force).all() and flipped.smallest_jacobian == pytest.approx(-1)


@pytest.mark.parametrize("stretch", [0.6, 1.05, 1.8])
@pytest.mark.parametrize("mode", TEST_MODES)
@pytest.mark.parametrize("card", CARDS, ids=repr)
def test_a_cube_follows_the_closed_form(box, card, mode, stretch):
    """On rollers, driven by its faces, free elsewhere; nu = 0.5 exactly."""
    space = TaylorHood(box((1, 1, 1), jitter=0.0, split=False))
    where = space.displacement.doflocs
    driven = {"uniaxial": {0: stretch}, "equibiaxial": {0: stretch, 1: stretch}, "pure_shear": {0: stretch, 1: 1.0}}[
        mode
    ]
    free = np.ones((space.nodes, 3), dtype=bool)
    displacement = np.zeros((space.nodes, 3))
    for axis in range(3):
        free[where[axis] == 0, axis] = False
        if axis in driven:
            free[where[axis] == 1, axis] = False
            displacement[:, axis] = (driven[axis] - 1) * where[axis]
    displacement[:, 2] = (float(principal_pair(stretch, mode)[1]) ** 0.7 - 1) * where[2]
    body = Body(space, {0: Card(card, 0.5)}, np.append(free.ravel(), np.ones(space.pressures, dtype=bool)))
    pressure = np.zeros(space.pressures)
    for _ in range(12):
        force, tangent = body.forces(displacement, pressure).force, body.tangent(displacement, pressure)
        change, dp = _state(body, np.linalg.lstsq(_full(tangent), -force, rcond=1e-12)[0])
        displacement, pressure = displacement + change, pressure + dp
    assert np.abs(body.forces(displacement, pressure).force).max() < 1e-12
    whole = Body(space, body.cards, np.ones(space.unknowns, dtype=bool))
    forces = whole.forces(displacement, pressure).force[: 3 * space.nodes].reshape(-1, 3)
    reaction = forces[where[0] == 1, 0].sum()
    assert reaction == pytest.approx(float(card.nominal_stress(stretch, mode)), rel=1e-9)
