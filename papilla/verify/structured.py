"""Structured meshes of the study: sheets of triangles stacked to prisms, each prism cut into three tetrahedra.

Nothing here comes from the mesher, so every figure of the study is reproducible to the digit.
"""

import numpy as np

from papilla.core import checks
from papilla.mesh.cells import paired_faces, volumes
from papilla.mesh.layered import INNER_LAYER, OUTER_LAYER, LayeredMesh, mirrored


def cylinder(radii: np.ndarray, depths: np.ndarray, interface: int, divisions: int) -> LayeredMesh:
    """A mirrored cylinder below z = 0, meshed in rings of `radii` (mm, from 0 up) and at `depths` (mm, from 0 down).

    The skin is its top; bottom and side are clamped. Cells above depth number `interface` are `OUTER`, others `INNER`;
    a ring far enough out has `divisions` chords a quarter.
    """
    xy, triangles = _quarter_disc(np.asarray(radii, dtype=float), divisions)
    sheets = [np.column_stack([xy, np.full(len(xy), -depth)]) for depth in depths[::-1]]
    points, tets, sheet = _stack(sheets, triangles)
    layer = np.where(sheet >= len(depths) - 1 - interface, OUTER_LAYER, INNER_LAYER)
    rim = np.hypot(*points[:, :2].T) > radii[-1] * (1 - checks.ROUNDING_SHARE)
    clamped = [points[:, 2] == -depths[-1], rim]
    return mirrored(_layered(points, tets, layer, [points[:, 2] == 0], clamped), ("x", "y"))


def shell(radii: np.ndarray, divisions: int) -> LayeredMesh:
    """The positive octant of a ball's shell in spheres of `radii` (mm); skin is the outermost, base the innermost."""
    directions, triangles = _octant(divisions)
    points, tets, _ = _stack([radius * directions for radius in radii], triangles)
    distance = np.linalg.norm(points, axis=1)
    outside, inside = (
        distance > radii[-1] * (1 - checks.ROUNDING_SHARE),
        distance < radii[0] * (1 + checks.ROUNDING_SHARE),
    )
    return _layered(points, tets, np.full(len(tets), OUTER_LAYER), [outside], [inside])


def cube(divisions: int, jitter: float = 0.0, split: bool = False) -> LayeredMesh:
    """The unit cube: skin above, base below, every vertex inside moved by up to `jitter` element sizes.

    With `split` the half below z = 1/2 is `INNER`, and vertices on that plane stay.
    """
    line = np.linspace(0, 1, divisions + 1)
    x, y = (grid.ravel() for grid in np.meshgrid(line, line, indexing="ij"))
    number = np.arange(len(x)).reshape(divisions + 1, divisions + 1)
    a, b, c, d = (corners.ravel() for corners in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    points, tets, sheet = _stack([np.column_stack([x, y, np.full(len(x), z)]) for z in line], triangles)
    inside = ((points > 0) & (points < 1)).all(axis=1)
    if split:
        inside &= points[:, 2] != line[divisions // 2]
    points[inside] += jitter / divisions * np.random.default_rng(7).uniform(-1, 1, (inside.sum(), 3))
    layer = np.where(split & (sheet < divisions // 2), INNER_LAYER, OUTER_LAYER)
    return _layered(points, _oriented(points, tets), layer, [points[:, 2] == 1], [points[:, 2] == 0])


def growing(first: float, ratio: float, end: float) -> np.ndarray:
    """Lengths from 0 to `end` whose steps start at about `first` and grow by `ratio`."""
    steps = first * ratio ** np.arange(int(np.ceil(np.log1p((ratio - 1) * end / first) / np.log(ratio))))
    places = np.append(0, np.cumsum(steps))
    return places * (end / places[-1])


def _layered(points, tets, layer, skins, bases) -> LayeredMesh:
    """A mesh whose skin and base are the outer triangles with all vertices in one of the masks (vertices,)."""
    faces, cells = paired_faces(tets)
    outside, between = cells[:, 1] < 0, faces[(cells[:, 1] >= 0) & (layer[cells[:, 0]] != layer[cells[:, 1]])]
    rim = faces[outside]
    skin, base = (np.any([mask[rim].all(axis=1) for mask in masks], axis=0) for masks in (skins, bases))
    boundaries = {"skin": rim[skin], "base": rim[base & ~skin], "interface": between}
    return LayeredMesh(points, tets, layer, boundaries, 1.0)


def _stack(sheets, triangles) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points, tetrahedra between neighbouring sheets, and for each the number of the sheet that it stands on.

    A prism's faces are cut from the vertex of lowest number, so that neighbours agree.
    """
    count = len(sheets[0])
    below = np.sort(triangles, axis=1)
    a, b = below.T, below.T + count
    prism = np.concatenate(
        [
            np.stack(corners, axis=1)
            for corners in ((a[0], a[1], a[2], b[2]), (a[0], a[1], b[1], b[2]), (a[0], b[0], b[1], b[2]))
        ]
    )
    tets = np.concatenate([prism + k * count for k in range(len(sheets) - 1)])
    points = np.concatenate(sheets)
    return points, _oriented(points, tets), np.repeat(np.arange(len(sheets) - 1), len(prism))


def _oriented(points, tets) -> np.ndarray:
    return np.where((volumes(points, tets) < 0)[:, None], tets[:, [0, 2, 1, 3]], tets)


def _quarter_disc(radii, divisions) -> tuple[np.ndarray, np.ndarray]:
    """Nodes on quarter circles, ring k with min(k, divisions) chords, and their triangles; exact zeros on the axes."""
    chords = np.minimum(np.arange(len(radii)), divisions)
    start = np.append(0, np.cumsum(chords + 1))
    nodes = []
    for radius, count in zip(radii, chords, strict=True):
        angle = np.linspace(0, np.pi / 2, count + 1)
        ring = radius * np.column_stack([np.cos(angle), np.sin(angle)])
        ring[-1, 0] = ring[0, 1] = 0.0
        nodes.append(ring)
    triangles = []
    for k in range(1, len(radii)):
        inner, outer = start[k - 1], start[k]
        for j in range(chords[k]):
            triangles.append((outer + j, outer + j + 1, inner + min(j, chords[k - 1])))
            if j < chords[k - 1]:
                triangles.append((inner + j, outer + j + 1, inner + j + 1))
    return np.concatenate(nodes), np.array(triangles)


def _octant(n) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors of the positive octant on a triangular grid, spread evenly, and its triangles."""
    corners = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)])
    number = {(int(i), int(j)): k for k, (i, j, _) in enumerate(corners)}
    up = [(number[i, j], number[i + 1, j], number[i, j + 1]) for i in range(n) for j in range(n - i)]
    down = [(number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]) for i in range(n) for j in range(n - 1 - i)]
    spread = np.sin(corners * np.pi / (2 * n))
    return spread / np.linalg.norm(spread, axis=1)[:, None], np.array(up + down)
