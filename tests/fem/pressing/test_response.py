"""The smooth response of a family against presses of its members, and its derivatives against differences."""

from dataclasses import replace

import numpy as np
import pytest
from scaled_finger import scaled_finger

from papilla.fem import press
from papilla.fem.pressing.off_apex import off_apex_change
from papilla.fem.pressing.response import Response, response
from papilla.fem.reduction.family import family
from papilla.mesh import default_size_mm
from papilla.model.finger import Dome, Finger
from papilla.model.specimen import Block

SIZE_MM = 2.8


@pytest.fixture(scope="module")
def relatives():
    return family(Finger.default(), size_mm=SIZE_MM)


@pytest.fixture(scope="module")
def smooth(relatives):
    return response(relatives, Block(1.0, 10.0))


FORCE, MODULUS = np.array([0.1, 0.3, 0.6, 1.0, 1.0]), np.array([0.3, 0.089, 0.5, 0.72, 0.089])


@pytest.mark.parametrize("outer, inner", [(0.136, 0.034), (0.1, 0.06), (0.2, 0.018)])
def test_it_tells_presses_of_fingers_of_the_family(relatives, smooth, outer, inner):
    member = relatives.at(outer, inner)
    presses = [press(member, Block(e, 10.0), force=f) for f, e in zip(FORCE, MODULUS, strict=True)]
    told = smooth.felt(FORCE, MODULUS, outer, inner)
    expected = np.array([one.values for one in presses])
    # Contact on this coarse mesh, unlike from one to the next, grows in steps, which the response averages over
    size = np.sqrt((expected**2).mean(axis=2, keepdims=True))
    assert np.abs((told.values - expected) / size).max() < 0.4
    assert told.indentation == pytest.approx([one.indentation for one in presses], rel=0.12)
    assert np.sqrt(np.mean(((told.values - expected) / size) ** 2)) < 0.1
    assert smooth.inside(FORCE, MODULUS, outer, inner).all()


def test_its_slopes_are_derivatives(smooth):
    outer, inner, step = 0.15, 0.04, 1e-5
    told = smooth.felt(FORCE, MODULUS, outer, inner)
    sides = {
        0: [smooth.felt(FORCE * np.exp(sign * step), MODULUS, outer, inner) for sign in (1, -1)],
        1: [smooth.felt(FORCE, MODULUS * np.exp(sign * step), outer, inner) for sign in (1, -1)],
        2: [smooth.felt(FORCE, MODULUS, outer * np.exp(sign * step), inner) for sign in (1, -1)],
    }
    for k, (up, down) in sides.items():
        for name in ("values", "indentation"):
            slope = (getattr(up, name) - getattr(down, name)) / (2 * step)
            found = getattr(told, f"slope_{name}")[k]
            assert found == pytest.approx(slope, abs=1e-7 * np.abs(slope).max())


def test_moduli_and_forces_in_other_units_feel_the_same(smooth):
    one, other = (smooth.felt(k * FORCE, k * MODULUS, k * 0.15, k * 0.04) for k in (1.0, 3.0))
    assert other.values == pytest.approx(one.values, rel=1e-9)
    assert other.indentation == pytest.approx(one.indentation, rel=1e-9)


def test_what_it_was_not_made_of_is_told(smooth):
    assert not smooth.inside([50.0], [0.5], 0.136, 0.034)[0]
    assert not smooth.inside([0.5], [100.0], 0.136, 0.034)[0]
    assert smooth.strained < np.inf and smooth.large_strain and np.isinf(smooth.friction)
    assert "block 10 mm thick" in repr(smooth)


def test_a_press_is_inside_up_to_the_deepest_one_at_the_nearest_ratio():
    """Made-up rows of E / E_inner, ratio and largest x: at twice the ratio the largest x is twice as large."""
    deepest = np.array([(e, ratio, 3.0 * ratio) for ratio in (2.0, 4.0) for e in (1.0, 100.0)]).T
    made = Response(np.zeros((1, 1)), deepest, np.inf, 0.0, False, np.zeros(1), 1, "made up")
    x = np.array([0.99, 1.01])
    for ratio, top in ((1.9, 6.0), (2.7, 6.0), (3.0, 12.0), (5.0, 12.0)):
        assert made.inside(0.03 * top * x, np.full(2, 0.3), ratio * 0.03, 0.03).tolist() == [True, False]


@pytest.mark.slow
def test_it_knows_no_unit_of_length_or_stress():
    """Responses, and changes beside the apex, of fingers with all lengths and moduli times a factor."""
    own = replace(Finger.default(), shape=Dome((20.0, 26.0, 19.0), (17.5, 23.5, 16.5), (9.0, 13.0, 6.0)))
    length, stress = 0.4, 10.0
    felt, moved = [], []
    for of_length, of_stress in ((1.0, 1.0), (length, stress)):
        finger = scaled_finger(own, of_length, of_stress)
        relatives = family(finger, size_mm=4 * default_size_mm(finger))
        block, force = Block(1.0, 10.0 * of_length), of_length**2 * of_stress * FORCE
        smooth = response(relatives, block, friction=0.0)
        layers = 0.136 * of_stress, 0.034 * of_stress
        told = smooth.felt(force, of_stress * MODULUS, *layers)
        assert smooth.inside(force, of_stress * MODULUS, *layers).all()
        felt.append(np.column_stack([told.indentation / of_length, told.values[:, 0], of_length * told.values[:, 1]]))
        place, shift = np.tile([2.0 * of_length, 1.0 * of_length], (5, 1)), np.full((2, 5), of_length)
        change = off_apex_change(relatives, block, 0.0)
        values = change.changed(force, of_stress * MODULUS, *layers, place, shift).values
        moved.append(np.column_stack([values[:, 0], of_length * values[:, 1]]))
    assert felt[1] == pytest.approx(felt[0], rel=1e-6, abs=1e-7 * np.abs(felt[0]).max())
    assert moved[1] == pytest.approx(moved[0], rel=1e-6, abs=1e-7 * np.abs(moved[0]).max())
