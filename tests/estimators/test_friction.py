"""Friction in both directions from a simulated stick and slide, its offset, its faults and its contract."""

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
    for known, true in ((forward, 0.45), (backward, 0.45)):
        assert known.mu_kinetic == pytest.approx(true, abs=0.01) and 0.015 < known.mu_kinetic_sigma < 0.03
    assert forward.offset_N == pytest.approx(OFFSET_N, abs=0.01)
    other = Friction()
    other.process(slide(forward=0.5, backward=0.4, swing=0.0))
    for known, true in zip(other.coefficients, (0.5, 0.4), strict=True):
        assert known.mu_kinetic == pytest.approx(0.45, abs=0.01), "about their mean, as the status confesses"
        assert abs(known.mu_kinetic - true) < 3 * known.mu_kinetic_sigma, "and the stated sigma knows"
    assert "they share the difference" in other.coefficients[0].sentence


def test_one_direction_only_leaves_the_offset_in_and_says_so():
    estimator = Friction()
    answer = estimator.process(slide(one_way=True, seconds=3.0))
    assert answer.status[-1] == FrictionStatus.ONE_WAY
    assert abs(answer.mu_kinetic[-1] - 0.5) < 2 * answer.mu_kinetic_sigma[-1], "the sensor's offset is in its sigma"
    steady = Friction()
    steady.process(slide(one_way=True, swing=0.0, seconds=3.0))
    known = steady.coefficients[0]
    assert known.mu_kinetic == pytest.approx(0.5 + OFFSET_N, abs=0.05) and 0.18 < known.mu_kinetic_sigma < 0.22
    assert math.isnan(estimator.coefficients[1].mu_kinetic)


@pytest.mark.slow
def test_a_slower_filter_lowers_the_breakaway_but_not_the_kinetic_value():
    found = []
    for corner in (50.0, 5.0, 2.0):
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
    before = repr(estimator.state)
    for bad in ((math.nan, 1.0, 0.0), (0.1, math.inf, 3.0), (0.1, 1.0, math.nan)):
        assert estimator.update(bad).status == FrictionStatus.BAD_INPUT
    assert repr(estimator.state) == before
    assert estimator.process([(0.1, 0.0, 30.0)] * 5).status[-1] == FrictionStatus.NO_CONTACT
    assert all(isinstance(text, str) for text in estimator.process(rows[:5]).sentence)


@pytest.mark.slow
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


def swipe(first, then, seconds=2.0, speed=50.0, rate=1000.0, scatter=0.003, seed=0):
    """(n, 3) of one swipe whose kinetic coefficient changes in its middle."""
    count = round(seconds * rate)
    mu = np.where(np.arange(count) < count / 2, first, then)
    generator = np.random.default_rng(seed)
    return np.column_stack([mu + generator.normal(0, scatter, count), np.ones(count), np.full(count, speed)])


def test_a_change_of_friction_is_seen_within_a_few_millimetres_and_said():
    answer = Friction(offset_sigma_N=1e-3).process(swipe(0.422, 0.280))
    before, after = answer.mu_kinetic[900:1000], answer.mu_kinetic[1100:]
    np.testing.assert_allclose(before, 0.422, atol=0.005)
    np.testing.assert_allclose(after, 0.280, atol=0.005)
    changed = np.flatnonzero(answer.status == FrictionStatus.CHANGED)
    assert 1020 < changed[0] < 1100 and changed[-1] < 1300, "said 1 to 5 mm after it, and not for ever"
    assert len(changed) > 30 and (np.diff(changed) == 1).all(), "until as much was learnt anew"


def test_a_slow_drift_is_followed_and_old_sliding_is_forgotten():
    rows = swipe(0.5, 0.5, seconds=8.0)
    rows[:, 0] += np.linspace(0, 0.1, len(rows))
    for memory in (10.0, 20.0, 40.0):
        found = Friction(offset_sigma_N=1e-3, memory_mm=memory).process(rows)
        assert found.mu_kinetic[-1] == pytest.approx(0.6 - 0.1 * memory / 400, abs=0.002), "one memory behind"


@pytest.mark.parametrize("column, value", [(1, 50.0), (1, 500.0), (1, 0.0), (0, 50.0), (0, -500.0), (2, 1e4)])
@pytest.mark.parametrize("samples", [1, 2])
def test_single_wrong_samples_leave_no_trace(column, value, samples):
    rows = slide(seconds=8.0)
    clean = Friction().process(rows)
    rows[5500 : 5500 + samples, column] = value
    found = Friction().process(rows)
    np.testing.assert_allclose(found.mu_kinetic[5600:], clean.mu_kinetic[5600:], atol=0.01)


