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

GAUSS = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
"""Barycentric points of the three-point rule of degree 2, weights 1/3."""


def half_space_compliance(patch: Patch) -> np.ndarray:
    """Matrix (n, n), in mm3, that times pressure / E* is the weak displacement of a half-space."""
    points, weights, hats = quadrature(patch)
    near_pairs = _near_potential(patch, points)
    potential = _smooth_potential(patch, points, weights, hats, _inverse_distance) + near_pairs
    compliance = hats.T @ (weights[:, None] * potential) / np.pi
    return (compliance + compliance.T) / 2


@lru_cache(maxsize=8)
def kernel_compliance(patch: Patch, kernel: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Matrix (n, n), in mm4 times the kernel's unit, of a smooth kernel of distance (mm)."""
    points, weights, hats = quadrature(patch)
    compliance = hats.T @ (weights[:, None] * _smooth_potential(patch, points, weights, hats, kernel))
    return (compliance + compliance.T) / 2


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


def _inverse_distance(r: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore"):
        return np.where(r > 0, 1 / r, 0.0)


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


def _smooth_potential(patch, points, weights, hats, kernel) -> np.ndarray:
    """Potential (3t, n) of each hat function and its images, by quadrature."""
    loaded = (hats.multiply(weights[:, None])).tocsr()
    total = np.zeros(hats.shape)
    for image in patch.images:
        source = points * image
        distance = np.hypot(points[:, None, 0] - source[None, :, 0], points[:, None, 1] - source[None, :, 1])
        total += (loaded.T @ kernel(distance).T).T
    return total


def _near_potential(patch: Patch, points: np.ndarray) -> np.ndarray:
    """What exact integration changes in the potentials (3t, n) of near triangles."""
    corners = patch.xy[patch.triangles]
    centres = corners.mean(axis=1)
    size = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean(axis=1)
    correction = np.zeros((len(points), len(patch.xy)))
    for image in patch.images:
        flipped = corners * image
        tree = cKDTree(points)
        near = tree.query_ball_point(centres * image, NEAR * size)
        triangle = np.repeat(np.arange(len(centres)), [len(found) for found in near])
        point = np.concatenate([np.array(found, dtype=int) for found in near])
        exact = linear_potentials(points[point], flipped[triangle])
        nodes = patch.triangles[triangle]
        quadrature = _gauss_potentials(points[point], flipped[triangle])
        np.add.at(correction, (point[:, None], nodes), exact - quadrature)
    return correction


def _gauss_potentials(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(k, 3) potentials 1/r of the hat functions of k triangles at k points, by the three-point rule."""
    source = np.einsum("ql,klj->kqj", GAUSS, corners)
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    inverse = _inverse_distance(np.linalg.norm(source - points[:, None], axis=2))
    return area[:, None] / 3 * inverse @ GAUSS


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
