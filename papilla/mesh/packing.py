"""A layered mesh as named arrays, for the cache and the reference meshes: of a mirrored mesh only the cell is kept."""

from collections.abc import Mapping

import numpy as np

from papilla.mesh.layered import BOUNDARIES, LayeredMesh
from papilla.mesh.mirroring import mirrored


def pack(mesh: LayeredMesh) -> dict[str, np.ndarray]:
    """The arrays that `unpack` needs."""
    cell = mesh.cell()
    return {
        "points": cell.points,
        "tets": cell.tets.astype(np.int32),
        "layer": cell.layer,
        **{name: cell.boundaries[name].astype(np.int32) for name in BOUNDARIES},
        "size_mm": np.array(mesh.size_mm),
        "mirrors": np.array("".join(mesh.mirrors)),
    }


def unpack(arrays: Mapping[str, np.ndarray]) -> LayeredMesh:
    """The mesh that was packed, bit for bit where `mirrored` made it."""
    boundaries = {name: arrays[name] for name in BOUNDARIES}
    cell = LayeredMesh(arrays["points"], arrays["tets"], arrays["layer"], boundaries, float(arrays["size_mm"]))
    mirrors = tuple(str(arrays["mirrors"]))
    return mirrored(cell, mirrors) if mirrors else cell
