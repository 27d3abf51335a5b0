"""Small parts of the search for a wavelength, each against its closed form or the same number by another way."""

import math

import numpy as np
import pytest

from papilla.estimators.stream import completed
from papilla.estimators.wavelength.frequency_search import FrequencySearch, nominated, price_of
from papilla.estimators.wavelength.fundamental import hints
from papilla.estimators.wavelength.line_search import LineSearch
from papilla.estimators.wavelength.memory import Options, Task, TrackingStatus
from papilla.estimators.wavelength.motion_fit import (
    JUMPS_PART,
    MOTION_KNOTS,
    SHAPE_PARAMETERS,
    TREND_PARAMETERS,
    MotionFit,
    moved,
    phase_at,
    rates_at,
)
from papilla.estimators.wavelength.spectrum import (
    CUBIC_SHARES,
    Line,
    Spectrum,
    background,
    highest_shown,
    longest_strokes,
    middle,
    share_of,
    size_of,
    slope,
    spectrum_of,
    strokes_of,
    vertex,
)

TIME = np.arange(900) / 1000


def motion_of(motion, jumps):
    return MotionFit(
        np.array(motion), np.array(jumps), 0.02, 0.03, np.zeros(TREND_PARAMETERS), np.zeros(SHAPE_PARAMETERS),
        np.zeros((1, 1)), 1.0, np.zeros(1), 0.0,
    )  # fmt: skip


@pytest.mark.parametrize("stiffness", [-90.0, 1e-3, 250.0])
def test_a_motion_is_the_same_from_any_moment_and_its_rate_the_slope_of_its_phase(stiffness):
    start = np.array([0.3, 60.0, -200.0, stiffness])
    assert moved(moved(start, -0.07), -0.05) == pytest.approx(moved(start, -0.12))
    assert moved(moved(start, 0.1), -0.1) == pytest.approx(start)
    jumps = np.random.default_rng(0).normal(0, 40, MOTION_KNOTS)
    time, plain = np.linspace(-0.25, 0.0, 31), motion_of(start, 0 * jumps)
    assert phase_at(plain, np.array([-0.07]))[0] == pytest.approx(moved(start, -0.07)[0])
    assert rates_at(plain, np.array([-0.07]))[0] == pytest.approx(moved(start, -0.07)[1])
    bent = motion_of(start, jumps)
    assert bent.knots == pytest.approx(-0.02 - 0.03 * np.arange(MOTION_KNOTS))
    (later, speed), (before, _) = phase_at(bent, time + 1e-6), phase_at(bent, time - 1e-6)
    rates, slopes = rates_at(bent, time)
    assert rates == pytest.approx((later - before) / 2e-6, rel=1e-5, abs=1e-3)
    assert speed == pytest.approx(np.abs(rates), abs=1e-2)
    values = np.concatenate([start, jumps])
    for k, step in enumerate(1e-5 * np.eye(JUMPS_PART.stop) * np.maximum(np.abs(values), 1.0)):
        up, down = (rates_at(motion_of(*np.split(values + sign * step, [4])), time)[0] for sign in (1, -1))
        assert slopes[:, k] == pytest.approx((up - down) / (2 * step[k]), rel=1e-3, abs=1e-5)


def test_the_price_of_a_fit_and_the_peaks_from_which_it_starts():
    fit = motion_of([0.0, -60.0, 0.0, 0.0], np.zeros(MOTION_KNOTS))
    expected = 100 * math.log(0.02) + 2 * 5 * math.log(100) - 15 * math.log2(60)
    assert price_of(fit, 0.02, 100, 1000.0) == pytest.approx(expected)
    quick = price_of(fit, 0.02, 100, 400.0)
    assert quick - expected == pytest.approx(-6 * math.log(100)), "two harmonics are shown at 400 Hz"
    slow = motion_of([0.0, 0.1, 0.0, 0.0], np.zeros(MOTION_KNOTS))
    assert price_of(slow, 1.0, 100, 1000.0) == pytest.approx(10 * math.log(100))
    rated = {10.0: 1, 50.0: 5, 52.4: 4, 53.0: 3, 20.0: 2, 80.0: 0.5, 90.0: 0.4}
    scored = [(score, np.array([0.0, rate, 0.0, 0.0])) for rate, score in rated.items()]
    assert [motion[1] for motion in nominated(scored)] == [50.0, 53.0, 20.0, 10.0]


