"""One Kalman filter for every kind of softness: the modulus of a touch, and every unknown error that is constant during
the touch.

State x = (h, theta) with mean and covariance P, constant during a touch. h is a scale of ln E on which readings change
along straight lines; theta are the `Doubts`, the zeros of the gauges and the errors of the calibration, each in its
standard deviations. A sample of readings and force, divided by its noise and linearised at its own contact, is

    y = r + H x + B l + noise,   S = H P H' + B L B' + R,   gain K = P H' / S,

where l, the sample's own force and place with covariance L, is eliminated.

Two obvious ways fail. Evaluating H at every noisy sample creates information that is not there, so H is evaluated again
only when force, place or ln E have moved by `NODE`. And errors of gains are not independent from sample to sample: they
return whenever a force returns. So R holds an error for each cell of force, and a cell that is pressed again adds only
the information that is new (`_own_errors`).

The answer is the fit of noise alone as long as it explains the readings, because no other fit has a smaller error;
otherwise it is the filter's. Sigma is always the filter's, and grows where the gauges contradict each other
(`widening`). A linearisation costs 35 microseconds, learning a slot 100. Where readings do not change with the modulus,
sigma says so (ADR 0016, 0030).
"""

import math
from functools import lru_cache

import numpy as np

from papilla.estimators.softness.doubts import SHIFT_POWER, Doubts
from papilla.estimators.softness.filter_state import BENT_PLACE, FilterState, Linear, NoiseFit, Residuals, Tangent
from papilla.estimators.softness.surfaces import distance_curve
from papilla.specimen import THICKNESS_MM

BESIDE_SHARE = 0.017
"""All readings fall by this share 1 mm beside the apex across the row of gauges, and with the square of the distance:
0.4 to 3 % by gauge and load in presses of the default finger (the rest is within the gauges' gains)."""
SHAPE_ERROR = 0.4
"""Relative error, per factor of e of the force, of the growth of the effect of the thickness with the force."""
SPREAD_FORCE = 0.5
"""Prior standard deviation of a sample's ln force about that of the one before (for the place it is the reach of the
calibration): so wide that the prior has almost no weight."""
BENT, NEAR = 0.4, 0.005
"""Both bound (step of ln force)^2 x (greatest whitened reading), the curvature that a linearisation neglects. Above the
first a sample is linearised again at its new contact; below the second the linearisation of another sample is used."""
LEVEL, FAR, JITTER = 0.05, 3.0, 6.0
"""Samples of a slot lie within LEVEL of the same measure; a tangent is valid for steps FAR times as long; noise alone
moves a sample by up to JITTER standard deviations."""
NODE = (0.05, 0.3, 0.3)
"""H is evaluated again after ln force, place (mm) or ln E have changed by this much. Evaluated where noise puts each
sample, H would create information that no reading holds."""
CELL, SHAPE = 0.1, 0.5
"""Gains and calibration errors differ from force to force: each cell of ln force, CELL wide, has an error of its own,
with SHAPE of their standard deviation. It is the same when the cell is pressed again: only its noise averages out."""
SLOT, SHARE = 64, 8
"""A slot holds at most SLOT samples, and at most one in SHARE of those learnt so far: a touch that has just begun is
learnt sample by sample."""
LEAST_NOISE = 1e-6
"""Smallest noise relative to the largest reading and force; below it there is only rounding."""
STEPS = 6
"""Largest number of Gauss-Newton steps."""
ZERO_WALK, CREEP_WALK = 1e-4, 1e-2
"""Zeros and creep change slowly: after n samples exp(-n WALK / 2) of what was known of them is left."""
SURE, SLACK = 5.0, 0.05
"""Noise alone explains the readings while its mean squared misfit is below 1 + SLACK by at most SURE standard
deviations: noise itself is known to some per cent only."""
STATED = 1.0
"""Weight of the stated standard deviations in `widening`, as a number of squared errors of average size."""
PRIOR_REACH = 0.25
"""Prior standard deviation of h relative to its range: a first estimate may lie beyond the calibrated moduli."""


