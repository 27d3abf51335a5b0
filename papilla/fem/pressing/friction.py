"""A press with friction between finger and specimen: a point on the path of a force that grows from first touch."""

import math
from functools import lru_cache

import numpy as np

from papilla.errors import InputError
from papilla.fem.pressing.contact import NoContactError, contact_result
from papilla.fem.pressing.friction_path import FrictionPath
from papilla.fem.pressing.friction_step import FrictionProblem
from papilla.fem.pressing.press import Press, refuse_detail
from papilla.fem.reduction.compliance import weak_gap
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.specimen import Specimen

UNLIKE = 1e-6
"""Difference, as a share of the largest, between the two compliances that a specimen gives for pressure alone."""


def friction_press(
    reduced: ReducedFinger,
    specimen: Specimen,
    force: float | None,
    indentation: float | None,
    friction: float,
    began: float,
) -> Press:
    """One press by force (N) or indentation (mm) with a coefficient of friction > 0, infinite for stick.

    The finger is pushed along the contact normal, and held sideways. Raises `ContactRangeError` as `contact_press`
    does, `InputError` for a specimen whose tangential compliance does not fit its normal one.
    """
    refuse_detail(specimen, reduced.patch, reduced.mesh_size_mm)
    path = friction_path(reduced, specimen, friction)
    share = None if force is None else force / reduced.multiplicity
    state = path.at(force=share, indentation=indentation)
    if state is None:
        raise NoContactError(f"an indentation of {indentation:g} mm makes no contact on this mesh: it is too coarse")
    taken = sum(knot.indentation < state.indentation for knot in path.knots)
    held = f"friction {friction:g}: {state.slipping.sum()} of {state.active.sum()} nodes slip"
    if math.isinf(friction):
        held = "stuck from the moment of contact"
    return contact_result(
        reduced,
        specimen,
        began,
        force=force,
        pressure=state.traction[0],
        indentation=state.indentation,
        active=state.active,
        values=reduced.traction_rows @ state.traction.ravel(),
        status=f"contact: {held}, the force grown from first touch in {taken} steps",
        shear=state.traction[1:],
        friction=friction,
    )


@lru_cache(maxsize=8)
def friction_path(reduced: ReducedFinger, specimen: Specimen, friction: float) -> FrictionPath:
    """The path of one finger, specimen and coefficient; kept, so that the presses of a sweep share it."""
    patch = reduced.patch
    theirs = reduced.specimen_traction_compliance(specimen)
    n, normal = len(patch.xy), reduced.specimen_compliance(specimen)
    if np.abs(theirs[:n, :n] - normal).max() > UNLIKE * normal.max():
        raise InputError(
            f"{specimen.words}: traction_compliance, which friction needs, does not fit compliance: override both"
        )
    fixed = ((patch.xy == 0) & (patch.images < 0).any(axis=0)).T
    problem = FrictionProblem(reduced.traction_compliance + theirs, patch.mass, weak_gap(patch, specimen), fixed)
    return FrictionPath(problem, friction)
