"""The press that every library makes, and what all share: the scene, Newton's method, MKL Pardiso, the list of
libraries.

The press is a rigid flat on the finger at its apex, to the same depth, without friction. It is defined once, in nodes
and arrays, so that only the libraries differ: mesh, P2 nodes, layer-wise P1 pressure, clamped and mirror nodes, gap of
the exact skin over its nodes, gauges.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import cached_property, lru_cache
from importlib import import_module
from importlib.util import find_spec
from time import perf_counter
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from papilla.core.errors import MissingExtraError, SolverError
from papilla.core.units import to_microstrain
from papilla.fem import FingerModel
from papilla.fem.discrete.assembly import lame
from papilla.fem.discrete.elements import SYMMETRIC_PARITY, TaylorHood
from papilla.fem.reduction.gauges import gauge_functionals, gauge_weights
from papilla.fem.reduction.loaded_patch import SMALLEST_SKIN_COSINE
from papilla.fem.reduction.patch import Frame, gap_of
from papilla.mesh.layered import LayeredMesh

INSTALL = "pip install 'papilla[peers]'"
NEWTON_STEPS = 40
RESIDUAL = 1e-9
"""Norm of the unbalanced forces, relative to the contact forces, at which Newton's method has converged."""


@dataclass(frozen=True, eq=False)
class PeerScene:
    """A rigid flat pressed `indentation` mm into the finger of `model` at its apex.

    The libraries use the cell of the model's mesh: a part with mirrors, or the whole finger without mirrors.
    """

    model: FingerModel
    indentation: float

    @property
    def space(self) -> TaylorHood:
        """Numbering of the P2 nodes and of the layer-wise pressures."""
        assert isinstance(self.model.space, TaylorHood)
        return self.model.space

    @property
    def mesh(self) -> LayeredMesh:
        """The cell."""
        return self.space.mesh

    @property
    def multiplicity(self) -> int:
        """Number of repetitions of the cell: forces on the finger are this many times those on the cell."""
        return 2 ** len(self.model.mesh.mirrors)

    @property
    def nodes(self) -> np.ndarray:
        """Positions (n, 3) of the P2 nodes in mm: vertices first, in the order of the mesh."""
        return self.space.displacement.doflocs.T

    @cached_property
    def elasticity(self) -> dict[int, tuple[float, float]]:
        """Layer number of the mesh -> shear modulus (MPa) and compressibility 1/lambda (1/MPa)."""
        return {number: lame(self.model.layers[number]) for number in self.space.layer_numbers}

    @cached_property
    def held(self) -> np.ndarray:
        """Mask (n, 3) of the displacements that the clamped base and the mirror planes hold at zero."""
        free = self.space.free(SYMMETRIC_PARITY, self.model.mesh.mirrors)
        return ~free[: 3 * self.space.nodes].reshape(-1, 3)

    @cached_property
    def frame(self) -> Frame:
        """The contact plane at first touch; the flat comes down along its normal."""
        return Frame.at(self.model.surfaces["skin"], 0.0, 0.0)

    @cached_property
    def contact_triangles(self) -> np.ndarray:
        """Triangles (k, 3) of the skin that may touch the flat: within the patch radius, facing the flat."""
        triangles = self.mesh.boundaries["skin"]
        local = self.frame.local(self.mesh.points)
        near = np.hypot(local[:, 0], local[:, 1]) < self.model.finger.patch_radius
        skin = self.model.surfaces["skin"]
        facing = skin.normal(self.mesh.points[triangles].mean(axis=1)) @ self.frame.axes[2] > SMALLEST_SKIN_COSINE
        return triangles[near[triangles].all(axis=1) & facing]

    @cached_property
    def contact_nodes(self) -> np.ndarray:
        """Numbers of the P2 nodes on the contact triangles."""
        return self.space.nodes_on(self.contact_triangles)

    @cached_property
    def contact_gaps(self) -> np.ndarray:
        """Distance (mm) of the exact skin above each contact node from the flat at first touch."""
        return gap_of(self.model.surfaces["skin"], self.frame, self.nodes[self.contact_nodes])

    @cached_property
    def first_guess(self) -> np.ndarray:
        """First guess of the displacement (n, 3): half of the indentation for all free components.

        A flat that cuts a round skin to depth d overlaps twice the area that it touches, and half of d gives that area.
        """
        guess = np.broadcast_to(-0.5 * self.indentation * self.frame.axes[2], self.nodes.shape)
        return np.where(self.held, 0.0, guess)

    def sd(self, displacement: np.ndarray) -> float:
        """Population standard deviation of the gauge readings (microstrain) of a displacement (n, 3) in mm."""
        functionals = gauge_functionals(self.model.finger, self.model.surfaces["interface"])
        weights = gauge_weights(self.model.finger)
        quantities = (self.model.rows(functionals, SYMMETRIC_PARITY) @ displacement.ravel()).reshape(weights.shape)
        return float(to_microstrain((weights * quantities).sum(axis=0)).std())


