"""`Response`: gauge values and indentation of presses, for all fingers of one geometry, as one smooth function.

Strains depend on F / E_inner, E / E_inner and r = E_outer / E_inner alone, also with large strain and friction
(`large_strain`). A Chebyshev polynomial in the logarithms of these three is fitted to a few thousand presses
(Trefethen, Approximation Theory and Approximation Practice, SIAM 2019, chapters 7 and 8). So a press costs microseconds
and has exact derivatives, and the fit averages out the steps that arise as the contact grows node by node.
"""

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import product

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebvander

from papilla.core import cache
from papilla.core.errors import ContactRangeError, InputError, SolverError
from papilla.core.progress import Progress, silent
from papilla.core.units import PER_CENT
from papilla.fem.pressing.fidelity import including_large_strain, press_grid
from papilla.fem.pressing.large_strain import TABLE_LOG_MARGIN, ends_of, is_known, tables_of
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.family import MODULUS_RATIO_ENDS as RATIO_LIMITS
from papilla.fem.reduction.family import FingerFamily
from papilla.fem.reduction.gauges import GAUGE_QUANTITIES
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.mesh.scale import FingerScale
from papilla.model.specimen import STICK_WORD, Friction, Specimen, friction_coefficient

RESPONSE_FORCES_MM2 = np.geomspace(0.15, 130.0, 20)
"""F / E_inner in mm2 on the default finger, on others times the square of their size (`FingerScale.area`); for the
default finger: 5 mN to 4.4 N."""

SPECIMEN_MODULUS_RATIOS = np.geomspace(0.15, 600.0, 16)
"""E / E_inner of the specimens; for the same finger: 0.005 to 20 MPa."""

POLYNOMIAL_DEGREES, TOTAL_DEGREE_SHARE = (8, 7, 4), 1.5
"""Largest powers of ln force, ln modulus and ln ratio, and of the sum of a term's shares of these."""

UNRESOLVED_WEIGHT = 0.1
"""Weight of a press that is too light for the mesh, relative to a resolved one."""

USUAL_RANGES = (1.0, 60.0), (1.0, 60.0)
"""Forces and moduli for which the error is measured; for the same finger: 0.03 to 2 N on 0.03 to 2 MPa."""

HERTZ_DEPTH_POWER = 2 / 3
"""Power of the force with which the indentation of a Hertzian contact grows."""

CROSS_VALIDATION_FOLDS = 5
"""Number of parts of the presses; each part is predicted by a fit to the others, which gives the error."""


@dataclass(frozen=True)
class LogPolynomial:
    """Products of Chebyshev polynomials in ln of v variables; m terms.

    limits : (v) lowest and highest value of each. degrees : (v) largest power of each. total : largest sum of a term's
    shares of these.
    """

    limits: tuple[tuple[float, float], ...]
    degrees: tuple[int, ...]
    total: float

    @cached_property
    def powers(self) -> np.ndarray:
        """(m, v) of each term."""
        every = product(*(range(degree + 1) for degree in self.degrees))
        shares = ((powers, sum(p / d for p, d in zip(powers, self.degrees, strict=True))) for powers in every)
        return np.array([powers for powers, share in shares if share <= self.total])

    def terms(self, values: tuple[np.ndarray, ...]) -> np.ndarray:
        """(1 + v, n, m) terms at values (n,) of each variable, and their derivatives by its logarithm.

        Beyond the limits they go on as their derivatives there say.
        """
        at, beyond = zip(
            *(_scaled(coordinate, ends) for coordinate, ends in zip(values, self.limits, strict=True)), strict=True
        )
        bases = [chebvander(coordinate, degree) for coordinate, degree in zip(at, self.degrees, strict=True)]
        tables = [self._product(bases)]
        for axis, (low, high) in enumerate(self.limits):
            steeper = [*bases]
            steeper[axis] = bases[axis] @ _derivative(self.degrees[axis]) * (2 / math.log(high / low))
            tables.append(self._product(steeper))
        tables[0] = tables[0] + sum(over[:, None] * slope for over, slope in zip(beyond, tables[1:], strict=True))
        return np.array(tables)

    def _product(self, bases: list[np.ndarray]) -> np.ndarray:
        columns = [basis[:, powers] for basis, powers in zip(bases, self.powers.T, strict=True)]
        return np.prod(columns, axis=0)


