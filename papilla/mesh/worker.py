"""The process of the mesher and of VTK's file readers: `python worker.py JOB`, in a separate folder.

It reads `input.npz` there and leaves `output.npz`, whole or not at all.
"""

import os
import signal
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np

Arrays = Mapping[str, np.ndarray]

PR_SET_PDEATHSIG = 1  # Constant of Linux' prctl(2): the signal that a process gets when its parent has died


def tetrahedralise(soup: Arrays) -> Arrays:
    """Points (n, 3) and tetrahedra (m, 4) that pytetwild makes from the triangulations.

    The space around them is meshed, too, because the mesher's own winding numbers fail if nested surfaces share a base.
    """
    import pytetwild

    points, tets = pytetwild.tetrahedralize(
        soup["vertices"],
        soup["triangles"].astype(np.int32),
        edge_length_abs=float(soup["far_mm"]),
        epsilon=float(soup["envelope"]),
        optimize=True,
        disable_filtering=True,
        vtk_ordering=True,
        quiet=True,
        bg_vertices=soup["grid_points"],
        bg_tets=soup["grid_tets"].astype(np.int32),
        bg_values=soup["grid_sizes"],
    )
    return {"points": points, "tets": tets}


def read_surface(file: Arrays) -> Arrays:
    """Vertices (n, 3) and triangles (m, 3) of a surface file with bytes `content` and name `suffix`.

    VTK's readers crash on some damaged files, and print their own messages.
    """
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter
    from vtkmodules.vtkIOGeometry import vtkSTLReader
    from vtkmodules.vtkIOPLY import vtkPLYReader
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    suffix = str(file["suffix"])
    file["content"].tofile(f"surface{suffix}")
    _limit_memory()
    readers: dict[str, Any] = {".stl": vtkSTLReader, ".ply": vtkPLYReader, ".vtp": vtkXMLPolyDataReader}
    reader = readers[suffix]()
    reader.SetFileName(f"surface{suffix}")
    triangulated = vtkTriangleFilter()
    triangulated.SetInputConnection(reader.GetOutputPort())
    triangulated.Update()
    surface = triangulated.GetOutput()
    if not surface.GetNumberOfPolys():
        return {"vertices": np.empty((0, 3)), "triangles": np.empty((0, 3), dtype=np.int64)}
    vertices = vtk_to_numpy(surface.GetPoints().GetData()).astype(float)
    triangles = vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3).astype(np.int64)
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise SystemExit("a triangle has a vertex that is not there")
    return {"vertices": vertices, "triangles": triangles}


def _limit_memory() -> None:
    """Limit the memory, so that a damaged file that asks for too much cannot take it."""
    from papilla.core.memory import available_bytes

    free = available_bytes()
    if sys.platform == "linux" and free is not None:
        import resource

        resource.setrlimit(resource.RLIMIT_DATA, (free, free))


def end_with_parent() -> None:
    """On Linux, let this process be killed as soon as its parent has ended. It cannot watch by itself, because the
    mesher holds the interpreter's lock for minutes."""
    if sys.platform == "linux":
        import ctypes

        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


WORKER_JOBS = {"tetrahedralise": tetrahedralise, "read_surface": read_surface}

if __name__ == "__main__":
    end_with_parent()
    with np.load("input.npz", allow_pickle=False) as given:
        made = WORKER_JOBS[sys.argv[1]](given)
    with open("output.part", "wb") as part:
        np.savez(part, allow_pickle=False, **made)
    os.replace("output.part", "output.npz")
