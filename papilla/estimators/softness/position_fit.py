"""One sample against the gauges' surfaces where the contact may lie beside the apex: force and position as nuisances.

As `sample_fit`, with one nuisance more: for slopes a in ln E and B = (dr/df, dr/dx), weights v, and a prior of variance
s^2 on x about the apex, the efficient score of ln E is sum v (a - B M^-1 B'v a) (y - r), M = B'v B + diag(1 / s_f^2,
1 / s^2). Readings bend over x, so a sample is linearised where its own force and position are, and what is left of the
bend is taken off to second order. Every sample has its own position: a finger also slides.
"""

import math
from operator import mul
from typing import Any, NamedTuple

import numpy as np

from papilla.estimators.softness.position_surfaces import PositionSection, PositionSurfaces
from papilla.estimators.softness.sample_fit import (
    EMPTY,
    LEAST_CHANNELS,
    NEAR,
    START_STEPS,
    START_STRIDE,
    OwnFit,
    Rules,
    SampleFit,
)

STEPS = 12
"""Gauss-Newton steps for force and position, at most."""
BENT = 0.03
"""Squared misfit that the bend of the readings makes of a step, above which a sample is linearised anew."""
FARTHEST = 0.25
"""Of the reach: longest step of the position."""
LOST = 50.0
"""Squared misfit from which a sample is looked up like a first one: its contact may have jumped."""
SCAN_ERROR = 0.03
"""Relative error of the table that a first sample is looked up in, for its spacing."""
SCAN_STEP = 1.15
"""Ratio by which a force of that table may be off."""


class _Settled(NamedTuple):
    """A sample linearised at its own force and position, E given: rows and errors of the gauges there; M of force and
    position, the steps of these that are left, and the squared misfit after them."""

    force: float
    position: float
    rows: list[tuple[float, ...]]
    own_errors: list[float]
    place_errors: list[float]
    bb: float
    bc: float
    cc: float
    force_step: float
    position_step: float
    left: float


