"""Friction in both directions from a simulated stick and slide, its offset, its faults and its contract."""

import dataclasses
import math
import pickle

import numpy as np
import pytest

from papilla.errors import InputError
from papilla.estimators.friction import Friction, FrictionStatus

OFFSET_N = 0.3


def slide(forward=0.5, backward=0.4, static=0.8, swing=0.3, seconds=12.0, rate=1000.0, one_way=False, seed=0):
    """(n, 3) of rest, slide, rest, slide back, each 1 s; at rest the pull grows to the static limit, then gives way."""
    time = np.arange(round(seconds * rate)) / rate
    phase = time % 4
    velocity = np.select([phase < 1, phase < 2, phase < 3], [0.0, 30.0, 0.0], 0.0 if one_way else -30.0)
    normal = 1 + swing * np.sin(2 * np.pi * 0.7 * time)
    heading = np.where(phase < 2, 1.0, -1.0)
    coefficient = np.where(velocity == 0, static * (phase % 1) ** 2, np.where(velocity > 0, forward, backward))
    if one_way:
        coefficient = np.where(phase < 2, coefficient, 0.0)
    generator = np.random.default_rng(seed)
    tangential = heading * coefficient * normal + OFFSET_N + generator.normal(0, 0.005, time.size)
    return np.column_stack([tangential, normal + generator.normal(0, 0.003, time.size), velocity])


def same(first, second) -> bool:
    return all(np.array_equal(a, b, equal_nan=True) for a, b in zip(first, second, strict=True))


def test_both_directions_and_the_offset_are_found_when_the_force_varies():
    estimator = Friction()
    answer = estimator.process(slide())
    forward, backward = estimator.coefficients
    assert forward.mu_kinetic == pytest.approx(0.5, abs=0.005) and backward.mu_kinetic == pytest.approx(0.4, abs=0.005)
    assert forward.offset_N == pytest.approx(OFFSET_N, abs=0.005)
    assert forward.mu_static == pytest.approx(0.8, abs=0.03) and backward.mu_static == pytest.approx(0.8, abs=0.03)
    assert forward.status == FrictionStatus.OK and forward.sentence == "ok"
    last = answer.status[-1], answer.mu_kinetic[-1], answer.mu_static[-1]
    assert last == (backward.status, backward.mu_kinetic, backward.mu_static)
    at_three_seconds = answer.mu_kinetic[9900]
    assert at_three_seconds == pytest.approx(0.5, abs=0.01), "sliding forward, the answer is that of forward"


def test_a_steady_force_makes_the_directions_alike_and_says_so():
    estimator = Friction()
    estimator.process(slide(forward=0.45, backward=0.45, swing=0.0))
    forward, backward = estimator.coefficients
    assert forward.status == backward.status == FrictionStatus.ALIKE
    assert forward.mu_kinetic == pytest.approx(0.45, abs=0.005) == backward.mu_kinetic
    assert forward.offset_N == pytest.approx(OFFSET_N, abs=0.005)
    other = Friction()
    other.process(slide(forward=0.5, backward=0.4, swing=0.0))
    assert other.coefficients[0].mu_kinetic == pytest.approx(0.45, abs=0.005), "their mean, as the status confesses"
    assert "taken as alike" in other.coefficients[0].sentence


def test_one_direction_only_leaves_the_offset_in_and_says_so():
    estimator = Friction()
    answer = estimator.process(slide(one_way=True, seconds=3.0))
    assert answer.status[-1] == FrictionStatus.ONE_WAY and answer.offset_N[-1] == 0.0
    assert answer.mu_kinetic[-1] == pytest.approx(0.5 + OFFSET_N, abs=0.1)
    assert math.isnan(estimator.coefficients[1].mu_kinetic)


def test_a_slower_filter_lowers_the_breakaway_but_not_the_kinetic_value():
    found = []
    for corner in (50.0, 5.0, 1.0):
        estimator = Friction(low_pass_Hz=corner)
        estimator.process(slide(seconds=24.0))
        found.append(estimator.coefficients[0])
    statics = [one.mu_static for one in found]
    assert statics == sorted(statics, reverse=True) and statics[-1] < 0.7
    np.testing.assert_allclose([one.mu_kinetic for one in found], 0.5, atol=0.01)


def test_no_movement_no_contact_and_faults_are_statuses():
    rows = slide(seconds=2.0)
    estimator = Friction()
    assert (estimator.process(rows[:1000]).status == FrictionStatus.NOT_SLIDING).all()
    before = estimator.state
    for bad in ((math.nan, 1.0, 0.0), (0.1, math.inf, 3.0), (0.1, 1.0, math.nan)):
        assert estimator.update(bad).status == FrictionStatus.BAD_INPUT
    assert estimator.state == before
    assert estimator.update((0.1, 0.0, 30.0)).status == FrictionStatus.NO_CONTACT
    assert all(isinstance(text, str) for text in estimator.process(rows[:5]).sentence)


def test_chunks_states_and_reset():
    rows = slide(seconds=9.0)
    rows[4321, 0] = np.nan
    whole = Friction().process(rows)
    parts, single = Friction(), Friction()
    chunked = [parts.process(part) for part in np.split(rows, [1, 17, 4300, 4322])]
    assert same([np.concatenate(values) for values in zip(*chunked, strict=True)], whole)
    assert same([np.array(v) for v in zip(*[single.update(row) for row in rows.tolist()], strict=True)], whole)
    first, second = Friction(), Friction()
    first.process(rows[:5200])
    second.state = pickle.loads(pickle.dumps(first.state))
    assert same(first.process(rows[5200:]), second.process(rows[5200:]))
    second.reset()
    assert same(second.process(rows), whole)
    with pytest.raises(dataclasses.FrozenInstanceError):
        first.state.heading = 0


def test_old_sliding_is_forgotten():
    estimator = Friction(memory_s=0.5)
    estimator.process(slide(forward=0.9, backward=0.9))
    estimator.process(slide(forward=0.3, backward=0.3, seconds=24.0))
    assert estimator.coefficients[0].mu_kinetic == pytest.approx(0.3, abs=0.02)


def test_unusable_parameters_and_rows_are_refused():
    with pytest.raises(InputError, match="low_pass_Hz must be below half of sample_rate_Hz, got 500 at 1000 Hz"):
        Friction(low_pass_Hz=500)
    with pytest.raises(InputError, match="rest_mm_s must be greater than 0"):
        Friction(rest_mm_s=0)
    with pytest.raises(InputError, match="n x 3 .* got 4 x 2"):
        Friction().process(np.zeros((4, 2)))
    with pytest.raises(InputError, match="got 2 values"):
        Friction().update((1.0, 2.0))
    assert Friction().process(np.zeros((0, 3))).status.shape == (0,)
