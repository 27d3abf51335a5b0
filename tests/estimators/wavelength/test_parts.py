"""The parts of a look by themselves, each against its definition written out or a closed form."""

import numpy as np
import pytest

from papilla.estimators.stream import completed
from papilla.estimators.wavelength.fundamental import fundamental_of
from papilla.estimators.wavelength.refine import phases_of, regressed, share_kept
from papilla.estimators.wavelength.spectrum import (
    FEWEST,
    GUARD,
    LOCAL,
    LOWEST,
    MEDIAN_EFFICIENCY,
    WIDTH,
    Line,
    background,
    middle,
    share_of,
    slope,
    spectrum_of,
    strokes_of,
)
from papilla.estimators.wavelength.time_lines import silenced
from papilla.estimators.wavelength.trackers import wavelength_between


@pytest.fixture(scope="module")
def uneven():
    """place (n,) of uneven steps over 30 mm and readings (n, 2) with a trend, one of them missing for a while."""
    rng = np.random.default_rng(0)
    place = 5.0 + np.cumsum(0.1 * (1 + 0.5 * rng.uniform(-1, 1, 300)))
    readings = rng.standard_normal((300, 2)) * (1.0, 30.0) + 0.02 * place[:, None] ** 2 - 3.0
    readings[40:60, 1] = np.nan
    return place, readings


def test_the_slope_is_that_of_numpy():
    values = np.random.default_rng(1).normal(size=9)
    np.testing.assert_allclose(slope(values), np.gradient(values), rtol=1e-12)
    np.testing.assert_allclose(slope(values[:2]), np.gradient(values[:2]), rtol=1e-12)


def test_middles_and_shares_are_those_of_numpy():
    values = np.random.default_rng(6).normal(size=41)
    for count in (1, 2, 7, 40, 41):
        assert middle(values[:count]) == pytest.approx(np.median(values[:count]), rel=1e-12)
        for share in (0.0, 0.3, 0.95, 1.0):
            lower = np.quantile(values[:count], share, method="lower")
            assert share_of(values[:count], share) == lower
    assert middle(values[:0]) == 0.0


def test_the_lowest_places_of_gauges_one_by_one_are_those_of_all_together(uneven, monkeypatch):
    place, readings = uneven
    strokes = completed(strokes_of(place, readings, np.array([0, 150, 300])))
    together = completed(spectrum_of(strokes, 0.2, 256))
    monkeypatch.setattr("papilla.estimators.wavelength.spectrum.POINTS", 256)
    apart = completed(spectrum_of(strokes, 0.2, 256, 60))
    np.testing.assert_allclose(apart.each, together.each[:, :60], rtol=1e-12)


def test_a_stroke_is_tapered_by_path_and_has_no_trend(uneven):
    place, readings = uneven
    strokes = completed(strokes_of(place, readings, np.array([0, 180, 300])))
    for first, last in ((0, 180), (180, 300)):
        x, rows = place[first:last], slice(first, last)
        at = (x - x[0]) / (x[-1] - x[0])
        taper = np.sin(np.pi * at) ** 2 * np.abs(np.gradient(x))
        np.testing.assert_allclose(strokes.weight[rows], taper, rtol=1e-9, atol=1e-12)
        for gauge in range(2):
            seen = np.isfinite(readings[rows, gauge])
            root = np.sqrt(taper[seen])
            basis = np.polynomial.legendre.legvander(2 * at - 1, 2)[seen]
            fit = np.linalg.lstsq(basis * root[:, None], readings[rows, gauge][seen] * root, rcond=None)[0]
            rest = np.zeros(last - first)
            rest[seen] = readings[rows, gauge][seen] - basis @ fit
            np.testing.assert_allclose(strokes.readings[rows, gauge], rest, atol=1e-6 * np.abs(rest).max())
    assert strokes.extent == pytest.approx(place[-1] - place[180])