class PositionFitter:
    """Fits single samples; gauge_sigma in microstrain, position_sigma (mm) of the prior, inf for none.

    near : force (N) and position (mm) of the last sample that was learnt from, where the next one is linearised first;
    empty before. Methods and what they give are those of `SampleFitter`.
    """

    def __init__(self, surfaces: PositionSurfaces, gauge_sigma: float, position_sigma: float):
        self.surfaces = surfaces
        self.noise = gauge_sigma**2
        self.near: tuple[float, ...] = ()
        # Beside the apex gauges that mirror each other feel different things.
        alike = (*surfaces.groups, len(surfaces.members))
        self.rules = Rules(LEAST_CHANNELS + 1, alike, tuple(range(surfaces.gauges + 1)))
        self.error_count = len(surfaces.members) + surfaces.gauges + 1
        self._prior = position_sigma**-2.0
        self._spread = position_sigma if self._prior else 0.0
        self._sharers = [len(surfaces.members[group]) for group in surfaces.groups]
        self._own_errors = [[row[group] for group in surfaces.groups] for row in surfaces.errors]
        scan: Any
        nodes, scan = surfaces.at_nodes(START_STRIDE)
        self._scan = scan
        self._ln_tried = [section.ln_modulus for section in self._scan]
        self._table, self._forces, self._places = surfaces.scan(nodes)

    def fit(
        self, readings, used, force, precision: float, section: PositionSection, samples: float
    ) -> SampleFit | None:
        """What a sample says about the modulus, near that of a section; see `SampleFitter.fit`."""
        settled = self._settle(readings, used, force, precision, section, self.near)
        if settled is None or settled.left > LOST:
            settled = self._found_again(readings, used, force, precision, section) or settled
        if settled is None:
            return None
        at, x, rows, own_errors, place_errors = settled[:5]
        # A touch may lie where it lies: its prior counts once, like the errors of the calibration.
        noise, square, prior = self.noise, at * at, self._prior / samples
        aa = ab = ac = bc = am = jbb = jbc = jcc = 0.0
        bb, cc = precision, prior
        bm, cm = precision * (force - at) if precision else 0.0, -prior * x
        terms = []
        for number, (y, row, own, extra, sharers) in enumerate(
            zip(readings, rows, own_errors, place_errors, self._sharers, strict=True)
        ):
            if not used[number]:
                continue
            expected, a, b, c, ff, fx, xx = row
            v = 1.0 / (noise + samples * (own * own * sharers + extra * extra) * square)
            m, va, vb, vc = y - expected, v * a, v * b, v * c
            aa += va * a
            ab += va * b
            ac += va * c
            bb += vb * b
            bc += vb * c
            cc += vc * c
            am += va * m
            bm += vb * m
            cm += vc * m
            jbb += vb * vb
            jbc += vb * vc
            jcc += vc * vc
            terms.append((number, va, vb, vc, ff, fx, xx, own, extra))
        det = bb * cc - bc * bc
        if not det > EMPTY * bb * cc:
            return None
        p, q, r = cc / det, -bc / det, bb / det
        share, shift = p * ab + q * ac, q * ab + r * ac
        total = aa - ab * share - ac * shift
        if not total > EMPTY * aa:
            return None
        # The readings bend over force and position: what the error of these adds to the score is taken off.
        jbb, jbc, jcc = noise * jbb + precision, noise * jbc, noise * jcc
        force_step, step = p * bm + q * cm, q * bm + r * cm
        bend_ff = 0.5 * (force_step * force_step - (p * p * jbb + 2 * p * q * jbc + q * q * jcc))
        bend_fx = force_step * step - (p * q * jbb + (p * r + q * q) * jbc + q * r * jcc)
        bend_xx = 0.5 * (step * step - (q * q * jbb + 2 * q * r * jbc + r * r * jcc))
        score, random, per = am - share * bm - shift * cm, share * share * precision, at / total
        systematic = [0.0] * self.error_count
        groups, kept = self.surfaces.groups, len(self.surfaces.members)
        for number, va, vb, vc, ff, fx, xx, own, extra in terms:
            w = va - share * vb - shift * vc
            score -= w * (bend_ff * ff + bend_fx * fx + bend_xx * xx)
            random += noise * w * w
            systematic[groups[number]] += w * own * per
            systematic[kept + number] = w * extra * per
        systematic[-1] = shift * prior * self._spread / total
        return SampleFit(
            score / total,
            total * total / random,
            systematic,
            at + force_step,
            p * p * jbb + 2 * p * q * jbc + q * q * jcc,
            settled.left,
            x + settled.position_step,
            settled.bb / (settled.bb * settled.cc - settled.bc**2),
            -shift,
        )

    def alone(
        self, readings, used, force, precision: float, section: PositionSection, near: tuple[float, ...] = ()
    ) -> OwnFit | None:
        """The fit of a sample to itself; see `SampleFitter.alone`. near : where to begin if not at the last sample."""
        settled = self._settle(readings, used, force, precision, section, near or self.near)
        if settled is None:
            return None
        square = settled.force**2
        aa = ab = ac = am = 0.0
        for y, use, row, own, extra in zip(readings, used, *settled[2:5], strict=True):
            if use:
                ua = row[1] / (self.noise + (own * own + extra * extra) * square)
                aa += ua * row[1]
                ab += ua * row[2]
                ac += ua * row[3]
                am += ua * (y - row[0] - row[2] * settled.force_step - row[3] * settled.position_step)
        det = settled.bb * settled.cc - settled.bc**2
        p, q, r = settled.cc / det, -settled.bc / det, settled.bb / det
        information = aa - ab * (p * ab + q * ac) - ac * (q * ab + r * ac)
        if not information > EMPTY * aa:
            return None
        return OwnFit(
            settled.left - am * am / information,
            section.ln_modulus + am / information,
            1.0 / information,
            settled.force + settled.force_step,
            p,
            settled.position + settled.position_step,
            r,
            q,
        )

    def expected(self, own: OwnFit, section: PositionSection, variance: float) -> list[tuple[float, float]]:
        """(expected reading, sigma of reading minus expected) of every gauge; see `SampleFitter.expected`."""
        surfaces = self.surfaces
        force, position = surfaces.clamped(own.force), self._within(own.position)
        cell, rows = section.rows(force, math.log(force), position)
        errors = zip(rows, self._own_errors[cell], surfaces.place_errors(position), strict=True)
        return [
            (
                expected,
                math.sqrt(
                    self.noise
                    + (error * error + extra * extra) * force * force
                    + a * a * variance
                    + b * b * own.force_variance
                    + c * c * own.position_variance
                    + 2 * b * c * own.covariance
                ),
            )
            for (expected, a, b, c, *_), error, extra in errors
        ]

    def beyond(self, own: OwnFit) -> float:
        """Squared distance, in its sigmas, by which a fit leaves the calibrated moduli and positions."""
        off = max(abs(own.position) - self.surfaces.reach, 0.0)
        return self.surfaces.beyond(own.ln_modulus) ** 2 / own.variance + off * off / own.position_variance

    def start(self, readings, used, force, precision: float) -> tuple[PositionSection, OwnFit | None]:
        """Where to linearise a first sample, and its own fit there; see `SampleFitter.start`.

        Force and position are looked up in a table at every few nodes of the modulus, and settled from there.
        """
        surfaces, tried = self.surfaces, self._ln_tried
        reach, (low, *_, high) = tried[1] - tried[0], surfaces.nodes
        near = self._look_up(readings, used, force, precision, slice(None))
        settled = [
            self._settle(readings, used, force, precision, section, place)
            for section, place in zip(self._scan, near, strict=True)
        ]
        best = min((one for one in settled if one is not None), key=lambda one: one.left, default=None)
        if best is None:
            return self._scan[0], None
        weights = [0.0 if one is None else math.exp(0.5 * (best.left - one.left)) for one in settled]
        section = surfaces.section(sum(map(mul, weights, tried)) / sum(weights))
        place = (best.force + best.force_step, best.position + best.position_step)
        own = self.alone(readings, used, force, precision, section, place)
        for _ in range(START_STEPS):
            if own is None or own.variance > reach * reach:
                break
            step = min(max(own.ln_modulus - section.ln_modulus, -reach), reach)
            section = surfaces.section(min(max(section.ln_modulus + step, low), high))
            own = self.alone(readings, used, force, precision, section, (own.force, own.position))
            if own is None or step * step < NEAR * own.variance:
                break
        return section, own

    def _found_again(self, readings, used, force, precision, section: PositionSection) -> _Settled | None:
        """A sample that is not near the last one, from the table; None where it fits nowhere else either."""
        nearest = int(np.abs(np.array(self._ln_tried) - section.ln_modulus).argmin())
        near = self._look_up(readings, used, force, precision, slice(nearest, nearest + 1))[0]
        settled = self._settle(readings, used, force, precision, section, near)
        return None if settled is None or settled.left > LOST else settled

    def _look_up(self, readings, used, force: float, precision: float, nodes: slice) -> list[tuple[float, float]]:
        """Force and position that explain a sample best, at some of the tried nodes of the modulus, from a table."""
        use = np.array(used)
        y, table = np.array(readings)[use], self._table[nodes][..., use]
        own, across = np.einsum("ecg,ecg->ec", table, table), table @ y
        scale = np.clip(across / np.maximum(own, 1e-300), 1 / SCAN_STEP, SCAN_STEP)
        left = (scale * (scale * own - 2 * across)) / (self.noise + SCAN_ERROR**2 * (y @ y) / max(len(y), 1))
        left += self._prior * self._places**2
        if precision > 0:
            left += (force - scale * self._forces) ** 2 / (1 / precision + (SCAN_ERROR * force) ** 2)
        best = left.argmin(axis=1)
        forces = self._forces[best] * scale[np.arange(len(best)), best]
        return list(zip(forces.tolist(), self._places[best].tolist(), strict=True))

    def _settle(self, readings, used, force, precision, section: PositionSection, near) -> _Settled | None:
        """Gauss-Newton for force and position at the modulus of a section, within domain and reach."""
        surfaces, noise, prior = self.surfaces, self.noise, self._prior
        at, x = near or (force if precision else surfaces.high_force, 0.0)
        at, x = surfaces.clamped(at), self._within(x)
        longest = FARTHEST * surfaces.reach
        for _ in range(STEPS):
            cell, rows = section.rows(at, math.log(at), x)
            own_errors, place_errors, square = self._own_errors[cell], surfaces.place_errors(x), at * at
            bb, bc, cc = precision, 0.0, prior
            bm, cm = precision * (force - at) if precision else 0.0, -prior * x
            mm = bm * (force - at) - cm * x if precision else -cm * x
            bends = []
            for y, use, row, own, extra in zip(readings, used, rows, own_errors, place_errors, strict=True):
                if use:
                    expected, _, b, c, ff, fx, xx = row
                    u = 1.0 / (noise + (own * own + extra * extra) * square)
                    m, ub, uc = y - expected, u * b, u * c
                    bb += ub * b
                    bc += ub * c
                    cc += uc * c
                    bm += ub * m
                    cm += uc * m
                    mm += u * m * m
                    bends.append((u, ff, fx, xx))
            det = bb * cc - bc * bc
            if not det > EMPTY * bb * cc:
                return None
            force_step, step = (cc * bm - bc * cm) / det, (bb * cm - bc * bm) / det
            bend = 0.0
            for u, ff, fx, xx in bends:
                more = 0.5 * (ff * force_step + 2 * fx * step) * force_step + 0.5 * xx * step * step
                bend += u * more * more
            if bend <= BENT:
                break
            next_at = surfaces.clamped(at + min(max(force_step, -0.5 * at), at))
            next_x = self._within(x + min(max(step, -longest), longest))
            if next_at == at and next_x == x:
                break
            at, x = next_at, next_x
        left = mm - bm * force_step - cm * step
        return _Settled(at, x, rows, own_errors, place_errors, bb, bc, cc, force_step, step, left)

    def _within(self, position: float) -> float:
        """The nearest calibrated position, to linearise at."""
        reach = self.surfaces.reach
        return min(max(position, -reach), reach)
