"""Friction look by look: the filter against its equations, and each limit from both of its sides."""

import math
from dataclasses import replace

import numpy as np
import pytest

from papilla.errors import InputError
from papilla.estimators.friction import Friction, FrictionState, FrictionStatus, Look

STEADY = (0.4, 1.0, 30.0)


def look_of(mu, normal, samples=20, path=0.5):
    return Look(samples, path, samples * mu * normal, samples * normal)


def taught(looks, way=1, **options):
    """An estimator after looks (tangential over normal, normal) in a direction."""
    own = Friction(**options)
    for mu, normal in looks:
        own._memory.heading = way
        own._learn(look_of(mu, normal))
    return own


def test_the_prior_knows_that_directions_are_alike_and_no_more():
    P = Friction(offset_sigma_N=0.3)._prior
    mean, apart, offset = np.array([0.5, 0.5, 0]), np.array([1.0, -1, 0]), np.array([0, 0, 1.0])
    assert [way @ P @ way for way in (mean, apart, offset)] == pytest.approx([1.0, 0.05**2, 0.09])
    assert mean @ P @ apart == pytest.approx(0) and mean @ P @ offset == 0


@pytest.mark.parametrize("way", [1, -1])
def test_a_look_is_kalmans_correction(way):
    """T = offset + mu N one way, offset - mu N the other, with a scatter of mu N."""
    mu, normal = 0.45, 0.8
    own = taught([(way * mu, normal)], way)
    P = Friction()._prior
    H = np.array([normal, 0, 1]) if way > 0 else np.array([0, -normal, 1])
    S = H @ P @ H + (0.02 * normal) ** 2
    gain = P @ H / S
    memory = own._memory
    np.testing.assert_allclose(memory.x, gain * way * mu * normal, rtol=1e-12)
    np.testing.assert_allclose(memory.P, P - np.outer(gain, H @ P), rtol=1e-7, atol=1e-12)
    # A residual's square is S on average; the look weighs beside four that are taken for granted.
    share = (way * mu * normal) ** 2 * 0.02**2 / S
    assert memory.scatter == pytest.approx((4 * 0.02**2 + share) / 5) and memory.looks == 5
    assert memory.slid == (way > 0, way < 0)
    found = own.coefficients[0 if way > 0 else 1]
    assert found.mu_kinetic == pytest.approx(memory.x[0 if way > 0 else 1]) and found.status == FrictionStatus.ONE_WAY
    assert found.offset_sigma_N == pytest.approx(memory.P[2, 2] ** 0.5)


def test_looks_both_ways_at_two_forces_tell_all_three():
    own = Friction()
    for number in range(40):
        normal, way = 0.5 + number % 2, 1 if number % 4 < 2 else -1
        own._memory.heading = way
        own._learn(Look(10, 0.5, 10 * (0.1 + way * (0.5 if way > 0 else 0.4) * normal), 10 * normal))
    forward, backward = own.coefficients
    assert (forward.mu_kinetic, backward.mu_kinetic, forward.offset_N) == pytest.approx((0.5, 0.4, 0.1), abs=3e-3)
    assert forward.status == FrictionStatus.OK


@pytest.mark.parametrize("way", [1, -1])
def test_a_direction_that_was_slid_stays_known_while_the_other_is_slid(way):
    own = taught([(way * 0.4, 1.0)], way)
    own._memory.heading = -way
    own._learn(look_of(-way * 0.4, 1.0))
    assert own._memory.slid == (True, True) and own.coefficients[0].status == FrictionStatus.ALIKE


def test_what_was_learnt_of_a_direction_fades_over_the_slid_path():
    """What its looks tell beyond the others: its variance, all else known, grows by e over the memory."""
    own = taught([(0.4, 1.0), (0.45, 0.5)] * 10, memory_mm=20.0)
    before = own._memory.P.copy()
    for path in (5.0, 20.0):
        own._memory.P = before.copy()
        own._fade(0, path)
        alone = 1 / np.linalg.inv(own._memory.P)[0, 0]
        assert alone == pytest.approx(math.exp(path / 20.0) / np.linalg.inv(before)[0, 0])
        assert np.count_nonzero(before != own._memory.P) == 1
    own._fade(0, 1e3)
    assert own._memory.P[0, 0] == pytest.approx(1.0), "no more than was unknown before"
    own._memory.P[0, 0] = 2.0
    own._fade(0, 1.0)
    assert own._memory.P[0, 0] == 2.0


