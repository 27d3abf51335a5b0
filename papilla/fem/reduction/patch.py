"""The contact patch: the part of the skin around the touch-down point that contact may reach, and integrals over it.

Pressure is continuous and linear on the patch's triangles, acts along the specimen's normal, and is measured per area
of the contact plane. The gap is that of the exact surface, not of its facets, because at 5 gf the sagitta of a 1 mm
facet is 2.5 % of the indentation.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
import scipy.sparse as sp

from papilla.core.errors import InputError
from papilla.mesh.surfaces import Surface
from papilla.model.specimen import Specimen

SKIN_NEWTON_STEPS = 3
"""Number of steps from a facet of the mesh to the exact skin; each one squares the relative error."""

TRIANGLE_POINTS = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
"""Barycentric points of the three-point rule of degree 2, weights 1/3."""


@dataclass(frozen=True, eq=False)
class Frame:
    """The contact plane: touch-down point (3,) and unit axes (3, 3) in rows, the last the skin's outward normal."""

    origin: np.ndarray
    axes: np.ndarray

    @classmethod
    def at(cls, skin: Surface, x: float, y: float) -> "Frame":
        """The tangent plane of the skin above (x, y) mm; raises `InputError` if there is no skin."""
        z = float(skin.height(np.array([[x, y]]))[0])
        if not np.isfinite(z):
            raise InputError(f"no skin to touch at x {x:g}, y {y:g} mm")
        origin = np.array([x, y, z])
        normal = skin.normal(origin[None])[0]
        across = np.array([normal[2], 0.0, -normal[0]])
        across /= np.linalg.norm(across)
        return cls(origin, np.stack([across, np.cross(normal, across), normal]))

    def local(self, points: np.ndarray) -> np.ndarray:
        """Coordinates (..., 3) of points (..., 3) in the contact plane's axes."""
        return (points - self.origin) @ self.axes.T


@dataclass(frozen=True, eq=False)
class Patch:
    """Pressure nodes and weak integrals of a contact patch; n nodes, t triangles, mm.

    xy : (n, 2) node positions in the contact plane.
    triangles : (t, 3) node numbers.
    mass : (n,) integral of each node's hat function over the contact plane (mm2).
    gap : (n,) integral of hat function times distance of the exact skin from the tangent plane (mm3).
    rim : (n,) True if contact at the node would leave the patch, although the skin continues there.
    images : (k, 2) signs of the mirror images of the patch in the contact plane; [[1, 1]] if it is the whole patch.
    """

    xy: np.ndarray
    triangles: np.ndarray
    mass: np.ndarray
    gap: np.ndarray
    rim: np.ndarray
    images: np.ndarray

    @cached_property
    def node_gap(self) -> np.ndarray:
        """Mean gap (n,) around each node, in mm."""
        return self.gap / self.mass

    @cached_property
    def edge_length(self) -> np.ndarray:
        """Mean length (n,) of the triangle edges at each node, in mm."""
        total, count = np.zeros(len(self.xy)), np.zeros(len(self.xy))
        for a, b in ((0, 1), (1, 2), (2, 0)):
            ends = self.triangles[:, [a, b]]
            length = np.linalg.norm(self.xy[ends[:, 0]] - self.xy[ends[:, 1]], axis=1)
            for end in ends.T:
                np.add.at(total, end, length)
                np.add.at(count, end, 1)
        return total / count

    @cached_property
    def finest_edge(self) -> float:
        """Mean length (mm) of the triangle edges around the node that is touched first.

        The edges of that node alone may be unusual, so those of its neighbours count, too. On a flat skin it is the
        middle node.
        """
        # By the gap, and among equal gaps by the distance from the middle
        first = np.lexsort((np.hypot(*self.xy.T), self.node_gap))[0]
        touching = self.triangles[(self.triangles == first).any(axis=1)]
        return self.mean_edge(np.isin(np.arange(len(self.xy)), touching))

    @cached_property
    def gradient(self) -> tuple[sp.csr_matrix, sp.csr_matrix]:
        """Two (n, n): derivatives along x and y, at the nodes, of a field that is linear on the triangles.

        They are the mean over the triangles at a node, by area; across a mirror plane they are zero, as for a field
        that is even there.
        """
        a, b, c = self.xy[self.triangles].swapaxes(0, 1)
        # Per unit of the field at a corner, the gradient is its opposite edge, turned, over twice the area
        opposite = np.stack([c - b, a - c, b - a], axis=1)
        double_area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
        turned = np.sign(double_area)[:, None, None] * opposite[:, :, ::-1] * [-1, 1]
        around = np.bincount(self.triangles.ravel(), np.repeat(np.abs(double_area), 3), len(self.xy))
        even = (self.xy == 0) & (self.images < 0).any(axis=0)
        rows, columns = np.repeat(self.triangles, 3, axis=1).ravel(), np.tile(self.triangles, 3).ravel()
        along_x, along_y = (
            sp.csr_matrix((np.tile(turned[..., axis], 3).ravel() * (~even[:, axis] / around)[rows], (rows, columns)))
            for axis in (0, 1)
        )
        return along_x, along_y

    @cached_property
    def copies(self) -> np.ndarray:
        """Number of nodes of the whole patch that each node (n,) represents: the number of its images, fewer on a
        mirror plane."""
        on_plane = (self.xy == 0) & (self.images < 0).any(axis=0)
        return np.asarray(len(self.images) / 2.0 ** on_plane.sum(axis=1))

    def mean_edge(self, nodes: np.ndarray) -> float:
        """Mean length (mm) of the triangle edges at nodes (mask (n,)) and at their images."""
        copies = self.copies[nodes]
        return float(copies @ self.edge_length[nodes] / copies.sum())

    @cached_property
    def outline(self) -> np.ndarray:
        """Whether each node (n,) lies on the outline of the whole patch; cuts in mirror planes are not part of it."""
        edges = np.concatenate([self.triangles[:, [0, 1]], self.triangles[:, [1, 2]], self.triangles[:, [2, 0]]])
        # An edge of one triangle alone is on the rim of the triangles, or in a mirror plane that cuts the patch.
        edges, count = np.unique(np.sort(edges), axis=0, return_counts=True)
        on_plane = (self.xy == 0) & (self.images < 0).any(axis=0)
        cut = on_plane[edges].all(axis=1).any(axis=1)
        return np.isin(np.arange(len(self.xy)), edges[(count == 1) & ~cut])


