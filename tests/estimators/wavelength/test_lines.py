"""Spectral lines of a log in the position domain, their background, their sigma, and lags between channels."""

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.estimators.stream import completed
from papilla.estimators.wavelength.lines import find_lines, latest_stretch, travelled, with_harmonics
from papilla.estimators.wavelength.spectrum import Line, Spectrum, background


def red(count: int, channels: int, correlation: float, seed: int) -> np.ndarray:
    """(n, channels) first-order autoregressive noise."""
    noise = np.random.default_rng(seed).normal(size=(count, channels))
    for row in range(1, count):
        noise[row] += correlation * noise[row - 1]
    return noise


def test_a_weak_line_under_drift_and_a_strong_long_line():
    """The hard case of ridged boards: drift and a long component much stronger than the line that is asked for."""
    position = np.arange(1080) * 0.14
    generator = np.random.default_rng(2)
    line = np.outer(np.cos(2 * np.pi * position / 3.99), generator.uniform(0.5, 1.5, 6))
    strong = np.outer(np.cos(2 * np.pi * position / 20.3 + 1.0), generator.uniform(10, 20, 6))
    drift = np.outer(40 * (position / 150) ** 2 - 30 * np.exp(-position / 40), np.ones(6))
    readings = np.round(line + strong + drift + 100 + generator.normal(0, 1, (1080, 6)))
    near = find_lines(position, readings, wavelength_range_mm=(1, 8))
    assert near.lines[0].wavelength_mm == pytest.approx(3.99, rel=2e-3)
    assert near.lines[0].amplitude == pytest.approx(np.sqrt(np.mean(np.max(np.abs(line), axis=0) ** 2)), rel=0.1)
    everything = find_lines(position, readings)
    first, second = everything.lines[:2]
    assert first.wavelength_mm == pytest.approx(20.3, rel=0.01) and second.wavelength_mm == pytest.approx(
        3.99, rel=2e-3
    )
    sizes = [line.amplitude for line in everything.lines]
    assert sizes == sorted(sizes, reverse=True)
    far = find_lines(position, readings, wavelength_range_mm=(10, 40))
    assert far.lines[0].wavelength_mm == pytest.approx(20.3, rel=0.01)


@pytest.mark.parametrize("correlation, channels", [(0.0, 1), (0.9, 2), (1.0, 2)])
def test_background_alone_gives_no_lines(correlation, channels):
    """1 % of logs may show a line; of 60 more than 4 would have a chance of 3e-4."""
    found = [bool(find_lines(np.arange(800) * 0.1, red(800, channels, correlation, seed)).lines) for seed in range(60)]
    assert sum(found) <= 4


@pytest.mark.parametrize("step_mm", [0.05, 0.1, 0.137])
def test_even_steps_make_no_images_of_a_line(step_mm):
    """Even steps repeat a line at every multiple of their wavenumber, and a grid folds these images back."""
    position = np.arange(0, 100, step_mm)
    for seed, sigma in enumerate((0, 1e-4, 1e-3, 1e-3, 0.01)):
        noise = sigma * np.random.default_rng(seed).standard_normal(len(position))
        found = find_lines(position, np.sin(2 * np.pi * position / 3) + noise)
        assert [line.wavelength_mm for line in found.lines] == pytest.approx([3], rel=1e-4)


def test_sigma_is_true():
    """RMS of error over stated sigma, 80 seeds, one channel in red noise."""
    position, ratios = np.arange(1500) * 0.1, []
    for seed in range(80):
        phase = np.random.default_rng(seed).uniform(0, 6)
        readings = red(1500, 1, 0.7, 500 + seed)[:, 0] + 1.2 * np.cos(2 * np.pi * position / 4.0 + phase)
        line = find_lines(position, readings, wavelength_range_mm=(2, 8)).lines[0]
        ratios.append((line.wavelength_mm - 4.0) / line.sigma_mm)
    assert 0.75 < np.sqrt(np.mean(np.square(ratios))) < 1.3


