"""Power of unevenly spaced readings over a coordinate, pooled over strokes and gauges, and the lines in it.

The coordinate is the path (wavenumbers), the time (frequencies) or a warped time. Strokes are transformed apart and
their powers added: the skin trails the finger by an unknown distance after each turn, so that a line keeps its
wavelength from stroke to stroke but not its phase. The same for the gauges. A whole log may be taken as one stroke.

A row weighs as much as the path it stands for, so that standing still adds nothing and uneven steps do not matter, and
the taper is over the coordinate: a path to and fro has its ends at every turn, and would leak there.

A line is compared with the background beside it. Drift, rough surfaces, roll-off of the skin and white noise have no
common formula, but each is smooth over a few resolutions. The level at a line is

  ln level = (ln median_left + ln median_right) / 2,

each median taken beyond a guard that the line itself fills, so a tilt of the spectrum cancels. The probability that
noise exceeds such a level has a closed form (constant false alarm rate: Finn and Johnson 1968, RCA Review 29:414;
medians: Rohling 1983, doi:10.1109/TAES.1983.309350).
"""

import math
from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from papilla.core.units import TINY_DIVISOR
from papilla.estimators.stream import Pieces

CYCLE_EXPONENT = 2j * np.pi
"""Exponent of a wave for one cycle."""
FEWEST_STEPS = 2.2
"""Smallest number of steps of the path in a wavelength; two are the aliasing limit."""
SHOWN_WAVENUMBER_RATIO, EVEN_STEP_SHARE = 0.45, 0.9
"""Highest wavenumber, relative to that of the steps, that uneven steps show; and the share of the steps that must be
short enough for it."""
PADDED_GRID_LENGTH = 1.6
"""Length of a grid, relative to what it holds: zeros behind it, so that a peak is sampled near its top."""
MOST_GRID_POINTS = 2**20
"""Of a grid, above which gauges are transformed one by one: a long log then does not need them all at once."""
FEWEST_ROWS, COMPARABLE_STROKES = 8, 0.6
"""Rows that a stroke must have more than; and the part of the longest stroke's extent that the others must have: the
shortest one sets the resolution."""
LINEAR_SHARES = np.array([[-1, 1], [1, 0]])
"""Shares of two grid points in a sample: a row by power (1, 0) of its distance from the begin of its cell, a column by
point. The images of a line beyond the grid, which even steps of the path make, come back by the transform sinc^2: with
2 % of its amplitude at most where the grid has eight points in the shortest wavelength."""
CUBIC_SHARES = np.array([[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 0, 3, 0], [1, 4, 1, 0]]) / 6
"""The same of four points by a cubic B-spline: sinc^4, 4e-4 at most. On a grid as coarse as the path's steps it would
raise the noise of short wavelengths 17 times."""
SPARE_TOPS = 8
"""Peaks beside those that are wanted: some are too near to drift to be separated from it."""
MOST_SIDE_CELLS, GUARD_RESOLUTIONS, FEWEST_SIDE_CELLS = 20, 2, 2
"""Largest number of cells on each side for the median, resolutions from the line to the first cell, and smallest number
of cells."""
LOWEST_RESOLUTIONS = 1.0
"""Resolutions from zero to the lowest cell; what lies below counts as drift."""
LARGEST_SIDE_WIDTH = 2.0
"""Largest width of a side, relative to its distance from zero, where drift bends the spectrum."""
MEDIAN_EFFICIENCY = 0.36
"""Number of cells whose mean is as certain as a median of one cell: (ln 2)^2 for noise, times three quarters because a
taper correlates cells."""
PLACES_AT_ONCE = 4096
"""Places whose background is examined at once."""


class Strokes(NamedTuple):
    """Rows of one window: place (m,), readings (m, g) less their trend (0 where missing), seen (m, g) as 0 or 1.

    weight (m,) : path (or time) that a row stands for, under a Hann taper along its stroke; begin (s + 1,) : where
    strokes begin, and the end; extent : of the shortest.
    """

    place: np.ndarray
    readings: np.ndarray
    seen: np.ndarray
    weight: np.ndarray
    begin: np.ndarray
    extent: float

    @property
    def rows(self) -> list[slice]:
        """The rows of each stroke."""
        return [slice(*ends) for ends in pairwise(self.begin.tolist())]


class Line(NamedTuple):
    """A peak: wavenumber (or frequency), power over the background, amplitude in units of the gauges' own noise,
    and the probability that noise reaches it. In a whole log (`lines`) the amplitude is in units of the readings;
    sigma : of the wavenumber; channels : numbers of those that show it by themselves."""

    wavenumber: float
    ratio: float
    amplitude: float
    chance: float
    sigma: float = 0.0
    channels: tuple[int, ...] = ()


