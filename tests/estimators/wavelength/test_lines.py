"""Spectral lines of a log in the position domain, their background, their sigma, and lags between channels."""

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.estimators.wavelength.lines import find_lines, latest_stretch, travelled, with_harmonics
from papilla.estimators.wavelength.spectrum import Line, background


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


def test_however_many_channels_noise_alone_gives_no_lines():
    """Sixteen channels of noise of their own: 1 % of the logs may show a line, and of 40 hardly more than 3."""
    position = np.arange(300) * 0.2
    found = [len(find_lines(position, red(300, 16, 0.0, seed)).lines) > 0 for seed in range(40)]
    assert sum(found) <= 3


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


def test_the_wavelength_does_not_depend_on_how_the_finger_moved():
    time = np.arange(4000) / 500
    for velocity in (
        10 + 6 * np.sin(2 * np.pi * 0.7 * time),
        20 * np.sin(2 * np.pi * 0.11 * time),
        np.full(4000, -9.0),
    ):
        position = travelled(time, velocity)
        readings = np.sin(2 * np.pi * position / 1.7) + np.random.default_rng(1).normal(0, 0.3, 4000)
        found = find_lines(position, readings)
        assert found.lines[0].wavelength_mm == pytest.approx(1.7, rel=2e-3)


def test_scale_and_offset_change_nothing_but_the_amplitude():
    position = np.arange(900) * 0.1
    readings = red(900, 2, 0.5, 1) + 2 * np.cos(2 * np.pi * position / 3)[:, None]
    one, other = find_lines(position, readings), find_lines(position, 1e-6 * readings - 5e-4)
    assert len(one.lines) == len(other.lines) > 0
    for a, b in zip(one.lines, other.lines, strict=True):
        assert b.wavelength_mm == pytest.approx(a.wavelength_mm, rel=1e-5)
        assert b.amplitude == pytest.approx(1e-6 * a.amplitude, rel=1e-4)


def test_harmonics_are_named():
    position = np.arange(2000) * 0.1
    wave = np.cos(2 * np.pi * position / 12) + 0.4 * np.cos(6 * np.pi * position / 12 + 1)
    lines = find_lines(position, wave + np.random.default_rng(0).normal(0, 0.3, 2000)).lines
    assert [(round(line.wavelength_mm, 1), line.harmonic) for line in lines[:2]] == [(12.0, 1), (4.0, 3)]
    assert lines[1].fundamental_mm == lines[0].wavelength_mm


def test_faulty_rows_and_channels_are_counted_not_hidden():
    position = np.arange(900) * 0.1
    readings = np.column_stack([np.cos(2 * np.pi * position / 3 + k) for k in range(3)])
    readings = readings + np.random.default_rng(0).normal(0, 0.2, readings.shape)
    readings[100:120, 1] = np.nan
    dead, lost = np.full(900, 7.0), np.full(900, np.nan)
    found = find_lines(position, np.column_stack([readings, dead, lost]))
    assert (found.unused_samples, found.unused_channels) == (20, 2)
    assert found.lines[0].wavelength_mm == pytest.approx(3, rel=2e-3)


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


def test_the_background_is_found_beside_lines():
    generator = np.random.default_rng(4)
    k = np.arange(400.0)
    truth = 3 * np.maximum(k / 150, 0.002) ** -2.0 + 0.5
    power = truth * generator.chisquare(2, k.size) / 2
    lines = np.array([37, 60, 200])
    power[lines] *= 80
    level = background(power, np.arange(20, 380), 1.0)
    # A median of 40 scatters by 23 %.
    assert np.std(np.log(level.power / truth[20:380])) < 0.3 and abs(np.mean(np.log(level.power / truth[20:380]))) < 0.1
    assert (level.chance(power[20:380])[lines - 20] < 1e-4).all()
    unknown = background(power, [2], 1.0)
    assert np.isinf(unknown.power).all() and unknown.chance(power[[2]]) == 1
    for true in (2, 8, 60):
        found = background(generator.chisquare(true, 2000), np.arange(50, 1950), 1.0).freedom
        assert np.median(found) == pytest.approx(true, rel=0.25)


def test_noise_passes_as_seldom_as_it_is_said():
    """Local medians of 10^5 places of red noise, 1 in 100 and 1 in 1000 stated."""
    generator = np.random.default_rng(5)
    slope = np.exp(-np.arange(400) / 40)
    passed = []
    for _ in range(300):
        power = slope * generator.exponential(size=400)
        at = np.arange(30, 360)
        passed.append(background(power, at, 1.0).chance(power[at]))
    for stated in (1e-2, 1e-3):
        assert np.mean(np.array(passed) < stated) == pytest.approx(stated, rel=0.5)


