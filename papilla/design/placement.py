"""Optimal places of gauges: greedy choice and exchange among all places, for the smallest sigma of ln E.

A touch has six unknowns: ln E, ln force, friction, the place in x and y, and creep. A gauge with slopes a (by the
unknowns) and its own variance d (noise, zero, gain, calibration) adds a a' / d to the information matrix M. Sigma of ln
E is the root of (M^-1)_00, and a further gauge reduces (M^-1)_00 by

    (M^-1 a)_0^2 / (d + a' M^-1 a)        (Sherman and Morrison 1950, doi:10.1214/aoms/1177729893):

so all candidates are evaluated at once. The criterion is the mean of sigma squared over the touches of the scene. Foils
must not overlap. On small grids greedy choice and exchange find the same sets as an exhaustive search; on large grids
that has not been tested.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from papilla.design.influence import Influence
from papilla.design.scene import Scene
from papilla.design.touch import PRIOR
from papilla.estimators.softness.touch import RULES
from papilla.fem.pressing.large_strain import CONTINUED_GAUGE

EXCHANGES = 20
"""Largest number of rounds of exchange; two or three are usual."""
STARTS = 14
"""Number of candidates for the next gauge from which exchange starts, spread from the best to the worst: started from
the best alone, it missed the optimum in one of 24 small problems."""
GAUGE_ERROR = 0.004
"""Relative one sigma of a gauge in a calibration: mesh scatter, fit and large strain are 0.3 to 0.4 % of it on the
default finger at 0.2 to 0.98 N."""
FRICTION = 0.5
"""One sigma of friction, relative to the change without friction: two sigmas reach from stick to none."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Candidates of a scene: slopes (p, k, 6), own variances (p, k), information without gauges (p, 6, 6), and overlaps
    of foils (k, k)."""

    slopes: np.ndarray
    variance: np.ndarray
    prior: np.ndarray
    overlap: np.ndarray

    def sigma(self, chosen: list[int]) -> float:
        """Root mean square sigma of ln E with the chosen candidates."""
        return float(np.sqrt(self._inverse(chosen)[:, 0, 0].mean()))

    def better(self, chosen: list[int]) -> np.ndarray:
        """(k,) mean sigma squared with one more candidate; infinite if its foil overlaps a chosen one."""
        inverse = self._inverse(chosen)
        moved = self.slopes @ inverse
        gain = moved[:, :, 0] ** 2 / (self.variance + np.einsum("pki,pki->pk", moved, self.slopes))
        after = (inverse[:, 0, 0][:, None] - gain).mean(axis=0)
        return np.where(self.overlap[chosen].any(axis=0), np.inf, after) if chosen else after

    def _inverse(self, chosen: list[int]) -> np.ndarray:
        slopes = self.slopes[:, chosen]
        information = self.prior + np.einsum("pki,pkj,pk->pij", slopes, slopes, 1 / self.variance[:, chosen])
        return np.linalg.inv(information)


def problem(found: Influence, scene: Scene, *, friction: bool = True, place: bool = True) -> Problem:
    """The problem of a scene; friction, place : whether each is unknown."""
    doubts = scene.unknown.doubts
    by_modulus, by_force, free, x, y = found.slopes
    slopes = np.stack([by_modulus, by_force, free, x, y, found.reading], axis=2)
    # A gain error is proportional to the reading; noise averages over the samples; a zero that was measured in the air
    # is known better than one that was not, but drifts.
    own = (GAUGE_ERROR**2 + CONTINUED_GAUGE**2 + doubts.gauge_gain**2) * found.reading**2
    own = own + scene.gauge_noise_microstrain**2 / scene.samples + (RULES.air_share * doubts.zero_microstrain) ** 2
    offset = (RULES.air_share * doubts.force_offset_N) ** 2 + scene.force_noise_N**2 / scene.samples
    force = doubts.force_gain**2 + offset / found.force_N**2
    # A known unknown has a sigma of nearly zero instead of one column less.
    nothing = 1e-9
    sigmas = np.tile(
        [PRIOR, 0.0, FRICTION * friction, scene.place_mm * place, scene.place_mm * place, doubts.creep], (len(force), 1)
    )
    sigmas[:, 1] = np.sqrt(force)
    prior = np.einsum("pi,ij->pij", 1 / np.maximum(sigmas, nothing) ** 2, np.eye(6))
    apart = np.linalg.norm(found.sites[:, None] - found.sites, axis=2)
    return Problem(slopes, own, prior, apart < found.gauges[0].backing_mm[0] - 1e-6)


def place(one: Problem, count: int, among: np.ndarray | None = None) -> list[list[int]]:
    """The chosen candidates for 1 to `count` gauges, or as many as fit. among : (k,) allowed candidates."""
    allowed = np.ones(one.overlap.shape[0], bool) if among is None else among
    chosen: list[int] = []
    found = []
    for _ in range(count):
        after = np.where(allowed, one.better(chosen), np.inf)
        if not np.isfinite(after).any():
            break
        starts = [k for k in after.argsort(kind="stable")[:: max(1, len(after) // STARTS)] if np.isfinite(after[k])]
        tried = [exchanged(one, [*chosen, int(k)], allowed) for k in starts]
        chosen = min(tried, key=one.sigma)
        found.append(sorted(chosen))
    return found


def exchanged(one: Problem, chosen: list[int], allowed: np.ndarray) -> list[int]:
    """A choice after every gauge in turn was moved to its best place, until none moves."""
    for _ in range(EXCHANGES):
        before = list(chosen)
        for k in range(len(chosen)):
            others = chosen[:k] + chosen[k + 1 :]
            after = np.where(allowed, one.better(others), np.inf)
            best = int(after.argmin())
            if after[best] < after[chosen[k]] * (1 - 1e-12):
                chosen = [*chosen[:k], best, *chosen[k + 1 :]]
        if chosen == before:
            break
    return chosen


def brute_force(one: Problem, count: int) -> list[int]:
    """The best of all sets, by exhaustive search; for small grids."""
    sets = (list(s) for s in combinations(range(one.overlap.shape[0]), count))
    free = (s for s in sets if not any(one.overlap[a, b] for a, b in combinations(s, 2)))
    return min(free, key=one.sigma)