def test_a_spectrum_is_the_sum_of_strokes_and_gauges_over_their_own_level(uneven):
    place, readings = uneven
    strokes, step, size = completed(strokes_of(place, readings, np.array([0, 180, 300]))), 0.025, 4096
    found = completed(spectrum_of(strokes, step, size))
    k = np.arange(1, 400) / (size * step)
    power = np.zeros((2, len(k)))
    for rows in (slice(0, 180), slice(180, 300)):
        waves = np.exp(-2j * np.pi * np.outer(k, place[rows] - place[rows.start]))
        power += np.abs(waves @ (strokes.weight[rows, None] * strokes.readings[rows])).T ** 2
    assert found.step == pytest.approx(k[0]) and found.resolution * found.step == pytest.approx(1 / strokes.extent)
    expected = (power / found.own[:, None]).mean(axis=0)
    np.testing.assert_allclose(found.power[1:400], expected, rtol=0.02, atol=0.01 * expected.mean())
    assert found.own[1] / found.own[0] == pytest.approx(900, rel=0.5), "by each gauge's own noise"


def test_the_level_beside_a_place_is_that_of_two_medians():
    """Cells whole resolutions away, beyond the guard, none below the lowest; a tilt in the logarithm cancels."""
    rng, resolution = np.random.default_rng(2), 3.7
    power = rng.exponential(size=600) * np.exp(-np.arange(600) / 150)
    at = np.array([9, 23, 120, 300, 560, 598])
    found = background(power, at, resolution, pooled=False)
    for place, level, cells in zip(at.tolist(), found.power.tolist(), found.cells.tolist(), strict=True):
        width = min(max(LOCAL * place / resolution, 2 * FEWEST), WIDTH)
        sides = []
        for way in (-1, 1):
            near = [place + way * round((GUARD + n) * resolution) for n in range(WIDTH) if n < width]
            sides.append([power[one] for one in near if round(LOWEST * resolution) <= one < len(power)])
        if min(map(len, sides)) < FEWEST:
            assert level == np.inf and cells == 0
            continue
        both = np.exp(np.mean([np.median(np.log(side)) for side in sides]))
        assert level == pytest.approx(both / (1 - 2 / (9 * 2)) ** 3, rel=1e-9)
        assert cells == pytest.approx(4 * MEDIAN_EFFICIENCY / sum(1 / len(side) for side in sides))
    assert np.isfinite(found.power[2:4]).all() and not np.isfinite(found.power[-1])


def test_the_chance_of_noise_is_as_often_as_it_says():
    """Exponential power: a level of chance 0.02 is reached in 2 % of the places, whatever the level's own error."""
    power = np.random.default_rng(3).exponential(size=40_000)
    at = np.arange(200, 39_800, 3)
    chance = background(power, at, 4.0, pooled=False).chance(power[at])
    for limit in (0.1, 0.02, 0.004):
        assert np.mean(chance < limit) == pytest.approx(limit, rel=0.35)


def wave(wavenumber, noise, seed, turn=None, gauges=1):
    """place, readings and stroke (n,) of one way, or of a way and back."""
    place = np.linspace(0, 60, 900)
    stroke = np.zeros(900, int)
    if turn:
        place, stroke = np.where(place < turn, place, 2 * turn - place), (place >= turn).astype(int)
    rng = np.random.default_rng(seed)
    sizes = np.array([1.0, 0.5])[:gauges]
    readings = sizes * np.cos(2 * np.pi * wavenumber * place[:, None] + 0.4 + stroke[:, None])
    return place, readings + noise * rng.standard_normal(readings.shape), stroke


def fitted(place, readings, stroke, wavenumber, noise):
    spread = np.full((2, readings.shape[1]), noise**2)
    ones = np.ones(len(place))
    phases = completed(phases_of(
        wavenumber * place, place[:, None] - place[-1], np.abs(np.gradient(place)), ones, readings,
        np.ones_like(readings, bool), stroke, spread,
    ))  # fmt: skip
    return phases, completed(regressed(phases, np.array([1e-12]), np.zeros(1)))


