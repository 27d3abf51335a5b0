"""What is known of the friction in one direction: its kinetic coefficient, look by look, and its last breakaway."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from papilla.estimators.friction.offset import EXPONENT, Look, Stroke

SCATTER, SCATTER_LOOKS, MEMORY_LOOKS = 0.04, 4.0, 25.0
"""Relative scatter of mu from look to look that is taken for granted, the looks that this counts for, and those over
which scatter is averaged."""
LEAST_SCATTER = 1e-3
"""Relative scatter of mu that no force sensor is better than: its own linearity."""
WANDER = 0.03
"""Relative standard deviation by which mu may be another after 1 s of sliding; it grows with the root of the time."""
GATE, CHANGE_LOOKS = 5.0, 3
"""Scatters from which a look contradicts the mean; contradicting looks in a row that are a change of friction."""
USUAL_LOOKS = 100.0
"""Looks that the usual mu is a mean over."""
MEDIAN = 5
"""Samples whose median is a candidate for the peak of a breakaway: no single fault is one."""
_FIVES = np.arange(MEDIAN)


class Peak(NamedTuple):
    """Pull and normal force in N where a start pulls most, by their `ratio` less its noise; and the pull's sigma."""

    ratio: float = -math.inf
    pull: float = math.nan
    normal: float = math.nan
    sigma: float = 0.0


@dataclass
class Way:
    """One direction, s = 1 or -1.

    pull, normal : means of s T and N, from `looks` since the last change. variance : of a look's mu about the mean;
    off : the last one's deviation; age : sliding since then, s. log_normal, log_variance : mean and variance of ln N.
    usual : slow mean of mu. stroke : the last stroke. odd : (s T, N) of the last looks, if they contradict the mean.
    peak : of the start that goes on; breakaway : of the last start.
    """

    s: int
    pull: float = 0.0
    normal: float = 1.0
    looks: float = 0.0
    variance: float = 0.0
    off: float = 0.0
    age: float = 0.0
    log_normal: float = 0.0
    log_variance: float = 0.0
    usual: float = 0.0
    stroke: Stroke = Stroke()
    odd: tuple[tuple[float, float], ...] = ()
    peak: Peak = Peak()
    breakaway: Peak = Peak()

    def mu(self, offset: float) -> float:
        """The kinetic coefficient with this offset."""
        return (self.pull - self.s * offset) / self.normal

    def model_variance(self, mu: float) -> float:
        """Of mu, the offset apart: scatter, lag behind a change, force and time since the last look."""
        relative = LEAST_SCATTER**2 + EXPONENT**2 * self.log_variance + WANDER**2 * self.age
        return self.variance + self.off**2 + relative * mu**2

    def take(self, look: Look, samples: int, offset: float, gain: float) -> bool | None:
        """A look of so many samples, which counts with at least this gain: True where it was learnt, None where it is
        left out because it contradicts the mean, False where the third such look in a row began the means anew."""
        taken, mu = [(self.s * look.tangential, look.normal)], self.mu(offset)
        off = self.s * (look.tangential - offset) / look.normal - mu
        odd = self.looks and off**2 > GATE**2 * (self.variance + (LEAST_SCATTER * mu) ** 2)
        self.odd = (*self.odd, *taken) if odd else ()
        if 0 < len(self.odd) < CHANGE_LOOKS:
            return None
        if changed := bool(self.odd):
            taken, self.odd, self.looks = list(self.odd), (), 0.0
        for pull, normal in taken:
            self._learn(pull, normal, look.noise**2 / samples, offset, gain)
        return not changed

    def _learn(self, pull: float, normal: float, noise: float, offset: float, gain: float) -> None:
        own, log = (pull - self.s * offset) / normal, math.log(normal)
        if not self.looks:
            self.pull, self.normal, self.log_normal, self.usual = pull, normal, log, self.usual or own
            self.variance = max(self.variance, (SCATTER * own) ** 2 + noise / normal**2)
        self.looks = min(self.looks + 1, MEMORY_LOOKS)
        share, gain = 1 / (SCATTER_LOOKS + self.looks), max(gain, 1 / self.looks)
        self.variance += share * ((own - self.mu(offset)) ** 2 - self.variance)
        self.log_variance += share * ((log - self.log_normal) ** 2 - self.log_variance)
        self.log_normal += share * (log - self.log_normal)
        self.usual += (own - self.usual) / USUAL_LOOKS
        self.pull += gain * (pull - self.pull)
        self.normal += gain * (normal - self.normal)
        self.off, self.age = own - self.mu(offset), 0.0
        ratio, inverse, logs, spread, looks = self.stroke
        ratio, inverse, looks = ratio + pull / normal, inverse + 1 / normal, looks + 1
        spread += (own - (ratio - self.s * offset * inverse) / looks) ** 2
        self.stroke = Stroke(ratio, inverse, logs + log, spread, looks)

    def start(self, window: np.ndarray, noise: float, offset: float, least_N: float) -> None:
        """Keep where a start pulls most, of samples (n, 3): medians of five, less twice the noise, over the force."""
        normal = np.maximum(window[MEDIAN // 2 : len(window) - MEDIAN // 2, 1], least_N)
        pulls = np.sort(self.s * window[:, 0][_FIVES + np.arange(len(normal))[:, None]], axis=1)
        middle, spread = pulls[:, MEDIAN // 2], pulls[:, -1] - pulls[:, MEDIAN // 2]
        ratios = (middle - 2 * noise - self.s * offset) / normal
        best = int(ratios.argmax())
        # A peak of few samples is higher than the median, by about half of their spread.
        peak = Peak(*(float(values[best]) for values in (ratios, middle + spread / 2, normal, spread)))
        self.peak = max(self.peak, peak)
