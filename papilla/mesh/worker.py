"""The mesher's process: `python -m papilla.mesh.worker INPUT.npz OUTPUT.npz`, in a directory of its own."""

import os
import sys

import numpy as np


def main(source: str, target: str) -> None:
    """Mesh the soup of `source` with pytetwild and write points and tetrahedra to `target`.

    The space around the soup is meshed too: the mesher's own winding numbers fail where nested surfaces share a base.
    """
    import pytetwild

    with np.load(source, allow_pickle=False) as data:
        points, tets = pytetwild.tetrahedralize(
            data["vertices"],
            data["triangles"].astype(np.int32),
            edge_length_abs=float(data["far_mm"]),
            epsilon=float(data["envelope"]),
            optimize=True,
            disable_filtering=True,
            vtk_ordering=True,
            quiet=True,
            bg_vertices=data["grid_points"],
            bg_tets=data["grid_tets"].astype(np.int32),
            bg_values=data["grid_sizes"],
        )
    with open(target + ".part", "wb") as file:
        np.savez(file, points=points, tets=tets)
    os.replace(target + ".part", target)


if __name__ == "__main__":
    main(*sys.argv[1:])
