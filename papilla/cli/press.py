"""`papilla press`: one scene."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from papilla.cli import options
from papilla.cli.options import option
from papilla.cli.output import CommandResult, print_table, progress, tell
from papilla.core.checks import place, positive
from papilla.core.errors import FileFormatError, InputError
from papilla.core.progress import Progress

if TYPE_CHECKING:
    from papilla.fem import Press, ReducedFinger
    from papilla.model.finger import Finger
    from papilla.model.specimen import Friction, Specimen

Fidelity = Literal["auto", "hertz", "contact", "finite"]

PRESS_RATE_HZ = 1000
AIR_S, LOADING_S, HELD_S = 0.2, 0.5, 0.5
"""Durations: the air gives the estimators the zero of the gauges; a hand loads a finger in about half a second."""
LIGHTEST_N = 0.01
"""Smallest force of a press: half of the force from which the estimators see contact."""


def press(
    specimen: options.SpecimenOptions,
    modulus: float = option(..., "Young's modulus of the specimen, MPa."),
    force: float | None = option(None, "Pressing force, N."),
    indentation: float | None = option(None, "Approach of finger and specimen, mm."),
    at: options.PlaceOption = (0.0, 0.0),
    fidelity: Fidelity = option(
        "auto", "auto: the cheaper of hertz and contact within 2 %; finite: the whole mesh, seconds."
    ),
    friction: options.FrictionOption = None,
    finger: options.FingerOption = None,
    size_mm: options.SizeOption = None,
    log: Path | None = option(None, "Log over time of this touch to write as well (CSV), for papilla estimate."),
    export: Path | None = option(
        None, "Field to write as well: displacement, strain and stress for ParaView.", metavar="FILE.vtu"
    ),
) -> CommandResult:
    """Press a specimen on the finger: indentation, contact, gauge readings.

    Give the force or the indentation.
    """
    rubbing = options.read_friction(friction)
    if rubbing and fidelity == "hertz":
        raise InputError("--fidelity hertz has no friction: use auto, contact or finite")
    if (force is None) == (indentation is None):
        raise InputError("give exactly one of --force and --indentation")
    if force is not None:
        positive("--force (N)", force)
    else:
        positive("--indentation (mm)", indentation)
    place("--at", at)
    written = _outputs(log, export, fidelity)

    from papilla.fem.preparing import prepare
    from papilla.fem.pressing.fidelity import press as press_reduced

    design, size = options.design_of(finger), options.mesh_size(size_mm)
    touched = specimen.of(modulus, design)
    options.ready([finger, *options.surface_files(design)], written.values())
    with progress() as reporter:
        if fidelity == "finite":
            load = {"force": force, "indentation": indentation}
            pressed = _finite(design, size, touched, rubbing, reporter, at=at, **load)
        else:
            reduced = prepare(design, size_mm=size, at=at, progress=reporter)
            how: dict[str, Any] = {"fidelity": fidelity, "friction": rubbing}
            pressed = press_reduced(reduced, touched, force=force, indentation=indentation, **how)
            if log is not None:
                write_touch_log(
                    log, pressed, lambda part_force: press_reduced(reduced, touched, force=part_force, **how), reporter
                )
            if export is not None:
                write_field(export, design, reduced, pressed, reporter)
    named = {"finger": design.name, "at_mm": list(at), **options.scene_of(touched, pressed)}
    facts = {**pressed.to_json(), **named} | {name: str(path) for name, path in written.items()}
    return CommandResult(facts, partial(_print, pressed, named, [gauge.name for gauge in design.gauges], written))


def _outputs(log: Path | None, export: Path | None, fidelity: Fidelity) -> dict[str, Path]:
    """The files to write, by their content; raises `InputError` and `FileFormatError`."""
    written = {name: path for name, path in (("log", log), ("field", export)) if path is not None}
    if log is not None and fidelity == "finite":
        raise InputError("--log makes hundreds of presses: leave --fidelity finite out")
    if export is not None and fidelity == "finite":
        raise InputError("--export writes the field of a linear press: leave --fidelity finite out")
    if export is not None and export.suffix.lower() != ".vtu":
        raise FileFormatError(f"{export}: fields are written as .vtu files")
    return written


def _finite(
    design: "Finger",
    size: float | None,
    touched: "Specimen",
    rubbing: "Friction | None",
    reporter: Progress,
    **scene: Any,
) -> "Press":
    """The press on the whole mesh, which sticks if neither the option nor the bench states a friction."""
    from papilla.fem.finite import press_finite
    from papilla.mesh import build
    from papilla.model.specimen import STICK_WORD

    friction = next(stated for stated in (rubbing, design.bench.friction, STICK_WORD) if stated is not None)
    return press_finite(
        design, build(design, size, progress=reporter), touched, friction=friction, progress=reporter, **scene
    )


def write_field(path: Path, design: "Finger", reduced: "ReducedFinger", pressed: "Press", reporter: Progress) -> None:
    """Write the field of a press for ParaView; raises `FileAccessError`."""
    from papilla import view
    from papilla.fem.fields import save_field

    (field,) = view.fields(design, reduced, [pressed], progress=reporter)
    save_field(field, path)


def _print(pressed: "Press", named: dict, gauges: list[str], written: dict[str, Path]) -> None:
    """Print a press as a table, with its specimen, physics and status, and the files that were written."""
    measures = {key: value for key, value in named["specimen"].items() if key != "kind"}
    specimen = ", ".join(f"{key} {value:g}" for key, value in measures.items())
    rows = [
        ("force", f"{pressed.force:.4g}", "N"),
        ("indentation", f"{pressed.indentation:.4g}", "mm"),
        ("contact area", f"{pressed.contact_area:.4g}", "mm²"),
        ("peak pressure", f"{pressed.peak_pressure:.4g}", "MPa"),
        *((f"reading {name}", f"{value:.1f}", "µε") for name, value in zip(gauges, pressed.reading, strict=True)),
        ("S_d (population sd)", f"{pressed.sd:.1f}", "µε"),
        ("force balance", f"{pressed.force_balance:.1e}", ""),
        ("fidelity", pressed.fidelity, ""),
    ]
    tell(f"{named['specimen']['kind']} ({specimen}) on {named['finger']}")
    print_table(rows)
    tell(f"Pressed on: {named['physics']}")
    tell(pressed.status)
    for path in written.values():
        tell(f"Wrote {path}")


def write_touch_log(path: Path, complete: "Press", press: Callable[[float], "Press"], reporter: Progress) -> None:
    """Write the log that ends with the press `complete`; `press` makes the press of another force (N), `reporter` tells
    progress.

    Each row of the loading is a separate press, without creep and noise. Raises `FileAccessError`.
    """
    import numpy as np

    from papilla.core.tables import write_table

    count, loading = round((AIR_S + LOADING_S + HELD_S) * PRESS_RATE_HZ), round(LOADING_S * PRESS_RATE_HZ)
    time = np.arange(count) / PRESS_RATE_HZ
    force = complete.force * np.clip((time - AIR_S) / LOADING_S, 0.0, 1.0)
    force[force < LIGHTEST_N] = 0.0
    rows = np.zeros((count, 1 + len(complete.reading)))
    rows[force == complete.force] = complete.indentation, *complete.reading
    partly = np.flatnonzero((force > 0) & (force < complete.force))[::-1]
    for finished, index in enumerate(partly):
        reporter(f"loading, {finished} of {loading} presses")
        # From the largest force on, because all presses share one contact path
        partial_press = press(float(force[index]))
        rows[index] = partial_press.indentation, *partial_press.reading
    gauges = {f"g{number}": column for number, column in enumerate(rows.T[1:], start=1)}
    write_table(path, {"t_s": time, **gauges, "force_N": force, "indentation_mm": rows[:, 0]})
