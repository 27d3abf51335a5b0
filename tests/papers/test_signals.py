"""The signals that experiments share, and what they are made of: closed forms, and records without noise."""

import math

import numpy as np
import pytest
from pytest import approx

from papilla.core.units import INCH_MM
from papilla.model.finger import Finger
from papilla_papers.claims import signals
from papilla_papers.claims.experiments import fitted, gratings, impulses, softness, textiles, wavelets
from papilla_papers.methods.roughness import ShortTimeSpectrum

RNG = np.random.default_rng(5)
NOISE = RNG.standard_normal(2000)


def test_lags_correlations_and_shares_are_those_of_made_up_columns():
    late = np.append(np.full(37, np.nan), NOISE[:-37])
    for rate, lag in ((1000.0, 37.0), (500.0, 74.0)):
        assert signals.lag_ms(late, NOISE, rate) == lag and signals.follows(late, NOISE, rate) == approx(1)
    assert abs(signals.correlation(late, NOISE)) < 0.1 and signals.correlation(-3 * late, late) == approx(-1)
    assert signals.lag_ms(np.append(np.full(260, np.nan), NOISE[:-260]), NOISE, 1000.0) != 260, "beyond the longest"
    assert signals.lag_ms(np.append(np.full(250, np.nan), NOISE[:-250]), NOISE, 1000.0) == 250
    few, more = (np.where(np.arange(400) < count, late[:400], np.nan) for count in (137, 138))
    assert (signals.lag_ms(few, NOISE[:400], 1000.0), signals.lag_ms(more, NOISE[:400], 1000.0)) == (0, 37)
    assert [signals.share_of_noise(level) for level in (0, 20, 40)] == approx([1, 0.1, 0.01])
    assert signals.times(0.5, 8.0).tolist() == [0, 0.125, 0.25, 0.375] and signals.times(2.0)[-1] == 1.999
    levels = [np.array([3.0, 3.2]), np.array([2.0, 2.2]), np.array([1.9, 2.1]), np.array([]), np.array([0.5, 0.5])]
    assert signals.apart(levels) == 0.25 and signals.apart(levels[:2]) == 1 and signals.apart(levels[1::-1]) == 0
    assert signals.last_number([1.0, 2.0, np.nan]) == 2 and math.isnan(signals.last_number([np.nan]))
    assert signals.listed([1.004, 2.5]) == "1.00, 2.50" and signals.listed([0.5], ".0%") == "50%"


def test_errors_of_scenes_are_root_mean_squares_of_clipped_ratios():
    seen = signals.noisy_scene("const", 1.8, "2007", 1, seconds=3.0)
    silent = signals.noisy_scene("const", 1.8, "2007", 1, seconds=3.0, cause=False)
    assert silent.readings.std() == approx(seen.readings.std(), rel=0.05)
    assert abs(np.corrcoef(silent.readings[:, 0], seen.readings[:, 0])[0, 1]) < 0.15
    estimate, answered = signals.answers_to(ShortTimeSpectrum(), seen)
    off = np.clip(estimate.wavelength_mm[answered] / 1.8 - 1, -1, 3)
    error = signals.wavelength_error(ShortTimeSpectrum(), seen)
    assert error == approx(np.sqrt(np.mean(off**2))) and 0 < error < 0.1
    other = signals.wavelength_error(ShortTimeSpectrum(), silent)
    assert signals.mean_error(ShortTimeSpectrum, [seen, silent]) == approx(np.hypot(error, other) / np.sqrt(2))
    assert signals.answers_mm(ShortTimeSpectrum(), seen) == approx(1.8 * (off + 1))
    assert signals.wavelength_error(ShortTimeSpectrum(window_s=4.0), seen) == 1, "no answer at all"
    assert other <= 3


def test_channels_over_a_grating_are_waves_of_power_one_one_behind_the_other():
    place = np.linspace(0, 4.8, 961)
    first, second = wavelets.channels(place, 0.48, RNG, (0.0, 0.1), np.array([[2.0], [0.5]]), snr_dB=math.inf)
    np.testing.assert_allclose(first, 2 * np.sqrt(2) * np.sin(2 * np.pi * place / 0.48))
    np.testing.assert_allclose(second, 0.5 * np.sqrt(2) * np.sin(2 * np.pi * (place - 0.1) / 0.48))
    assert np.std(wavelets.channels(0 * place, 0.48, RNG, snr_dB=10.0)[1]) == approx(10**-0.5, rel=0.1)
    time = np.arange(1050) / 300
    speed = wavelets.passive_speed(time)
    assert np.cumsum(speed)[[598, -1]] / 300 == approx([10, 20], rel=0.01) and speed.max() == 10
    assert np.flatnonzero(np.diff(speed)).tolist() == [149, 599, 899]
    assert wavelets.phase_deg(2.36) == approx(0, abs=1e-9) and wavelets.phase_deg(4 * 2.36) == approx(90)
    values = RNG.standard_normal((8, 20))
    ends = values.max(axis=1).mean(), values.min(axis=1).mean()
    assert wavelets.indices(values) == approx((values.mean(), values.std(ddof=1), *ends))


