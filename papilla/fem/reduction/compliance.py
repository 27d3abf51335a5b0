"""Compliance of the specimen on the patch: weak surface displacement under piecewise linear pressure.

The half-space kernel 1/(pi E* r) is singular: pairs of near triangles are integrated exactly inside (the potential of a
linear density on a triangle, Wilton et al. 1984, doi:10.1109/TAP.1984.1143304) and by Gauss outside; far pairs
by Gauss on both. A bonded block adds a smooth kernel.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from papilla.fem.reduction.patch import Patch
from papilla.specimen import Specimen

NEAR = 3.0
"""Pairs closer than this many mean edge lengths are integrated exactly."""

ROWS = 256
"""Quadrature points evaluated against all others at a time: bounds the memory of large patches."""

Kernel = Callable[..., np.ndarray]

GAUSS = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
"""Barycentric points of the three-point rule of degree 2, weights 1/3."""


def half_space_compliance(patch: Patch) -> np.ndarray:
    """Matrix (n, n), in mm3, that times pressure / E* is the weak displacement of a half-space."""

    def exact(points, corners):
        return linear_potentials(points, corners)[..., None]

    return symmetric(weak_terms(patch, _inverse_distance, exact)(0, 0) / np.pi)


@lru_cache(maxsize=8)
def kernel_compliance(patch: Patch, kernel: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Matrix (n, n), in mm4 times the kernel's unit, of a smooth kernel of distance (mm)."""
    return symmetric(weak_terms(patch, lambda offset: kernel(np.hypot(*np.moveaxis(offset, -1, 0)))[None], None)(0, 0))