def test_a_longer_burst_is_left_out_or_called_a_change_and_recovered_from():
    rows = slide(seconds=12.0)
    rows[5500:5540, 1] = 50.0
    found = Friction().process(rows)
    wrong = np.abs(found.mu_kinetic - np.where(rows[:, 2] < 0, 0.4, 0.5)) > 0.05
    sliding = (rows[:, 2] != 0) & (np.roll(rows[:, 2], 5) == rows[:, 2]) & (np.arange(len(rows)) > 4000)
    silent = wrong & sliding & (found.status == FrictionStatus.OK) & (found.mu_kinetic_sigma < 0.02)
    assert not silent.any()
    assert {FrictionStatus.OUTLIER, FrictionStatus.CHANGED} & set(found.status[5500:6000].tolist())
    assert found.mu_kinetic[-1] == pytest.approx(0.4, abs=0.01)


def test_a_breakaway_below_the_kinetic_friction_is_remarked_on():
    estimator = Friction(low_pass_Hz=5.0, onset_s=0.002)
    estimator.process(slide(static=0.3))
    assert estimator.coefficients[0].status == FrictionStatus.STATIC_BELOW_KINETIC


@pytest.mark.slow
def test_stated_sigmas_cover_what_is_drawn():
    """Offsets, directions and scatter over the path drawn from what the estimator takes for granted."""
    inside, trials = 0, 60
    for seed in range(trials):
        generator = np.random.default_rng(seed)
        mean, apart = generator.uniform(0.2, 0.8), generator.normal(0, 0.05)
        rows = slide(mean + apart / 2, mean - apart / 2, swing=generator.uniform(0, 0.4), seconds=8.0, seed=seed)
        rows[:, 0] += generator.normal(0, 0.2) - OFFSET_N
        found = Friction(onset_s=0.05)
        found.process(rows)
        truths = zip(found.coefficients, (mean + apart / 2, mean - apart / 2), strict=True)
        inside += sum(abs(known.mu_kinetic - true) < 2 * known.mu_kinetic_sigma for known, true in truths)
    assert 0.9 <= inside / (2 * trials) <= 1.0


def test_unusable_parameters_and_rows_are_refused():
    with pytest.raises(InputError, match="low_pass_Hz must be below half of sample_rate_Hz, got 500 at 1000 Hz"):
        Friction(low_pass_Hz=500)
    with pytest.raises(InputError, match="rest_mm_s must be greater than 0"):
        Friction(rest_mm_s=0)
    with pytest.raises(InputError, match="memory_mm must be greater than 0"):
        Friction(memory_mm=0)
    with pytest.raises(InputError, match="n x 3 .*got 4 x 2"):
        Friction().process(np.zeros((4, 2)))
    with pytest.raises(InputError, match="got 2 values"):
        Friction().update((1.0, 2.0))
    assert Friction().process(np.zeros((0, 3))).status.shape == (0,)


def test_readings_without_any_noise_keep_a_sigma():
    found = Friction().process(swipe(0.5, 0.5, seconds=20.0, scatter=0.0))
    assert np.isfinite(found.mu_kinetic[1000:]).all() and (found.mu_kinetic_sigma[1000:] > 1e-4).all()


def strokes(noise_mm_s, speed, seed=0):
    """Rests of 1 s and strokes of 3 s both ways, mu 0.4, the static peak 0.5; noise of the velocity alone."""
    time = np.arange(0, 16, 0.002)
    moving = (time % 4.0) > 1.0
    velocity = np.where(moving, np.where(time % 8 < 4, speed, -speed), 0.0)
    start = moving & ((time % 4.0) < 1.05)
    tangential = 0.05 + np.sign(velocity) * np.where(start, 0.25, 0.2)
    measured = velocity + noise_mm_s * np.random.default_rng(seed).normal(size=len(time))
    return np.column_stack([tangential, np.full(len(time), 0.5), measured])


@pytest.mark.parametrize("noise_mm_s, speed", [(0.0, 0.5), (0.02, 0.8), (3.0, 60.0)])
def test_rests_are_recognised_by_the_noise_of_the_velocity(noise_mm_s, speed):
    """Slower than 1 mm/s it slides too, and noise far above 1 mm/s is not sliding."""
    samples = strokes(noise_mm_s, speed)
    answer = Friction(sample_rate_Hz=500.0).process(samples)
    assert answer.mu_kinetic[-1] == pytest.approx(0.4, abs=0.02)
    assert answer.mu_static[-1] == pytest.approx(0.5, abs=0.03)
    if speed < 1:
        assert np.isnan(Friction(sample_rate_Hz=500.0, rest_mm_s=1.0).process(samples).mu_kinetic[-1])


def test_a_static_below_the_kinetic_is_remarked_on_one_way_too():
    time = np.arange(3000) / 1000
    velocity = np.where((time % 1.0) > 0.3, 30.0, 0.0)
    tangential = np.where((time % 1.0) > 0.5, 0.3, 0.1) * (velocity > 0)
    answer = Friction(offset_sigma_N=1e-3).process(np.column_stack([tangential, np.full(3000, 0.5), velocity]))
    assert answer.mu_static[-1] < answer.mu_kinetic[-1]
    assert answer.status[-1] == FrictionStatus.STATIC_BELOW_KINETIC
