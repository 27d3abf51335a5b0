"""Change of a linear press by large strain: a table of presses with and without it, for all fingers of one geometry.

With neo-Hookean layers (or material cards of one shape) all strains of a geometry depend only on

  F / E_inner,    E / E_inner,    r = E_outer / E_inner.

A table contains presses of one r, linear and at finite strain on the same mesh. A polynomial in ln(F/E_inner) and
ln(A/A_rigid) is fitted to their differences; A is the linear contact area and A_rigid that on a rigid flat. The area
stands for the specimen: presses of equal force and area strain the finger alike, on any flat specimen.

Cost: one evaluation of a polynomial per press. Between tables r is interpolated. Outside of its table a press is
changed like the nearest one inside (`LARGEST_FORCE_RATIO`), and its status says so.
"""

import json
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from papilla.core import cache
from papilla.core.outside import json_value, read_json
from papilla.core.units import PER_CENT
from papilla.fem.pressing.press import CONTACT_MEASURES, SILENT_SD_SHARE, Press
from papilla.fem.pressing.specimen_strain import with_specimen_strain
from papilla.fem.reduction.gauges import GAUGE_QUANTITIES
from papilla.fem.reduction.reduced import ReducedFinger, kept
from papilla.model.finger import DEFAULT_FINGER

LARGE_STRAIN_SCHEMA = "papilla.large_strain/1"
SHIPPED_STRAIN_TABLES = DEFAULT_FINGER.parent / "default_large_strain.json"
ALL_SHIPPED = (SHIPPED_STRAIN_TABLES, SHIPPED_STRAIN_TABLES.with_name("published_large_strain.json"))
STRAIN_TABLES_MODULE = "papilla.fem.finite.strain_tables"
"""Module whose code makes the tables in the cache."""

FIRST_GAUGE = len(CONTACT_MEASURES)
"""Column of a table in which the values of the gauges begin: they follow those of `MEASURES`."""

POLYNOMIAL_POWERS = [
    [(i, j) for i in range(force + 1) for j in range(min(area, force - i) + 1)]
    for force, area in ((5, 4), (4, 4), (4, 3), (3, 3))
]
"""Powers of force and area in the polynomials: 20, 15, 14 or 10 terms. The change varies much with the force, as the
contact approaches the gauges and the bone, and little with the area."""

PRESSES_A_TERM, CROSS_VALIDATED_PRESSES = 1.4, 24
"""Presses needed per term of the polynomial; and the number of presses from which each one is predicted by a fit to all
others. Shipped tables have 36 presses, those of a user's finger 20."""

LEAST_PRESSES = len(POLYNOMIAL_POWERS[-1]) + 1
"""Smallest number of presses of a table: one more than the terms of its polynomial."""

TABLE_ARRAYS = ("force", "modulus", "linear", "finite")
"""Arrays of a table in files."""

MODEL_ERROR_FREE, MODEL_ERROR_STUCK = 0.005, 0.0065
"""Relative error of S_d (one sigma) of a press with large strain, without friction and with it. It contains the table,
its coarse mesh and the mesh of the linear press: 0.42 and 0.23 % rms against the axisymmetric reference, which shares
nothing with these presses, over twelve drawn fingers (`python benchmarks/own_fingers.py --draws 12 --seed 852265567`).
And it contains the error of the reference: from a second independent code it differs by 0.2 and 0.57 % rms on a tall
dome (docs/adr/0051)."""

LOWERED_FRICTION = (0.7, 0.85)
"""Fractions of a coefficient of friction for which linear presses are made, too; between them the share of stick is
interpolated linearly."""

BETWEEN_FRICTION_ERROR = 0.003
"""Relative error of S_d (one sigma) at a friction between none and stick, whose share of stick is an estimate."""

SAME_RATIO = 1e-3
"""Relative difference up to which two ratios of moduli are one."""

