"""The background of a spectrum beside each of its lines, without a model: medians to the left and to the right.

Drift, rough surfaces, roll-off of the skin and white noise have no common formula, but each is smooth over a few
resolutions. The level beside a line is the mean of the logarithms of two medians, one on each side of a guard that the
line itself fills: a tilt cancels. How often such a level is exceeded by chance is known in closed form (constant false
alarm rate: Finn and Johnson 1968, RCA Review 29:414; medians: Rohling 1983, doi:10.1109/TAES.1983.309350).
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

WIDTH, GUARD, FEWEST = 20, 2, 2
"""Cells on each side whose median is taken at most, resolutions from the line to the first, and the fewest cells."""
LOWEST = 1.0
"""Resolutions from zero to the lowest cell; below is what is taken for drift."""
LOCAL = 2.0
"""A side is no wider than this part of the distance from zero, where drift bends the spectrum."""
MEDIAN_EFFICIENCY = 0.36
"""Cells whose mean knows as much as a median of one: (ln 2)^2 for noise, and three quarters, as a taper ties them."""


TOGETHER = 4096  # Places that are looked at at once


class Level(NamedTuple):
    """Expected power (m,) of noise, infinite where it cannot be told; cells (m,) of certainty that it rests on, 0 then;
    freedom (m,) : degrees of the chi-square that the power there follows around it, 2 for one channel."""

    power: np.ndarray
    cells: np.ndarray
    freedom: np.ndarray

    def chance(self, power) -> np.ndarray:
        """Probability (m,) that noise reaches this power (m,)."""
        # As for one channel: what all of them feel, as the roughness of a surface, they feel alike.
        return (1 + power / self.power / np.maximum(self.cells, 1e-9)) ** -self.cells


def background(power: np.ndarray, at: np.ndarray, resolution: float, pooled: bool = True) -> Level:
    """The level (m,) of noise at indices `at` (m,).

    power : (n,) > 0 of a tapered spectrum, evenly from wavenumber or frequency 0. resolution : in indices. The cells
    lie whole resolutions from the place itself, where a line there has no power. pooled : its freedom is looked for, as
    the mean of channels may have more than the two of one.
    """
    at = np.asarray(at, int)
    logarithm = np.append(np.log(power), np.inf)
    # A part after the other: all cells of all places of a long spectrum would take hundreds of MB.
    parts = [_around(logarithm, at[first : first + TOGETHER], resolution) for first in range(0, len(at), TOGETHER)]
    twice, known, spread = map(np.concatenate, zip(*parts, strict=True)) if parts else np.zeros((3, 0))
    own = _freedom(power, at, max(round(resolution), 1)) if pooled else np.full(len(at), 2.0)
    # Wilson and Hilferty's median of a chi-square over its mean.
    level = np.exp(twice / 4) / (1 - 2 / (9 * own)) ** 3
    return Level(np.where(known, level, np.inf), np.where(known, 4 * MEDIAN_EFFICIENCY / spread, 0.0), own)


def _around(logarithm: np.ndarray, at: np.ndarray, resolution: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of places (m,): twice the sum of the medians of the cells on both sides; whether there are enough cells; and the
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
    # A taper ties neighbours together.
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
