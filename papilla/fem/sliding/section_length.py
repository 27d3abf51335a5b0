"""Which length along y turns the section's N/mm into N: that of the contact in three dimensions."""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import LinearNDInterpolator

from papilla.errors import InputError
from papilla.fem.pressing.fidelity import press
from papilla.fem.reduction.finger_model import prepare
from papilla.finger import Finger, Slab
from papilla.specimen import HalfSpace

RIGID_MPA = 1e4
"""Modulus of what the three-dimensional finger is pressed on: rigid against silicone."""

LINE_POINTS = 2001
"""Points of the integral along x."""


def section_length(
    finger: Finger,
    *,
    force: float | None = None,
    indentation: float | None = None,
    progress: Callable[[str], None] = lambda line: None,
) -> float:
    """Effective length L (mm): force over the line load (N/mm) that the 3-D contact with a flat carries at y = 0.

    Of a slab its depth. Frictionless, contact alone; give the force (N) or the indentation (mm). Raises `InputError`,
    and `ContactRangeError` for a load beyond the contact patch.
    """
    if isinstance(finger.shape, Slab):
        return finger.shape.depth
    if (force is None) == (indentation is None):
        raise InputError("section_length: give exactly one of force and indentation")
    reduced = prepare(finger, progress=progress)
    found = press(reduced, HalfSpace(RIGID_MPA), force=force, indentation=indentation, fidelity="contact", friction=0)
    xy = np.concatenate([reduced.patch.xy * image for image in reduced.patch.images])
    pressure = np.tile(found.pressure, len(reduced.patch.images))
    along = np.linspace(xy[:, 0].min(), xy[:, 0].max(), LINE_POINTS)
    _, once = np.unique(xy.round(9), axis=0, return_index=True)
    line = LinearNDInterpolator(xy[once], pressure[once], fill_value=0.0)(along, np.zeros_like(along))
    return float(found.force / np.trapezoid(line, along))
