"""The friction of one direction: the mean of steady sliding, its scatter, outliers and changes, and the breakaway."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from papilla.estimators.friction.offset import MEMORY_BLOCKS, BlockMeans, Stroke

PRIOR_MU_SCATTER, SCATTER_BLOCKS = 0.04, 4.0
"""Prior relative scatter of mu from block to block, and the number of blocks that this prior counts as."""
LEAST_SCATTER = 1e-3
"""Smallest relative scatter of mu: the linearity of a good force sensor."""
OUTLIER_SCATTERS, CHANGE_BLOCKS = 5.0, 3
"""A block that is OUTLIER_SCATTERS scatters away from the mean is an outlier; CHANGE_BLOCKS consecutive outliers are a
change of friction."""
SLOW_BLOCKS = 100.0
"""Number of blocks over which the slow mean of mu is taken."""
BREAKAWAY_MEDIAN_SAMPLES = 5
"""Number of samples whose median is a candidate for the peak of a breakaway, so that a single faulty sample cannot be
one."""


class Peak(NamedTuple):
    """Pull and normal force in N at the moment when a start pulls most, by the `ratio` minus its noise; and the pull's
    sigma."""

    ratio: float = -math.inf
    pull: float = math.nan
    normal: float = math.nan
    sigma: float = 0.0


@dataclass
class Direction:
    """One direction, s = 1 or -1.

    pull, normal : means of s T and N, over `blocks` since the last change. variance : of a block's mu about the mean;
    error : deviation of the last block; age : time of sliding since then, s. log_normal, log_variance : mean and
    variance of ln N. slow_mu : slow mean of mu. stroke : sums over the last stroke. outliers : (s T, N) of the last
    blocks, if they contradict the mean. peak : of the present start; breakaway : of the last start.
    """

    s: int
    pull: float = 0.0
    normal: float = 1.0
    blocks: float = 0.0
    variance: float = 0.0
    error: float = 0.0
    age: float = 0.0
    log_normal: float = 0.0
    log_variance: float = 0.0
    slow_mu: float = 0.0
    stroke: Stroke = Stroke()
    outliers: tuple[tuple[float, float], ...] = ()
    peak: Peak = Peak()
    breakaway: Peak = Peak()

    def mu(self, offset: float) -> float:
        """The kinetic coefficient with this offset."""
        return (self.pull - self.s * offset) / self.normal

    def take(self, block: BlockMeans, samples: int, offset: float, gain: float) -> bool | None:
        """Take a block of `samples` samples, with at least this gain. Returns True if it was learnt, None if it was
        left out because it contradicts the mean, and False if it was the third such block in a row, so that the means
        begin again."""
        taken, mu = [(self.s * block.tangential, block.normal)], self.mu(offset)
        error = self.s * (block.tangential - offset) / block.normal - mu
        outlier = self.blocks and error**2 > OUTLIER_SCATTERS**2 * (self.variance + (LEAST_SCATTER * mu) ** 2)
        self.outliers = (*self.outliers, *taken) if outlier else ()
        if 0 < len(self.outliers) < CHANGE_BLOCKS:
            return None
        # Three in a row agree that the friction changed: forget the mean, and begin with these three.
        if changed := bool(self.outliers):
            taken, self.outliers, self.blocks = list(self.outliers), (), 0.0
        for pull, normal in taken:
            self._learn(pull, normal, block.noise**2 / samples, offset, gain)
        return not changed

    def _learn(self, pull: float, normal: float, noise: float, offset: float, gain: float) -> None:
        mu, log = (pull - self.s * offset) / normal, math.log(normal)
        if not self.blocks:
            self.pull, self.normal, self.log_normal, self.slow_mu = pull, normal, log, self.slow_mu or mu
            self.variance = max(self.variance, (PRIOR_MU_SCATTER * mu) ** 2 + noise / normal**2)
        # Scatter is a slow mean that begins with its prior; mu is a fast one with `gain`, but a plain mean at first.
        self.blocks = min(self.blocks + 1, MEMORY_BLOCKS)
        share, gain = 1 / (SCATTER_BLOCKS + self.blocks), max(gain, 1 / self.blocks)
        self.variance += share * ((mu - self.mu(offset)) ** 2 - self.variance)
        self.log_variance += share * ((log - self.log_normal) ** 2 - self.log_variance)
        self.log_normal += share * (log - self.log_normal)
        self.slow_mu += (mu - self.slow_mu) / SLOW_BLOCKS
        # T and N are averaged apart, without the offset, so that mu follows at once when the offset is known better.
        self.pull += gain * (pull - self.pull)
        self.normal += gain * (normal - self.normal)
        self.error, self.age = mu - self.mu(offset), 0.0
        ratio, inverse, logs, spread, blocks = self.stroke
        ratio, inverse, blocks = ratio + pull / normal, inverse + 1 / normal, blocks + 1
        spread += (mu - (ratio - self.s * offset * inverse) / blocks) ** 2
        self.stroke = Stroke(ratio, inverse, logs + log, spread, blocks)

    def start(self, window: np.ndarray, noise: float, offset: float, least_N: float) -> None:
        """Keep the moment when a start pulls most, from samples (n, 3): medians of five, minus twice the noise, over
        the force."""
        half = BREAKAWAY_MEDIAN_SAMPLES // 2
        normal = np.maximum(window[half : len(window) - half, 1], least_N)
        pulls = np.sort(self.s * sliding_window_view(window[:, 0], BREAKAWAY_MEDIAN_SAMPLES), axis=1)
        middle, spread = pulls[:, half], pulls[:, -1] - pulls[:, half]
        ratios = (middle - 2 * noise - self.s * offset) / normal
        best = int(ratios.argmax())
        # A peak of few samples is higher than the median, by about half of their spread.
        peak = Peak(*(float(values[best]) for values in (ratios, middle + spread / 2, normal, spread)))
        self.peak = max(self.peak, peak)
