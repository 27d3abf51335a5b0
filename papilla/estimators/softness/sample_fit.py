"""One sample against the gauges' surfaces: force as a nuisance, and what is left for the modulus.

For readings y = r(f, E) + e with slopes a = dr / d ln E, b = dr / df and weights v, the force being known as f_m with
variance s^2, the score of ln E with the force profiled out is sum w (y - r), w = v (a - b ab / bb), ab = sum v a b,
bb = sum v b^2 + 1 / s^2: the efficient score (Bickel et al. 1993, ISBN 978-0387984735, section 2.4).
"""

import math
from operator import mul
from typing import NamedTuple

from papilla.estimators.softness.surfaces import GaugeSurfaces, Section

START_STRIDE = 4
"""Every so many nodes of the modulus are tried for a first sample."""
START_STEPS = 3
LEAST_CHANNELS = 3
"""Readings and force: two unknowns, and one that can contradict."""
NEAR = 1e-2
"""Square of a Gauss-Newton step, in variances of the modulus, that is small enough."""
EMPTY = 1e-9
"""Share of the modulus' information that is left when the force is unknown, below which it is rounding."""


class SampleFit(NamedTuple):
    """What one sample adds to an average of many, linearised at one modulus.

    step : by how much ln E should change, with random variance 1 / information; systematic : change of `step` by one
    sigma of each group's calibration error. force, force_variance : N, at the modulus before the step.
    most : squared misfit at that modulus, which the sample's own fit can only make smaller.
    position, position_variance, position_slope : mm of the contact where it is an unknown, E given; slope in ln E.
    """

    step: float
    information: float
    systematic: list[float]
    force: float
    force_variance: float
    most: float
    position: float = math.nan
    position_variance: float = math.nan
    position_slope: float = math.nan


class OwnFit(NamedTuple):
    """One sample on its own, noise and calibration errors taken together.

    chi2 : squared misfit once modulus and force are fitted; ln_modulus, variance : of that fit; force, force_variance :
    N, at the modulus where it was linearised. position, position_variance, covariance : mm of the contact, where it is
    an unknown, and its covariance with the force.
    """

    chi2: float
    ln_modulus: float
    variance: float
    force: float
    force_variance: float
    position: float = math.nan
    position_variance: float = math.nan
    covariance: float = math.nan


class Rules(NamedTuple):
    """When channels (the gauges and, last, the force) can contradict each other.

    least : channels that it takes, one more than unknowns. alike : number of the group of each; gauges that mirror each
    other may be wrong alike. kinds : channels of one kind count once where it is to be found out who is wrong.
    """

    least: int
    alike: tuple[int, ...]
    kinds: tuple[int, ...]


