"""What breaks a frequency without a velocity: bad samples, disturbances, motions that turn, long streams, other rates.

Scenes are 30 dB gratings; "found" is the median error of the frequency `lag_s` ago, over rows that are called ok.
"""

import math
import pickle

import numpy as np
import pytest

from papilla.estimators.tracking import blind_kernel, blind_loops, blind_vectors
from papilla.estimators.tracking.blind import ChirpStatus, ChirpTracker
from papilla.studies.estimator_bench.scenes import scene

SNR = 30.0


def plain(**options) -> ChirpTracker:
    return ChirpTracker(compiled=False, **options)


def grating(wavelength=1.2, kind="const", seconds=1.2, **options):
    return scene(kind, wavelength, snr_dB=SNR, seed=21, seconds=seconds, **options)


def sound(found) -> bool:
    """Whether every answer is one: a known status, no infinity, nothing negative."""
    columns = (found.frequency_Hz, found.frequency_sigma_Hz, found.wavelength_mm, found.wavelength_sigma_mm)
    known = set(found.status.tolist()) <= set(map(int, ChirpStatus))
    return known and all(np.all(np.isnan(c) | ((c >= 0) & (c < math.inf))) for c in columns)


def errors(made, found, rows=slice(600, None), lag_s=0.014):
    """(median |relative error| of the frequency, RMS of error over sigma, share) of rows that are called ok."""
    truth = np.roll(made.frequency_Hz, round(lag_s * made.sample_rate_Hz))[rows]
    ok = found.status[rows] == ChirpStatus.OK
    error = (found.frequency_Hz[rows] - truth)[ok]
    ratio = error / found.frequency_sigma_Hz[rows][ok]
    return np.median(np.abs(error / truth[ok])), math.sqrt(np.mean(ratio**2)), np.mean(ok)


@pytest.mark.parametrize("case", ["hum", "jitter", "second", "counts", "single", "steps"])
def test_disturbed_readings(case):
    made = grating()
    block, time = made.block(), made.time_s
    rng = np.random.default_rng(3)
    if case == "hum":
        block[:, 0] += 0.2 * np.sin(2 * math.pi * 50 * time)
    elif case == "jitter":
        block[:, 0] = np.interp(time + rng.uniform(-2e-4, 2e-4, time.size), time, made.readings[:, 0])
    elif case == "second":
        block[:, 0] += 0.2 * np.sin(2 * math.pi * made.position_mm / 2.9)
    elif case == "counts":
        block = np.round(2048 + 20 * block).astype(np.int32)
        block[:, 1] = 100
    elif case == "single":
        block = block.astype(np.float32)
    elif case == "steps":
        block[:, 0] += 4.0 * (np.floor(time / 0.35) % 2)
    found = plain().process(block)
    assert sound(found)
    whole = np.median(np.abs(found.frequency_Hz[600:] / made.frequency_Hz[600:] - 1))
    assert whole < 0.01
    # A hum or a second texture is not explained by the lock: what it says is right, but it may say that it doubts.
    if case not in ("hum", "second"):
        error, _, share = errors(made, found)
        assert error < 0.01 and share > 0.5


@pytest.mark.parametrize("lost", ["burst", "dropped", "repeated"])
def test_lost_samples(lost):
    """NaN for 15 of each 250 samples; or every 97th sample missing, or sent twice, and nobody says so."""
    made = grating(seconds=1.5)
    block, number = made.block(), np.arange(1500)
    rows = number
    if lost == "burst":
        block[number % 250 < 15, 0] = math.nan
    else:
        rows = number[number % 97 != 0] if lost == "dropped" else np.repeat(number, 1 + (number % 97 == 0))
    found = plain().process(block[rows])
    assert sound(found)
    after = slice(700, 1400)
    usable = np.isfinite(block[rows, 0])[after]
    assert np.all((found.status[after] == ChirpStatus.MISSING) == ~usable)
    truth = made.frequency_Hz[0]
    assert np.median(np.abs(found.frequency_Hz[after] / truth - 1)) < 0.02
    # Each sample that is lost unsaid is a jump of the phase, which is in doubt for a while.
    assert np.mean(found.status[after][usable] == ChirpStatus.OK) > 0.2


def test_a_clipped_signal_keeps_its_frequency():
    made = grating()
    block = made.block()
    block[:, 0] = np.clip(block[:, 0], -0.8, 0.8)
    error, _, share = errors(made, plain().process(block))
    assert error < 0.01 and share > 0.9


