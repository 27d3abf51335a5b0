"""What the gauges of a finitely deformed finger read: true elongation of the chord, curvature as the linear rungs."""

import numpy as np

from papilla.fem.discrete.locate import interpolation
from papilla.fem.discrete.space import SYMMETRIC, parity_signs
from papilla.fem.discrete.taylor_hood import TaylorHood
from papilla.fem.reduction.finger_model import image_of
from papilla.fem.reduction.gauges import QUANTITIES, gauge_functionals
from papilla.finger import Finger
from papilla.mesh.surfaces import Surface


def gauge_values(
    finger: Finger, interface: Surface, space: TaylorHood, mirrors: tuple[str, ...], displacement: np.ndarray
) -> np.ndarray:
    """What gauges feel (q, g) at a displacement (nodes of the cell, 3) that mirrors repeat: `gauges.QUANTITIES`.

    Raises `InputError` for a gauge off the mesh.
    """
    functionals = gauge_functionals(finger, interface)
    finite = [quantity.finite for quantity in QUANTITIES.values() for _ in finger.gauges]
    values = [
        value(functional, values_at(space, mirrors, displacement, functional.points))
        for value, functional in zip(finite, functionals, strict=True)
    ]
    return np.reshape(values, (len(QUANTITIES), -1))


def values_at(space: TaylorHood, mirrors: tuple[str, ...], displacement: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Displacement (k, 3) at points (k, 3) of the whole finger, from that (nodes, 3) of a mirror-symmetric cell."""
    images = image_of(points, mirrors)
    folded = points * np.column_stack([images, np.ones(len(points), dtype=int)])
    signs = np.stack([parity_signs(SYMMETRIC, (int(x), int(y))) for x, y in images])
    return signs * (interpolation(space, folded) @ displacement)
