"""A new mesh from the mesher, for shapes that no shipped mesh can be mapped to: surfaces from files, unusual domes and
slabs, and the shipped meshes themselves.

TetWild gets closed triangulations of the nested bodies. Of a dome or a slab it meshes a quarter, the part at x >= 0 and
y >= 0, closed by the mirror planes and the base plane: so the whole mesh can be its exact mirror image. TetWild cannot
be seeded, so each call gives another mesh. Its cells get their layers by their centroids, its faces the surface or
plane on which they lie. A mesh with flat or inverted cells, or in several parts, is discarded and made again.
"""

from dataclasses import replace
from itertools import permutations

import numpy as np

from papilla.core.checks import SIZE_OPTION
from papilla.core.errors import MeshError
from papilla.core.progress import Progress, silent
from papilla.mesh.body import MeshGeometry
from papilla.mesh.cells import TaggedCells, between, compact, edges_of, paired_faces, positively_oriented
from papilla.mesh.child import tetrahedralise
from papilla.mesh.finishing import finished, snap
from papilla.mesh.layered import BONE_LAYER, INNER_LAYER, OUTER_LAYER, LayeredMesh
from papilla.mesh.sizing import Sizing, asked
from papilla.mesh.surfaces import Ellipsoid, EllipticCylinder, Surface, TriangleSurface, Triangulation
from papilla.model.finger import Finger

MOST_DRAWS = 5  # Largest number of meshes that are made for a finger
ENVELOPE_SHARE, ENVELOPE_SIZES = 1e-3, 0.05
"""How far the mesher may move a surface: a fraction of the bounding box's diagonal, or of the element size if more."""

FLAT_COSINE = 0.8
"""A boundary face near a plane lies on it if its normal is at most 37 degrees from the plane's."""

REACH_ENVELOPES = 3.0  # Flat faces are searched within this many envelopes of their plane

FACETS_PER_RADIUS, FACET_SIZES = 18, 1.1
"""Edges on curved faces have the length of the largest radius over the first number, or the element size times the
second, if that is longer."""

JOINING_DECIMALS = 9  # Vertices of parts of a triangulation are joined if they are equal to so many decimals (mm)
FEWEST_FACETS = 6  # Edges on a quarter of a curved face
SCATTER_EDGE_SHARE = (
    0.3  # Largest displacement of an edge's ends by `_scattered`, as a share of the edge, along each axis
)


def drawn(finger: Finger, size_mm: float, *, variant: int = 0, progress: Progress = silent) -> LayeredMesh:
    """A new mesh of a finger; arguments as of `papilla.mesh.build`, and raises as it does."""
    body, sizing = asked(finger, size_mm)
    keep_bone = finger.bone is not None
    for draw in range(1, MOST_DRAWS + 1):
        try:
            return finished(body, _draw(body, sizing, keep_bone, variant, progress), size_mm, keep_bone, progress)
        except MeshError as error:
            if draw == MOST_DRAWS:
                raise MeshError(f"{error} ({MOST_DRAWS} meshes were drawn)") from error
            progress(f"mesh {draw} of at most {MOST_DRAWS} cannot be used, drawing another: {error}")
    raise AssertionError("unreachable")


def _draw(body: MeshGeometry, sizing: Sizing, keep_bone: bool, variant: int, progress: Progress) -> TaggedCells:
    """One mesh from the mesher, with its cells sorted and its vertices moved onto the surfaces."""
    diagonal = float(np.linalg.norm(body.high - body.low))
    envelope = max(ENVELOPE_SHARE, ENVELOPE_SIZES * sizing.near_mm / diagonal)
    points, tets = tetrahedralise(_soup(body, sizing, envelope, variant), progress)
    cells = tag(body, points, positively_oriented(points, tets), keep_bone, REACH_ENVELOPES * envelope * diagonal)
    return replace(cells, points=snap(body, cells))


