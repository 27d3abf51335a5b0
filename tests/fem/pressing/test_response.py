"""The smooth response of a family against presses of its members, and its derivatives against differences."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.fem import press
from papilla.fem.pressing.response import Response, response
from papilla.fem.reduction.family import family
from papilla.model.finger import Dome, Finger
from papilla.model.specimen import Block, Sphere

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
@pytest.mark.parametrize("length", [0.3, 3.0])
def test_a_scaled_finger_feels_scaled_forces_alike(relatives, length):
    """Presses on balls, which are linear: strain is the same, curvature and indentation scale with the length."""
    finger = Finger.default()
    shape = Dome(
        *(
            tuple((length * np.array(axes)).tolist())
            for axes in (finger.shape.outer, finger.shape.interface, finger.shape.bone)
        )
    )
    gauges = tuple(
        replace(
            gauge,
            length_mm=length * gauge.length_mm,
            width_mm=length * gauge.width_mm,
            backing_mm=tuple(length * np.array(gauge.backing_mm)),
        )
        for gauge in finger.gauges
    )
    scaled = replace(finger, name="scaled", shape=shape, gauges=gauges, patch_radius=length * finger.patch_radius)
    there = response(family(scaled, size_mm=length * SIZE_MM), Sphere(1.0, radius=length * 15.0))
    here = response(relatives, Sphere(1.0, radius=15.0))
    one, other = here.felt(FORCE, MODULUS, 0.136, 0.034), there.felt(length**2 * FORCE, MODULUS, 0.136, 0.034)
    assert other.values[:, 0] == pytest.approx(one.values[:, 0], rel=1e-4)
    assert length * other.values[:, 1] == pytest.approx(one.values[:, 1], rel=1e-4)
    assert other.indentation / length == pytest.approx(one.indentation, rel=1e-4)
    assert (there.inside(length**2 * FORCE, MODULUS, 0.136, 0.034) == here.inside(FORCE, MODULUS, 0.136, 0.034)).all()