def test_a_rub_is_felt_for_115_ms_by_each_row_while_the_speed_rises():
    """The window of 20 samples about the middle of what both feel goes from 22 to 31 mm/s."""
    assumed = wavelets.RunParameters(speed_spread=0.0, edge_s=0.015, snr_dB=math.inf)
    speed, (first, second, fourth) = wavelets.active_records(0.48, np.random.default_rng(1), assumed)
    time = np.arange(len(speed)) / 300 - 0.4
    np.testing.assert_array_equal(first, second)
    assert len(time) == 300 and all(np.ptp(time[record != 0]) == approx(0.115, abs=0.007) for record in (first, fourth))
    starts = [time[np.flatnonzero(record)[0]] for record in (first, fourth)]
    assert starts == approx([0, 0.035], abs=0.007)
    middle = np.mean([0.5 * (0.035 + 0.115), 0.5 * 0.115]) + 3.5 / 300  # Of both pairs
    assert np.interp(middle + np.array([-9.5, 0, 9.5]) / 300, time, speed) == approx([22, 26.5, 31], abs=1e-6)
    assert (speed.min(), speed.max()) == (5, 50), "the limits"
    steady, _ = wavelets.active_records(0.48, np.random.default_rng(1), assumed, cause=False)
    assert steady == approx(26.5)
    inner = (time > starts[1] + 0.02) & (time < 0.09)
    grating = np.sin(2 * np.pi * np.cumsum(speed) / 300 / 0.48 + np.linspace(0, 2 * np.pi, 721)[:, None])
    assert np.abs(grating[:, inner] * np.sqrt(2) - first[inner]).max(axis=1).min() < 0.02
    spread = wavelets.RunParameters(speed_spread=0.1, edge_s=0.015)
    ratios = [
        wavelets.active_records(0.48, np.random.default_rng(seed), spread)[0][100] / speed[100] for seed in range(40)
    ]
    assert np.std(ratios) == approx(0.1, rel=0.3) and np.mean(ratios) == approx(1, abs=0.05)


def test_a_campaign_is_eight_runs_a_grating():
    runs = wavelets.campaign(3, wavelets.STEADY_RUNS)
    assert [run.period_mm for run in runs] == [0.40] * 8 + [0.44] * 8 + [0.48] * 8
    table = wavelets.table_3(runs)
    for number, period in enumerate((0.40, 0.44, 0.48)):
        for pair in (0, 1):
            samples = np.array([run.frequency_Hz[pair] for run in runs if run.period_mm == period])
            assert samples.shape == (8, 20) and table[number, pair] == approx(wavelets.indices(samples))
            assert samples.mean() == approx(27 / period, rel=0.15)
    assert all(run.windows[0].mean_Hz == approx(run.frequency_Hz[0].mean()) for run in runs)


@pytest.mark.parametrize("name, yarns", [("1", (95, 64)), ("3", (175, 108))])
def test_a_fabric_has_the_lines_of_its_yarns_and_noise_that_falls(name, yarns):
    pure = textiles.fabric(name, np.random.default_rng(2), 12.7, textiles.Fibres(0.0, 0.5))
    lines = 2 / len(pure) * np.abs(np.fft.rfft(pure))
    expected = np.zeros(len(lines))
    for k in (1, 2, 3):
        expected[[round(4 * 12.7 * k * count / INCH_MM) for count in yarns]] = 1 / k
    np.testing.assert_allclose(lines, expected, atol=1e-9)
    fibres = textiles.Fibres(0.3, 1.0)
    noise = textiles.fabric(name, np.random.default_rng(2), 12.7, fibres) - pure
    assert noise.std() == approx(0.3 * pure.std())
    power = np.abs(np.fft.rfft(noise)) ** 2
    rising = [power[round(4 * f) : round(8 * f)].mean() for f in (1, 3, 40, 80, 160)]
    assert rising[0] == approx(rising[1], rel=1.2) and rising[2] / rising[4] == approx(16, rel=0.3)


