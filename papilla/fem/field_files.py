"""Writes the displacement, strain and stress of a press to a VTU file, for ParaView and other tools."""

from pathlib import Path

import numpy as np

from papilla.errors import FileFormatError
from papilla.fem.fields import Field
from papilla.files import replacing

VOIGT = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
"""Order in which VTK and ParaView keep a symmetric tensor: xx, yy, zz, xy, yz, xz."""


def save_field(field: Field, path: str | Path) -> None:
    """Write displacement (mm) of the vertices, small strain and stress (MPa; six components each) and the layer number
    of the tetrahedra.

    Raises `FileFormatError` unless the path ends in .vtu, `FileAccessError` if the file cannot be written.
    """
    import meshio

    if Path(path).suffix.lower() != ".vtu":
        raise FileFormatError(f"{path}: fields are written as .vtu files")
    tensors = {"strain": field.strain, "stress_MPa": field.stress}
    cells = {name: [np.stack([of[:, i, j] for i, j in VOIGT], axis=1)] for name, of in tensors.items()}
    cells["layer"] = [field.mesh.layer.astype(np.int32)]
    whole = meshio.Mesh(
        field.mesh.points,
        [("tetra", field.mesh.tets)],
        point_data={"displacement_mm": field.displacement},
        cell_data=cells,
    )
    with replacing(path) as temporary:
        meshio.vtu.write(str(temporary), whole, binary=True)
