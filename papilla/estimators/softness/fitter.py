"""One fit for every kind of softness: the modulus of a touch, with all that is not known exactly as further unknowns.

The unknowns that stay in a touch are x = (h, theta): h is a scale of ln E along which readings move in straight lines,
theta are the `Doubts`, the gauges' zeros and the calibration's errors, each in units of its standard deviation. Every
sample has its own force and place. Linearised where its own force and place are, a sample y = r + H x + B l + noise is
a Kalman update with innovation covariance S = H P H' + B L B' + 1 (all whitened): l, the sample's own, is eliminated.

The estimate that is answered is that of noise alone as long as it explains the readings, for there is none sharper;
where it does not, that of the filter. Sigma is the filter's in both cases.
"""

import math
from functools import lru_cache

import numpy as np

from papilla.estimators.softness.belief import BENT_PLACE, FAR, Alone, Belief, Fit, Linear, Tangent
from papilla.estimators.softness.contrast import Contrast
from papilla.estimators.softness.doubts import SHIFT_POWER, Doubts
from papilla.estimators.softness.surfaces import distance_curve
from papilla.specimen import THICKNESS_MM

BESIDE_SHARE = 0.017
"""By so much all readings fall 1 mm beside the apex across the row of gauges, and with the square of it: presses of the
default finger, 0.4 to 3 % by gauge and load (the rest is within the gauges' gains)."""
SHAPE_ERROR = 0.4
"""How little is known of how the thickness' effect grows with force: relative, per factor of e of the force."""
SPREAD_FORCE = 0.5
"""A sample's ln force may differ from that of the one before by this, and its place by the reach: next to no prior."""
BENT = 0.4
"""Squared step of ln force times the greatest whitened reading, below which a sample is not linearised anew."""
NODE = (0.05, 0.3, 0.3)
"""H is taken anew where ln force, place (mm) or ln E have moved by so much: were it taken where noise puts each sample,
the filter would come to know what no reading tells."""
DRIFT = 0.5
"""Gains and calibration errors are constant within so much of their standard deviation from such a node to the next:
what is known to 3 % is not known to be the same at all forces within 0.01 %."""
SLOT, SHARE = 32, 8
"""What is learnt from is the mean of a slot of samples, at most so many, and of what was learnt already one in so many:
nothing that is looked for changes from one sample to the next."""
ODD = 20.0
"""A sample whose squared misfit is so many times the usual one is looked at by itself."""
LEAST_NOISE = 1e-6
"""Of the greatest reading and force: noise below it is rounding."""
STEPS = 6
ZERO_WALK, CREEP_WALK = 1e-4, 1e-2
"""Zeros and creep change slowly: after n samples all but exp(-n WALK / 2) of what was known of them is forgotten."""
SURE, SLACK = 5.0, 0.05
"""The estimate of noise alone stands while its mean squared misfit is within so many standard deviations of 1, and so
much more, as noise is not known exactly either."""
PRIOR_REACH = 0.25
"""Of the scale h, by which a first estimate may lie beyond the calibrated moduli."""


