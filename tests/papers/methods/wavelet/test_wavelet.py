"""Morlet transform, cross-wavelet, significance and phase, against second implementations and known signals."""

import numpy as np
import pytest
from scipy.signal import lfilter

from papilla.core.errors import InputError
from papilla_papers.methods.wavelet import (
    RedNoise,
    cross_quantile,
    cross_threshold,
    cross_wavelet,
    lag_of_phase,
    morlet,
    octaves,
    periods_of_phase,
)
from papilla_papers.methods.wavelet.cross import common_threshold

RATE = 300.0
SAMPLES = np.random.default_rng(0).normal(size=100)


def by_convolution(samples, rate, frequency):
    """Second implementation: the Morlet wavelet of unit energy written in time, slid over the record, sum by sum."""
    scale = (6 + np.sqrt(38)) / (4 * np.pi * frequency)
    centred = samples - samples.mean()
    time = np.arange(len(samples)) / rate
    eta = (time[None, :] - time[:, None]) / scale
    wavelet = np.pi**-0.25 * np.exp(6j * eta - 0.5 * eta**2) / np.sqrt(scale * rate)
    return np.conj(wavelet) @ centred


def test_transform_equals_a_direct_convolution():
    samples = np.random.default_rng(0).normal(size=400) + np.sin(2 * np.pi * 21 * np.arange(400) / RATE)
    frequency = np.array([6.0, 14.0, 21.0, 40.0, 75.0])
    found = morlet(samples, RATE, frequency)
    for row, f in enumerate(frequency):
        np.testing.assert_allclose(found.coefficients[row], by_convolution(samples, RATE, f), atol=2e-8)
    np.testing.assert_allclose(found.edge_s, np.sqrt(2) * (6 + np.sqrt(38)) / (4 * np.pi * frequency))
    assert found.inside[2, 200] and not found.inside[2, 0]


@pytest.mark.parametrize("alpha", [0.0, 0.7])
def test_significance_levels_hold_for_noise(alpha):
    generator, frequency = np.random.default_rng(2), octaves(10, 80, 6)
    single, cross = [], []
    for _ in range(25):
        a, b = lfilter([1.0], [1.0, -alpha], generator.normal(size=(2, 1200)))
        wave = morlet(a, RATE, frequency)
        single.append((wave.power > RedNoise.of(a).power(frequency, RATE)[:, None] * -np.log(0.05))[wave.inside].mean())
        pair = cross_wavelet(a, b, RATE, frequency)
        cross.append(pair.significant[pair.inside].mean())
    assert np.mean(single) == pytest.approx(0.05, abs=0.015)
    assert np.mean(cross) == pytest.approx(0.05, abs=0.02)


@pytest.mark.parametrize("size", [0.0, 0.5, 3.0, 30.0])
@pytest.mark.parametrize("kind", ["hum", "jolts"])
def test_what_both_channels_have_at_once_does_not_travel(kind, size):
    """Whatever its size and the gains, as often as is stated at most; a texture 1.2 rad later in the second does."""
    generator, time = np.random.default_rng(2), np.arange(1500) / RATE
    common = np.sqrt(2) * np.sin(2 * np.pi * 60 * time) if kind == "hum" else 3.5 * ((4 * time) % 1 - 0.5)
    frequency, ridges = octaves(12, 120, 12), []
    for gain in (0.5, 1.0, -1.3):
        noise = generator.normal(size=(2, time.size))
        pair = cross_wavelet(size * common + noise[0], gain * size * common + noise[1], RATE, frequency)
        assert pair.travels[pair.inside].mean() < 0.02
        ridges.append(pair.ridge.travels[pair.ridge.inside].mean())
    assert np.mean(ridges) < 0.1
    texture = [2 * np.sin(2 * np.pi * 31 * time - late) for late in (0.0, 1.2)]
    pair = cross_wavelet(*(own + row + 0.5 * common for own, row in zip(texture, noise, strict=True)), RATE, frequency)
    assert pair.ridge.travels[pair.ridge.inside].mean() > 0.9
    assert not cross_wavelet(texture[0], 0.7 * texture[0], RATE, frequency).travels.any()