def gap_of(skin: Surface, frame: Frame, points: np.ndarray) -> np.ndarray:
    """Distance (k,) of the exact skin from the contact plane, along the plane's normal through points (k, 3)."""
    normal = frame.axes[2]
    # From a facet of the mesh, which is close to the skin, three steps reach rounding.
    return -(onto(skin, points, normal, SKIN_NEWTON_STEPS) - frame.origin) @ normal


def onto(surface: Surface, points: np.ndarray, direction: np.ndarray, most_steps: int = 8) -> np.ndarray:
    """The points (k, 3) moved along `direction` until they lie on the surface, by Newton's method: the surface near a
    point is replaced by the tangent plane at its foot."""
    for _ in range(most_steps):
        foot = surface.project(points)
        normal = surface.normal(foot)
        step = np.einsum("ki,ki->k", foot - points, normal) / (normal @ direction)
        points = points + step[:, None] * direction
        if np.abs(step).max() < 1e-12:
            break
    return points


@lru_cache(maxsize=64)
def weak_gap(patch: Patch, specimen: Specimen) -> np.ndarray:
    """Weak gap (n,), in mm3, between the undeformed skin and a specimen that touches it."""
    points, weights, hats = quadrature(patch)
    height = specimen.gap(points)
    # A quarter stands for the whole only if the specimen has the same mirror planes.
    for image in patch.images[1:]:
        if not np.allclose(specimen.gap(points * image), height, rtol=1e-9, atol=1e-12):
            raise InputError(
                f"a {specimen.words} that is not symmetric about x and y does not fit a finger reduced at its apex, "
                "which is: reduce the finger a little beside it, at (1e-6, 1e-6)"
            )
    return patch.gap + hats.T @ (weights * height)


@lru_cache(maxsize=8)
def quadrature(patch: Patch, subdivisions: int = 1) -> tuple[np.ndarray, np.ndarray, sp.csr_matrix]:
    """Gauss points (q, 2), weights (q,) in mm2, and hat functions there (q, n); q = 3 t subdivisions^2.

    Each triangle is cut into subdivisions^2 equal parts, and each part has the three points of `TRIANGLE_POINTS`.
    """
    parts = []
    for i in range(subdivisions):
        for j in range(subdivisions - i):
            corner = np.array([i, j, subdivisions - i - j - 1]) / subdivisions
            parts.append(corner + TRIANGLE_POINTS / subdivisions)
            if i + j < subdivisions - 1:  # The triangle that stands on its head next to it
                parts.append(corner + (1 - TRIANGLE_POINTS - np.array([0, 0, 1])) / subdivisions)
    rule = np.concatenate(parts)
    corners = patch.xy[patch.triangles]
    edge_a, edge_b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(edge_a[:, 0] * edge_b[:, 1] - edge_a[:, 1] * edge_b[:, 0]) / 2
    points = np.einsum("ql,tlk->tqk", rule, corners).reshape(-1, 2)
    rows = np.repeat(np.arange(len(points)), 3)
    columns = np.repeat(patch.triangles[:, None, :], len(rule), axis=1).ravel()
    values = np.tile(rule, (len(corners), 1, 1)).ravel()
    hats = sp.csr_matrix((values, (rows, columns)), shape=(len(points), len(patch.xy)))
    return points, np.repeat(area / len(rule), len(rule)), hats
