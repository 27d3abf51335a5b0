"""Relaxing silicone: Prony series against quadrature, contact along a history against Lee and Radok's sphere."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from papilla.errors import ContactRangeError, InputError
from papilla.fem import prepare
from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.effects import creeping_press
from papilla.fem.reduction.compliance import half_space_compliance
from papilla.finger import Finger
from papilla.references import Prony, hertz_sphere, lee_radok_force, lee_radok_indentation
from papilla.specimen import Block, HalfSpace

SERIES = (Prony((0.3,), (2.0,)), Prony((0.2, 0.25), (0.5, 10.0)), Prony((), ()))
RADIUS, E_STAR = 10.0, 0.2


# ---- the series


@pytest.mark.parametrize("prony", SERIES)
def test_creep_undoes_relaxation(prony):
    """The integral of J(t - s) E(s) is t (Ferry, Viscoelastic Properties of Polymers, chapter 3)."""
    for t in (0.3, 2.0, 30.0):
        total = quad(lambda s, t=t: float(prony.creep(t - s) * prony.relaxation(s)), 0, t, epsabs=1e-12, limit=200)[0]
        assert total == pytest.approx(t, rel=1e-8)
    assert prony.relaxation(0) == prony.creep(0) == 1
    assert prony.creep(1e6) == pytest.approx(1 / prony.relaxation(1e6))


@pytest.mark.parametrize("prony", SERIES)
def test_strain_of_its_own_stress_comes_back(prony):
    time = np.linspace(0, 8, 4001)
    strain = 0.3 + np.sin(time) ** 2
    assert prony.strained(time, prony.stressed(time, strain)) == pytest.approx(strain, abs=1e-5)


@pytest.mark.parametrize(
    "shares, times, message",
    [
        ((0.5, 0.5), (1, 2), "sum to less than 1, got 1"),
        ((0.5,), (1, 2), "1 shares of relaxation and 2 times"),
        ((0.1, 0.1), (1, 1), "times must differ, got 1, 1 s"),
        ((0.1,), (0,), r"relaxation time \(s\) must be greater than 0"),
    ],
)
def test_series_that_are_none(shares, times, message):
    with pytest.raises(InputError, match=message):
        Prony(shares, times)


# ---- a sphere


@pytest.fixture(scope="module")
def half_space(disc):
    """A reduced 'finger' that is a half-space, touched by a ball: its patch of 16 rings has the ball's gap."""
    patch = disc(4.0, 16, lambda x, y: (x**2 + y**2) / (2 * RADIUS))
    reduced = prepare(Finger.default(), size_mm=2.8)
    compliance = half_space_compliance(patch)
    return replace(
        reduced,
        patch=patch,
        compliance=compliance / E_STAR,
        half_space=compliance,
        rows=np.zeros((2, 5, len(patch.xy))),
    )


@pytest.mark.parametrize("prony", SERIES[:2], ids=("one", "two"))
def test_a_sphere_pushed_in_and_held_is_lee_and_radoks(half_space, prony):
    """Ramp of 1 s and hold of 5 s. Errors of the mesh are in the elastic force alike: the ratio has none."""
    time = np.concatenate([np.linspace(0.02, 1, 50), np.linspace(1.05, 6, 100)])
    depth = np.minimum(time, 1.0) * 0.9
    found = creeping_press(half_space, HalfSpace(1e9), prony, time, indentation=depth)
    elastic = creeping_press(half_space, HalfSpace(1e9), Prony((), ()), time, indentation=depth)
    exact = lee_radok_force(time, depth, RADIUS, E_STAR, prony)
    hertz = np.array([4 / 3 * np.sqrt(RADIUS) * E_STAR * d**1.5 for d in depth])
    late = time > 0.3
    assert (found.force / elastic.force)[late] == pytest.approx((exact / hertz)[late], rel=4e-3)
    assert found.force[-1] == pytest.approx(exact[-1], rel=0.02)


def test_a_sphere_under_a_held_force_creeps_as_lee_and_radok_say(half_space):
    prony, time = SERIES[0], np.concatenate([np.linspace(0.02, 1, 50), np.linspace(1.05, 9, 160)])
    force = 0.35 * np.minimum(time, 1.0)
    found = creeping_press(half_space, HalfSpace(1e9), prony, time, force=force)
    exact = lee_radok_indentation(time, force, RADIUS, E_STAR, prony)
    assert found.indentation[40:] == pytest.approx(exact[40:], rel=0.01)
    at_once = hertz_sphere(0.35, RADIUS, E_STAR).indentation
    assert exact[-1] / at_once == pytest.approx(float(prony.creep(8.5)) ** (2 / 3), rel=2e-3)