@dataclass(frozen=True, eq=False)
class PeerSolution:
    """Result of a library's press: the finger's force (N) and the displacement (n, 3) of the P2 nodes in mm.

    systems : how many linear systems were factored.
    seconds : of assembly, factorisations and iterations; `seconds_assembly` of the elastic matrix alone.
    """

    force: float
    displacement: np.ndarray
    systems: int
    seconds: float
    seconds_assembly: float


class Elastic(NamedTuple):
    """The assembled elastic matrix: its product with unknowns (n,), the solution (n,) of it with entries added on the
    free ones (upper triangle or all, and right-hand side), and what ends it."""

    times: Callable[[np.ndarray], np.ndarray]
    solve: Callable[[sp.coo_matrix, np.ndarray], np.ndarray]
    close: Callable[[], None] = lambda: None


Forces = Callable[[np.ndarray], tuple[np.ndarray, Callable[[], sp.coo_matrix]]]
"""Unknowns (n,) -> contact forces (n,), and a function for the tangent."""


class PeerLibrary(ABC):
    """A scene in a library's own terms; free (n,): mask of the unknowns that are not held; start (n,): first guess."""

    scene: PeerScene
    threads: int
    free: np.ndarray
    start: np.ndarray

    @abstractmethod
    def assemble(self) -> Elastic:
        """The elastic matrix, assembled again."""

    @abstractmethod
    def contact(self, penalty: float) -> Forces:
        """The contact with stiffness `penalty`, in the library's unit times the outer layer's modulus."""

    @abstractmethod
    def told(self, unknowns: np.ndarray, forces: np.ndarray) -> tuple[float, np.ndarray]:
        """Force (N) on the cell and displacement (nodes, 3) in mm of unknowns and forces of the contact."""

    def running(self) -> AbstractContextManager:
        """Description of the library's threads."""
        return nullcontext()

    @property
    def unknowns(self) -> int:
        """Number of free unknowns."""
        return int(self.free.sum())

    def press(self, penalty: float) -> PeerSolution:
        """One press at a contact penalty, by Newton's method; raises `SolverError` if it does not converge."""
        with self.running():
            began = perf_counter()
            elastic = self.assemble()
            seconds_assembly = perf_counter() - began
            contact, x = self.contact(penalty), self.start.copy()
            try:
                for step in range(NEWTON_STEPS + 1):
                    systems, (forces, tangent) = step, contact(x)
                    residual = np.where(self.free, elastic.times(x) + forces, 0.0)
                    if np.linalg.norm(residual) <= RESIDUAL * np.linalg.norm(forces):
                        break
                    x -= elastic.solve(tangent(), residual)
                else:
                    raise SolverError(f"{type(self).__name__}: contact did not settle in {NEWTON_STEPS} Newton steps")
            finally:
                elastic.close()
            seconds = perf_counter() - began
            force, displacement = self.told(x, forces)
        return PeerSolution(self.scene.multiplicity * force, displacement, systems, seconds, seconds_assembly)


@dataclass(frozen=True)
class Peer:
    """A library: its `name`, the required `packages`, and the module and name of its class."""

    name: str
    packages: tuple[str, ...]
    kind: tuple[str, str]

    @property
    def missing(self) -> str | None:
        """What to install, in a sentence; None if everything is installed."""
        absent = [package for package in self.packages if find_spec(package) is None]
        return f"{self.name}: no {' and no '.join(absent)}; {INSTALL}" if absent else None

    def prepare(self, scene: PeerScene, threads: int) -> PeerLibrary:
        """The scene in the library's terms; raises `MissingExtraError` if a package is missing or does not load."""
        if self.missing is not None:
            raise MissingExtraError(self.missing)
        try:
            return getattr(import_module(self.kind[0]), self.kind[1])(scene, threads)
        except ImportError as error:
            raise MissingExtraError(f"{self.name} does not load ({error}); {INSTALL}") from error


