"""The reciprocal counter, the wavenumber bank alone, and several gauges together."""

import itertools
import math

import numpy as np
import pytest

from papilla.errors import InputError
from papilla.estimators.tracking import (
    FusedTracker,
    ReciprocalCounter,
    TrackingStatus,
    WavelengthEstimate,
    WavenumberBank,
)
from papilla.studies.estimator_bench.measures import errors_of
from papilla.studies.estimator_bench.scenes import scene

KINDS = (ReciprocalCounter, WavenumberBank)
PLACES = (-8.0, -4.0, 0.0, 4.0, 8.0)


def same(first, second) -> bool:
    return all(np.array_equal(a, b, equal_nan=True) for a, b in zip(first, second, strict=True))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("wavelength", [0.6, 1.2])
def test_the_wavelength_is_found(kind, wavelength):
    made = scene("act1", wavelength, seed=1, seconds=1.5)
    found = kind().process(made.block())
    error = (found.wavelength_mm / wavelength - 1)[made.judged()]
    assert math.sqrt(np.mean(error**2)) < 0.01
    assert np.all(found.wavelength_sigma_mm[made.judged()] > 0)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["const", "act1", "act2"])
def test_the_stated_sigma_is_true(kind, name):
    squares = []
    for wavelength in (0.6, 1.2, 2.4):
        made = scene(name, wavelength, seed=101, seconds=2.5)
        squares.append(errors_of(made, kind().process(made.block())).sigma_square)
    assert 0.7 < math.sqrt(np.mean(squares)) < 1.35


def test_few_crossings_do_not_claim_too_much():
    with_three = ReciprocalCounter(crossings=3)
    made = scene("const", 1.2, seed=3, seconds=2.0)
    assert errors_of(made, with_three.process(made.block())).sigma_square < 1.3**2
    assert with_three.state.scatter[1] >= 3


@pytest.mark.parametrize("kind", KINDS)
def test_chunks_and_state(kind):
    block = scene("act1", 1.2, seed=1, seconds=0.7).block()
    block[60, 0], block[200, 1], block[300:310, 1] = np.nan, np.nan, 0.0
    whole = kind().process(block)
    cut = kind()
    first = cut.process(block[:350])
    other = kind()
    other.state = cut.state
    rest = other.process(block[350:])
    assert same(whole, (np.concatenate(pair) for pair in zip(first, rest, strict=True)))
    cut.reset()
    assert same(whole, cut.process(block))
    assert {0, 1, 2, 3, 4} >= set(whole.status.tolist()) >= {0, 1, 3, 4}


@pytest.mark.parametrize("kind", KINDS)
def test_standstill_and_shapes(kind):
    estimator = kind()
    estimator.process(scene("const", 1.2, seed=1, seconds=0.6).block())
    estimator.update((0.0, 0.0))
    held = estimator.update((0.0, 0.0))
    assert held.status == TrackingStatus.STANDSTILL and held.frequency_Hz == 0
    assert held.wavelength_mm == pytest.approx(1.2, rel=0.02)
    with pytest.raises(InputError, match="n x 2"):
        estimator.process(np.zeros(4))
    with pytest.raises(InputError, match="a sample must be"):
        estimator.update((1.0,))


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: ReciprocalCounter(wavelength_range_mm=(2, 1)), "must rise"),
        (lambda: ReciprocalCounter(crossings=2), "crossings must be at least 3"),
        (lambda: FusedTracker((1.0,)), "two or more different places"),
        (lambda: FusedTracker((1.0, 1.0)), "two or more different places"),
    ],
)
def test_unusable_values(make, message):
    with pytest.raises(InputError, match=message):
        make()


@pytest.fixture(scope="module")
def gauges():
    return scene("const", 2.4, seed=2, seconds=0.9, gauge_positions_mm=PLACES)


def test_several_gauges_are_better_than_one_and_show_a_wrong_speed(gauges):
    rows = gauges.block()
    fused = FusedTracker(PLACES, compiled=False).process(rows)
    assert fused.used[-1] == 5
    assert fused.wavelength_mm[-1] == pytest.approx(2.4, abs=5 * fused.wavelength_sigma_mm[-1])
    assert fused.wavelength_by_phase_mm[-1] == pytest.approx(2.4, rel=0.002)
    rows[:, -1] *= 1.05
    wrong = FusedTracker(PLACES, compiled=False).process(rows)
    assert wrong.wavelength_mm[-1] == pytest.approx(2.4 * 1.05, rel=0.002)
    assert wrong.wavelength_by_phase_mm[-1] == pytest.approx(2.4, rel=0.002)


