"""`build`: from a finger to its layered mesh, a shipped one that is mapped or a new one from the mesher.

A shipped mesh needs no mesher, and is the same on every machine. A dome or a slab takes one of its kind
(`papilla/data/meshes`), mapped by `morphed`: of the shipped element sizes the coarsest whose cells at the
contact are small enough after the map. Cells that are still too large for the sizing field are halved (a gauge or the
contact lies elsewhere, or the finger is larger), then poor cells are relaxed. If the worst cell stays below
`WORST_MEAN_RATIO`, or the shape is another one, the mesher makes a mesh, which the cache keeps.

`python -m papilla.mesh.builder` makes the shipped files again: default results change with them.
"""

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from papilla.core import cache, checks
from papilla.core.errors import InputError
from papilla.core.files import replacing
from papilla.core.outside import read_arrays
from papilla.core.progress import Progress, silent
from papilla.mesh.body import SURFACE_NAMES, MeshGeometry, body_of
from papilla.mesh.cells import TaggedCells, between, edge_lengths, mean_ratio, paired_faces, volumes
from papilla.mesh.child import MESHER_VERSION
from papilla.mesh.drawing import drawn
from papilla.mesh.finishing import Constraints, finished, relax
from papilla.mesh.layered import BONE_LAYER, INNER_LAYER, LayeredMesh, pack, unpack
from papilla.mesh.refining import bisected
from papilla.mesh.scale import FingerScale
from papilla.mesh.sizing import Sizing, asked
from papilla.mesh.surfaces import Ellipsoid, EllipticCylinder
from papilla.model.finger import DEFAULT_FINGER, Dome, Finger, Layer, Slab

DEFAULT_SIZE_MM = 0.7
"""Element size at the contact to which the figures of the README refer, on the default finger."""


SHIPPED_VARIANTS = 5
"""Number of shipped meshes of each size: the first is the default, the spread of all is the mesh scatter."""

MESH_FOLDER = DEFAULT_FINGER.parent / "meshes"
SIZES_MM = {"dome": (2.8, 2.0, 1.4, 1.0, 0.7), "dome_bone": (2.8, 1.4, 0.7), "slab": (2.8, 1.4, 0.7)}
"""Element sizes of the shipped meshes, the coarsest first, for fingers 20 mm tall."""

WORST_MEAN_RATIO = 0.15  # Smallest mean ratio of a usable mesh
RELAXED_MEAN_RATIO, HOPELESS_SHARE = 0.2, 0.05
"""Mean ratio below which cells are relaxed, and the share of such cells above which the mesher makes a new mesh."""
ALMOST_WANTED_SIZE = 1.1
"""Size of cells at the contact (median, relative to the wanted size), compared with the reference, above which a finer
shipped mesh is taken: at 1.2, S_d of a finger of half size was 0.5 % low at 10 gf."""
TOO_LARGE = 1.5
"""Size relative to the wanted one, averaged with the neighbours, above which a cell is halved. The shipped meshes have
no larger cell."""
TOO_LARGE_EVERYWHERE = 1.2
"""The same if the finest shipped mesh is too coarse, so that all cells at the contact are halved: their final size is
0.95 to 1.2 of the wanted one, like that of new meshes."""
LONGEST_EDGE_SHARE = (
    0.55  # Share of the longest edge that counts as a cell's size; usual: up to 1.8 edges of a regular cell
)
MAP_BISECTIONS = 60  # Number of bisections of t in [0, 1] by which a point is mapped: beyond double precision
MESHES_IN_MEMORY = 16  # Number of shipped meshes that a process keeps in memory
NEAREST_CELLS = 100  # Number of cells closest to the apex, whose size is that at the contact


def default_size_mm(finger: Finger) -> float:
    """The element size at the contact by default: `DEFAULT_SIZE_MM` for the default finger, in proportion for others.

    Raises what `surfaces_of` raises.
    """
    return DEFAULT_SIZE_MM * FingerScale.of(finger).length