def test_two_equal_wavelengths_are_not_told_as_one():
    """What one chirp does not explain leaves coloured innovations: its frequency is not called ok for long."""
    made, other = grating(), grating(2.1)
    block = made.block()
    block[:, 0] += other.readings[:, 0]
    found = plain().process(block)
    assert np.mean(found.status[700:] == ChirpStatus.OK) < 0.3


def test_an_alias_is_told_as_the_frequency_that_it_looks_like():
    """900 Hz at 1 kHz are 100 Hz: without a velocity nobody can know better, so the range must exclude it."""
    time = np.arange(900) / 1000.0
    noise = 0.03 * np.random.default_rng(1).standard_normal(900)
    found = plain().process(np.sin(2 * math.pi * 900 * time) + noise)
    assert found.frequency_Hz[-1] == pytest.approx(100.0, rel=0.01)
    assert found.status[-1] == ChirpStatus.OK


@pytest.mark.parametrize("rate", [500.0, 2000.0])
def test_reversals_at_other_rates(rate):
    made = grating(3.0, "act1", 1.6, sample_rate_Hz=rate)
    tracker = plain(sample_rate_Hz=rate)
    found = tracker.process(made.block())
    after = slice(round(0.8 * rate), None)
    error, ratio, share = errors(made, found, after, tracker.lag_s)
    assert error < 0.02 and 0.3 < ratio < 2 and share > 0.8


def strokes(seed: int, seconds: float = 3.0):
    """(velocity, readings) of a hand on a grating of 1.2 mm: minimum-jerk strokes out and back, with rests between."""
    rng = np.random.default_rng(seed)
    velocity = np.zeros(round(seconds * 1000))
    at, sign = 0, 1.0
    while at < velocity.size:
        length = round(1000 * rng.uniform(0.4, 0.8))
        place = (np.arange(length) + 0.5) / length
        stroke = sign * rng.uniform(100, 180) * 16 * (place * (1 - place)) ** 2
        end = min(at + length, velocity.size)
        velocity[at:end] = stroke[: end - at]
        at, sign = end + round(1000 * rng.uniform(0, 0.2)), -sign
    phase = 2 * math.pi * np.cumsum(velocity) / 1000 / 1.2
    clean = 1.3 * np.cos(phase) + 0.4 * np.cos(2 * phase + 1) + 0.2 * np.cos(3 * phase - 1)
    return velocity, clean + 0.1 * rng.standard_normal(velocity.size)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_hand_that_starts_stops_and_turns(seed):
    """What is called ok is right within what it says; no rest is called a texture for long."""
    velocity, readings = strokes(seed)
    found = plain().process(np.column_stack([readings, velocity]))
    assert sound(found)
    truth = np.roll(np.abs(velocity) / 1.2, 14)
    moving = (np.arange(velocity.size) > 700) & (truth > 40)
    ok = moving & (found.status == ChirpStatus.OK)
    error = found.frequency_Hz - truth
    assert ok.sum() > 0.7 * moving.sum()
    assert math.sqrt(np.mean((error[ok] / truth[ok]) ** 2)) < 0.05
    assert math.sqrt(np.mean((error[ok] / found.frequency_sigma_Hz[ok]) ** 2)) < 1.6


def test_a_long_stream_neither_grows_nor_drifts():
    """After ten hours' worth of counted samples, far from where it began, a grating is followed as on the first day."""
    made = grating(seconds=0.8)
    young, old = plain(), plain()
    size = len(pickle.dumps(young.state))
    first = young.process(made.block())
    values = {name: list(array) for name, array in old.state.arrays}
    values["guide"][blind_kernel.SEEN] = 3.6e7
    old.state = type(old.state)(tuple((name, tuple(array)) for name, array in values.items()))
    # Counted as seen, but empty: as after an hour of missing readings.
    old.process(np.full(500, math.nan))
    later = old.process(made.block())
    assert len(pickle.dumps(old.state)) == pytest.approx(size, rel=0.01)
    assert later.frequency_Hz[-1] == pytest.approx(first.frequency_Hz[-1], rel=0.005)
    assert later.frequency_sigma_Hz[-1] == pytest.approx(first.frequency_sigma_Hz[-1], rel=0.5)
    assert later.status[-1] == ChirpStatus.OK


