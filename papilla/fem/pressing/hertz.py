"""The `hertz` fidelity: a press is a look-up in tables of the pressure ellipses of least energy of finger and specimen.

The pressure is Hertz's with one more term for layers: p = F / (pi a b) [(1 - q) 3/2 t + q 5/2 t^3] with t = sqrt(1 -
u), u = (x/a)^2 + (y/b)^2. A hard layer over a soft one makes the profile flatter (q < 0), a thin soft layer on hard
ground makes it more pointed (q > 0). For q = 0 and a gap x^2/(2 Rx) + y^2/(2 Ry) the energy under a force F is F^2 c /
2 + F (a^2/Rx + b^2/Ry) / 10. With the c of a half-space, 3 / (5 a E*) for a circle, its minimum is Hertz's solution.
Here E* is computed from the compliances of finger and specimen under such ellipses, for each pair of terms, so it
includes layers, bone and a thin specimen; for a -> 0 it is that of the outer layer. Size, aspect ratio and layer term q
minimise the energy.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from papilla.core.errors import ContactRangeError, InputError
from papilla.fem.pressing import ellipses
from papilla.fem.pressing.ellipses import SECOND_MOMENTS, Array, EllipseFamily, ellipse_family, mean_square
from papilla.fem.pressing.press import CONTACT_MEASURES, Load, Press, linear_press
from papilla.fem.reduction.reduced import ReducedFinger, kept
from papilla.model.specimen import Specimen

LEVEL_STEP, POLYNOMIAL_LEVELS = 1 / 32, 6
"""Step of ln modulus between tables, and the number of tables through which the polynomial goes: accurate to 1e-6. If
the specimen makes finger and specimen nearly one homogeneous body, the ellipses change within a tenth in ln modulus."""

LARGEST_ASPECT_STRETCH = 0.15
"""Largest |ln aspect| relative to Hertz up to which the parabolas through the three tabulated stretches are used (0.14
on the default finger and a rigid flat)."""

HOMOGENEOUS_LOG_CHANGE = 0.1
"""Change of ln E* from a = 0 below which a body counts as homogeneous. Hertz's profile and aspect are exact there;
differences of the measured E* are errors of the mesh, to which the flat minimum in q is sensitive."""

SMALLEST_LAYERING = (
    0.01  # Measure of layering, from 0 to 1, below which the aspect is Hertz's, whatever the parabolas give
)
FORCE_ROUNDING_SHARE = 1e-12  # Share of the largest force of a table that is rounding
LARGEST_RADIUS_RATIO = 1.5
"""The tables end where neighbouring radii have a larger ratio than this: ellipses between them do not have least
energy."""

CUBIC_ROWS = 4
"""Number of neighbouring rows of a table through which a cubic interpolates."""

INDENTATION_COLUMN = 3
"""Column of a table with the indentation."""


@dataclass(frozen=True, eq=False)
class HertzTable:
    """Presses of one finger on one specimen, from zero force to the largest known ellipse.

    cube_root : (k,) of the force (N). parts : (l, k, 4 + q g), whose sum weighted by `weights` (l,) gives the columns:
    semi-axes a and b (mm) over the root, layer term q, indentation (mm) over its square, and the response of the gauges
    per newton, quantity by quantity. By Hertz's law all columns except the last group are constant. end : what limits
    the table, as the object of "a force of 2 N takes ...". complete : whether the table ends at the patch's rim.
    """

    cube_root: np.ndarray
    parts: np.ndarray
    weights: np.ndarray
    end: str
    complete: bool

    @cached_property
    def columns(self) -> np.ndarray:
        """All columns (k, 4 + q g)."""
        return np.einsum("l,lkc->kc", self.weights, self.parts)

    @property
    def force(self) -> np.ndarray:
        """Forces (k,) in N."""
        return self.cube_root**3

    @property
    def indentation(self) -> np.ndarray:
        """Indentations (k,), mm."""
        return self.cube_root**2 * self.columns[:, INDENTATION_COLUMN]

    def at(self, root: float) -> np.ndarray:
        """Columns (4 + q g,) at the cube root of a force (N) inside the table; a cubic through four rows
        interpolates."""
        first = min(max(int(self.cube_root.searchsorted(root)) - CUBIC_ROWS // 2, 0), len(self.cube_root) - CUBIC_ROWS)
        rows = slice(first, first + CUBIC_ROWS)
        across = np.array(_weights(self.cube_root[rows].tolist(), root))
        return np.asarray(self.weights @ (across @ self.parts[:, rows]))

    def root_of(self, indentation: float) -> float:
        """The cube root of the force (N) that makes an indentation (mm) inside the table."""
        right = int(np.clip(np.searchsorted(self.indentation, indentation), 1, len(self.cube_root) - 1))
        low, high = self.cube_root[right - 1 : right + 1]
        return float(
            brentq(lambda root: root**2 * self.at(root)[INDENTATION_COLUMN] - indentation, low, high, xtol=1e-14 * high)
        )


def _weights(nodes: Sequence, at: Array) -> list[Array]:
    """Weights of the values at `nodes` for the polynomial through them; `at` may be one number or an array (k,)."""
    nodes, away, weights = list(nodes), [at - node for node in nodes], []
    for i, node in enumerate(nodes):
        others = nodes[:i] + nodes[i + 1 :]
        weights.append(math.prod(away[:i] + away[i + 1 :]) / math.prod([node - other for other in others]))
    return weights


@kept(64)
def hertz_table(reduced: ReducedFinger, specimen: Specimen) -> HertzTable:
    """The table of a finger and specimen: a polynomial in ln modulus through the tables of neighbouring moduli.

    If one of these ends before the rim, or the specimen's compliance is not proportional to 1 / modulus, the table is
    computed for the specimen itself. Raises `ContactRangeError` as `_table` does.
    """
    if specimen.elastic:
        at = math.log(specimen.modulus) / LEVEL_STEP
        lowest = math.floor(at) + 1 - POLYNOMIAL_LEVELS // 2
        near = _tables(reduced, specimen.unit, lowest)
        if near is not None:
            logarithms, parts, end = near
            weights = np.array(_weights(range(POLYNOMIAL_LEVELS), at - lowest))
            return HertzTable(np.append(0.0, np.exp(weights @ logarithms)), parts, weights, end, True)
    return _table(reduced, specimen)


@kept(128)
def _tables(reduced: ReducedFinger, unit: Specimen, lowest: int) -> tuple[np.ndarray, np.ndarray, str] | None:
    """Logarithms of `cube_root` (levels, k - 1), and columns, of the tables of `POLYNOMIAL_LEVELS` moduli, starting at
    level `lowest`; None if one of them does not reach the rim."""
    try:
        levels = [LEVEL_STEP * (lowest + k) for k in range(POLYNOMIAL_LEVELS)]
        tables = [_table(reduced, replace(unit, modulus=math.exp(level))) for level in levels]
    except (ContactRangeError, InputError):
        return None
    if not all(table.complete for table in tables):
        return None
    roots = np.log([table.cube_root[1:] for table in tables])
    return roots, np.array([table.columns for table in tables]), tables[0].end


@kept(128)
def _table(reduced: ReducedFinger, specimen: Specimen) -> HertzTable:
    """A table up to where the ellipse reaches the rim of the patch.

    It ends earlier if no ellipse within the tabulated stretches has the least energy (a hard skin on a hard specimen).
    Raises `ContactRangeError` if the skin is not convex, no such ellipse fits on the patch, or the specimen has no
    curvature.
    """
    family = ellipse_family(reduced, specimen.unit)
    branches = _branches(family, *ellipses.moduli(family, reduced.outer_modulus, specimen))
    # The three aspects are tabulated at the same forces, so that parabolas through them compare like with like.
    root = min(roots[-1] for roots, _ in branches) * family.radius / family.radius[-1]
    columns = np.stack([_through(*branch, root) for branch in branches])
    stretch, vouched = _stretch(columns[:, :, 0], _layered(columns[1, :, 3]))
    energy, a, q, _, *influence = np.moveaxis(_quadratic(columns, stretch), -1, 0)
    aspect = family.aspects[1] * np.exp(stretch)
    bend = family.bend(aspect)
    # The energy per force is F c / 2 + gap term, and the indentation F c + gap term
    indentation = 2 * energy - bend * a**2 * mean_square(q) / SECOND_MOMENTS[0]
    # Beyond its bounds the profile would pull; and a radius or depth that falls with the force is no press.
    vouched &= (q >= ellipses.FLATTEST_Q) & (q <= ellipses.SHARPEST_Q)
    for column in (a * root, indentation * root**2):
        vouched &= np.diff(column, prepend=0) > 0
    sound = np.logical_and.accumulate(vouched)
    if sound.sum() < ellipses.SMALL_POINTS:
        raise ContactRangeError("hertz fidelity: no pressure ellipse has the least energy on this finger and specimen")
    rows = np.column_stack([a, a * aspect, q, indentation, *influence])[sound]
    end = "the contact to the rim of its patch" if sound.all() else "the contact beyond the ellipses of this skin"
    # At zero force the columns have the values of the smallest ellipse: by Hertz's law they are constant there.
    parts = np.vstack([rows[:1], rows])[None]
    return HertzTable(np.append(0, root[sound]), parts, np.ones(1), end, bool(sound.all()))


def _branches(
    family: EllipseFamily, change: np.ndarray, slope: np.ndarray, limit: float
) -> list[tuple[np.ndarray, np.ndarray]]:
    """For each aspect: F^(1/3) (k,) of the ellipses, and a table with the columns energy / F^(5/3), a / F^(1/3), q,
    change of ln E*, and response of the gauges (q g).

    On a half-space all of them except the influence are constant.
    """
    bend, branches = family.bend(family.aspects), []
    many = _least_energy(family.radius, family.half_space[:, None], change, slope, limit, bend[:, None])
    for q, force, compliance, changed, influence, gap_bend in zip(
        *many, change[0], family.influence, bend, strict=True
    ):
        radius = family.radius
        # A table over the force needs forces that rise with the radius, without gaps.
        usable = np.append(True, np.diff(np.maximum.accumulate(force)) > 0) & (force > 0)
        last = np.append(-np.inf, radius[usable])
        usable[usable] = np.logical_and.accumulate(
            radius[usable] < LARGEST_RADIUS_RATIO * np.where(last[:-1] > 0, last[:-1], np.inf)
        )
        felt = (1 - q)[:, None] * influence[0] + q[:, None] * influence[1]
        energy = force * compliance / 2 + gap_bend * radius**2 * mean_square(q) / SECOND_MOMENTS[0]
        root = np.cbrt(np.maximum(force, 0))[usable]
        branches.append((root, np.column_stack(
            [energy[usable] / root**2, radius[usable] / root, q[usable], changed[usable], felt[usable]]
        )))  # fmt: skip
    return branches


def _through(nodes: np.ndarray, columns: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Columns (k, c) at places (k,), by cubics through four of the rising nodes and their columns."""
    first = np.clip(np.searchsorted(nodes, at) - CUBIC_ROWS // 2, 0, len(nodes) - CUBIC_ROWS)
    weights = _weights([nodes[first + k] for k in range(CUBIC_ROWS)], at)
    return sum(weight[:, None] * columns[first + k] for k, weight in enumerate(weights))


def _least_energy(
    radius: np.ndarray, half_space: Array, change: np.ndarray, by_radius: np.ndarray, limit: float, bend: Array
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Layer term q, force (N) and mean displacement per force (mm/N) (..., k) at which ellipses of radii (k,) have the
    least energy, with q within its bounds; Hertz's q if no q is stationary (a mesh that locks).

    change, by_radius : (3, ..., k) of ln E* of the pairs of terms, from its `limit` at a = 0, and its derivative by a.
    The energy over F is F/2 (c11 + 2 q (c12 - c11) + q^2 (c11 - 2 c12 + c22)) + bend a^2 <u>(q) / <u>(0). That it is
    stationary in q gives F; put into the derivative in a, it leaves a quadratic equation in q.
    """
    factors = np.array(ellipses.HALF_SPACE_ENERGY).reshape(-1, *[1] * (change.ndim - 1))
    # Compliances c11, c12, c22 of the pairs of terms, and their derivatives by a.
    c = factors * half_space / (radius * np.exp(limit + change))
    slope = -c * (1 + radius * by_radius)
    first, second = c[1] - c[0], c[0] - 2 * c[1] + c[2]
    first_slope, second_slope = slope[1] - slope[0], slope[0] - 2 * slope[1] + slope[2]
    loss = 1 - SECOND_MOMENTS[1] / SECOND_MOMENTS[0]
    # Coefficients of the quadratic equation in q; the root is taken in the form that loses no digits if the square term
    # is small.
    terms = (
        loss * slope[0] + 4 * first,
        2 * loss * first_slope + 4 * second - 4 * loss * first,
        loss * second_slope - 4 * loss * second,
    )
    with np.errstate(invalid="ignore"):
        root = np.sqrt(terms[1] ** 2 - 4 * terms[0] * terms[2])
        q = -2 * terms[0] / (terms[1] + np.copysign(root, terms[1]))
    q = np.clip(np.where(np.isfinite(q), q, 0.0), ellipses.FLATTEST_Q, ellipses.SHARPEST_Q) * _layered(change[0])
    total, total_slope = c[0] + 2 * q * first + q**2 * second, slope[0] + 2 * q * first_slope + q**2 * second_slope
    return q, -4 * bend * radius**2 * (1 - loss * q) / total_slope, total


def _layered(change: np.ndarray) -> np.ndarray:
    """Measure, from 0 to 1, of how much a change of ln E* from a = 0 exceeds that of a homogeneous body on a mesh."""
    power = (change / HOMOGENEOUS_LOG_CHANGE) ** 4
    return power / (1 + power)


def _stretch(energy: np.ndarray, layered: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stretch (k,) at which the parabola through the energies (3, k) of the tabulated stretches has its minimum, scaled
    by `layered` (k,); and whether the parabola has a minimum near them. 0 if it has none."""
    # Vertex of the parabola through three energies.
    step, bend = ellipses.ASPECT_STRETCHES[1] - ellipses.ASPECT_STRETCHES[0], energy[0] - 2 * energy[1] + energy[2]
    stretch = -step / 2 * (energy[2] - energy[0]) / np.where(bend > 0, bend, np.inf) * layered
    vouched = ((bend > 0) | (layered < SMALLEST_LAYERING)) & (np.abs(stretch) <= LARGEST_ASPECT_STRETCH)
    # A nearly straight parabola may have its minimum anywhere, up to where numbers overflow
    return np.where(vouched, stretch, 0.0), vouched


def _quadratic(columns: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """Parabolas through columns (3, k, c) of the tabulated stretches, at the stretches (k,)."""
    s = (stretch / (ellipses.ASPECT_STRETCHES[1] - ellipses.ASPECT_STRETCHES[0]))[:, None]
    return columns[0] * s * (s - 1) / 2 + columns[1] * (1 - s**2) + columns[2] * s * (s + 1) / 2


@dataclass(frozen=True)
class HertzScene:
    """Semi-axes (mm), layer term q, peak pressure (MPa), indentation (mm), gauge `values` (q, g) and contact area (mm2)
    of one press."""

    force: float
    semi_axes: tuple[float, float]
    layer_term: float
    peak_pressure: float
    indentation: float
    values: np.ndarray
    contact_area: float


def hertz_scene(reduced: ReducedFinger, specimen: Specimen, load: Load) -> HertzScene:
    """The press of a load; raises `ContactRangeError` where the ellipse leaves the patch."""
    force, indentation = load
    table = hertz_table(reduced, specimen)
    if indentation is not None:
        aim, limit, what, unit = indentation, table.indentation[-1], "an indentation", "mm"
    else:
        assert force is not None
        aim, limit, what, unit = force, table.cube_root[-1] ** 3 * (1 + FORCE_ROUNDING_SHARE), "a force", "N"
    if aim > limit:
        raise ContactRangeError(f"{what} of {aim:g} {unit} takes {table.end} ({limit:.3g} {unit})")
    root = math.cbrt(aim) if indentation is None else table.root_of(aim)
    force = root**3 if force is None else force
    a, b, q, depth, *per_newton = table.at(root).tolist()
    return HertzScene(
        force=force,
        semi_axes=(root * a, root * b),
        layer_term=q,
        peak_pressure=ellipses.peak_over_mean(q) * force / (math.pi * root**2 * a * b),
        indentation=root**2 * depth if indentation is None else indentation,
        values=force * np.array(per_newton).reshape(reduced.weights.shape),
        contact_area=math.pi * root * a * root * b,
    )


def hertz_press(reduced: ReducedFinger, specimen: Specimen, load: Load, status: str) -> Press:
    """The press of a load as a `Press` that says `status`; raises `ContactRangeError`."""
    scene = hertz_scene(reduced, specimen, load)
    a, b = scene.semi_axes
    patch = reduced.patch
    x, y = patch.xy.T
    shape = ellipses.layer_factor(np.sqrt(np.maximum(0.0, 1 - (x / a) ** 2 - (y / b) ** 2)), scene.layer_term)
    # If an ellipse lies between the nodes, the nearest node carries it; in any case the nodal pressures are scaled to
    # the force
    shape[np.argmin(np.hypot(x, y))] += float(not shape.any())
    pressure = scene.force / (reduced.multiplicity * patch.mass @ shape) * shape
    return linear_press(
        reduced,
        specimen,
        fidelity="hertz",
        force_balance=abs(float(reduced.multiplicity * patch.mass @ pressure) - scene.force) / scene.force,
        status=status,
        resolved=True,
        pressure=pressure,
        active=shape > 0,
        **{name: getattr(scene, name) for name in ("force", "values", *CONTACT_MEASURES)},
    )