def build(
    finger: Finger, size_mm: float | None = None, *, variant: int = 0, progress: Progress = silent
) -> LayeredMesh:
    """The layered mesh of a finger.

    Parameters
    ----------
    finger : its shape decides the geometry; `Dome` and `Slab` give a mesh that is its own mirror image in x and y.
    size_mm : edge length at the contact; it grows away from the apex (`papilla.mesh.sizing`). None is
        `default_size_mm`.
    variant : number >= 0 of an independent mesh of the same design: differences between variants are mesh scatter.
    progress : called with a line of text about twice a second while the mesher runs.

    Raises `InputError` for a size or variant out of range or a gauge off the interface, `MemoryEstimateError` for a
    mesh whose presses would need more memory than is free, `FileAccessError` and `FileFormatError` for surface files,
    `MeshError` if the mesher fails or its mesh is unusable.
    """
    if isinstance(variant, bool) or not isinstance(variant, int) or variant < 0:
        raise InputError(f"variant must be a whole number >= 0, got {variant!r}")
    size_mm = default_size_mm(finger) if size_mm is None else checks.positive("size_mm", size_mm)
    moved = from_reference(finger, size_mm, variant, progress)
    if moved is not None:
        return moved
    key = cache.versioned_key("mesh", MESHER_VERSION, finger.geometry_sha256, size_mm, variant)
    return unpack(cache.fetch("mesh", key, lambda: pack(drawn(finger, size_mm, variant=variant, progress=progress))))


def path_of(shape: str, size_mm: float, variant: int) -> Path:
    """The file of a shipped mesh."""
    return MESH_FOLDER / f"{shape}_{size_mm:g}_{variant}.npz"


def from_reference(finger: Finger, size_mm: float, variant: int, progress: Progress = silent) -> LayeredMesh | None:
    """The mesh of a dome or slab from a shipped one; None if the mesher has to make it.

    Arguments as of `papilla.mesh.build`, and raises as it does.
    """
    shape = type(finger.shape).__name__.lower() + ("" if finger.bone is None else "_bone")
    if shape not in SIZES_MM or variant >= SHIPPED_VARIANTS:
        return None
    if size_mm in SIZES_MM[shape] and finger.geometry_sha256 == _reference_finger(shape).geometry_sha256:
        return _shipped(shape, size_mm, variant)
    body, sizing = asked(finger, size_mm)
    cells, how = _fitted(shape, body, sizing, variant)
    worst = float(mean_ratio(cells.points, cells.tets).min())
    refused = f", below {WORST_MEAN_RATIO:g}: the mesher makes a new one" if worst < WORST_MEAN_RATIO else ""
    progress(f"{how}; worst mean ratio {worst:.2f}{refused}")
    return None if worst < WORST_MEAN_RATIO else finished(body, cells, size_mm, finger.bone is not None, progress)


def _fitted(shape: str, body: MeshGeometry, sizing: Sizing, variant: int) -> tuple[TaggedCells, str]:
    """The coarsest shipped mesh whose cells at the contact are small enough after the map, refined; and words on how it
    was made."""
    for shipped_mm in SIZES_MM[shape]:
        shipped = _shipped(shape, shipped_mm, variant, mirrored=False)
        points = morphed(shipped.points, _origin(shape), body)
        near = np.linalg.norm(points[shipped.tets].mean(axis=1) - body.apex, axis=1).argsort()[:NEAREST_CELLS]
        reference_sizes = relative_sizes(shipped.points, shipped.tets, _own_sizing(shape, shipped_mm))
        fits = np.median(relative_sizes(points, shipped.tets, sizing)[near]) <= ALMOST_WANTED_SIZE * np.median(
            reference_sizes[near]
        )
        if fits:
            break
    cells = replace(tagged(shipped, _origin(shape)), points=points)
    cells, halved = _refined(cells, body, sizing, TOO_LARGE if fits else TOO_LARGE_EVERYWHERE)
    moved = "not moved" if body.surfaces == _origin(shape).surfaces else "moved"
    more = f", {halved} cells halved for their size" if halved else ""
    return cells, f"shipped mesh of {shipped_mm:g} mm, {moved}{more}"