def tag(body: MeshGeometry, points: np.ndarray, tets: np.ndarray, keep_bone: bool, reach: float) -> TaggedCells:
    """Tag a raw mesh of `body`; the bone's cells are dropped unless `keep_bone`.

    Cells outside the body are dropped. `reach` (mm) is the largest distance by which the mesher may have moved a flat
    face. Raises `MeshError` if a layer has no cells or a boundary face lies on no surface or plane.
    """
    tets = tets[_inside(body, points[tets].mean(axis=1))]
    centroids = points[tets].mean(axis=1)
    layer = np.full(len(tets), OUTER_LAYER)
    layer[body.surfaces["interface"].level(centroids) < 0] = INNER_LAYER
    layer[body.surfaces["bone"].level(centroids) < 0] = BONE_LAYER
    parts = ((OUTER_LAYER, "outer layer"), (INNER_LAYER, "inner layer"), (BONE_LAYER, "bone"))
    missing = [name for number, name in parts if not np.any(layer == number)]
    if missing:
        raise MeshError(f"the {' and the '.join(missing)} got no tetrahedra: take a smaller size_mm ({SIZE_OPTION})")
    if not keep_bone:
        keep = layer != BONE_LAYER
        tets, layer = tets[keep], layer[keep]
    points, tets = compact(points, tets)
    return _sort_faces(body, points, tets, layer, reach)


def _inside(body: MeshGeometry, centroids: np.ndarray) -> np.ndarray:
    inside = body.surfaces["skin"].level(centroids) < 0
    for plane in body.planes:
        inside &= plane.outward * (centroids[:, plane.axis] - plane.value) < 0
    return inside


def _sort_faces(body, points, tets, layer, reach) -> TaggedCells:
    """Sort the outer faces onto planes, skin and bone, and find those between layers; raises `MeshError`."""
    faces, cells = paired_faces(tets)
    outside = cells[:, 1] < 0
    rim, rim_layer = faces[outside], layer[cells[outside, 0]]
    flat = [_on_plane(points, rim, plane, reach) for plane in body.planes]
    curved = ~np.any(flat, axis=0)
    centres = points[rim].mean(axis=1)
    on_bone = np.abs(body.surfaces["bone"].level(centres)) < np.abs(body.surfaces["skin"].level(centres))
    if np.any(curved & ~on_bone & (rim_layer != OUTER_LAYER)) or np.any(curved & on_bone & (rim_layer == OUTER_LAYER)):
        raise MeshError(f"a layer is open, its cells on the surface of another: take a smaller size_mm ({SIZE_OPTION})")
    shared = {
        pair: between(faces, cells, layer, *pair)
        for pair in ((INNER_LAYER, OUTER_LAYER), (BONE_LAYER, INNER_LAYER), (BONE_LAYER, OUTER_LAYER))
    }
    if len(shared[BONE_LAYER, OUTER_LAYER]):
        raise MeshError(f"the bone touches the outer layer: take a smaller size_mm ({SIZE_OPTION})")
    on_surface = {
        "skin": rim[curved & ~on_bone],
        "interface": shared[INNER_LAYER, OUTER_LAYER],
        "bone": np.vstack([rim[curved & on_bone], shared[BONE_LAYER, INNER_LAYER]]),
    }
    return TaggedCells(points, tets, layer, on_surface, tuple(rim[on] for on in flat))


