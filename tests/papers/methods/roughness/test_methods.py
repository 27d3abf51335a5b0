"""What each published method answers, as printed and corrected, against what is known of it."""

import numpy as np
import pytest
from scipy.signal import butter, detrend, lfilter

from papilla.core.errors import InputError
from papilla_papers.methods.roughness import (
    ImpulseDensity,
    ImpulseInterval,
    Okamoto,
    RoughnessStatus,
    ShortTimeSpectrum,
    ZeroCrossing,
    expected_error,
    fit_amplitude,
    optimal_period,
)  # fmt: skip
from papilla_papers.methods.roughness.impulses import Corpuscle, UpwardCrossings

WAVELENGTHS = (0.6, 1.2, 1.8, 2.4, 3.0)


def grooves(speed=60.0, wavelength=3.0, seconds=1.0, rate=1000.0):
    """The record of the 2006 paper's figure 2 without noise: the reading drops into each groove and rises out of it."""
    position = speed * np.arange(round(seconds * rate)) / rate + 0.013
    inside = position % wavelength / wavelength
    reading = np.interp(inside, [0, 0.04, 0.5, 0.54, 1], [0, -1, -1, 0, 0])
    return np.column_stack([reading, np.full(len(reading), speed)])


def test_two_impulses_a_groove_and_the_printed_example():
    rows = grooves()
    impulses = np.array([*map(Corpuscle(200, Corpuscle.PRINTED).fire, rows[:, 0].tolist())])
    falling, rising = (np.flatnonzero(impulses == edge) for edge in (-1, 1))
    assert (np.diff(falling[2:]) == 50).all() and (np.diff(rising[2:]) == 50).all(), "0.050 s apart at 60 mm/s"
    answer = ImpulseDensity().process(rows)
    assert answer.frequency_Hz[-1] == 20.0 and answer.wavelength_mm[-1] == pytest.approx(3.0)


def test_the_interval_read_literally_is_twice_the_frequency_and_corrected_is_it():
    literal, corrected = (ImpulseInterval(variant=name).process(grooves()) for name in ("as_printed", "corrected"))
    assert np.median(literal.frequency_Hz[300:]) == pytest.approx(40.0, rel=0.03)
    np.testing.assert_allclose(corrected.frequency_Hz[300:], 20.0)
    np.testing.assert_allclose(corrected.wavelength_mm[300:], 3.0)


def test_density_by_hand():
    """Equations (1)-(4) written out once more, sample by sample, over a whole record."""
    rows = np.round(grooves(speed=83.0, wavelength=1.7), 3)
    x = np.abs(np.diff(rows[:, 0], prepend=np.nan)) * 1000
    above = np.zeros(len(x), bool)
    for k in range(1, len(x)):
        above[k] = x[k] > 1.5 * np.nanmean(x[max(k - 199, 0) : k + 1])
    pulses = above & ~np.concatenate([[False], above[:-1]])
    answer = ImpulseDensity().process(rows)
    for k in range(220, len(x), 37):
        count = pulses[k - 199 : k + 1].sum()
        assert answer.frequency_Hz[k] == pytest.approx(count / (2 * 0.2))
        assert answer.wavelength_mm[k] == pytest.approx(83.0 * 2 * 0.2 / count)


def test_crossings_by_hand():
    """High-passed by SciPy, an impulse at each step from not above zero to above it, as printed and with hysteresis."""
    readings = grooves(wavelength=2.1)[:, 0] + 0.05 * np.random.default_rng(2).normal(size=1000)
    passed = lfilter(*butter(1, 10.0, "highpass", fs=1000.0), readings - readings[0])
    size = np.array([np.mean(np.abs(passed[max(k - 79, 0) : k + 1])) for k in range(1000)])
    for threshold in (UpwardCrossings.PRINTED, UpwardCrossings.CORRECTED):
        expected, over = [], False
        for value, mean in zip(passed, size, strict=True):
            was, over = over, value > (threshold.release if over else threshold.factor) * mean
            expected.append(float(over and not was))
        fired = [*map(UpwardCrossings(80, threshold, 1000.0, 10.0).fire, readings.tolist())]
        assert fired == expected and 25 < sum(fired) < 200
    for method, samples in ((ImpulseDensity, 200), (ImpulseInterval, 200), (ZeroCrossing, 80)):
        assert {method(variant=variant).window_samples for variant in ("as_printed", "corrected")} == {samples}
    assert Corpuscle.PRINTED == (1.5, 1.5) and pytest.approx((1.2, 0.96)) == Corpuscle.CORRECTED
    assert UpwardCrossings.PRINTED == (0.0, 0.0) and UpwardCrossings.CORRECTED == (0.0, -0.7)


