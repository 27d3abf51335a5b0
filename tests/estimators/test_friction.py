"""Friction in both directions: the kinds of logs that it was found wrong on, its offset, faults and contract."""

import warnings

import numpy as np
import pytest

from papilla.estimators.friction import Friction, FrictionStatus
from tests.support import friction_logs

OFFSET_N = 0.3


def slide(
    forward=0.5, backward=0.4, static=0.8, swing=0.3, seconds=12.0, rate=1000.0, one_way=False, air=False, seed=0
):
    """(n, 3) of rest, slide, rest, slide back, each 1 s; at rest the pull grows to the static limit, then gives way."""
    time = np.arange(round(seconds * rate)) / rate
    phase = time % 4
    velocity = np.select([phase < 1, phase < 2, phase < 3], [0.0, 30.0, 0.0], 0.0 if one_way else -30.0)
    normal = 1 + swing * np.sin(2 * np.pi * 0.7 * time)
    if air:
        normal = np.where(time < 0.5, 0.0, normal)
    heading = np.where(phase < 2, 1.0, -1.0)
    coefficient = np.where(velocity == 0, static * (phase % 1) ** 2, np.where(velocity > 0, forward, backward))
    if one_way:
        coefficient = np.where(phase < 2, coefficient, 0.0)
    generator = np.random.default_rng(seed)
    tangential = heading * coefficient * normal + OFFSET_N + generator.normal(0, 0.005, time.size)
    return np.column_stack([tangential, normal + generator.normal(0, 0.003, time.size), velocity])


def swipe(first, then, seconds=2.0, speed=50.0, rate=1000.0, scatter=0.003, seed=0):
    """(n, 3) of one swipe whose kinetic coefficient changes in its middle."""
    count = round(seconds * rate)
    mu = np.where(np.arange(count) < count / 2, first, then)
    generator = np.random.default_rng(seed)
    return np.column_stack([mu + generator.normal(0, scatter, count), np.ones(count), np.full(count, speed)])


def answered(scene):
    return Friction(sample_rate_Hz=scene.rate_Hz, **scene.options).process(scene.samples)


@pytest.mark.parametrize("kind", friction_logs.NAMED.values(), ids=friction_logs.NAMED)
def test_logs_of_the_kinds_that_it_was_wrong_on(kind):
    """Inside two sigma, and sigma at most 10 % where anything tells the offset."""
    for seed in (1001, 1002):
        scene = kind(seed)
        found = friction_logs.judge(scene, answered(scene))
        assert found.inside > 0.95 and found.answered > 0.95
        assert not found.false > 0.02
        assert found.sigma < 0.1 or not scene.told
        assert not found.static_inside < 1


@pytest.mark.slow
def test_stated_sigmas_cover_what_is_drawn():
    scenes = [friction_logs.drawn(seed) for seed in range(5000, 5040)]
    found = [friction_logs.judge(scene, answered(scene)) for scene in scenes]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        assert np.nanmean([one.inside for one in found]) > 0.95
    ok = np.array([one.ok for one in found])
    assert np.nansum(ok * np.nan_to_num([one.false for one in found])) < 0.05 * ok.sum() and ok.mean() > 0.4


def test_air_tells_the_directions_apart():
    estimator = Friction()
    answer = estimator.process(slide(air=True))
    for known, true in zip(estimator.coefficients, (0.5, 0.4), strict=True):
        assert known.mu_kinetic == pytest.approx(true, abs=0.01) and known.status == FrictionStatus.OK
        assert known.mu_static == pytest.approx(0.8, abs=0.03)
    assert answer.mu_kinetic[9900] == pytest.approx(0.5, abs=0.015), "sliding forward, the answer is that of forward"
    once = Friction().process(slide(air=True, one_way=True, seconds=3.0))
    assert once.mu_kinetic[-1] == pytest.approx(0.5, abs=0.01) and once.status[-1] == FrictionStatus.OK


@pytest.mark.parametrize("then", [0.28, 0.6])
def test_a_step_of_friction_is_followed_within_three_tenths_of_a_second_and_said(then):
    answer = Friction(offset_sigma_N=1e-3).process(swipe(0.422, then))
    before, after = answer.mu_kinetic[900:1000], answer.mu_kinetic[1300:]
    np.testing.assert_allclose(before, 0.422, atol=0.005)
    np.testing.assert_allclose(after, then, atol=0.01)
    changed = np.flatnonzero(answer.status == FrictionStatus.CHANGED)
    assert 1080 < changed[0] < 1200 and changed[-1] < 1350 and (np.diff(changed) == 1).all(), "and not for ever"


def broken_away(rate, peak=0.42, kinetic=0.32, seconds=3.0, noise=0.002):
    """(n, 3): at rest the pull grows, gives way in a triangle of 15 ms, and slides."""
    time = np.arange(round(seconds * rate)) / rate
    shape = np.clip(1 - np.abs(time - 1.0) / 0.0075, 0, 1)
    pull = np.where(time < 1, kinetic * np.clip(time / 0.9, 0, 1) ** 2, kinetic) + (peak - kinetic) * shape
    pull += np.random.default_rng(3).normal(0, noise, len(time))
    return np.column_stack([pull, np.ones(len(time)), np.where(time > 1.0075, 40.0, 0.0)])


def test_a_breakaway_of_15_ms_is_seen_where_the_rate_allows_it_and_else_not_told():
    for rate in (500.0, 1000.0, 2000.0):
        found = Friction(sample_rate_Hz=rate, offset_sigma_N=1e-3).process(broken_away(rate))
        assert abs(found.mu_static[-1] - 0.42) < 2 * found.mu_static_sigma[-1] < 0.1
        assert found.mu_static[-1] == pytest.approx(0.42, abs=0.02) and found.status[-1] == FrictionStatus.OK
    for rate in (10.0, 100.0):
        found = Friction(sample_rate_Hz=rate, offset_sigma_N=1e-3).process(broken_away(rate))
        assert np.isnan(found.mu_static).all() and found.status[-1] == FrictionStatus.OK


@pytest.mark.parametrize("column, value", [(1, 50.0), (1, 500.0), (1, 0.0), (0, 50.0), (0, -500.0), (2, 1e4)])
@pytest.mark.parametrize("samples", [1, 2])
def test_single_wrong_samples_leave_no_trace(column, value, samples):
    rows = slide(seconds=8.0)
    clean = Friction().process(rows)
    rows[5500 : 5500 + samples, column] = value
    found = Friction().process(rows)
    np.testing.assert_allclose(found.mu_kinetic[5600:], clean.mu_kinetic[5600:], atol=0.01)


@pytest.mark.parametrize("seed", range(6))
def test_a_finger_that_goes_the_other_way_feels_the_same_friction(seed):
    scene = friction_logs.drawn(7000 + seed)
    mirrored = scene.samples * (-1, 1, -1)
    once, other = (
        Friction(sample_rate_Hz=scene.rate_Hz, **scene.options).process(x) for x in (scene.samples, mirrored)
    )
    for name in ("mu_kinetic", "mu_static", "mu_kinetic_sigma", "mu_static_sigma", "offset_sigma_N"):
        np.testing.assert_allclose(getattr(other, name), getattr(once, name), rtol=1e-9, err_msg=name)
    np.testing.assert_allclose(other.offset_N, -once.offset_N, rtol=1e-9, atol=1e-12)
    np.testing.assert_array_equal(other.status, once.status)