@pytest.mark.parametrize("skin_mm", [0.1, 0.2, 0.3])
def test_a_rough_surface_through_the_skin_has_no_lines(skin_mm):
    """White roughness through a Gaussian skin falls off by orders of magnitude; 1 % of logs may show a line."""
    from scipy.ndimage import gaussian_filter1d

    position, found = np.arange(2000) * 0.06, 0
    for seed in range(40):
        rough = gaussian_filter1d(np.random.default_rng(seed).normal(size=2000), skin_mm / 0.06)
        readings = rough / rough.std() + np.random.default_rng(seed + 1000).normal(0, 0.1, 2000)
        found += bool(find_lines(position, readings, wavelength_range_mm=(0.4, 6)).lines)
    assert found <= 2


def test_a_path_is_the_trapezoids_of_its_velocity():
    np.testing.assert_allclose(travelled([0.0, 1.0, 3.0, 3.5], [0.0, 2.0, 4.0, -4.0]), [0.0, 1.0, 7.0, 7.0])


def test_the_spectrum_is_that_of_what_was_searched():
    position = np.arange(1500) * 0.05
    reading = np.cos(2 * np.pi * position / 2) + np.random.default_rng(1).normal(0, 0.3, 1500)
    found = find_lines(position, reading, wavelength_range_mm=(1, 6))
    k, power = found.wavenumber_per_mm, found.power
    assert len(k) == len(power) == len(found.background) > 50
    assert k[0] == pytest.approx(1 / 6, abs=0.01) and k[-1] == pytest.approx(1, abs=0.01)
    assert found.searched_mm == (1, 6) and (np.diff(k) > 0).all() and k[0] >= 1 / 6 and k[-1] <= 1
    assert k[power.argmax()] == pytest.approx(0.5, abs=0.005)
    assert 0.3 < np.median(power / found.background) < 1.5 and power.max() > 100 * np.median(found.background)


def test_short_and_reciprocating_logs_are_answered():
    assert find_lines(np.arange(20) * 0.08, np.random.default_rng(163).normal(size=20)).lines == ()
    for seed in range(200):
        rng = np.random.default_rng(seed)
        position = np.abs((0.08 * np.arange(16 + seed)) % 3 - 1.5)
        find_lines(position, rng.normal(size=16 + seed).round(1))


def test_the_channels_of_a_line_are_those_that_show_it():
    position = np.linspace(0, 120, 3000)
    readings = np.random.default_rng(7).normal(0, 1, (3000, 4))
    readings[:, [0, 3]] += np.sin(2 * np.pi * position / 4)[:, None]
    readings[:, 1] = np.nan
    found = find_lines(position, readings)
    assert found.lines[0].wavelength_mm == pytest.approx(4, rel=2e-3)
    assert found.lines[0].channels == (0, 3)
    assert found.unused_channels == 1


def test_the_latest_stretch_of_a_long_path_is_searched(monkeypatch):
    position = np.linspace(0, 100, 5001)
    assert latest_stretch(position) == 0
    monkeypatch.setattr("papilla.estimators.wavelength.lines.LONGEST_GRID", 2000)
    first = latest_stretch(position, (1.0, 10.0))
    assert 100 - position[first] == pytest.approx(2000 / 8 / 4, rel=0.01), "a grid of 8 points in a quarter of 1 mm"
    assert latest_stretch(np.tile(position[:501], 10), (1.0, 10.0)) == 0, "to and fro is no long path"
    with pytest.raises(InputError, match="rows with a position"):
        latest_stretch([1.0, np.nan])


def test_harmonics_sharpen_the_fundamental_by_their_order():
    """Inverse variances: the n-th harmonic knows the wavenumber n times better; louder lines are no harmonics."""
    base = Line(0.25, 50.0, 1.0, 1e-9, 1e-3)
    third = Line(0.7506, 20.0, 0.4, 1e-6, 1.2e-3)
    found = with_harmonics(base, [third, base], 0.01)
    weights = np.array([1e-3, 0.4e-3]) ** -2.0
    assert found.wavenumber == pytest.approx(weights @ [0.25, 0.2502] / weights.sum(), rel=1e-12)
    assert found.sigma == pytest.approx(weights.sum() ** -0.5, rel=1e-9) and found[1:4] == base[1:4]
    assert with_harmonics(base, [third._replace(amplitude=1.5)], 0.01) == base
    assert with_harmonics(base, [third._replace(wavenumber=0.77)], 0.01) == base
    apart = with_harmonics(base, [third._replace(wavenumber=0.759)], 0.01)
    spread = weights @ (np.array([0.25, 0.253]) - apart.wavenumber) ** 2
    assert spread > 1 and apart.sigma == pytest.approx((spread / weights.sum()) ** 0.5), "Birge's ratio"


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