class Fitter:
    """Linearises and fits samples (c readings, force).

    surfaces : what channels read. reading_sigma (microstrain), force_sigma (N, inf for no sensor) : noise. doubts :
    what is not known. position_sigma : mm about the apex, inf where nothing is known, None at the apex.
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
        self.own = 1 if position_sigma is None else 2
        self.anywhere, self.position_sigma = position_sigma is not None, position_sigma or 0.0
        self._spread, self._eye = np.array([SPREAD_FORCE, surfaces.reach])[: self.own], np.eye(c + 1)
        self.low, self.high = map(math.log, surfaces.force_N)
        self.ln_modulus = lru_cache(maxsize=64)(self._ln_modulus)
        self._middle, self._half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        self._shift, self._shift_sigma = doubts.thickness_shift(THICKNESS_MM)
        self.parts = self._columns()
        self.curve = distance_curve(*self._distances())
        self.top = self.curve.values[-1]

    def _columns(self) -> dict[str, slice]:
        """Which columns of H belong to which doubt, in words."""
        c, groups = self.channels, max(self.surfaces.groups) + 1
        sizes = {
            "the zero of the gauges": c,
            "the gain of the gauges": c,
            "the calibration": 3 * groups,
            "the calibration beside the apex": c if self.anywhere else 0,
            "friction": 0 if self.surfaces.friction_known else 1,
            "creep": 1,
            "the place across the row of gauges (y)": 1,
            "the thickness of the specimen": 2,
            "the gain of the force": 1,
            "the offset of the force": 1,
        }
        parts, end = {}, 1
        for name, size in sizes.items():
            parts[name] = slice(end, end + size)
            end += size
        self.size = end
        template = np.zeros((c + 1, end))
        numbers = np.arange(c)
        zero, gain, error, beside, *_ = parts.values()
        template[numbers, zero.start + numbers] = self.doubts.zero_microstrain / self.noise[:-1]
        template[-1, -1] = self.doubts.force_offset_N * self.whiten[-1]
        self._template = template
        self._gain = numbers, gain.start + numbers
        self._faded = np.ones(end)
        self._faded[zero], self._faded[parts["creep"]] = 1 - ZERO_WALK, 1 - CREEP_WALK
        self._drifting = np.arange(gain.start, beside.stop) * (end + 1)
        self._beside = numbers, beside.start + numbers
        self._error = numbers[:, None], error.start + 3 * np.array(self.surfaces.groups)[:, None] + np.arange(3)
        self._creep = parts["creep"].start
        return parts

    def _distances(self):
        """Slope of h over ln E at the calibrated nodes, at the middle force: what one sample's noise tells."""
        nodes = self.surfaces.ln_nodes
        slopes = []
        for node in nodes.tolist():
            linear = self._linear(self._middle, 0.0, node, 1.0)
            rows = slice(None) if math.isfinite(self.noise[-1]) else slice(0, -1)
            a, b = linear.H[rows, 0], linear.B[rows, 0]
            slopes.append(math.sqrt(max(a @ a - (a @ b) ** 2 / (b @ b + SPREAD_FORCE**-2), 0.0)))
        return np.array(slopes), float(nodes[0]), 1 / float(nodes[1] - nodes[0])

    def _ln_modulus(self, h: float) -> tuple[float, float]:
        """ln E at h, and dh / d ln E there; beyond the calibrated moduli their end's."""
        values = self.curve.values
        return self.curve.solve(min(max(h, values[0]), values[-1]), 0, len(values) - 1)

    def linear(self, ln_force: float, place: float, h: float, thickness: float = 0.0) -> Linear:
        """The channels at a contact of the domain; thickness: the doubt's, in its standard deviations."""
        ln_modulus, slope = self.ln_modulus(h)
        return self._linear(ln_force, place, ln_modulus, slope, thickness)

    def _linear(self, ln_force: float, place: float, ln_modulus: float, slope: float, thickness: float = 0.0) -> Linear:
        surfaces, doubts, c = self.surfaces, self.doubts, self.channels
        force = math.exp(ln_force)
        thin = force**SHIFT_POWER
        moved = (self._shift + self._shift_sigma * thickness) * thin
        low, high = surfaces.ln_nodes[0], surfaces.ln_nodes[-1]
        apparent = min(max(ln_modulus + moved, low), high)
        r, a, b, d = surfaces.at(ln_force, apparent, place)
        w = self.whiten
        H = self._template.copy()
        white, a = r * w[:-1], a * w[:-1]
        H[:-1, 0] = a / slope
        H[self._gain] = white * doubts.gauge_gain
        z = (ln_force - self._middle) / self._half
        error = surfaces.error(round(100 * ln_force)) * (force * w[:-1])
        H[self._error] = error[:, None] * (1.0, 0.5 * z, 0.75 * z * z - 0.25)
        if self.anywhere:
            H[self._beside] = surfaces.place_error(place) * (force * w[:-1])
        k, effect = self._creep, a * (self._shift_sigma * thin)
        if not surfaces.friction_known:
            # Two standard deviations reach from the calibration's friction to none
            H[:-1, k - 1] = surfaces.without_friction(ln_force, apparent) * (0.5 * w[:-1])
        H[:-1, k] = white * doubts.creep
        H[:-1, k + 1] = white * (-BESIDE_SHARE * doubts.beside_mm**2)
        H[:-1, k + 2] = effect
        H[:-1, k + 3] = effect * (SHAPE_ERROR * 2 * (ln_force - self._middle))
        H[-1, k + 4] = doubts.force_gain * force * w[-1]
        B = np.empty((c + 1, self.own))
        B[:-1, 0] = (b * force + (a / w[:-1]) * (SHIFT_POWER * moved)) * w[:-1]
        B[-1, 0] = force * w[-1]
        if self.anywhere:
            B[:-1, 1], B[-1, 1] = d * w[:-1], 0.0
        return Linear(np.append(white, force * w[-1]), H, B)

    def fresh(self, zero_share: float) -> Belief:
        """A belief before the first sample, the zeros being known to a share of their standard deviation."""
        mean, variance = np.zeros(self.size), np.ones(self.size)
        variance[1 : 1 + self.channels] = zero_share**2
        variance[0] = (PRIOR_REACH * self.top) ** 2
        return Belief(mean, np.diag(variance))

    def alone(self, y: np.ndarray, rows: np.ndarray, belief: Belief, count: int = 1) -> Alone:
        """What a mean (c + 1,) of `count` samples of the channels `rows` says if noise is all that is wrong: its own
        force and place, and with these eliminated what it says of h."""
        h, c, root = self.sharp(belief), self.channels, math.sqrt(count)
        whiten = self.whiten * root
        white = y * whiten
        ln_modulus, slope = self.ln_modulus(h)
        low, high = self.surfaces.ln_nodes[0], self.surfaces.ln_nodes[-1]
        at, place = self.inside(*self._guessed(y, rows, belief))
        greatest = float(np.abs(white[rows]).max())
        for _ in range(STEPS):
            force = math.exp(at)
            moved = self._shift * force**SHIFT_POWER if self._shift else 0.0
            r, a, b, d = self.surfaces.at(at, min(max(ln_modulus + moved, low), high), place)
            table = np.zeros((2 + self.own, c + 1))
            table[0, :-1] = a / slope
            table[1, :-1], table[1, -1] = r, force
            table[2, :-1], table[2, -1] = (b * force + a * (SHIFT_POWER * moved)) * SPREAD_FORCE, force * SPREAD_FORCE
            if self.anywhere:
                table[3, :-1] = d * self.surfaces.reach
            table *= whiten
            table[1] = white - table[1]
            if len(rows) <= c:
                table = table[:, rows]
            aa, ar, al, am, rr, rl, rm, ll, lm, mm = _upper(table @ table.T)
            # Two unknowns at most are the sample's own, with next to no prior of unit variance.
            ll, mm = ll + 1.0, mm + 1.0
            det = ll * mm - lm * lm
            step, across = SPREAD_FORCE * (mm * rl - lm * rm) / det, self.surfaces.reach * (ll * rm - lm * rl) / det
            if (step * step + (BENT_PLACE * across) ** 2) * greatest < BENT:
                break
            at, place = self.inside(at + step, place + across)
        to_l, to_m = (mm * al - lm * am) / det, (ll * am - lm * al) / det
        here = rr - (rl * (mm * rl - lm * rm) + rm * (ll * rm - lm * rl)) / det
        information, score = aa - to_l * al - to_m * am, ar - to_l * rl - to_m * rm
        away = h - belief.anchor
        square = here + away * (2 * score + away * information)
        own = np.array(((mm, -lm), (-lm, ll)))[: self.own, : self.own] / det
        tangent = self._tangent(rows, y, table / root, own * count, (at, place), greatest / root)
        freedom, at, place = len(rows) - self.own, at + step, place + across
        return Alone(information, score + away * information, square, here, freedom, at, place, count, tangent)

    def _tangent(self, rows, y, table, own, at: tuple[float, float], greatest: float) -> Tangent:
        """The tangent at a contact; table (2 + own, k) : slope in h, rest of y, slopes in force and place; own :
        covariance of the latter two."""
        B = table[2:]
        gain = own @ B
        split = np.concatenate([self._spread[:, None] * gain, self._eye[: len(rows), : len(rows)] - B.T @ gain])
        expected = (y * self.whiten)[rows] - table[1]
        jitter = tuple([spread * math.sqrt(own[k, k]) for k, spread in enumerate(self._spread.tolist())])
        return Tangent(rows, expected, split, at, jitter, max(greatest, 1.0) ** -0.5)

    def near(self, y: np.ndarray, rows: np.ndarray, belief: Belief) -> list[float] | None:
        """Steps from the tangent of a touch to a sample (c + 1,) of the channels `rows`, None where that does not hold:
        not for these channels, too far for it, outside what is calibrated, or unlike what was read so far."""
        tangent = belief.tangent
        if tangent is None or not (rows is tangent.rows or np.array_equal(rows, tangent.rows)):
            return None
        d = (y * self.whiten)[rows] - tangent.expected
        split = tangent.split @ d
        steps = split[: self.own].tolist()
        if not float(split[self.own :] @ d) <= self._usual(belief):
            return None
        within = self.low <= tangent.at[0] + steps[0] <= self.high
        if self.anywhere:
            within = within and abs(tangent.at[1] + steps[1]) <= self.surfaces.reach
        return steps if within and tangent.level(steps, [0.0, 0.0], FAR) else None

    def _guessed(self, y: np.ndarray, rows: np.ndarray, belief: Belief) -> tuple[float, float]:
        """ln force and place to begin with."""
        tangent = belief.tangent
        if tangent is None or len(tangent.rows) != len(rows):
            return belief.ln_force, belief.place_mm
        steps = (tangent.split[: self.own] @ ((y * self.whiten)[rows] - tangent.expected)).tolist()
        longest = SPREAD_FORCE / 2
        force = tangent.at[0] + min(max(steps[0], -longest), longest)
        return force, tangent.at[1] + min(max(steps[1], -longest), longest) if self.anywhere else 0.0

    def slot(self, belief: Belief) -> int:
        """How many samples are learnt together."""
        return min(int(belief.samples) // SHARE, SLOT)

    def odd(self, belief: Belief, alone: Alone) -> bool:
        """Whether a sample is unlike those before, as noise alone sees them."""
        return alone.here > self._usual(belief)

    def _usual(self, belief: Belief) -> float:
        """Squared misfit of a sample that is like those before."""
        return ODD * (1 + belief.square / max(belief.freedom, 1.0))

    def fit(self, y: np.ndarray, rows: np.ndarray, belief: Belief, alone: Alone) -> Fit:
        """A mean (c + 1,) of samples against a belief, of the channels `rows`, linearised where it lies."""
        y = y * self.whiten
        h = min(max(float(belief.mean[0]), 0.0), self.top)
        at, place = self.inside(alone.ln_force + belief.offset[0], alone.place_mm + belief.offset[1])
        spread = self._spread
        greatest, contrasts = float(np.abs(y[rows]).max()), []
        mean, thickness = belief.mean.copy(), float(belief.mean[self._creep + 2])
        mean[0] -= h
        mean[self._creep + 2] = 0.0
        for _ in range(STEPS):
            expected, exact, B = self.linear(at, place, h, thickness)
            belief = self._near(belief, at, place, h, exact)
            exact, H, B = exact[rows], belief.slopes[rows], B[rows] * spread  # type: ignore[index]
            innovation = (y - expected)[rows] - exact @ mean
            PH = belief.covariance @ H.T
            S = H @ PH + B @ B.T
            S.flat[:: len(rows) + 1] += 1.0 / alone.samples
            precision = np.linalg.inv(S)
            weighted = precision @ innovation
            contrasts.append(Contrast(weighted, precision, rows, float(innovation @ weighted)))
            step = spread * (B.T @ weighted)
            bend = step[0] ** 2 + ((BENT_PLACE * step[1]) ** 2 if self.anywhere else 0.0)
            if bend * greatest < BENT:
                break
            at, place = self.inside(at + float(step[0]), place + (float(step[1]) if self.anywhere else 0.0))
        sigma = 0.0
        if self.anywhere:
            place += float(step[1])
            sigma = spread[1] * math.sqrt(max(1.0 - float(B[:, 1] @ precision @ B[:, 1]), 0.0))
        return Fit(contrasts[0], contrasts[-1], belief, PH, alone.samples, at + float(step[0]), place, sigma)

    def sharp(self, belief: Belief) -> float:
        """h of noise alone; that of the start before the first sample."""
        step = belief.score / belief.information if belief.information > 0 else 0.0
        return min(max(belief.anchor + step, 0.0), self.top)

    def _near(self, belief: Belief, at: float, place: float, h: float, exact: np.ndarray) -> Belief:
        """The belief with H of a node near a contact, at which H is `exact`."""
        far = (at - belief.node[0], place - belief.node[1], (h - belief.node[2]) / self.ln_modulus(h)[1])
        if all([abs(distance) <= limit for distance, limit in zip(far, NODE, strict=True)]):
            return belief
        covariance = belief.covariance.copy()
        if belief.slopes is not None:
            covariance.flat[self._drifting] += DRIFT**2
        return belief._replace(node=(at, place, h), slopes=exact, covariance=covariance)

    def learnt(self, fit: Fit, alone: Alone, keep: float = 1.0) -> Belief:
        """The belief after the filter has learnt a fit of it, and noise alone what `alone` says, of which each sample
        leaves a share `keep`."""
        belief, kept = fit.belief, keep**alone.samples
        covariance = belief.covariance - fit.PH @ fit.last.precision @ fit.PH.T
        covariance = 0.5 * (covariance + covariance.T)
        faded = self._faded ** (0.5 * fit.samples)
        covariance *= faded[:, None] * faded
        covariance.flat[:: self.size + 1] += 1 - faded * faded
        if keep < 1.0:
            covariance[0] /= keep ** (0.25 * fit.samples)
            covariance[:, 0] /= keep ** (0.25 * fit.samples)
        return belief._replace(
            mean=faded * (belief.mean + fit.PH @ fit.last.weighted),
            covariance=covariance,
            offset=(fit.ln_force - alone.ln_force, fit.place_mm - alone.place_mm),
            place_sigma_mm=fit.place_sigma_mm * math.sqrt(fit.samples),
            ln_force=alone.ln_force,
            place_mm=alone.place_mm,
            tangent=alone.tangent,
            information=kept * belief.information + alone.information,
            score=kept * belief.score + alone.score,
            square=kept * belief.square + alone.square,
            freedom=kept * belief.freedom + alone.own,
            samples=kept * belief.samples + alone.samples,
        )

    def estimate(self, belief: Belief) -> tuple[float, float]:
        """h and its standard deviation."""
        h, sigma = float(belief.mean[0]), math.sqrt(max(float(belief.covariance[0, 0]), 0.0))
        if self.stands(belief):
            h = belief.anchor + belief.score / belief.information
        return h, sigma

    def stands(self, belief: Belief) -> bool:
        """Whether noise alone explains the readings."""
        if not belief.information > 0:
            return False
        square = belief.square - belief.score * belief.score / belief.information
        freedom = max(belief.freedom - 1, 1e-9)
        return square <= freedom * (1 + SLACK) + SURE * math.sqrt(2 * freedom)

    def contact(self, belief: Belief, ln_force: float, place: float) -> tuple[float, float]:
        """Force (N) and place (mm) of a sample of which noise alone says these."""
        more, beside = (0.0, 0.0) if self.stands(belief) else belief.offset
        return math.exp(ln_force + more), place + beside

    def doubt(self, belief: Belief) -> float:
        """Squared length of the nuisances found: what they would have to be, in their standard deviations."""
        return float(belief.mean[1:] @ belief.mean[1:])

    def dominant(self, belief: Belief) -> str:
        """Which doubt makes most of sigma: the one that, known, would take most off it."""
        P = belief.covariance
        taken = {"noise": 0.0}
        for name, own in self.parts.items():
            if own.stop > own.start:
                taken[name] = float(P[0, own] @ np.linalg.solve(P[own, own], P[own, 0]))
        taken["noise"] = 1 / belief.information if belief.information else math.inf
        return max(taken, key=lambda name: taken[name])

    def least_reading(self) -> np.ndarray:
        """(c,) smallest |reading| in microstrain at the lowest force, over the moduli."""
        nodes = self.surfaces.ln_nodes.tolist()
        return np.abs([self.surfaces.at(self.low, node, 0.0).reading for node in nodes]).min(axis=0)

    def inside(self, ln_force: float, place: float) -> tuple[float, float]:
        """The nearest calibrated contact, to linearise at."""
        reach = self.surfaces.reach
        return min(max(ln_force, self.low), self.high), min(max(place, -reach), reach)


def _upper(gram: np.ndarray) -> tuple[float, ...]:
    """The upper triangle of a Gram matrix of (slope, rest, force, place), row by row; zeros where there is no place."""
    if len(gram) == 4:
        (aa, ar, al, am), (_, rr, rl, rm), (_, _, ll, lm), (*_, mm) = gram.tolist()
        return aa, ar, al, am, rr, rl, rm, ll, lm, mm
    (aa, ar, al), (_, rr, rl), (_, _, ll) = gram.tolist()
    return aa, ar, al, 0.0, rr, rl, 0.0, ll, 0.0, 0.0