class SampleFitter:
    """Fits single samples; gauge_sigma in microstrain. error_count : length of `SampleFit.systematic`."""

    def __init__(self, surfaces: GaugeSurfaces, gauge_sigma: float):
        self.surfaces = surfaces
        self.noise = gauge_sigma**2
        alike = (*surfaces.groups, len(surfaces.members))
        self.rules = Rules(LEAST_CHANNELS, alike, alike)
        self.error_count = len(surfaces.members)
        self._sharers = list(map(len, surfaces.members))
        self._errors = [
            [(error, error * error, error * error * share) for error, share in zip(row, self._sharers, strict=True)]
            for row in surfaces.errors
        ]
        self._tried, self._scan = surfaces.at_nodes(START_STRIDE)
        self._ln_tried = [section.ln_modulus for section in self._scan]
        self._counts: dict[tuple[bool, ...], list[int]] = {}

    def fit(self, readings, used, force, precision: float, section: Section, samples: float) -> SampleFit | None:
        """What a sample says about the modulus, near that of a section.

        Parameters
        ----------
        used : g times True for the gauges to use. force : measured, with `precision` = 1 / variance, 0 where unknown.
        samples : how many are averaged in the end: noise counts so many times less than calibration errors.

        None where the sample says nothing about the modulus, or about the force that is unknown.
        """
        at, ln_force = self._linearise_at(readings, used, force, precision, section.ln_modulus)
        if at == 0.0:
            return None
        noise, square = self.noise, at * at
        cell, points = section.evaluate(ln_force)
        errors = self._errors[cell]
        rows, terms = [], []
        aa = ab = ac = bc = bb2 = am = most = own_bm = 0.0
        bb = own_bb = precision
        for count, (q, a, slope, bend), (error, alone, shared) in zip(self._count(used), points, errors, strict=True):
            a, b, c = at * a, q + slope, slope + bend
            v, u = 1.0 / (noise + samples * shared * square), 1.0 / (noise + alone * square)
            va, vb = v * a, v * b
            rows.append((at * q, va, vb, u, u * b))
            terms.append((count, va, vb, error))
            na, nb = count * va, count * vb
            aa += na * a
            ab += na * b
            ac += na * c
            bb += nb * b
            bc += nb * c
            bb2 += nb * vb
            own_bb += count * u * b * b
        bm = offset = precision * (force - at) if precision else 0.0
        own_bm = offset
        for y, use, group in zip(readings, used, self.surfaces.groups, strict=True):
            if use:
                expected, va, vb, u, ub = rows[group]
                m = y - expected
                am += va * m
                bm += vb * m
                most += u * m * m
                own_bm += ub * m
        if not bb > 0:
            return None
        share = ab / bb
        total = aa - ab * share
        if not total > EMPTY * aa:
            return None
        change, variance = bm / bb, (noise * bb2 + precision) / (bb * bb)
        # The readings bend over force: what the profiled force's own error adds to the score is taken off.
        score = am - share * bm - 0.5 * (ac - share * bc) / at * (change * change - variance)
        random, systematic, shift = share * share * precision, [], at / total
        for count, va, vb, error in terms:
            w = va - vb * share
            weighed = count * w
            random += noise * w * weighed
            systematic.append(weighed * error * shift)
        if precision:
            most += offset * (force - at)
        most -= own_bm * own_bm / own_bb
        return SampleFit(score / total, total * total / random, systematic, at + change, variance, most)

    def alone(self, readings, used, force, precision: float, section: Section) -> OwnFit | None:
        """The fit of a sample to itself, near the modulus of a section; arguments and None as of `fit`."""
        at, ln_force = self._linearise_at(readings, used, force, precision, section.ln_modulus)
        if at == 0.0:
            return None
        cell, points = section.evaluate(ln_force)
        errors, groups = self._errors[cell], self.surfaces.groups
        rows = [
            (at * q, at * a, q + slope, 1.0 / (self.noise + alone * at * at))
            for (q, a, slope, _), (_, alone, _) in zip(points, errors, strict=True)
        ]
        aa = ab = am = 0.0
        bb, bm = precision, precision * (force - at) if precision else 0.0
        mm = bm * (force - at) if precision else 0.0
        for y, use, group in zip(readings, used, groups, strict=True):
            if use:
                expected, a, b, u = rows[group]
                m, ua, ub = y - expected, u * a, u * b
                aa += ua * a
                ab += ua * b
                am += ua * m
                bb += ub * b
                bm += ub * m
                mm += u * m * m
        if not bb > 0:
            return None
        own, score = aa - ab * ab / bb, am - ab / bb * bm
        if not own > EMPTY * aa:
            return None
        chi2 = mm - bm * bm / bb - score * score / own
        return OwnFit(chi2, section.ln_modulus + score / own, 1.0 / own, at + bm / bb, 1.0 / bb)

    def expected(self, own: OwnFit, section: Section, variance: float) -> list[tuple[float, float]]:
        """(expected reading, sigma of reading minus expected) of every gauge, at the force of a fit and the modulus of
        a section, `variance` being that of its ln E."""
        surfaces = self.surfaces
        force = min(max(own.force, surfaces.low_force), surfaces.high_force)
        cell, points = section.evaluate(math.log(force))
        found = []
        for (q, a, slope, _), (_, alone, _) in zip(points, self._errors[cell], strict=True):
            b = q + slope
            whole = self.noise + (alone + a * a * variance) * force * force + b * b * own.force_variance
            found.append((force * q, math.sqrt(whole)))
        return [found[group] for group in surfaces.groups]

    def beyond(self, own: OwnFit) -> float:
        """Squared distance, in its sigma, by which a fit's modulus leaves the calibrated ones."""
        return self.surfaces.beyond(own.ln_modulus) ** 2 / own.variance

    def start(self, readings, used, force, precision: float) -> tuple[Section, OwnFit | None]:
        """Where to linearise a first sample, and its own fit there.

        The mean of the modulus under the sample's likelihood at every few nodes; where that is narrower than these are
        apart, its maximum by Gauss-Newton steps.
        """
        surfaces, tried = self.surfaces, self._ln_tried
        reach, (low, *_, high) = tried[1] - tried[0], surfaces.nodes
        left = self._misfits(readings, used, force, precision)
        least = min(left)
        weights = [math.exp(0.5 * (least - value)) for value in left]
        section = surfaces.section(sum(map(mul, weights, tried)) / sum(weights))
        own = self.alone(readings, used, force, precision, section)
        for _ in range(START_STEPS):
            if own is None or own.variance > reach * reach:
                break
            step = min(max(own.ln_modulus - section.ln_modulus, -reach), reach)
            section = surfaces.section(min(max(section.ln_modulus + step, low), high))
            own = self.alone(readings, used, force, precision, section)
            if own is None or step * step < NEAR * own.variance:
                break
        return section, own

    def _misfits(self, readings, used, force: float, precision: float) -> list[float]:
        """Squared misfit of a sample at every few nodes of the modulus, its force fitted at each."""
        surfaces, counts = self.surfaces, self._count(used)
        sums, squares = ([0.0] * len(counts) for _ in range(2))
        for y, use, group in zip(readings, used, surfaces.groups, strict=True):
            if use:
                sums[group] += y
                squares[group] += y * y
        norm = sum(squares)
        table = surfaces.force_table(used) if norm > 0 else None
        if table is not None:
            ln_forces = table.ln_forces(0.5 * math.log(norm), self._tried)
        elif precision > 0:
            ln_forces = [math.log(surfaces.clamped(force))] * len(self._tried)
        else:
            return [0.0] * len(self._tried)
        found = []
        for ln_force, section in zip(ln_forces, self._scan, strict=True):
            at = math.exp(ln_force)
            bb, bm = precision, precision * (force - at) if precision else 0.0
            mm = bm * (force - at) if precision else 0.0
            cell, points = section.evaluate(ln_force)
            for count, total, square, (q, _, slope, _), (_, alone, _) in zip(
                counts, sums, squares, points, self._errors[cell], strict=True
            ):
                expected, b = at * q, q + slope
                u, rest = 1.0 / (self.noise + alone * at * at), total - count * expected
                bb += u * b * b * count
                bm += u * b * rest
                mm += u * (square - expected * (total + rest))
            found.append(mm - bm * bm / bb)
        return found

    def _count(self, used) -> list[int]:
        """How many gauges of each group are used."""
        counts = self._counts.get(used)
        if counts is None:
            self._counts[used] = counts = [sum(used[number] for number in own) for own in self.surfaces.members]
        return counts

    def _linearise_at(self, readings, used, force: float, precision: float, ln_modulus: float) -> tuple[float, float]:
        """Force (N) and its logarithm from the norm of the used readings; from the force itself where that is no
        measure of it; 0 where neither is."""
        surfaces = self.surfaces
        table = surfaces.force_table(used)
        if False in used:
            readings = [y for y, use in zip(readings, used, strict=True) if use]
        norm = sum(map(mul, readings, readings))
        if table is not None and norm > 0:
            ln_force, _ = table.ln_force(0.5 * math.log(norm), ln_modulus)
            return math.exp(ln_force), ln_force
        if precision > 0:
            at = surfaces.clamped(force)
            return at, math.log(at)
        return 0.0, 0.0