def test_the_published_quantile_of_the_cross_wavelet():
    """Z of two chi-squares with two degrees of freedom at 5 % is 3.999."""
    assert cross_quantile() == pytest.approx(3.999, abs=0.001) and 0 < cross_quantile(0.5) < cross_quantile(1e-12) < 100
    level = cross_threshold(SAMPLES, SAMPLES, RATE, 50.0) / RedNoise.of(SAMPLES).power(50.0, RATE)
    assert 2 * level == pytest.approx(cross_quantile())


def touch(period_mm, distance_mm=0.6):
    """Two channels a distance apart on a grating under the speed ramp of an active touch, 22 to 31 mm/s."""
    time, generator = np.arange(600) / RATE, np.random.default_rng(0)
    speed = np.interp(time, [0, 2], [22.0, 31.0])
    turns = [2 * np.pi * (np.cumsum(speed) / RATE - place) / period_mm for place in (0.0, distance_mm)]
    envelope = np.exp(-0.5 * ((time - 1.1) / 0.25) ** 2)
    return *(envelope * np.cos(turn) + 0.05 * generator.normal(size=600) for turn in turns), speed


def test_ridge_follows_the_speed_and_the_window_is_the_printed_one():
    first, second, speed = touch(0.48)
    ridge = cross_wavelet(first, second, RATE, octaves(20, 120, 100)).ridge
    part = slice(250, 400)
    np.testing.assert_allclose(ridge.frequency_Hz[part], speed[part] / 0.48, rtol=0.03)
    assert ridge.significant[part].all() and ridge.inside[part].all()
    assert abs(ridge.strongest - 330) < 40
    window = ridge.around_strongest()
    assert (window.first, window.last) == (ridge.strongest - 6, ridge.strongest + 13)
    inside = ridge.frequency_Hz[window.first : window.last + 1]
    assert len(inside) == 20
    assert window.mean_Hz == pytest.approx(inside.mean()) and window.sd_Hz == pytest.approx(inside.std(ddof=1))
    assert (window.least_Hz, window.greatest_Hz) == (inside.min(), inside.max())
    assert (ridge.window(0, 1).first, ridge.window(598, 599).last) == (0, 599)
    for first, last in ((590, 600), (-1, 4), (7, 7)):
        with pytest.raises(InputError, match=f"window from sample {first} to {last} is not inside the record of 600"):
            ridge.window(first, last)


@pytest.mark.parametrize("period_mm", [0.40, 0.44, 0.48, 1.6])
def test_the_phase_inverts_to_the_period_whatever_the_speed(period_mm):
    first, second, _ = touch(period_mm)
    ridge = cross_wavelet(first, second, RATE, octaves(8, 120, 50)).ridge
    phase = float(np.angle(np.sum((ridge.magnitude * np.exp(1j * ridge.phase))[250:401])))
    periods = (lag_of_phase(phase, period_mm) - 0.6) / period_mm
    assert periods == pytest.approx(round(periods), abs=0.02)
    assert np.abs(periods_of_phase(phase, 0.6, (0.3, 2.0)) / period_mm - 1).min() < 0.02
    assert len(periods_of_phase(phase, 0.6, (1.2, 5.0))) <= 1, "over twice the distance there is one answer"


def test_all_periods_of_a_phase_are_listed():
    found = periods_of_phase(np.pi / 2, 1.0, (0.2, 10.0))
    np.testing.assert_allclose(found, [4.0, 1 / 1.25, 1 / 2.25, 1 / 3.25, 1 / 4.25])
    np.testing.assert_allclose(periods_of_phase(-np.pi / 2, 1.0, (0.2, 10.0))[0], 1 / 0.75)
    assert periods_of_phase(0.0, 1.0, (2.0, 10.0)).size == 0


