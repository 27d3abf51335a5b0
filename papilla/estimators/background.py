"""The background of a spectrum beside each of its lines, from medians to the left and to the right, without a model.

Drift, rough surfaces, roll-off of the skin and white noise have no common formula, but each is smooth over a few
resolutions. The level at a line is

  ln level = (ln median_left + ln median_right) / 2,

each median taken beyond a guard that the line itself fills, so a tilt of the spectrum cancels. The probability that
noise exceeds such a level has a closed form (constant false alarm rate: Finn and Johnson 1968, RCA Review 29:414;
medians: Rohling 1983, doi:10.1109/TAES.1983.309350).
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

WIDTH, GUARD, FEWEST = 20, 2, 2
"""Largest number of cells on each side for the median, resolutions from the line to the first cell, and smallest number
of cells."""
LOWEST = 1.0
"""Resolutions from zero to the lowest cell; what lies below counts as drift."""
LOCAL = 2.0
"""Largest width of a side, relative to its distance from zero, where drift bends the spectrum."""
MEDIAN_EFFICIENCY = 0.36
"""Number of cells whose mean is as certain as a median of one cell: (ln 2)^2 for noise, times three quarters because a
taper correlates cells."""


TOGETHER = 4096  # Number of places that are examined at once


class Level(NamedTuple):
    """Expected power (m,) of noise, infinite if it is not known; cells (m,) : number of independent cells behind it, 0
    then; freedom (m,) : degrees of freedom of the chi-square distribution of the power around it, 2 for one channel."""

    power: np.ndarray
    cells: np.ndarray
    freedom: np.ndarray

    def chance(self, power) -> np.ndarray:
        """Probability (m,) that noise reaches this power (m,)."""
        # As for one channel: a cause common to all channels, such as a rough surface, acts on all of them alike.
        return (1 + power / self.power / np.maximum(self.cells, 1e-9)) ** -self.cells


def background(power: np.ndarray, at: np.ndarray, resolution: float, pooled: bool = True) -> Level:
    """The level (m,) of noise at indices `at` (m,).

    power : (n,) > 0 of a tapered spectrum, evenly from wavenumber or frequency 0. resolution : in indices. The cells
    lie whole resolutions away from the place itself, where a line at the place has no power. pooled : whether to
    estimate the degrees of freedom, because a mean of channels may have more than the two of one channel.
    """
    at = np.asarray(at, int)
    logarithm = np.append(np.log(power), np.inf)
    # One part after the other: all cells of all places of a long spectrum would take hundreds of MB.
    parts = [_around(logarithm, at[first : first + TOGETHER], resolution) for first in range(0, len(at), TOGETHER)]
    twice, known, spread = map(np.concatenate, zip(*parts, strict=True)) if parts else np.zeros((3, 0))
    own = _freedom(power, at, max(round(resolution), 1)) if pooled else np.full(len(at), 2.0)
    # Wilson and Hilferty's median of a chi-square over its mean.
    level = np.exp(twice / 4) / (1 - 2 / (9 * own)) ** 3
    return Level(np.where(known, level, np.inf), np.where(known, 4 * MEDIAN_EFFICIENCY / spread, 0.0), own)


def _around(logarithm: np.ndarray, at: np.ndarray, resolution: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For places (m,): twice the sum of the medians of ln power on both sides; whether there are enough cells; and the
    sum of the inverse numbers of cells. logarithm (n + 1,) : infinite in its last place."""
    width = np.clip(LOCAL * at / resolution, 2 * FEWEST, WIDTH)[:, None]
    steps = np.arange(WIDTH)
    offsets = np.round((GUARD + steps) * resolution).astype(int)
    # (2, m, cells): both sides of each place.
    places = at[:, None] + np.multiply.outer((-1, 1), offsets)[:, None]
    seen = (steps < width) & (places >= round(LOWEST * resolution)) & (places < len(logarithm) - 1)
    values = np.sort(logarithm[np.where(seen, places, -1)], axis=-1)
    count = seen.sum(axis=-1)
    sides, rows = np.arange(2)[:, None], np.arange(len(at))
    twice = values[sides, rows, np.maximum(count - 1, 0) // 2] + values[sides, rows, count // 2]
    return twice.sum(axis=0), (count >= FEWEST).all(axis=0), (1 / np.maximum(count, 1)).sum(axis=0)


def _freedom(power: np.ndarray, at: np.ndarray, stride: int) -> np.ndarray:
    """Degrees of freedom (m,), 2 to 1000, around indices `at`, from the differences of the logarithm."""
    from scipy.ndimage import median_filter

    logarithm = np.log(power[::stride])
    if len(logarithm) < 2 * WIDTH:
        return np.full(len(at), 2.0)
    # A taper correlates neighbours.
    steps = np.abs(logarithm[GUARD:] - logarithm[:-GUARD])
    values, spreads = _spreads()
    seen = np.pad(median_filter(steps, 2 * WIDTH + 1, mode="mirror"), (GUARD, 0), mode="edge")
    return np.interp(-seen[np.minimum(at // stride, len(seen) - 1)], -spreads, values)


@lru_cache(maxsize=1)
def _spreads() -> tuple[np.ndarray, np.ndarray]:
    """Degrees of freedom, and the median |difference| of two logarithms of such a chi-square."""
    from scipy.stats import f

    values = np.geomspace(2, 1000, 60)
    return values, np.log(f.ppf(0.75, values, values))