@pytest.mark.parametrize("turn, gauges", [(None, 1), (None, 2), (30.0, 1)])
def test_phases_tell_the_wavenumber_at_the_bound(turn, gauges):
    """Rife & Boorstyn (1974): sd(k) = sqrt(6) s / (pi a L sqrt(N)); each of two strokes has a phase of its own."""
    true, noise, steps, sigmas = 0.5, 0.3, [], []
    for seed in range(40):
        phases, fit = fitted(*wave(true, noise, seed, turn, gauges), true + 1e-3, noise)
        steps.append(fit.step[0])
        sigmas.append(fit.covariance[0, 0] ** 0.5)
    extent, count, strokes = (30.0, 450, 2) if turn else (60.0, 900, 1)
    power = 1.0 + 0.25 * (gauges - 1)
    bound = np.sqrt(6 / (strokes * count * power)) * noise / (np.pi * extent)
    assert np.mean(sigmas) == pytest.approx(bound, rel=0.15)
    assert np.mean(steps) == pytest.approx(-1e-3, abs=bound)
    assert np.std(steps) == pytest.approx(bound, rel=0.4)
    assert np.abs(phases.amplitude[:, 0]) == pytest.approx(1.0, abs=0.1) and phases.coherence > 0.95


def test_a_few_odd_blocks_do_not_turn_the_wavenumber():
    place, readings, stroke = wave(0.5, 0.05, 0)
    readings[430:480] += 3 * np.cos(2 * np.pi * 0.5 * place[430:480, None] + 2.0)
    _, fit = fitted(place, readings, stroke, 0.5, 0.05)
    _, clean = fitted(*wave(0.5, 0.05, 0), 0.5, 0.05)
    assert abs(fit.step[0]) < 5e-5 and clean.scatter < 2e-3
    assert fit.covariance[0, 0] > clean.covariance[0, 0]


def test_a_line_over_time_is_taken_out_and_the_surface_is_left():
    time = np.arange(900) / 1000
    place = 80 * time + 6 * time**2
    surface = np.cos(2 * np.pi * 0.5 * place) + 0.3 * np.cos(2 * np.pi * 1.0 * place + 1)
    hum = 2 * np.sin(2 * np.pi * 61.0 * time)
    strokes = completed(strokes_of(place, np.column_stack([surface + hum, 0.1 * surface - hum]), np.array([0, 900])))
    alone = completed(strokes_of(place, np.column_stack([surface, 0.1 * surface]), np.array([0, 900])))
    lines = [Line(61.0, 100.0, 1.0, 0.0), Line(117.0, 100.0, 0.9, 0.0)]
    for cleaned in (completed(silenced(strokes, time, lines, 0.5)), completed(silenced(strokes, time, lines[:1]))):
        inner = slice(100, 800)
        rest = cleaned.readings[inner] - alone.readings[inner]
        assert np.abs(rest).max() < 0.2 and np.abs(hum).max() > 1.9
    untouched = completed(silenced(strokes, time, [], 0.5))
    np.testing.assert_array_equal(untouched.readings, strokes.readings)


def test_phases_between_gauges_tell_the_wavelength_with_a_true_sigma():
    """Whole turns from the velocity, which is a few per cent off; errors over sigma of 200 draws."""
    rng, ratios = np.random.default_rng(4), []
    places, sigmas = np.array([0.0, 2.3, 5.9, 7.1]), np.array([0.08, 0.05, 0.1, 0.06])
    for _ in range(200):
        wavelength = rng.uniform(0.9, 3.0)
        phases = 2 * np.pi * places / wavelength + rng.uniform(0, 6) + sigmas * rng.standard_normal(4)
        phases = np.angle(np.exp(1j * phases))
        found, sigma = wavelength_between(places, phases, sigmas, wavelength * (1 + 0.01 * rng.standard_normal()))
        if np.isfinite(found):
            ratios.append((found - wavelength) / sigma)
    assert len(ratios) > 150 and 0.7 < np.sqrt(np.mean(np.square(ratios))) < 1.1
    assert np.mean(np.abs(ratios) < 2) > 0.93