@dataclass(frozen=True, eq=False)
class PatchSurface:
    """What a specimen makes its compliance on a patch of (`papilla.specimen.Surface`); n patch nodes.

    half_space : (n, n) of `half_space_compliance`.
    """

    patch: Patch
    half_space: np.ndarray

    def kernel(self, kernel: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Weak compliance (n, n) of a smooth kernel: mm per N at a distance in mm."""
        return kernel_compliance(self.patch, kernel)


@lru_cache(maxsize=64)
def weak_gap(patch: Patch, specimen: Specimen) -> np.ndarray:
    """Weak gap (n,), in mm3, between the undeformed skin and a specimen that touches it."""
    points, weights, hats = quadrature(patch)
    return patch.gap + hats.T @ (weights * specimen.gap(points))


def _inverse_distance(offset: np.ndarray) -> np.ndarray:
    r = np.hypot(offset[..., 0], offset[..., 1])
    return np.divide(1.0, r, out=np.zeros_like(r), where=r > 0)[None]


@lru_cache(maxsize=8)
def quadrature(patch: Patch, subdivisions: int = 1) -> tuple[np.ndarray, np.ndarray, sp.csr_matrix]:
    """Gauss points (q, 2), weights (q,) in mm2, and hat functions there (q, n); q = 3 t subdivisions^2."""
    rule = _subdivided_rule(subdivisions)
    corners = patch.xy[patch.triangles]
    edge_a, edge_b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(edge_a[:, 0] * edge_b[:, 1] - edge_a[:, 1] * edge_b[:, 0]) / 2
    points = np.einsum("ql,tlk->tqk", rule, corners).reshape(-1, 2)
    rows = np.repeat(np.arange(len(points)), 3)
    columns = np.repeat(patch.triangles[:, None, :], len(rule), axis=1).ravel()
    values = np.tile(rule, (len(corners), 1, 1)).ravel()
    hats = sp.csr_matrix((values, (rows, columns)), shape=(len(points), len(patch.xy)))
    return points, np.repeat(area / len(rule), len(rule)), hats


def _subdivided_rule(n: int) -> np.ndarray:
    """Barycentric points (3 n^2, 3) of the three-point rule on each of n^2 equal parts of a triangle."""
    parts = []
    for i in range(n):
        for j in range(n - i):
            corner = np.array([i, j, n - i - j - 1]) / n
            parts.append(corner + GAUSS / n)
            if i + j < n - 1:
                parts.append(corner + (1 - GAUSS - np.array([0, 0, 1])) / n)
    return np.concatenate(parts)


def symmetric(matrix: np.ndarray) -> np.ndarray:
    """The symmetric part of a matrix (n, n), not to be written to: it is kept."""
    matrix = (matrix + matrix.T) / 2
    matrix.flags.writeable = False
    return matrix


def weak_terms(patch: Patch, kernel: Kernel, exact: Kernel | None) -> Callable[[int, int], np.ndarray]:
    """terms(k, c) -> (n, n): double integral of the kernel's term k between hat functions, for sources of component c.

    `kernel` maps offsets (..., 2) from source to point onto (terms, ...); `exact`, where the kernel is singular, gives
    the integrals (pairs, 3, terms) of the terms times a near triangle's hat functions.
    """
    points, weights, hats = quadrature(patch)
    loaded = hats.multiply(weights[:, None]).tocsr()
    per_image = []
    for image in patch.images:
        source, total = points * image, np.zeros(())
        for first in range(0, len(points), ROWS):
            rows = slice(first, first + ROWS)
            values = kernel(points[rows, None] - source[None])
            potentials = np.stack([(loaded.T @ value.T).T for value in values])
            total = total + np.stack([loaded[rows].T @ potential for potential in potentials])
        if exact is not None:
            total = total + _near(patch, points, loaded, image, kernel, exact)
        per_image.append(total)
    signs = np.column_stack([np.ones(len(patch.images)), patch.images])

    def terms(k: int, c: int) -> np.ndarray:
        return np.einsum("i,iab->ab", signs[:, c], np.stack([total[k] for total in per_image]))

    return terms


def _near(patch, points, loaded, image, kernel, exact) -> np.ndarray:
    """What exact integration over near triangles changes: (terms, n, n)."""
    corners = patch.xy[patch.triangles]
    size = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean(axis=1)
    flipped = corners * image
    near = cKDTree(points).query_ball_point(flipped.mean(axis=1), NEAR * size)
    triangle = np.repeat(np.arange(len(corners)), [len(found) for found in near])
    point = np.concatenate([np.array(found, dtype=int) for found in near])
    change = exact(points[point], flipped[triangle]) - _gauss(points[point], flipped[triangle], kernel)
    n, nodes = len(patch.xy), patch.triangles[triangle]
    total = np.zeros((change.shape[2], len(points), n))
    for k, values in enumerate(total):
        np.add.at(values, (point[:, None], nodes), change[:, :, k])
    return np.stack([loaded.T @ values for values in total])


def _gauss(points, corners, kernel) -> np.ndarray:
    """(pairs, 3, terms) what the three-point rule makes of the kernel times hat functions."""
    source = np.einsum("ql,klj->kqj", GAUSS, corners)
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    return np.einsum("k,tkq,ql->klt", area / 3, kernel(points[:, None] - source), GAUSS)


def linear_potentials(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Integrals (k, 3) of each hat function over r, for k points (k, 2) in the plane of k triangles (k, 3, 2).

    Exact (Wilton et al. 1984, in-plane case): with edge distance d, edge coordinates s and R = |r| at the ends,
    int 1/r = sum d ln((R+ + s+)/(R- + s-)), int rho/r = sum n (d^2 ln(...) + s+ R+ - s- R-) / 2.
    """
    plain = np.zeros(len(points))
    moment = np.zeros((len(points), 2))
    middle = corners.mean(axis=1)
    for k in range(3):
        start, end = corners[:, k], corners[:, (k + 1) % 3]
        along = (end - start) / np.linalg.norm(end - start, axis=1)[:, None]
        out = np.stack([along[:, 1], -along[:, 0]], axis=1)
        out *= np.sign(np.einsum("kj,kj->k", start - middle, out))[:, None]
        d = np.einsum("kj,kj->k", start - points, out)
        s_end, s_start = (np.einsum("kj,kj->k", p - points, along) for p in (end, start))
        r_end, r_start = np.hypot(s_end, d), np.hypot(s_start, d)
        weighted = d * edge_logarithm(s_start, r_start, s_end, r_end, d)
        plain += weighted
        moment += out * ((d * weighted + s_end * r_end - s_start * r_start) / 2)[:, None]
    edges = np.stack([corners[:, 0] - corners[:, 2], corners[:, 1] - corners[:, 2]], axis=2)
    gradients = np.linalg.inv(edges)
    first_two = np.einsum("kij,kj->ki", gradients, points - corners[:, 2]) * plain[:, None]
    first_two += np.einsum("kij,kj->ki", gradients, moment)
    return np.column_stack([first_two, plain - first_two.sum(axis=1)])


def edge_logarithm(
    s_start: np.ndarray, r_start: np.ndarray, s_end: np.ndarray, r_end: np.ndarray, d: np.ndarray
) -> np.ndarray:
    """ln((R+ + s+)/(R- + s-)), taken from the side without cancellation; zero where the point is on the edge's line."""
    forward = s_start + s_end > 0
    upper = np.where(forward, r_end + s_end, r_start - s_start)
    lower = np.where(forward, r_start + s_start, r_end - s_end)
    safe = np.abs(d) > 1e-14 * (r_start + r_end)
    return np.log(np.where(safe, upper, 1.0) / np.where(safe, lower, 1.0))
