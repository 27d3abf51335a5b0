"""Stiffness of finger and specimen under elliptic pressures, and the response of the gauges to them: the tables of
`hertz`.

Quantity: E*(a, b/a, pair of terms), the contact modulus that a homogeneous half-space must have for the same energy
under a pressure ellipse of semi-axes a, b. The pressure has two terms, t = sqrt(1 - u) and t^3 with
u = (x/a)^2 + (y/b)^2, so the energy is a quadratic form in their shares, with three pairs. For each ellipse

    1 / E* = p . C p / (p . C_0 p),     C of finger + specimen / E,   C_0 of a half-space of 1 MPa,

p being the nodal pressures. C is known only on the nodes, so E* is measured for ellipses of at least
`SMALLEST_RADIUS_EDGES` elements. For smaller ones a polynomial in a extends ln E* to its known limit at a = 0, that of
the outer layer. The matrices of finger and specimen enter separately, so a new modulus E of the specimen needs no new
ellipses. The method fails if no ellipse fits on the patch, or if the skin is not convex."""

import math
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from scipy.special import ellipk

from papilla.core import cache
from papilla.core.errors import ContactRangeError
from papilla.fem.reduction.patch import Patch, quadrature
from papilla.fem.reduction.reduced import ReducedFinger, kept
from papilla.model.specimen import Specimen
from papilla.references import hertz_ellipse
from papilla.references.hertz import MAX_RADIUS_RATIO

Array = TypeVar("Array", float, np.ndarray)

SECOND_MOMENTS, SIXTH_MOMENTS = (2 / 5, 2 / 7), (16 / 105, 16 / 231)
"""Moments of u and u^3 under the two terms, per unit force."""
HALF_SPACE_ENERGY = (1.0, 15 / 14, 25 / 21)
"""Energy of the three pairs of pressure terms (t with t, t with t^3, t^3 with t^3) on a half-space, relative to the
first: integrals of (J_m(x) / x^m) (J_n(x) / x^n) over x, m, n = 3/2 and 5/2."""

FLATTEST_Q, SHARPEST_Q = -1.5, 1.0  # Bounds of q: beyond them the pressure is negative in the middle or at the edge
SMALLEST_RADIUS_EDGES = 2.0
"""Smallest radius, in patch edge lengths, at which E* is measured; below it E* is extrapolated to its known limit at a
= 0."""

ELLIPSE_SUBDIVISIONS = 6
"""Number of parts into which a triangle's edge is cut for integrals of a Hertzian pressure and of the skin's
curvature."""

TABLE_POINTS = 32
ELLIPSE_TABLE_ROWS = (40, 400)
"""Number of tabulated ellipses of one aspect with radii below `SMALLEST_RADIUS_EDGES`, and above; cubics interpolate
between them."""

SMALL_POINTS, SMALL_RANGE = 10, (0.05, 0.95)
"""Number and range (in smallest measured radii) of smaller radii at which the gauges' readings are tabulated, but not
E*."""

ASPECT_STRETCHES = (-0.06, 0.0, 0.06)
"""Stretches at which ellipses are tabulated: ln of b / a relative to that of Hertz. The layers of the default finger
change it by up to 0.06."""

MODULUS_DEGREES = (7, 5, 2)
"""Largest degrees in a of the terms of ln E* with the stretch to the power 0, 1, 2. There is no constant term, because
E*(0) is known. On a coarse patch, whose smallest measured ellipse is large, the degree is lower."""

CURVATURE_REACH, FITTED_NODES = 0.27, 28
"""Share of the patch's radius over which the skin's curvature is fitted (4 mm of 15), and the smallest number of nodes
for the fit."""


def layer_factor(t: Array, q: Array) -> Array:
    """Pressure over mean pressure at t = sqrt(1 - u), for t in [0, 1]."""
    return 1.5 * (1 - q) * t + 2.5 * q * t**3


