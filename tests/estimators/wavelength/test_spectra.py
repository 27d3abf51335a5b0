"""The parts of a look by themselves, each against its definition written out or a closed form."""

import numpy as np
import pytest

from papilla.estimators.stream import completed
from papilla.estimators.wavelength.spectrum import (
    FEWEST_SIDE_CELLS,
    GUARD_RESOLUTIONS,
    LARGEST_SIDE_WIDTH,
    LOWEST_RESOLUTIONS,
    MEDIAN_EFFICIENCY,
    MOST_SIDE_CELLS,
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
        width = min(max(LARGEST_SIDE_WIDTH * place / resolution, 2 * FEWEST_SIDE_CELLS), MOST_SIDE_CELLS)
        sides = []
        for way in (-1, 1):
            near = [
                place + way * round((GUARD_RESOLUTIONS + n) * resolution) for n in range(MOST_SIDE_CELLS) if n < width
            ]
            sides.append([power[one] for one in near if round(LOWEST_RESOLUTIONS * resolution) <= one < len(power)])
        if min(map(len, sides)) < FEWEST_SIDE_CELLS:
            assert level == np.inf and cells == 0
            continue
        both = np.exp(np.mean([np.median(np.log(side)) for side in sides]))
        assert level == pytest.approx(both / (1 - 2 / (9 * 2)) ** 3, rel=1e-9)
        assert cells == pytest.approx(4 * MEDIAN_EFFICIENCY / sum(1 / len(side) for side in sides))
    assert np.isfinite(found.power[2:4]).all() and not np.isfinite(found.power[-1])