SEPARATE_LOG_RATIO = 0.5
"""Smallest difference of ln r at which two tables count as two: the polynomial in ln r has one term per group of
tables. Closer tables are averaged, because a polynomial through both would amplify their errors."""

LEAST_TABLES = 3
"""Number of tables between which the ratio is interpolated: a parabola in ln r."""

TABLE_LOG_MARGIN = 0.05
"""How far outside of the table the logarithms of force and area may lie."""

HARDER_LOG_AREA = 0.15
"""How far the logarithm of the area may lie below that on a rigid flat. Nothing is harder than rigid, but on the coarse
mesh of a user's finger the areas of light presses are up to 9 % larger than on a fine one."""

LARGEST_FORCE_RATIO = 2.25
"""Largest force, relative to the largest one of a table, for which a press is changed like that one; the same factor
below the smallest. At 1.6 times the largest force S_d was within 1.1 % of finite strain and gauges within 6 % of the
largest; linear presses were 2.3 and 10 % off. On a dome of 8, 8, 7 mm S_d was 2.4 % off at 1.3 times and 4.7 % at 2."""

CONTINUED_SD, CONTINUED_GAUGE = 0.026, 0.03
"""Errors (one sigma) of such a press: of its S_d, 2.6 % rms at 1.3 and 2 times the largest force on that dome, stuck
and without friction; and of a gauge relative to the largest."""

CONTINUED_WORDS = f"S_d within {2 * PER_CENT * CONTINUED_SD:g} %, gauges within {2 * PER_CENT * CONTINUED_GAUGE:g} %"

BEYOND_STRAIN_TABLES = "beyond the forces at which large strain was measured"
"""Part of the status of such a press."""


