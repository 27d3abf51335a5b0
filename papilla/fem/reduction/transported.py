"""Readings of presses beside the apex, by moving the tractions of presses at the apex along the skin.

A short way along x the skin is bent, and gives way, nearly as at the apex: what changes is where the gauges see the
contact. So the tractions keep their shape in the contact plane, the plane goes with the skin, and a gauge's adjoint
field weighs what arrives (reciprocity): two factorisations and one solve a gauge answer all presses at all places.
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
    model: FingerModel, patch: Patch, traction: np.ndarray, places_mm: Sequence[float]
) -> np.ndarray:
    """Readings (k, m, g) in microstrain of m contacts at k places x along the finger, y = 0.

    Parameters
    ----------
    patch : that of `model.reduce()`, at the apex. traction : (m, 3, n) pressure and tangential tractions in MPa at the
        nodes, of presses there, as `Press.traction` has them.
    places_mm : x (mm) of the touch-down point, as `at=(x, 0)` of `FingerModel.reduce` has it.

    Raises `InputError` for tractions of another patch, and where a contact would leave the skin.
    """
    traction = np.asarray(traction, float)
    if traction.ndim != 3 or traction.shape[1:] != (3, len(patch.xy)):
        raise InputError(f"tractions must be (m, 3, {len(patch.xy)}), a row a press, got shape {traction.shape}")
    places = [checks.finite("place x (mm)", place) for place in places_mm]
    adjoints = model.reading_adjoints()
    points, weights, hats = quadrature(patch)
    load = (hats @ traction.reshape(-1, len(patch.xy)).T).reshape(len(points), len(traction), 3)
    pressed = load.any(axis=(1, 2))
    points, load = points[pressed], (load * weights[:, None, None])[pressed]
    # Mirror images in y = 0 do the same work: half of them stand for all.
    images = [image for image in patch.images if "y" not in model.mesh.mirrors or image[1] > 0]
    share = len(patch.images) / len(images)
    readings = [
        sum(
            np.einsum(
                "qmc,c,qcg->mg", load, (share, *share * image), _influence(model, adjoints, place, points * image)
            )
            for image in images
        )
        for place in places
    ]
    return to_microstrain(np.array(readings))


def _influence(model: FingerModel, adjoints: dict, place: float, points: np.ndarray) -> np.ndarray:
    """Readings (q, 3, g), as strain, per newton into the contact plane at `place` and along its axes, at points (q, 2)
    of that plane."""
    skin = model.surfaces["skin"]
    frame = Frame.at(skin, place, 0.0)
    normal = frame.axes[2]
    on_skin = frame.origin + points @ frame.axes[:2]
    on_skin = on_skin - gap_of(skin, frame, on_skin)[:, None] * normal
    directions = np.vstack([-normal, frame.axes[:2]])
    return np.einsum("ci,qig->qcg", directions, evaluated(model.space, model.mesh.mirrors, adjoints, on_skin))
