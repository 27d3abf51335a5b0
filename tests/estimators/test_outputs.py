"""Which gauge is followed without a velocity, when a delay is told, and the means of friction, against closed forms."""

import math

import numpy as np
import pytest

from papilla.estimators.friction.direction import BREAKAWAY_MEDIAN_SAMPLES, Direction
from papilla.estimators.friction.offset import BlockMeans, ForceOffset, Source, combined
from papilla.estimators.pipeline.clock import Tick
from papilla.estimators.pipeline.outputs import FrequencyOutput, SampleRow, WavelengthOutput

RATE = 1000.0


@pytest.mark.parametrize("ratio, followed", [(3.6, 0), (4.4, 1)])
def test_another_gauge_is_followed_if_its_variance_is_four_times_as_great(ratio, followed):
    """The variance of the last tenth of a second; both begin alike, so that the first one is followed."""
    output = FrequencyOutput(2, RATE)
    for number in range(1600):
        wave = math.sin(2 * math.pi * 60 * number / RATE)
        second = 5 + (0.5 if number < 400 else math.sqrt(ratio)) * wave
        output.take(SampleRow((wave, second), (), math.nan, math.nan, Tick(0, time_s=number / RATE)))
    _, gauge, moments = output.state
    assert gauge == followed
    assert [power for _, power in moments] == pytest.approx([0.5, 0.5 * ratio], rel=0.08)
    assert [mean for mean, _ in moments] == pytest.approx([0, 5], abs=0.1)


@pytest.mark.parametrize(
    "late_ms, sigma_ms, message", [(1.6, 0.5, True), (1.4, 0.1, False), (-3.0, 0.9, True), (3.0, 1.1, False)]
)
def test_a_delay_is_told_above_a_millisecond_and_a_half_and_three_sigmas(late_ms, sigma_ms, message):
    output = WavelengthOutput(1)
    state = output.tracker.state
    state.follower.late_s, state.follower.late_variance = late_ms / 1e3, (sigma_ms / 1e3) ** 2
    output.tracker.state = state
    assert (f"found to be {late_ms:.1f} ms behind the readings" in output.doubted) == message
    stated = WavelengthOutput(1, latency_s=0.01)
    assert stated.doubted == "" and stated.tracker.latency_s == 0.01 and stated.tracker.latency_sigma_s == 0


def test_sources_of_an_offset_weigh_by_their_inverse_variance_and_widen_where_they_contradict():
    value, variance = combined(Source(1.0, 0.04), Source(), Source(1.8, 0.16))
    assert (value, variance) == pytest.approx((1.16, 0.032))
    apart = combined(Source(1.0, 0.04), Source(3.0, 0.16))
    squares = 0.4**2 / 0.04 + 1.6**2 / 0.16
    assert apart == pytest.approx((1.4, 0.032 * squares / 4)) and squares > 4
    assert combined() == combined(Source()) == Source(0.0, math.inf)


def test_the_steadiest_five_blocks_of_a_rest_are_kept():
    offset = ForceOffset(Source(0.0, 1.0), Source(0.0, 1.0), moving=(0.5, 1.1))
    pulls = [0.5, 0.3, 0.21, 0.2, 0.2, 0.22, 0.21, 0.1, 0.0]
    for pull in pulls:
        offset.at_rest(BlockMeans(pull, 1.0 + pull, 0.0, 0.0))
    assert offset.rest == pytest.approx((np.mean(pulls[2:7]), 1 + np.mean(pulls[2:7]), 0.02))
    assert offset.before == (0.5, 1.1) and len(offset.rests) == 5


def test_a_direction_is_a_plain_mean_at_first_and_fades_by_its_gain_later():
    rng, offset = np.random.default_rng(3), 0.1
    normals = rng.uniform(0.8, 1.2, 8)
    pulls = 0.4 * normals * (1 + 0.02 * rng.standard_normal(8)) - offset
    direction = Direction(-1)
    for count, (pull, normal) in enumerate(zip(pulls, normals, strict=True), 1):
        direction.age = 7.0
        assert direction.take(BlockMeans(-pull, normal, -30.0, 0.02), 40, offset, 1e-3) is True
        assert direction.pull == pytest.approx(pulls[:count].mean()) and direction.blocks == count
        assert direction.normal == pytest.approx(normals[:count].mean()) and direction.age == 0
        mu = (pulls[:count].mean() + offset) / normals[:count].mean()
        assert direction.mu(offset) == pytest.approx(mu)
        if count == 1:
            assert direction.variance == pytest.approx(((0.04 * mu) ** 2 + 0.02**2 / 40 / normal**2) * 0.8)
            assert direction.log_normal == pytest.approx(math.log(normal)) and direction.slow_mu == pytest.approx(mu)
        assert direction.error == pytest.approx((pull + offset) / normal - mu)
    sums = direction.stroke
    assert sums[:3] == pytest.approx([(pulls / normals).sum(), (1 / normals).sum(), np.log(normals).sum()])
    assert sums.blocks == 8 and 0 < sums.spread < 8 * 4 * (0.02 * 0.4) ** 2
    before = direction.pull
    direction.take(BlockMeans(-0.35, 1.0, -30.0, 0.0), 40, offset, 0.5)
    assert direction.pull == pytest.approx(before + 0.5 * (0.35 - before))


def test_a_start_pulls_most_where_the_median_of_five_less_twice_the_noise_does():
    rng, offset = np.random.default_rng(5), 0.05
    window = np.column_stack([-rng.uniform(0.2, 0.6, 44), rng.uniform(0.0, 1.5, 44), np.full(44, -20.0)])
    window[20, 0] = -9.0  # a single wrong sample is no peak
    direction = Direction(-1)
    direction.start(window, 0.01, offset, 0.3)
    fives = np.sort([-window[k : k + BREAKAWAY_MEDIAN_SAMPLES, 0] for k in range(40)], axis=1)
    force = np.maximum(window[2:-2, 1], 0.3)
    ratios = (fives[:, 2] - 0.02 + offset) / force
    best = int(ratios.argmax())
    spread = fives[best, 4] - fives[best, 2]
    assert direction.peak == pytest.approx((ratios[best], fives[best, 2] + spread / 2, force[best], spread))
    kept = direction.peak
    direction.start(window * [0.5, 1, 1], 0.01, offset, 0.3)
    assert direction.peak == kept, "a weaker start changes nothing"
