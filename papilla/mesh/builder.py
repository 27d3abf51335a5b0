"""From a finger to its layered mesh: shipped, cached, or made of soup, mesher, tags, snapping and mirrors."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from papilla import cache as store
from papilla import checks
from papilla.errors import InputError, MeshError
from papilla.finger import DEFAULT_FINGER, Finger
from papilla.memory import least_bytes, refuse_size
from papilla.mesh.body import Body, body_of
from papilla.mesh.child import Progress, tetrahedralise
from papilla.mesh.curving import bent_edges
from papilla.mesh.layered import LayeredMesh, mirrored, pack, unpack
from papilla.mesh.sizing import Sizing, grid_over, positively_oriented
from papilla.mesh.snapping import snap
from papilla.mesh.surfaces import gauge_site
from papilla.mesh.tagging import TaggedCells, tag
from papilla.mesh.topology import components, paired_faces, volumes

DEFAULT_SIZE_MM = 0.7  # Element size at the contact for which the figures of the README hold
ENVELOPE, ENVELOPE_SIZES = 1e-3, 0.05
"""How far the mesher may move a surface: a fraction of the bounding box's diagonal, or of the element size if more."""

FINEST, COARSEST = 1 / 200, 1 / 4  # Element sizes that are accepted, as fractions of the finger's height
REACH = 3.0  # Flat faces are looked for within this many envelopes of their plane
SAMPLES = 32  # Points along each axis of the body's box in which its volume is sampled
VARIANTS = 5
"""Reference meshes of the default finger: the first is the default, the spread of all five is the mesh scatter."""


def build(
    finger: Finger,
    size_mm: float = DEFAULT_SIZE_MM,
    *,
    variant: int = 0,
    progress: Progress | None = None,
    cache: bool = True,
) -> LayeredMesh:
    """The layered mesh of a finger.

    Parameters
    ----------
    finger : its shape decides the geometry; `Dome` and `Slab` give a mesh that is its own mirror image in x and y.
    size_mm : edge length at the contact; it grows away from the apex (`papilla.mesh.sizing`).
    variant : number >= 0 of an independent mesh of the same design: what differs between variants is mesh scatter.
    progress : called with a line of text about twice a second while the mesher runs.
    cache : look for the mesh among the shipped and the cached ones, and keep it (`papilla.cache`).

    Raises `InputError` for a size or variant out of range or a gauge off the interface, `MemoryEstimateError` for a
    mesh that could not be pressed in the memory left, `FileAccessError` and `FileFormatError` for surface files,
    `MeshError` where the mesher fails or its mesh must not be used.
    """
    if isinstance(variant, bool) or not isinstance(variant, int) or variant < 0:
        raise InputError(f"variant must be a whole number >= 0, got {variant!r}")
    size_mm = checks.positive("size_mm", size_mm)
    if not cache:
        return mesh_finger(finger, size_mm, variant=variant, progress=progress)
    shipped = reference(finger, size_mm, variant)
    if shipped is not None:
        return shipped
    key = store.key(__name__, finger.geometry_sha256, size_mm, variant)
    return unpack(
        store.fetch("mesh", key, lambda: pack(mesh_finger(finger, size_mm, variant=variant, progress=progress)))
    )


def reference_path(variant: int) -> Path:
    """File of a reference mesh: they ship with the package (`papilla.mesh.pin` makes them), because the mesher is not
    deterministic and default results could not be reproduced to the digit without."""
    return DEFAULT_FINGER.parent / f"reference_mesh_{variant}.npz"


def reference(finger: Finger, size_mm: float, variant: int) -> LayeredMesh | None:
    """The shipped mesh of this geometry, size and variant; None where none was shipped."""
    path = reference_path(variant)
    if variant >= VARIANTS or not path.exists():
        return None
    with np.load(path, allow_pickle=False) as data:
        if float(data["size_mm"]) != size_mm or str(data["geometry_sha256"]) != finger.geometry_sha256:
            return None
        return unpack(data)


