"""The velocity-blind tracker: accuracy with its lag, its sigma, reversals, bad samples, state, and settings."""

import math

import numpy as np
import pytest

from papilla.errors import InputError
from papilla.estimators.tracking.blind import ChirpStatus, ChirpTracker
from papilla.estimators.tracking.compiled import numba_available
from papilla.studies.estimator_bench.scenes import scene


def plain(**options) -> ChirpTracker:
    return ChirpTracker(compiled=False, **options)


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
    tracker = plain()
    found = tracker.process(made.block())
    error, ratio = aligned(made, found, tracker.lag_s)
    assert math.sqrt(np.mean(error**2)) < 0.03
    assert 0.3 < math.sqrt(np.mean(ratio**2)) < 2
    of_wavelength = found.wavelength_mm[made.judged()] / wavelength - 1
    assert math.sqrt(np.mean(of_wavelength**2)) < 0.03
    assert np.mean(found.status[made.judged()] == ChirpStatus.OK) > 0.99


@pytest.mark.parametrize("wavelength, seed", [(0.6, 44), (2.4, 42)])
def test_pressing_steps_are_told_from_an_answer(wavelength, seed):
    made = scene("harsh", wavelength, seed=seed, seconds=2.2)
    tracker = plain()
    found = tracker.process(made.block())
    ok = (found.status == ChirpStatus.OK)[made.judged()]
    assert 0.4 < np.mean(ok) < 0.9
    _, ratio = aligned(made, found, tracker.lag_s)
    assert math.sqrt(np.mean(ratio[ok] ** 2)) < 2
    of_wavelength = (found.wavelength_mm - wavelength) / found.wavelength_sigma_mm
    assert math.sqrt(np.mean(of_wavelength[made.judged()] ** 2)) < 2


def test_the_fundamental_is_tracked_at_constant_speed():
    made = scene("const", 2.4, seed=42, seconds=1.3)
    found = plain().process(made.readings)
    error, _ = aligned(made, found, 0.0)
    assert np.abs(error).max() < 0.02
    assert np.isnan(found.wavelength_mm).all()


def test_chunks_and_state_do_not_change_a_bit():
    block = scene("act1", 1.2, seed=43, seconds=0.6).block()
    block[300:320, 0], block[400, 0], block[410, 1] = np.nan, np.inf, np.nan
    whole = plain().process(block)
    assert {0, 1, 3} == set(whole.status.tolist())
    one = plain()
    singles = [one.update(row) for row in block.tolist()]
    assert same(whole, map(np.array, zip(*singles, strict=True)))
    first, second = plain(), plain()
    before = first.process(block[:350])
    second.state = first.state
    after = second.process(block[350:])
    assert same(whole, (np.concatenate(pair) for pair in zip(before, after, strict=True)))
    first.reset()
    assert same(whole, first.process(block))
    with pytest.raises(InputError, match="this tracker needs"):
        plain(sample_rate_Hz=2000.0).state = second.state


def test_sigma_grows_where_readings_are_missing():
    made = scene("const", 1.8, seed=44, seconds=0.6)
    tracker = plain(saturation=50.0)
    before = tracker.process(made.block())
    gap = tracker.process(np.full(2000, 60.0))
    assert set(gap.status.tolist()) == {int(ChirpStatus.MISSING)}
    assert np.all(np.diff(gap.frequency_sigma_Hz[:50]) > 0)
    assert gap.frequency_sigma_Hz[-1] > 5 * before.frequency_sigma_Hz[-1]
    assert gap.frequency_Hz[5] == pytest.approx(made.frequency_Hz[-1], rel=0.03)
    assert "missing" in gap.sentence[0] and tracker.update(0.0).sentence


def test_standstill_is_told_and_left_again():
    made = scene("const", 1.8, seed=45, seconds=1.6)
    readings = made.readings[:, 0].copy()
    rng = np.random.default_rng(0)
    readings[600:1100] = readings[600] + 0.1 * rng.standard_normal(500)
    found = plain().process(np.column_stack([readings, made.velocity_mm_s]))
    assert set(found.status[950:1100].tolist()) <= {int(ChirpStatus.QUIET), int(ChirpStatus.SEARCHING)}
    assert found.wavelength_sigma_mm[1090] > found.wavelength_sigma_mm[590]
    assert found.frequency_Hz[1400:] == pytest.approx(made.frequency_Hz[1400:], rel=0.03)


def test_noise_and_dead_gauges_have_no_frequency():
    dead = plain().process(np.full(400, 3.0))
    assert np.isnan(dead.frequency_Hz).all() and dead.status[-1] == ChirpStatus.QUIET
    noise = plain().process(np.random.default_rng(5).standard_normal(600))
    assert not np.any(noise.status == ChirpStatus.OK)


@pytest.mark.parametrize("rate", [500.0, 4000.0])
def test_the_sampling_rate_is_a_parameter(rate):
    made = scene("const", 2.4, seed=46, seconds=0.7, sample_rate_Hz=rate)
    found = plain(sample_rate_Hz=rate).process(made.readings)
    assert found.frequency_Hz[-1] == pytest.approx(made.frequency_Hz[-1], rel=0.02)


@pytest.mark.parametrize("scale, offset", [(1e3, 2e4), (1e-6, 0.0)])
def test_scale_and_offset_do_not_matter(scale, offset):
    made = scene("const", 1.8, seed=47, seconds=0.5)
    reference = plain().process(made.readings).frequency_Hz[-1]
    assert plain().process(offset + scale * made.readings).frequency_Hz[-1] == pytest.approx(reference, rel=1e-5)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"frequency_range_Hz": (100, 50)}, "must span a factor 2 to 100 below 0.4 of the sampling rate"),
        ({"frequency_range_Hz": (15, 450)}, "got 15 to 450 Hz"),
        ({"frequency_range_Hz": 15}, "must be two numbers"),
        ({"sample_rate_Hz": 0}, "sample_rate_Hz"),
        ({"lag_s": 0.2}, "lag_s must lie between 0 and 0.03"),
        ({"saturation": -1}, "saturation"),
    ],
)
def test_unusable_values(options, message):
    with pytest.raises(InputError, match=message):
        plain(**options)


def test_samples_and_blocks_of_another_shape():
    with pytest.raises(InputError, match="a block must be n readings"):
        plain().process(np.zeros((3, 3)))
    with pytest.raises(InputError, match="a sample must be"):
        plain().update((1.0, 2.0, 3.0))


@pytest.mark.slow
@pytest.mark.skipif(not numba_available(), reason="numba is in the extra 'fast'")
def test_compiled_gives_the_same_answers():
    block = scene("act1", 1.8, seed=48, seconds=1.5).block()
    first, second = plain().process(block), ChirpTracker(compiled=True).process(block)
    assert np.array_equal(first.status, second.status)
    for name in first._fields[:4]:
        assert getattr(first, name) == pytest.approx(getattr(second, name), rel=1e-9, nan_ok=True)
