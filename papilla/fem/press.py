"""`press`: one scene, on the rung that was asked for or the cheapest that is good enough."""

from functools import lru_cache
from time import perf_counter

import numpy as np

from papilla import checks
from papilla.errors import ContactRangeError, InputError
from papilla.fem.contact_rung import contact_press
from papilla.fem.hertz import hertz_press, hertz_table
from papilla.fem.reduced import ReducedFinger
from papilla.fem.scene import Press
from papilla.specimen import Block, HalfSpace, Specimen, Sphere

RUNGS = ("hertz", "contact")
"""From cheap to dear."""

AUTO_QUANTITIES = ("sd", "indentation", "contact_area")
"""What `auto` holds to its tolerance."""

NEARLY_HERTZIAN = 0.1
"""Measured error of the hertz rung at the lightest resolved press, up to which `auto` trusts it with lighter ones."""

PROBE_FORCES = np.geomspace(0.02, 1.0, 6)
"""Forces (N) at which `auto` measures the hertz rung against contact."""


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
    fidelity : "hertz", "contact", or "auto": the cheapest rung whose measured error in S_d, indentation and contact
        area, for this finger, specimen and force, is within `tolerance`.
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
    if fidelity == "auto" and (error := _hertz_error(reduced, specimen, force, indentation)) <= tolerance:
        reason = f"hertz rung: {100 * error:.1f} % from contact, within {100 * tolerance:g} %"
        return hertz_press(reduced, specimen, force, indentation, reason, began)
    found = contact_press(reduced, specimen, force, indentation, start, began)
    if fidelity == "auto" and not found.resolved and (error := _lightest_error(reduced, specimen)) <= NEARLY_HERTZIAN:
        reason = (
            "hertz rung: the contact is smaller than this mesh resolves, "
            f"and {100 * error:.1f} % from Hertzian at the lightest force that it does"
        )
        return hertz_press(reduced, specimen, force, indentation, reason, began)
    return found


def _hertz_error(reduced, specimen, force: float | None, indentation: float | None) -> float:
    """Measured relative error of the hertz rung around a force; infinite where contact cannot tell."""
    if indentation is not None:
        try:
            table = hertz_table(reduced, specimen)
        except ContactRangeError:
            return np.inf
        force = float(np.interp(indentation, table.indentation, table.force))
    assert force is not None
    errors = _probe_hertz(reduced, specimen)
    if not PROBE_FORCES[0] <= force <= PROBE_FORCES[-1]:
        return np.inf
    right = int(np.clip(np.searchsorted(PROBE_FORCES, force), 1, len(PROBE_FORCES) - 1))
    return float(np.max(errors[right - 1 : right + 1]))


def _lightest_error(reduced, specimen) -> float:
    """Measured relative error of the hertz rung at the lightest probe that contact resolves; infinite where none is."""
    errors = _probe_hertz(reduced, specimen)
    return float(errors[np.isfinite(errors)][0]) if np.isfinite(errors).any() else np.inf


@lru_cache(maxsize=256)
def _probe_hertz(reduced: ReducedFinger, specimen: Specimen) -> np.ndarray:
    """Worst relative error of the hertz rung against contact at each of `PROBE_FORCES`."""
    errors, start = np.full(len(PROBE_FORCES), np.inf), None
    for k, force in enumerate(PROBE_FORCES):
        try:
            truth = contact_press(reduced, specimen, float(force), None, start, perf_counter())
            scene = hertz_press(reduced, specimen, float(force), None, "", perf_counter())
        except ContactRangeError:
            break
        start = truth.active
        if truth.resolved:
            errors[k] = max(abs(getattr(scene, name) / getattr(truth, name) - 1) for name in AUTO_QUANTITIES)
    return errors