class Spectrum(NamedTuple):
    """power (n,) : mean over the gauges of each one's over its own median, at 0, step, 2 step ...; each (g, n) : their
    powers; own (g,) : these medians, infinite for a gauge that shows nothing; resolution : in steps."""

    power: np.ndarray
    each: np.ndarray
    own: np.ndarray
    step: float
    resolution: float

    def chance(self, wavenumber: float) -> float:
        """Probability that noise reaches the power within half a resolution of a wavenumber."""
        middle, half = wavenumber / self.step, 0.5 * self.resolution
        at = np.arange(max(round(middle - half), 1), min(round(middle + half) + 1, len(self.power)))
        if not len(at):
            return 1.0
        top = at[[int(self.power[at].argmax())]]
        return float(background(self.power, top, self.resolution, pooled=False).chance(self.power[top])[0])

    def lines(self, low: float, high: float, most: int) -> Pieces[list[Line]]:
        """The greatest peaks over the background between two wavenumbers, most amplitude first."""
        power = self.power
        tops = self.tops(max(int(low / self.step), 1), min(int(high / self.step) + 2, len(power) - 1))
        tops = tops[np.argsort(-power[tops])[: most + SPARE_TOPS]]
        yield
        noise = background(power, tops, self.resolution, pooled=False)
        places = self.vertices(tops)
        valid = (noise.power < np.inf) & (places >= low) & (places <= high)
        rows = places, power[tops] / noise.power, power[tops] ** 0.5, noise.chance(power[tops])
        return [Line(*values) for values in zip(*(values[valid][:most].tolist() for values in rows), strict=True)]

    def tops(self, first: int, last: int) -> np.ndarray:
        """Indices (m,) of the peaks from `first` > 0 to before `last`."""
        from scipy.ndimage import maximum_filter1d

        inner = self.power[first:last]
        # A side lobe, or the shoulder of a stronger line, is within the width of the taper.
        highest = maximum_filter1d(self.power, 2 * int(2 * self.resolution) + 1)[first:last]
        return first + np.flatnonzero((inner == highest) & (inner > self.power[first - 1 : last - 1]))

    def vertices(self, tops: np.ndarray) -> np.ndarray:
        """Wavenumbers (m,) of peaks: the vertices of the parabolas through the logarithms about each."""
        before, middle, after = np.log(self.power[np.add.outer((-1, 0, 1), tops)])
        return self.step * (tops + 0.5 * (before - after) / np.minimum(before - 2 * middle + after, -TINY_DIVISOR))


def vertex(powers: Sequence[float] | np.ndarray) -> float:
    """Place of a line's top, in steps from the middle of three powers: that of the parabola through their
    logarithms."""
    if not min(powers) > 0:
        return 0.0
    before, middle, after = map(math.log, powers)
    curvature = before - 2 * middle + after
    return 0.5 * (before - after) / curvature if curvature < 0 else 0.0


class Level(NamedTuple):
    """Expected power (m,) of noise, infinite if it is not known; cells (m,) : number of independent cells behind it, 0
    then; freedom (m,) : degrees of freedom of the chi-square distribution of the power around it, 2 for one channel."""

    power: np.ndarray
    cells: np.ndarray
    freedom: np.ndarray

    def chance(self, power) -> np.ndarray:
        """Probability (m,) that noise reaches this power (m,)."""
        # As for one channel: a cause common to all channels, such as a rough surface, acts on all of them alike.
        return (1 + power / self.power / np.maximum(self.cells, TINY_DIVISOR)) ** -self.cells


def background(power: np.ndarray, at: np.ndarray, resolution: float, pooled: bool = True) -> Level:
    """The level (m,) of noise at indices `at` (m,).

    power : (n,) > 0 of a tapered spectrum, evenly from wavenumber or frequency 0. resolution : in indices. The cells
    lie whole resolutions away from the place itself, where a line at the place has no power. pooled : whether to
    estimate the degrees of freedom, because a mean of channels may have more than the two of one channel.
    """
    at = np.asarray(at, int)
    logarithm = np.append(np.log(power), np.inf)
    # One part after the other: all cells of all places of a long spectrum would take hundreds of MB.
    begins = range(0, len(at), PLACES_AT_ONCE)
    parts = [_around(logarithm, at[begin : begin + PLACES_AT_ONCE], resolution) for begin in begins]
    twice, enough, spread = map(np.concatenate, zip(*parts, strict=True)) if parts else np.zeros((3, 0))
    freedom = _freedom(power, at, max(round(resolution), 1)) if pooled else np.full(len(at), 2.0)
    # Wilson and Hilferty's median of a chi-square over its mean.
    level = np.exp(twice / 4) / (1 - 2 / (9 * freedom)) ** 3
    return Level(np.where(enough, level, np.inf), np.where(enough, 4 * MEDIAN_EFFICIENCY / spread, 0.0), freedom)


