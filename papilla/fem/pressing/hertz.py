"""The `hertz` fidelity: a press is a look-up in tables of the pressure ellipses of least energy of finger and specimen.

The pressure is Hertz's with one term more for layers: p = F / (pi a b) [(1 - q) 3/2 t + q 5/2 t^3] with
t = sqrt(1 - u), u = (x/a)^2 + (y/b)^2. A hard layer over a soft one makes it flatter (q < 0), a thin soft layer on hard
ground more pointed (q > 0). With q = 0 and a force F on surfaces of
gap x^2/(2 Rx) + y^2/(2 Ry), the energy is F^2 c / 2 + F (a^2/Rx + b^2/Ry) / 10; with the c of a half-space, which is
3 / (5 a E*) for a circle, its minimum is Hertz's own result. Here E* of finger and specimen is measured on their
compliance under such ellipses, for each pair of terms, so that layers, bone and a thin specimen count; towards a = 0 it
is the outer layer's. Size, aspect and layer term of the ellipse are those of least energy.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import ceil
from typing import TypeVar

import numpy as np
from numpy.polynomial import Polynomial
from scipy.interpolate import PchipInterpolator
from scipy.special import ellipk

from papilla.errors import ContactRangeError
from papilla.fem.pressing.press import Press, linear_press
from papilla.fem.reduction.compliance import quadrature
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.references import hertz_ellipse
from papilla.references.hertz import MAX_RADIUS_RATIO
from papilla.specimen import Specimen

Array = TypeVar("Array", float, np.ndarray)

SECOND, SIXTH = (2 / 5, 2 / 7), (16 / 105, 16 / 231)
"""Moments of u and u^3 under the two terms, per unit force."""
HALF_SPACE_ENERGY = (1.0, 15 / 14, 25 / 21)
"""Energy of the pairs of terms (Hertz with itself, with the other, the other with itself) on a half-space, in Hertz's:
integrals of (J_m(x) / x^m) (J_n(x) / x^n) over x, m, n = 3/2 and 5/2."""

FLATTEST, SHARPEST = -1.5, 1.0  # Bounds of q, beyond which the pressure is negative in the middle or at the edge
SMALLEST = 2.0
"""Smallest radius, in patch edge lengths, at which E* is measured; below, it goes to its known limit at a = 0."""

ELLIPSE_SUBDIVISIONS = 6
"""Parts of a triangle's edge for the integrals of a Hertzian pressure and of the skin's curvature."""

TABLE_POINTS = 32
SMALL_POINTS = 10  # Radii below `SMALLEST` at which the gauges' readings, but not E*, are tabulated
STRETCHES = (-0.06, 0.0, 0.06)
"""ln of b / a, over that of Hertz, at which ellipses are tabulated: layers change it by up to 0.06 on the default."""

STRETCHED = 0.15
"""Largest such ln to which the parabolas through these three are followed (0.14 on the default and a rigid flat)."""

MODULUS_DEGREES = (7, 5, 2)
"""Degrees in a of ln E*'s terms in the stretch to the power 0, 1, 2, at most; each starts at the first, for E*(0) is
known. On a coarse patch, where much of the way down to a = 0 is not measured, the degree is lower: see `_moduli`."""

CURVATURE_REACH, FITTED_NODES = 0.27, 28
"""Share of the patch's reach over which the skin's curvature is fitted (4 mm of 15), and the fewest nodes for it."""

HOMOGENEOUS = 0.1
"""Change of ln E* from a = 0 below which a body is as good as homogeneous: there Hertz's profile and aspect are exact,
and what the measured E* says against them is the mesh's error, to which the flat minimum in q is sensitive."""

LAYERED = 0.01  # How far a body is layered, from 0 to 1, below which its aspect is Hertz's whatever the parabolas say
GAP = 1.5
"""Ratio of neighbouring radii of the tables from which ellipses in between have no least energy, and the tables end."""