PEERS = tuple(
    Peer(f"{name} + PyPardiso", (package, "pypardiso"), (f"{__package__}.{package}_press", f"{package.title()}Press"))
    for name, package in (("FElupe", "felupe"), ("NGSolve", "ngsolve"))
)


# ---- MKL Pardiso through PyPardiso: symmetric indefinite matrices of one sparsity, analysed once and factored often

SYMMETRIC_INDEFINITE = -2

SETTINGS = {1: 1, 2: 3, 8: 2, 10: 8, 24: 1}
"""Pardiso's parameters, numbered from 1: own settings; threaded nested dissection; at most two refinements; pivots
perturbed below 1e-8; two-level factorisation. These were the fastest, with residuals below 1e-12."""

ANALYSE, FACTORISE_AND_SOLVE = 11, 23


@lru_cache(maxsize=1)
def engine():
    """PyPardiso's solver, configured; made once, because it searches the whole installation for MKL, which takes
    seconds.

    Raises `ImportError` if MKL is not found.
    """
    from pypardiso import PyPardisoSolver

    solver = PyPardisoSolver(mtype=SYMMETRIC_INDEFINITE)
    for number, value in SETTINGS.items():
        solver.set_iparm(number, value)
    return solver


class SymmetricPardiso:
    """Solves (base + added entries) x = b on the free unknowns of a symmetric matrix `base`, on `threads` threads.

    base : (n, n), its upper triangle or all of it; every entry that is added later must be stored, possibly as zero.
    free : (m,) numbers of the unknowns that are not held at zero.
    """

    def __init__(self, base: sp.spmatrix, free: np.ndarray, threads: int):
        self._size = base.shape[0]
        self._free = free
        self._number = np.full(self._size, -1)
        self._number[free] = np.arange(len(free))
        entries = base.tocoo()
        rows, columns = self._number[entries.row], self._number[entries.col]
        kept = (rows >= 0) & (rows <= columns)
        shape = (len(free), len(free))
        self._upper = sp.csr_matrix((entries.data[kept], (rows[kept], columns[kept])), shape=shape)
        self._upper.sort_indices()
        self._solver = engine()
        self._solver.libmkl.MKL_Set_Num_Threads(threads)
        self._run(ANALYSE, self._upper, np.zeros(len(free)))

    def solve(self, added: sp.coo_matrix, rhs: np.ndarray) -> np.ndarray:
        """Solution (n,), zero where not free, of the system with the symmetric matrix `added` (n, n) on top of base."""
        matrix = self._upper.copy()
        rows, columns = self._number[added.row], self._number[added.col]
        kept = (rows >= 0) & (rows <= columns)
        places = stored_at(matrix.indptr, matrix.indices, rows[kept], columns[kept])
        np.add.at(matrix.data, places, added.data[kept])
        solution = np.zeros(self._size)
        solution[self._free] = self._run(FACTORISE_AND_SOLVE, matrix, np.ascontiguousarray(rhs[self._free]))
        return solution

    def close(self) -> None:
        """Release the memory of the factorisation."""
        self._solver.free_memory(everything=True)

    def _run(self, phase: int, upper: sp.csr_matrix, rhs: np.ndarray) -> np.ndarray:
        self._solver.set_phase(phase)
        # The documented way to a single phase: `solve` would analyse every new matrix again
        return self._solver._call_pardiso(upper, rhs)


def stored_at(starts: np.ndarray, columns: np.ndarray, rows: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Positions in a CSR matrix with sorted `columns` and row `starts` of its entries in `rows` and columns
    `others`."""
    # 64 bits, because a row times the size exceeds 32 bits on usual meshes
    touched, which = np.unique(rows.astype(np.int64), return_inverse=True)
    spans = [np.arange(starts[row], starts[row + 1]) for row in touched]
    stored = np.concatenate(spans)
    size = int(columns.max()) + 1
    keys = np.repeat(touched, [len(span) for span in spans]) * size + columns[stored]
    return stored[np.searchsorted(keys, touched[which] * size + others)]