class Fitter:
    """Linearises and fits samples (c readings, force).

    surfaces : what channels read. reading_sigma (microstrain), force_sigma (N, inf for no sensor) : noise. doubts :
    standard deviations of errors. position_sigma : of the place, mm about the apex; inf where the place is unknown,
    None at the apex.
    """

    def __init__(
        self, surfaces, reading_sigma: float, force_sigma: float, doubts: Doubts, position_sigma: float | None
    ):
        self.surfaces, self.doubts = surfaces, doubts
        c = self.channels = surfaces.channels
        most = max(
            abs(surfaces.at(math.log(force), surfaces.ln_nodes[-1], 0.0).reading).max() for force in surfaces.force_N
        )
        floor = LEAST_NOISE * most, LEAST_NOISE * surfaces.force_N[1]
        self.noise = np.array([max(reading_sigma, floor[0])] * c + [max(force_sigma, floor[1])])
        self.whiten = 1.0 / self.noise
        self.anywhere, self.position_sigma = position_sigma is not None, position_sigma or 0.0
        self.spread = np.array([SPREAD_FORCE, surfaces.reach])
        self.low, self.high = map(math.log, surfaces.force_N)
        self._softest, self._hardest = float(surfaces.ln_nodes[0]), float(surfaces.ln_nodes[-1])
        self.ln_modulus = lru_cache(maxsize=64)(self._ln_modulus)
        self._errors = lru_cache(maxsize=1024)(self._errors_near)
        self._error_at = lru_cache(maxsize=1024)(surfaces.error)
        self._place_error = lru_cache(maxsize=1024)(lambda place: surfaces.place_error(place))
        self._faded_by = lru_cache(maxsize=64)(lambda samples: self._faded ** (0.5 * samples))
        self._middle, self._half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        self._shift, self._shift_sigma = doubts.thickness_shift(THICKNESS_MM)
        self.columns = self._columns()
        self.curve = distance_curve(*self._distances())
        self.top = self.curve.values[-1]

    def _columns(self) -> dict[str, slice]:
        """Columns of H by the name of their error; the first three columns are those that act like a change of ln E."""
        c, groups, doubts = self.channels, max(self.surfaces.groups) + 1, self.doubts
        sizes = {
            "the thickness of the specimen": 2,
            "the zero of the gauges": c,
            "the gain of the gauges": c,
            "the calibration": 3 * groups,
            "the calibration beside the apex": c if self.anywhere else 0,
            "friction": 0 if self.surfaces.friction_known else 1,
            "creep": 1,
            "the place across the row of gauges (y)": 1,
            "the gain of the force": 1,
            "the offset of the force": 1,
        }
        parts, end = {}, 1
        for name, size in sizes.items():
            parts[name] = slice(end, end + size)
            end += size
        self.size, numbers = end, np.arange(c)
        _, zero, gain, error, beside, friction, creep, across, self._force_gain, offset = parts.values()
        self._template, self._of_reading = np.zeros((c + 1, end)), np.zeros((c, end))
        self._template[numbers, zero.start + numbers] = doubts.zero_microstrain * self.whiten[:-1]
        self._template[-1, offset] = doubts.force_offset_N * self.whiten[-1]
        self._of_reading[numbers, gain.start + numbers] = doubts.gauge_gain
        self._of_reading[:, creep], self._of_reading[:, across] = doubts.creep, -BESIDE_SHARE * doubts.beside_mm**2
        self._faded = np.ones(end)
        self._faded[zero], self._faded[creep] = 1 - ZERO_WALK, 1 - CREEP_WALK
        self._shaped = slice(gain.start, beside.stop)
        self._error = numbers[:, None], error.start + 3 * np.array(self.surfaces.groups)[:, None] + np.arange(3)
        self._beside, self._friction = (numbers, beside.start + numbers), friction
        return parts

    def _distances(self):
        """dh / d ln E at the calibrated nodes, at the middle force: square root of the information of one sample about
        ln E."""
        nodes = self.surfaces.ln_nodes
        slopes = []
        for node in nodes.tolist():
            _, H, (b, _) = self._channels(self._middle, 0.0, node, 1.0, 0.0)
            a = H[:, 0]
            # What the change by the sample's own force explains is taken out of the slope: only the rest tells E.
            slopes.append(math.sqrt(max(a @ a - (a @ b) ** 2 / (b @ b + 1.0), 0.0)))
        return np.array(slopes), float(nodes[0]), 1 / float(nodes[1] - nodes[0])

    def _ln_modulus(self, h: float) -> tuple[float, float]:
        """ln E at h, and dh / d ln E there; beyond the calibrated moduli, the values at their end."""
        values = self.curve.values
        return self.curve.solve(min(max(h, values[0]), values[-1]), 0, len(values) - 1)

    def _errors_near(self, force: int, modulus: int, place: int) -> np.ndarray:
        """(c, m) part of H for errors of calibration and friction, per newton, near a contact: ln force and ln modulus
        in 1/100, place in 1/50 mm."""
        H, w, surfaces, ln_force = np.zeros((self.channels, self.size)), self.whiten[:-1], self.surfaces, force / 100
        ln_force = min(max(ln_force, self.low), self.high)
        ln_modulus = min(max(modulus / 100, self._softest), self._hardest)
        z = (ln_force - self._middle) / self._half
        # The calibration's error is a smooth function of ln force: Legendre polynomials of degree 0, 1 and 2, the
        # latter two half as large. Gauges that mirror each other share it (`_error`).
        H[self._error] = (self._error_at(ln_force) * w)[:, None] * (1.0, 0.5 * z, 0.75 * z * z - 0.25)
        if self.anywhere:
            H[self._beside] = self._place_error(place / 50) * w
        if not surfaces.friction_known:
            # Two standard deviations reach from the calibration's friction to none
            H[:, self._friction] = (surfaces.without_friction(ln_force, ln_modulus) * (0.5 * w))[:, None]
        return H

    def linear(self, ln_force: float, place: float, h: float, thickness: float = 0.0) -> Linear:
        """The channels at the nearest calibrated contact; thickness: its error in standard deviations."""
        ln_modulus, slope = self.ln_modulus(h)
        ln_force, place = self.inside(ln_force, place)
        return Linear((ln_force, place, h, thickness), *self._channels(ln_force, place, ln_modulus, slope, thickness))

    def _channels(self, ln_force: float, place: float, ln_modulus: float, slope: float, thickness: float):
        """expected, H and B of a `Linear`; slope : dh / d ln E."""
        # A block of another thickness presses like one of another modulus: the surfaces are read at this apparent ln E.
        force = math.exp(ln_force)
        thin = force**SHIFT_POWER
        effect, moved = self._shift_sigma * thin, (self._shift + self._shift_sigma * thickness) * thin
        apparent = min(max(ln_modulus + moved, self._softest), self._hardest)
        r, a, b, d = self.surfaces.at(ln_force, apparent, place)
        expected, w = np.empty(self.channels + 1), self.whiten[:-1]
        expected[:-1], expected[-1] = r, force
        expected *= self.whiten
        H = self._template.copy()
        errors = self._errors(round(100 * ln_force), round(100 * apparent), round(50 * place))
        H[:-1] += expected[:-1, None] * self._of_reading + force * errors
        H[:-1, :3] = (a * w)[:, None] * (1 / slope, effect, effect * SHAPE_ERROR * 2 * (ln_force - self._middle))
        H[-1, self._force_gain] = self.doubts.force_gain * expected[-1]
        B = np.zeros((2, self.channels + 1))
        # Readings change with the sample's force directly, and because the effect of the thickness grows with the
        # force.
        B[0, :-1], B[0, -1] = (b * force + a * (SHIFT_POWER * moved)) * (SPREAD_FORCE * w), SPREAD_FORCE * expected[-1]
        B[1, :-1] = d * (self.surfaces.reach * w)
        return expected, H, B

    def prior(self, zero_share: float) -> FilterState:
        """The filter before the first sample; `zero_share` is the part of the zeros' standard deviations that is still
        unknown."""
        mean, variance = np.zeros(self.size), np.ones(self.size)
        for name in ("the zero of the gauges", "the offset of the force"):
            variance[self.columns[name]] = zero_share**2
        # The rest of the variance belongs to the cells of force (`_own_errors`).
        variance[self._shaped] = 1 - SHAPE**2
        variance[0] = (PRIOR_REACH * self.top) ** 2
        return FilterState(mean, np.diag(variance), np.zeros(1 + int((self.high - self.low) / CELL)))

    def _own_errors(self, H: np.ndarray, pressed: np.ndarray, ln_force: float, samples: float):
        """Variances (k,) of a mean of `samples` in its cell of force, from noise and the cell's own error: the full
        ones, and those with which only new information counts if the cell was pressed before; and the cell."""
        cell = min(max(int((ln_force - self.low) / CELL), 0), len(pressed) - 1)
        before, slopes = float(pressed[cell]), H[:, self._shaped]
        own = SHAPE**2 * np.einsum("km,km->k", slopes, slopes)
        plain, after = own + 1 / samples, before + samples
        # Information of all samples of the cell minus that of the earlier ones.
        new = (own + 1 / before) * (own + 1 / after) * (before * after / samples) if before else plain
        return plain, new, cell

    def bend(self, linear: Linear, ln_force: float, place: float, h: float, thickness: float) -> float:
        """Distance of a contact from a linearisation, as the squared step of ln force with the same nonlinearity."""
        at, there, known, thick = linear.at
        along = (h - known + (thickness - thick) * self._shift_sigma * math.exp(SHIFT_POWER * at)) / self.top
        return (ln_force - at) ** 2 + (BENT_PLACE * (place - there)) ** 2 + along * along

    def moved(self, linear: Linear, steps) -> tuple[float, float]:
        """ln force and place after steps from a linearisation; steps are in units of their spread."""
        at, there, *_ = linear.at
        return at + SPREAD_FORCE * steps[0], there + self.surfaces.reach * steps[1]

    def noise_fit(self, y: np.ndarray, rows: np.ndarray, state: FilterState, count: int = 1) -> NoiseFit:
        """Fit of a mean (c + 1,) of `count` samples of the channels `rows`, assuming noise alone: least squares for its
        own force and place; with these eliminated, the normal equation of h."""
        h, white, near = self.h_of_noise(state), (y * self.whiten)[rows], state.linear is not None
        linear = state.linear or self.linear(state.ln_force, state.place_mm, h)
        greatest = float(np.abs(white).max()) * math.sqrt(count)
        # Products of slope a by h, residual r, and slopes l, m by the sample's own force and place: all that the least
        # squares need, by one product of matrices.
        table = np.empty((4, len(rows)))
        for _ in range(STEPS):
            table[0] = slope = linear.H[rows, 0]
            table[1] = white - linear.expected[rows] - slope * (h - linear.at[2])
            table[2:] = linear.B[:, rows]
            (aa, ar, al, am), (_, rr, rl, rm), (_, _, ll, lm), (*_, mm) = (table @ table.T).tolist()
            # The prior of force and place, of variance 1 in these units, against the noise 1 / count of the mean.
            ll, mm = ll + 1 / count, mm + 1 / count
            det = ll * mm - lm * lm
            steps = (mm * rl - lm * rm) / det, (ll * rm - lm * rl) / det
            at, place = self.moved(linear, steps)
            if self.bend(linear, at, place, h, 0.0) * greatest < (NEAR if near else BENT):
                break
            linear, near = self.linear(at, place, h), False
        # Eliminate force and place (Schur complement): what is left of the information and the score belongs to h.
        to_l, to_m = (mm * al - lm * am) / det, (ll * am - lm * al) / det
        here = count * (rr - rl * steps[0] - rm * steps[1])
        information, score = count * (aa - to_l * al - to_m * am), count * (ar - to_l * rl - to_m * rm)
        # Sums of several slots must refer to one h, the anchor: this slot's parabola in h is moved there.
        away = h - state.anchor
        square = here + away * (2 * score + away * information)
        freedom = len(rows) - 1 - self.anywhere
        return NoiseFit(information, score + away * information, square, here, freedom, at, place, count, linear)

    def tangent(self, linear: Linear, rows: np.ndarray) -> Tangent:
        """The tangent at a linearisation, for some channels."""
        B, expected = linear.B[:, rows], linear.expected[rows]
        # Projections of a whitened sample onto its force and place, and onto what neither explains: linear, so both are
        # one matrix, computed once.
        own = np.linalg.inv(B @ B.T + np.eye(2) / SLOT)
        gain, jitter = own @ B, self.spread * np.sqrt(own.diagonal())
        split = np.concatenate([self.spread[:, None] * gain, np.eye(len(rows)) - B.T @ gain])
        # Samples may share a slot as long as the curvature between them stays below `LEVEL`, plus what noise alone
        # moves.
        bent = math.sqrt(LEVEL / max(float(np.abs(expected).max()), 1.0))
        slack = bent + JITTER * float(jitter[0]), bent / BENT_PLACE + JITTER * float(jitter[1])
        (at, there, *_), end = linear.at, self.surfaces.reach
        ends = zip(slack, ((self.low - at, self.high - at), (-end - there, end - there)), strict=True)
        reach = tuple([(max(-FAR * far, low), min(FAR * far, high)) for far, (low, high) in ends])
        return Tangent(linear, rows, split * self.whiten[rows], split @ expected, reach, slack)

    def slot(self, state: FilterState) -> int:
        """Number of samples that are learnt together."""
        return min(int(state.samples) // SHARE, SLOT)

    def weighed(self, rows, innovation, H: np.ndarray, B: np.ndarray, P: np.ndarray, R):
        """Residuals of an innovation (k,) with variances R, slopes H (k, m) and B (2, k), and covariance P (m, m) of x;
        and P H'."""
        PH = P @ H.T
        S = H @ PH + B.T @ B
        S.flat[:: len(rows) + 1] += R
        precision = np.linalg.inv(S)
        weighted = precision @ innovation
        return Residuals(weighted, precision, rows, float(innovation @ weighted)), PH

    def residuals(self, y: np.ndarray, rows: np.ndarray, state: FilterState, fit: NoiseFit | None = None) -> Residuals:
        """Residuals of a mean (c + 1,) of samples of the channels `rows` against the filter. Without `fit` the sample
        may be faulty, so it is linearised at the contact of the last one."""
        white = (y * self.whiten)[rows]
        linear = self._first(white, state, fit)
        return self._against(white, rows, self._near(state, linear), linear, fit.samples if fit else 1)[0]

    def learn(
        self, y: np.ndarray, rows: np.ndarray, known: FilterState, fit: NoiseFit, keep=1.0, limit=math.inf
    ) -> tuple[Residuals, FilterState]:
        """The `residuals` of a mean (c + 1,) of samples of the channels `rows`, and the filter after it: unchanged
        where the misfit is above `limit`. The fit of noise alone is added to the earlier ones, whose weight each sample
        multiplies by `keep`."""
        white, samples, state = (y * self.whiten)[rows], fit.samples, known
        linear, greatest = self._first(white, state, fit), float(np.abs(white).max())
        for step in range(STEPS):
            state = self._near(state, linear)
            residuals, PH, new, cell = self._against(white, rows, state, linear, samples)
            if step == 0:
                first = residuals
                # Judge the sample before it has moved anything: a bad one must leave no trace.
                if first.misfit > limit:
                    return first, known
            B = linear.B[:, rows]
            at, place = self.moved(linear, (B @ residuals.weighted).tolist())
            if self.bend(linear, at, place, *linear.at[2:]) * greatest < BENT:
                break
            # The correction moved the sample's contact too far for its linearisation: again, from there.
            linear = self.linear(at, place, *self._unknowns(state))
        # Variance of the place that remains, relative to its prior; for one sample, not for the mean.
        left = 1 - float(B[1] @ residuals.precision @ B[1])
        place_sigma = self.surfaces.reach * math.sqrt(max(samples * left, 0.0))
        mean, covariance = self._corrected(state, PH, new, samples, keep)
        kept = keep**samples
        pressed = kept * state.pressed
        pressed[cell] += samples
        return first, FilterState(
            mean, covariance, pressed, fit.linear, state.node, (at - fit.ln_force, place - fit.place_mm),
            place_sigma, fit.ln_force, fit.place_mm, state.anchor,
            information=kept * state.information + fit.information,
            score=kept * state.score + fit.score,
            square=kept * state.square + fit.square,
            freedom=kept * state.freedom + fit.own,
            samples=kept * state.samples + samples,
        )  # fmt: skip

    def _unknowns(self, state: FilterState) -> tuple[float, float]:
        """h of the filter, limited to the calibrated range, and its thickness."""
        return min(max(float(state.mean[0]), 0.0), self.top), float(state.mean[1])

    def _first(self, white: np.ndarray, state: FilterState, fit: NoiseFit | None) -> Linear:
        """The first linearisation for whitened channels: that of the fit if it is near enough."""
        unknowns = self._unknowns(state)
        at, place = (fit.ln_force, fit.place_mm) if fit else (state.ln_force, state.place_mm)
        at, place = at + state.offset[0], place + state.offset[1]
        if fit and self.bend(fit.linear, at, place, *unknowns) * float(np.abs(white).max()) <= NEAR:
            return fit.linear
        return self.linear(at, place, *unknowns)

    def _against(self, white: np.ndarray, rows: np.ndarray, state: FilterState, linear: Linear, samples: int):
        """`weighed` of whitened channels (k,) near a linearisation, with the slopes of the filter's node; the residuals
        with the variances of new information; and the cell of force."""
        x = state.mean.copy()
        x[:2] -= linear.at[2:]
        innovation = white - linear.expected[rows] - linear.H[rows] @ x
        # Expected readings are those at the sample, but slopes are those of the node: see the top of the module.
        H = (state.node or linear).H[rows]
        R, new, cell = self._own_errors(H, state.pressed, linear.at[0], samples)
        channels = rows, innovation, H, linear.B[:, rows], state.covariance
        residuals, PH = self.weighed(*channels, R)
        return residuals, PH, residuals if new is R else self.weighed(*channels, new)[0], cell

    def _corrected(
        self, state: FilterState, PH: np.ndarray, residuals: Residuals, samples: int, keep: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Mean and covariance of x after a Kalman correction and after the drift during its samples."""
        # Zeros and creep drift: their knowledge fades and as much of the prior variance comes back.
        faded = self._faded_by(samples)
        covariance = state.covariance - PH @ residuals.precision @ PH.T
        covariance = (0.5 * faded[:, None]) * (covariance + covariance.T) * faded
        covariance.flat[:: self.size + 1] += 1 - faded * faded
        if keep < 1.0:
            covariance[0] /= keep ** (0.25 * samples)
            covariance[:, 0] /= keep ** (0.25 * samples)
        return faded * (state.mean + PH @ residuals.weighted), covariance

    def h_of_noise(self, state: FilterState) -> float:
        """h from the fit of noise alone; before the first sample, the start value."""
        step = state.score / state.information if state.information > 0 else 0.0
        return min(max(state.anchor + step, 0.0), self.top)

    def _near(self, state: FilterState, linear: Linear) -> FilterState:
        """The filter with its node near a linearisation."""
        if state.node is not None:
            (at, place, h, _), (before, there, known, _) = linear.at, state.node.at
            far = at - before, place - there, (h - known) / self.ln_modulus(h)[1]
            if all([abs(distance) <= limit for distance, limit in zip(far, NODE, strict=True)]):
                return state
        return state._replace(node=linear)

    def estimate(self, state: FilterState) -> tuple[float, float]:
        """h and its standard deviation."""
        h, sigma = float(state.mean[0]), self.widening(state) * math.sqrt(max(float(state.covariance[0, 0]), 0.0))
        # The value with the smaller error; sigma stays that of the filter.
        if self.noise_explains(state):
            h = state.anchor + state.score / state.information
        return h, sigma

    def widening(self, state: FilterState) -> float:
        """Factor by which sigma grows if readings contradict each other more than the stated errors of gains and
        calibration allow: root of the sum of squares of the estimated errors, divided by its expectation."""
        found, known = state.mean[self._shaped], 1 - SHAPE**2
        left = known - state.covariance.diagonal()[self._shaped]
        return math.sqrt(max((STATED * known + float(found @ found)) / (STATED * known + float(left.sum())), 1.0))

    def noise_explains(self, state: FilterState) -> bool:
        """Whether noise alone explains the readings."""
        if not state.information > 0:
            return False
        square = state.square - state.score * state.score / state.information
        freedom = max(state.freedom - 1, 1e-9)
        return square <= freedom * (1 + SLACK) + SURE * math.sqrt(2 * freedom)

    def dominant(self, state: FilterState) -> str:
        """The largest contribution to sigma: the error whose knowledge would lower sigma most."""
        P = state.covariance
        taken = {"noise": 0.0}
        for name, own in self.columns.items():
            if own.stop > own.start:
                # Decrease of the variance of h if this error were known exactly.
                taken[name] = float(P[0, own] @ np.linalg.solve(P[own, own], P[own, 0]))
        taken["noise"] = 1 / state.information if state.information else math.inf
        return max(taken, key=lambda name: taken[name])

    def least_reading(self) -> np.ndarray:
        """(c,) smallest |reading| in microstrain at the lowest force, over all moduli."""
        nodes = self.surfaces.ln_nodes.tolist()
        return np.abs([self.surfaces.at(self.low, node, 0.0).reading for node in nodes]).min(axis=0)

    def inside(self, ln_force: float, place: float) -> tuple[float, float]:
        """The nearest calibrated contact, at which to linearise."""
        reach = self.surfaces.reach
        return min(max(ln_force, self.low), self.high), min(max(place, -reach), reach)
