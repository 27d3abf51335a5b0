"""The `contact` fidelity: unilateral frictionless contact on the condensed finger, a linear complementarity problem.

Find nodal pressures p >= 0 and weak gaps w = A p + g - delta m >= 0 with p . w = 0, where A is the compliance of finger
and specimen, g the weak gap, m the mass of the nodes, delta the indentation; under force control m . p = force.
Solved by block principal pivoting, with single pivots as the backup that cannot cycle (Judice and Pires 1994,
doi:10.1016/0305-0548(94)90106-6). All decisions are signs, so rescaled units change nothing.
"""

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from papilla.errors import ContactRangeError, SolverError
from papilla.fem.pressing.hertz import (
    FLATTEST,
    SECOND,
    SHARPEST,
    SIXTH,
    HertzScene,
    hertz_scene,
    hertz_table,
    layer_factor,
    mean_square,
    peak_over_mean,
)
from papilla.fem.pressing.press import Press, linear_press, refuse_detail, too_coarse
from papilla.fem.reduction.compliance import quadrature, weak_gap
from papilla.fem.reduction.patch import Patch
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.specimen import Specimen

PATIENCE = 4
"""Block exchanges without progress before single pivots take over."""

MAX_PIVOTS = 2000

OFF_APEX = 0.05
"""Accuracy of the readings, in the largest of them, where the touch-down point is not the apex that the mesh is made
for: two meshes differ by up to 4.6 % there (`papilla verify --only places`)."""

SAME_ELLIPSE = 0.1
"""Difference of area from that of the Hertz fidelity, up to which its layer term is taken for that of the contact."""

TRUSTED, TRUSTED_COARSE = 0.05, 40.0
"""Mismatch of the sixth moment above which the contact is no such ellipse (a slab's line contact, say); the second is
for one element across the radius and falls with their fourth power (0.12 was measured at 4.8)."""

CUT_OFF = 0.01
"""Share of the peak pressure that, at the patch's outline, means that the contact is cut off there."""

INNER = 1.25
"""Squared radius, in its mean under the pressure, inside of which the pressure tells its profile: half of the contact.
Further out it is at the mercy of the mesh, and the profiles of layers leave the family."""

TELLING_ELEMENTS, RESOLVING_ELEMENTS = 4.0, 6.0
"""Elements across the contact radius from which the pressure tells q better than Hertz's 0, and than the energy's q."""

EDGE_BAND = 1.2
"""Widths of the strip from what pressed nodes own to what their triangles reach, by which a true ellipse may differ
from what they own (0.93 was measured at most; a square, whose low moments an ellipse can match, gives 1.5 and more)."""


class NoContactError(ContactRangeError):
    """The indentation is less than the gap at the first node of the mesh."""


@dataclass(frozen=True)
class ContactShape:
    """Area (mm2) and peak pressure (MPa); `elliptic` tells whether the moments fit, else nodes were counted."""

    area: float
    peak_pressure: float
    elliptic: bool


def contact_press(
    reduced: ReducedFinger,
    specimen: Specimen,
    force: float | None,
    indentation: float | None,
    start: np.ndarray | None,
    began: float,
) -> Press:
    """One press by force (N) or indentation (mm), the search starting from the active nodes `start` (n,).

    Raises `ContactRangeError` where contact reaches the rim, goes too deep, or is not seen by the mesh at all.
    """
    patch = reduced.patch
    refuse_detail(specimen, patch, reduced.mesh_size_mm)
    compliance, gap = reduced.total_compliance(specimen), weak_gap(patch, specimen)
    share = None if force is None else force / reduced.multiplicity
    if start is None:
        start = _hertzian_guess(reduced, specimen, force, indentation)
    solution = solve_contact(compliance, patch.mass, gap, force=share, indentation=indentation, start=start)
    if not solution.active.any():
        raise NoContactError(f"an indentation of {indentation:g} mm makes no contact on this mesh: it is too coarse")
    return contact_result(
        reduced,
        specimen,
        began,
        force=force,
        pressure=solution.pressure,
        indentation=solution.indentation,
        active=solution.active,
        values=reduced.rows @ solution.pressure,
        status=f"contact: converged in {solution.iterations} exchanges",
    )


