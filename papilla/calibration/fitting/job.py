"""The main job: from a finger's design, or from measured presses, to a calibration and a check of the moduli that it
recovers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from papilla import fem
from papilla.calibration import Calibration
from papilla.calibration.fitting.checking import (
    FAILED_WIDENING,
    Depth,
    Recovery,
    Truth,
    held_as_stated,
    in_doubt,
    mesh_number,
    press_truth,
    published_depths,
    truth_is_known,
)
from papilla.calibration.fitting.fit import fit, with_compact
from papilla.calibration.fitting.position_terms import with_positions
from papilla.calibration.fitting.sweep import NOT_INCLUDED, CalibrationRanges, Sweep, sweep
from papilla.core import cache
from papilla.core.errors import ContactRangeError, InputError
from papilla.core.progress import Progress, silent
from papilla.core.units import PER_CENT
from papilla.core.workers import workers
from papilla.fem.finite.strain_tables import begin_large_strain
from papilla.fem.pressing.large_strain import ends_of, large_strain_error, tables_of
from papilla.mesh import default_size_mm
from papilla.model.finger import Finger
from papilla.model.specimen import STICK_WORD, Friction, friction_coefficient

SCATTER_VARIANTS = (1, 2, 3)
"""Numbers of the independent meshes whose sweeps measure the scatter of S_d between meshes."""
SCATTER_STEP, SHORT_STEP, SHORT_AXIS_VALUES = 6, 2, 24
"""On each other mesh every `SCATTER_STEP`-th force and modulus of a sweep is pressed; of up to `SHORT_AXIS_VALUES`
values every `SHORT_STEP`-th."""
QUICK_NOTE = (
    "quick: one other mesh instead of three, not compared with presses at finite strain, contacts at the apex alone"
)
"""Note of a quick calibration."""
QUICK_FORCES, QUICK_MODULI = 15, 12
"""Numbers of forces and moduli of a quick calibration: S_d between them is off by up to 1 %, which its intervals
contain."""

CHECKED_PER_AXIS = 10
"""Number of forces and of moduli, inside the range in which a modulus should be recovered, at which it is checked."""


class MeasuredPresses(Protocol):
    """What is known of the measured presses that a finger was identified from, for the page and the design file."""

    @property
    def finger(self) -> Finger:
        """The identified finger."""

    @property
    def found(self) -> Any:
        """The identification."""

    @property
    def diagnosis(self) -> Any:
        """What it does not determine."""

    @property
    def recovery(self) -> Recovery:
        """The moduli of these presses, recovered by the calibration."""

    @property
    def inside(self) -> np.ndarray:
        """(n,) whether the stated 95 % interval of a press contains its modulus."""

    def section(self) -> str:
        """The section of the page on the identification, as HTML."""


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A calibration, the presses to which it was fitted, and its checks: on its own mesh, and against finite strain.

    presses : computed. truth : None if none of its presses is within the domain. depths : comparison with the published
    ones.
    bench : the measured presses that the finger was identified from, if it was. widening : factor by which one sigma of
    S_d was widened, because the intervals held too few of the presses of `truth`.
    """

    calibration: Calibration
    presses: Sweep
    recovery: Truth
    reduced: fem.ReducedFinger | None = None
    truth: Truth | None = None
    depths: Sequence[Depth] = ()
    bench: MeasuredPresses | None = None
    widening: float = 1.0

    @property
    def failed(self) -> bool:
        """Whether intervals had to be widened so far that the calibration's errors are not understood."""
        return self.widening > FAILED_WIDENING