def test_a_shrinking_contact_is_not_lee_and_radoks():
    with pytest.raises(InputError, match="must grow from 0"):
        lee_radok_force([0, 1, 2], [0.1, 0.2, 0.1], RADIUS, E_STAR, SERIES[0])


# ---- a finger


@pytest.fixture(scope="module")
def finger():
    return prepare(Finger.default(), size_mm=2.8)


def test_without_relaxation_every_state_is_a_press(finger):
    force = np.array([0.1, 0.4, 0.8, 0.3])
    found = creeping_press(finger, Block(0.3, 10), Prony((), ()), [0, 1, 2, 3], force=force)
    for k, one in enumerate(force):
        alone = contact_press(finger, Block(0.3, 10), (one, None))
        assert found.reading[k] == pytest.approx(alone.reading, rel=1e-9)
        assert found.indentation[k] == pytest.approx(alone.indentation)


def test_on_what_is_rigid_a_relaxing_finger_feels_as_under_its_equivalent_force(finger):
    """The correspondence principle: readings and depths are those of an elastic press by the crept force."""
    prony, time = SERIES[1], np.concatenate([np.linspace(0.01, 1, 100), np.linspace(1.1, 15, 140)])
    force, flat = 0.5 * np.minimum(time, 1.0), HalfSpace(1e6)
    found = creeping_press(finger, flat, prony, time, force=force)
    for k in (99, 150, 239):
        alone = contact_press(finger, flat, (float(prony.strained(time, force)[k]), None))
        assert found.indentation[k] == pytest.approx(alone.indentation, rel=2e-3)
        assert found.reading[k] == pytest.approx(alone.reading, rel=1e-2, abs=2e-3 * np.abs(alone.reading).max())


def test_long_after_a_finger_is_the_softer_one(finger):
    """A hold of 1000 relaxation times ends at the elastic press with relaxed moduli."""
    prony, block = SERIES[0], Block(0.1, 10)
    time = np.concatenate([np.linspace(0.1, 20, 100), [2000.0]])
    found = creeping_press(finger, block, prony, time, force=np.full(101, 0.4))
    soft = replace(finger, compliance=finger.compliance / 0.7, rows=finger.rows / 0.7)
    alone = contact_press(soft, block, (0.4, None))
    assert found.indentation[-1] == pytest.approx(alone.indentation, rel=1e-3)
    assert found.reading[-1] == pytest.approx(alone.reading, rel=1e-3, abs=1.0)


def test_a_loop_takes_up_work_and_an_elastic_one_none(finger):
    time = np.linspace(0, 2, 101)[1:-1]
    depth = 0.05 + 0.6 * (1 - np.abs(time - 1))
    lossy, elastic = (
        creeping_press(finger, HalfSpace(1.0), prony, time, indentation=depth) for prony in (SERIES[0], SERIES[2])
    )
    work = np.trapezoid(lossy.force[:50], lossy.indentation[:50])
    assert 0.05 * work < lossy.lost_work < 0.5 * work
    assert abs(elastic.lost_work) < 1e-9 * work


def test_histories_that_are_none(finger):
    block = Block(0.3, 10)
    for history, message in (
        ({"force": [0.1, 0.2], "indentation": [0.1, 0.2]}, "exactly one history"),
        ({}, "exactly one history"),
        ({"force": [0.1]}, "as many loads as times"),
        ({"force": [0.1, -0.1]}, "must be greater than 0"),
        ({"force": [0.1, np.nan]}, "must be greater than 0"),
    ):
        with pytest.raises(InputError, match=message):
            creeping_press(finger, block, SERIES[0], [0.0, 1.0], **history)
    with pytest.raises(InputError, match="times that rise"):
        creeping_press(finger, block, SERIES[0], [1.0, 1.0], force=[0.1, 0.2])
    with pytest.raises(ContactRangeError):
        creeping_press(finger, Block(0.01, 200), Prony((0.9,), (0.1,)), [0.0, 9.0], force=[3.0, 3.0])