@pytest.mark.parametrize("factor, low, high", [(1.0, 0.8, 1.0), (2.0, 0.9, 1.25)])
def test_sigma_by_phase_holds_the_shared_origin_and_what_gauges_disagree_by(factor, low, high):
    rng, tracker = np.random.default_rng(5), FusedTracker(PLACES)
    sigmas = np.array([0.012, 0.01, 0.008, 0.01, 0.015])
    answers = [WavelengthEstimate(2.4, 0.004, 40.0, 0)] * 5
    ratios = []
    for _ in range(1500):
        phases = 2 * math.pi * np.array(PLACES) / 2.4 + 1.0 + factor * sigmas * rng.standard_normal(5)
        pairs = list(zip((phases % (2 * math.pi)).tolist(), sigmas.tolist(), strict=True))
        found = tracker._fuse(100.0, answers, pairs)
        ratios.append((found.wavelength_by_phase_mm - 2.4) / found.wavelength_by_phase_sigma_mm)
    assert low < math.sqrt(np.mean(np.square(ratios))) < high


def test_a_block_of_several_gauges_is_what_its_rows_give():
    rows = scene("act1", 1.8, seed=2, seconds=0.3, gauge_positions_mm=PLACES[:3]).block()
    rows[150:160, 0], rows[200:205, -1], rows[220, 2] = np.nan, np.nan, np.inf
    whole, single = (FusedTracker(PLACES[:3], compiled=False) for _ in range(2))
    answers = [single.update(row) for row in rows.tolist()]
    assert same(whole.process(rows), map(np.array, zip(*answers, strict=True)))
    assert np.isfinite(answers[-1].wavelength_mm) and answers[202].status == TrackingStatus.NO_VELOCITY
    assert len(whole.process(np.empty((0, 4))).status) == 0


def test_dead_and_contradicting_gauges_are_left_out(gauges):
    rows = gauges.block()
    rows[:, 1] = 0.0
    rows[:, 3] = scene("const", 1.0, seed=2, seconds=0.9).readings[:, 0]
    fused = FusedTracker(PLACES, compiled=False)
    found = fused.process(rows)
    assert found.used[-1] == 3
    assert found.wavelength_mm[-1] == pytest.approx(2.4, rel=0.002)
    other = FusedTracker(PLACES, compiled=False)
    other.state = fused.state
    assert other.update(rows[-1]) == fused.update(rows[-1])
    with pytest.raises(InputError, match="the state is of 4 gauges"):
        other.state = fused.state[:4]
    with pytest.raises(InputError, match="n x 6"):
        fused.process(rows[:, :3])
    with pytest.raises(InputError, match="5 readings"):
        fused.update((1.0, 2.0))


@pytest.mark.parametrize("kind, scenes", [(WavenumberBank, (("harsh", 20.0),)), (ReciprocalCounter, (("const", 0.0),))])
def test_what_cannot_be_known_is_not_called_ok(kind, scenes):
    """Steps of the baseline, or noise that makes crossings: no wrong wavelength is called OK."""
    for (name, snr), wavelength in itertools.product(scenes, (0.6, 1.8)):
        made = scene(name, wavelength, snr_dB=snr, seed=102, seconds=2.5)
        found = kind().process(made.block())
        called = made.judged() & (found.status == TrackingStatus.OK)
        assert np.all(np.abs(found.wavelength_mm[called] / wavelength - 1) < 0.1)
        assert np.mean(called[made.judged()]) < 0.6


def test_the_counter_follows_a_baseline_that_has_moved():
    made = scene("const", 1.2, seed=3, seconds=1.6)
    rows = made.block()
    rows[600:, 0] += 20.0
    found = ReciprocalCounter().process(rows)
    assert np.mean(found.status[700:760] == TrackingStatus.OK) < 0.1
    assert np.all(found.status[1000:] == TrackingStatus.OK)
    assert found.wavelength_mm[1000:] == pytest.approx(np.full(600, 1.2), rel=0.005)