def layer_factor(t: Array, q: Array) -> Array:
    """Pressure over mean pressure at t = sqrt(1 - u), for t in [0, 1]."""
    return 1.5 * (1 - q) * t + 2.5 * q * t**3


def mean_square(q: Array) -> Array:
    """Mean of u under the profile."""
    return SECOND[0] - (SECOND[0] - SECOND[1]) * q


def peak_over_mean(q: float) -> float:
    """Largest pressure over mean pressure."""
    inside = np.sqrt((1 - q) / (-5 * q)) if q < 0 else 1.0
    return float(max(layer_factor(1.0, q), layer_factor(min(inside, 1.0), q)))


@dataclass(frozen=True, eq=False)
class HertzTable:
    """Force-indexed tables of Hertz presses of one finger on one specimen.

    force (N), semi-axes a and b (mm), layer_term (q), indentation (mm) : (k,).
    influence : (k, q g) what gauges feel per newton, quantity by quantity.
    end : why they end, in words that follow "takes".
    """

    force: np.ndarray
    a: np.ndarray
    b: np.ndarray
    layer_term: np.ndarray
    indentation: np.ndarray
    influence: np.ndarray
    end: str

    @cached_property
    def cube_root(self) -> np.ndarray:
        """Cube roots (k,) of the forces, in which all but the indentation are interpolated."""
        return np.cbrt(self.force)

    def at(self, force: float) -> tuple[float, float, float, np.ndarray]:
        """a, b (mm), q and influence (q g,) at a force (N) inside the table."""
        root = np.cbrt(force)
        right = int(np.clip(np.searchsorted(self.cube_root, root), 1, len(self.force) - 1))
        low, high = self.cube_root[right - 1 : right + 1]
        a, b, q, *influence = np.array([high - root, root - low]) @ self._columns[right - 1 : right + 1] / (high - low)
        return float(a), float(b), float(q), np.array(influence)

    @cached_property
    def _columns(self) -> np.ndarray:
        return np.column_stack([self.a, self.b, self.layer_term, self.influence])


@lru_cache(maxsize=64)
def hertz_table(reduced: ReducedFinger, specimen: Specimen) -> HertzTable:
    """Tables over force, from nothing to where the ellipse reaches the rim of the patch.

    They end before that where no ellipse that the tabulated stretches vouch for has the least energy (a hard skin on a
    hard specimen). Raises `ContactRangeError` for a skin that is not convex, a patch that holds no such ellipse, or a
    specimen without a curvature.
    """
    gap_radii = _radii(reduced, specimen)
    unit = hertz_ellipse(1.0, *gap_radii, 1.0)
    aspects = unit.b / unit.a * np.exp(STRETCHES)
    smallest, largest = _measured_radii(reduced, aspects)
    moduli = _moduli(reduced, specimen, tuple(aspects), smallest, largest)
    branches = [
        _branch(reduced, gap_radii, aspect, modulus, smallest, largest)
        for aspect, modulus in zip(aspects, moduli, strict=True)
    ]
    ends = min(branch.x[-1] for branch in branches)
    root = np.append(branches[1].x[branches[1].x < ends], ends)
    columns = np.stack([branch(root) for branch in branches])
    stretch, vouched = _stretch(columns[:, :, 0], _layered(moduli[1][0], columns[1, :, 1] * root))
    energy, a, q, *influence = np.moveaxis(_quadratic(columns, stretch), -1, 0)
    energy, a = energy * root**2, a * root
    aspect = aspects[1] * np.exp(stretch)
    bend = (1 / gap_radii[0] + aspect**2 / gap_radii[1]) / 10
    # The energy per force is F c / 2 + gap term, and the indentation F c + gap term
    indentation = 2 * energy - bend * a**2 * mean_square(q) / SECOND[0]
    vouched &= (q >= FLATTEST) & (q <= SHARPEST)
    for column in (a, indentation):
        vouched &= np.diff(column, prepend=0) > 0
    kept = np.logical_and.accumulate(vouched)
    if kept.sum() < SMALL_POINTS:
        raise ContactRangeError("hertz fidelity: no pressure ellipse has the least energy on this finger and specimen")
    rows = np.stack(influence, axis=1)
    force, a, b, q, indentation = (np.append(0, part[kept]) for part in (root**3, a, a * aspect, q, indentation))
    end = "the contact to the rim of its patch" if kept.all() else "the contact beyond the ellipses of this skin"
    return HertzTable(force, a, b, q, indentation, np.vstack([rows[:1], rows[kept]]), end)