@pytest.mark.parametrize(
    "refused, message",
    [
        (lambda: morlet(SAMPLES, RATE, [20.0, 150.0]), "frequency_Hz must lie between 3 .* and below 150"),
        (lambda: morlet([1.0, np.nan] * 10, RATE, 20.0), "8 or more finite samples"),
        (lambda: cross_wavelet(SAMPLES, SAMPLES[:-1], RATE, 20.0), "equally long"),
        (lambda: cross_wavelet(SAMPLES, np.ones(100), RATE, 20.0), "never change"),
        (lambda: octaves(5, 5), "low_Hz must be below high_Hz, got 5 and 5"),
        (lambda: octaves(5, 9, 0), "per_octave must be at least 1, got 0"),
        (lambda: periods_of_phase(1.0, 1.0, (2.0, 1.0)), "period_range_mm must rise"),
        (lambda: cross_quantile(0.9e-12), "level must lie between 1e-12 and 0.5"),
    ],
)
def test_unusable_input_is_refused(refused, message):
    with pytest.raises(InputError, match=message):
        refused()


@pytest.mark.parametrize("gain", [1.0, -1.0, 0.3])
def test_the_level_of_what_is_common_is_that_of_the_channels_difference(gain):
    """Red noise of A - B over their own deviations, times 3.841 / 2; B turned where its gain is negative."""
    rng, frequency = np.random.default_rng(4), np.array([12.0, 40.0, 90.0])
    common = np.cumsum(rng.standard_normal(600)) * 0.1
    one = common + 0.2 * rng.standard_normal(600) + 5.0
    two = gain * (common + 0.2 * rng.standard_normal(600)) - 3.0
    level = common_threshold(one, two, 300.0, frequency)
    apart = (one - one.mean()) / one.std() - np.sign(gain) * (two - two.mean()) / two.std()
    expected = one.std() * two.std() * RedNoise.of(apart).power(frequency, 300.0) * 3.8415 / 2
    np.testing.assert_allclose(level, expected, rtol=1e-4)
    np.testing.assert_allclose(common_threshold(7 * one, -2 * two, 300.0, frequency), 14 * level, rtol=1e-9)
    # Of channels that are the same but for a gain rounding is left, and any change is over it.
    same = common_threshold(one, 3 * one, 300.0, frequency)
    np.testing.assert_allclose(same, 3 * one.var() * 600 * (1e-24 / 600) * 3.8415 / 2, rtol=1e-3)


def test_a_sinusoid_has_its_ridge_at_its_frequency_and_its_phase():
    time = np.arange(900) / RATE
    frequency = octaves(8, 60, 100)
    found = morlet(2 * np.cos(2 * np.pi * 20.8 * time + 0.4), RATE, frequency)
    middle = found.coefficients[:, 450]
    best = np.abs(middle).argmax()
    assert frequency[best] == pytest.approx(20.8, rel=0.004)
    assert np.angle(middle[best] * np.exp(-2j * np.pi * 20.8 * time[450])) == pytest.approx(0.4, abs=0.01)
    assert found.inside[best, 450] and not found.inside[best, 0]
    np.testing.assert_allclose(found.edge_s, np.sqrt(2) * (6 + np.sqrt(38)) / (4 * np.pi * frequency))


def test_passive_touch_table_of_the_paper():
    """f = v / period from 13.9 to 25.0 Hz: 0.40, 0.44, 0.48 mm at 6.7 and 10 mm/s, spread within 1.6 % of the mean."""
    time = np.arange(900) / RATE
    for period_mm in (0.40, 0.44, 0.48):
        for speed in (20 / 3, 10.0):
            generator = np.random.default_rng(3)
            wave = np.cos(2 * np.pi * speed * time / period_mm)
            pair = [wave + generator.normal(0, 0.2, 900) for _ in range(2)]
            window = cross_wavelet(*pair, RATE, octaves(5, 60, 100)).ridge.window(350, 549)
            assert window.mean_Hz == pytest.approx(speed / period_mm, rel=0.01)
            assert window.sd_Hz / window.mean_Hz < 0.016