def test_the_printed_threshold_loses_the_finest_grating_and_the_corrected_does_not(grating, rms_error):
    answer = ImpulseDensity().process(grating(0.6, snr_dB=40.0))
    assert 1.7 < np.nanmedian(answer.wavelength_mm[1000:]) / 0.6 < 2.05
    assert rms_error(ImpulseDensity, WAVELENGTHS, snr_dB=40.0) > 0.3
    assert rms_error(lambda: ImpulseDensity(variant="corrected"), WAVELENGTHS, snr_dB=40.0) < 0.04
    assert rms_error(lambda: ImpulseInterval(variant="corrected"), WAVELENGTHS, snr_dB=40.0) < 0.04


@pytest.mark.parametrize(
    "make, variant, kind, least, most",
    [
        (ZeroCrossing, "as_printed", "const", 0.107, 0.147), (ZeroCrossing, "corrected", "act2", 0, 0.17),
        (ZeroCrossing, "as_printed", "act2", 0.33, 1), (ShortTimeSpectrum, "as_printed", "const", 0.021, 0.041),
        (ShortTimeSpectrum, "corrected", "const", 0, 0.001), (ShortTimeSpectrum, "as_printed", "act1", 1, 3),
        (Okamoto, "as_printed", "const", 0.14, 0.2), (Okamoto, "corrected", "const", 0, 0.005),
        (Okamoto, "corrected", "act2", 0, 0.11), (Okamoto, "as_printed", "act2", 0.16, 0.24),
    ],
)  # fmt: skip
def test_the_figures_of_the_docstrings(make, variant, kind, least, most, rms_error):
    assert least < rms_error(lambda: make(variant=variant), WAVELENGTHS, kind) < most


@pytest.mark.parametrize("window_s", [0.1, 0.2])
@pytest.mark.parametrize("variant", ["as_printed", "corrected"])
def test_power_is_the_spectral_density_of_the_line(variant, window_s):
    """A sinusoid of amplitude a in a window of T seconds without taper has the density a^2 T / 2 at its line."""
    time = np.arange(600) / 1000
    rows = np.column_stack([3.0 * np.sin(2 * np.pi * 50 * time + 0.3), np.full(600, 100.0)])
    answer = ShortTimeSpectrum(variant=variant, window_s=window_s).process(rows)
    spread = 1.0 if variant == "as_printed" else 1.5  # equivalent noise bandwidth of the Hann taper
    assert answer.power[-1] == pytest.approx(0.5 * 9.0 * window_s / spread, rel=0.02)
    assert answer.frequency_Hz[-1] == pytest.approx(50.0, abs=0.02)


@pytest.mark.parametrize("method, hop", [(ShortTimeSpectrum, 10), (Okamoto, 1)])
@pytest.mark.parametrize("variant", ["as_printed", "corrected"])
def test_spectra_by_hand(method, hop, variant, grating):
    """The window, its taper, the line, its density and the wavelength written out once more, in strokes with noise."""
    rows, estimator = grating(1.8, "act1", seconds=1.2, snr_dB=10.0), method(variant=variant)
    answer, size, corrected = estimator.process(rows), estimator.window_samples, variant == "corrected"
    windows = {ShortTimeSpectrum: (200, 200), Okamoto: (32, 80)}
    assert size == windows[method][corrected]
    taper = np.hamming(size) if method is Okamoto else np.hanning(size + 2)[1:-1] if corrected else np.ones(size)
    padding, compared = 4 if corrected else 1, 0
    for last in range(size - 1 + 30 * hop, 1200, 7 * hop):
        part, speeds = rows[last + 1 - size : last + 1, 0], np.abs(rows[last + 1 - size : last + 1, 1])
        power = np.abs(np.fft.rfft((detrend(part) if corrected else part) * taper, padding * size)) ** 2
        line_Hz, speed = 1000 / (padding * size), speeds @ taper**2 / (taper @ taper)
        low, high = (speed / limit / line_Hz for limit in (6.0, 0.4)) if corrected else (1, len(power) - 2)
        best = int(low) + int(power[int(low) : int(high) + 1].argmax())
        if answer.status[last] == 0:
            a, b, c = np.log(power[best - 1 : best + 2])
            place = best + (0.5 * (a - c) / (a - 2 * b + c) if corrected else 0.0)
            assert answer.frequency_Hz[last] == pytest.approx(place * line_Hz, rel=1e-6)
            assert answer.wavelength_mm[last] == pytest.approx(
                (speed if corrected else speeds[-1]) / place / line_Hz, rel=1e-6
            )
            assert answer.power[last] == pytest.approx(2 * power[best] / 1000 / (taper @ taper), rel=1e-6)
            compared += 1
    assert compared > (10 if hop > 1 else 90)


