"""The velocity-blind tracker: accuracy with its lag, its sigma, reversals, bad samples, state, and settings."""

import math
import pickle

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.estimators.wavelength.chirp import ChirpStatus, ChirpTracker
from papilla.estimators.wavelength.motion_fit import (
    JUMPS_PART,
    MOTION_KNOTS,
    MOTION_PART,
    SHAPE_PARAMETERS,
    SHAPE_PART,
    TREND_PARAMETERS,
    TREND_PART,
    MotionFit,
    designed,
    phase_at,
    profile,
    solved,
    swung,
    trend_of,
)  # fmt: skip
from papilla.scenes.scenes import scene


def same(first, second) -> bool:
    return all(np.array_equal(a, b, equal_nan=True) for a, b in zip(first, second, strict=True))


def aligned(made, found, lag_s):
    """Relative error of the frequency `lag_s` ago on the judged rows, and error over stated sigma."""
    lag = round(lag_s * made.sample_rate_Hz)
    rows = np.flatnonzero(made.judged())
    truth = made.frequency_Hz[rows - lag]
    error = found.frequency_Hz[rows] - truth
    return error / truth, error / found.frequency_sigma_Hz[rows]


@pytest.mark.parametrize("kind, wavelength, snr", [("act1", 3.0, 20), ("act1", 1.2, 10), ("act2", 0.6, 20)])
def test_active_touch_is_followed_through_reversals(kind, wavelength, snr):
    made = scene(kind, wavelength, snr_dB=snr, seed=41, seconds=2.2)
    tracker = ChirpTracker()
    found = tracker.process(made.block())
    error, ratio = aligned(made, found, tracker.lag_s)
    assert math.sqrt(np.mean(error**2)) < 0.03
    assert 0.3 < math.sqrt(np.mean(ratio**2)) < 2
    of_wavelength = found.wavelength_mm[made.judged()] / wavelength - 1
    assert math.sqrt(np.mean(of_wavelength**2)) < 0.03
    # Some periods pass before it is told that they are no harmonic's.
    assert np.mean(found.status[made.judged()] == ChirpStatus.OK) > 0.94


def test_a_state_saved_while_it_searches_or_follows_goes_on_bit_for_bit():
    block = scene("act1", 1.2, seed=43, seconds=0.7).block()
    block[430:450, 0], block[500, 0], block[510, 1] = np.nan, np.inf, np.nan
    whole = ChirpTracker().process(block)
    assert {0, 1, 3} <= set(whole.status.tolist())
    tracker, searched = ChirpTracker(), 0
    for number, row in enumerate(block.tolist()):
        tracker.update(row)
        looking = tracker.state.search is not None
        if (looking and searched < 4 and number % 11 == 0) or number == 600:
            searched += looking
            other = ChirpTracker()
            other.state = pickle.loads(pickle.dumps(tracker.state))
            rest = other.process(block[number + 1 :])
            assert same(rest, (column[number + 1 :] for column in whole))
    assert searched == 4
    with pytest.raises(InputError, match="the state is not of this sampling rate"):
        ChirpTracker(sample_rate_Hz=2000.0).state = tracker.state


def test_sigma_grows_where_readings_are_missing():
    made = scene("const", 1.8, seed=44, seconds=0.6)
    tracker = ChirpTracker(saturation=50.0)
    before = tracker.process(made.block())
    gap = tracker.process(np.full(2000, 60.0))
    assert set(gap.status.tolist()) == {int(ChirpStatus.MISSING)}
    # The step that was under way when readings ended still adds what it knows.
    assert np.all(np.diff(gap.frequency_sigma_Hz[10:200:10]) > 0)
    assert gap.frequency_sigma_Hz[-1] > 5 * before.frequency_sigma_Hz[-1]
    assert gap.frequency_Hz[5] == pytest.approx(made.frequency_Hz[-1], rel=0.03)
    assert "missing" in gap.sentence[0] and tracker.update(0.0).sentence


