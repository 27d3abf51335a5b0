"""Runs the peers: on the quarter that symmetry allows, with a sweep of penalties, then on the whole finger."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from benchmarks.presses.peers.library import PEERS, Peer, PeerLibrary, PeerScene, PeerSolution
from papilla.core.errors import SolverError
from papilla.core.progress import Progress, silent
from papilla.fem import FingerModel, press
from papilla.fem.pressing.press import Press
from papilla.mesh.layered import LayeredMesh
from papilla.model.finger import Finger
from papilla.model.specimen import HalfSpace

INDENTATION_MM = 0.8
"""About 55 gf on the default finger."""

RIGID_MPA = 1e9
"""Modulus of the flat that papilla presses on: ten orders above the finger's, and so rigid within rounding."""

PENALTIES = (10.0, 100.0, 1000.0, 1e4)
"""Contact stiffnesses of the sweep, relative to the library's unit."""

CONVERGED = 1e-3
"""Relative change of force by a tenfold penalty below which the penalty counts as converged."""

REPEATS = 2
"""Number of timed presses; the fastest counts, because other work on the machine only adds time."""

ACROSS = {0: "whole finger", 1: "half by symmetry", 2: "quarter by symmetry"}


@dataclass(frozen=True)
class PeerPress:
    """One press of a rigid flat by another library, compared with papilla's fidelity contact on the same mesh.

    name : library, and the part of the finger that it meshed.
    seconds_one_press : assembly, factorisations and Newton steps of one press at `penalty`, the fastest of `REPEATS`;
        no imports and no conversion of the mesh.
    seconds_assembly : of the elastic matrix, part of the above.
    force_N, force_papilla_N, difference : forces on the finger, and their relative difference.
    sd_microstrain, sd_papilla_microstrain, difference_sd : the same of S_d at the gauges.
    penalty : stiffness of the contact as the library takes it, the least of the sweep that is converged.
    penalty_change : relative change of force when the penalty is raised tenfold from there.
    penalty_sweep : penalties tried and their forces (N).
    unknowns, systems : free unknowns, and linear systems that were factored in the press.
    """

    name: str
    seconds_one_press: float
    seconds_assembly: float
    force_N: float
    force_papilla_N: float
    difference: float
    sd_microstrain: float
    sd_papilla_microstrain: float
    difference_sd: float
    penalty: float
    penalty_change: float
    penalty_sweep: tuple[tuple[float, float], ...]
    unknowns: int
    systems: int

    def to_json(self) -> dict:
        """The documented keys (`ratio` is the caller's, who knows papilla's seconds), as plain values."""
        return {**vars(self), "penalty_sweep": [list(pair) for pair in self.penalty_sweep]}


def missing_peers(peers: Sequence[Peer] = PEERS) -> tuple[str, ...]:
    """A sentence for each peer that is not installed: what is absent, and how to install it."""
    return tuple(peer.missing for peer in peers if peer.missing is not None)


def run_peers(
    finger: Finger, mesh: LayeredMesh, *, threads: int = 2, progress: Progress = silent, peers: Sequence[Peer] = PEERS
) -> tuple[PeerPress, ...]:
    """The press by every installed peer; those that are not are named by `missing_peers`.

    A mirrored mesh gives two rows a peer: the part that mirrors leave, as papilla uses it, and the whole.
    Raises `SolverError` where a peer does not settle or its penalty does not converge, and what `FingerModel.reduce`
    and `fem.press` raise.
    """
    available = [peer for peer in peers if peer.missing is None]
    if not available:
        return ()
    flat = HalfSpace(RIGID_MPA)
    ours = press(FingerModel(finger, mesh).reduce(), flat, indentation=INDENTATION_MM, fidelity="contact")
    # The whole mesh is the part's mirror image, so that the part's sweep holds for it
    meshes = [mesh, replace(mesh, mirrors=())] if mesh.mirrors else [mesh]
    rows: list[PeerPress] = []
    for peer in available:
        sweep: dict[float, PeerSolution] = {}
        for one in meshes:
            name = f"{peer.name}, {ACROSS[len(one.mirrors)]}"
            progress(name)
            scene = PeerScene(FingerModel(finger, one), INDENTATION_MM)
            library = peer.prepare(scene, threads)
            runs = [] if sweep else [*_sweep(name, library, sweep)]
            rows.append(_row(name, scene, library, sweep, ours, runs))
    return tuple(rows)


def _sweep(name: str, library: PeerLibrary, sweep: dict[float, PeerSolution]) -> list[PeerSolution]:
    """Fill `sweep` by presses up to the first whose force is that of the one before within `CONVERGED`: the last but
    one, whose penalty is converged."""
    before = 0.0
    for penalty in PENALTIES:
        sweep[penalty] = library.press(penalty)
        force = sweep[penalty].force
        if abs(force - before) <= CONVERGED * abs(force):
            return [list(sweep.values())[-2]]
        before = force
    raise SolverError(f"{name}: the force still changes by more than {CONVERGED:g} at a penalty of {PENALTIES[-1]:g}")


def _row(
    name: str,
    scene: PeerScene,
    library: PeerLibrary,
    sweep: dict[float, PeerSolution],
    ours: Press,
    runs: list[PeerSolution],
) -> PeerPress:
    """The fastest of `REPEATS` presses at the converged penalty, those in `runs` counted."""
    *_, (penalty, found), (_, stiffer) = sweep.items()
    best = min((*runs, *(library.press(penalty) for _ in range(REPEATS - len(runs)))), key=lambda run: run.seconds)
    sd = scene.sd(best.displacement)
    return PeerPress(
        name=name,
        seconds_one_press=best.seconds,
        seconds_assembly=best.seconds_assembly,
        force_N=best.force,
        force_papilla_N=ours.force,
        difference=best.force / ours.force - 1,
        sd_microstrain=sd,
        sd_papilla_microstrain=ours.sd,
        difference_sd=sd / ours.sd - 1,
        penalty=penalty,
        penalty_change=stiffer.force / found.force - 1,
        penalty_sweep=tuple((value, run.force) for value, run in sweep.items()),
        unknowns=library.unknowns,
        systems=best.systems,
    )