def contact_result(
    reduced: ReducedFinger,
    specimen: Specimen,
    began: float,
    *,
    force: float | None,
    pressure: np.ndarray,
    status: str,
    active: np.ndarray,
    **values,
) -> Press:
    """The press of a solved contact, and how far the mesh lets it be trusted; `force` (N) is the one asked for."""
    patch = reduced.patch
    total = float(reduced.multiplicity * patch.mass @ pressure)
    shape = _shape(reduced, specimen, pressure, total)
    coarse = too_coarse(shape.area, patch.mean_edge(active), reduced.mesh_size_mm)
    status = coarse or status
    if coarse is None and reduced.at != (0.0, 0.0):
        status += f"; off the apex the mesh is coarser, and readings are within {100 * OFF_APEX:g} %"
    return linear_press(
        reduced,
        specimen,
        began,
        compliance=reduced.total_compliance(specimen),
        force=total if force is None else force,
        fidelity="contact",
        contact_area=shape.area,
        peak_pressure=shape.peak_pressure,
        force_balance=0.0 if force is None else abs(total - force) / force,
        status=status,
        resolved=coarse is None,
        pressure=pressure,
        active=active,
        **values,
    )


def _hertzian_guess(reduced, specimen, force, indentation) -> np.ndarray | None:
    """Active nodes (n,) of the Hertz fidelity, or None where it has no answer; only where the search starts."""
    scene = hertzian(reduced, specimen, force, indentation)
    if scene is None:
        return None
    x, y = reduced.patch.xy.T
    return (x / scene.semi_axes[0]) ** 2 + (y / scene.semi_axes[1]) ** 2 < 1


def _shape(reduced, specimen, pressure: np.ndarray, force: float) -> ContactShape:
    """Area and peak of the nodal pressure (n,), the layer term from hertz where both see the same ellipse."""
    scene = hertzian(reduced, specimen, force, None)
    if scene is not None:
        shape = contact_shape(reduced.patch, pressure, scene.layer_term)
        if abs(np.pi * np.prod(scene.semi_axes) / shape.area - 1) < SAME_ELLIPSE:
            return shape
    return contact_shape(reduced.patch, pressure)


def hertzian(
    reduced: ReducedFinger, specimen: Specimen, force: float | None, indentation: float | None
) -> HertzScene | None:
    """The scene of the Hertz fidelity at a force (N) or indentation (mm); None where it has none."""
    if not _has_table(reduced, specimen):
        return None
    try:
        return hertz_scene(reduced, specimen, force, indentation)
    except ContactRangeError:
        return None


@lru_cache(maxsize=64)
def _has_table(reduced, specimen) -> bool:
    """Whether hertz knows this finger and specimen; asked once, for the answer takes as long as the table."""
    try:
        hertz_table(reduced, specimen)
    except ContactRangeError:
        return False
    return True


@dataclass(frozen=True, eq=False)
class ContactSolution:
    """Nodal pressure (n,) in MPa, indentation in mm, active nodes (n,) and how many exchanges it took."""

    pressure: np.ndarray
    indentation: float
    active: np.ndarray
    iterations: int


def solve_contact(
    compliance: np.ndarray,
    mass: np.ndarray,
    gap: np.ndarray,
    *,
    force: float | None = None,
    indentation: float | None = None,
    start: np.ndarray | None = None,
) -> ContactSolution:
    """Solve for a given force on the patch (N) or indentation (mm); exactly one is given.

    Parameters
    ----------
    compliance : (n, n) symmetric positive definite, mm3 / MPa.
    mass : (n,) mm2; gap : (n,) mm3.
    start : (n,) bool, active nodes of a similar scene, to start from.

    Raises `SolverError` where the exchanges do not settle.
    """
    active = np.asarray(gap / mass <= np.partition(gap / mass, min(8, len(gap) - 1))[min(8, len(gap) - 1)])
    if start is not None and start.any():
        active = start.copy()
    best, patience = len(mass) + 1, PATIENCE
    for iteration in range(1, MAX_PIVOTS + 1):
        pressure, depth = _solve_active(compliance, mass, gap, active, force, indentation)
        weak_gap = compliance[:, active] @ pressure[active] + gap - depth * mass
        wrong = np.where(active, pressure < 0, weak_gap < 0)
        count = int(wrong.sum())
        if count == 0:
            return ContactSolution(pressure, depth, active, iteration)
        if count < best:
            best, patience = count, PATIENCE
        else:
            patience -= 1
        if patience > 0:
            active = active ^ wrong
        else:
            active = active.copy()
            last = np.flatnonzero(wrong)[-1]
            active[last] = not active[last]
        if force is not None and not active.any():
            active[np.argmin(gap / mass)] = True
    raise SolverError(f"contact did not settle in {MAX_PIVOTS} exchanges ({best} nodes undecided at best)")