@pytest.mark.parametrize("part", range(1, 26, 3))
def test_a_state_saved_while_it_searches_goes_on_bit_for_bit(part):
    """At every part of a look, with a lock that is in doubt and with none yet."""
    block = grating(kind="act1", seconds=0.42).block()
    block[300:, 0] += 3.0
    whole = plain().process(block)
    tracker, seen = plain(), 0
    for number, row in enumerate(block.tolist()):
        tracker.update(row)
        guide = dict(tracker.state.arrays)["guide"] if number > 140 else None
        if guide is not None and abs(guide[blind_kernel.PART] - part) <= 1:
            other = plain()
            other.state = pickle.loads(pickle.dumps(tracker.state))
            rest = other.process(block[number + 1 :])
            assert all(np.array_equal(a, b[number + 1 :], equal_nan=True) for a, b in zip(rest, whole, strict=True))
            seen += 1
            if seen == 2:
                break
    assert seen


RNG = np.random.default_rng(6)


def covariance(size, width):
    root = RNG.standard_normal((size, size))
    return np.hstack([root @ root.T + np.eye(size), RNG.standard_normal((size, width - size))])


def filled_row():
    return np.concatenate([[0.3], np.zeros(3), RNG.standard_normal(10)])


RING = np.where(RNG.random(90) < 0.1, np.nan, RNG.standard_normal(90))
CASES = {
    "carry_motion": lambda: (covariance(14, 20), 0.01, 3.0, 200.0),
    "add_diagonal": lambda: (covariance(14, 20), RNG.random(14), 0.3),
    "faded_row": lambda: (RNG.standard_normal(14), 0.2, 4, np.zeros(14)),
    "spread_rows": lambda: (covariance(14, 20), filled_row(), np.zeros(20)),
    "take_rows": lambda: (RNG.random(20), covariance(14, 20), RNG.random(6), RNG.standard_normal(20), 3.0, 0.4),
    "symmetrise": lambda: (covariance(14, 20) + np.tri(14, 20) * 1e-3,),
    "unrolled": lambda: (RING.copy(), 40, 3, np.zeros(25), np.zeros(25)),
    "demodulated": lambda: (90.0, 700.0, np.linspace(-0.1, 0, 40), RNG.standard_normal(40)),
    "faded_block": lambda: (
        RNG.standard_normal(14), 0.1, 4, np.linspace(-0.01, 0, 9), (RNG.random(9) > 0.3) * 1.0, RNG.standard_normal(9),
        np.zeros((14, 9)), np.zeros(9),
    ),
    "take_block": lambda: (
        RNG.standard_normal(14), covariance(14, 14), RNG.standard_normal((14, 9)), RNG.standard_normal(9), 0.5,
        np.zeros((9, 9)), np.zeros((15, 9)),
    ),
    "weighed": lambda: ((RNG.random(9) > 0.3) * 1.0, (RNG.random(9) > 0.5) * 1.0, RNG.standard_normal(9), 2.0),
    "centred": lambda: (RNG.random(30), (RNG.random(30) > 0.2) * 1.0, RNG.standard_normal(30), np.zeros((2, 30))),
    "correlate": lambda: (RNG.standard_normal((2, 30)), RNG.standard_normal((30, 11)), np.zeros((2, 11))),
    "add_squares": lambda: (RNG.standard_normal((2, 11)), 0.7, RNG.random((2, 11))),
    "comb": lambda: (RNG.random((8, 40)), 4, 3),
    "begin_with": lambda: (RNG.standard_normal(14), covariance(14, 14), np.zeros(20), np.zeros((14, 20))),
}  # fmt: skip
"""Arguments of each sum that has two forms; those that are arrays may be written to."""
SCRATCH = {"take_block": (5, 6)}
"""Numbers of the arguments that one form alone uses."""


@pytest.mark.parametrize("name", [function.__name__ for function in blind_vectors.VECTORS])
def test_numpy_and_loops_agree(name):
    given = CASES[name]()
    other = tuple(item.copy() if isinstance(item, np.ndarray) else item for item in given)
    pairs = [
        (getattr(blind_vectors, name)(*given), getattr(blind_loops, name)(*other)),
        *zip(given, other, strict=True),
    ]
    for number, (first, second) in enumerate(pairs):
        if number - 1 in SCRATCH.get(name, ()):
            continue
        assert (first is None) == (second is None)
        if first is not None:
            assert np.allclose(first, second, rtol=1e-9, atol=1e-11, equal_nan=True)


def test_both_forms_are_of_the_same_names():
    assert [f.__name__ for f in blind_vectors.VECTORS] == [f.__name__ for f in blind_loops.LOOPS]