def test_a_look_five_sigmas_off_is_left_out_and_the_fourth_in_a_row_is_a_change():
    for sigmas, remark in ((4.9, FrictionStatus.OK), (5.1, FrictionStatus.OUTLIER)):
        own = taught([(0.4, 1.0)] * 30)
        memory = own._memory
        own._fade(0, 0.5)
        spread = memory.P[0, 0] + memory.P[2, 2] + 2 * memory.P[0, 2] + memory.scatter
        before, learnt = memory.x.copy(), memory.looks
        off = float(before[0] + before[2]) + sigmas * math.sqrt(spread)
        own._learn(look_of(off, 1.0, path=1e-12))
        assert memory.remark == remark
        assert np.array_equal(memory.x, before) == (remark == FrictionStatus.OUTLIER)
        assert memory.looks == learnt + (remark == FrictionStatus.OK)
    own, told = taught([(0.4, 1.0)] * 30), []
    for _ in range(9):
        own._learn(look_of(0.9, 1.0))
        told.append(own.coefficients[0].status)
    outlier, changed, one_way = FrictionStatus.OUTLIER, FrictionStatus.CHANGED, FrictionStatus.ONE_WAY
    assert told == [outlier] * 3 + [changed] * 4 + [one_way] * 2
    assert own.coefficients[0].mu_kinetic == pytest.approx(0.9, abs=0.1)
    own = taught([(0.4, 1.0)] * 30)
    for mu in (0.9, 0.9, 0.9, 0.4, 0.9, 0.9, 0.9):
        own._learn(look_of(mu, 1.0))
    assert own._memory.remark == outlier and own._memory.contradicting == 3, "three in a row and three again"


def test_after_a_change_both_directions_are_learnt_anew_and_the_offset_stays():
    own = taught([(0.4, 1.0), (0.4, 0.5)] * 15)
    own._memory.heading = -1
    for normal in (1.0, 0.5) * 15:
        own._learn(look_of(-0.4, normal))
    offset, spread = own._memory.x[2], own._memory.P[2, 2]
    for _ in range(4):
        own._learn(look_of(-0.9, 1.0))
    memory = own._memory
    assert memory.slid == (False, True) and math.isnan(own.coefficients[0].mu_kinetic)
    assert memory.x[2] == pytest.approx(offset, abs=3 * spread**0.5) and memory.P[2, 2] <= spread * (1 + 1e-9)
    assert memory.looks == 5 and memory.x[1] == pytest.approx(0.9, abs=0.02)


def test_the_scatter_is_that_of_the_looks_and_never_below_a_thousandth():
    assert taught([(0.4, 1.0)] * 2000)._memory.scatter >= 1e-6
    rng = np.random.default_rng(0)
    own = taught([(0.4 + 0.03 * rng.standard_normal(), 1.0) for _ in range(400)], memory_mm=200.0)
    assert math.sqrt(own._memory.scatter) == pytest.approx(0.03, rel=0.25)
    assert own._memory.looks == 400 and taught([(0.4, 1.0)] * 50, memory_mm=10.0)._memory.looks == 20


def answered(way=0, **known):
    own = Friction()
    P = np.diag([1e-4, 1e-4, 4e-4])
    state = {"P": P, "x": np.array([0.5, 0.4, 0.1]), "slid": (True, True), "scatter": 1e-4,
             "breakaway": ((0.9, 1.25), (0.5, 1.0))}  # fmt: skip
    own.state = FrictionState(**(state | known))
    return own.coefficients[way]