@dataclass(frozen=True, eq=False)
class LargeStrain:
    """Presses of one geometry and ratio of moduli; n presses, g gauges, q of `gauges.QUANTITIES`.

    ratio : E_outer / E_inner. friction : of both presses, 0 or infinite (stuck).
    force (n,) : F / E_inner, mm2. modulus (n,) : of the specimen, over E_inner.
    linear, finite : (n, 3 + q g) indentation (mm), area (mm2), peak pressure / E_inner, and the gauges' values.
    """

    ratio: float
    force: np.ndarray
    modulus: np.ndarray
    linear: np.ndarray
    finite: np.ndarray
    friction: float = 0.0

    @cached_property
    def fit(self) -> "TableFit":
        """The polynomials of the table."""
        ln_force, ln_area, count = np.log(self.force), np.log(self.linear[:, 1]), len(self.force)
        hardest = self.modulus == self.modulus.max()
        # The area on a rigid flat is the reference: ln(A/A_rigid) is 0 for the hardest specimen at any force, and grows
        # with softness.
        rigid = np.polyfit(ln_force[hardest], ln_area[hardest], 2)
        softness = ln_area - np.polyval(rigid, ln_force)
        levels = np.unique(ln_force)
        groups = [softness[ln_force == level] for level in levels]
        ends = np.array([[side(group) for group in groups] for side in (np.min, np.max)])
        gauges = self.linear[:, FIRST_GAUGE:].reshape(count, len(GAUGE_QUANTITIES), -1)
        # A single gauge may read nearly nothing, so its change is relative to all gauges of the press.
        sizes = np.broadcast_to(np.linalg.norm(gauges, axis=2, keepdims=True), gauges.shape)
        norms = np.concatenate([self.linear[:, :FIRST_GAUGE], sizes.reshape(count, -1)], axis=1)
        ranges = tuple((float(coordinate.min()), float(np.ptp(coordinate))) for coordinate in (ln_force, softness))
        differences = (self.finite - self.linear) / norms
        enough = [powers for powers in POLYNOMIAL_POWERS if count >= PRESSES_A_TERM * len(powers)]
        candidates = []
        for powers in map(
            np.array, enough[: None if count >= CROSS_VALIDATED_PRESSES else 1] or POLYNOMIAL_POWERS[-1:]
        ):
            terms = _monomials(ln_force, softness, ranges, powers)
            coefficients = np.linalg.lstsq(terms, differences)[0]
            # Share of an error of one press that the fit does not follow (1 - leverage).
            residual_share = 1 - np.einsum("nt,tn->n", terms, np.linalg.pinv(terms))[:, None]
            exponent = 1.0 if count >= CROSS_VALIDATED_PRESSES else 0.5
            errors = (terms @ coefficients - differences) / residual_share**exponent
            candidates.append(TableFit(rigid, softness, levels, ends, powers, ranges, norms, coefficients, errors))
        # With many presses the polynomial that predicts left-out ones best
        return min(candidates, key=lambda fit: float((fit.errors[:, FIRST_GAUGE:] ** 2).sum()))

    def changes(self, force, softness) -> np.ndarray:
        """Changes (..., 3 + q g) at F / E_inner (mm2) and ln(A/A_rigid): relative ones of `MEASURES`; those of gauges
        are divided by the root of the sum of squares of their linear values."""
        return _monomials(np.log(force), np.asarray(softness), self.fit.ranges, self.fit.powers) @ self.fit.coefficients

    def covers(self, force: float, softness: float) -> bool:
        """Whether a press lies within the range of the table."""
        levels, at = self.fit.levels, np.log(force)
        if not levels[0] - TABLE_LOG_MARGIN <= at <= levels[-1] + TABLE_LOG_MARGIN:
            return False
        low, high = self.softness_between(at)
        return bool(low - HARDER_LOG_AREA <= softness <= high + TABLE_LOG_MARGIN)

    def nearest(self, force: float, softness: float) -> tuple[tuple[float, float], bool]:
        """The force and softness within the table that are nearest to a press (its own if the table covers it), and
        whether the press lies at most `LARGEST_FORCE_RATIO` outside."""
        if self.covers(force, softness):
            return (force, softness), True
        least, most = float(self.force.min()), float(self.force.max())
        clipped = float(np.clip(force, least, most))
        near = least / LARGEST_FORCE_RATIO <= force <= LARGEST_FORCE_RATIO * most and self.covers(clipped, softness)
        return (clipped, float(np.clip(softness, *self.softness_between(np.log(clipped))))), near

    def softness_between(self, ln_force: float) -> tuple[float, float]:
        """ln(A/A_rigid) of the hardest and the softest specimen at a force, or at the nearest force of the table."""
        low, high = (float(np.interp(ln_force, self.fit.levels, ends)) for ends in self.fit.ends)
        return low, high

    def sd_error(self, weights: np.ndarray) -> float:
        """Root mean square relative error of S_d for readings weighted by (q, g), each press being predicted by a fit
        to all others. If S_d says nothing, it is the error of the readings."""
        predicted = self.finite[:, FIRST_GAUGE:] + self.fit.errors[:, FIRST_GAUGE:] * self.fit.norms[:, FIRST_GAUGE:]
        both = (values.reshape(len(values), *weights.shape) for values in (predicted, self.finite[:, FIRST_GAUGE:]))
        refitted, true = ((weights * values).sum(axis=-2) for values in both)
        sd, largest = true.std(axis=-1), np.abs(true).max(axis=-1)
        silent = (sd <= SILENT_SD_SHARE * largest).any()
        off = np.abs(refitted - true).max(axis=-1) / largest if silent else refitted.std(axis=-1) / sd - 1
        return float(np.sqrt(np.mean(off**2)))

    def to_json(self) -> dict:
        """The table as plain values."""
        # Rounded to seven digits; further digits differ from machine to machine
        arrays = {name: np.vectorize(lambda value: float(f"{value:.7g}"))(getattr(self, name)) for name in TABLE_ARRAYS}
        return {
            "ratio": self.ratio,
            "stuck": self.friction > 0,
            **{name: array.tolist() for name, array in arrays.items()},
        }

    @classmethod
    def from_json(cls, table: dict) -> "LargeStrain":
        """The table of `to_json`."""
        arrays = {name: np.asarray(table[name], float) for name in TABLE_ARRAYS}
        return cls(float(table["ratio"]), **arrays, friction=math.inf if table["stuck"] else 0.0)


