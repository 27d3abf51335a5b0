"""`papilla identify`: identifies the finger that made a log of presses."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from papilla.cli.identify_compare import compare_with
from papilla.cli.identify_rate import loops_of, print_relaxation, relaxation_of
from papilla.cli.identify_suggest import SuggestOptions, print_suggestion
from papilla.cli.options import (
    PROCESSES,
    FingerOption,
    FrictionOption,
    JsonOption,
    MapOption,
    SpecimenOptions,
    about,
    argument,
    describe,
    keep_inputs,
    number,
    option,
    read_friction,
    read_press_log,
    surface_files,
)
from papilla.cli.output import Stopwatch, print_json, print_table, progress, tell
from papilla.errors import InputError

if TYPE_CHECKING:
    from papilla.calibrate.identification import Diagnosis, Identification


def identify(
    specimen: SpecimenOptions,
    further: SuggestOptions,
    log: Path | None = argument(None, "Log of presses (CSV): force_N, modulus_MPa, g1, ...", metavar="LOG.csv"),
    out: Path | None = option(None, "Design file of the identified finger to write (TOML)."),
    finger: FingerOption = None,
    free: list[str] | None = option(None, "A further parameter to fit, such as thickness_mm."),
    fix: list[str] | None = option(None, "Hold a parameter, such as lever_mm=0 or gain.g1=1.", metavar="NAME=VALUE"),
    friction: FrictionOption = None,
    noise: float = option(5.0, "Noise of a reading, microstrain."),
    force_error: float = option(0.01, "Relative error of a force."),
    report: Path | None = option(None, "Page to write on the fit (HTML)."),
    relaxation: Literal["1", "2"] | None = option(
        None, "Fit so many relaxation times to the log's longest touch (t_s)."
    ),
    compare: Path | None = option(
        None,
        "Test whether it is still the finger of this identified design; exit code 1 if not; nothing is written.",
        metavar="OLD.toml",
    ),
    log_map: MapOption = None,
    as_json: JsonOption = False,
) -> None:
    """Identify a real finger from presses: moduli, gains, levers, zeros, with intervals and doubts.

    Every command accepts the design file that is written; calibrate includes its uncertainty. --suggest proposes the
    next presses; --compare tests whether it is still the same finger.
    """
    watch = Stopwatch()
    given = {"out": out, "report": report, "free": free, "fix": fix, "friction": friction, "relaxation": relaxation}
    if compare is not None:
        return compare_with(compare, log, log_map, as_json, finger=finger, suggest=further.suggest, **given)
    rubbing, held = read_friction(friction), _held(fix or [])
    further.check(log, **given)
    from papilla.calibrate.identification import Noise, diagnose, record
    from papilla.calibrate.identification import identify as fit
    from papilla.calibrate.report.identification_page import write_identification
    from papilla.files import check_writable, replacing_set
    from papilla.finger import Finger

    outputs = [path for path in (out, report) if path is not None]
    keep_inputs([log, finger, log_map], outputs)
    design = Finger.load(finger) if finger else Finger.default()
    touched = specimen.of(1.0, design)
    keep_inputs(surface_files(design), outputs)
    stated = Noise(readings_microstrain=noise, force=force_error)
    if log is None:
        protocol = further.protocol(design, touched, stated)
        return print_json(protocol) if as_json else print_suggestion(protocol)
    presses = read_press_log(log, False, mixed=touched, log_map=log_map)
    if relaxation is not None and presses.t_s is None:
        raise InputError(f"{log}: --relaxation needs a column t_s: when each row was taken")
    for path in outputs:
        check_writable(path.parent)
    with progress() as shown:
        with about(log):
            bench: Any = {"specimen": touched, "noise": stated, "friction": rubbing}
            found = fit(presses, design, free=free or (), fix=held, **bench, processes=PROCESSES, progress=shown.line)
        shown.line("what to doubt")
        diagnosis = diagnose(found)
        silicone, kept = relaxation_of(log, found, relaxation, log_map)
        pressed = [shape.specimen for shape in found.problem.shapes]
        of_what = " and ".join(one.words for one in pressed)
        identified = found.with_record(replace(record(found, diagnosis, of_what), **kept))
        besides = loops_of(presses) | silicone | further.after(found)
        with replacing_set(outputs) as files:
            if out is not None:
                identified.save(files[0])
            if report is not None:
                write_identification(files[-1], found, diagnosis)
    written = {name: str(path) for name, path in (("finger", out), ("report", report)) if path is not None}
    summary = summary_of(found, diagnosis) | {"specimen": describe(pressed[0])} | written | besides
    summary["seconds"] = watch.seconds
    return print_json(summary) if as_json else _print(summary)


def _held(fix: list[str]) -> dict[str, float]:
    found = {}
    for text in fix:
        name, sign, value = text.partition("=")
        if not sign:
            raise InputError(f"--fix takes NAME=VALUE, got {text!r}")
        found[name.strip()] = number(f"--fix {name.strip()} must be a number", value)
    return found


def summary_of(found: "Identification", diagnosis: "Diagnosis") -> dict:
    """Parameters with intervals, and doubts, as plain values."""
    parameters = {}
    for name, value in found.values.items():
        parameters[name] = {"value": value, "free": name in found.names}
        if name in found.names:
            low, high = diagnosis.intervals[name]
            parameters[name] |= {"sigma": found[name][1], "lower": low, "upper": high}
    return {
        "presses": len(found.problem.log),
        "status": diagnosis.status,
        "parameters": parameters,
        "chi_square": found.chi_square,
        "freedom": found.freedom,
        "condition": diagnosis.condition,
        "noise": vars(found.problem.noise) | {"words": found.problem.noise.words},
        "friction": found.problem.friction,
        "physics": " and ".join(shape.physics for shape in found.problem.shapes),
        "profiles": [vars(one) for one in diagnosis.profiles],
        "influence": diagnosis.influence.tolist(),
        "doubts": list(diagnosis.doubts),
    }


def _print(summary: dict) -> None:
    from papilla.calibrate.identification.parameters import kind, plain_value

    rows, still = [], []
    for name, one in summary["parameters"].items():
        if not one["free"] and plain_value(name, one["value"]):
            still.append(kind(name))
            continue
        unit = next((unit for key, unit in _UNITS.items() if name.split(".")[0].endswith(key)), "")
        value = f"{one['value']:.4g}"
        rows.append(
            (name, value, f"{unit}  {one['lower']:.4g} to {one['upper']:.4g}" if one["free"] else f"{unit}  held")
        )
    tell(f"{summary['presses']} presses on: {summary['physics']}")
    tell("Values and 95 % intervals:")
    print_table(rows)
    if still:
        tell(f"Held where they start: {', '.join(dict.fromkeys(still))}.")
    tell(f"Noise: {summary['noise']['words']}.")
    tell(f"Status: {summary['status']}.")
    for doubt in summary["doubts"]:
        tell(f"Doubt: {doubt}.")
    if written := [summary[key] for key in ("finger", "report") if key in summary]:
        tell(f"Wrote {', '.join(written)}")
    print_relaxation(summary)
    print_suggestion(summary)


_UNITS = {"_MPa": "MPa", "_modulus": "MPa", "_mm": "mm", "_deg": "deg", "_microstrain": "µε"}
