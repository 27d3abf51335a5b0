"""Which peers there are, and whether they are installed; none is imported before it is used."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Protocol

from papilla.errors import MissingExtraError
from papilla.studies.bench.peers.scene import PeerScene, PeerSolution

INSTALL = "pip install 'papilla[peers]'"


class PeerLibrary(Protocol):
    """A scene in a library's own terms."""

    @property
    def unknowns(self) -> int:
        """Number of free unknowns."""

    def press(self, penalty: float) -> PeerSolution:
        """One press at a contact penalty."""


@dataclass(frozen=True)
class Peer:
    """A library by its `name`, the `packages` that it takes, and how a scene is put into its terms for some threads."""

    name: str
    packages: tuple[str, ...]
    convert: Callable[[PeerScene, int], PeerLibrary]

    @property
    def missing(self) -> str | None:
        """What to install, in a sentence; None where everything is there."""
        absent = [package for package in self.packages if find_spec(package) is None]
        return f"{self.name}: no {' and no '.join(absent)}; {INSTALL}" if absent else None

    def prepare(self, scene: PeerScene, threads: int) -> PeerLibrary:
        """The scene in the library's terms; raises `MissingExtraError` where a package is absent or does not load."""
        if self.missing is not None:
            raise MissingExtraError(self.missing)
        try:
            return self.convert(scene, threads)
        except ImportError as error:
            raise MissingExtraError(f"{self.name} does not load ({error}); {INSTALL}") from error


def _felupe(scene: PeerScene, threads: int) -> PeerLibrary:
    from papilla.studies.bench.peers.felupe_press import FelupePress
    from papilla.studies.bench.peers.pardiso import engine

    engine()
    return FelupePress(scene, threads)


def _ngsolve(scene: PeerScene, threads: int) -> PeerLibrary:
    from papilla.studies.bench.peers.ngsolve_press import NgsolvePress

    return NgsolvePress(scene, threads, "sparsecholesky")


def _ngsolve_pardiso(scene: PeerScene, threads: int) -> PeerLibrary:
    from papilla.studies.bench.peers.ngsolve_press import NgsolvePress
    from papilla.studies.bench.peers.pardiso import engine

    engine()
    return NgsolvePress(scene, threads, "pardiso")


PEERS = (
    Peer("FElupe + PyPardiso", ("felupe", "pypardiso"), _felupe),
    Peer("NGSolve", ("ngsolve",), _ngsolve),
    Peer("NGSolve + PyPardiso", ("ngsolve", "pypardiso"), _ngsolve_pardiso),
)
"""NGSolve twice: with its own direct solver, and with Pardiso, whichever is faster on the machine at hand."""