def test_limits_of_records_octaves_periods_and_cones_are_where_they_are_said_to_be():
    few = SAMPLES[:8]
    assert morlet(few, 8.0, [1.0, 3.99]).coefficients.shape == (2, 8) and octaves(10, 80, 6)[[0, 6, -1]].tolist() == [
        10,
        20,
        80,
    ]
    assert len(octaves(10, 80, 6)) == 19 and len(octaves(10, 79, 1)) == 3 and len(octaves(5, 10)) == 101
    for refused in ((few[:7], 8.0, 2.0), (few, 8.0, 4.0), (few, 8.0, 0.99), (np.stack([few, few]), 8.0, 2.0)):
        with pytest.raises(InputError):
            morlet(*refused)
    np.testing.assert_allclose(periods_of_phase(np.pi, 1.0, (0.4, 2.0)), [2, 2 / 3, 0.4])
    assert periods_of_phase(np.pi, 1.0, (0.4001, 1.999)) == pytest.approx(2 / 3)
    assert lag_of_phase(np.pi / 2, 3.0) == pytest.approx(0.75)
    wave, count = morlet(SAMPLES, 50.0, [3.0, 9.0]), np.arange(100)
    from_end = np.minimum(count, 99 - count) / 50.0
    assert np.array_equal(
        wave.inside, from_end >= (np.sqrt(2) * (6 + np.sqrt(38)) / (4 * np.pi * np.array([[3.0], [9.0]])))
    )


def test_levels_and_ridges_are_those_of_their_definitions():
    one, two = np.random.default_rng(8).normal(size=(2, 400)).cumsum(axis=1) + [[3.0], [-90.0]]
    red, frequency = RedNoise.of(one), octaves(10, 100, 10)
    centred = one - one.mean()
    alpha = np.sum(centred[1:] * centred[:-1]) / np.sum(centred**2)
    assert (red.variance, red.alpha) == pytest.approx((one.var(), alpha))
    mean_power = np.mean(red.power(np.linspace(0, 300, 3001)[:-1], 300.0))
    assert mean_power == pytest.approx(one.var()), "over all frequencies the power is the variance"
    both = [RedNoise.of(channel).power(frequency, 300.0) for channel in (one, two)]
    pair = cross_wavelet(one, two, 300.0, frequency)
    np.testing.assert_allclose(pair.level, np.sqrt(both[0] * both[1]) * cross_quantile() / 2)
    np.testing.assert_allclose(cross_threshold(one, two, 300.0, 20.0, 0.01) / cross_threshold(one, two, 300.0, 20.0),
                               cross_quantile(0.01) / cross_quantile(0.05))  # fmt: skip
    assert common_threshold(one, two, 300.0, 20.0, 0.3173) * 3.8415 == pytest.approx(
        common_threshold(one, two, 300.0, 20.0), rel=1e-3
    )
    magnitude, at = np.abs(pair.product), np.arange(400)
    best = magnitude.argmax(axis=0)
    for name, whole in (("significant", pair.significant), ("travels", pair.travels), ("inside", pair.inside)):
        assert np.array_equal(getattr(pair.ridge, name), whole[best, at]), name
    assert np.array_equal(pair.significant, magnitude > pair.level[:, None])
    assert np.array_equal(
        pair.travels, pair.significant & (pair.product.imag**2 > pair.common_level[:, None] * magnitude)
    )
    np.testing.assert_array_equal(pair.ridge.magnitude, magnitude.max(axis=0))
    assert pair.ridge.strongest == magnitude.max(axis=0).argmax()
    np.testing.assert_allclose(np.exp(1j * pair.ridge.phase), pair.product[best, at] / magnitude[best, at])