def test_the_static_coefficient_is_the_peak_less_the_offset_over_the_force_then():
    forward, backward = answered(), answered(1)
    assert (forward.mu_kinetic, backward.mu_kinetic, forward.offset_N) == (0.5, 0.4, 0.1)
    assert forward.mu_static == pytest.approx((0.9 - 0.1) / 1.25) and backward.mu_static == pytest.approx(0.5 + 0.1)
    assert forward.mu_static_sigma == pytest.approx(math.hypot(0.02 / 1.25, 0.01))
    assert (forward.mu_kinetic_sigma, forward.offset_sigma_N) == pytest.approx((0.01, 0.02))
    never = answered(breakaway=((math.nan, math.nan), (-math.inf, 0.0)))
    assert math.isnan(never.mu_static) and math.isnan(never.mu_static_sigma)


@pytest.mark.parametrize(
    "known, status",
    [
        ({"P": np.diag([3e-4, 3e-4, 1e-4])}, FrictionStatus.OK),
        ({"P": np.diag([4e-4, 3e-4, 1e-4])}, FrictionStatus.ALIKE),
        ({"P": np.array([[4e-4, 1e-4, 0], [1e-4, 3e-4, 0], [0, 0, 1e-4]])}, FrictionStatus.OK),
        ({"slid": (True, False)}, FrictionStatus.ONE_WAY),
        ({"slid": (False, False)}, FrictionStatus.NOT_SLIDING),
        ({"breakaway": ((0.595, 1.0), (0.9, 1.0))}, FrictionStatus.OK),
        ({"breakaway": ((0.585, 1.0), (0.9, 1.0))}, FrictionStatus.STATIC_BELOW_KINETIC),
        ({"breakaway": ((0.585, 1.0), (0.9, 1.0)), "scatter": 4e-4}, FrictionStatus.OK),
        ({"breakaway": ((0.1, 1.0), (0.9, 1.0)), "remark": 5}, FrictionStatus.CHANGED),
        ({"breakaway": ((0.1, 1.0), (0.9, 1.0)), "slid": (True, False)}, FrictionStatus.STATIC_BELOW_KINETIC),
    ],
)
def test_the_status_says_what_is_missing(known, status):
    """Directions are told apart at 0.025, a breakaway within two scatters of the kinetic friction is not below it."""
    assert answered(**known).status == status


def statuses(rows, **options):
    return [int(status) for status in Friction(**options).process(rows).status]


@pytest.mark.parametrize("speed, first", [(30.0, 100 + 17), (60.0, 100 + 16), (10.0, 100 + 50), (4.0, 100 + 125)])
def test_a_look_is_half_a_millimetre_of_steady_sliding(speed, first):
    """100 ms after the start, and no shorter than the low-pass tells things apart."""
    found = statuses([(0.4, 1.0, speed)] * (first + 1))
    assert found.index(FrictionStatus.ONE_WAY) == first - 1
    assert set(found[: first - 1]) == {FrictionStatus.NOT_SLIDING}
    soon = statuses([(0.4, 1.0, 30.0)] * 80, onset_s=0.01)
    assert soon.index(FrictionStatus.ONE_WAY) == 40 + 17 - 1, "five time constants of 20 Hz are 40 ms"


def test_below_the_rest_speed_the_finger_rests():
    for speed, rests in ((0.99, True), (1.01, False)):
        own = Friction(rest_mm_s=1.0)
        own.process([(0.4, 1.0, speed)] * 30)
        assert (own._memory.heading == 0) == rests
    # And below 2 % of the greatest recent speed; at the same speed, long after, it is slow sliding.
    for speed, rests in ((0.59, True), (0.61, False)):
        own = Friction(rest_mm_s=0.1)
        own.process([STEADY] * 200)
        own._memory.velocity, own._memory.recent = speed, ((0.4, 1.0, speed),) * 5
        own._memory.before = speed, speed
        own.process([(0.4, 1.0, speed)] * 3)
        assert (own._memory.sliding == 0) == rests
    own = Friction(rest_mm_s=0.1, memory_mm=1.0)
    own._memory.top = 100.0
    own.process([(0.4, 1.0, 1.0)] * 2000)
    assert own._memory.top == pytest.approx(100 * math.exp(-2.0), rel=0.01)


