"""The `contact` rung: the complementarity problem of a finger and its specimen, and when its answer means something."""

from functools import lru_cache

import numpy as np

from papilla.errors import ContactRangeError
from papilla.fem.pressing.complementarity import ContactSolution, solve_contact
from papilla.fem.pressing.hertz import HertzScene, hertz_scene
from papilla.fem.pressing.hertz_table import hertz_table
from papilla.fem.pressing.moments import ContactShape, contact_shape
from papilla.fem.pressing.press import Press, press_result
from papilla.fem.reduction.compliance import quadrature
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.specimen import Block, Specimen, Sphere

RESOLVED_RADIUS = 2.5
"""Contact radius in patch edge lengths from which the contact rung is within 3 % in S_d (measured: docs/adr/0005)."""

OFF_APEX = 0.05
"""Accuracy of the readings, in the largest of them, where the touch-down point is not the apex that the mesh is made
for: two meshes differ by up to 4.6 % there (`papilla verify --only places`)."""

DEEPEST = 0.5
"""Share of the soft tissue, or of a bonded block, that a press may take up before it is refused."""

SAME_ELLIPSE = 0.1
"""Difference of area from that of the Hertz rung, up to which its layer term is taken for that of the contact."""

BESIDE = 1e3
"""Gap beside a ball, in ball radii: far beyond any contact."""


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
    compliance = _total_compliance(reduced, specimen)
    share = None if force is None else force / reduced.multiplicity
    gap = patch.gap + _sphere_gap(reduced, specimen)
    if start is None:
        start = _hertzian_guess(reduced, specimen, force, indentation)
    solution = solve_contact(compliance, patch.mass, gap, force=share, indentation=indentation, start=start)
    if not solution.active.any():
        raise ContactRangeError(
            f"an indentation of {indentation:g} mm makes no contact on this mesh: the mesh is too coarse"
        )
    _refuse_deep_parts(reduced, specimen, solution)
    if (solution.active & patch.rim).any():
        radius = float(np.hypot(*patch.xy[patch.rim].T).min())
        raise ContactRangeError(f"the contact reaches the rim of its patch, {radius:.3g} mm from the touch-down point")
    total = float(reduced.multiplicity * patch.mass @ solution.pressure)
    shape = _shape(reduced, specimen, solution.pressure, total)
    resolved, status = _resolution(reduced, solution, shape.area)
    strain, curvature = reduced.strain_rows @ solution.pressure, reduced.curvature_rows @ solution.pressure
    return press_result(
        reduced,
        specimen,
        began,
        force=total if force is None else force,
        fidelity="contact",
        indentation=solution.indentation,
        contact_area=shape.area,
        peak_pressure=shape.peak_pressure,
        strain=strain,
        curvature=curvature,
        force_balance=0.0 if force is None else abs(total - force) / force,
        status=status,
        resolved=resolved,
        pressure=solution.pressure,
        active=solution.active,
    )


def _hertzian_guess(reduced, specimen, force, indentation) -> np.ndarray | None:
    """Active nodes (n,) of the Hertz rung, or None where it has no answer; only where the search starts."""
    scene = _hertzian(reduced, specimen, force, indentation)
    if scene is None:
        return None
    x, y = reduced.patch.xy.T
    return (x / scene.semi_axes[0]) ** 2 + (y / scene.semi_axes[1]) ** 2 < 1


def _shape(reduced, specimen, pressure: np.ndarray, force: float) -> ContactShape:
    """Area and peak of the nodal pressure (n,), the layer term from the Hertz rung where both see the same ellipse."""
    scene = _hertzian(reduced, specimen, force, None)
    if scene is not None:
        shape = contact_shape(reduced.patch, pressure, scene.layer_term)
        if abs(np.pi * np.prod(scene.semi_axes) / shape.area - 1) < SAME_ELLIPSE:
            return shape
    return contact_shape(reduced.patch, pressure)


def _hertzian(reduced, specimen, force, indentation) -> HertzScene | None:
    if not _has_table(reduced, specimen):
        return None
    try:
        return hertz_scene(reduced, specimen, force, indentation)
    except ContactRangeError:
        return None


@lru_cache(maxsize=64)
def _has_table(reduced, specimen) -> bool:
    """Whether the Hertz rung knows this finger and specimen; asked once, for the answer takes as long as the table."""
    try:
        hertz_table(reduced, specimen)
    except ContactRangeError:
        return False
    return True


@lru_cache(maxsize=64)
def _total_compliance(reduced: ReducedFinger, specimen: Specimen) -> np.ndarray:
    return reduced.compliance + reduced.specimen_compliance(specimen)


@lru_cache(maxsize=16)
def _sphere_gap(reduced: ReducedFinger, specimen: Specimen) -> np.ndarray | float:
    """Weak gap (n,) that a ball adds to that of a flat: the exact sphere's, and beside it nothing to touch."""
    if not isinstance(specimen, Sphere):
        return 0.0
    points, weights, hats = quadrature(reduced.patch)
    square = (points**2).sum(axis=1)
    under = square < specimen.radius**2
    gap = np.where(
        under, specimen.radius - np.sqrt(np.maximum(0, specimen.radius**2 - square)), BESIDE * specimen.radius
    )
    return hats.T @ (weights * gap)


def _resolution(reduced: ReducedFinger, solution: ContactSolution, area: float) -> tuple[bool, str]:
    """Whether the mesh is fine enough for a contact, and the sentence that says so."""
    radius = float(np.sqrt(area / np.pi))
    edge = float(reduced.patch.edge_length[solution.active].mean())
    if radius >= RESOLVED_RADIUS * edge:
        found = f"contact rung: converged in {solution.iterations} exchanges"
        if reduced.at != (0.0, 0.0):
            found += f"; off the apex the mesh is coarser, and readings are within {100 * OFF_APEX:g} %"
        return True, found
    return False, (
        f"mesh too coarse for this light press: a contact radius of {radius:.2g} mm on {edge:.2g} mm elements, "
        f"S_d may be off by more than 3 %; mesh with size_mm <= {radius / RESOLVED_RADIUS:.2g}"
    )


def _refuse_deep_parts(reduced: ReducedFinger, specimen: Specimen, solution: ContactSolution) -> None:
    """Refuse what small-strain theory cannot mean: half of the soft tissue, or of a bonded block, gone."""
    moved = reduced.compliance @ solution.pressure
    own = float((moved / reduced.patch.mass).max())
    if own > DEEPEST * reduced.depth:
        raise ContactRangeError(
            f"the press reaches {own:.3g} mm into a finger with {reduced.depth:.3g} mm of soft tissue: "
            f"more than {100 * DEEPEST:g} % is beyond the model"
        )
    if isinstance(specimen, Block):
        both = _total_compliance(reduced, specimen) @ solution.pressure
        taken = float(((both - moved) / reduced.patch.mass).max())
        if taken > DEEPEST * specimen.thickness:
            raise ContactRangeError(
                f"the press takes {taken:.3g} mm off a block of {specimen.thickness:g} mm: "
                f"more than {100 * DEEPEST:g} % is beyond the model"
            )
