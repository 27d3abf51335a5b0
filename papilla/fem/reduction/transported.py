"""Presses beside the apex, by moving the tractions of presses at the apex along the skin.

Near the apex the skin has nearly the curvature and compliance of the apex; only the place of the contact relative to
the gauges changes. So the tractions keep their shape in the contact plane, the plane moves with the skin, and by
reciprocity

  value of a gauge = sum over nodes of (adjoint field of the gauge at the moved node) . (nodal force).

One factorisation per parity and one solve per gauge serve all presses at all places.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from papilla import checks
from papilla.errors import InputError
from papilla.fem.discrete.elements import fold, interpolation, parity_signs
from papilla.fem.reduction.finger_model import FingerModel
from papilla.fem.reduction.patch import Frame, Patch, gap_of, quadrature
from papilla.units import to_microstrain


def transported_readings(
    model: FingerModel, patch: Patch, traction: np.ndarray, places_mm: Sequence[float]
) -> np.ndarray:
    """Readings (k, m, g) in microstrain of m contacts at k places x along the finger, y = 0.

    Parameters
    ----------
    patch : that of `model.reduce()`, at the apex. traction : (m, 3, n) pressure and tangential tractions in MPa at the
        nodes, of presses there, as in `Press.traction`.
    places_mm : x (mm) of the touch-down point, as in `at=(x, 0)` of `FingerModel.reduce`.

    Raises `InputError` for tractions of another patch, or if a contact would leave the skin.
    """
    traction = np.asarray(traction, float)
    if traction.ndim != 3 or traction.shape[1:] != (3, len(patch.xy)):
        raise InputError(f"tractions must be (m, 3, {len(patch.xy)}), one row per press, got shape {traction.shape}")
    places = [checks.finite("place x (mm)", place) for place in places_mm]
    adjoints = on_each_side(model.reading_adjoints())
    pressed = np.any(traction, axis=(0, 1))
    rows = [MovedContact.at(model, patch, (place, 0.0), pressed).rows(adjoints) for place in places]
    return to_microstrain(np.einsum("kgcn,mcn->kmg", np.array(rows), traction))


@dataclass(frozen=True, eq=False)
class MovedContact:
    """The contact of the apex moved to another place of the skin; n nodes of its patch.

    directions : (3, 3) directions of pressure and the tangential tractions. pieces : for each image of the patch, and
    each image of the cell on which it lies, the signs of both and (nodes of the cell, n) integrals of shape function
    times hat function.
    """

    directions: np.ndarray
    pieces: tuple[tuple[np.ndarray, tuple[int, int], sp.csr_matrix], ...]

    @classmethod
    def at(
        cls, model: FingerModel, patch: Patch, place_mm: tuple[float, float], pressed: np.ndarray | None = None
    ) -> "MovedContact":
        """The contact moved to (x, y) in mm on the skin of `model`; pressed : (n,) nodes that may press: only they must
        stay on the skin. Raises `InputError` if they would leave it."""
        skin = model.surfaces["skin"]
        frame = Frame.at(skin, *place_mm)
        points, weights, hats = quadrature(patch)
        kept = np.ones(len(points), bool) if pressed is None else (hats @ pressed.astype(float)) > 0
        points, loads = points[kept], sp.diags(weights[kept]) @ hats[kept]
        pieces = []
        for image in patch.images:
            on_skin = frame.origin + (points * image) @ frame.axes[:2]
            on_skin = on_skin - gap_of(skin, frame, on_skin)[:, None] * frame.axes[2]
            folded, sides = fold(on_skin, model.mesh.mirrors)
            values = interpolation(model.space, folded)
            for sx, sy in np.unique(sides, axis=0).tolist():
                there = (sides == (sx, sy)).all(axis=1)
                pieces.append((image, (sx, sy), (values[there].T @ loads[there]).tocsr()))
        return cls(np.vstack([-frame.axes[2], frame.axes[:2]]), tuple(pieces))

    def rows(self, fields: Mapping[tuple[int, int], np.ndarray]) -> np.ndarray:
        """Work (k, 3, n) of unit nodal pressures and tangential tractions on fields on each image of the cell (nodes of
        the cell, 3, k), such as gauges' adjoints `on_each_side`."""
        found = 0.0
        for image, side, coupling in self.pieces:
            field = fields[side]
            there = (coupling.T @ field.reshape(len(field), -1)).reshape(-1, *field.shape[1:])
            found = found + np.einsum("nik,ci->kcn", there, self.directions * np.array([1, *image])[:, None])
        return np.asarray(found)


def on_each_side(fields: Mapping[tuple[int, int], np.ndarray]) -> dict[tuple[int, int], np.ndarray]:
    """Fields by parity (nodes of the cell, 3, k) as displacements of the cell's images, by the signs of these."""
    sides = [(sx, sy) for sx in (1, -1) for sy in (1, -1)]
    return {
        side: np.sum([field * parity_signs(parity, side)[:, None] for parity, field in fields.items()], axis=0)
        for side in sides
    }
