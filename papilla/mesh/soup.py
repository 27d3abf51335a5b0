"""Closed triangulations for the mesher: a quarter of each nested body of a `Dome` or a `Slab`.

A quarter is the part at x >= 0, y >= 0, closed by the mirror planes and the base plane, so that the whole mesh can be
its exact mirror image.
"""

import numpy as np

from papilla.mesh.surfaces import Ellipsoid, EllipticCylinder

SCATTER = 0.3  # Largest displacement of an edge's ends by `scattered`, as a share of the edge, along each axis

Triangulation = tuple[np.ndarray, np.ndarray]
"""Vertices (n, 3) in mm and triangles (m, 3)."""


def quarter_ellipsoid(surface: Ellipsoid, divisions: int) -> Triangulation:
    """The octant x, y, z >= 0 of an ellipsoid, its curved face cut into `divisions` squared triangles."""
    x, y, z, origin = np.vstack([np.eye(3), np.zeros(3)])
    patches = [_patch(x, y, z, divisions, _onto_sphere)]
    patches += [_patch(a, b, origin, divisions, _onto_disc) for a, b in ((y, x), (z, y), (x, z))]
    vertices, triangles = merge(patches)
    return vertices * surface.axes, triangles


def quarter_cylinder(surface: EllipticCylinder, divisions: int) -> Triangulation:
    """The part x, y, z >= 0 of an elliptic cylinder, with `divisions` edges along the arc and equally long ones along
    y."""
    a, c = surface.axes
    end = surface.depth / 2
    layers = max(1, round(divisions * end / (np.pi / 2 * max(a, c))))
    x, _, z, origin = np.vstack([np.eye(3), np.zeros(3)])
    section, faces = _patch(x, z, origin, divisions, _onto_disc)
    section = section * [a, 1, c]
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    wall = _wall(section[edges[first[count == 1]]], end, layers)
    return merge([(section, faces), (section + [0, end, 0], faces[:, ::-1]), wall])


def scattered(
    vertices: np.ndarray, triangles: np.ndarray, surface: Ellipsoid, random: np.random.Generator
) -> np.ndarray:
    """The vertices (n, 3) moved by up to `SCATTER` of their shortest edge, within their flat or curved faces: another
    triangulation of the same body."""
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    shortest = np.full(len(vertices), np.inf)
    np.minimum.at(shortest, edges, np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)[:, None])
    moved = vertices + SCATTER * shortest[:, None] * random.uniform(-1, 1, vertices.shape)
    on_plane = (vertices == 0) | ((vertices == vertices.max(axis=0)) & ~np.isfinite(surface.semi_axes))
    moved = np.where(on_plane, vertices, moved)
    curved = np.abs(surface.level(vertices)) < 1e-9
    moved[curved] = surface.project(moved[curved])
    return moved


def merge(parts: list[Triangulation]) -> Triangulation:
    """One triangulation of several, vertices closer than 1e-9 mm joined."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    vertices = np.vstack([vertices for vertices, _ in parts])
    triangles = np.vstack([faces + offset for (_, faces), offset in zip(parts, offsets, strict=False)])
    _, first, number = np.unique(np.round(vertices, 9), axis=0, return_index=True, return_inverse=True)
    return vertices[first], number.ravel()[triangles]


def _patch(a, b, c, divisions, mapping) -> Triangulation:
    """The triangle a, b, c cut into `divisions` squared triangles, its points (i steps to b, j to c) then mapped."""
    pairs = [(i, j) for i in range(divisions + 1) for j in range(divisions + 1 - i)]
    number = {pair: place for place, pair in enumerate(pairs)}
    points = np.array([(a * (divisions - i - j) + b * i + c * j) / divisions for i, j in number])
    triangles = []
    for i, j in number:
        if i + j < divisions:
            triangles.append((number[i, j], number[i + 1, j], number[i, j + 1]))
        if i + j < divisions - 1:
            triangles.append((number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]))
    return mapping(points), np.array(triangles)


def _onto_sphere(points: np.ndarray) -> np.ndarray:
    return points / np.linalg.norm(points, axis=1)[:, None]


def _onto_disc(points: np.ndarray) -> np.ndarray:
    """Octahedral radius |x| + |y| + |z| replaced by the Euclidean one: straight rims become arcs."""
    radius = np.linalg.norm(points, axis=1)
    return points * np.divide(np.abs(points).sum(axis=1), radius, out=np.zeros(len(points)), where=radius > 0)[:, None]


def _wall(rim: np.ndarray, end: float, layers: int) -> Triangulation:
    """The band swept by directed edges (k, 2, 3) along y from 0 to `end`."""
    swept = rim + np.array([0, 1, 0]) * np.linspace(0, end, layers + 1)[:, None, None, None]
    corners = np.concatenate([swept[:-1], swept[1:]], axis=2).reshape(-1, 3)
    number = np.arange(len(corners)).reshape(-1, 4)
    return corners, number[:, [[0, 2, 1], [1, 2, 3]]].reshape(-1, 3)