def morphed(points: np.ndarray, origin: MeshGeometry, target: MeshGeometry) -> np.ndarray:
    """Points (n, 3) of the body `origin` mapped into the body `target`, in mm. Both are domes, or both are slabs.

    Skin, interface and bone of a dome are nested ellipsoids about the origin with semi-axes a_0 > a_1 > a_2. Any point
    p between two of them lies on exactly one ellipsoid of the family between,

        a(t) = (1 - t) a_k + t a_k+1,    sum_i (p_i / a_i(t))^2 = 1,

    and its image has the same t and the same p_i / a_i(t) in the family of the target: p_i a'_i(t) / a_i(t). Inside the
    bone the axes are scaled. Surfaces go to surfaces and planes through the origin into themselves; the map is
    continuous and never folds, because both families are nested. A slab has the same map in its section, and its depth
    is scaled. There is no system of equations and nothing random: a design has one mesh, the same on every machine up
    to rounding.

    Example: an outer semi-axis a_0 = 20 and an interface a_1 = 17 along z; a point on the z axis at z = 18.5 has t =
    0.5. In a target with a'_0 = 30 and a'_1 = 20 it moves to z = 25.

    Straight edges stay straight. If a thick layer becomes a thin curved one, a cell may therefore become flat or
    inverted: the caller checks the quality.
    """
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


def _share(points: np.ndarray, around: np.ndarray, inside: np.ndarray, body: MeshGeometry) -> np.ndarray:
    """t (n,) of points (n, 3) between two surfaces with half lengths (3,): 0 on the surface `around`."""
    low, high = np.zeros(len(points)), np.ones(len(points))
    for _ in range(MAP_BISECTIONS):
        middle = (low + high) / 2
        outside = _level(points, (1 - middle)[:, None] * around + middle[:, None] * inside, body) > 1
        low, high = np.where(outside, low, middle), np.where(outside, middle, high)
    return (low + high) / 2


def _level(points: np.ndarray, half: np.ndarray, body: MeshGeometry) -> np.ndarray:
    """sum_i (p_i / a_i)^2 (n,) over the axes along which the surfaces of `body` are curved."""
    curved = [0, 2] if isinstance(body.surfaces["skin"], EllipticCylinder) else [0, 1, 2]
    return ((points / half)[:, curved] ** 2).sum(axis=1)


def _half_lengths(body: MeshGeometry) -> list[np.ndarray]:
    """Half lengths (3,) of each surface along the axes in mm, from the outside in."""
    halves = []
    for surface in (body.surfaces[name] for name in SURFACE_NAMES):
        assert isinstance(surface, Ellipsoid)
        depth = surface.depth / 2 if isinstance(surface, EllipticCylinder) else np.inf
        halves.append(np.where(np.isfinite(surface.semi_axes), surface.semi_axes, depth))
    return halves


def _refined(cells: TaggedCells, body: MeshGeometry, sizing: Sizing, most: float) -> tuple[TaggedCells, int]:
    """The mapped mesh on its surfaces, with cells of more than `most` sizes halved and poor ones relaxed; and the
    number of halved cells."""
    halved = 0
    while True:
        constraints = Constraints(body, cells)
        cells = replace(cells, points=constraints.apply(cells.points, np.arange(len(cells.points))))
        large = relative_sizes(cells.points, cells.tets, sizing) > most
        if not large.any():
            break
        halved += int(large.sum())
        cells = bisected(cells, large)
    ratio = mean_ratio(cells.points, cells.tets)
    if np.mean(ratio < RELAXED_MEAN_RATIO) < HOPELESS_SHARE:
        cells = replace(cells, points=relax(cells.points, cells.tets, constraints, RELAXED_MEAN_RATIO))
    return cells, halved


