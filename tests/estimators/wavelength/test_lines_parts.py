"""Lines, their backgrounds and the lags between channels against closed forms, and on each side of their limits."""

import math

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.estimators.stream import completed
from papilla.estimators.wavelength.lines import find_lines, order_of
from papilla.estimators.wavelength.spectrum import Level, Line, Spectrum, background, vertex


def log(count=900, step=0.1, wavelength=3.0, noise=0.3, channels=1, seed=0, size=1.0):
    position = np.arange(count) * step
    wave = size * np.cos(2 * np.pi * position / wavelength + 0.5)[:, None] * np.ones(channels)
    return position, wave + noise * np.random.default_rng(seed).standard_normal((count, channels))


@pytest.mark.parametrize("count", [300, 1200])
def test_the_sigma_of_a_line_is_that_of_a_tapered_periodogram(count):
    """Var k = W0^2 int w^2 x^2 / (2 r int w^2 (int w x^2)^2) / (2 pi)^2, w the Hann taper, r power over background."""
    position, readings = log(count)
    found = find_lines(position, readings).lines[0]
    x = np.linspace(-0.5, 0.5, 20001) * (position[-1] - position[0])
    w = np.cos(np.pi * x / (position[-1] - position[0])) ** 2
    variance = w.sum() ** 2 * (w**2 @ x**2) / (2 * (w**2).sum() * (w @ x**2) ** 2)
    sigma = math.sqrt(variance / found.ratio) / (2 * math.pi)
    assert found.sigma_mm == pytest.approx(sigma * found.wavelength_mm**2, rel=0.02)
    assert found.fundamental_mm == found.wavelength_mm and found.channels == (0,)


def test_channels_with_noise_of_their_own_know_a_line_better_by_the_root_of_their_number():
    def sigma(channels, seed):
        return find_lines(*log(1000, channels=channels, seed=seed)).lines[0].sigma_mm

    ratios = [sigma(8, seed) / sigma(1, seed) for seed in range(8)]
    assert np.exp(np.mean(np.log(ratios))) == pytest.approx(1 / math.sqrt(8), rel=0.4)
    position, readings = log(1000)
    alike = find_lines(position, np.repeat(readings, 8, axis=1)).lines[0]
    assert alike.sigma_mm == pytest.approx(sigma(1, 0), rel=0.05) and alike.channels == tuple(range(8))


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


def test_what_uneven_steps_show_is_by_the_path():
    """2.2 of the mean step, each weighed by its length; up to a third of the path, and inside what is asked for."""
    steps = np.where(np.arange(600) % 3, 0.1, 0.4)
    position = np.cumsum(steps)
    readings = np.random.default_rng(0).standard_normal(600)
    shortest, longest = 2.2 * (2 * 0.01 + 0.16) / 0.6, np.ptp(position) / 3
    assert find_lines(position, readings).searched_mm == pytest.approx((shortest, longest), rel=0.01)
    for asked in ((0.5, 9.0), (1.0, 999.0), (2.0, 9.0)):
        limits = max(asked[0], shortest), min(asked[1], longest)
        assert find_lines(position, readings, wavelength_range_mm=asked).searched_mm == pytest.approx(limits, rel=0.01)
    with pytest.raises(
        InputError, match=r"of the 0.2 to 0.3 mm asked for can be searched: 119.6 mm of path in steps of 0.3 mm show"
    ):
        find_lines(position, readings, wavelength_range_mm=(0.2, 0.3))


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


def test_the_chance_beside_a_level_is_that_of_exponential_power_over_a_level_of_so_many_cells():
    level = Level(np.array([1.0, 2.0, 1.0, np.inf]), np.array([4.0, 4.0, 1e7, 0.0]), np.full(4, 2.0))
    expected = [1.75**-4, 1.375**-4, math.exp(-3), 1.0]
    assert level.chance(np.full(4, 3.0)) == pytest.approx(expected, rel=1e-5)


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