def mean_square(q: Array) -> Array:
    """Mean of u under the profile."""
    return SECOND_MOMENTS[0] - (SECOND_MOMENTS[0] - SECOND_MOMENTS[1]) * q


def peak_over_mean(q: float) -> float:
    """Largest pressure over mean pressure."""
    inside = np.sqrt((1 - q) / (-5 * q)) if q < 0 else 1.0
    return float(max(layer_factor(1.0, q), layer_factor(min(inside, 1.0), q)))


@dataclass(frozen=True, eq=False)
class EllipseFamily:
    """What the tables of one finger and one shape of specimen share; m measured radii, k tabulated radii, t terms of ln
    E*.

    gap_radii : (2,) mm. aspects : (3,) b / a of the stretches. radius : (k,) semi-axes a, mm.
    finger, specimen : (3 pairs, 3 aspects, m) compliances under unit ellipses, relative to a half-space of 1 MPa, for a
    specimen of 1 MPa. fit : (t, 3 m) from ln E* to its terms. terms, slopes : (3, k, t) of them, and by a.
    half_space : (3,) energies. influence : (3 aspects, 2 terms, k, q g) response of the gauges per newton.
    """

    gap_radii: np.ndarray
    aspects: np.ndarray
    radius: np.ndarray
    finger: np.ndarray
    specimen: np.ndarray
    fit: np.ndarray
    terms: np.ndarray
    slopes: np.ndarray
    half_space: np.ndarray
    influence: np.ndarray

    def bend(self, aspect: np.ndarray) -> np.ndarray:
        """Gap under ellipses of aspects (...) per square of a and newton, 1/mm."""
        return (1 / self.gap_radii[0] + aspect**2 / self.gap_radii[1]) / 10


@kept()
def ellipse_family(reduced: ReducedFinger, unit: Specimen) -> EllipseFamily:
    """The ellipses of a finger on specimens of one shape, given as `Specimen.unit`; the latest results are kept. If the
    finger lies in the cache, what serves specimens of any modulus is kept there, too.

    Raises `ContactRangeError` if the skin is not convex, no ellipse fits on the patch, or the specimen has no
    curvature.
    """
    if unit.curvature is None:
        raise ContactRangeError(f"hertz fidelity needs a specimen with a curvature; a {unit.words} has none")
    # Energies of the same nodal pressures on half-space, finger and specimen. Their ratios are compliances relative to
    # the half-space, so errors of the mesh nearly cancel.
    matrices = reduced.half_space, reduced.compliance, reduced.specimen_compliance(unit)
    parts = reduced.patch, unit.curvature, matrices, reduced.rows
    if reduced.cached and unit.elastic:
        return EllipseFamily(**cache.fetch("ellipse_family", cache.key(__name__, *parts), lambda: _family(*parts)))
    return EllipseFamily(**_family(*parts))


