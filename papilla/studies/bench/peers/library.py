"""The interface of a library that makes the press of `PeerScene`, Newton's method for all, and the list of
libraries."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from time import perf_counter
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from papilla.errors import MissingExtraError, SolverError
from papilla.studies.bench.peers.scene import PeerScene, PeerSolution

INSTALL = "pip install 'papilla[peers]'"
NEWTON_STEPS = 40
RESIDUAL = 1e-9
"""Norm of the unbalanced forces, relative to the contact forces, at which Newton's method has converged."""


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
