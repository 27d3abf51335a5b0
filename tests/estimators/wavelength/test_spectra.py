"""The parts of a look by themselves, each against its definition written out or a closed form."""

import numpy as np
import pytest

from papilla.estimators.stream import completed
from papilla.estimators.wavelength.refine import phases_of, regressed, share_kept
from papilla.estimators.wavelength.spectrum import (
    FEWEST,
    GUARD,
    LOCAL,
    LOWEST,
    MEDIAN_EFFICIENCY,
    WIDTH,
    background,
    spectrum_of,
    strokes_of,
)


@pytest.fixture(scope="module")
def uneven():
    """place (n,) of uneven steps over 30 mm and readings (n, 2) with a trend, one of them missing for a while."""
    rng = np.random.default_rng(0)
    place = 5.0 + np.cumsum(0.1 * (1 + 0.5 * rng.uniform(-1, 1, 300)))
    readings = rng.standard_normal((300, 2)) * (1.0, 30.0) + 0.02 * place[:, None] ** 2 - 3.0
    readings[40:60, 1] = np.nan
    return place, readings


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
