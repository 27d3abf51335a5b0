"""Values that the fitter passes on: the state of a touch, and what one slot of its samples adds."""

from typing import NamedTuple

import numpy as np

from papilla.estimators.spread import Pieces

BENT_PLACE = 0.2
"""A step of 1 mm bends the readings as much as a step of ln force by this much."""
ODD = 20.0
"""If the squared misfit of a sample is this many times the average one, the sample is examined alone."""


class Linear(NamedTuple):
    """Whitened channels near a contact at (ln force, place in mm, h, thickness in its standard deviations): expected
    (c + 1,), slopes H (c + 1, m) in h and theta, B (2, c + 1) in the sample's own ln force and place, each in units of
    its spread (a place that is known has none)."""

    at: tuple[float, float, float, float]
    expected: np.ndarray
    H: np.ndarray
    B: np.ndarray


class Tangent(NamedTuple):
    """Linear model, for the channels `rows`, of samples near a contact: `split` (2 + k, k) times a sample's, less
    `origin`, gives the steps to its own ln force and place, and the whitened residual (k,) that no contact explains.

    reach : (lowest, highest) of each step for which the model holds; slack : largest difference of each step within a
    slot.
    """

    linear: Linear
    rows: np.ndarray
    split: np.ndarray
    origin: np.ndarray
    reach: tuple[tuple[float, float], ...]
    slack: tuple[float, ...]

    def steps(self, y: np.ndarray, reach, usual: float) -> tuple[float, float] | None:
        """Steps to a sample (c + 1,). None if the tangent does not hold for it: steps beyond `reach`, or a squared
        residual above the usual."""
        force, place, *rest = (self.split @ y[self.rows] - self.origin).tolist()
        (low, high), (left, right) = reach
        within = low <= force <= high and left <= place <= right
        return (force, place) if within and sum([one * one for one in rest]) <= usual else None

    def about(self, steps: tuple[float, float]) -> tuple[tuple[float, float], ...]:
        """The part of `reach` for samples that share a slot with a first sample, given by its steps."""
        each = zip(steps, self.slack, self.reach, strict=True)
        return tuple([(max(low, step - slack), min(high, step + slack)) for step, slack, (low, high) in each])


class FilterState(NamedTuple):
    """Everything known of a touch. mean (m,), covariance (m, m) of h and theta; pressed: number of samples learnt in
    each cell of force; node: contact at which the slopes (c + 1, m) are evaluated; offset: difference of ln force and
    place between the filter and the fit of noise alone.

    For the fit of noise alone: ln_force, place_mm: of the last slot; linear: the linearisation near it; information,
    score, square: of the least squares for h - anchor; freedom: degrees of freedom of `square`; samples: number learnt.
    """

    mean: np.ndarray
    covariance: np.ndarray
    pressed: np.ndarray
    linear: Linear | None = None
    node: Linear | None = None
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

    @property
    def usual(self) -> float:
        """Largest squared misfit of a sample that agrees with those before."""
        return ODD * (1 + self.square / max(self.freedom, 1.0))


class Residuals(NamedTuple):
    """Residuals r of channels, with covariance S = H P H' + B B' + R: weighted (k,) = S^-1 r, precision (k, k) = S^-1,
    rows (k,) : numbers of the channels, misfit = r' S^-1 r."""

    weighted: np.ndarray
    precision: np.ndarray
    rows: np.ndarray
    misfit: float

    def misfits_without(self, sets: list[tuple[int, ...]]) -> Pieces[list[float]]:
        """Misfits of the other channels when each of some sets of channels is left out, computed in one piece."""
        yield
        places = [np.searchsorted(self.rows, own) for own in sets]
        return (self.misfit - shares_of(self.weighted, self.precision, places)).tolist()

    def expected(self, *rows: int) -> tuple[np.ndarray, np.ndarray]:
        """Difference of these channels from what the others predict, and its variance (whitened)."""
        at = np.searchsorted(self.rows, rows)
        covariance = np.linalg.inv(self.precision[np.ix_(at, at)])
        return covariance @ self.weighted[at], np.diag(covariance)


def shares_of(weighted: np.ndarray, precision: np.ndarray, sets: list[np.ndarray]) -> np.ndarray:
    """(..., s) part of the squared misfits that disappears when each of s sets of channels is left out: weighted (...,
    k), precision (..., k, k)."""
    shares = np.empty((*weighted.shape[:-1], len(sets)))
    for size in {len(own) for own in sets}:
        which = [number for number, own in enumerate(sets) if len(own) == size]
        at = np.array([sets[number] for number in which])
        own = weighted[..., at]
        solved = np.linalg.solve(precision[..., at[:, :, None], at[:, None]], own[..., None])[..., 0]
        shares[..., which] = (own * solved).sum(axis=-1)
    return shares


class NoiseFit(NamedTuple):
    """Fit of a mean of `samples` under the assumption that only noise is present: information, score and square of h -
    anchor, the square at the best h so far (here), degrees of freedom (own), ln force and place, and the linearisation
    used."""

    information: float
    score: float
    square: float
    here: float
    own: int
    ln_force: float
    place_mm: float
    samples: int
    linear: Linear