def _family(patch: Patch, curvature: tuple[float, float], matrices: tuple, rows: np.ndarray) -> dict[str, np.ndarray]:
    """The arrays of `EllipseFamily`, for the curvatures (1/mm) of a specimen, the compliances (n, n) of half-space,
    finger and specimen, and the rows (q, g, n) of the gauges."""
    gap_radii = _radii(patch, curvature)
    round_ = hertz_ellipse(1.0, *gap_radii, 1.0)
    aspects = round_.b / round_.a * np.exp(ASPECT_STRETCHES)
    smallest, largest = _measured_radii(patch, aspects)
    share = smallest / largest
    # Geometric below the smallest measured ellipse, where presses are light; evenly spaced above.
    radius = largest * np.append(
        np.geomspace(1e-3 * share, share, ELLIPSE_TABLE_ROWS[0])[:-1], np.linspace(share, 1, ELLIPSE_TABLE_ROWS[1])
    )
    # Semi-axes a (mm) of the tabulated ellipses; the first ones are below `smallest`.
    below, above = np.linspace(*SMALL_RANGE, SMALL_POINTS) * smallest, np.geomspace(smallest, largest, TABLE_POINTS)
    tabulated, measured = np.append(below, above), above / largest
    # A polynomial can bridge a gap about as wide as the wavelength of its oscillations, but not a wider one
    bridging = max(2, math.ceil(largest / smallest))
    powers = [(i, j) for j, degree in enumerate(MODULUS_DEGREES) for i in range(1, min(degree, bridging) + 1)]
    i, j = np.array(powers).T
    stretches = np.array(ASPECT_STRETCHES)[:, None, None]
    # Ellipses of each aspect depend on the patch alone, not on moduli, and take most of the computing time
    key, make_ellipses = cache.key(__name__, patch, smallest, largest, aspects), partial(_ellipses, patch, tabulated)
    ellipses = cache.fetch("ellipses", key, lambda: {"pressure": np.array([*map(make_ellipses, aspects)])})["pressure"]
    flat, finger, specimen = (
        np.stack([_energies(compliance, shapes) for shapes in ellipses], axis=1) for compliance in matrices
    )
    # Mean displacement times a under a Hertzian ellipse of unit force on a half-space with E* = 1 MPa.
    long, short = np.maximum(aspects, 1.0), np.minimum(aspects, 1.0)
    return {
        "gap_radii": np.array(gap_radii),
        "aspects": aspects,
        "radius": radius,
        "finger": finger / flat,
        "specimen": specimen / flat,
        "fit": np.linalg.pinv((measured[:, None] ** i * stretches**j).reshape(-1, len(powers))),
        "terms": (radius[:, None] / largest) ** i * stretches**j,
        "slopes": i / largest * (radius[:, None] / largest) ** (i - 1) * stretches**j,
        "half_space": 0.8 * 1.5 / np.pi * ellipk(1 - (short / long) ** 2) / long,
        "influence": np.array([_influences(patch, rows, shapes, tabulated, radius) for shapes in ellipses]),
    }


def moduli(family: EllipseFamily, outer_modulus: float, specimen: Specimen) -> tuple[np.ndarray, np.ndarray, float]:
    """ln E* (MPa) of finger and specimen minus its value at a = 0 (3 pairs of pressure terms, 3 aspects, k); the
    derivative by a; and the value at a = 0, which is that of the outer layer (`ReducedFinger.outer_modulus`)."""
    limit = -math.log(1 / outer_modulus + 1 / specimen.contact_modulus)
    compliance = family.finger + family.specimen * (1 / specimen.modulus if specimen.elastic else 1.0)
    if not (compliance > 0).all():
        raise ContactRangeError("hertz fidelity: finger and specimen have no positive compliance on this patch")
    coefficients = family.fit @ (-np.log(compliance) - limit).reshape(3, -1).T
    change, slope = (np.moveaxis(basis @ coefficients, -1, 0) for basis in (family.terms, family.slopes))
    return change, slope, limit