def test_two_gauges_need_the_velocity_to_count_whole_turns():
    """7 mm apart the next count is 20 % away; 60 mm apart a velocity that is 1 % off leaves it open."""
    wavelength, sigmas = 1.4, (0.02, 0.02)
    for distance, told in ((7.0, True), (60.0, False)):
        for off in (-0.02, 0.0, 0.02):
            phases = (0.3, np.angle(np.exp(1j * (0.3 + 2 * np.pi * distance / wavelength))))
            found, sigma = wavelength_between((0.0, distance), phases, sigmas, wavelength * (1 + off))
            assert np.isfinite(found) == told
            if told:
                assert found == pytest.approx(wavelength, rel=1e-6)
                exact = wavelength**2 / (2 * np.pi * distance) * np.hypot(*sigmas)
                assert sigma == pytest.approx(exact, rel=1e-6)


def line(wavenumber, amplitude, ratio=1000.0):
    return Line(wavenumber, ratio, amplitude, 1e-9)


@pytest.mark.parametrize(
    "others, fundamental, sure",
    [
        ([], 1.0, True),
        ([line(0.5, 0.5)], 0.5, True),
        ([line(0.5, 0.5), line(1.5, 0.06)], 0.5, True),
        ([line(1.5, 0.6), line(2.5, 0.4)], 0.5, True),
        ([line(4 / 3, 0.6), line(5 / 3, 0.4)], 1 / 3, True),
        ([line(0.62, 0.9)], 1.0, True),
        ([line(1.618, 0.5), line(0.777, 0.4)], 1.0, True),
    ],
)
def test_the_fundamental_is_what_the_lines_are_harmonics_of(others, fundamental, sure):
    found = fundamental_of(line(1.0, 1.0), others, 0.0025, others, False)
    assert (found.wavenumber, not found.other) == (fundamental, sure)
    # What may be another's, as the mains', proves nothing.
    assert fundamental_of(line(1.0, 1.0), others, 0.0025, [], False)[0] == 1.0


def test_without_a_wavelength_only_the_loudest_lines_over_time_are_taken_out():
    time = np.arange(900) / 1000
    place = 80 * time + 6 * time**2
    readings = (2 * np.sin(2 * np.pi * 61.0 * time) + 0.3 * np.cos(2 * np.pi * 0.9 * place))[:, None]
    strokes = completed(strokes_of(place, readings, np.array([0, 900])))
    loud, faint = Line(61.0, 100.0, 1.0, 0.0), Line(117.0, 100.0, 0.3, 0.0)
    both, one = completed(silenced(strokes, time, [loud, faint])), completed(silenced(strokes, time, [loud]))
    np.testing.assert_array_equal(both.readings, one.readings)
    assert np.std(one.readings) < 0.2 * np.std(strokes.readings)


def test_the_share_that_is_kept_is_by_path_however_unevenly_that_was_read():
    place = 10 * np.linspace(0, 1, 400) ** 1.7
    for share in (1.0, 0.4):
        wave = np.cos(2 * np.pi * place / 1.1)
        readings = np.where(place > place[-1] - 4 * 1.1, share, 1.0)[:, None] * wave[:, None]
        seen = np.ones_like(readings, bool)
        kept, sigma = share_kept(place, readings, seen, 1 / 1.1, [1.0 + 0j], [0.01], 3)
        assert kept == pytest.approx(share, abs=0.03) and sigma < 0.05
        both = np.column_stack([readings, np.zeros(400)]), np.column_stack([seen, np.zeros(400, bool)])
        assert share_kept(place, *both, 1 / 1.1, [1.0, 1.0], [0.01, 0.01], 3) == pytest.approx((kept, sigma))