def test_only_lines_of_the_wavelength_range_count_when_corrected():
    time = np.arange(1200) / 1000
    for wavelength, inside in ((0.403, True), (0.397, False), (5.9, True), (6.4, False)):
        for method in (ShortTimeSpectrum, Okamoto):
            rows = np.column_stack([np.sin(2 * np.pi * 150.0 / wavelength * time), np.full(1200, 150.0)])
            answer = method(variant="corrected", window_s=0.4).process(rows)
            assert np.isfinite(answer.wavelength_mm[-1]) == inside, wavelength
            assert not inside or answer.wavelength_mm[-1] == pytest.approx(wavelength, rel=1e-3)


def test_a_sample_is_late_after_one_and_a_half_periods_and_a_duplicate_before_half(grating):
    rows = grating(1.2, seconds=0.8)
    for step, statuses in ((0.46, "DUPLICATE"), (0.54, "OK"), (1.46, "OK"), (1.54, "GAP")):
        times = np.arange(800) / 1000
        times[600:] += (step - 1) / 1000
        answer = ImpulseDensity().process(np.column_stack([rows, times])).sentence[600]
        assert answer == RoughnessStatus[statuses].sentence, step
    reading = np.column_stack([10.0 * np.sin(np.arange(400.0)), np.full(400, 90.0)])
    reading[350, 0], reading[351, 0] = 11.0, -10.999
    assert ImpulseDensity(saturation=11.0).process(reading).status[350:352].tolist() == [
        RoughnessStatus.SATURATED, RoughnessStatus.GAP]  # fmt: skip


@pytest.mark.parametrize("line_Hz", [50.0, 73.4])
def test_matrix_and_transform_are_the_same_spectrum(line_Hz):
    """A short window is transformed by a matrix, a long one by the fast transform: the line is the same, its density
    grows with the window."""
    rows = np.column_stack([3.0 * np.sin(2 * np.pi * line_Hz * np.arange(1500) / 1000), np.full(1500, 100.0)])
    short, long = (ShortTimeSpectrum(variant="corrected", window_s=window_s).process(rows) for window_s in (0.2, 1.0))
    assert [one.frequency_Hz[-1] for one in (short, long)] == pytest.approx([line_Hz] * 2, abs=0.05)
    assert 5 * short.power[-1] == pytest.approx(long.power[-1], rel=0.05)


def test_spectra_are_held_between_hops(grating):
    answer = ShortTimeSpectrum().process(grating(1.8))
    changes = np.flatnonzero(np.diff(answer.power[250:]) != 0)
    assert changes.size and (np.diff(changes) % 10 == 0).all()


@pytest.mark.parametrize("period", [0.06, 0.1, 0.15])
def test_the_expected_error_is_what_counting_does(period):
    """Whole periods counted over A in a sinusoidal touch: two whole cycles, many phases, against the formula."""
    wavelength, speed, rate = 1.3, 100.0, 2000.0
    turn = 2 * np.pi * np.arange(round(3 * rate)) / rate
    position, truth = speed / (2 * np.pi) * (1 - np.cos(turn)), speed / wavelength * np.sin(turn)
    # Signed: a period passed backwards counts back, so that the mean is v / wavelength at reversals too.
    passed = np.floor(position / wavelength + np.random.default_rng(5).uniform(0, 1, (60, 1)))
    count = passed - np.roll(passed, round(period * rate), axis=1)
    rms = np.sqrt(np.mean((count / period - truth)[:, round(rate) :] ** 2))
    assert rms == pytest.approx(expected_error(period, wavelength, speed, 1.0), rel=0.03)
    assert optimal_period(3.48, 100.0, 1.0) == pytest.approx(0.08, rel=2e-3), "the printed window of natural touch"
    periods = np.linspace(0.02, 0.3, 2801)
    best = periods[np.argmin(expected_error(periods, 2.0, 200.0, 0.7))]
    assert best == pytest.approx(optimal_period(2.0, 200.0, 0.7), rel=0.02)


def test_amplitude_over_wavelength_is_a_quartic():
    wavelength, truth = np.linspace(0.8, 2.0, 9), np.array([0.7, -4.1, 8.2, -6.4, 1.9])
    fit = fit_amplitude(wavelength, np.polyval(truth, wavelength))
    np.testing.assert_allclose(fit.coefficients, truth, rtol=1e-8)
    assert fit.r_squared == pytest.approx(1.0) and fit.freedom == 4
    noisy = np.polyval(truth, wavelength) + 0.02 * np.random.default_rng(1).normal(size=9)
    other = fit_amplitude(wavelength, noisy)
    missed = np.sum((noisy - other(wavelength)) ** 2) / np.sum((noisy - noisy.mean()) ** 2)
    assert other.r_squared == pytest.approx(1 - missed) and 0.5 < other.r_squared < 1.0
    with pytest.raises(InputError, match="5 different wavelengths, got 4"):
        fit_amplitude([1, 2, 3, 4, 4], [1, 2, 3, 4, 5])
    with pytest.raises(InputError, match="must lie between 0.8 and 2"):
        fit(2.1)