def _energies(matrix: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """Energies (3 pairs of terms, m) of a compliance (n, n) under unit ellipses, nodal pressures (2, m + small, n)."""
    # The smallest ellipses fall between the nodes: their energy would be that of the mesh.
    hertz, layer_term = shapes[:, SMALL_POINTS:]
    pairs = ((hertz, hertz), (hertz, layer_term), (layer_term, layer_term))
    return np.array([((first @ matrix) * second).sum(axis=1) for first, second in pairs])


def _measured_radii(patch: Patch, aspects: np.ndarray) -> tuple[float, float]:
    """Smallest and largest semi-axis a (mm) at which ellipses of these aspects are measured on the patch."""
    # Ellipses must lie inside the patch's outline, whether the skin continues beyond it or ends there
    x, y = patch.xy[patch.outline].T
    largest = float(np.hypot(x, y / aspects[:, None]).min())
    shorter = largest * min(1.0, aspects.min())
    edge = patch.finest_edge
    if shorter < SMALLEST_RADIUS_EDGES * edge:
        raise ContactRangeError(
            "hertz fidelity needs a patch that contains its ellipse: "
            f"{largest:.2g} x {largest * aspects[1]:.2g} mm at most on {edge:.2g} mm elements"
        )
    return min(SMALLEST_RADIUS_EDGES * edge, largest / 4), largest


def _influences(patch: Patch, rows, ellipses: np.ndarray, tabulated: np.ndarray, radius) -> list[np.ndarray]:
    """Response of the gauges (k, q g) per newton to each pressure term of the `ellipses` of `tabulated` radii, at radii
    (k,)."""
    from scipy.interpolate import PchipInterpolator

    rows = rows.reshape(-1, len(patch.xy))
    influences = []
    for shapes in ellipses:
        load = len(patch.images) * shapes @ patch.mass
        # On a coarse patch the smallest ellipses fall between the quadrature points
        caught = load > 0
        per_force = (shapes @ rows.T)[caught] / load[caught, None]
        # Interpolated over a^2: readings per newton are even in a, because a small ellipse differs from a point load by
        # its second moments.
        at = np.append(0, np.square(tabulated)[caught])
        influences.append(PchipInterpolator(at, np.vstack([per_force[:1], per_force]))(radius**2))
    return influences


def _ellipses(patch: Patch, tabulated: np.ndarray, aspect: float) -> np.ndarray:
    """Nodal pressures (2, k, n) of the tabulated ellipses under each term of the profile, sqrt(1 - u) and its cube,
    projected on the nodes so that force and moments stay the same."""
    points, weights, hats = quadrature(patch, subdivisions=ELLIPSE_SUBDIVISIONS)
    square = points[:, 0] ** 2 + (points[:, 1] / aspect) ** 2
    inside = np.maximum(0.0, 1 - square / np.square(tabulated)[:, None])
    hertz = np.sqrt(inside)
    loads = np.concatenate([hertz, hertz * inside]) * weights
    # Least squares projection on the hat functions, which keeps force and first moments.
    mass = (hats.T @ hats.multiply(weights[:, None])).toarray()
    return np.linalg.solve(mass, hats.T @ loads.T).T.reshape(2, len(inside), -1)


def _radii(patch: Patch, curvature: tuple[float, float]) -> tuple[float, float]:
    """Radii of curvature (mm) of the gap to a specimen along x and y of the contact plane, fitted near touch-down."""
    points, weights, hats = quadrature(patch, subdivisions=ELLIPSE_SUBDIVISIONS)
    distance = np.hypot(*patch.xy.T)
    reach = float(distance.max())
    outwards = np.argsort(distance)
    last = min(int(np.searchsorted(np.cumsum(patch.copies[outwards]), FITTED_NODES)), len(distance) - 1)
    near = distance <= max(CURVATURE_REACH * reach, distance[outwards[last]])
    x, y = points.T / reach
    # An even polynomial: the curvatures are the coefficients of x^2/2 and y^2/2, terms of degree 4 take up the rest of
    # the skin's shape. Weak integrals of the terms are compared with the weak gap.
    terms = [x**2 / 2, y**2 / 2, x**4, x**2 * y**2, y**4, np.ones_like(x)]
    if len(patch.images) == 1:
        terms.append(x * y)  # A mirrored patch has no such terms; the fit is the one of the whole patch, node by node
    scale = np.sqrt(patch.copies[near])
    weak_terms = (hats.T @ (weights[:, None] * np.stack(terms, axis=1)))[near] / patch.mass[near, None]
    fitted = np.linalg.lstsq(scale[:, None] * weak_terms, scale * patch.node_gap[near] / reach, rcond=None)[0] / reach
    curvature_x, curvature_y = fitted[:2]
    curvature_x, curvature_y = np.add((curvature_x, curvature_y), curvature)
    if min(curvature_x, curvature_y) <= max(curvature_x, curvature_y) / MAX_RADIUS_RATIO:
        raise ContactRangeError("hertz fidelity needs a skin that is convex in both directions at the touch-down point")
    return 1 / curvature_x, 1 / curvature_y
