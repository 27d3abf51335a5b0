"""The guided tracker: accuracy against the bound, its sigma, its state, and what it does with bad samples."""

import dataclasses
import math

import numpy as np
import pytest

from papilla.errors import InputError, MissingExtraError
from papilla.estimators.tracking import SpaceTracker, TrackerState, TrackingStatus
from papilla.estimators.tracking.compiled import numba_available
from papilla.studies.estimator_bench.scenes import scene


def plain(**options) -> SpaceTracker:
    return SpaceTracker(compiled=False, **options)


def same(first, second) -> bool:
    return all(np.array_equal(a, b, equal_nan=True) for a, b in zip(first, second, strict=True))


@pytest.mark.parametrize("kind, snr, factor", [("const", 20.0, 2.0), ("const", 0.0, 2.5), ("act1", 20.0, 2.5)])
def test_the_error_is_near_the_bound_of_the_declared_memory(kind, snr, factor):
    """One run of a few memories scatters about the bound: the RMS over many seeds is what the benchmark reports."""
    made = scene(kind, 1.8, snr_dB=snr, seed=7, seconds=2.5)
    found = plain().process(made.block())
    error = (found.wavelength_mm / 1.8 - 1)[made.judged()]
    assert math.sqrt(np.mean(error**2)) < factor * made.bound(0.5)
    ratio = error * 1.8 / found.wavelength_sigma_mm[made.judged()]
    assert 0.2 < math.sqrt(np.mean(ratio**2)) < 2.5
    assert found.frequency_Hz[made.judged()] == pytest.approx(made.frequency_Hz[made.judged()], rel=0.05)


@pytest.mark.parametrize("wavelength", [0.6, 3.0])
def test_harsh_touch_is_survived(wavelength):
    made = scene("harsh", wavelength, seed=3, seconds=2.5)
    error = plain().process(made.block()).wavelength_mm / wavelength - 1
    assert np.median(np.abs(error[made.judged()])) < 0.003


@pytest.mark.parametrize("wavelength, seed", [(0.6, 10000), (0.6, 10002)])
def test_steps_of_the_baseline_are_not_called_a_second_texture(wavelength, seed):
    made = scene("harsh", wavelength, seed=seed, seconds=2.5)
    found = plain().process(made.block())
    assert np.mean(found.status[made.judged()] == TrackingStatus.DISTURBED) < 0.15


@pytest.mark.parametrize("wavelength, seed, snr", [(3.0, 20002, 40.0), (2.4, 502, 0.0), (1.2, 10000, 0.0)])
def test_neither_a_step_nor_friction_at_the_turn_passes_for_a_long_wavelength(wavelength, seed, snr):
    made = scene("harsh", wavelength, snr_dB=snr, seed=seed, seconds=4.0)
    found = SpaceTracker().process(made.block())
    assert np.abs(found.wavelength_mm[made.time_s > 1] / wavelength - 1).max() < 0.1


def test_a_new_wavelength_is_found():
    made = scene("const", 3.0, seed=2, seconds=1.4, step_to_mm=0.6, step_at_s=1.0)
    found = plain().process(made.block()).wavelength_mm
    assert found[995] == pytest.approx(3.0, rel=0.002)
    assert found[1100:] == pytest.approx(np.full(300, 0.6), rel=0.05)


@pytest.mark.parametrize("kind, wavelength, seed", [("act2", 1.8, 40004), ("act1", 3.0, 40001)])
def test_a_poor_first_lock_is_left(kind, wavelength, seed):
    """The finger starts from rest: the first lock is to a wrong wavelength, whose misfit must not pass for noise."""
    made = scene(kind, wavelength, seed=seed, seconds=1.6)
    estimator = plain()
    found = estimator.process(made.block())
    late = made.judged(1.2)
    assert np.abs(found.wavelength_mm[late] / wavelength - 1).max() < 0.002
    assert estimator.noise_sd < 2 * made.noise_sd


@pytest.mark.parametrize("kind, other", [("act1", 2.9), ("act1", 4.1), ("act2", 2.9)])
def test_two_wavelengths_in_active_touch_are_not_called_ok(kind, other):
    made, second = (scene(kind, value, seed=2, seconds=1.4) for value in (1.8, other))
    found = plain().process(made.block() + [1, 0] * second.block())
    assert np.mean(found.status[made.judged()] == TrackingStatus.DISTURBED) > 0.9


@pytest.mark.parametrize("amplitude", [0.3, 1.0])
def test_hum_is_tolerated_or_told(amplitude):
    made = scene("act1", 1.8, seed=3, seconds=1.8)
    block = made.block()
    block[:, 0] += amplitude * np.sin(2 * np.pi * 50 * made.time_s + 1)
    found = plain().process(block)
    rows = made.judged()
    called = rows & (found.status == TrackingStatus.OK)
    if amplitude < 1:
        assert called.sum() == rows.sum()
        ratio = (found.wavelength_mm / 1.8 - 1)[called] * 1.8 / found.wavelength_sigma_mm[called]
        assert math.sqrt(np.mean(ratio**2)) < 2
    else:
        assert np.mean(found.status[rows] == TrackingStatus.DISTURBED) > 0.5


