"""Closed-form stress and tangent: checked by finite differences for every material, and where stretches coincide."""

import numpy as np
import pytest

from papilla.fem.discrete.assembly import lame
from papilla.fem.discrete.elements import TaylorHood
from papilla.fem.finite.body import Body, Card
from papilla.fem.finite.constitutive import Kinematics, principal, response, stress
from papilla.model.finger import Layer
from papilla.model.materials import NeoHookean, Ogden, Yeoh

CARDS = [NeoHookean(0.3), Yeoh(0.17, -0.004, 0.002), Ogden(0.11, 3.3), Ogden(0.2, -1.5)]

GRADIENTS = {
    "general": np.random.default_rng(1).normal(size=(3, 3, 6)) * 0.2,
    "none": np.zeros((3, 3, 1)),
    "dilatation": 0.1 * np.eye(3)[:, :, None],
    "two stretches alike": np.diag([0.2, 0.2, -0.3])[:, :, None],
    "two stretches nearly alike": np.diag([0.2, 0.2 + 1e-11, -0.3])[:, :, None],
}


@pytest.mark.parametrize("gradient", GRADIENTS.values(), ids=GRADIENTS)
@pytest.mark.parametrize("card", CARDS, ids=repr)
def test_stress_and_tangent_are_derivatives(card, gradient, density):
    pressure = np.random.default_rng(2).normal(size=gradient.shape[2])
    stress, tangent = response(card, Kinematics.of(gradient), pressure)
    for k, step in enumerate(1e-6 * np.eye(9).reshape(9, 3, 3, 1)):
        up, down = (Kinematics.of(gradient + sign * step) for sign in (1, -1))
        slope = (density(card, up, pressure, 0.1) - density(card, down, pressure, 0.1)) / 2e-6
        assert stress.reshape(9, -1)[k] == pytest.approx(slope, abs=2e-9)
        change = (response(card, up, pressure)[0] - response(card, down, pressure)[0]) / 2e-6
        assert tangent[:, k] == pytest.approx(change.reshape(9, -1), abs=5e-9)
    assert np.array_equal(response(card, Kinematics.of(gradient), pressure)[1], tangent), "evaluating twice"


@pytest.mark.parametrize("shape", [(), (6,), (3, 2), (1, 3, 2)], ids=str)
@pytest.mark.parametrize("card", CARDS, ids=repr)
def test_points_may_stand_in_any_table(card, shape):
    """Volume, cofactor and stretches are those of NumPy's determinant, inverse and singular values, point by point."""
    gradient = GRADIENTS["general"][..., : int(np.prod(shape))]
    pressure = np.linspace(-1, 1, gradient.shape[2])
    table = Kinematics.of(gradient.reshape(3, 3, *shape))
    F = np.eye(3) + gradient.transpose(2, 0, 1)
    assert table.volume_change.shape == shape and table.volume_change.ravel() == pytest.approx(np.linalg.det(F) - 1)
    cofactor = np.linalg.det(F)[:, None, None] * np.linalg.inv(F).swapaxes(1, 2)
    assert table.cofactor.reshape(3, 3, -1).transpose(2, 0, 1) == pytest.approx(cofactor)
    stretches, spatial, reference = (
        values.reshape(*values.shape[: values.ndim - len(shape)], -1).T for values in principal(table)
    )
    assert stretches[:, ::-1] == pytest.approx(np.linalg.svd(F, compute_uv=False))
    assert (spatial.swapaxes(1, 2) * stretches[:, None]) @ reference == pytest.approx(F)
    stress, tangent = response(card, table, pressure.reshape(shape))
    points = [response(card, Kinematics.of(gradient[..., k]), pressure[k]) for k in range(len(pressure))]
    assert stress.shape == (3, 3, *shape) and tangent.shape == (9, 9, *shape)
    assert stress.reshape(3, 3, -1) == pytest.approx(np.stack([stress for stress, _ in points], axis=-1))
    assert tangent.reshape(9, 9, -1) == pytest.approx(np.stack([tangent for _, tangent in points], axis=-1))


def test_the_volume_change_of_a_tiny_strain_keeps_its_digits():
    gradient = 1e-12 * np.diag([3.0, -1.0, 0.5])[:, :, None]
    assert Kinematics.of(gradient).volume_change == pytest.approx([2.5e-12], rel=1e-11)


@pytest.mark.parametrize("card", CARDS[:2], ids=repr)
def test_the_stress_of_a_tiny_strain_is_linear_and_keeps_its_digits(card):
    gradient, pressure = 1e-9 * GRADIENTS["general"], 1e-9 * np.linspace(-1, 1, 6)
    linear = card.shear_modulus * (gradient + gradient.swapaxes(0, 1)) - pressure * np.eye(3)[:, :, None]
    assert stress(card, Kinematics.of(gradient), pressure) == pytest.approx(linear, abs=2e-9 * np.abs(linear).max())


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


def test_a_state_turned_inside_out_has_no_forces(space):
    body = Body(space, {0: Card(CARDS[0], 0.5), 1: Card(CARDS[0], 0.5)}, np.ones(space.unknowns, dtype=bool))
    flipped = body.forces(-2 * space.displacement.doflocs.T, np.zeros(space.pressures))
    assert np.isnan(flipped.force).all() and flipped.smallest_jacobian == pytest.approx(-1)
