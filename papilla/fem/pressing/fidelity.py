"""`press`: one scene, on the rung that was asked for or the cheapest that is good enough."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.fem.pressing.auto import NEARLY_HERTZIAN, hertz_error, lightest_error, shared_losses
from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.hertz import hertz_press
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.specimen import Block, HalfSpace, Specimen, Sphere

RUNGS = ("hertz", "contact")
"""From cheap to dear."""


def press(
    reduced: ReducedFinger,
    specimen: Specimen,
    *,
    force: float | None = None,
    indentation: float | None = None,
    fidelity: str = "auto",
    tolerance: float = 0.02,
    start: np.ndarray | None = None,
) -> Press:
    """Press a specimen on the finger by a force (N) or an indentation (mm).

    Parameters
    ----------
    fidelity : "hertz", "contact", or "auto": rung hertz where its error in S_d, indentation and contact area (measured
        against contact for this finger, specimen and force, and on top of it what the mesh is known to cost) is within
        `tolerance`, else contact. The status then says
        which quantity decided, and what both are known to be off by for the mesh and for small strain
        (`prices`); rung finite, which alone is free of the latter, needs the mesh and is never taken.
    start : (n,) active nodes of a similar press, to start the contact search from.

    Raises `InputError` for unusable values, `ContactRangeError` where the press leaves what the model covers.
    """
    began = perf_counter()
    if not isinstance(specimen, HalfSpace | Block | Sphere):
        raise InputError(f"a press takes a HalfSpace, Block or Sphere, got {type(specimen).__name__}")
    if (force is None) == (indentation is None):
        raise InputError("give exactly one of force and indentation")
    force = None if force is None else checks.positive("force (N)", force)
    indentation = None if indentation is None else checks.positive("indentation (mm)", indentation)
    checks.positive("tolerance", tolerance)
    if fidelity == "finite":
        raise InputError("rung finite needs the mesh, not the reduced finger: call papilla.fem.press_finite")
    if fidelity not in (*RUNGS, "auto"):
        raise InputError(f"fidelity must be one of {', '.join(RUNGS)} or auto, got {fidelity!r}")
    if fidelity == "hertz":
        return hertz_press(reduced, specimen, force, indentation, "hertz rung as asked", began)
    if fidelity == "contact":
        return contact_press(reduced, specimen, force, indentation, start, began)
    found = _cheapest(reduced, specimen, force, indentation, tolerance, start, began)
    return replace(
        found, status=found.status + shared_losses(reduced, found.force, tolerance), seconds=perf_counter() - began
    )


def _cheapest(reduced, specimen, force, indentation, tolerance, start, began) -> Press:
    """The press on the cheapest linear rung within the tolerance, its status saying why it is that one."""
    error = hertz_error(reduced, specimen, force, indentation)
    if error is not None and error.error <= tolerance:
        reason = f"hertz rung: {error}, within {100 * tolerance:g} %"
        return hertz_press(reduced, specimen, force, indentation, reason, began)
    found = contact_press(reduced, specimen, force, indentation, start, began)
    if not found.resolved:
        light = lightest_error(reduced, specimen)
        if light is None or light.error > NEARLY_HERTZIAN:
            return found
        reason = (
            "hertz rung: the contact is smaller than this mesh resolves, "
            f"and {light} from Hertzian at the lightest force that it does"
        )
        return hertz_press(reduced, specimen, force, indentation, reason, began)
    if error is None:
        return replace(found, status=f"{found.status}; hertz is not measured at this force")
    return replace(found, status=f"{found.status}; hertz is off by {error}, over {100 * tolerance:g} %")