def calibrate_finger(
    finger: Finger,
    *,
    friction: Friction | None = None,
    size_mm: float | None = None,
    progress: Progress = silent,
    processes: int = 1,
    forces: Sequence[float] | None = None,
    moduli: Sequence[float] | None = None,
    quick: bool = False,
    identified: "Callable[[Calibration, Finger, Progress, float | None], Calibration] | None" = None,
) -> Calibrated:
    """Mesh, model, sweep, mesh scatter and fit of a finger; meshes, reduced fingers and sweeps come from the cache.

    Parameters
    ----------
    friction : between finger and specimens: 0, Coulomb's coefficient or "stick". None takes the friction of the
        finger's bench. If the bench states none, presses stick, as silicone does on silicone, and intervals also
        contain presses without friction.
    size_mm : element size at the contact on all meshes. None takes `papilla.mesh.default_size_mm`, and that of
        `identify` for the uncertainty of an identification.
    progress : told each stage, and the presses of a sweep.
    processes : number of processes, if much is not in the cache (`papilla.core.workers`).
    forces, moduli : of the sweep, N and MPa; at least three each. None takes those of `CalibrationRanges`.
    quick : one other mesh instead of three for the scatter, no comparison with finite strain and no contacts beside the
        apex; the notes say so.
    identified : of (calibration, finger, progress, size_mm), adds the uncertainty of an identification, without which
        an identified finger is an `InputError`; `papilla.calibrate` states it.

    Raises what meshing, reduction and fitting raise.
    """
    if finger.identified is not None and identified is None:
        raise InputError("the finger was identified: papilla.calibrate also adds the uncertainty of that")
    friction = finger.bench.friction if friction is None else friction
    size, ranges = size_mm or default_size_mm(finger), CalibrationRanges.of(finger)
    forces, moduli = ranges.swept(forces, moduli)
    block, stated = finger.bench.specimen, friction is not None
    against: tuple[Friction, ...] = () if quick else (STICK_WORD, 0.0) if friction is None else (friction,)
    cold = not quick and not truth_is_known(finger, size, against)
    with workers(processes if cold else 1, progress) as start:
        ends = (False, True) if friction is None else ends_of(friction_coefficient(friction))
        tables = begin_large_strain(finger, ends, start, progress=progress)
        truth = None if quick else start(press_truth, finger, size, against)
        reduced = fem.prepare(finger, size_mm=size, progress=mesh_number(0, progress))
        doubt = tables()
        # Their sweeps need the tables of large strain
        thin = [one[:: SHORT_STEP if len(one) <= SHORT_AXIS_VALUES else SCATTER_STEP] for one in (forces, moduli)]
        scatter = [start(_scatter, finger, size, one, *thin) for one in SCATTER_VARIANTS[: 1 if quick else None]]
        if friction is None:
            friction = 0.0 if doubt else STICK_WORD
        error = NOT_INCLUDED if doubt else large_strain_error(reduced, friction_coefficient(friction))
        progress("sweeping over force and modulus")
        presses = cached_sweep(reduced, moduli, forces, block, friction, progress)
        free = cached_sweep(reduced, moduli, forces, block, 0.0, progress) if friction else None
        others = []
        for number, swept in enumerate(scatter, 1):
            progress(f"mesh scatter: {number} of {len(scatter)} meshes")
            others.append(swept())
        progress("fitting")
        calibration = fit(presses, others, frictionless=free, friction_known=stated, strain=error, ranges=ranges)
        calibration = replace(calibration, notes=(*calibration.notes, *_friction_notes(stated, doubt)))
        calibration = replace(calibration, finger=calibration.finger | {"ridge_pitch_mm": finger.ridge_pitch_mm})
        calibration = identified(calibration, finger, progress, size_mm) if identified else calibration
        if not quick:
            progress("contacts beside the apex")
            calibration = with_positions(calibration, finger, reduced, friction)
        recovery = recover(calibration, reduced, friction, forces, moduli)
        progress("against physics: presses at finite strain on another mesh")
        unseen, law = truth() if truth else (None, "")
    calibration, judged, widening = _checked(_lawful(calibration, law), recovery, unseen)
    calibration = replace(calibration, notes=(*calibration.notes, *([QUICK_NOTE] if quick else [])))
    depths = _depths(finger, reduced)
    return Calibrated(calibration, presses, recovery, reduced, judged, depths, widening=widening)


def _lawful(calibration: Calibration, law: str) -> Calibration:
    """The calibration with a note on the stability of the layers' material laws; in doubt where one is unstable."""
    calibration = replace(calibration, provenance=calibration.provenance | {"laws": law})
    if "unstable" not in law:
        return calibration
    return in_doubt(replace(calibration, notes=(*calibration.notes, law)), law)