@dataclass(frozen=True, eq=False)
class TableFit:
    """The polynomials of a table, t terms; n presses, l forces.

    rigid : (3,) of ln A_rigid (A in mm2) over ln force, a parabola through the hardest specimen's presses. softness :
    (n,) ln(A/A_rigid). levels : (l,) ln force, rising; ends : (2, l) smallest and largest softness at each. norms :
    (n, 3 + q g) by which changes are divided. coefficients : (t, 3 + q g) of the changes. errors : (n, 3 + q g) of each
    press's changes. With many presses each one is predicted by a fit to all others. With few presses each one is at a
    corner of the table, and a fit without it would extrapolate far; then the errors are the residuals, divided by the
    share of an error that remains in a residual.
    """

    rigid: np.ndarray
    softness: np.ndarray
    levels: np.ndarray
    ends: np.ndarray
    powers: np.ndarray
    ranges: tuple[tuple[float, float], ...]
    norms: np.ndarray
    coefficients: np.ndarray
    errors: np.ndarray


def _monomials(ln_force, softness, ranges: tuple[tuple[float, float], ...], powers: np.ndarray) -> np.ndarray:
    """Products (..., t) of powers (t, 2) of both coordinates, -1 to 1 over their ranges (low, width)."""
    x, y = (
        np.asarray(2 * (coordinate - low) / width - 1)
        for coordinate, (low, width) in zip((ln_force, softness), ranges, strict=True)
    )
    return x[..., None] ** powers[:, 0] * y[..., None] ** powers[:, 1]


def at_ratio(tables: Sequence[LargeStrain], ratio: float, stuck: bool = False) -> tuple[tuple[LargeStrain, float], ...]:
    """Tables of one geometry and their weights for a ratio of moduli, without friction or stuck; empty if none is
    known. Between three or more tables of rising ratios it is interpolated."""
    tables = [table for table in tables if (table.friction > 0) == stuck]
    for table in tables:
        if abs(ratio / table.ratio - 1) < SAME_RATIO:
            return ((table, 1.0),)
    nodes, at = np.log([table.ratio for table in tables]), np.log(ratio)
    # Tables close to each other count as one node of the interpolation.
    terms = 1 + int(np.sum(np.diff(nodes) > SEPARATE_LOG_RATIO))
    if terms < LEAST_TABLES or not nodes[0] <= at <= nodes[-1]:
        return ()
    # Weights of a polynomial in ln r through the tables (by least squares where there are more tables than terms).
    weights = np.vander([at - nodes[0]], terms)[0] @ np.linalg.pinv(np.vander(nodes - nodes[0], terms))
    return tuple(zip(tables, weights.tolist(), strict=True))


def with_large_strain(reduced: ReducedFinger, linear: Press, *, beyond: bool = False) -> Press | None:
    """A linear press, without friction or stuck, with the change by large strain; None if no table covers it.

    The pressure stays the linear one: force, nodes and the integral of the pressure are the same. A press that is
    harder or lighter than those of the tables, by `LARGEST_FORCE_RATIO` at most, is changed like the nearest one, and
    its status says so. beyond : treat every other press like this, too, instead of returning None."""
    tables = tables_of(reduced, stuck=linear.friction > 0)
    if not tables:
        return None
    force = linear.force / reduced.layers[1, 1]
    softness = softness_in_each(tables, force, linear.contact_area)
    # Outside of a table: the change of the nearest press inside, because linear presses were further off
    # (`LARGEST_FORCE_RATIO`).
    nearest = [table.nearest(force, soft) for (table, _), soft in zip(tables, softness, strict=True)]
    if not (beyond or all(near for _, near in nearest)):
        return None
    parts = [weight * table.changes(*place) for (table, weight), (place, _) in zip(tables, nearest, strict=True)]
    changes = np.sum(parts, axis=0)
    norms = np.linalg.norm(linear.values, axis=1, keepdims=True)
    changed = {name: getattr(linear, name) * (1 + changes[k]) for k, name in enumerate(CONTACT_MEASURES)}
    changed["values"] = linear.values + norms * changes[FIRST_GAUGE:].reshape(linear.values.shape)
    strained = _with(reduced, linear, changed)
    if [place for place, _ in nearest] == [(force, soft) for soft in softness]:
        return strained
    return replace(strained, status=f"{strained.status}, {BEYOND_STRAIN_TABLES}: {CONTINUED_WORDS}")


