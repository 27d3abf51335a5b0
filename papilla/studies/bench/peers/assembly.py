"""Assembly of the Taylor-Hood matrix on one mesh: papilla's against NGSolve's, in one run."""

from dataclasses import dataclass
from time import perf_counter

from papilla.errors import MissingExtraError
from papilla.fem.discrete.elements import TaylorHood
from papilla.finger import Finger
from papilla.mesh.layered import BONE, INNER, OUTER, LayeredMesh
from papilla.studies.bench.peers.installed import INSTALL
from papilla.studies.bench.peers.scene import PeerScene

REPEATS = 3
"""Assemblies that are timed, in turn; the fastest of each library counts."""


@dataclass(frozen=True)
class AssemblyComparison:
    """Seconds from a mesh whose edges and faces are numbered to the sparse matrix, and again for other moduli.

    seconds_ngsolve does not count its spaces, while papilla's basis and pressure numbering are in seconds_papilla.
    unknowns : of displacement and pressure, boundary conditions not yet removed.
    """

    unknowns: int
    threads: int
    seconds_papilla: float
    seconds_ngsolve: float
    seconds_papilla_again: float
    seconds_ngsolve_again: float

    @property
    def ratio(self) -> float:
        """papilla's seconds over NGSolve's, first assembly."""
        return self.seconds_papilla / self.seconds_ngsolve

    @property
    def ratio_again(self) -> float:
        """papilla's seconds over NGSolve's when only moduli change."""
        return self.seconds_papilla_again / self.seconds_ngsolve_again


def compare_assembly(finger: Finger, mesh: LayeredMesh, *, threads: int = 2) -> AssemblyComparison:
    """Assemble the whole mesh by both; raises `MissingExtraError` without NGSolve."""
    try:
        import ngsolve

        from papilla.studies.bench.peers.ngsolve_press import elastic_form, mesh_of, taylor_hood
    except ImportError as error:
        raise MissingExtraError(f"comparing assembly needs NGSolve ({error}); {INSTALL}") from error
    scene = PeerScene(finger, mesh, (), 0.0)
    ngsolve.SetNumThreads(threads)
    space = taylor_hood(mesh_of(scene))
    layers = {OUTER: finger.outer, INNER: finger.inner} | ({} if finger.bone is None else {BONE: finger.bone})
    ours, theirs = [], []
    for _ in range(REPEATS):
        fresh = TaylorHood(mesh)
        # Numbers the edges, as the conversion to NGSolve has
        _ = fresh.skmesh.edges
        ours.append(_twice(lambda fresh=fresh: fresh.matrix(layers)))
        with ngsolve.TaskManager():
            form = elastic_form(space, scene.elasticity)
            theirs.append(_twice(form.Assemble))
    first, again = zip(*ours, strict=True)
    first_theirs, again_theirs = zip(*theirs, strict=True)
    return AssemblyComparison(space.ndof, threads, min(first), min(first_theirs), min(again), min(again_theirs))


def _twice(assemble) -> tuple[float, float]:
    start = perf_counter()
    assemble()
    middle = perf_counter()
    assemble()
    return middle - start, perf_counter() - middle
