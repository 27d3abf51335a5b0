"""From tagged cells on their surfaces to the final mesh: checked, boundaries named, edges bent, mirrored."""

import numpy as np

from papilla.checks import SIZE_OPTION
from papilla.errors import MeshError
from papilla.mesh.body import Body
from papilla.mesh.child import Progress
from papilla.mesh.curving import bent_edges
from papilla.mesh.layered import LayeredMesh, mirrored
from papilla.mesh.tagging import TaggedCells
from papilla.mesh.topology import components, paired_faces, volumes


def finished(
    body: Body, cells: TaggedCells, size_mm: float, keep_bone: bool, progress: Progress | None = None
) -> LayeredMesh:
    """The mesh of `cells`, which lie in `body` and on its surfaces; raises `MeshError` if it is unusable."""
    boundaries = _boundaries(body, cells, keep_bone)
    refuse_unusable(LayeredMesh(cells.points, cells.tets, cells.layer, boundaries, size_mm))
    faces = [(surface, cells.on_surface[name]) for name, surface in body.surfaces.items()]
    edges, middles, straight = bent_edges(cells.points, cells.tets, faces)
    if straight and progress is not None:
        progress(f"{straight} edges stay straight: bent to the surface, their cells would turn over")
    cell = LayeredMesh(cells.points, cells.tets, cells.layer, boundaries, size_mm, (), edges, middles)
    return mirrored(cell, body.mirrors) if body.mirrors else cell


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
        raise MeshError(f"{bad} of {len(volume)} tetrahedra are flat or inverted: try another size_mm ({SIZE_OPTION})")
    faces, cells = paired_faces(mesh.tets)
    parts = int(components(cells, len(mesh.tets)).max()) + 1
    if parts > 1:
        raise MeshError(f"the mesh falls into {parts} separate parts: try another size_mm ({SIZE_OPTION})")
