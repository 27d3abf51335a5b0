"""Layered meshes as VTU files: tetrahedra with their layer, boundary triangles with their name, and bent edges.

A bent edge is a quadratic line; the points in the middle of these lines come after all vertices. A mesh that is written
and read again is the same to the last bit.
"""

from os import PathLike
from pathlib import Path

import numpy as np

from papilla.errors import FileAccessError, FileFormatError
from papilla.files import replacing
from papilla.mesh.layered import BOUNDARIES, LayeredMesh

NO_LAYER = -1
"""`layer` of cells that are not tetrahedra; `boundary` is 0 for tetrahedra, 1, 2, 3 for triangles of skin, interface,
base, and 4 for bent edges."""


def save(mesh: LayeredMesh, path: str | PathLike[str]) -> None:
    """Write a mesh as VTU (binary, compressed); raises `FileAccessError` if that is not possible.

    Cell data: `layer`, `boundary`, and, the same for every cell, `size_mm` and `mirrors` (1 for x, plus 2 for y).
    """
    import meshio

    if Path(path).suffix.lower() != ".vtu":
        raise FileFormatError(f"{path}: meshes are written as .vtu files")
    blocks = [("tetra", mesh.tets), *(("triangle", mesh.boundaries[name]) for name in BOUNDARIES)]
    middles = len(mesh.points) + np.arange(len(mesh.edges))
    blocks.append(("line3", np.column_stack([mesh.edges, middles])))
    points = np.vstack([mesh.points, mesh.middles])
    layer = [mesh.layer.astype(np.int32)] + [np.full(len(faces), NO_LAYER, np.int32) for _, faces in blocks[1:]]
    mirrors = sum(1 << "xyz".index(axis) for axis in mesh.mirrors)
    data = {
        "layer": layer,
        "boundary": [np.full(len(cells), number, np.int32) for number, (_, cells) in enumerate(blocks)],
        "size_mm": [np.full(len(cells), mesh.size_mm) for _, cells in blocks],
        "mirrors": [np.full(len(cells), mirrors, np.int32) for _, cells in blocks],
    }
    with replacing(path) as temporary:
        meshio.vtu.write(str(temporary), meshio.Mesh(points, blocks, cell_data=data), binary=True)


def load(path: str | PathLike[str]) -> LayeredMesh:
    """Read a mesh that `save` wrote.

    Raises `FileAccessError` for a missing or unreadable file, `FileFormatError` for one with other content.
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
    refused = f"{path} is not a layered mesh:"
    absent = [key for key in ("layer", "boundary", "size_mm", "mirrors") if key not in content.cell_data]
    if absent or not {*content.cells_dict} <= {"tetra", "triangle", "line3"}:
        lack = f"no cell data {', '.join(absent)}" if absent else "cells beside tetrahedra, triangles and bent edges"
        raise FileFormatError(f"{refused} it has {lack}")
    cells: dict[int, np.ndarray] = {}
    bent = content.cells_dict.get("line3", np.empty((0, 3), dtype=np.int64))
    vertices = len(content.points) - len(bent)
    if np.any(bent[:, :2] >= vertices) or not np.array_equal(bent[:, 2], vertices + np.arange(len(bent))):
        raise FileFormatError(f"{refused} its bent edges have no middles of their own")
    for kind, boundary in content.cell_data_dict["boundary"].items():
        if kind == "line3":
            continue
        for number in np.unique(boundary):
            if not 0 <= number <= len(BOUNDARIES) or (number == 0) != (kind == "tetra"):
                raise FileFormatError(f"{refused} a {kind} has boundary number {number}")
            cells[int(number)] = content.cells_dict[kind][boundary == number]
    if len(cells) <= len(BOUNDARIES):
        raise FileFormatError(f"{refused} it lacks tetrahedra or one of {', '.join(BOUNDARIES)}")
    bits = int(content.cell_data["mirrors"][0][0])
    return LayeredMesh(
        content.points[:vertices],
        cells[0],
        content.cell_data_dict["layer"]["tetra"],
        {name: cells[number] for number, name in enumerate(BOUNDARIES, start=1)},
        float(content.cell_data["size_mm"][0][0]),
        tuple(axis for k, axis in enumerate("xyz") if bits >> k & 1),
        bent[:, :2],
        content.points[vertices:],
    )
