"""Moves points of one dome or slab into another: a user's finger gets a shipped mesh, not a new draw of the mesher.

Skin, interface and bone of a dome are nested ellipsoids about the origin with semi-axes a_0 > a_1 > a_2. Any point p
between two of them lies on exactly one ellipsoid of the family between,

    a(t) = (1 - t) a_k + t a_k+1,    sum_i (p_i / a_i(t))^2 = 1,

and its image has the same t and the same p_i / a_i(t) in the family of the target: p_i a'_i(t) / a_i(t). Inside the
bone the axes are scaled. Surfaces go to surfaces and planes through the origin into themselves; the map is continuous
and never folds, because both families are nested. A slab has the same map in its section, and its depth is scaled.
There is no system of equations and nothing random: a design has one mesh, the same on every machine up to rounding.

Example: an outer semi-axis a_0 = 20 and an interface a_1 = 17 along z; a point on the z axis at z = 18.5 has t = 0.5.
In a target with a'_0 = 30 and a'_1 = 20 it moves to z = 25.

Straight edges stay straight. If a thick layer becomes a thin curved one, a cell may therefore become flat or inverted:
the caller checks the quality.
"""

import numpy as np

from papilla.mesh.body import NAMES, Body
from papilla.mesh.surfaces import Ellipsoid, EllipticCylinder

HALVINGS = 60  # Number of bisections of t in [0, 1]: beyond double precision


def morphed(points: np.ndarray, origin: Body, target: Body) -> np.ndarray:
    """Points (n, 3) of the body `origin` mapped into the body `target`, in mm. Both are domes, or both are slabs."""
    start, end = _half_lengths(origin), _half_lengths(target)
    if np.array_equal(start, end):
        return points
    moved = points * (end[2] / start[2])
    for k in (1, 0):
        between = _level(points, start[k + 1], origin) > 1
        t = _share(points[between], start[k], start[k + 1], origin)[:, None]
        axes, images = ((1 - t) * half[k] + t * half[k + 1] for half in (start, end))
        moved[between] = points[between] * (images / axes)
    return moved


def _share(points: np.ndarray, around: np.ndarray, inside: np.ndarray, body: Body) -> np.ndarray:
    """t (n,) of points (n, 3) between two surfaces with half lengths (3,): 0 on the surface `around`."""
    low, high = np.zeros(len(points)), np.ones(len(points))
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        outside = _level(points, (1 - middle)[:, None] * around + middle[:, None] * inside, body) > 1
        low, high = np.where(outside, low, middle), np.where(outside, middle, high)
    return (low + high) / 2


def _level(points: np.ndarray, half: np.ndarray, body: Body) -> np.ndarray:
    """sum_i (p_i / a_i)^2 (n,) over the axes along which the surfaces of `body` are curved."""
    curved = [0, 2] if isinstance(body.surfaces["skin"], EllipticCylinder) else [0, 1, 2]
    return ((points / half)[:, curved] ** 2).sum(axis=1)


def _half_lengths(body: Body) -> list[np.ndarray]:
    """Half lengths (3,) of each surface along the axes in mm, from the outside in."""
    halves = []
    for surface in (body.surfaces[name] for name in NAMES):
        assert isinstance(surface, Ellipsoid)
        depth = surface.depth / 2 if isinstance(surface, EllipticCylinder) else np.inf
        halves.append(np.where(np.isfinite(surface.semi_axes), surface.semi_axes, depth))
    return halves
