"""One Kalman filter for every kind of softness: the modulus of a touch, and every unknown error that is constant during
the touch.

State x = (h, theta) with mean and covariance P, constant during a touch. h is a scale of ln E on which readings change
along straight lines; theta are the `Doubts`, the zeros of the gauges and the errors of the calibration, each in its
standard deviations. A sample of readings and force, divided by its noise and linearised at its own contact, is

    y = r + H x + B l + noise,   S = H P H' + B L B' + R,   gain K = P H' / S,

where l, the sample's own force and place with covariance L, is eliminated.

Two obvious ways fail. Evaluating H at every noisy sample creates information that is not there, so H is evaluated again
only when force, place or ln E have moved by `NODE_STEPS`. And errors of gains are not independent from sample to
sample: they return whenever a force returns. So R holds an error for each cell of force, and a cell that is pressed
again adds only the information that is new (`_own_errors`).

The answer is the fit of noise alone as long as it explains the readings, because no other fit has a smaller error;
otherwise it is the filter's. Sigma is always the filter's, and grows where the gauges contradict each other
(`widening`). A linearisation costs 35 microseconds, learning a slot 100. Where readings do not change with the modulus,
sigma says so (ADR 0016, 0030).
"""

import math
from typing import NamedTuple

import numpy as np

from papilla.estimators.softness.channels import MOST_SLOT_SAMPLES, Channels, Linear
from papilla.estimators.stream import Pieces

LARGEST_LINEARISATION_BEND, LARGEST_REUSE_BEND = 0.4, 0.005
"""Both bound (step of ln force)^2 x (greatest whitened reading), the curvature that a linearisation neglects. Above the
first a sample is linearised again at its new contact; below the second the linearisation of another sample is used."""
NODE_STEPS = (0.05, 0.3, 0.3)
"""H is evaluated again after ln force, place (mm) or ln E have changed by this much. Evaluated where noise puts each
sample, H would create information that no reading holds."""
FORCE_CELL_LN, CELL_ERROR_SHARE = 0.1, 0.5
"""Gains and calibration errors differ from force to force: each cell of ln force, FORCE_CELL_LN wide, has an error of
its own, with CELL_ERROR_SHARE of their standard deviation. It is the same when the cell is pressed again: only its
noise averages out."""
SLOT_SAMPLE_SHARE = 8
"""A slot holds at most one in SLOT_SAMPLE_SHARE of the samples learnt so far: a touch that has just begun is learnt one
by one."""
MOST_GAUSS_NEWTON_STEPS = 6
"""Largest number of Gauss-Newton steps."""
SURE_MISFIT_SIGMAS, MISFIT_SLACK = 5.0, 0.05
"""Noise alone explains the readings while its mean squared misfit is below 1 + MISFIT_SLACK by at most
SURE_MISFIT_SIGMAS standard deviations: noise itself is known to some per cent only."""
STATED_SIGMA_WEIGHT = 1.0
"""Weight of the stated standard deviations in `widening`, as a number of squared errors of average size."""
PRIOR_REACH = 0.25
"""Prior standard deviation of h relative to its range: a first estimate may lie beyond the calibrated moduli."""
ODD_MISFIT_RATIO = 20.0
"""If the squared misfit of a sample is this many times the average one, the sample is examined alone."""


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
        return ODD_MISFIT_RATIO * (1 + self.square / max(self.freedom, 1.0))


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
        places = [np.searchsorted(self.rows, channels) for channels in sets]
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
    for size in {len(channels) for channels in sets}:
        which = [number for number, channels in enumerate(sets) if len(channels) == size]
        at = np.array([sets[number] for number in which])
        removed = weighted[..., at]
        solved = np.linalg.solve(precision[..., at[:, :, None], at[:, None]], removed[..., None])[..., 0]
        shares[..., which] = (removed * solved).sum(axis=-1)
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