def test_what_can_be_searched_is_stated_and_the_rest_refused():
    position, readings = np.arange(400) * 0.5, red(400, 1, 0.0, 3)
    found = find_lines(position, readings, wavelength_range_mm=(0.2, 500))
    assert found.searched_mm == pytest.approx((1.1, 199.5 / 3))
    with pytest.raises(InputError, match="no wavelength of the 0.1 to 0.9 mm asked for can be searched"):
        find_lines(position, readings, wavelength_range_mm=(0.1, 0.9))
    with pytest.raises(InputError, match="wavelength_range_mm must rise, got 8 and 1"):
        find_lines(position, readings, wavelength_range_mm=(8, 1))
    with pytest.raises(InputError, match="the position never changes"):
        find_lines(np.zeros(400), readings)
    with pytest.raises(InputError, match="no channel has changing"):
        find_lines(position, np.ones(400))
    with pytest.raises(InputError, match="needs 16 rows .* got 3"):
        find_lines(position[:3], readings[:3])
    with pytest.raises(InputError, match="do not fit"):
        find_lines(position, readings[:-1])
    with pytest.raises(InputError, match="must not fall; it does after row 1"):
        travelled([0, 1, 0.5], 3.0)
    with pytest.raises(InputError, match="finite"):
        travelled([0, 1], [np.nan, 1])
    with pytest.raises(InputError, match=r"one number or one a time, got \(3,\) for \(2,\)"):
        travelled([0, 1], [1, 2, 3])


@pytest.mark.parametrize("size", [1e-160, 1e-60, 1e300])
def test_numbers_that_no_sensor_gives_are_left_out_or_refused(size):
    position, rng = np.arange(800) * 0.1, np.random.default_rng(0)
    readings = np.sin(2 * np.pi * position / 1.7)[:, None] + rng.normal(0, 0.2, (800, 2))
    if size == 1e-60:
        assert find_lines(position, size * readings).lines[0].wavelength_mm == pytest.approx(1.7, rel=1e-3)
        return
    with pytest.raises(InputError, match="finite readings"):
        find_lines(position, size * readings)
    readings[50:60, 0], position[70] = 1e300, 1e300
    assert find_lines(position, readings).unused_samples == 11
    assert latest_stretch(position) == 0


def test_harmonics_sharpen_the_fundamental_by_their_order():
    """Inverse variances: the n-th harmonic knows the wavenumber n times better; louder lines are no harmonics."""
    base = Line(0.25, 50.0, 1.0, 1e-9, 1e-3)

    def third(wavenumber, amplitude=0.4):
        return Line(wavenumber, 20.0, amplitude, 1e-6, 1.2e-3)

    found = with_harmonics(base, [third(0.7506), base], 0.01)
    weights = np.array([1e-3, 0.4e-3]) ** -2.0
    assert found.wavenumber == pytest.approx(weights @ [0.25, 0.2502] / weights.sum(), rel=1e-12)
    assert found.sigma == pytest.approx(weights.sum() ** -0.5, rel=1e-9) and found[1:4] == base[1:4]
    assert with_harmonics(base, [third(0.7506, 1.5)], 0.01) == with_harmonics(base, [third(0.77)], 0.01) == base
    apart = with_harmonics(base, [third(0.759)], 0.01)
    spread = weights @ (np.array([0.25, 0.253]) - apart.wavenumber) ** 2
    assert spread > 1 and apart.sigma == pytest.approx((spread / weights.sum()) ** 0.5), "Birge's ratio"


def test_of_a_path_too_long_for_a_spectrum_the_latest_stretch_is_searched():
    """Half a million points of a grid of 8 in a quarter of the shortest wavelength; to and fro is no long path."""
    position = np.linspace(0, 20_000, 200_001)
    first = latest_stretch(position, (1.0, 10.0))
    assert 20_000 - position[first] == pytest.approx(500_000 / 8 / 4, rel=0.01)
    assert latest_stretch(position[:1000]) == latest_stretch(np.tile(position[:5001], 10), (1.0, 10.0)) == 0
    with pytest.raises(InputError, match="rows with a position"):
        latest_stretch([1.0, np.nan])


def log(count=900, step=0.1, wavelength=3.0, noise=0.3, channels=1, seed=0, size=1.0):
    position = np.arange(count) * step
    wave = size * np.cos(2 * np.pi * position / wavelength + 0.5)[:, None] * np.ones(channels)
    return position, wave + noise * np.random.default_rng(seed).standard_normal((count, channels))