def _branch(reduced, gap_radii, aspect: float, modulus, smallest: float, largest: float) -> PchipInterpolator:
    """Ellipses of one aspect: energy / F^(5/3), a / F^(1/3), q and influence (q g) over F^(1/3).

    On a half-space all of them but the influence are constant.
    """
    radius = np.append(np.geomspace(1e-3 * smallest, smallest, 40)[:-1], np.linspace(smallest, largest, 400))
    bend = (1 / gap_radii[0] + aspect**2 / gap_radii[1]) / 10
    q, force, compliance = _least_energy(radius, _half_space_energy(aspect), modulus, bend)
    usable = np.append(True, np.diff(np.maximum.accumulate(force)) > 0) & (force > 0)
    last = np.append(-np.inf, radius[usable])
    usable[usable] = np.logical_and.accumulate(radius[usable] < GAP * np.where(last[:-1] > 0, last[:-1], np.inf))
    radius, q, force, compliance = radius[usable], q[usable], force[usable], compliance[usable]
    energy = force * compliance / 2 + bend * radius**2 * mean_square(q) / SECOND[0]
    hertz, other = (influence(radius**2) for influence in _influences(reduced, aspect, smallest, largest))
    influence = (1 - q)[:, None] * hertz + q[:, None] * other
    root = np.cbrt(force)
    return PchipInterpolator(root, np.column_stack([energy / root**2, radius / root, q, influence]))