@pytest.mark.parametrize("kind", ["const", "act1"])
@pytest.mark.parametrize("scale, offset", [(1024.0, 0.0), (2.0**-20, 0.0), (-1.0, 0.0), (1.0, 4096.0)])
def test_unit_sign_and_zero_of_the_readings_do_not_matter(kind, scale, offset):
    made = scene(kind, 1.8, seed=47, seconds=0.8)
    once, other = (ChirpTracker().process(block) for block in (made.readings, offset + scale * made.readings))
    np.testing.assert_array_equal(other.status, once.status)
    for name in ("frequency_Hz", "frequency_sigma_Hz"):
        np.testing.assert_allclose(getattr(other, name), getattr(once, name), rtol=1e-5)


@pytest.mark.parametrize("rate, frequency, chirp", [(1000.0, 60.0, 0.0), (1000.0, 60.0, 40.0), (2000.0, 110.0, 0.0)])
def test_every_number_of_a_state_is_that_of_the_wave_that_is_followed(rate, frequency, chirp):
    """Noise, profile and their information with a memory of half a second; periods, usual frequency, and doubt."""
    time, tracker = np.arange(int(1.5 * rate)) / rate, ChirpTracker(sample_rate_Hz=rate)
    turns, rates = frequency * time + 0.5 * chirp * time**2, frequency + chirp * time
    readings = 3 + np.cos(2 * np.pi * turns) + 0.3 * np.cos(4 * np.pi * turns)
    readings += 0.05 * np.random.default_rng(1).standard_normal(len(time))
    answers = tracker.process(np.column_stack([readings, -1.8 * rates]))
    late, state = time > 1.0, tracker.state
    ratio = (answers.frequency_Hz - rates + chirp * tracker.lag_s)[late] / answers.frequency_sigma_Hz[late]
    assert (answers.status[late] == ChirpStatus.OK).all() and 0.5 < math.sqrt(np.mean(ratio**2)) < 1.2
    assert answers.wavelength_mm[late] == pytest.approx(1.8, rel=6e-3)
    assert state.held[1] / state.held[0] == pytest.approx(
        answers.frequency_sigma_Hz[-1] / answers.frequency_Hz[-1], rel=1e-9
    )
    first = int(np.argmax(answers.status == ChirpStatus.OK))
    assert 3 / frequency + 0.13 < time[first] < 0.26, "two windows, a search and three periods"
    # A fit begins with a search, and takes over the readings since.
    begun = turns[-1] - state.followed
    assert 0 < begun < turns[first] - 3 and state.span == len(state.stroke.residual) == math.ceil(4.5 / 15 * rate)
    fading = np.exp(-(time[-1] - time) / 0.5) * (turns >= begun)
    mean = fading @ rates**2 / (2 * rate / 4) + (1 - fading.sum() / (rate / 2)) * rates[turns >= begun][0] ** 2
    assert state.swing == pytest.approx(mean, rel=0.03)
    assert abs(state.stroke.motion[1]) == pytest.approx(rates[-1], rel=3e-3) and 0 <= state.stroke.motion[0] < 1.3
    assert state.stroke.noise == pytest.approx(0.05**2, rel=0.15) and state.doubt == pytest.approx(1.0, abs=0.2)
    assert state.stroke.shape[:3] == pytest.approx([1, 0.3, 0], abs=0.01) and state.about[:2] == pytest.approx(
        [1, 0.3], abs=0.01
    )
    # Of each harmonic a cosine and a sine, but of the first a cosine alone.
    shown = sum(weight * (order * rates < 0.4 * rate) for order, weight in enumerate((0.5, 1, 1, 1, 1), 1))
    assert np.trace(state.known) == pytest.approx(fading @ shown, rel=0.12)
    assert state.other == 0 and not state.quiet and 0.1 <= state.lively < 0.2 and state.wander < 0.2


def stroke_of(motion, jumps=None, trend=None, shape=None, spacing=0.0375):
    """A fit with these parameters, the others 0."""
    sizes = MOTION_KNOTS, TREND_PARAMETERS, SHAPE_PARAMETERS
    jumps, trend, shape = (np.zeros(n) if x is None else x for x, n in zip((jumps, trend, shape), sizes, strict=True))
    return MotionFit(motion, jumps, 0.02, spacing, trend, shape, np.zeros((1, 1)), 1.0, np.zeros(300), 0.0)