@pytest.mark.parametrize("way", [1, -1])
def test_the_breakaway_is_the_greatest_pull_from_rest_to_the_onset(way):
    """In the rest before and 100 ms after it; what the other direction pulls does not count."""
    rest, moving = [(way * 0.7, 1.0, 0.0)] * 50, [(way * 0.4, 1.0, way * 30.0)] * 104
    own = Friction(rest_mm_s=1.0, low_pass_Hz=400.0)
    own.process([(-way * 2.0, 1.0, 0.0)] * 20 + rest + moving)
    peak, normal = own._memory.breakaway[0 if way > 0 else 1]
    assert peak == pytest.approx(0.7, abs=1e-6) and normal == pytest.approx(1.0)
    assert math.isnan(own._memory.breakaway[1 if way > 0 else 0][0])
    # A peak that comes after the onset is none.
    late = Friction(rest_mm_s=1.0, low_pass_Hz=400.0)
    late.process(rest + [(way * 0.4, 1.0, way * 30.0)] * 105 + [(way * 0.9, 1.0, way * 30.0)] * 20)
    assert late._memory.breakaway[0 if way > 0 else 1][0] == pytest.approx(0.7, abs=1e-6)
    # A turn without a rest has only the time after it.
    turned = Friction(rest_mm_s=1.0, low_pass_Hz=400.0)
    turned.process(rest + moving + [(-way * 0.5, 1.0, -way * 30.0)] * 110)
    assert turned._memory.breakaway[1 if way > 0 else 0][0] == pytest.approx(0.5, abs=1e-3)


def test_lost_contact_ends_a_start_and_a_look():
    for normal, status in ((0.0201, FrictionStatus.NOT_SLIDING), (0.0199, FrictionStatus.NO_CONTACT)):
        assert statuses([(0.001, normal, 30.0)] * 5)[-1] == status
    own = Friction()
    own.process([STEADY] * 110)
    assert own._memory.look.samples == 10 and own._memory.sliding == 101
    own.process([(0.0, 0.0, 30.0)] * 3)
    assert own._memory.look == Look() and own._memory.sliding == 0


def test_forces_pass_a_median_of_five_and_a_low_pass():
    """63 % of a step after 1 / (2 pi f); two wrong samples leave no trace."""
    own = Friction(low_pass_Hz=20.0)
    own.process([(0.0, 1.0, 30.0)] * 20)
    found = []
    for _ in range(30):
        own.update((1.0, 2.0, 40.0))
        found.append((own._memory.tangential, own._memory.normal - 1, (own._memory.velocity - 30) / 10))
    settled = 1 - np.exp(-2 * np.pi * 20 * np.maximum(np.arange(30) - 1, 0) / 1000)
    np.testing.assert_allclose(np.array(found), settled[:, None] * np.ones(3), atol=1e-9)
    own = Friction()
    own.process([STEADY] * 20)
    before = replace(own._memory)
    own.process([(9.0, 9.0, 900.0)] * 2 + [STEADY] * 5)
    assert own._memory.tangential == pytest.approx(before.tangential) and own._memory.top == pytest.approx(
        before.top, rel=0.01
    )


@pytest.mark.parametrize("sigma", [0.5, 5.0])
def test_the_noise_of_the_velocity_is_told_from_its_movement(sigma):
    """White noise on a slow swing: after the median its standard deviation is 0.536 of what it was."""
    time = np.arange(6000) / 1000
    rng = np.random.default_rng(2)
    velocity = 50 * np.sin(2 * np.pi * 0.5 * time) + sigma * rng.standard_normal(6000)
    own = Friction()
    own.process(np.column_stack([np.zeros(6000), np.ones(6000), velocity]))
    assert own._memory.noise == pytest.approx(sigma, rel=0.2)


@pytest.mark.parametrize("rate, low_pass, usable", [(1000.0, 499.0, True), (1000.0, 500.0, False), (50.0, 20.0, True)])
def test_a_low_pass_is_below_half_of_the_rate(rate, low_pass, usable):
    if usable:
        assert Friction(sample_rate_Hz=rate, low_pass_Hz=low_pass).low_pass_Hz == low_pass
    else:
        with pytest.raises(InputError, match="low_pass_Hz must be below half of sample_rate_Hz, got 500 at 1000 Hz"):
            Friction(sample_rate_Hz=rate, low_pass_Hz=low_pass)