def test_a_peak_within_twice_the_resolution_of_a_greater_one_is_its_shoulder():
    for apart, tops in ((8, [100]), (9, [100, 109])):
        power = np.ones(300)
        power[100], power[100 + apart] = 50.0, 20.0
        found = spectrum(power).tops(1, 299)
        assert [top for top in found.tolist() if power[top] > 2] == tops
    power = np.ones(300)
    power[[50, 120, 200]] = 9.0, 7.0, 8.0
    found = [line.wavenumber for line in completed(spectrum(power).lines(0.3, 2.5, 2)) if line.amplitude > 1.5]
    assert found == pytest.approx([0.5, 2.0], abs=0.01)


def test_the_chance_at_a_wavenumber_is_that_of_the_greatest_power_within_half_a_resolution():
    power = np.random.default_rng(4).exponential(size=600)
    own = spectrum(power, resolution=6.0)
    for wavenumber in (1.0, 2.37):
        middle = round(100 * wavenumber)
        around = np.arange(middle - 3, middle + 4)
        top = around[power[around].argmax()]
        level = background(power, [top], 6.0, pooled=False)
        assert own.chance(wavenumber) == pytest.approx(float(level.chance(power[[top]])[0]))
    assert own.chance(99.0) == 1.0


def test_a_harmonic_is_named_by_its_own_fundamental_not_by_a_louder_line():
    position = np.arange(2400) * 0.05
    waves = (
        2 * np.cos(2 * np.pi * position / 7.3)
        + np.cos(2 * np.pi * position / 4)
        + 0.4 * np.cos(6 * np.pi * position / 4)
    )
    lines = find_lines(position, waves + np.random.default_rng(0).normal(0, 0.2, 2400)).lines
    told = [(round(line.wavelength_mm, 2), line.harmonic, round(line.fundamental_mm, 2)) for line in lines[:3]]
    assert told == [(7.3, 1, 7.3), (4.0, 1, 4.0), (1.33, 3, 4.0)]


def test_a_line_that_one_of_many_channels_shows_is_found():
    """Lost in the mean of twenty; by itself it is as rare as one in twenty needs to be."""
    position, readings = log(600, size=0.0, noise=1.0, channels=20)
    readings[:, 7] += 0.5 * np.cos(2 * np.pi * position / 3.0)
    (found,) = find_lines(position, readings).lines
    assert found.wavelength_mm == pytest.approx(3.0, rel=0.01) and found.channels == (7,)
    assert find_lines(position, np.delete(readings, 7, axis=1)).lines == ()


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


@pytest.mark.parametrize("at", [-0.45, 0.0, 0.3])
def test_the_top_of_a_gaussian_is_found_exactly(at):
    powers = 7.0 * np.exp(-((np.array([-1, 0, 1]) - at) ** 2) / 1.3)
    assert vertex(powers) == pytest.approx(at, abs=1e-12)
    assert vertex(1e-3 * powers) == pytest.approx(at, abs=1e-12)


def test_without_a_top_it_is_the_middle():
    assert vertex([0.0, 1.0, 0.5]) == 0.0, "a power of nothing has no logarithm"
    assert vertex([1.0, 1.0, 1.0]) == 0.0 and vertex([2.0, 1.0, 3.0]) == 0.0


def test_a_harmonic_is_a_multiple_within_the_slack():
    """Three sigmas of the difference and a quarter of the resolution, but never a quarter of the fundamental."""
    fundamental = Line(1.0, 50.0, 1.0, 1e-9, 0.001)

    def order(wavenumber, sigma=0.001, resolution=0.04):
        return order_of(Line(wavenumber, 20.0, 0.5, 1e-6, sigma), fundamental, resolution)

    slack = 3 * np.hypot(0.001, 3 * 0.001) + 0.25 * 0.04
    assert order(3 + 0.99 * slack) == order(3 - 0.99 * slack) == 3
    assert order(3 + 1.01 * slack) == order(3 - 1.01 * slack) == 1
    assert order(1.0) == 1 and order(2.0) == 2 and order(12.0) == 12 and order(13.0) == 1
    assert order(2.24, sigma=1.0) == 2 and order(2.26, sigma=1.0) == 1