@pytest.mark.parametrize("kind, snr", [("const", -6.0), ("act1", 0.0), ("act2", 20.0)])
def test_white_noise_is_not_called_a_disturbance(kind, snr):
    made = scene(kind, 1.8, snr_dB=snr, seed=3, seconds=1.5)
    assert set(plain().process(made.block()).status[made.judged()].tolist()) == {int(TrackingStatus.OK)}


def test_chunks_do_not_change_a_bit():
    block = scene("act1", 1.2, seed=1, seconds=0.6).block()
    block[100:110, 0], block[200, 1], block[300:330, 1] = np.nan, np.inf, 0.0
    whole = plain().process(block)
    one, many = plain(), plain()
    singles = [one.update(row) for row in block.tolist()]
    assert same(whole, map(np.array, zip(*singles, strict=True)))
    cuts = np.split(block, [1, 2, 150, 151, 400])
    pieces = [many.process(part) for part in cuts]
    assert same(whole, (np.concatenate(column) for column in zip(*pieces, strict=True)))
    assert len(plain().process(np.empty((0, 2))).status) == 0


def test_the_state_can_be_kept_and_set():
    block = scene("const", 1.2, seed=1, seconds=0.5).block()
    first = plain()
    first.process(block[:250])
    kept = first.state
    rest = first.process(block[250:])
    second = plain()
    second.state = kept
    assert same(rest, second.process(block[250:]))
    assert dataclasses.is_dataclass(kept) and hash(kept) is not None
    first.reset()
    assert same(first.process(block), plain().process(block))
    with pytest.raises(InputError, match="this tracker needs"):
        plain(wavelength_range_mm=(1, 8)).state = kept


def test_standstill_holds_the_wavelength_and_sigma_grows():
    made = scene("const", 1.8, seed=4, seconds=1.2)
    block = made.block()
    still = np.column_stack(
        [np.full(800, block[-1, 0]) + 0.1 * np.random.default_rng(0).standard_normal(800), np.zeros(800)]
    )
    estimator = plain()
    before = estimator.process(block)
    after = estimator.process(still)
    assert after.wavelength_mm[-1] == pytest.approx(1.8, rel=0.005)
    assert after.wavelength_sigma_mm[-1] > after.wavelength_sigma_mm[10] > 0
    assert set(after.status[2:]) == {int(TrackingStatus.STANDSTILL)}
    assert np.all(after.frequency_Hz[2:] == 0)
    assert before.status[-1] == TrackingStatus.OK


def test_bad_samples_are_answered_with_a_status():
    made = scene("const", 1.8, seed=4, seconds=0.8)
    estimator = plain(saturation=50.0)
    estimator.process(made.block())
    held = estimator.update((made.readings[-1, 0], 100.0)).wavelength_mm
    for sample, status in [
        ((math.nan, 100.0), TrackingStatus.MISSING),
        ((math.inf, 100.0), TrackingStatus.MISSING),
        ((60.0, 100.0), TrackingStatus.MISSING),
        ((0.5, math.nan), TrackingStatus.NO_VELOCITY),
        ((0.5, -math.inf), TrackingStatus.NO_VELOCITY),
    ]:
        answer = estimator.update(sample)
        assert answer.status == status and answer.wavelength_mm == pytest.approx(held, rel=1e-3)
        assert answer.sentence
    assert math.isnan(estimator.update((0.5, math.nan)).frequency_Hz)


def test_rows_without_a_velocity_took_their_time_too():
    """Dropped rows arrive as NaN: the finger moved on meanwhile, and the phase with it."""
    made = scene("act1", 1.8, seed=4, seconds=1.4)
    block = made.block()
    rng = np.random.default_rng(0)
    for start in rng.integers(300, 1350, 8):
        block[start : start + rng.integers(1, 40)] = np.nan
    found = plain().process(block)
    known = (made.time_s > 0.6) & (found.status == TrackingStatus.OK)
    assert known.sum() > 500
    assert np.abs(found.wavelength_mm[known] / 1.8 - 1).max() < 0.005


def test_steps_of_the_baseline_hardly_move_the_wavelength():
    made = scene("const", 1.8, seed=4, seconds=1.6)
    block = made.block()
    block[900:, 0] += 20.0
    block[1200:, 0] -= 35.0
    found = plain().process(block)
    ratio = (found.wavelength_mm - 1.8)[700:] / found.wavelength_sigma_mm[700:]
    assert np.abs(found.wavelength_mm[700:] / 1.8 - 1).max() < 0.001
    assert math.sqrt(np.mean(ratio**2)) < 2.5