def _around(logarithm: np.ndarray, at: np.ndarray, resolution: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For places (m,): twice the sum of the medians of ln power on both sides; whether there are enough cells; and the
    sum of the inverse numbers of cells. logarithm (n + 1,) : infinite in its last place."""
    width = np.clip(LARGEST_SIDE_WIDTH * at / resolution, 2 * FEWEST_SIDE_CELLS, MOST_SIDE_CELLS)[:, None]
    steps = np.arange(MOST_SIDE_CELLS)
    offsets = np.round((GUARD_RESOLUTIONS + steps) * resolution).astype(int)
    # (2, m, cells): both sides of each place.
    places = at[:, None] + np.multiply.outer((-1, 1), offsets)[:, None]
    seen = (steps < width) & (places >= round(LOWEST_RESOLUTIONS * resolution)) & (places < len(logarithm) - 1)
    values = np.sort(logarithm[np.where(seen, places, -1)], axis=-1)
    count = seen.sum(axis=-1)
    sides, rows = np.arange(2)[:, None], np.arange(len(at))
    twice = values[sides, rows, np.maximum(count - 1, 0) // 2] + values[sides, rows, count // 2]
    return twice.sum(axis=0), (count >= FEWEST_SIDE_CELLS).all(axis=0), (1 / np.maximum(count, 1)).sum(axis=0)


def _freedom(power: np.ndarray, at: np.ndarray, stride: int) -> np.ndarray:
    """Degrees of freedom (m,), 2 to 1000, around indices `at`, from the differences of the logarithm."""
    from scipy.ndimage import median_filter

    logarithm = np.log(power[::stride])
    if len(logarithm) < 2 * MOST_SIDE_CELLS:
        return np.full(len(at), 2.0)
    # A taper correlates neighbours.
    steps = np.abs(logarithm[GUARD_RESOLUTIONS:] - logarithm[:-GUARD_RESOLUTIONS])
    values, spreads = _spreads()
    seen = np.pad(median_filter(steps, 2 * MOST_SIDE_CELLS + 1, mode="mirror"), (GUARD_RESOLUTIONS, 0), mode="edge")
    return np.interp(-seen[np.minimum(at // stride, len(seen) - 1)], -spreads, values)


@lru_cache(maxsize=1)
def _spreads() -> tuple[np.ndarray, np.ndarray]:
    """Degrees of freedom, and the median |difference| of two logarithms of such a chi-square."""
    from scipy.stats import f

    values = np.geomspace(2, 1000, 60)
    return values, np.log(f.ppf(0.75, values, values))


def longest_strokes(place: np.ndarray, edges: Iterable[int], least: float) -> tuple[np.ndarray, np.ndarray] | None:
    """Rows (m,) of the strokes that are nearly as long as the longest, and where each begins in them (s + 1,); None
    where the longest is shorter than `least`.

    place (n,); edges : rows at which strokes begin, from 0, and n.
    """
    strokes = [np.arange(first, last) for first, last in pairwise(edges) if last - first > FEWEST_ROWS]
    extents = [float(np.ptp(place[rows])) for rows in strokes]
    longest = max(extents, default=0.0)
    if longest < max(least, TINY_DIVISOR):
        return None
    comparable = [rows for rows, extent in zip(strokes, extents, strict=True) if extent >= COMPARABLE_STROKES * longest]
    return np.concatenate(comparable), np.cumsum([0, *map(len, comparable)])


def strokes_of(place: np.ndarray, readings: np.ndarray, begin: np.ndarray, trend: int = 2) -> Pieces[Strokes]:
    """Strokes of rows at `place` (m,) with readings (m, g), NaN where missing; begin as in `Strokes`."""
    weight, flat, extents = np.empty(len(place)), np.empty_like(readings), []
    seen = np.isfinite(readings)
    for ends in pairwise(begin.tolist()):
        rows = slice(*ends)
        x = place[rows]
        extent = float(np.ptp(x))
        at = (x - x.min()) / extent
        taper = np.sin(np.pi * at) ** 2 * np.abs(slope(x))
        basis = np.vander(2 * at - 1, trend + 1)
        yield
        flat[rows] = _less_trend(basis, taper, readings[rows], seen[rows])
        weight[rows] = taper
        extents.append(extent)
    yield
    return Strokes(place, flat, seen, weight, begin, min(extents))


def spectrum_of(
    strokes: Strokes, step: float, size: int, count: int | None = None, spread: np.ndarray = LINEAR_SHARES
) -> Pieces[Spectrum]:
    """Spectrum on a grid of `size` points (a power of two), `step` apart, of each stroke and gauge: its first `count`
    places (all). spread : of a sample over points, `LINEAR_SHARES` or `CUBIC_SHARES`."""
    from scipy.fft import rfft

    gauges, count = strokes.readings.shape[1], count or size // 2 + 1
    powers, together = np.zeros((gauges, count)), max(MOST_GRID_POINTS // size, 1)
    for rows in strokes.rows:
        place = strokes.place[rows]
        at = (place - place.min()) / step
        cell = np.minimum(at.astype(int), size - len(spread))
        shares = np.vander(at - cell, len(spread)) @ spread
        values = strokes.weight[rows, None] * strokes.readings[rows]
        for some in [slice(begin, begin + together) for begin in range(0, gauges, together)]:
            loads, power = values[:, some], powers[some]
            index = (cell[:, None] + size * np.arange(len(power))).ravel()
            grid = np.zeros(len(power) * size)
            for k, share in enumerate(shares.T):
                grid += np.bincount(index + k, (share[:, None] * loads).ravel(), len(grid))
            transform = rfft(grid.reshape(-1, size))[:, :count]
            power += transform.real**2 + transform.imag**2
        yield
    powers /= _spread(size, powers.shape[1], len(spread))
    resolution = size * step / strokes.extent
    medians = np.median(powers[:, int(resolution) :: max(int(resolution), 1)], axis=1)
    medians = np.where(medians > 1e-12 * medians.max(), medians, np.inf)
    showing = max(int(np.isfinite(medians).sum()), 1)
    return Spectrum(
        np.maximum((1 / medians) @ powers / showing, TINY_DIVISOR), powers, medians, 1 / (size * step), resolution
    )


@lru_cache(maxsize=8)
def _spread(size: int, count: int, points: int) -> np.ndarray:
    """(count,) what spreading a sample over so many of the `size` points of a grid does to its power."""
    return np.sinc(np.arange(count) / size) ** (2 * points)


def size_of(extent: float, step: float) -> int:
    """Points of a grid for this extent: a power of two."""
    return 1 << math.ceil(math.log2(PADDED_GRID_LENGTH * extent / step))


def highest_shown(place: np.ndarray, least: float = TINY_DIVISOR) -> float:
    """The highest wavenumber that the distances of these places can show, if they are `least` or more."""
    return SHOWN_WAVENUMBER_RATIO / max(share_of(np.abs(np.diff(place)), EVEN_STEP_SHARE), least)


def slope(values: np.ndarray) -> np.ndarray:
    """Change (m,) from row to row of at least two: `np.gradient` of evenly spaced rows, at a fifth of its price."""
    change = np.empty_like(values)
    change[1:-1] = 0.5 * (values[2:] - values[:-2])
    change[0], change[-1] = values[1] - values[0], values[-1] - values[-2]
    return change


def share_of(values: np.ndarray, share: float) -> float:
    """What this share of the values (m,) is below: a `np.quantile` that is one of them."""
    place = int(share * (len(values) - 1))
    return float(np.partition(values, place)[place])


def middle(values: np.ndarray) -> float:
    """Median of values (m,), 0 for none: `np.median` at a fifth of its price."""
    ranked, half = np.sort(values), len(values) // 2
    return float(0.5 * (ranked[(len(values) - 1) // 2] + ranked[half])) if len(values) else 0.0


def _less_trend(basis: np.ndarray, weight: np.ndarray, readings: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Readings (m, g) less the weighted fit of basis (m, p); 0 where not seen."""
    values, size = np.where(seen, readings, 0.0), basis.shape[1]
    # What is left of a gauge that never changes is rounding, not a signal.
    least = 1e-11 * np.abs(values).max(axis=0)
    used = weight[:, None] * seen
    squares = (basis[:, :, None] * basis[:, None, :]).reshape(len(basis), -1)
    gram = (used.T @ squares).reshape(-1, size, size)
    # Too few rows fit any trend: the smallest one is taken.
    gram += (1e-15 * float(weight.sum())) * np.eye(size)
    fit = np.linalg.solve(gram, ((used * values).T @ basis)[..., None])[..., 0]
    values = seen * (values - basis @ fit.T)
    return np.where(np.abs(values) > least, values, 0.0)
