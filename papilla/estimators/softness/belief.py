"""What is known of a touch, and what one slot of its samples says: the values that the fitter passes about."""

import math
from typing import NamedTuple

import numpy as np

from papilla.estimators.softness.contrast import Contrast

BENT_PLACE = 0.2
"""A mm of place bends the readings like so much of ln force."""
LEVEL, FAR, JITTER = 0.05, 3.0, 6.0
"""Squared step of ln force times the greatest whitened reading within which the samples of a slot lie; a tangent holds
for steps so many times longer; and the standard deviations by which noise alone may move a sample."""


class Tangent(NamedTuple):
    """What samples read near a contact, noise apart: what the channels `rows` (k,) of a sample differ by from expected
    (k,), whitened, `split` (own + k, k) makes the steps to its own ln force and place, and the rest that no contact
    explains.

    at : ln force and place; jitter : standard deviations of the steps; bent : step of ln force that bends the readings
    by the noise of one.
    """

    rows: np.ndarray
    expected: np.ndarray
    split: np.ndarray
    at: tuple[float, float]
    jitter: tuple[float, ...]
    bent: float

    def level(self, steps: list[float], others: list[float], reach: float = 1.0) -> bool:
        """Whether the readings are straight between two contacts, as far as noise tells their steps."""
        return all([
            abs(one - other) < reach * (LEVEL**0.5 * self.bent * scale + JITTER * sigma)
            for one, other, sigma, scale in zip(steps, others, self.jitter, (1.0, 1 / BENT_PLACE), strict=False)
        ])  # fmt: skip


class Belief(NamedTuple):
    """All that is known of a touch. mean (m,), covariance (m, m) of h and theta; node, slopes (c + 1, m): where (ln
    force, place, h) H is taken; offset: by how much ln force and place of the filter differ from those of noise alone.

    Of noise alone: ln_force, place_mm: of the last slot; tangent: what samples near it read; information, score,
    square: for h - anchor; freedom: degrees of freedom of `square`; samples: how many were learnt.
    """

    mean: np.ndarray
    covariance: np.ndarray
    tangent: Tangent | None = None
    node: tuple[float, float, float] = (math.nan, 0.0, 0.0)
    slopes: np.ndarray | None = None
    offset: tuple[float, float] = (0.0, 0.0)
    place_sigma_mm: float = 0.0
    ln_force: float = 0.0
    place_mm: float = 0.0
    anchor: float = 0.0
    information: float = 0.0
    score: float = 0.0
    square: float = 0.0
    freedom: float = 0.0
    samples: float = 0.0


class Fit(NamedTuple):
    """A mean of some samples against a belief: first and last linearisation's contrast, the belief with its H and
    P H' there, ln force and place, and the standard deviation of that."""

    first: Contrast
    last: Contrast
    belief: Belief
    PH: np.ndarray
    samples: int
    ln_force: float
    place_mm: float
    place_sigma_mm: float


class Alone(NamedTuple):
    """A mean of `samples` with which nothing is wrong but noise: information, score and square of h - anchor, the
    square at the best h so far, degrees of freedom, ln force and place, and the tangent there."""

    information: float
    score: float
    square: float
    here: float
    own: int
    ln_force: float
    place_mm: float
    samples: int = 1
    tangent: Tangent | None = None


class Linear(NamedTuple):
    """Whitened channels at a contact: expected (c + 1,), slopes H (c + 1, m) in h and theta, B (c + 1, own) in ln force
    and place."""

    expected: np.ndarray
    H: np.ndarray
    B: np.ndarray