class Fitter(Channels):
    """Fits samples (c readings, force), which `Channels` linearises."""

    def prior(self, zero_share: float) -> FilterState:
        """The filter before the first sample; `zero_share` is the part of the zeros' standard deviations that is still
        unknown."""
        mean, variance = np.zeros(self.size), np.ones(self.size)
        for name in ("the zero of the gauges", "the offset of the force"):
            variance[self.columns[name]] = zero_share**2
        # The rest of the variance belongs to the cells of force (`_own_errors`).
        variance[self._shaped] = 1 - CELL_ERROR_SHARE**2
        variance[0] = (PRIOR_REACH * self.top) ** 2
        return FilterState(mean, np.diag(variance), np.zeros(1 + int((self.high - self.low) / FORCE_CELL_LN)))

    def _own_errors(self, H: np.ndarray, pressed: np.ndarray, ln_force: float, samples: float):
        """Variances (k,) of a mean of `samples` in its cell of force, from noise and the cell's own error: the full
        ones, and those with which only new information counts if the cell was pressed before; and the cell."""
        cell = min(max(int((ln_force - self.low) / FORCE_CELL_LN), 0), len(pressed) - 1)
        before, slopes = float(pressed[cell]), H[:, self._shaped]
        cell_error = CELL_ERROR_SHARE**2 * np.einsum("km,km->k", slopes, slopes)
        plain, after = cell_error + 1 / samples, before + samples
        # Information of all samples of the cell minus that of the earlier ones.
        new = (cell_error + 1 / before) * (cell_error + 1 / after) * (before * after / samples) if before else plain
        return plain, new, cell

    def noise_fit(self, y: np.ndarray, rows: np.ndarray, posterior: FilterState, count: int = 1) -> NoiseFit:
        """Fit of a mean (c + 1,) of `count` samples of the channels `rows`, assuming noise alone: least squares for its
        own force and place; with these eliminated, the normal equation of h."""
        h, white, near = self.h_of_noise(posterior), (y * self.whiten)[rows], posterior.linear is not None
        linear = posterior.linear or self.linear(posterior.ln_force, posterior.place_mm, h)
        greatest = float(np.abs(white).max()) * math.sqrt(count)
        # Products of slope a by h, residual r, and slopes l, m by the sample's own force and place: all that the least
        # squares need, by one product of matrices.
        table = np.empty((2 + len(linear.B), len(rows)))
        for _ in range(MOST_GAUSS_NEWTON_STEPS):
            table[0] = slope = linear.H[rows, 0]
            table[1] = white - linear.expected[rows] - slope * (h - linear.at[2])
            table[2:] = linear.B[:, rows]
            (aa, ar, al, am), (_, rr, rl, rm), (_, _, ll, lm), (*_, mm) = (table @ table.T).tolist()
            # The prior of force and place, of variance 1 in these units, against the noise 1 / count of the mean.
            ll, mm = ll + 1 / count, mm + 1 / count
            det = ll * mm - lm * lm
            steps = (mm * rl - lm * rm) / det, (ll * rm - lm * rl) / det
            at, place = self.moved(linear, steps)
            limit = LARGEST_REUSE_BEND if near else LARGEST_LINEARISATION_BEND
            if self.bend(linear, at, place, h, 0.0) * greatest < limit:
                break
            linear, near = self.linear(at, place, h), False
        # Eliminate force and place (Schur complement): what is left of the information and the score belongs to h.
        to_l, to_m = (mm * al - lm * am) / det, (ll * am - lm * al) / det
        misfit = count * (rr - rl * steps[0] - rm * steps[1])
        information, score = count * (aa - to_l * al - to_m * am), count * (ar - to_l * rl - to_m * rm)
        # Sums of several slots must refer to one h, the anchor: this slot's parabola in h is moved there.
        away = h - posterior.anchor
        square = misfit + away * (2 * score + away * information)
        freedom = len(rows) - 1 - self.anywhere
        return NoiseFit(information, score + away * information, square, misfit, freedom, at, place, count, linear)

    def slot(self, posterior: FilterState) -> int:
        """Number of samples that are learnt together."""
        return min(int(posterior.samples) // SLOT_SAMPLE_SHARE, MOST_SLOT_SAMPLES)

    def weighed(self, rows, innovation, H: np.ndarray, B: np.ndarray, P: np.ndarray, R):
        """Residuals of an innovation (k,) with variances R, slopes H (k, m) and B (2, k), and covariance P (m, m) of x;
        and P H'."""
        PH = P @ H.T
        S = H @ PH + B.T @ B
        S.flat[:: len(rows) + 1] += R
        precision = np.linalg.inv(S)
        weighted = precision @ innovation
        return Residuals(weighted, precision, rows, float(innovation @ weighted)), PH

    def residuals(
        self, y: np.ndarray, rows: np.ndarray, posterior: FilterState, fit: NoiseFit | None = None
    ) -> Residuals:
        """Residuals of a mean (c + 1,) of samples of the channels `rows` against the filter. Without `fit` the sample
        may be faulty, so it is linearised at the contact of the last one."""
        white = (y * self.whiten)[rows]
        linear = self._first(white, posterior, fit)
        return self._against(white, rows, self._near(posterior, linear), linear, fit.samples if fit else 1)[0]

    def learn(
        self, y: np.ndarray, rows: np.ndarray, before: FilterState, fit: NoiseFit, keep=1.0, limit=math.inf
    ) -> tuple[Residuals, FilterState]:
        """The `residuals` of a mean (c + 1,) of samples of the channels `rows`, and the filter after it: unchanged
        where the misfit is above `limit`. The fit of noise alone is added to the earlier ones, whose weight each sample
        multiplies by `keep`."""
        white, samples, posterior = (y * self.whiten)[rows], fit.samples, before
        linear, greatest = self._first(white, posterior, fit), float(np.abs(white).max())
        for step in range(MOST_GAUSS_NEWTON_STEPS):
            posterior = self._near(posterior, linear)
            residuals, PH, new, cell = self._against(white, rows, posterior, linear, samples)
            if step == 0:
                first = residuals
                # Judge the sample before it has moved anything: a bad one must leave no trace.
                if first.misfit > limit:
                    return first, before
            B = linear.B[:, rows]
            at, place = self.moved(linear, (B @ residuals.weighted).tolist())
            if self.bend(linear, at, place, *linear.at[2:]) * greatest < LARGEST_LINEARISATION_BEND:
                break
            # The correction moved the sample's contact too far for its linearisation: again, from there.
            linear = self.linear(at, place, *self._unknowns(posterior))
        # Variance of the place that remains, relative to its prior; for one sample, not for the mean.
        unknown = 1 - float(B[1] @ residuals.precision @ B[1])
        place_sigma = self.surfaces.reach * math.sqrt(max(samples * unknown, 0.0))
        # Zeros and creep drift: their knowledge fades and as much of the prior variance comes back.
        faded = self._faded_by(samples)
        covariance = posterior.covariance - PH @ new.precision @ PH.T
        covariance = (0.5 * faded[:, None]) * (covariance + covariance.T) * faded
        covariance.flat[:: self.size + 1] += 1 - faded * faded
        if keep < 1.0:
            forgotten = keep ** (0.25 * samples)
            covariance[0] /= forgotten
            covariance[:, 0] /= forgotten
        fading = keep**samples
        pressed = fading * posterior.pressed
        pressed[cell] += samples
        return first, FilterState(
            faded * (posterior.mean + PH @ new.weighted), covariance, pressed, fit.linear, posterior.node,
            (at - fit.ln_force, place - fit.place_mm),
            place_sigma, fit.ln_force, fit.place_mm, posterior.anchor,
            information=fading * posterior.information + fit.information,
            score=fading * posterior.score + fit.score,
            square=fading * posterior.square + fit.square,
            freedom=fading * posterior.freedom + fit.own,
            samples=fading * posterior.samples + samples,
        )  # fmt: skip

    def _unknowns(self, posterior: FilterState) -> tuple[float, float]:
        """h of the filter, limited to the calibrated range, and its thickness."""
        return min(max(float(posterior.mean[0]), 0.0), self.top), float(posterior.mean[1])

    def _first(self, white: np.ndarray, posterior: FilterState, fit: NoiseFit | None) -> Linear:
        """The first linearisation for whitened channels: that of the fit if it is near enough."""
        unknowns = self._unknowns(posterior)
        at, place = (fit.ln_force, fit.place_mm) if fit else (posterior.ln_force, posterior.place_mm)
        at, place = at + posterior.offset[0], place + posterior.offset[1]
        if fit and self.bend(fit.linear, at, place, *unknowns) * float(np.abs(white).max()) <= LARGEST_REUSE_BEND:
            return fit.linear
        return self.linear(at, place, *unknowns)

    def _against(self, white: np.ndarray, rows: np.ndarray, posterior: FilterState, linear: Linear, samples: int):
        """`weighed` of whitened channels (k,) near a linearisation, with the slopes of the filter's node; the residuals
        with the variances of new information; and the cell of force."""
        x = posterior.mean.copy()
        x[:2] -= linear.at[2:]
        innovation = white - linear.expected[rows] - linear.H[rows] @ x
        # Expected readings are those at the sample, but slopes are those of the node: see the top of the module.
        H = (posterior.node or linear).H[rows]
        R, new, cell = self._own_errors(H, posterior.pressed, linear.at[0], samples)
        channels = rows, innovation, H, linear.B[:, rows], posterior.covariance
        residuals, PH = self.weighed(*channels, R)
        return residuals, PH, residuals if new is R else self.weighed(*channels, new)[0], cell

    def h_of_noise(self, posterior: FilterState) -> float:
        """h from the fit of noise alone; before the first sample, the start value."""
        step = posterior.score / posterior.information if posterior.information > 0 else 0.0
        return min(max(posterior.anchor + step, 0.0), self.top)

    def _near(self, posterior: FilterState, linear: Linear) -> FilterState:
        """The filter with its node near a linearisation."""
        if posterior.node is not None:
            (at, place, h, _), (before, x0, h0, _) = linear.at, posterior.node.at
            far = at - before, place - x0, (h - h0) / self.ln_modulus(h)[1]
            if all([abs(distance) <= limit for distance, limit in zip(far, NODE_STEPS, strict=True)]):
                return posterior
        return posterior._replace(node=linear)

    def estimate(self, posterior: FilterState) -> tuple[float, float, tuple[float, float]]:
        """h, its standard deviation, and the difference of its ln force and place from the fit of noise alone."""
        sigma = self.widening(posterior) * math.sqrt(max(float(posterior.covariance[0, 0]), 0.0))
        # The value with the smaller error; sigma stays that of the filter.
        if self.noise_explains(posterior):
            return posterior.anchor + posterior.score / posterior.information, sigma, (0.0, 0.0)
        return float(posterior.mean[0]), sigma, posterior.offset

    def widening(self, posterior: FilterState) -> float:
        """Factor by which sigma grows if readings contradict each other more than the stated errors of gains and
        calibration allow: root of the sum of squares of the estimated errors, divided by its expectation."""
        errors, prior_variance = posterior.mean[self._shaped], 1 - CELL_ERROR_SHARE**2
        expected = prior_variance - posterior.covariance.diagonal()[self._shaped]
        stated = STATED_SIGMA_WEIGHT * prior_variance
        return math.sqrt(max((stated + float(errors @ errors)) / (stated + float(expected.sum())), 1.0))

    def noise_explains(self, posterior: FilterState) -> bool:
        """Whether noise alone explains the readings."""
        if not posterior.information > 0:
            return False
        square = posterior.square - posterior.score * posterior.score / posterior.information
        freedom = max(posterior.freedom - 1, 1e-9)
        return square <= freedom * (1 + MISFIT_SLACK) + SURE_MISFIT_SIGMAS * math.sqrt(2 * freedom)

    def dominant(self, posterior: FilterState) -> str:
        """The largest contribution to sigma: the error whose knowledge would lower sigma most."""
        P = posterior.covariance
        taken = {"noise": 1 / posterior.information if posterior.information else math.inf}
        for name, columns in self.columns.items():
            if columns.stop > columns.start:
                # Decrease of the variance of h if this error were known exactly.
                taken[name] = float(P[0, columns] @ np.linalg.solve(P[columns, columns], P[columns, 0]))
        return max(taken, key=taken.__getitem__)
