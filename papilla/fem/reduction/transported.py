"""Readings of presses beside the apex, by moving the pressure of presses at the apex along the skin.

A short way along x the skin is bent, and gives way, nearly as at the apex: what changes is where the gauges see the
contact. So the pressure keeps its shape in the contact plane, the plane goes with the skin, and a gauge's adjoint field
weighs what arrives (reciprocity): two factorisations and one solve a gauge answer all presses at all places.
"""

from collections.abc import Sequence

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.fem.discrete.elements import evaluated
from papilla.fem.reduction.compliance import quadrature
from papilla.fem.reduction.finger_model import FingerModel
from papilla.fem.reduction.patch import Frame, Patch, gap_of
from papilla.units import to_microstrain


def transported_readings(
    model: FingerModel, patch: Patch, pressure: np.ndarray, places_mm: Sequence[float]
) -> np.ndarray:
    """Readings (k, m, g) in microstrain of m contacts at k places x along the finger, y = 0.

    Parameters
    ----------
    patch : that of `model.reduce()`, at the apex. pressure : (m, n) nodal pressures in MPa of presses there.
    places_mm : x (mm) of the touch-down point, as `at=(x, 0)` of `FingerModel.reduce` has it.

    Raises `InputError` for pressures of another patch, and where a contact would leave the skin.
    """
    pressure = np.asarray(pressure, float)
    if pressure.ndim != 2 or pressure.shape[1] != len(patch.xy):
        raise InputError(f"pressures must be (m, {len(patch.xy)}), a row a press, got shape {pressure.shape}")
    places = [checks.finite("place x (mm)", place) for place in places_mm]
    adjoints = model.reading_adjoints()
    points, weights, hats = quadrature(patch)
    load = hats @ pressure.T
    pressed = load.any(axis=1)
    points, load = points[pressed], (load * weights[:, None])[pressed]
    # Mirror images in y = 0 do the same work: half of them stand for all.
    images = [image for image in patch.images if "y" not in model.mesh.mirrors or image[1] > 0]
    share = len(patch.images) / len(images)
    readings = [
        sum(share * load.T @ _influence(model, adjoints, place, points * image) for image in images) for place in places
    ]
    return to_microstrain(np.array(readings))


def _influence(model: FingerModel, adjoints: dict, place: float, points: np.ndarray) -> np.ndarray:
    """Readings (q, g), as strain, per newton into the contact plane at `place`, at points (q, 2) of that plane."""
    skin = model.surfaces["skin"]
    frame = Frame.at(skin, place, 0.0)
    normal = frame.axes[2]
    on_skin = frame.origin + points @ frame.axes[:2]
    on_skin = on_skin - gap_of(skin, frame, on_skin)[:, None] * normal
    return -np.einsum("i,qig->qg", normal, evaluated(model.space, model.mesh.mirrors, adjoints, on_skin))
