"""State of the friction in one direction: its kinetic coefficient, block by block, and its last breakaway."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from papilla.estimators.friction.offset import EXPONENT, Block, Stroke

SCATTER, SCATTER_BLOCKS, MEMORY_BLOCKS = 0.04, 4.0, 25.0
"""Prior relative scatter of mu from block to block, the number of blocks that this prior counts as, and the number of
blocks over which scatter is averaged."""
LEAST_SCATTER = 1e-3
"""Smallest relative scatter of mu: the linearity of a good force sensor."""
WANDER = 0.03
"""Relative standard deviation of the change of mu in 1 s of sliding; it grows with the root of the time."""
GATE, CHANGE_BLOCKS = 5.0, 3
"""A block that is GATE scatters away from the mean is an outlier; CHANGE_BLOCKS consecutive outliers are a change of
friction."""
SLOW_BLOCKS = 100.0
"""Number of blocks over which the slow mean of mu is taken."""
MEDIAN = 5
"""Number of samples whose median is a candidate for the peak of a breakaway, so that a single faulty sample cannot be
one."""
_FIVES = np.arange(MEDIAN)


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

    def model_variance(self, mu: float) -> float:
        """Variance of mu without the part of the offset: scatter, lag behind a change, force, and time since the last
        block."""
        relative = LEAST_SCATTER**2 + EXPONENT**2 * self.log_variance + WANDER**2 * self.age
        return self.variance + self.error**2 + relative * mu**2

    def take(self, block: Block, samples: int, offset: float, gain: float) -> bool | None:
        """Take a block of `samples` samples, with at least this gain. Returns True if it was learnt, None if it was
        left out because it contradicts the mean, and False if it was the third such block in a row, so that the means
        begin again."""
        taken, mu = [(self.s * block.tangential, block.normal)], self.mu(offset)
        error = self.s * (block.tangential - offset) / block.normal - mu
        outlier = self.blocks and error**2 > GATE**2 * (self.variance + (LEAST_SCATTER * mu) ** 2)
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
        own, log = (pull - self.s * offset) / normal, math.log(normal)
        if not self.blocks:
            self.pull, self.normal, self.log_normal, self.slow_mu = pull, normal, log, self.slow_mu or own
            self.variance = max(self.variance, (SCATTER * own) ** 2 + noise / normal**2)
        # Scatter is a slow mean that begins with its prior; mu is a fast one with `gain`, but a plain mean at first.
        self.blocks = min(self.blocks + 1, MEMORY_BLOCKS)
        share, gain = 1 / (SCATTER_BLOCKS + self.blocks), max(gain, 1 / self.blocks)
        self.variance += share * ((own - self.mu(offset)) ** 2 - self.variance)
        self.log_variance += share * ((log - self.log_normal) ** 2 - self.log_variance)
        self.log_normal += share * (log - self.log_normal)
        self.slow_mu += (own - self.slow_mu) / SLOW_BLOCKS
        # T and N are averaged apart, without the offset, so that mu follows at once when the offset is known better.
        self.pull += gain * (pull - self.pull)
        self.normal += gain * (normal - self.normal)
        self.error, self.age = own - self.mu(offset), 0.0
        ratio, inverse, logs, spread, blocks = self.stroke
        ratio, inverse, blocks = ratio + pull / normal, inverse + 1 / normal, blocks + 1
        spread += (own - (ratio - self.s * offset * inverse) / blocks) ** 2
        self.stroke = Stroke(ratio, inverse, logs + log, spread, blocks)

    def start(self, window: np.ndarray, noise: float, offset: float, least_N: float) -> None:
        """Keep the moment when a start pulls most, from samples (n, 3): medians of five, minus twice the noise, over
        the force."""
        normal = np.maximum(window[MEDIAN // 2 : len(window) - MEDIAN // 2, 1], least_N)
        pulls = np.sort(self.s * window[:, 0][_FIVES + np.arange(len(normal))[:, None]], axis=1)
        middle, spread = pulls[:, MEDIAN // 2], pulls[:, -1] - pulls[:, MEDIAN // 2]
        ratios = (middle - 2 * noise - self.s * offset) / normal
        best = int(ratios.argmax())
        # A peak of few samples is higher than the median, by about half of their spread.
        peak = Peak(*(float(values[best]) for values in (ratios, middle + spread / 2, normal, spread)))
        self.peak = max(self.peak, peak)