def softness_in_each(tables: tuple[tuple[LargeStrain, float], ...], force: float, area: float) -> list[float]:
    """ln(A/A_rigid) at which each weighted table is evaluated, for a press by F / E_inner (mm2) with a contact area
    (mm2).

    Each table is evaluated at the same relative position between its hardest and its softest specimen as the press has
    at its own ratio of moduli, because the same specimens span half as much of ln(A/A_rigid) at ratio 1 as at 4, and a
    quarter more at 8.
    """
    ends = np.array([table.softness_between(math.log(force)) for table, _ in tables])
    weights = np.array([weight for _, weight in tables])
    rigid = sum(weight * np.polyval(table.fit.rigid, math.log(force)) for table, weight in tables)
    low, high = weights @ ends
    share = (math.log(area) - rigid - low) / (high - low)
    return [float(least + share * (most - least)) for least, most in ends]


def between_ends(
    reduced: ReducedFinger,
    small_strain: Press,
    ends: tuple[Press, Press],
    strained: tuple[Press, Press],
    linear: Callable[[float], Press],
) -> Press:
    """A linear press with a friction between none and stick, with the change by large strain.

    ends : linear presses by the same force without friction and stuck; strained : the same with large strain; `linear`
    makes linear presses with other coefficients. Where points slip, the effect of friction is proportional to the
    coefficient mu, the same at large and at small strain. But full stick has 1/k times the effect at large strain. So
    the share of stick for mu at large strain is the share for k mu in linear presses.
    """
    (free, stuck), (free_large, stuck_large) = ends, strained
    small, large = stuck.reading - free.reading, stuck_large.reading - free_large.reading
    if not (small.any() and large.any()):
        return replace(free_large, friction=small_strain.friction)
    # k mu, k being the effect of stick at small strain over that at large strain.
    lower = small_strain.friction * float(np.linalg.norm(small) / np.linalg.norm(large))
    # Share of stick at some lower coefficients, from linear presses; between them a straight line is enough.
    marks = [small_strain.friction * share for share in (*LOWERED_FRICTION, 1.0)]
    readings = [linear(mark).reading for mark in marks[:-1]] + [small_strain.reading]
    shares = [float(small @ (reading - free.reading) / (small @ small)) for reading in readings]
    share = min(float(np.interp(lower, [0.0, *marks], [0.0, *shares])), 1.0)
    both = (free_large, 1 - share), (stuck_large, share)
    mixed = {name: sum(weight * getattr(end, name) for end, weight in both) for name in ("values", *CONTACT_MEASURES)}
    return _with(reduced, small_strain, mixed)


def _with(reduced: ReducedFinger, small_strain: Press, changed: dict) -> Press:
    """A press with the gauges' `values` (q, g) and the `MEASURES` as changed by large strain."""
    error = large_strain_error(reduced, small_strain.friction)
    skin = reduced.skin_thickness, float(reduced.layers[0, 1])
    strained = with_specimen_strain(replace(small_strain, large_strain=True, **changed), skin)
    change = (
        "readings to" if small_strain.silent else f"{PER_CENT * (strained.sd / small_strain.sd - 1):+.1f} % in S_d, to"
    )
    unit = "%" if small_strain.silent else "% of it"
    note = f"large strain included ({change} {PER_CENT * error:.2f} {unit})"
    return replace(strained, status=f"{strained.status}; {note}")


