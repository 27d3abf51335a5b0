"""The `contact` fidelity: unilateral frictionless contact on the condensed finger, a linear complementarity problem.

Find nodal pressures p >= 0 and weak gaps w = A p + g - delta m >= 0 with p . w = 0, where A is the compliance of finger
and specimen, g the weak gap, m the mass of the nodes, delta the indentation; under force control m . p = force.
All presses of a specimen are one `contact_path`. Where nodes leave again, each is solved by block principal pivoting,
with single pivots as the backup that cannot cycle (Judice and Pires 1994, doi:10.1016/0305-0548(94)90106-6). All
decisions are signs, so rescaled units change nothing.
"""

import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from papilla.errors import ContactRangeError, SolverError
from papilla.fem.pressing.contact_path import ContactPath, ContactProblem, ContactState, LeavingError
from papilla.fem.pressing.ellipses import (
    FLATTEST,
    SECOND,
    SHARPEST,
    SIXTH,
    layer_factor,
    mean_square,
    peak_over_mean,
)
from papilla.fem.pressing.hertz import HertzScene, hertz_scene, hertz_table
from papilla.fem.pressing.press import Press, linear_press, refuse_detail, too_coarse
from papilla.fem.reduction.compliance import quadrature, weak_gap
from papilla.fem.reduction.kept import kept
from papilla.fem.reduction.patch import Patch
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.specimen import Specimen

PATIENCE = 4
"""Block exchanges without progress before single pivots take over."""

MAX_PIVOTS = 2000

ORDER_STEP = 1.0
"""Steps of ln modulus at which a path through all nodes is kept, for the order in which others begin to look."""

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
    path = plain_path(reduced, specimen)
    share = None if force is None else force / reduced.multiplicity
    try:
        state = path.at(force=share, indentation=indentation)
        touching = 0 if state is None else int(state.active.sum())
        status = f"contact: {touching} nodes in contact"
    except LeavingError:
        problem = path.problem
        solution = solve_contact(
            problem.compliance, patch.mass, problem.gap, force=share, indentation=indentation, start=start
        )
        state = ContactState(solution.indentation, 0.0, solution.pressure[None], solution.active)
        status = f"contact: converged in {solution.iterations} exchanges"
    if state is None or not state.active.any():
        raise NoContactError(f"an indentation of {indentation:g} mm makes no contact on this mesh: it is too coarse")
    return contact_result(
        reduced,
        specimen,
        began,
        force=force,
        pressure=state.traction[0],
        indentation=state.indentation,
        active=state.active,
        values=reduced.rows @ state.traction[0],
        status=status,
    )


@kept(64)
def plain_path(reduced: ReducedFinger, specimen: Specimen) -> ContactPath:
    """The frictionless presses of one finger and specimen; nodes come into contact much as at a modulus near by."""
    guess = None
    if specimen.elastic:
        guess = _in_order(reduced, specimen.unit, round(math.log(specimen.modulus) / ORDER_STEP))
    return ContactPath(_problem(reduced, specimen), guess)


@kept(64)
def _in_order(reduced: ReducedFinger, unit: Specimen, level: int) -> ContactPath:
    return ContactPath(_problem(reduced, replace(unit, modulus=math.exp(ORDER_STEP * level))))


def _problem(reduced: ReducedFinger, specimen: Specimen) -> ContactProblem:
    patch = reduced.patch
    fixed = np.zeros((0, len(patch.mass)), dtype=bool)
    return ContactProblem(reduced.total_compliance(specimen), patch.mass, weak_gap(patch, specimen.unit), fixed)


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


@kept(64)
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
