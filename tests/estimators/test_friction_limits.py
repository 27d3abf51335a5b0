"""What friction is made of: the sources of the offset, the means of a direction, looks, each limit from both sides."""

import math
from dataclasses import replace

import numpy as np
import pytest

from papilla.estimators.friction import Friction, FrictionStatus
from papilla.estimators.friction.direction import BREAKAWAY_MEDIAN_SAMPLES, Direction, Peak
from papilla.estimators.friction.offset import (
    AIR_SIGMA_N,
    ANISOTROPY_SIGMA,
    FORCE_EXPONENT_RMS,
    LEAST_STROKE_CHANGE,
    BlockMeans,
    ForceOffset,
    Source,
    Stroke,
)

STEADY = (0.4, 1.0, 30.0)


def unknown(sigma=0.2):
    return ForceOffset(Source(0.0, sigma**2), Source(0.0, sigma**2))


def stroke(pull, normal, blocks=10):
    return Stroke(blocks * pull / normal, blocks / normal, blocks * math.log(normal), 0.0, blocks)


def test_air_tells_the_offset_from_its_second_look_on():
    offset = unknown()
    offset.in_air(BlockMeans(0.7, 0.0, 0.0, 0.0), 40)
    assert not offset.observed
    for _ in range(30):
        offset.in_air(BlockMeans(0.1, 0.0, 0.0, 0.0), 40)
    assert offset.all.value_N == pytest.approx(0.1, abs=1e-4)
    assert math.sqrt(offset.all.variance_N2) == pytest.approx(AIR_SIGMA_N, rel=1e-3)
    light = unknown()
    for _ in range(5):
        light.in_air(BlockMeans(0.1, 0.01, 0.0, 0.0), 40)
    assert math.sqrt(light.air.variance_N2) == pytest.approx(0.005, rel=0.05), "it may rub"


@pytest.mark.parametrize("forces", [(1.0, 1.0), (0.5, 2.0)])
def test_turns_tell_the_offset_with_mu_the_same_both_ways(forces):
    """T = offset + mu N one way, offset - mu N the other; s T is what a stroke sums."""
    mu, zero = 0.4, 0.05
    forward, backward = forces
    strokes = stroke(mu * forward + zero, forward), stroke(mu * backward - zero, backward)
    offset = unknown(sigma=100.0)
    offset.sliding(BlockMeans(0.4, 1.0, 30.0, 0.0), *strokes)
    assert offset.all.value_N == pytest.approx(zero, abs=1e-4)
    b = 1 / forward + 1 / backward
    other = FORCE_EXPONENT_RMS * math.log(forward / backward)
    assert math.sqrt(offset.all.variance_N2) == pytest.approx(
        mu / b * math.sqrt(ANISOTROPY_SIGMA**2 + LEAST_STROKE_CHANGE**2 + other**2), rel=1e-3
    )
    offset.keep_turns(*strokes)
    assert offset.turns.value_N == pytest.approx(zero)
    for _ in range(50):
        offset.keep_turns(*strokes)
    offset.sliding(BlockMeans(0.4, 1.0, 30.0, 0.0), *strokes)
    assert math.sqrt(offset.all.variance_N2) > mu * ANISOTROPY_SIGMA / b, "anisotropy is not averaged away"


@pytest.mark.parametrize(
    "moved, rest, told",
    [
        ((0.5, 1.0), [0.1] * 5, True), ((0.5, 1.0), [0.3] * 5, False), ((0.5, 1.0), [0.1] * 4, False),
        ((0.5, 1.0), [0.1, 0.1, 0.1, 0.1, 0.13], False), ((0.5, 1.3), [0.1] * 5, False),
        ((0.12, 1.0), [0.1] * 5, False), (None, [0.1] * 5, True),
    ],
)  # fmt: skip
def test_a_rest_counts_where_the_pull_fell_by_more_than_half_and_nothing_better_is_known(moved, rest, told):
    offset, sliding = unknown(), BlockMeans(0.5, 1.0, 30.0, 0.0)
    offset.moving = moved
    for tangential in rest:
        offset.at_rest(BlockMeans(tangential, 1.0, 0.0, 0.0))
    offset.sliding(sliding, stroke(0.5, 1.0), Stroke())
    assert offset.observed == told
    if told:
        assert offset.all.value_N == pytest.approx(0.1, abs=0.005)
        offset.sliding(sliding, stroke(0.5, 1.0), stroke(0.3, 1.0))
        assert offset.all.value_N == pytest.approx(0.1, abs=0.01), "(0.5 - 0.3) / 2"


def test_a_look_five_scatters_off_is_left_out_and_the_third_in_a_row_is_a_change():
    for sigmas, learnt in ((4.9, True), (5.1, None)):
        way = Direction(1)
        for _ in range(10):
            way.take(BlockMeans(0.4, 1.0, 30.0, 0.0), 40, 0.0, 0.3)
        spread = math.sqrt(way.variance + (1e-3 * 0.4) ** 2)
        before = replace(way)
        assert way.take(BlockMeans(0.4 + sigmas * spread, 1.0, 30.0, 0.0), 40, 0.0, 0.3) is learnt
        assert (way.mu(0.0) == before.mu(0.0)) == (learnt is None)
    told = [way.take(BlockMeans(0.9, 1.0, 30.0, 0.0), 40, 0.0, 0.3) for _ in range(3)]
    assert told == [None, False, True] and way.mu(0.0) > 0.7
    way.take(BlockMeans(2.0, 1.0, 30.0, 0.0), 40, 0.0, 0.3)
    way.take(BlockMeans(way.mu(0.0), 1.0, 30.0, 0.0), 40, 0.0, 0.3)
    assert way.outliers == (), "not in a row"