def _solve_active(compliance, mass, gap, active, force, indentation) -> tuple[np.ndarray, float]:
    """Pressure with zero weak gap on the active nodes, and the indentation."""
    pressure = np.zeros(len(mass))
    if not active.any():
        return pressure, float(indentation)
    index = np.flatnonzero(active)
    factor, failed = dpotrf(compliance[np.ix_(index, index)].T, lower=True, overwrite_a=True, clean=False)
    if failed:
        raise SolverError("the compliance is not positive: an unstable finger, or a mesh too coarse for the specimen")
    per_depth, offset = dpotrs(factor, np.stack([mass[index], gap[index]]).T, lower=True)[0].T
    depth = indentation if force is None else (force + mass[index] @ offset) / (mass[index] @ per_depth)
    pressure[index] = depth * per_depth - offset
    return pressure, float(depth)


def contact_shape(patch: Patch, pressure: np.ndarray, expected_q: float | None = None) -> ContactShape:
    """Area and peak of a nodal pressure (n,) in MPa on a patch with all its images.

    `expected_q` is the profile's layer term as the energy has it, for contacts too small for their moments to tell.
    """
    points, weights, hats = quadrature(patch)
    load = weights * (hats @ pressure)
    total = float(load.sum())
    share = load / total
    mirrored = (patch.images < 0).any(axis=0)
    x, y = (points - np.where(mirrored, 0.0, share @ points)).T
    xx, yy = float(share @ x**2), float(share @ y**2)
    xy = 0.0 if mirrored.any() else float(share @ (x * y))
    determinant = xx * yy - xy**2
    counted = ContactShape(len(patch.images) * float(patch.mass[pressure > 0].sum()), float(pressure.max()), False)
    # Cut off by the skin's own edge, as on a slab, it is no ellipse either
    cut_off = pressure[patch.outline].max() > CUT_OFF * pressure.max()
    if cut_off or determinant <= 0:
        return counted
    square = (yy * x**2 - 2 * xy * x * y + xx * y**2) / (2 * determinant)
    q = _layer_term(float(share @ _inner_share(square)))
    if q is None:
        return counted
    # By Hertz alone the radius is nearly right already: enough to count the elements across it
    edge = patch.mean_edge(pressure > 0)
    spread = float(np.sqrt(determinant))
    elements = float(np.sqrt(2 * spread / SECOND[0]) / edge)
    sixth = ((1 - q) * SIXTH[0] + q * SIXTH[1]) / mean_square(q) ** 3
    if abs(sixth / float(share @ square**3) - 1) > TRUSTED + TRUSTED_COARSE / elements**4:
        return counted
    known, needed = (0.0, TELLING_ELEMENTS) if expected_q is None else (expected_q, RESOLVING_ELEMENTS)
    q = known + (q - known) / (1 + (needed / elements) ** 12)
    area = 2 * np.pi * spread / mean_square(q)
    reached = len(patch.images) * float(weights[load > 0].sum())
    if abs(area - counted.area) > EDGE_BAND * (reached - counted.area):
        return counted
    mean = len(patch.images) * total / area
    return ContactShape(area, mean * peak_over_mean(q), True)


@cache
def _profiles() -> tuple[np.ndarray, np.ndarray]:
    """Layer terms and the inner shares of their profiles, both (k,) and rising."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    t, terms = (1 + nodes) / 2, np.linspace(FLATTEST, SHARPEST, 501)[:, None]
    share = _inner_share((1 - t**2) / mean_square(terms)) * layer_factor(t, terms) * t @ weights
    return terms[:, 0], share


def _inner_share(square: np.ndarray) -> np.ndarray:
    """Weight of the pressure at squared radii, over their mean, that tells the profile."""
    return np.maximum(0.0, 1 - square / INNER) ** 2


def _layer_term(inner: float) -> float | None:
    """q from the inner share of a pressure; None where the family has no such member."""
    terms, shares = _profiles()
    return float(np.interp(inner, shares, terms)) if shares[0] <= inner <= shares[-1] else None