def _scaled(values: np.ndarray, limits: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,) from -1 to 1 of values between the limits, and how far their logarithms lie beyond the limits."""
    low, high = math.log(limits[0]), math.log(limits[1])
    at = np.log(values)
    clipped = np.clip(at, low, high)
    return 2 * (clipped - low) / (high - low) - 1, at - clipped


@lru_cache
def _derivative(degree: int) -> np.ndarray:
    """Matrix (degree + 1, degree + 1) that maps Chebyshev coefficients to those of the derivative."""
    matrix = np.zeros((degree + 1, degree + 1))
    for k in range(1, degree + 1):
        matrix[:k, k] = chebder(np.eye(degree + 1)[k])[:k]
    return matrix


RESPONSE_POLYNOMIAL = LogPolynomial(
    (
        (RESPONSE_FORCES_MM2[0], RESPONSE_FORCES_MM2[-1]),
        (SPECIMEN_MODULUS_RATIOS[0], SPECIMEN_MODULUS_RATIOS[-1]),
        RATIO_LIMITS,
    ),
    POLYNOMIAL_DEGREES,
    TOTAL_DEGREE_SHARE,
)


@dataclass(frozen=True, eq=False)
class ResponseValues:
    """n presses as seen by g gauges. values : (n, q, g) of `gauges.QUANTITIES`. indentation : (n,) mm.

    slope_values (3, n, q, g), slope_indentation (3, n) : derivatives by ln force, ln modulus of the specimen, and ln
    ratio, the inner modulus fixed for the first two and for the third.
    """

    values: np.ndarray
    indentation: np.ndarray
    slope_values: np.ndarray
    slope_indentation: np.ndarray


@dataclass(frozen=True, eq=False)
class Response:
    """Presses of all fingers of one geometry on specimens of one shape; g gauges, q quantities.

    coefficients : (terms, 1 + q g) of indentation (mm) / x^(2/3) and of the gauges' values / x, x = F / E_inner in mm2
    over the finger's `scale`, its `FingerScale.area`.
    deepest : (3, k) rows of E / E_inner, ratio, and the largest x at which the contact stays on its patch.
    strained : largest x for which large strain was measured; infinite if it is not included.
    friction : Coulomb's coefficient, infinite for stick. large_strain : whether it is included.
    error : (1 + q g,) root mean square error of presses predicted by a fit of the others: indentation, relative, then
    the gauges' values over the root mean square of the quantity over the gauges.
    """

    coefficients: np.ndarray
    deepest: np.ndarray
    strained: float
    friction: float
    large_strain: bool
    error: np.ndarray
    gauge_count: int
    specimen: str
    scale: float = 1.0

    def __repr__(self) -> str:
        return f"Response({self.specimen}, {self.gauge_count} gauges, within {PER_CENT * self.error.max():.2g} %)"

    def felt(self, force_N, modulus_MPa, outer: float, inner: float) -> ResponseValues:
        """Presses by forces (n,) on specimens of moduli (n,) of the finger with these Young's moduli (MPa).

        Outside the range of the fitted presses the function continues linearly: see `inside`.
        """
        x = self._load(force_N, inner)
        places = (x, np.asarray(modulus_MPa, float) / inner, np.full(len(x), outer / inner))
        table, *by = RESPONSE_POLYNOMIAL.terms(places) @ self.coefficients
        slopes = np.array(by)
        scale = np.concatenate(
            [x[:, None] ** HERTZ_DEPTH_POWER, np.repeat(x[:, None], table.shape[1] - 1, axis=1)], axis=1
        )
        # The polynomial is that of depth / x^(2/3) and of values / x: the product rule adds the power to the slope by
        # ln x.
        powers = np.concatenate([[HERTZ_DEPTH_POWER], np.ones(table.shape[1] - 1)])
        slopes[0] += powers * table
        responses, slopes = scale * table, scale * slopes
        shape = (len(x), len(GAUGE_QUANTITIES), self.gauge_count)
        return ResponseValues(
            responses[:, 1:].reshape(shape),
            responses[:, 0],
            slopes[:, :, 1:].reshape(len(slopes), *shape),
            slopes[:, :, 0],
        )

    def inside(self, force_N, modulus_MPa, outer: float, inner: float) -> np.ndarray:
        """(n,) whether presses lie within the range of the fitted presses."""
        x, e = self._load(force_N, inner), np.asarray(modulus_MPa, float) / inner
        near = np.abs(np.log(self.deepest[1] / (outer / inner)))
        limits = self.deepest[:, near == near.min()]
        within = (x >= RESPONSE_FORCES_MM2[0]) & (e >= SPECIMEN_MODULUS_RATIOS[0]) & (e <= SPECIMEN_MODULUS_RATIOS[-1])
        return within & (x <= np.interp(np.log(e), np.log(limits[0]), limits[2]))

    def beyond_large_strain(self, force_N, inner: float) -> np.ndarray:
        """(n,) whether presses strain a finger of this inner modulus more than was measured at finite strain."""
        return self._load(force_N, inner) > self.strained

    def _load(self, force_N, inner: float) -> np.ndarray:
        return np.asarray(force_N, float) / inner / self.scale


def response(
    family: FingerFamily, specimen: Specimen, *, friction: Friction | None = None, progress: Progress = silent
) -> Response:
    """The response of a family to presses on a specimen's shape (its modulus is ignored); kept in the cache.

    friction : as in `papilla.fem.press`; None means stick if large strain is known with it, else 0. Raises `InputError`
    if too few presses stay on the contact's patch.
    """
    inner = family.finger.inner.modulus
    members = [family.at(float(ratio) * inner, inner) for ratio in family.ratios]
    flat = specimen.curvature == (0.0, 0.0)
    if friction is None:
        friction = STICK_WORD if flat and all(is_known(reduced, math.inf) for reduced in members) else 0.0
    rubbing = friction_coefficient(friction)
    large = flat and all(is_known(reduced, rubbing) for reduced in members)
    scale = FingerScale.of(family.finger).area

    def make() -> dict[str, np.ndarray]:
        rows = []
        for number, (ratio, member) in enumerate(zip(family.ratios, members, strict=True), start=1):
            progress(f"presses of the family: modulus ratio {ratio:.3g} ({number} of {len(members)})")
            rows += _presses(member, float(ratio), inner, scale, specimen, friction, large)
        if len(rows) < 2 * len(RESPONSE_POLYNOMIAL.powers):
            asked = len(RESPONSE_FORCES_MM2) * len(SPECIMEN_MODULUS_RATIOS) * len(members)
            raise InputError(f"only {len(rows)} of {asked} presses of the family can be made")
        return _fitted(*(np.array(column) for column in zip(*rows, strict=True)))

    tables = [
        (table.to_json(), weight)
        for reduced in members
        for end in ends_of(rubbing)
        for table, weight in tables_of(reduced, end)
    ]
    parts = (family.compliance, family.rows, family.reduced.to_arrays(), inner)
    design = (RESPONSE_FORCES_MM2 * scale, SPECIMEN_MODULUS_RATIOS, list(POLYNOMIAL_DEGREES), TOTAL_DEGREE_SHARE)
    key = cache.key(
        __name__, *parts, repr(replace(specimen, modulus=1.0)), str(friction), large, json.dumps(tables), *design
    )
    arrays = cache.fetch("response", key, make)
    measured = [
        table.force.max() for reduced in members for end in ends_of(rubbing) for table, _ in tables_of(reduced, end)
    ]
    strained = math.exp(TABLE_LOG_MARGIN) * float(min(measured)) / scale if large else math.inf
    return Response(
        arrays["coefficients"],
        arrays["deepest"],
        strained,
        rubbing,
        large,
        arrays["error"],
        len(family.reduced.gauge_names),
        specimen.words,
        scale,
    )


def scaled_presses(
    member: ReducedFinger, inner: float, specimen: Specimen, friction: Friction, forces: np.ndarray, moduli: np.ndarray
) -> Iterator[tuple[float, float, Specimen, Press]]:
    """The presses that can be made of a finger, whose inner layer has the modulus `inner` (MPa): F / E_inner (mm2),
    E / E_inner, the specimen and its linear press."""
    touching = [replace(specimen, modulus=float(modulus)) for modulus in moduli * inner]
    presses = press_grid(member, touching, forces * inner, friction)
    for (modulus, force), (touched, outcome) in zip(product(moduli, forces), presses, strict=True):
        if not isinstance(outcome, Exception):
            yield force, modulus, touched, outcome


def _presses(
    member: ReducedFinger, ratio: float, inner: float, scale: float, specimen: Specimen, friction: Friction, large: bool
) -> list[tuple]:
    """Presses: (F / E_inner over the scale, E / E_inner, ratio), whether the mesh resolves it, and (indentation,
    values of the gauges)."""
    rows: list[tuple] = []
    grid = RESPONSE_FORCES_MM2 * scale, SPECIMEN_MODULUS_RATIOS
    for force, modulus, touched, outcome in scaled_presses(member, inner, specimen, friction, *grid):
        if large:
            try:
                # Without friction the contact is larger than with stick, and may extend beyond the patch
                outcome = including_large_strain(member, touched, outcome, beyond=True) or outcome
            except (ContactRangeError, SolverError):
                continue
        felt = (outcome.indentation, *outcome.values.flat)
        place = force / scale, modulus, ratio
        rows.append((place, outcome.resolved, felt))
    return rows


def _fitted(places: np.ndarray, resolved: np.ndarray, felt: np.ndarray) -> dict[str, np.ndarray]:
    """Fit the polynomials to columns of `_presses`: the arrays of a `Response`.

    Presses that are too light for the mesh have the weight `UNRESOLVED_WEIGHT`. The error is that of presses predicted
    by a fit to the others."""
    # Hertz's powers of the force are taken out first: what remains varies slowly, so a few terms describe it.
    x = places[:, 0]
    values = felt / np.column_stack([x**HERTZ_DEPTH_POWER, np.repeat(x[:, None], felt.shape[1] - 1, axis=1)])
    terms, weight = RESPONSE_POLYNOMIAL.terms(tuple(places.T))[0], np.where(resolved, 1.0, UNRESOLVED_WEIGHT)[:, None]

    def solve(chosen: np.ndarray) -> np.ndarray:
        return np.linalg.lstsq((weight * terms)[chosen], (weight * values)[chosen])[0]

    # Every fifth press belongs to one part, so that each part covers the whole range.
    fold = np.arange(len(places)) % CROSS_VALIDATION_FOLDS
    missed = np.zeros_like(values)
    for held_out in range(CROSS_VALIDATION_FOLDS):
        missed[fold == held_out] = terms[fold == held_out] @ solve(fold != held_out) - values[fold == held_out]
    count = (values.shape[1] - 1) // len(GAUGE_QUANTITIES)
    sizes = [values[:, :1]]
    for readings in np.split(values[:, 1:], len(GAUGE_QUANTITIES), axis=1):
        sizes.append(np.sqrt((readings**2).mean(axis=1, keepdims=True)).repeat(count, axis=1))
    usual = [(column >= low) & (column <= high) for column, (low, high) in zip(places.T, USUAL_RANGES, strict=False)]
    judged = resolved & usual[0] & usual[1]
    judged = judged if judged.any() else np.ones(len(places), bool)
    error = np.sqrt(np.mean((missed / np.concatenate(sizes, axis=1))[judged] ** 2, axis=0))
    groups = {(e, r): x[(places[:, 1] == e) & (places[:, 2] == r)].max() for e, r in {*map(tuple, places[:, 1:])}}
    deepest = np.array([(e, r, top) for (e, r), top in sorted(groups.items())]).T
    return {"coefficients": solve(np.ones(len(places), bool)), "deepest": deepest, "error": error}
