"""The contract of every published estimator: chunks, states, faults, time, refusals."""

import math
import pickle

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla_papers.methods.roughness import (
    ImpulseDensity,
    ImpulseInterval,
    Okamoto,
    RoughnessStatus,
    ShortTimeSpectrum,
    ZeroCrossing,
    expected_error,
    optimal_period,
)  # fmt: skip

CLASSES = (ImpulseDensity, ImpulseInterval, ZeroCrossing, ShortTimeSpectrum, Okamoto)
KINDS = [(cls, variant) for cls in CLASSES for variant in ("as_printed", "corrected")]
every = pytest.mark.parametrize(
    "make",
    [lambda cls=cls, variant=variant, **more: cls(variant=variant, **more) for cls, variant in KINDS],
    ids=[f"{cls.__name__}-{variant}" for cls, variant in KINDS],
)


def same(first, second) -> bool:
    return all(np.array_equal(a, b, equal_nan=True) for a, b in zip(first, second, strict=True))


def joined(answers):
    return [np.concatenate(values) for values in zip(*answers, strict=True)]


def sampled(estimator, rows):
    return [np.array(values) for values in zip(*(estimator.update(row) for row in rows.tolist()), strict=True)]


def spoilt(rows: np.ndarray) -> np.ndarray:
    """A hard record: NaN bursts, infinities, missing velocities, a step, a still stretch."""
    rows = rows.copy()
    rows[300:310, 0], rows[500, 0], rows[600:620, 1] = np.nan, np.inf, np.nan
    rows[700:, 0] += 40.0
    rows[900:1150] = rows[900]
    rows[900:1150, 1] = 0.0
    return rows


@every
def test_chunks_samples_and_a_saved_state_change_no_bit(make, grating):
    rows, chunked, resumed = spoilt(grating(1.2, "act1", seconds=1.6)), make(), make()
    whole = make().process(rows)
    assert same(joined([chunked.process(part) for part in np.split(rows, [1, 7, 307, 308, 911])]), whole)
    assert same(sampled(make(), rows), whole)
    first = make()
    first.process(rows[:805])
    resumed.process(rows[::-1])
    resumed.state = pickle.loads(pickle.dumps(first.state))
    assert same(resumed.process(rows[805:]), [values[805:] for values in whole])
    size = len(pickle.dumps(resumed.state))
    for _ in range(3):
        resumed.process(rows)
    assert abs(len(pickle.dumps(resumed.state)) - size) < 200, "memory does not grow"
    resumed.reset()
    assert same(resumed.process(rows), whole)


@every
def test_where_only_rounding_decides_chunks_change_no_bit(make):
    """The spectrum of a single impulse is flat: each of its lines is the highest but for rounding."""
    rows = np.column_stack([np.zeros(900), np.full(900, 100.0)])
    rows[40::130, 0] = 3.7
    rows[500:, 0] += 1e5
    assert same(sampled(make(), rows), make().process(rows))


@every
@pytest.mark.parametrize("other", [{"window_s": 0.123}, {"wavelength_range_mm": (0.5, 6.0)}, {"sample_rate_Hz": 900.0}])
def test_a_state_of_other_settings_is_refused(make, other):
    with pytest.raises(InputError, match=r"the state is of \w+, .*; this is \w+, .* at 1000 Hz"):
        make().state = make(**other).state


@every
def test_faults_are_answered_with_a_status_and_leave_no_trace(make, grating):
    rows = grating(1.2, seconds=2.0)
    clean = make().process(rows)
    rows[400:410, 0], rows[600:602, 0] = np.nan, (1e9, 1e300)
    answer = make(saturation=100.0).process(rows)
    assert (answer.status[400:410] == RoughnessStatus.MISSING).all()
    assert answer.status[600] == RoughnessStatus.SATURATED
    assert answer.status[601] == RoughnessStatus.MISSING, "no sensor gives that"
    assert np.isnan(answer.wavelength_mm[400:410]).all() and np.isnan(answer.frequency_Hz[600])
    assert answer.status[411] in (RoughnessStatus.GAP, RoughnessStatus.OK)
    np.testing.assert_allclose(answer.frequency_Hz[1200:], clean.frequency_Hz[1200:], rtol=0.02)
    assert (answer.status[1200:] == clean.status[1200:]).all()
    assert set(answer.sentence) <= {status.sentence for status in RoughnessStatus}


@every
def test_standstill_unknown_velocity_and_a_dead_gauge(make, grating):
    rows = grating(1.2, seconds=1.5)
    unknown = make().process(np.column_stack([rows[:, 0], np.full(len(rows), np.nan)]))
    assert np.isfinite(unknown.frequency_Hz[-50:]).all() and np.isnan(unknown.wavelength_mm).all()
    still = make().process(np.column_stack([rows[:, 0], np.zeros(len(rows))]))
    dead = make().process(np.column_stack([np.full(len(rows), 3.0), rows[:, 1]]))
    for answer, status in ((unknown, "NO_VELOCITY"), (still, "STANDSTILL"), (dead, "SILENT")):
        assert (answer.status[-50:] == RoughnessStatus[status]).all()
    assert make().update(rows[0]).status == RoughnessStatus.WARMING_UP


