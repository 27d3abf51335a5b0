"""What the gauges of a finitely deformed finger read: true elongation of the chord, curvature as the linear rungs."""

import numpy as np

from papilla.fem.discrete.locate import interpolation
from papilla.fem.discrete.space import SYMMETRIC, parity_signs
from papilla.fem.discrete.taylor_hood import TaylorHood
from papilla.fem.reduction.finger_model import image_of
from papilla.fem.reduction.gauges import curvature_functional, gauge_frame, strain_functional
from papilla.finger import Finger
from papilla.mesh.surfaces import Surface


def gauge_values(
    finger: Finger, interface: Surface, space: TaylorHood, mirrors: tuple[str, ...], displacement: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Strain (g,) and curvature change (g,) in 1/mm at a displacement (nodes of the cell, 3) that mirrors repeat.

    Strain is (l - L)/L of the chord between the displaced ends of the grid. Raises `InputError` for a gauge off the
    mesh.
    """
    strain, curvature = [], []
    for gauge in finger.gauges:
        frame = gauge_frame(finger, gauge, interface)
        ends = strain_functional(gauge, frame, interface).points
        moved = values_at(space, mirrors, displacement, ends)
        strain.append(elongation(ends[1] - ends[0], moved[1] - moved[0]))
        fit = curvature_functional(gauge, frame, interface)
        curvature.append(float((fit.weights * values_at(space, mirrors, displacement, fit.points)).sum()))
    return np.array(strain), np.array(curvature)


def values_at(space: TaylorHood, mirrors: tuple[str, ...], displacement: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Displacement (k, 3) at points (k, 3) of the whole finger, from that (nodes, 3) of a mirror-symmetric cell."""
    images = image_of(points, mirrors)
    folded = points * np.column_stack([images, np.ones(len(points), dtype=int)])
    signs = np.stack([parity_signs(SYMMETRIC, (int(x), int(y))) for x, y in images])
    return signs * (interpolation(space, folded) @ displacement)


def elongation(chord: np.ndarray, change: np.ndarray) -> float:
    """(l - L)/L of a chord (3,) whose ends move apart by `change` (3,), without cancellation for small changes."""
    length = float(np.linalg.norm(chord))
    longer = float(np.linalg.norm(chord + change))
    return float(2 * chord @ change + change @ change) / (length * (longer + length))
