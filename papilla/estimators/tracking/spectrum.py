"""Power of unevenly spaced readings over a coordinate, pooled over strokes and gauges, and the lines in it.

The coordinate is the path (wavenumbers), the time (frequencies) or a warped time. Strokes are transformed apart and
their powers added: the skin trails the finger by an unknown distance after each turn, so that a line keeps its
wavelength from stroke to stroke but not its phase. The same for the gauges.
"""

from typing import NamedTuple

import numpy as np

from papilla.estimators.background import background

GRID = 4
"""Grid points in the shortest wavelength: what lies beyond then folds back weaker than a third, and not into sums."""


class Strokes(NamedTuple):
    """Rows of one window: place (m,), readings (m, g) less their trend (0 where missing), seen (m, g) as 0 or 1.

    weight (m,) : path (or time) that a row stands for, under a Hann taper along its stroke; begin (s + 1,) : where
    strokes begin, and the end; origin (m,) : place at which the stroke of a row begins; extent : of the shortest.
    """

    place: np.ndarray
    readings: np.ndarray
    seen: np.ndarray
    weight: np.ndarray
    begin: np.ndarray
    origin: np.ndarray
    extent: float


class Line(NamedTuple):
    """A peak: wavenumber (or frequency), power over the background, amplitude in units of the gauges' own noise,
    probability that noise reaches it, and its place in the spectrum."""

    wavenumber: float
    ratio: float
    amplitude: float
    chance: float
    place: int


class Spectrum(NamedTuple):
    """power (n,) : mean over the gauges of each one's over its own median, at 0, step, 2 step ...; own (g,) : these
    medians, infinite for a gauge that shows nothing; resolution : in steps."""

    power: np.ndarray
    own: np.ndarray
    step: float
    resolution: float

    def level(self, at) -> np.ndarray:
        """Expected power of noise at indices `at` (m,)."""
        return background(self.power, np.asarray(at), self.resolution, pooled=False).power

    def chance(self, wavenumber: float) -> float:
        """Probability that noise reaches the power within half a resolution of a wavenumber."""
        middle, half = wavenumber / self.step, 0.5 * self.resolution
        at = np.arange(max(round(middle - half), 1), min(round(middle + half) + 1, len(self.power)))
        if not len(at):
            return 1.0
        top = at[[int(self.power[at].argmax())]]
        return float(background(self.power, top, self.resolution, pooled=False).chance(self.power[top])[0])

    def lines(self, low: float, high: float, most: int) -> list[Line]:
        """The greatest peaks over the background between two wavenumbers, most amplitude first."""
        power = self.power
        first, last = max(int(low / self.step), 1), min(int(high / self.step) + 2, len(power) - 1)
        inner = power[first:last]
        tops = first + np.flatnonzero((inner > power[first - 1 : last - 1]) & (inner >= power[first + 1 : last + 1]))
        if not len(tops):
            return []
        tops = tops[np.argsort(-power[tops])[: 4 * most]]
        noise = background(power, tops, self.resolution, pooled=False)
        chances = noise.chance(power[tops])
        found = []
        for top, level, chance in zip(tops.tolist(), noise.power.tolist(), chances.tolist(), strict=True):
            # A side lobe, or the shoulder of a stronger line, is within the width of the taper.
            reach = int(2 * self.resolution)
            if power[max(top - reach, 0) : top + reach + 1].max() > power[top] or not level < np.inf:
                continue
            place = (top + _vertex(*np.log(power[top - 1 : top + 2]).tolist())) * self.step
            if low <= place <= high:
                height = float(power[top])
                found.append(Line(place, height / level, height**0.5, chance, top))
        return found[:most]


def strokes_of(place: np.ndarray, readings: np.ndarray, begin: np.ndarray, trend: int = 2) -> Strokes:
    """Strokes of rows at `place` (m,) with readings (m, g), NaN where missing; begin as in `Strokes`."""
    origin, weight = np.empty(len(place)), np.empty(len(place))
    flat, extents = np.empty_like(readings), []
    seen = np.isfinite(readings)
    for first, last in zip(begin[:-1].tolist(), begin[1:].tolist(), strict=True):
        rows = slice(first, last)
        x = place[rows]
        start, extent = float(x.min()), float(np.ptp(x))
        at = (x - start) / extent
        taper = np.sin(np.pi * at) ** 2 * np.abs(slope(x))
        basis = np.polynomial.legendre.legvander(2 * at - 1, trend)
        flat[rows] = _less_trend(basis, taper, readings[rows], seen[rows])
        origin[rows], weight[rows] = start, taper
        extents.append(extent)
    return Strokes(place, flat, seen, weight, begin, origin, min(extents))


def spectrum_of(strokes: Strokes, step: float, size: int) -> Spectrum:
    """Spectrum on a grid of `size` points (a power of two), `step` apart, of each stroke and gauge."""
    gauges, count = strokes.readings.shape[1], len(strokes.begin) - 1
    at = (strokes.place - strokes.origin) / step
    cell = at.astype(int)
    share = (at - cell)[:, None]
    stroke = np.repeat(np.arange(count), np.diff(strokes.begin))
    index = ((stroke * gauges)[:, None] + np.arange(gauges)) * size + np.minimum(cell, size - 2)[:, None]
    values = strokes.weight[:, None] * strokes.readings
    total = count * gauges * size
    grid = np.bincount(index.ravel(), ((1 - share) * values).ravel(), total)
    grid += np.bincount(index.ravel() + 1, (share * values).ravel(), total)
    from scipy.fft import rfft

    transform = rfft(grid.reshape(count, gauges, size))
    power = (transform.real**2 + transform.imag**2).sum(axis=0)
    # Spreading a sample over two grid points is a convolution with a triangle, whose transform is sinc squared.
    power = power / np.sinc(np.arange(power.shape[1]) / size) ** 4
    resolution = size * step / strokes.extent
    own = np.median(power[:, int(resolution) :: max(int(resolution), 1)], axis=1)
    own = np.where(own > 1e-12 * own.max(), own, np.inf)
    shown = max(int(np.isfinite(own).sum()), 1)
    return Spectrum(np.maximum(((1 / own) @ power) / shown, 1e-300), own, 1 / (size * step), resolution)


def slope(values: np.ndarray) -> np.ndarray:
    """Change (m,) from row to row of at least two: `np.gradient` of evenly spaced rows, at a fifth of its price."""
    change = np.empty_like(values)
    change[1:-1] = 0.5 * (values[2:] - values[:-2])
    change[0], change[-1] = values[1] - values[0], values[-1] - values[-2]
    return change


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


def _vertex(left: float, middle: float, right: float) -> float:
    """Where the parabola through three values has its vertex, in steps from the middle."""
    curvature = left - 2 * middle + right
    return 0.5 * (left - right) / curvature if curvature < 0 else 0.0