def statuses(rows, **options):
    return [int(status) for status in Friction(**options).process(rows).status]


@pytest.mark.parametrize("speed, first", [(60.0, 120), (30.0, 120), (10.0, 160), (1.0, 320), (2.0, 760)])
def test_steady_sliding_begins_after_a_tenth_of_a_second_and_a_path(speed, first):
    """1.5 mm of path; a velocity of exactly 1 is a sign and counts as 5 mm/s."""
    found = statuses([(0.4, 1.0, speed)] * (first + 1))
    assert found.index(FrictionStatus.ONE_WAY) == first - 1
    assert set(found[: first - 1]) == {FrictionStatus.NOT_SLIDING}


def test_below_the_rest_speed_the_finger_rests():
    for speed, rests in ((0.99, True), (1.01, False)):
        own = Friction(rest_mm_s=1.0)
        own.process([(0.4, 1.0, speed)] * 40)
        assert (own.state.heading == 0) == rests
    # And below 2 % of the greatest recent speed, until that is forgotten
    for speed, rests in ((0.59, True), (0.61, False)):
        own = Friction(rest_mm_s=0.1)
        own.process([STEADY] * 200)
        own.process([(0.4, 1.0, speed)] * 80)
        assert (own.state.heading == 0) == rests
    assert own.state.top == pytest.approx(30.0, rel=0.01)
    own.process([(0.4, 1.0, 2.0)] * 50_000)
    assert own.state.top == pytest.approx(30 * math.exp(-2), rel=0.02)


def test_lost_contact_ends_a_start():
    for normal, status in ((0.0201, FrictionStatus.NOT_SLIDING), (0.0199, FrictionStatus.NO_CONTACT)):
        assert statuses([(0.001, normal, 30.0)] * 5)[-1] == status
    own = Friction()
    own.process([(0.4, 1.0, 0.0)] * 40)
    assert own.state.standing and own.state.directions[0].peak.pull == 0.4
    own.process([STEADY] * 20 + [(0.0, 0.0, 30.0)] * 20)
    memory = own.state
    assert not memory.standing and memory.directions[0].peak == Peak()
    assert memory.heading == 0 and memory.offset.air_run == 0
    own.process([(0.05, 0.0, 30.0)] * 80)
    assert own.state.offset.air_run == 2 and own.state.offset.observed
    # What comes down in motion has no breakaway
    own.process([(9.0, 1.0, 30.0)] * 40 + [STEADY] * 400)
    assert math.isnan(own.coefficients[0].mu_static) and own.coefficients[0].mu_kinetic == pytest.approx(0.35, abs=0.01)


def known_by(**known):
    """The answer of the first direction with mu 0.4 at 1 N, offset 0.05 +- 0.001 N, and what is given."""
    own = Friction()
    state = own.state
    state.offset.all = Source(0.05, 1e-6)
    way = state.directions[0]
    known = {"pull": 0.45, "blocks": 9.0, "variance": 1e-4, "breakaway": Peak(0.55, 1.2, 2.0, 0.02)} | known
    for name, value in known.items():
        setattr(way if hasattr(way, name) else state, name, value)
    own.state = state
    return own.coefficients[0]


def test_sigma_holds_scatter_offset_force_and_age():
    assert known_by().mu_kinetic == pytest.approx(0.4)
    alone = known_by().mu_kinetic_sigma ** 2
    assert alone == pytest.approx(1e-6 + 1e-4 + (1e-3 * 0.4) ** 2)
    for known, more in (
        ({"log_variance": 0.04}, (FORCE_EXPONENT_RMS * 0.2 * 0.4) ** 2),
        ({"age": 4.0}, (0.03 * 2 * 0.4) ** 2),
        ({"error": 0.03}, 0.03**2),
    ):
        assert known_by(**known).mu_kinetic_sigma ** 2 == pytest.approx(alone + more)
    assert known_by().mu_static == pytest.approx((1.2 - 0.05) / 2)
    assert known_by().mu_static_sigma == pytest.approx(math.hypot(0.02, 0.001, 0.03 * 1.2) / 2)


@pytest.mark.parametrize(
    "known, status",
    [
        ({}, "OK"), ({"variance": 0.0315**2}, "OK"), ({"variance": 0.0325**2}, "UNSURE"),
        ({"breakaway": Peak(0.3, 0.77, 2.0, 0.02)}, "STATIC_NOT_SEEN"), ({"breakaway": Peak()}, "OK"),
        ({"breakaway": Peak(0.3, 0.83, 2.0, 0.02)}, "OK"), ({"pull": 0.04}, "NEGATIVE"),
        ({"blocks": 0.0}, "NOT_SLIDING"),
        ({"note": FrictionStatus.CHANGED}, "CHANGED"), ({"note": FrictionStatus.CHANGED, "pull": 0.04}, "NEGATIVE"),
    ],
)  # fmt: skip
def test_the_status_says_what_is_missing(known, status):
    assert known_by(**known).status == FrictionStatus[status]


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
    strongest = direction.peak
    direction.start(window * [0.5, 1, 1], 0.01, offset, 0.3)
    assert direction.peak == strongest, "a weaker start changes nothing"
