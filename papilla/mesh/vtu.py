"""Layered meshes as VTU files: tetrahedra with their layer, boundary triangles with their name, bit for bit."""

from pathlib import Path

import numpy as np

from papilla.errors import FileAccessError, FileFormatError
from papilla.files import replacing
from papilla.mesh.layered import BOUNDARIES, LayeredMesh

NO_LAYER = -1
"""`layer` of the triangles; `boundary` of the tetrahedra is 0, of the triangles 1, 2, 3 for skin, interface, base."""


def save(mesh: LayeredMesh, path) -> None:
    """Write a mesh as VTU (binary, compressed); raises `FileAccessError` where that is not possible.

    Cell data: `layer`, `boundary`, and, the same for every cell, `size_mm` and `mirrors` (1 for x, plus 2 for y).
    """
    import meshio

    if Path(path).suffix.lower() != ".vtu":
        raise FileFormatError(f"{path}: meshes are written as .vtu files")
    blocks = [("tetra", mesh.tets), *(("triangle", mesh.boundaries[name]) for name in BOUNDARIES)]
    layer = [mesh.layer.astype(np.int32)] + [np.full(len(faces), NO_LAYER, np.int32) for _, faces in blocks[1:]]
    boundary = [np.full(len(cells), number, np.int32) for number, (_, cells) in enumerate(blocks)]
    mirrors = sum(1 << "xyz".index(axis) for axis in mesh.mirrors)
    data = {
        "layer": layer,
        "boundary": boundary,
        "size_mm": [np.full(len(cells), mesh.size_mm) for _, cells in blocks],
        "mirrors": [np.full(len(cells), mirrors, np.int32) for _, cells in blocks],
    }
    with replacing(path) as temporary:
        meshio.vtu.write(str(temporary), meshio.Mesh(mesh.points, blocks, cell_data=data), binary=True)


def load(path) -> LayeredMesh:
    """Read a mesh that `save` wrote.

    Raises `FileAccessError` for a missing or unreadable file, `FileFormatError` for one that holds something else.
    """
    import meshio

    try:
        Path(path).open("rb").close()
    except OSError as error:
        raise FileAccessError(f"cannot read mesh file {path}: {error.strerror}") from error
    try:
        content = meshio.vtu.read(str(path))
    except (Exception, SystemExit) as error:
        raise FileFormatError(f"{path} is not a readable VTU file: {error}") from error
    absent = [key for key in ("layer", "boundary", "size_mm", "mirrors") if key not in content.cell_data]
    if absent or not {block.type for block in content.cells} <= {"tetra", "triangle"}:
        lack = f"no cell data {', '.join(absent)}" if absent else "other cells than tetrahedra and triangles"
        raise FileFormatError(f"{path} is not a layered mesh: it has {lack}")
    return _from_meshio(path, content)


def _from_meshio(path, content) -> LayeredMesh:
    parts: dict[int, list[np.ndarray]] = {number: [] for number in range(len(BOUNDARIES) + 1)}
    layers = []
    for block, layer, boundary in zip(
        content.cells, content.cell_data["layer"], content.cell_data["boundary"], strict=True
    ):
        for number in np.unique(boundary):
            if int(number) not in parts or (number == 0) != (block.type == "tetra"):
                raise FileFormatError(f"{path} is not a layered mesh: a {block.type} has boundary number {number}")
            parts[int(number)].append(block.data[boundary == number])
        if block.type == "tetra":
            layers.append(layer)
    if not all(parts.values()):
        raise FileFormatError(f"{path} is not a layered mesh: it lacks tetrahedra or one of {', '.join(BOUNDARIES)}")
    cells = {number: np.vstack(found) for number, found in parts.items()}
    bits = int(content.cell_data["mirrors"][0][0])
    return LayeredMesh(
        content.points,
        cells[0],
        np.concatenate(layers),
        {name: cells[number] for number, name in enumerate(BOUNDARIES, start=1)},
        float(content.cell_data["size_mm"][0][0]),
        tuple(axis for k, axis in enumerate("xyz") if bits >> k & 1),
    )