@pytest.mark.parametrize("size, moves", [(0.0, False), (0.5, False), (2.0, True)])
def test_readings_move_where_they_are_not_as_white_as_noise(size, moves):
    time = (np.arange(133) - 66) / 1000
    noise = np.random.default_rng(1).standard_normal(133)
    readings = noise + size * np.cos(2 * np.pi * 40 * time) + 300 * time + 2e3 * time**2
    assert FrequencySearch(readings, time, 15.0, 400.0, 1000.0).moves() == moves
    alternating = 0.3 * noise + 3 * np.cos(2 * np.pi * 450 * time)
    assert FrequencySearch(alternating, time, 15.0, 400.0, 1000.0).moves(), "quicker than noise"
    few = np.where(np.arange(133) < 31, 5 * time, np.nan)
    assert not FrequencySearch(few, time, 15.0, 400.0, 1000.0).moves()


def flat_spectrum(bumps, seed=0):
    """Noise of mean 1 with the given powers at wavenumbers; a resolution is 0.04 / mm."""
    power = np.random.default_rng(seed).exponential(size=600)
    for wavenumber, size in bumps.items():
        power[round(wavenumber / 0.01)] = size
    return Spectrum(power, power[None], np.ones(1), 0.01, 4.0)


CHOSEN = Line(1.2, 400.0, 20.0, 1e-12)


@pytest.mark.parametrize(
    "bumps, divisor, lines, lowest, hinted",
    [
        ({}, 2, [], 0.1, False), ({0.6: 60.0}, 2, [], 0.1, True), ({0.6: 60.0}, 3, [], 0.1, False),
        ({0.4: 60.0}, 3, [], 0.1, True), ({0.8: 60.0}, 3, [], 0.1, True), ({1.8: 60.0}, 2, [], 0.1, True),
        ({1.8: 60.0}, 2, [], 0.7, False), ({0.6: 60.0}, 2, [], 0.7, True), ({2.4: 60.0}, 2, [], 0.1, False),
        ({3.0: 60.0}, 2, [], 0.1, True), ({3.6: 60.0}, 2, [], 0.1, False),
        ({0.6: 60.0}, 2, [Line(0.62, 50.0, 7.0, 1e-6)], 0.1, False),
        ({0.6: 60.0}, 2, [Line(0.7, 50.0, 7.0, 1e-6)], 0.1, True), ({1.8: 20.0}, 2, [], 0.1, False),
    ],
)  # fmt: skip
def test_a_hint_is_more_than_noise_where_a_multiple_of_a_lower_fundamental_would_be(
    bumps, divisor, lines, lowest, hinted
):
    """Up to the multiple 2 divisor + 1, none of them those of a lower divisor; below the range the first alone; a
    quarter of the amplitude at least, of which 20 has a power of 25."""
    for seed in (0, 1):
        quiet = flat_spectrum(bumps, seed)
        assert hints(quiet, [CHOSEN, *lines], CHOSEN, divisor, 0.08, lowest) == hinted


def test_helpers_are_numpys_and_sizes_powers_of_two():
    rng = np.random.default_rng(4)
    for count in (2, 7, 40):
        values = rng.normal(size=count)
        assert slope(values) == pytest.approx(np.gradient(values)) and middle(values) == pytest.approx(
            np.median(values)
        )
        assert share_of(values, 0.7) == np.sort(values)[int(0.7 * (count - 1))]
    assert middle(np.empty(0)) == 0.0
    assert [size_of(extent, 0.1) for extent in (39.9, 40.1, 80.1)] == [1024, 1024, 2048]
    place = np.concatenate([np.arange(0, 9, 0.1), [11.0, 14.0]])
    assert highest_shown(place) == pytest.approx(4.5) and highest_shown(place, 0.5) == pytest.approx(0.9)
    assert vertex([1.0, 4.0, 1.0]) == 0 and vertex([0.0, 4.0, 1.0]) == vertex([4.0, 1.0, 4.0]) == 0
    assert vertex(np.exp(-((np.array([-1, 0, 1]) - 0.3) ** 2))) == pytest.approx(0.3)


