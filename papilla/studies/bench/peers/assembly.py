"""Assembly of the Taylor-Hood matrix on one mesh: papilla's against NGSolve's, in one run."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from time import perf_counter

import numpy as np

from papilla.errors import MissingExtraError
from papilla.fem import FingerModel
from papilla.fem.discrete.elements import TaylorHood
from papilla.finger import Finger
from papilla.mesh.layered import LayeredMesh
from papilla.studies.bench.peers.library import INSTALL
from papilla.studies.bench.peers.scene import PeerScene

REPEATS = 3
"""Assemblies that are timed, in turn; the fastest of each library counts."""


def compare_assembly(finger: Finger, mesh: LayeredMesh, *, threads: int = 2) -> tuple[int, dict[str, np.ndarray]]:
    """Assemble the whole mesh by both: unknowns, and by library the seconds (2,) from a mesh whose edges and faces are
    numbered to the sparse matrix, and again for other moduli.

    NGSolve's seconds do not count its spaces, while papilla's basis and pressure numbering are in its own. Unknowns are
    of displacement and pressure, boundary conditions not yet removed. Raises `MissingExtraError` without NGSolve.
    """
    try:
        import ngsolve

        from papilla.studies.bench.peers.ngsolve_press import elastic_form, mesh_of, taylor_hood
    except ImportError as error:
        raise MissingExtraError(f"comparing assembly needs NGSolve ({error}); {INSTALL}") from error
    model = FingerModel(finger, replace(mesh, mirrors=()))
    scene = PeerScene(model, 0.0)
    ngsolve.SetNumThreads(threads)
    space = taylor_hood(mesh_of(scene))
    ours, theirs = [], []
    for _ in range(REPEATS):
        fresh = TaylorHood(scene.mesh)
        _ = fresh.skmesh.edges  # Numbered, as the conversion to NGSolve has them
        ours.append(_twice(partial(fresh.matrix, model.layers)))
        with ngsolve.TaskManager():
            theirs.append(_twice(elastic_form(space, scene.elasticity).Assemble))
    return space.ndof, {"papilla": np.min(ours, axis=0), "NGSolve": np.min(theirs, axis=0)}


def _twice(assemble: Callable[[], object]) -> np.ndarray:
    clock = [perf_counter()]
    for _ in range(2):
        assemble()
        clock.append(perf_counter())
    return np.diff(clock)
