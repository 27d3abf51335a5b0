"""Closed-form stress and tangent: checked by finite differences for every material, and where stretches coincide."""

import numpy as np
import pytest

from papilla.fem.finite.constitutive import Kinematics, response
from papilla.model.materials import NeoHookean, Ogden, Yeoh

CARDS = [NeoHookean(0.3), Yeoh(0.17, -0.004, 0.002), Ogden(0.11, 3.3), Ogden(0.2, -1.5)]

GRADIENTS = {
    "general": np.random.default_rng(1).normal(size=(6, 3, 3)) * 0.2,
    "none": np.zeros((1, 3, 3)),
    "dilatation": 0.1 * np.eye(3)[None],
    "two stretches alike": np.diag([0.2, 0.2, -0.3])[None],
    "two stretches nearly alike": np.diag([0.2, 0.2 + 1e-11, -0.3])[None],
}


def _steps():
    for k in range(9):
        step = np.zeros(9)
        step[k] = 1e-6
        yield k, step.reshape(3, 3)


@pytest.mark.parametrize("gradient", GRADIENTS.values(), ids=GRADIENTS)
@pytest.mark.parametrize("card", CARDS, ids=repr)
def test_stress_and_tangent_are_derivatives(card, gradient, density):
    pressure = np.random.default_rng(2).normal(size=len(gradient))
    stress, tangent = response(card, Kinematics.of(gradient), pressure)
    for k, step in _steps():
        up, down = (Kinematics.of(gradient + sign * step) for sign in (1, -1))
        slope = (density(card, up, pressure, 0.1) - density(card, down, pressure, 0.1)) / 2e-6
        assert stress.reshape(-1, 9)[:, k] == pytest.approx(slope, abs=2e-9)
        change = (response(card, up, pressure)[0] - response(card, down, pressure)[0]) / 2e-6
        assert tangent[:, :, k] == pytest.approx(change.reshape(-1, 9), abs=5e-9)
    assert np.array_equal(response(card, Kinematics.of(gradient), pressure)[1], tangent), "evaluating twice"


@pytest.mark.parametrize("card", CARDS, ids=repr)
def test_a_rotation_gives_no_stress_and_turns_the_stress_of_what_follows(card):
    gradient = GRADIENTS["general"]
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    none = np.zeros(1)
    stress, _ = response(card, Kinematics.of((turn - np.eye(3))[None]), none)
    assert np.abs(stress).max() < 1e-14
    zero = np.zeros(len(gradient))
    before, _ = response(card, Kinematics.of(gradient), zero)
    after, _ = response(card, Kinematics.of(turn @ (np.eye(3) + gradient) - np.eye(3)), zero)
    assert after == pytest.approx(turn @ before, abs=1e-13)


@pytest.mark.parametrize("card", CARDS, ids=repr)
def test_at_rest_the_tangent_is_linear_elasticity(card):
    _, tangent = response(card, Kinematics.of(np.zeros((1, 3, 3))), np.zeros(1))
    identity = np.eye(9).reshape(3, 3, 3, 3)
    expected = card.shear_modulus * (identity + identity.transpose(0, 1, 3, 2)).reshape(9, 9)
    assert tangent[0] == pytest.approx(expected, abs=1e-14)


def test_the_volume_change_of_a_tiny_strain_keeps_its_digits():
    gradient = 1e-12 * np.diag([3.0, -1.0, 0.5])[None]
    assert Kinematics.of(gradient).volume_change == pytest.approx([2.5e-12], rel=1e-11)