def test_strokes_that_are_nearly_as_long_as_the_longest_are_kept():
    place = np.interp(np.arange(70), [0, 20, 40, 60, 69], [0.0, 10.0, 4.1, -1.8, 8.2])
    rows, begin = longest_strokes(place, (0, 20, 40, 60, 70), 5.0)
    assert begin.tolist() == [0, 20, 30] and rows.tolist() == [*range(20), *range(60, 70)]
    assert longest_strokes(place, (0, 20, 40, 60, 70), 10.5) is None
    assert longest_strokes(place, (0, 8, 16), 0.1) is None, "more than eight rows"
    assert len(longest_strokes(place, (0, 9, 18), 0.1)[0]) == 18


def test_the_chance_of_a_power_is_that_of_the_greatest_within_half_a_resolution():
    quiet = flat_spectrum({1.0: 40.0})
    (expected,) = background(quiet.power, np.array([100]), 4.0, pooled=False).chance(np.array([40.0]))
    assert quiet.chance(1.0) == quiet.chance(1.02) == quiet.chance(0.98) == pytest.approx(expected)
    assert expected < 1e-4 and quiet.chance(1.03) > 1e3 * expected and quiet.chance(20.0) == 1.0
    tops = quiet.tops(1, 599)
    assert 100 in tops and np.diff(tops).min() > 8
    assert all(quiet.power[max(top - 8, 0) : top + 9].max() == quiet.power[top] for top in tops.tolist())


def test_a_cubic_grid_shows_the_sum_over_the_rows_themselves():
    place = 0.1 * np.arange(400) + 0.02 * np.sin(np.arange(400))
    readings = np.random.default_rng(2).standard_normal((400, 2))
    strokes = completed(strokes_of(place, readings, np.array([0, 400])))
    spectrum = completed(spectrum_of(strokes, 0.05, 2048, 200, CUBIC_SHARES))
    k = np.arange(1, 200) / (2048 * 0.05)
    exact = np.abs(np.exp(-2j * np.pi * np.outer(k, place - place[0])) @ (strokes.weight[:, None] * strokes.readings))
    assert pytest.approx(exact, abs=2e-3 * exact.max()) == spectrum.each[:, 1:].T ** 0.5
    assert spectrum.each.shape == (2, 200) and spectrum.step == pytest.approx(k[0])


def looked(place, readings, **task_values):
    rows = np.column_stack([TIME, place, np.ones(900), readings])
    options = Options(0.4, 6.0, 1000.0, 0.0, None, (50.0, 60.0, 100.0, 120.0), 0.0)
    values = {"before": 0.0, "proved": 0.0, "known_hums_Hz": ()} | task_values
    task = Task(rows, (), options, 0.1, 2048, 0.0, 0.0, **values)
    return completed(LineSearch(task).run())


@pytest.mark.parametrize("size, followed", [(0.92, True), (0.75, False)])
def test_the_known_line_is_followed_unless_another_is_much_louder(size, followed):
    place, noise = 96 * TIME + 8 * np.sin(7 * TIME), 0.1 * np.random.default_rng(0).standard_normal(900)
    readings = np.cos(2 * np.pi * place / 1.8) + size * np.cos(2 * np.pi * place / 1.13 + 1) + noise
    assert looked(place, readings).wavenumber == pytest.approx(1 / 1.8, rel=3e-3)
    result = looked(place, readings, before=1 / 1.13)
    assert result.wavenumber == pytest.approx(1 / (1.13 if followed else 1.8), rel=3e-3)


LONE_CASES = ((40, 0, True), (22, 0, False), (26, 0, True), (88, 0, True), (95, 0, False), (40, 0.4, False))


@pytest.mark.parametrize("frequency, second, lone", LONE_CASES)
def test_a_lone_line_of_25_to_90_hz_at_a_constant_speed_may_be_a_motors(frequency, second, lone):
    noise = 0.1 * np.random.default_rng(0).standard_normal(900)
    turns = 2 * np.pi * frequency * TIME
    result = looked(96 * TIME, np.cos(turns) + second * np.cos(2 * turns) + noise)
    assert result.status == (TrackingStatus.LONE if lone else TrackingStatus.CONSTANT_SPEED)
    assert result.wavenumber == pytest.approx(frequency / 96, rel=3e-3)