def test_of_two_wavelengths_one_is_answered_and_not_a_mix():
    made, other = (scene("const", value, seed=2, seconds=1.6) for value in (1.8, 1.1))
    block = made.block()
    block[:, 0] += other.readings[:, 0]
    found = plain().process(block).wavelength_mm[800:]
    nearest = np.where(np.abs(found / 1.8 - 1) < np.abs(found / 1.1 - 1), 1.8, 1.1)
    assert np.abs(found / nearest - 1).max() < 0.01


def test_a_step_up_is_found_within_three_periods():
    made = scene("const", 1.0, seed=6, seconds=1.2, step_to_mm=4.0, step_at_s=0.9)
    found = plain().process(made.block()).wavelength_mm
    assert found[1000:] == pytest.approx(np.full(200, 4.0), rel=0.05)


def test_aliases_are_refused():
    """At 1000 mm/s a wavelength of 1.8 mm makes 556 Hz, beyond what 1 kHz can carry."""
    made = scene("const", 1.8, seed=4, seconds=0.8)
    estimator = plain()
    estimator.process(made.block())
    fast = estimator.process(np.column_stack([np.zeros(5), np.full(5, 1000.0)]))
    assert set(fast.status[1:]) == {int(TrackingStatus.ALIASED)}
    assert fast.wavelength_mm[-1] == pytest.approx(1.8, rel=0.01)


def test_noise_and_dead_gauges_give_no_wavelength_that_is_called_ok_for_long():
    rng = np.random.default_rng(3)
    dead = plain().process(np.column_stack([np.full(400, 3.0), np.full(400, 100.0)]))
    assert np.isnan(dead.wavelength_mm).all()
    noise = plain().process(np.column_stack([rng.standard_normal(1500), np.full(1500, 100.0)]))
    assert np.mean(noise.status == TrackingStatus.OK) < 0.35


@pytest.mark.parametrize("rate", [500.0, 4000.0])
def test_the_sampling_rate_is_a_parameter(rate):
    made = scene("const", 2.4, seed=1, seconds=1.2, sample_rate_Hz=rate)
    found = plain(sample_rate_Hz=rate).process(made.block())
    assert found.wavelength_mm[-1] == pytest.approx(2.4, rel=2e-3)


def test_scale_offset_and_direction_do_not_matter():
    made = scene("const", 1.8, seed=2, seconds=1.0)
    reference = plain().process(made.block()).wavelength_mm[-1]
    big = plain().process(np.column_stack([2e4 + 1e3 * made.readings[:, 0], made.velocity_mm_s])).wavelength_mm[-1]
    back = plain().process(np.column_stack([made.readings[:, 0], -made.velocity_mm_s])).wavelength_mm[-1]
    assert big == pytest.approx(reference, rel=1e-7)
    assert back == pytest.approx(1.8, rel=1e-3)


def test_float32_and_integers_are_taken():
    made = scene("const", 1.8, seed=2, seconds=0.8)
    counts = np.round(100 * made.block()).astype(np.int64)
    counts[:, 1] = np.round(made.velocity_mm_s)
    found = plain().process(counts).wavelength_mm[-1] * made.velocity_mm_s[-1] / counts[-1, 1]
    assert found == pytest.approx(1.8, rel=3e-3)
    assert plain().process(made.block().astype(np.float32)).wavelength_mm[-1] == pytest.approx(1.8, rel=2e-3)


@pytest.mark.parametrize(
    "options, message",
    [
        ({"wavelength_range_mm": (2, 1)}, "wavelength_range_mm must span a factor 1.5 to 100, got 2 to 1 mm"),
        ({"wavelength_range_mm": (0, 1)}, "shortest wavelength"),
        ({"memory_s": 0.01}, "memory_s must be at least 50 samples"),
        ({"sample_rate_Hz": 0}, "sample_rate_Hz"),
        ({"shear_mm": -1}, "shear_mm"),
        ({"relaxation_mm": 0}, "relaxation_mm"),
        ({"saturation": math.nan}, "saturation"),
    ],
)
def test_unusable_values(options, message):
    with pytest.raises(InputError, match=message):
        plain(**options)


def test_samples_and_blocks_of_another_shape():
    with pytest.raises(InputError, match="a block must be n x 2"):
        plain().process(np.zeros((3, 3)))
    with pytest.raises(InputError, match="a sample must be"):
        plain().update((1.0, 2.0, 3.0))
    with pytest.raises(InputError, match="not of|holds"):
        plain().state = TrackerState((("fields", (1.0,)),))


@pytest.mark.slow
def test_compiled_gives_the_same_answers():
    block = scene("harsh", 1.8, seed=1, seconds=1.5).block()
    if not numba_available():
        with pytest.raises(MissingExtraError, match=r"papilla\[fast\]"):
            SpaceTracker(compiled=True)
        return
    first, second = plain().process(block), SpaceTracker(compiled=True).process(block)
    assert np.array_equal(first.status, second.status)
    for name in ("wavelength_mm", "wavelength_sigma_mm", "frequency_Hz"):
        assert getattr(first, name) == pytest.approx(getattr(second, name), rel=1e-9, nan_ok=True)