def relative_sizes(points: np.ndarray, tets: np.ndarray, sizing: Sizing) -> np.ndarray:
    """(m,) size of each cell relative to the wanted one: the edge of a regular cell of the same volume or, for a
    stretched cell, a share of its longest edge."""
    regular = (6 * np.sqrt(2) * np.abs(volumes(points, tets))) ** (1 / points.shape[1])
    longest = edge_lengths(points, tets).max(axis=1)
    ratio = np.maximum(regular, LONGEST_EDGE_SHARE * longest) / sizing(points[tets].mean(axis=1))
    vertices, around = tets.ravel(), len(points)
    ratios = np.repeat(ratio, tets.shape[1])
    mean = np.bincount(vertices, ratios, around) / np.bincount(vertices, minlength=around).clip(min=1)
    return mean[tets].mean(axis=1)


def tagged(mesh: LayeredMesh, body: MeshGeometry) -> TaggedCells:
    """The part of a mesh of `body` that its mirrors repeat, with the faces on each surface and plane."""
    cell = mesh.cell()
    faces, cells = paired_faces(cell.tets)
    rim = faces[cells[:, 1] < 0]
    planes = tuple(rim[np.all(cell.points[rim][:, :, plane.axis] == plane.value, axis=1)] for plane in body.planes)
    base = cell.boundaries["base"]
    bone = base[~np.all(cell.points[base][:, :, 2] == 0, axis=1)]
    if (cell.layer == BONE_LAYER).any():
        bone = between(faces, cells, cell.layer, BONE_LAYER, INNER_LAYER)
    surfaces = {"skin": cell.boundaries["skin"], "interface": cell.boundaries["interface"], "bone": bone}
    return TaggedCells(cell.points, cell.tets, cell.layer, surfaces, planes)


@lru_cache(MESHES_IN_MEMORY)
def _shipped(shape: str, size_mm: float, variant: int, *, mirrored: bool = True) -> LayeredMesh:
    """A shipped mesh, or the quarter that its mirrors repeat."""
    arrays = read_arrays(path_of(shape, size_mm, variant))
    return unpack(arrays if mirrored else {**arrays, "mirrors": np.array("")})


def _reference_finger(shape: str) -> Finger:
    """The design of the shipped meshes: the default finger, with or without an elastic bone, or a slab like it."""
    finger = Finger.default()
    if shape == "dome":
        return finger
    if shape == "dome_bone":
        return replace(finger, bone=Layer(3000.0, 0.35))
    assert isinstance(finger.shape, Dome)
    outer, interface, bone = ((x, z) for x, _, z in (finger.shape.outer, finger.shape.interface, finger.shape.bone))
    return replace(finger, shape=Slab(outer, interface, bone, depth=10.0))


@lru_cache(MESHES_IN_MEMORY)
def _own_sizing(shape: str, size_mm: float) -> Sizing:
    return asked(_reference_finger(shape), size_mm)[1]


@lru_cache
def _origin(shape: str) -> MeshGeometry:
    return body_of(_reference_finger(shape))


def ship() -> None:
    """Make all shipped meshes and write their files."""
    for shape, sizes in SIZES_MM.items():
        for size_mm in sizes:
            for variant in range(SHIPPED_VARIANTS):
                path = path_of(shape, size_mm, variant)
                mesh = drawn(_reference_finger(shape), size_mm, variant=variant)
                with replacing(path) as temporary, temporary.open("wb") as file:
                    np.savez_compressed(file, allow_pickle=False, **pack(mesh))
                print(f"{path.name}: {len(mesh.tets)} tetrahedra, {path.stat().st_size} bytes")


if __name__ == "__main__":
    ship()