def mesh_finger(finger: Finger, size_mm: float, *, variant: int = 0, progress: Progress | None = None) -> LayeredMesh:
    """A new mesh of a finger: the same as `build`, past all stored meshes."""
    body = body_of(finger, size_mm, variant)
    tall = float(body.high[2] - body.low[2])
    checks.within(f"size_mm of a finger {tall:g} mm tall", size_mm, FINEST * tall, COARSEST * tall)
    sizing = Sizing(body.apex, size_mm, finger.patch_radius, _sites(finger, body))
    keep_bone = finger.bone is not None
    refuse_too_fine(body, sizing, keep_bone)
    diagonal = float(np.linalg.norm(body.high - body.low))
    envelope = max(ENVELOPE, ENVELOPE_SIZES * size_mm / diagonal)
    points, tets = tetrahedralise(_soup(body, sizing, envelope, variant), progress)
    cells = tag(body, points, positively_oriented(points, tets), keep_bone, REACH * envelope * diagonal)
    points = snap(body, cells)
    boundaries = _boundaries(body, cells, keep_bone)
    refuse_unusable(LayeredMesh(points, cells.tets, cells.layer, boundaries, size_mm))
    faces = [(surface, cells.on_surface[name]) for name, surface in body.surfaces.items()]
    edges, middles, straight = bent_edges(points, cells.tets, faces)
    if straight and progress is not None:
        progress(f"{straight} edges stay straight: bent to the surface, their cells would turn over")
    cell = LayeredMesh(points, cells.tets, cells.layer, boundaries, size_mm, (), edges, middles)
    return mirrored(cell, body.mirrors) if body.mirrors else cell


def _sites(finger: Finger, body: Body) -> np.ndarray:
    """Where the gauges sit (k, 3), each in the part of the finger that is meshed."""
    sites = np.array([gauge_site(finger, gauge, body.surfaces["interface"]) for gauge in finger.gauges]).reshape(-1, 3)
    for axis in ("xyz".index(name) for name in body.mirrors):
        sites[:, axis] = np.abs(sites[:, axis])
    return np.unique(np.round(sites, 9), axis=0)


def refuse_too_fine(body: Body, sizing: Sizing, keep_bone: bool) -> None:
    """Raise `MemoryEstimateError` where the mesh that `sizing` asks for could not be pressed in the memory left."""
    lines = [
        low + (high - low) * (np.arange(SAMPLES) + 0.5) / SAMPLES for low, high in zip(body.low, body.high, strict=True)
    ]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    meshed = body.surfaces["skin"].level(points) <= 0
    if not keep_bone:
        meshed &= body.surfaces["bone"].level(points) > 0
    volume = float(np.prod(body.high - body.low)) / SAMPLES**3

    def cells(ratio: float) -> float:
        return replace(sizing, near_mm=ratio * sizing.near_mm).cell_count(points[meshed], volume)

    job = f"factorising a mesh of about {cells(1):,.0f} tetrahedra (size_mm {sizing.near_mm:g})"
    refuse_size(job, sizing.near_mm, lambda ratio: least_bytes(cells(ratio)))


def _soup(body: Body, sizing: Sizing, envelope: float, variant: int) -> dict[str, np.ndarray]:
    """The mesher's input; a variant has triangles of its own and a sizing grid that is shifted."""
    offsets = np.cumsum([0] + [len(vertices) for vertices, _ in body.triangulations])
    triangles = np.vstack([faces + k for (_, faces), k in zip(body.triangulations, offsets, strict=False)])
    shift = np.random.default_rng(variant).uniform(-0.5, 0.5, 3) if variant else np.zeros(3)
    grid_points, grid_tets = grid_over(body.low, body.high, sizing.grid_mm, shift)
    return {
        "vertices": np.vstack([vertices for vertices, _ in body.triangulations]),
        "triangles": triangles,
        "far_mm": np.array(sizing.far_mm),
        "envelope": np.array(envelope),
        "grid_points": grid_points,
        "grid_tets": grid_tets,
        "grid_sizes": sizing(grid_points),
    }


def _boundaries(body: Body, cells: TaggedCells, keep_bone: bool) -> dict[str, np.ndarray]:
    flat = [faces for plane, faces in zip(body.planes, cells.on_plane, strict=True) if plane.role == "base"]
    clamped = flat if keep_bone else [*flat, cells.on_surface["bone"]]
    return {"skin": cells.on_surface["skin"], "interface": cells.on_surface["interface"], "base": np.vstack(clamped)}


def refuse_unusable(mesh: LayeredMesh) -> None:
    """Raise `MeshError` for a mesh with flat or inverted cells, or of more than one part."""
    volume = volumes(mesh.points, mesh.tets)
    scale = np.abs(volume).mean()
    bad = int(np.sum(volume <= 1e-9 * scale))
    if bad:
        raise MeshError(f"{bad} of {len(volume)} tetrahedra are flat or inverted: try another element size")
    faces, cells = paired_faces(mesh.tets)
    parts = int(components(cells, len(mesh.tets)).max()) + 1
    if parts > 1:
        raise MeshError(f"the mesh falls into {parts} separate parts: try another element size")