def test_pure_parts_of_other_experiments():
    time = np.arange(500) / 1000
    depth = impulses.skin_over_grooves(time)
    edges = 0.3 + np.array([0, 1.5, 3.0, 4.5]) / 60
    expected = np.interp(time, np.repeat(edges, 2) + np.tile([0, 0.2 / 60], 4), [0, 1, 1, 0, 0, 1, 1, 0])
    np.testing.assert_allclose(depth, expected, atol=1e-9)
    printed = fitted.published_sd(softness.SD_FORCES_GF[:, None], np.array([0.089, 0.51, 0.72]))
    assert softness.scaled_to_9(printed / 7) == approx((7, 0), abs=1e-9)
    bent = np.vstack([printed[:2] * 5, printed[2:] / 7])
    assert softness.scaled_to_9(bent, 2) == approx((7, 0), abs=1e-9)
    scale, rms = softness.scaled_to_9(bent)
    assert scale == approx(np.vdot(bent, printed) / np.vdot(bent, bent))
    assert rms == approx(100 * np.linalg.norm(scale * bent - printed) / np.linalg.norm(printed))
    vector = np.arange(4.0)
    assert fitted.replaced(vector, 2, 9.0).tolist() == [0, 1, 9, 3] and vector[2] == 2


def test_relatives_are_interpolated_between_the_presses_of_nine_fingers():
    """A reading that is quadratic in both logarithms and linear in the lever is met everywhere."""
    skins, stiffer = (np.log(part) for part in (fitted.SKIN_FACTORS, fitted.STIFF_FACTORS))
    forces = np.arange(1.0, 4.0)

    def reading(skin, stiff, lever):
        size = 2 + skin + 3 * stiff - skin * stiff + skin**2 + (1 + stiff) * lever
        return size * forces[:, None, None] * np.array([1.0, 2.0, 3.0])[:, None] * np.array([-1.0, 1.0, 1.0, -1.0])

    felt = np.array([[[reading(a, b, lever) for lever in (-1.0, 0.0)] for b in stiffer] for a in skins])
    depths = np.array([[np.full(5, 1 + a**2 + b) for b in stiffer] for a in skins])
    family = fitted.Relatives(Finger.published(), felt, depths)
    for skin, stiff, lever, early in ((0.1, -0.05, -0.7, 0.1), (skins[0], stiffer[2], 0.0, 0.2), (-0.2, 0.2, 0.5, 0.0)):
        sd, depth = family.press(np.array([skin, stiff, lever, early]))
        assert sd == approx(reading(skin, stiff, lever).std(axis=-1)) and depth == approx(1 + skin**2 + stiff + early)
    assert family.start.tolist() == [0, 0, Finger.published().gauges[0].lever_mm, Finger.published().bench.touch_down]


def test_plates_and_fingers_of_sliding_scenes():
    plate = gratings.two_grooves(2.5)
    place, height = np.asarray(plate.x_mm), np.asarray(plate.height_mm)
    inside = ((place > 0) & (place < 1.5)) | ((place > 4.0) & (place < 5.5))
    clear = np.abs(place[:, None] - [0, 1.5, 4.0, 5.5]).min(axis=1) > 0.02
    assert np.array_equal(height[clear] < -0.4, inside[clear]) and set(height) == {0.0, -0.5}
    assert (place[0], place[-1]) == (-60, 60) and all(np.diff(place) > 0) and np.diff(place).max() < 0.11
    for edge in (0, 1.5, 4.0, 5.5):
        assert np.sum(np.abs(place - edge) < 0.0101) >= 2, "a steep flank"
    ribbed = gratings.grating(1.8)
    assert (ribbed.groove, ribbed.ridge) == (0.9, 0.9)
    usual, other = gratings.ASSUMED_SLIDE, gratings.SlideParameters(0.8, 1.0, 0.3)
    assert (usual.gauge, usual.gauges, other.gauge, other.gauges) == (2, [0, 1, 2, 3, 4], 5, [5])
    fingers = [gratings.finger_of(usual), gratings.finger_of(other), gratings.finger_of(usual, smooth=True)]
    assert [(f.ridges.pitch, f.ridges.width) if f.ridges else None for f in fingers] == [(1.2, 0.6), (0.8, 0.4), None]
    assert [gauge.length_mm for gauge in fingers[0].gauges[5:]] == [1.0, 0.2] and len(fingers[0].gauges) == 7
    rows = np.arange(900) / 10
    waves = np.column_stack([np.sin(2 * np.pi * rows / 3.0), np.sin(2 * np.pi * rows / 2.4)])
    seen = gratings.SceneReadings(rows, waves, 1.0, "modal", "ok")
    assert seen.speed_mm_s == approx(100) and len(gratings.density(seen, 0)) == 600
    assert [np.mean(gratings.density(seen, gauge)) for gauge in (0, 1)] == approx([3.0, 2.4], rel=0.05)