def _checked(
    calibration: Calibration, recovery: Truth, unseen: np.ndarray | None
) -> tuple[Calibration, Truth | None, float]:
    """The calibration, widened if it does not hold the presses of its checks as it says; what it made of the `unseen`
    ones before; and the factor."""
    presses = np.empty((0, 4)) if unseen is None else unseen
    judged = Truth.of(calibration, presses) if len(presses) else None
    wider, widening = held_as_stated(
        calibration,
        {
            "presses at finite strain on another mesh": presses,
            "presses between those that it was fitted to": recovery.presses,
        },
    )
    if unseen is not None and not (judged and len(judged.inside)):
        unchecked = "no press at finite strain lies in its domain: its intervals were not checked by one"
        wider = replace(wider, notes=(*wider.notes, unchecked))
    return calibration if wider is calibration else with_compact(wider), judged, widening


def _depths(finger: Finger, reduced: fem.ReducedFinger) -> Sequence[Depth]:
    """The comparison with the published depths; none if the finger, much smaller, cannot make those presses."""
    try:
        return published_depths(finger, reduced)
    except ContactRangeError:
        return ()


def _scatter(finger: Finger, size_mm: float, variant: int, forces, moduli, progress: Progress) -> Sweep:
    """A thin sweep without friction on another mesh."""
    reduced = fem.prepare(finger, size_mm=size_mm, variant=variant, progress=mesh_number(variant, progress))
    return cached_sweep(reduced, moduli, forces, finger.bench.specimen, 0.0)


def _friction_notes(stated: bool, doubt: str) -> list[str]:
    """Notes on what a calibration's intervals contain of large strain and friction."""
    if doubt:
        unstated = (
            "" if stated else ", and friction is not known, which lowers S_d by as much as large strain raises it"
        )
        return [f"{doubt}: intervals hold {2 * PER_CENT * NOT_INCLUDED:.2g} % for it{unstated}"]
    if stated:
        return []
    return [
        "friction is not known: stick is assumed, intervals contain presses without friction (--friction states it)"
    ]


def recover(
    calibration: Calibration,
    reduced: fem.ReducedFinger,
    friction: Friction,
    forces: Sequence[float],
    moduli: Sequence[float],
) -> Truth:
    """Press specimens of the finger's bench between the points of a sweep, and recover their moduli from the
    calibration's surface. Presses outside the range of the model are left out."""
    loads, hardness = CalibrationRanges.recorded(calibration.finger).checked
    between = _between(moduli, hardness), _between(forces, loads)
    pressed = cached_sweep(reduced, *between, reduced.bench.specimen, friction)
    columns = (pressed.force_N, pressed.modulus_MPa, pressed.sd_microstrain)
    rows = np.column_stack([np.full(len(pressed), friction_coefficient(friction)), *columns])
    return Truth.of(calibration, rows[pressed.valid])


def _between(grid: Sequence[float], limits: Sequence[float]) -> list[float]:
    """Geometric means of neighbouring grid values, thinned out: those inside the limits or, if there are none, all."""
    middles = np.sqrt(np.array(grid[:-1]) * np.array(grid[1:]))
    inside = (middles >= limits[0]) & (middles <= limits[1])
    middles = middles[inside] if inside.any() else middles
    picked = np.linspace(0, len(middles) - 1, min(CHECKED_PER_AXIS, len(middles))).round().astype(int)
    return middles[picked].tolist()


def cached_sweep(
    reduced: fem.ReducedFinger, moduli, forces, block, friction: Friction, progress: Progress = silent
) -> Sweep:
    """`sweep` on specimens like `block`, kept in the cache; for the arguments see there."""

    def make():
        return sweep(reduced, moduli, forces, block, progress=progress, friction=friction).to_arrays()

    ends = ends_of(friction_coefficient(friction))
    tables = [(table.to_json(), weight) for stuck in ends for table, weight in tables_of(reduced, stuck)]
    key = cache.key(sweep.__module__, reduced.to_arrays(), moduli, forces, vars(block(1.0)), friction, tables)
    return Sweep.from_arrays(cache.fetch("sweep", key, make))