@every
def test_times_make_gaps_and_duplicates_known(make, grating):
    rows = grating(1.2, seconds=1.5)
    timed = np.column_stack([rows, np.arange(len(rows)) / 1000.0])
    plain, jitter, timeless = make().process(rows), timed.copy(), timed.copy()
    jitter[:, 2] += np.random.default_rng(3).uniform(-2e-4, 2e-4, len(rows))
    assert same(make().process(jitter), plain), "jitter below half a period changes nothing"
    answer = make().process(np.repeat(timed, 2, axis=0))
    assert (answer.status[1::2] == RoughnessStatus.DUPLICATE).all() and same([values[0::2] for values in answer], plain)
    holed, missing, parts = np.delete(timed, np.arange(700, 720), axis=0), rows.copy(), make()
    missing[700:720, 0] = np.nan
    expected = [np.delete(values, np.arange(700, 720)) for values in make().process(missing)]
    assert same(make().process(holed), expected)
    assert same(joined([parts.process(part) for part in np.split(holed, [333, 700, 701])]), expected)
    timeless[[300, 800, 801], 2] = np.nan
    assert same(make().process(timeless), plain), "a sample without a time is the next one"


@every
def test_other_rates_integer_counts_and_float32(make, grating):
    rows, rate = grating(2.4, snr_dB=60, seconds=3.0, rate=2500.0), {"sample_rate_Hz": 2500.0}
    answer, kind = make(**rate).process(rows), make()
    literal = 2 if isinstance(kind, ImpulseInterval) and kind.variant == "as_printed" else 1
    off = abs(np.nanmedian(answer.frequency_Hz[-1000:]) - literal * rows[-1, 1] / 2.4)
    assert off < (25.0 if isinstance(kind, Okamoto) else 8.0)
    counts = np.column_stack([np.round(rows[:, 0] * 400), rows[:, 1]]).astype(np.float32)
    coarse = make(**rate).process(counts)
    assert np.isfinite(coarse.frequency_Hz[-1000:]).mean() > 0.9
    assert same(coarse, make(**rate).process(counts.astype(float)))


@every
def test_a_long_stream_leaves_no_rounding_behind(make, grating):
    """A spike of 1e11 in running sums would be felt forever; a window later nothing may be left of it."""
    rows, still = grating(1.2, seconds=2.0), np.column_stack([np.zeros(1500), np.full(1500, 100.0)])
    fresh, used, spike = make(), make(), rows[:900].copy()
    spike[::7, 0] = 1e11
    used.process(spike)
    used.process(still)
    fresh.process(still)
    assert same([values[700:] for values in used.process(rows)], [values[700:] for values in fresh.process(rows)])


@pytest.mark.parametrize(
    "arguments, message",
    [
        ({"variant": "better"}, "variant must be one of as_printed, corrected, got 'better'"),
        ({"window_s": 0.001}, "window_s must hold at least 8 samples"),
        ({"sample_rate_Hz": 0}, "sample_rate_Hz must be greater than 0"),
        ({"wavelength_range_mm": (3, 1)}, "wavelength_range_mm must rise, got 3 and 1"),
        ({"wavelength_range_mm": 3}, "wavelength_range_mm must be two numbers"),
        ({"saturation": math.nan}, "saturation .* must be greater than 0"),
    ],
)
@pytest.mark.parametrize("cls", CLASSES)
def test_unusable_parameters_are_refused(cls, arguments, message):
    with pytest.raises(InputError, match=message):
        cls(**arguments)


@pytest.mark.parametrize(
    "refused, message",
    [
        (lambda: setattr(ZeroCrossing(), "state", ZeroCrossing(high_pass_Hz=20.0).state), "high-pass of 20 Hz"),
        (lambda: setattr(ShortTimeSpectrum(), "state", ShortTimeSpectrum(hop_s=0.007).state), "every 7 samples"),
        (lambda: ShortTimeSpectrum(hop_s=0.3), "hop_s must be between one sample and window_s, got 0.3 s"),
        (lambda: ZeroCrossing(high_pass_Hz=500.0), "high_pass_Hz must be below half of sample_rate_Hz, got 500"),
        (lambda: ImpulseDensity().process(np.zeros((4, 5))), "n x 2 or 3 .* got 4 x 5"),
        (lambda: ImpulseDensity().update((1.0,)), "got 1 values"),
        (lambda: expected_error([0.1, 0.0], 1.0, 100.0, 1.0), "period_s must be positive"),
        (lambda: optimal_period(0.0, 100.0, 1.0), "wavelength_mm must be greater than 0"),
    ],
)
def test_states_blocks_and_parameters_of_one_method_are_refused(refused, message):
    with pytest.raises(InputError, match=message):
        refused()


@pytest.mark.parametrize("cls", CLASSES)
def test_limits_are_where_they_are_said_to_be(cls, grating):
    """Eight samples a window; half of the rate times the shortest wavelength, 200 mm/s, when corrected."""
    assert cls(window_s=0.008, **({"hop_s": 0.008} if issubclass(cls, ShortTimeSpectrum) else {})).window_samples == 8
    with pytest.raises(InputError, match="at least 8 samples, got 0.007 s"):
        cls(window_s=0.007)
    rows = grating(1.2, seconds=0.5)
    for speed, fast in ((198.0, False), (202.0, True)):
        rows[:, 1] = speed
        assert (cls(variant="corrected").process(rows).status[-1] == RoughnessStatus.ALIASED) == fast
        assert cls(variant="as_printed").process(rows).status[-1] == RoughnessStatus.OK, "no limit is printed"


@pytest.mark.parametrize("at", range(640, 650))
def test_the_very_last_speed_of_a_window_is_looked_at(at):
    """Whichever of the ten samples of a hop it is: only the spectra whose last sample it is say so."""
    rows = np.column_stack([np.sin(0.3 * np.arange(700)), np.full(700, 80.0)])
    rows[at, 1] = 400.0
    status = ShortTimeSpectrum(variant="corrected").process(rows).status
    assert (status[200:at] == RoughnessStatus.OK).all()
    assert (status == RoughnessStatus.ALIASED).sum() == (10 if (at - 199) % 10 == 0 else 0)