def test_the_derivatives_of_a_stroke_are_its_differences():
    """Gauss and Newton's step from a stroke to one beside it, of exact readings, is the difference of the two."""
    rng, time = np.random.default_rng(0), np.arange(-299, 1) / 1000
    trend, shape = rng.normal(0, 1, TREND_PARAMETERS), rng.normal(0, 1, SHAPE_PARAMETERS)
    start = stroke_of(np.array([0.2, 55.0, -180.0, 41.0]), rng.normal(0, 50, MOTION_KNOTS), trend, shape)
    small = rng.normal(0, 1e-5, SHAPE_PART.stop)
    small[JUMPS_PART], small[MOTION_PART] = 10 * small[JUMPS_PART], [1e-6, 1e-5, 1e-4, 1e-4]
    other = stroke_of(*np.split(start.values + small, [JUMPS_PART.start, TREND_PART.start, SHAPE_PART.start]))
    columns, _ = profile(*phase_at(other, time), 1000.0)
    readings = columns @ other.shape + trend_of(time, np.minimum(time[:, None] - other.knots, 0.0)) @ other.trend
    prior = 1e-12 * np.eye(SHAPE_PART.stop)
    found = solved(designed(start, readings, time, 1000.0), prior, start.values)
    assert np.abs(found.residual).max() < 1e-6
    (turned, speed), (phase, rate) = phase_at(found, time), phase_at(other, time)
    assert np.abs(turned - phase).max() < 1e-6 and np.abs(speed - rate).max() < 1e-4


def test_a_step_goes_no_further_than_the_readings_are_linear():
    """A tenth of a cycle by the phase; two hundredths by the square of a change of the stiffness, of which phase,
    frequency and chirp make up for the most."""
    time, shape = np.arange(-299, 1) / 1000, np.array([1.0, *[0.0] * (SHAPE_PARAMETERS - 1)])
    start = stroke_of(np.array([0.0, 55.0, 0.0, 0.0]), shape=shape)
    slopes = designed(start, np.zeros(300), time, 1000.0).motion[:, :4]
    rest = np.linalg.lstsq(slopes[:, :3], -9.0 * slopes[:, 3], rcond=None)[0]
    for change, phase_limited in (([0.3, 0.0, 0.0, 0.0], True), ([*rest, 9.0], False)):
        readings = profile(*phase_at(stroke_of(start.motion + change, shape=shape), time), 1000.0)[0] @ shape
        design = designed(start, readings, time, 1000.0)
        prior = np.diag([1e-9] * MOTION_PART.stop + [1e9] * (SHAPE_PART.stop - MOTION_PART.stop))
        step = solved(design, prior, start.values).values - start.values
        turned, bent = np.abs(design.motion @ step[: JUMPS_PART.stop]).max(), 55.0 * 0.299**5 * step[3] ** 2 / 60
        assert (turned if phase_limited else bent) == pytest.approx(0.1 if phase_limited else 0.02, rel=1e-6)
        assert turned < 0.1 + 1e-9 and bent < 0.02 + 1e-9


@pytest.mark.parametrize("stiffness", [-200.0, -1e-4, 0.0, 1e-7, 1e-4, 300.0])
def test_a_swing_is_the_oscillator_s_and_its_slopes_are_differences(stiffness):
    """S'' = -k S from S = 0, S' = 1, and C' = S; by the stiffness, whether it is a number or next to none."""
    time, h, dk = np.linspace(-0.3, 0.1, 9), 1e-4, 1e-2
    S, C, by_S, by_C, turned = swung(stiffness, time)
    later, before = swung(stiffness, time + h), swung(stiffness, time - h)
    np.testing.assert_allclose((later[0] - before[0]) / (2 * h), turned, rtol=1e-6)
    np.testing.assert_allclose((later[1] - before[1]) / (2 * h), S, rtol=1e-5, atol=1e-9)
    np.testing.assert_allclose((later[4] - before[4]) / (2 * h), -stiffness * S, rtol=1e-4, atol=1e-6)
    more, less = swung(stiffness + dk, time), swung(stiffness - dk, time)
    np.testing.assert_allclose((more[0] - less[0]) / (2 * dk), by_S, rtol=2e-2, atol=1e-7)
    np.testing.assert_allclose((more[1] - less[1]) / (2 * dk), by_C, rtol=2e-2, atol=1e-7)
    assert swung(stiffness, 0.0)[:2] == (0.0, 0.0) and C.min() >= 0