def test_a_line_is_stated_with_the_chance_that_noise_makes_it_somewhere():
    position, readings = log(800, size=0.0)
    few, many = (find_lines(position, readings, false_alarm=chance).lines for chance in (0.01, 0.5))
    assert len(few) <= len(many)
    for rare, lines in ((0.01, few), (0.5, many)):
        assert all(0 < line.chance < rare for line in lines)
    weak, strong = (find_lines(*log(800, size=size)).lines[0] for size in (0.25, 0.35))
    assert 0 < strong.chance < weak.chance < 0.01 and strong.ratio > weak.ratio > 10
    for chance in (0.51, 0.0):
        with pytest.raises(InputError, match="false_alarm must lie between"):
            find_lines(position, readings, false_alarm=chance)


def test_channels_and_rows_that_hold_numbers_are_used():
    """A channel with a number in more than half of the rows; 16 rows."""
    position, readings = log(400, channels=2)
    readings[:200, 1] = np.nan
    assert find_lines(position, readings).unused_channels == 1 and find_lines(position, readings).unused_samples == 0
    readings[199, 1] = 0.0
    found = find_lines(position, readings)
    assert (found.unused_channels, found.unused_samples) == (0, 199)
    assert find_lines(position, readings[:, 0]).unused_channels == 0
    assert find_lines(position[:16], readings[:16, 0]).unused_samples == 0
    with pytest.raises(InputError, match="got 15"):
        find_lines(position[:15], readings[:15, 0])
    with pytest.raises(InputError, match="got 0"):
        find_lines([], np.zeros((0, 2)))


@pytest.mark.parametrize("channels", [2, 5, 20])
def test_a_mean_of_channels_has_as_many_degrees_of_freedom_and_its_mean_for_a_level(channels):
    power = np.random.default_rng(1).chisquare(2 * channels, 6000) / (2 * channels)
    at = np.arange(200, 5800, 7)
    found = background(power, at, 1.0)
    assert np.median(found.freedom) == pytest.approx(2 * channels, rel=0.2)
    assert np.mean(found.power) == pytest.approx(1.0, abs=0.03)
    assert (background(power, at, 1.0, pooled=False).freedom == 2.0).all()
    few = background(power[:39], [19], 1.0)
    assert few.freedom == [2.0], "too few to tell"


def spectrum(power, resolution=4.0, step=0.01):
    power = np.asarray(power, float)
    return Spectrum(power, power[None], np.ones(1), step, resolution)


def test_the_top_of_a_line_is_that_of_the_parabola_through_its_logarithms():
    n = np.arange(400.0)
    for at in (120.0, 120.3, 119.6):
        own = spectrum(0.5 + 0.4 * np.cos(n * 7) + 500 * np.exp(-(((n - at) / 3) ** 2)))
        gaussian = spectrum(500 * np.exp(-(((n - at) / 3) ** 2)) + 1e-290)
        assert gaussian.vertices(np.array([round(at)])) == pytest.approx([0.01 * at])
        (found,) = [line for line in completed(own.lines(0.5, 3.0, 5)) if line.ratio > 100]
        assert found.wavenumber == pytest.approx(0.01 * at, abs=2e-4)
        assert found.amplitude == pytest.approx(own.power[round(at)] ** 0.5)
        level = background(own.power, np.array([round(at)]), own.resolution, pooled=False).power[0]
        assert found.ratio == pytest.approx(own.power[round(at)] / level)
    assert not any(line.ratio > 100 for line in completed(own.lines(1.2, 3.0, 5)))
    assert not any(line.ratio > 100 for line in completed(own.lines(0.3, 1.19, 5)))


def test_loud_lines_that_share_a_period_which_none_of_them_has_are_told_as_its_harmonics():
    """2.355 and 1.570 mm: 4.71 mm, where that is in the range; with 1.62 mm beside it a line is its own."""
    position = np.arange(0, 60, 0.05)
    noise = 0.1 * np.random.default_rng(3).normal(size=position.size)
    for second, high, told in ((1.570, 6.0, [(2, 4.71), (3, 4.71)]), (1.570, 4.0, None), (1.62, 6.0, None)):
        readings = sum(np.cos(2 * np.pi * position / own) / own for own in (2.355, second)) + noise
        lines = find_lines(position, readings, wavelength_range_mm=(0.4, high)).lines
        found = sorted((own.harmonic, own.fundamental_mm) for own in lines)
        own = sorted((1, own) for own in (2.355, second))
        assert found == [(order, pytest.approx(mm, rel=2e-3)) for order, mm in told or own]