def _on_plane(points, faces, plane, reach) -> np.ndarray:
    corners = points[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    cosine = np.abs(normal[:, plane.axis]) / np.linalg.norm(normal, axis=1)
    near = np.all(np.abs(corners[:, :, plane.axis] - plane.value) < reach, axis=1)
    return near & (cosine > FLAT_COSINE)


def _soup(body: MeshGeometry, sizing: Sizing, envelope: float, variant: int) -> dict[str, np.ndarray]:
    """The mesher's input; each variant has its own triangles and a shifted sizing grid."""
    vertices, triangles = _stacked(triangulations(body, sizing.near_mm, variant))
    shift = np.random.default_rng(variant).uniform(-0.5, 0.5, 3) if variant else np.zeros(3)
    grid_points, grid_tets = grid_over(body.low, body.high, sizing.grid_mm, shift)
    return {
        "vertices": vertices,
        "triangles": triangles,
        "far_mm": np.array(sizing.far_mm),
        "envelope": np.array(envelope),
        "grid_points": grid_points,
        "grid_tets": grid_tets,
        "grid_sizes": sizing(grid_points),
    }


def triangulations(body: MeshGeometry, size_mm: float, variant: int = 0) -> list[Triangulation]:
    """A closed triangulation of each nested body, with edges that fit elements of `size_mm`; surfaces from files keep
    their own.

    The points of a `variant` above 0 are shifted along the surfaces: each variant has other triangles.
    """
    random = np.random.default_rng(variant) if variant else None
    return [_triangulated(surface, body, size_mm, random) for surface in body.surfaces.values()]


def _triangulated(
    surface: Surface, body: MeshGeometry, size_mm: float, random: np.random.Generator | None
) -> Triangulation:
    if isinstance(surface, TriangleSurface):
        return surface.vertices, surface.triangles
    skin = body.surfaces["skin"]
    assert isinstance(surface, Ellipsoid) and isinstance(skin, Ellipsoid)
    edge = max(max(skin.axes) / FACETS_PER_RADIUS, FACET_SIZES * size_mm)
    divisions = max(FEWEST_FACETS, round(np.pi / 2 * max(surface.axes) / edge))
    if isinstance(surface, EllipticCylinder):
        vertices, triangles = quarter_cylinder(surface, divisions)
    else:
        vertices, triangles = quarter_ellipsoid(surface, divisions)
    return (vertices if random is None else _scattered(vertices, triangles, surface, random)), triangles


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
    edges = edges_of(faces).reshape(-1, 2)
    _, first, count = np.unique(np.sort(edges, axis=1), axis=0, return_index=True, return_counts=True)
    wall = _wall(section[edges[first[count == 1]]], end, layers)
    return merge([(section, faces), (section + [0, end, 0], faces[:, ::-1]), wall])


def _scattered(
    vertices: np.ndarray, triangles: np.ndarray, surface: Ellipsoid, random: np.random.Generator
) -> np.ndarray:
    """The vertices (n, 3) moved by up to `SCATTER_EDGE_SHARE` of their shortest edge, within their flat or curved
    faces: another triangulation of the same body."""
    edges = edges_of(triangles).reshape(-1, 2)
    shortest = np.full(len(vertices), np.inf)
    np.minimum.at(shortest, edges, np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)[:, None])
    moved = vertices + SCATTER_EDGE_SHARE * shortest[:, None] * random.uniform(-1, 1, vertices.shape)
    on_plane = (vertices == 0) | ((vertices == vertices.max(axis=0)) & ~np.isfinite(surface.semi_axes))
    moved = np.where(on_plane, vertices, moved)
    curved = np.abs(surface.level(vertices)) < 10.0**-JOINING_DECIMALS
    moved[curved] = surface.project(moved[curved])
    return moved


def merge(parts: list[Triangulation]) -> Triangulation:
    """One triangulation of several, vertices closer than 1e-9 mm joined."""
    vertices, triangles = _stacked(parts)
    _, first, number = np.unique(np.round(vertices, JOINING_DECIMALS), axis=0, return_index=True, return_inverse=True)
    return vertices[first], number.ravel()[triangles]


def _stacked(parts: list[Triangulation]) -> Triangulation:
    """The vertices and triangles of several triangulations one after another."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    triangles = [faces + offset for (_, faces), offset in zip(parts, offsets, strict=False)]
    return np.vstack([vertices for vertices, _ in parts]), np.vstack(triangles)


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


def grid_over(low: np.ndarray, high: np.ndarray, spacing: float, shift: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and tetrahedra (six a cube) of a regular grid that covers the box, displaced by `shift` (3,) spacings.

    `shift` lies in [-0.5, 0.5], because the grid extends one spacing beyond the box.
    """
    counts = np.ceil((high - low) / spacing).astype(int) + 3
    places = np.argwhere(np.ones(counts, dtype=bool))
    points = low + spacing * (places - 1 + shift)
    # Kuhn's six tetrahedra of a cube, along each axis in each order, so that neighbouring cubes match.
    first = np.flatnonzero(np.all(places < counts - 1, axis=1))
    steps = permutations((counts[1] * counts[2], counts[2], 1))
    tets = np.vstack([first[:, None] + np.cumsum([0, *order]) for order in steps])
    return points, positively_oriented(points, tets)