def _least_energy(radius, half_space: float, modulus, bend: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Layer term q, force (N) and mean displacement per force (mm/N) at which ellipses of the given radii (k,) have the
    least energy, q being within its bounds; Hertz's q where none is stationary (a mesh that locks).

    The energy over F is F/2 (c11 + 2 q (c12 - c11) + q^2 (c11 - 2 c12 + c22)) + bend a^2 <u>(q) / <u>(0). That it is
    stationary in q gives F; put into the derivative in a, it leaves a quadratic equation in q.
    """
    c, slope = [], []
    for factor, logarithm in zip(HALF_SPACE_ENERGY, modulus, strict=True):
        c.append(factor * half_space / (radius * np.exp(logarithm(radius))))
        slope.append(-c[-1] * (1 + radius * logarithm.deriv()(radius)))
    first, second = c[1] - c[0], c[0] - 2 * c[1] + c[2]
    first_slope, second_slope = slope[1] - slope[0], slope[0] - 2 * slope[1] + slope[2]
    loss = 1 - SECOND[1] / SECOND[0]
    terms = (
        loss * slope[0] + 4 * first,
        2 * loss * first_slope + 4 * second - 4 * loss * first,
        loss * second_slope - 4 * loss * second,
    )
    with np.errstate(invalid="ignore"):
        root = np.sqrt(terms[1] ** 2 - 4 * terms[0] * terms[2])
        q = -2 * terms[0] / (terms[1] + np.copysign(root, terms[1]))
    q = np.clip(np.where(np.isfinite(q), q, 0.0), FLATTEST, SHARPEST) * _layered(modulus[0], radius)
    total, total_slope = c[0] + 2 * q * first + q**2 * second, slope[0] + 2 * q * first_slope + q**2 * second_slope
    return q, -4 * bend * radius**2 * (1 - loss * q) / total_slope, total


def _layered(logarithm, radius) -> np.ndarray:
    """How far (k,), from 0 to 1, ln E* changes from a = 0 by more than that of a homogeneous body on a mesh may."""
    change = np.abs(logarithm(radius) - logarithm(0.0)) / HOMOGENEOUS
    return change**4 / (1 + change**4)


def _stretch(energy: np.ndarray, layered: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stretch (k,) at which the parabola through the energies (3, k) of the tabulated stretches is lowest, as far as
    the body is `layered` (k,), and whether the parabola has such a point, near them; 0 where it has not."""
    step, bend = STRETCHES[1] - STRETCHES[0], energy[0] - 2 * energy[1] + energy[2]
    stretch = -step / 2 * (energy[2] - energy[0]) / np.where(bend > 0, bend, np.inf) * layered
    vouched = ((bend > 0) | (layered < LAYERED)) & (np.abs(stretch) <= STRETCHED)
    # A parabola that is all but straight has its lowest point anywhere, up to where numbers overflow
    return np.where(vouched, stretch, 0.0), vouched


def _quadratic(columns: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """Parabolas through columns (3, k, c) of the tabulated stretches, at the stretches (k,)."""
    s = (stretch / (STRETCHES[1] - STRETCHES[0]))[:, None]
    return columns[0] * s * (s - 1) / 2 + columns[1] * (1 - s**2) + columns[2] * s * (s + 1) / 2


def _half_space_energy(aspect: float) -> float:
    """Mean displacement times a under a Hertzian ellipse of unit force on a half-space with E* = 1 MPa."""
    long, short = max(aspect, 1.0), min(aspect, 1.0)
    return 0.8 * 1.5 / np.pi * float(ellipk(1 - (short / long) ** 2)) / long


def _moduli(reduced, specimen, aspects: tuple[float, ...], smallest: float, largest: float) -> list[tuple]:
    """ln E* (MPa) of finger and specimen for each aspect and pair of pressure terms, as polynomials of a."""
    limit = np.log(1 / (1 / reduced.outer_modulus + 1 / specimen.contact_modulus))
    touched, by_aspect = reduced.specimen_compliance(specimen), []
    for aspect in aspects:
        flat, own = _finger_energies(reduced, smallest, largest, aspect)
        both = own + _energies(reduced, touched, smallest, largest, aspect)
        if not (both > 0).all():
            raise ContactRangeError("hertz fidelity: finger and specimen have no positive compliance on this patch")
        by_aspect.append(np.log(flat / both))
    logarithms = np.stack(by_aspect, axis=1)
    a, s = (part.ravel() for part in np.meshgrid(_tabulated(smallest, largest)[SMALL_POINTS:] / largest, STRETCHES))
    # A polynomial bridges a gap about as wide as its waves are long, and no wider
    bridging = max(2, ceil(largest / smallest))
    powers = [(i, j) for j, degree in enumerate(MODULUS_DEGREES) for i in range(1, min(degree, bridging) + 1)]
    terms = np.stack([a**i * s**j for i, j in powers], axis=1)
    found = []
    for pair in logarithms:
        coefficients = np.linalg.lstsq(terms, pair.ravel() - limit, rcond=None)[0]
        by_power = np.zeros((len(STRETCHES), max(MODULUS_DEGREES) + 1))
        by_power[:, 0] = limit
        for (i, j), value in zip(powers, coefficients, strict=True):
            by_power[:, i] += value / largest**i * np.power(STRETCHES, j)
        found.append([Polynomial(row) for row in by_power])
    return list(zip(*found, strict=True))


@lru_cache(maxsize=24)
def _finger_energies(reduced, smallest: float, largest: float, aspect: float) -> list[np.ndarray]:
    """Energies (3 pairs of terms, k) of a half-space of 1 MPa, and of the finger, under unit ellipses."""
    matrices = (reduced.half_space, reduced.compliance)
    return [_energies(reduced, matrix, smallest, largest, aspect) for matrix in matrices]


def _energies(reduced, matrix: np.ndarray, smallest: float, largest: float, aspect: float) -> np.ndarray:
    """Energies (3 pairs of terms, k) of a compliance (n, n) under unit ellipses."""
    hertz, other = _ellipses(reduced, smallest, largest, aspect)[:, SMALL_POINTS:]
    pairs = ((hertz, hertz), (hertz, other), (other, other))
    return np.array([((left @ matrix) * right).sum(axis=1) for left, right in pairs])


def _measured_radii(reduced: ReducedFinger, aspects: np.ndarray) -> tuple[float, float]:
    """Smallest and largest semi-axis a (mm) at which ellipses of these aspects are measured on the patch."""
    # Inside the patch's outline, whether the skin goes on there or ends
    x, y = reduced.patch.xy[reduced.patch.outline].T
    largest = float(np.hypot(x, y / aspects[:, None]).min())
    shorter = largest * min(1.0, aspects.min())
    edge = reduced.patch.finest_edge
    if shorter < SMALLEST * edge:
        raise ContactRangeError(
            "hertz fidelity needs a patch that holds its ellipse: "
            f"{largest:.2g} x {largest * aspects[1]:.2g} mm at most on {edge:.2g} mm elements"
        )
    return min(SMALLEST * edge, largest / 4), largest


@lru_cache(maxsize=8)
def _influences(reduced, aspect: float, smallest: float, largest: float) -> list[PchipInterpolator]:
    """What gauges feel (q g,) per newton under each pressure term, as functions of the radius squared."""
    rows = reduced.rows.reshape(-1, len(reduced.patch.xy))
    found = []
    for shapes in _ellipses(reduced, smallest, largest, aspect):
        load = reduced.multiplicity * shapes @ reduced.patch.mass
        # On a coarse patch the smallest ellipses fall between the quadrature points
        caught = load > 0
        per_force = (shapes @ rows.T)[caught] / load[caught, None]
        at = np.append(0, np.square(_tabulated(smallest, largest))[caught])
        found.append(PchipInterpolator(at, np.vstack([per_force[:1], per_force])))
    return found


def _tabulated(smallest: float, largest: float) -> np.ndarray:
    """Semi-axes a (mm) of the tabulated ellipses, the first `SMALL_POINTS` of them below `smallest`."""
    return np.append(np.linspace(0.05, 0.95, SMALL_POINTS) * smallest, np.geomspace(smallest, largest, TABLE_POINTS))


@lru_cache(maxsize=8)
def _ellipses(reduced: ReducedFinger, smallest: float, largest: float, aspect: float) -> np.ndarray:
    """Nodal pressures (2, k, n) of the tabulated ellipses under each term of the profile, sqrt(1 - u) and its cube,
    projected so that force and moments are kept."""
    points, weights, hats = quadrature(reduced.patch, subdivisions=ELLIPSE_SUBDIVISIONS)
    square = points[:, 0] ** 2 + (points[:, 1] / aspect) ** 2
    inside = np.maximum(0.0, 1 - square / np.square(_tabulated(smallest, largest))[:, None])
    hertz = np.sqrt(inside)
    loads = np.concatenate([hertz, hertz * inside]) * weights
    mass = (hats.T @ hats.multiply(weights[:, None])).toarray()
    return np.linalg.solve(mass, hats.T @ loads.T).T.reshape(2, len(inside), -1)


def _radii(reduced: ReducedFinger, specimen: Specimen) -> tuple[float, float]:
    """Radii of curvature (mm) of the gap along x and y of the contact plane, fitted near the touch-down point."""
    patch = reduced.patch
    points, weights, hats = quadrature(patch, subdivisions=ELLIPSE_SUBDIVISIONS)
    distance = np.hypot(*patch.xy.T)
    reach = float(distance.max())
    outwards = np.argsort(distance)
    last = min(int(np.searchsorted(np.cumsum(patch.copies[outwards]), FITTED_NODES)), len(distance) - 1)
    near = distance <= max(CURVATURE_REACH * reach, distance[outwards[last]])
    x, y = points.T / reach
    terms = [x**2 / 2, y**2 / 2, x**4, x**2 * y**2, y**4, np.ones_like(x)]
    if len(patch.images) == 1:
        terms.append(x * y)  # A mirrored patch has none
    # As the whole patch would be fitted, node by node
    scale = np.sqrt(patch.copies[near])
    weak_terms = (hats.T @ (weights[:, None] * np.stack(terms, axis=1)))[near] / patch.mass[near, None]
    fitted = np.linalg.lstsq(scale[:, None] * weak_terms, scale * patch.node_gap[near] / reach, rcond=None)[0] / reach
    curvature_x, curvature_y = fitted[:2]
    if specimen.curvature is None:
        raise ContactRangeError(f"hertz fidelity does not know the curvature of a {specimen.words}")
    curvature_x, curvature_y = np.add((curvature_x, curvature_y), specimen.curvature)
    if min(curvature_x, curvature_y) <= max(curvature_x, curvature_y) / MAX_RADIUS_RATIO:
        raise ContactRangeError("hertz fidelity needs a skin that is convex, in both directions, where it is touched")
    return 1 / curvature_x, 1 / curvature_y


@dataclass(frozen=True)
class HertzScene:
    """Semi-axes (mm), layer term q, peak pressure (MPa), indentation (mm) and gauge `values` (q, g) of one press."""

    force: float
    semi_axes: tuple[float, float]
    layer_term: float
    peak_pressure: float
    indentation: float
    values: np.ndarray


def hertz_scene(
    reduced: ReducedFinger, specimen: Specimen, force: float | None, indentation: float | None
) -> HertzScene:
    """One press by force (N) or indentation (mm); raises `ContactRangeError` where the ellipse leaves the patch."""
    table = hertz_table(reduced, specimen)
    if indentation is not None:
        _refuse_beyond(table, indentation, table.indentation[-1], "an indentation", "mm")
        # Interpolated as below, in force^(2/3), where Hertz's law is a straight line
        force = float(np.interp(indentation, table.indentation, table.cube_root**2) ** 1.5)
    assert force is not None
    _refuse_beyond(table, force, table.force[-1] * (1 + 1e-12), "a force", "N")
    a, b, q, per_newton = table.at(force)
    return HertzScene(
        force=force,
        semi_axes=(a, b),
        layer_term=q,
        peak_pressure=peak_over_mean(q) * force / (np.pi * a * b),
        indentation=float(np.interp(np.cbrt(force) ** 2, table.cube_root**2, table.indentation)),
        values=force * per_newton.reshape(reduced.weights.shape),
    )


def hertz_press(
    reduced: ReducedFinger,
    specimen: Specimen,
    force: float | None,
    indentation: float | None,
    status: str,
    began: float,
) -> Press:
    """One press by force (N) or indentation (mm) as a `Press` that says `status`; raises `ContactRangeError`."""
    scene = hertz_scene(reduced, specimen, force, indentation)
    a, b = scene.semi_axes
    patch = reduced.patch
    x, y = patch.xy.T
    shape = layer_factor(np.sqrt(np.maximum(0.0, 1 - (x / a) ** 2 - (y / b) ** 2)), scene.layer_term)
    # An ellipse between the nodes goes to the nearest one; whatever they sample of it, they carry the force
    shape[np.argmin(np.hypot(x, y))] += float(not shape.any())
    pressure = scene.force / (reduced.multiplicity * patch.mass @ shape) * shape
    return linear_press(
        reduced,
        specimen,
        began,
        compliance=reduced.total_compliance(specimen),
        force=scene.force,
        fidelity="hertz",
        indentation=scene.indentation,
        contact_area=float(np.pi * a * b),
        peak_pressure=scene.peak_pressure,
        values=scene.values,
        force_balance=abs(float(reduced.multiplicity * patch.mass @ pressure) - scene.force) / scene.force,
        status=status,
        resolved=True,
        pressure=pressure,
        active=shape > 0,
    )


def _refuse_beyond(table: HertzTable, value: float, limit: float, what: str, unit: str) -> None:
    if value > limit:
        raise ContactRangeError(f"{what} of {value:g} {unit} takes {table.end} ({limit:.3g} {unit})")