@kept()
def large_strain_error(reduced: ReducedFinger, friction: float) -> float:
    """Relative error of S_d (one sigma) with large strain: the model's, or the tables' own if they fit worse than it
    says; 0 if there is no table."""
    ends = [(stuck, [table for table, _ in tables_of(reduced, stuck)]) for stuck in ends_of(friction)]
    worst = max(error_of_tables(tables, reduced.weights, stuck) for stuck, tables in ends)
    return math.hypot(worst, BETWEEN_FRICTION_ERROR) if worst and 0 < friction < math.inf else worst


def error_of_tables(tables: Sequence[LargeStrain], weights: np.ndarray, stuck: bool) -> float:
    """Relative error of S_d (one sigma), for readings weighted by (q, g): that of the model, or of the worst table if
    it is larger; 0 without tables."""
    model = MODEL_ERROR_STUCK if stuck else MODEL_ERROR_FREE
    return max((max(model, table.sd_error(weights)) for table in tables), default=0.0)


def softest_ratio(key: str) -> float:
    """Smallest E / E_inner of a specimen for which large strain of a geometry is known; 0 without tables."""
    return max((float(table.modulus.min()) for table in known(key)), default=0.0)


def tables_of(reduced: ReducedFinger, stuck: bool = False) -> tuple[tuple[LargeStrain, float], ...]:
    """The tables that apply to a reduced finger, with their weights; they are made if the finger can make them. There
    are none beside the apex."""
    if reduced.at != (0.0, 0.0) or len(reduced.layers) < 2:
        return ()
    ratio = float(reduced.layers[0, 1] / reduced.layers[1, 1])
    tables = at_ratio(known(reduced.strain_key), ratio, stuck)
    if not tables and reduced.strain_source is not None:
        reduced.strain_source(stuck)
        tables = at_ratio(known(reduced.strain_key), ratio, stuck)
    return tables


def is_known(reduced: ReducedFinger, friction: float) -> bool:
    """Whether tables for a reduced finger and a friction are known; a friction between none and stick needs both."""
    return all(tables_of(reduced, stuck) for stuck in ends_of(friction))


def ends_of(friction: float) -> tuple[bool, ...]:
    """The tables that a coefficient of friction needs: without friction (False), stuck (True), or both."""
    return (False, True) if 0 < friction < math.inf else (friction > 0,)


def known(key: str) -> tuple[LargeStrain, ...]:
    """The tables of a geometry by rising ratio, from the cache or from the package; empty if there are none."""
    return _known(key, cache.folder()) if key else ()


def keep(key: str, tables: Iterable[LargeStrain]) -> None:
    """Add tables of a geometry to the cache, where `known` finds them."""
    new = {(table.friction, round(float(np.log(table.ratio)), 3)): table for table in (*known(key), *tables)}
    cache.keep(
        "large_strain",
        cache.key(STRAIN_TABLES_MODULE, key),
        {"json": np.array(json.dumps([entry.to_json() for _, entry in sorted(new.items())]))},
    )
    _known.cache_clear()


def shipped_text(key: str, tables: Iterable[LargeStrain]) -> str:
    """Text of the file that ships with the package, from the tables of one geometry."""
    return (
        json.dumps({"schema": LARGE_STRAIN_SCHEMA, "key": key, "tables": [table.to_json() for table in tables]}) + "\n"
    )


@lru_cache(maxsize=16)
def _known(key: str, _folder: Path) -> tuple[LargeStrain, ...]:
    """`known`, kept for each folder of the cache."""
    cached = cache.find("large_strain", cache.key(STRAIN_TABLES_MODULE, key), report=True)
    tables = [] if cached is None else json_value(str(cached["json"]), "large strain", finite=False)
    for path in ALL_SHIPPED if cached is None else ():
        shipped = read_json(path) if path.exists() else {}
        tables += shipped["tables"] if shipped.get("key") == key else []
    return tuple(LargeStrain.from_json(table) for table in tables)
