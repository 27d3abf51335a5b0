"""`papilla calibrate`: the main job, from a design file or a bench log to calibration coefficients."""

import math
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Literal

from papilla.cli import options
from papilla.cli.options import option
from papilla.cli.output import CHECK_FAILED, CommandResult, plain, print_table, progress, show_table, tell
from papilla.core.checks import positive
from papilla.core.errors import InputError
from papilla.core.progress import Progress
from papilla.core.units import PER_CENT

if TYPE_CHECKING:
    from papilla.calibration.fitting.checking import Check, Recovery
    from papilla.calibration.fitting.job import Calibrated
    from papilla.logs import PressLog
    from papilla.model.finger import Finger
    from papilla.model.specimen import Friction

DEFAULT_OUT = Path("calibration")
_OPTIONS = {"forces": "force-range (N)", "moduli": "moduli (MPa)"}
MOST_PRINTED_PRESSES = 20
"""Largest number of presses in the table; the JSON has all."""


@dataclass(frozen=True)
class SweepOptions:
    """Range and specimens of the sweep."""

    specimen: Literal["block", "half-space"] = option("block", "What the sweep presses on.")
    thickness: float | None = option(
        None, "Thickness of the blocks, mm.  [default: the bench's of the finger, else 10]"
    )
    force_range: tuple[float, float] | None = option(
        None,
        "Least and largest force, N.  [default: 0.05 1 for the default finger, in proportion for others]",
        metavar="LO HI",
    )
    moduli: str | None = option(
        None,
        "Moduli, MPa, with commas; two are the ends of a range.  [default: 0.02,5, in proportion to the finger]",
        metavar="E,E,..",
    )
    quick: bool = option(
        False, "Fewer presses, one other mesh, no comparison with finite strain; the notes say so.", "--quick"
    )

    def bench_of(self, design: "Finger") -> "Finger":
        """The design with these specimens; raises `InputError`."""
        if self.specimen == "half-space":
            if self.thickness is not None:
                raise InputError("--thickness is for a block, not for a half-space")
            return replace(design, bench=replace(design.bench, thickness=math.inf))
        if self.thickness is None:
            return design
        return replace(design, bench=replace(design.bench, thickness=positive("--thickness (mm)", self.thickness)))

    def table(self, design: "Finger") -> dict[str, Any]:
        """Forces, moduli and `quick` as arguments of `calibrate_finger` for a design; raises `InputError`."""
        import numpy as np

        from papilla.calibration.fitting.job import QUICK_FORCES, QUICK_MODULI
        from papilla.calibration.fitting.sweep import CalibrationRanges

        chosen_by, ranges = {"forces": self.force_range, "moduli": self._moduli()}, CalibrationRanges.of(design)
        usual = {"forces": ranges.forces, "moduli": ranges.moduli}
        counts = {"forces": QUICK_FORCES, "moduli": QUICK_MODULI} if self.quick else {}
        table: dict[str, Any] = {"quick": self.quick}
        for name, values in usual.items():
            chosen = chosen_by[name] or (values[0], values[-1])
            if len(chosen) > 2:
                table[name] = chosen
            elif chosen_by[name] or self.quick:
                low, high = (positive(f"--{_OPTIONS[name]}", value) for value in chosen)
                if low >= high:
                    raise InputError(f"--{_OPTIONS[name]} must rise, got {low:g} and {high:g}")
                table[name] = tuple(np.geomspace(low, high, counts.get(name, len(values))).tolist())
        return table

    def _moduli(self) -> tuple[float, ...] | None:
        if self.moduli is None:
            return None
        moduli = tuple(sorted(options.moduli_of(self.moduli)))
        if len(moduli) < 2:
            raise InputError("--moduli needs the two ends of a range, or three or more moduli")
        return moduli


def calibrate(
    swept: SweepOptions,
    finger: options.FingerOption = None,
    bench: Path | None = option(None, "Identify the finger from this log of real presses (CSV), and calibrate it."),
    friction: options.FrictionOption = None,
    size_mm: options.SizeOption = None,
    check: Path | None = option(
        None,
        "Recover these presses of known modulus (columns as in a bench log); exit code 1 where one is not.",
        metavar="PRESSES.csv",
    ),
    export_c: Path | None = option(
        None, "Write modulus and sigma as C code with five coefficients, for a microcontroller.", metavar="FILE.h"
    ),
    log_map: options.MapOption = None,
    out: Path = option(DEFAULT_OUT, "Folder for the results."),
) -> CommandResult:
    """Calibrate the finger: mesh, model, sweep, fit.

    Writes calibration.json, sweep.csv and report.html. Exit code 1 says that a press of --check was not recovered, or
    that intervals had to become more than three times as wide to hold the moduli of presses at finite strain.

    The table "shape" of a design names three closed surface files beside it, as papilla/data/surfaces_finger.toml does:
    kind = "surfaces", outer_file = "skin.stl", interface_file = "interface.stl", bone_file = "bone.stl"
    """
    began = perf_counter()
    if size_mm is not None:
        positive("--size-mm", size_mm)
    rubbing = options.read_friction(friction)
    if bench is not None and swept.specimen != "block":
        raise InputError("--bench identifies a finger from presses on blocks: leave out --specimen half-space")
    from papilla.core.files import check_writable, write_text

    paths = {"calibration": out / "calibration.json", "sweep": out / "sweep.csv", "report": out / "report.html"}
    paths |= {} if bench is None else {"finger": out / "finger.toml"}
    written = [*paths.values(), *([export_c] if export_c else [])]
    design = swept.bench_of(options.design_of(finger))
    options.keep_inputs([finger, *options.surface_files(design), bench, check, log_map], written)
    table = swept.table(design)
    log = None if bench is None else options.read_press_log(bench, False, sd_alone=True, log_map=log_map)
    presses = None if check is None else options.read_press_log(check, True, sd_alone=True, log_map=log_map)
    if presses is not None and presses.stated_sd is None and len(design.gauges) != len(presses.gauge_names):
        raise InputError(f"{check} has {len(presses.gauge_names)} gauges, the finger {len(design.gauges)}")
    if log is None:
        check_writable(out)
    if export_c is not None:
        check_writable(export_c.parent)

    with progress() as reporter:
        with options.about(bench):
            calibrated = _calibrated(log, design, rubbing, size_mm, reporter, table)
        check_writable(out)
        from papilla.calibration import c_header
        from papilla.calibration import check as recovered

        checked = None
        if presses is not None:
            with options.about(check):
                checked = recovered(calibrated.calibration, presses)
        header = None if export_c is None else c_header(calibrated.calibration)
        _write(calibrated, design, paths, perf_counter() - began, reporter)
        if export_c is not None and header is not None:
            write_text(export_c, header)
    more = {"export_c": export_c and str(export_c), "check": checked and checked.to_json()}
    summary = _summary(calibrated, paths, perf_counter() - began) | more
    failed = (checked is not None and not checked.passed) or calibrated.failed
    code = CHECK_FAILED if failed else 0
    return CommandResult(summary, partial(_print, summary, checked, check), code)


def _calibrated(
    log: "PressLog | None",
    design: "Finger",
    rubbing: "Friction | None",
    size_mm: float | None,
    reporter: Progress,
    table: dict[str, Any],
) -> "Calibrated":
    """The calibration of a design, or of the finger that made the presses of a log."""
    from papilla.identification.bench import calibrate as calibrate_design
    from papilla.identification.bench import calibrate_bench

    how: Any = {"friction": rubbing, "size_mm": size_mm, "processes": options.DEFAULT_PROCESSES, **table}
    how |= {"progress": reporter}
    if log is None:
        return calibrate_design(design, **how)
    return calibrate_bench(log, design, **how)


def _write(
    calibrated: "Calibrated", finger: "Finger", paths: dict[str, Path], seconds: float, reporter: Progress
) -> None:
    """Write all results, or none."""
    from papilla.calibration.fitting.page import write_report
    from papilla.core.files import replacing_set

    if calibrated.bench is not None:
        finger = calibrated.bench.finger
    with replacing_set(list(paths.values())) as (calibration, sweep, report, *identified):
        calibrated.calibration.save(calibration)
        calibrated.presses.to_csv(sweep)
        write_report(report, calibrated, finger, seconds=seconds, progress=reporter)
        for path in identified:
            finger.save(path)


def _summary(calibrated: "Calibrated", paths: dict[str, Path], seconds: float) -> dict:
    from papilla.calibration.document import to_document
    from papilla.calibration.fitting.sweep import CalibrationRanges

    softness = to_document(calibrated.calibration)["softness"]
    return {
        **{name: str(path) for name, path in paths.items()},
        "presses": len(calibrated.presses),
        "softness": {name: softness.get(name) for name in ("forward", "inverse", "compact")},
        **_errors_of(calibrated.recovery),
        "checked_presses": len(calibrated.recovery.error),
        "checked": CalibrationRanges.recorded(calibrated.calibration.finger).checked_in_words,
        "bench": _of_the_bench(calibrated),
        "published": _against_published(calibrated),
        "truth": calibrated.truth and calibrated.truth.to_json(),
        "widening": calibrated.widening,
        "physics": calibrated.presses.physics,
        "dominant": calibrated.calibration.dominant,
        "sigmas": calibrated.calibration.sigmas,
        "notes": list(calibrated.calibration.notes),
        "seconds": seconds,
    }


def _of_the_bench(calibrated: "Calibrated") -> dict | None:
    """The identified finger, and the moduli of the measured presses recovered by its calibration."""
    if calibrated.bench is None:
        return None
    from papilla.cli.identify import summary_of

    identified = summary_of(calibrated.bench.found, calibrated.bench.diagnosis)
    return identified | _errors_of(calibrated.bench.recovery) | {"inside_interval": int(calibrated.bench.inside.sum())}


def _errors_of(recovery: "Recovery") -> dict:
    """Errors of recovered moduli, and the number of presses without one."""
    unanswered = len(recovery.error) - recovery.answered
    return {"max_error": recovery.max_error, "rms_error": recovery.rms_error, "unanswered": unanswered}


def _against_published(calibrated: "Calibrated") -> dict | None:
    """Difference of the calibration from regression (9), up to one scale factor, and of its finger from published
    depths."""
    from dataclasses import asdict

    from papilla.calibration.published import covered_comparison

    comparison = covered_comparison(calibrated.calibration.predict)
    if comparison is None:
        return None
    return {
        "scale": comparison.scale,
        "rms": comparison.relative_rms,
        "rms_30_100_gf": comparison.heavy_rms,
        "press_rms": comparison.press_rms,
        "press_rms_30_100_gf": comparison.heavy_press_rms,
        "depths": [{**asdict(depth), "error": depth.error} for depth in calibrated.depths],
    }


def _print(summary: dict, verdict: "Check | None", check: Path | None) -> None:
    forward, inverse = summary["softness"]["forward"], summary["softness"]["inverse"]
    units = ("µε/gf²", "µε/gf", "µε/MPa²", "µε/MPa", "µε")
    errors = [float("nan") if error is None else error for error in forward["stderr"]]
    coefficients = zip("abcde", forward["coefficients"], errors, units, strict=True)
    answered = f"%, {summary['checked_presses'] - summary['unanswered']} of {summary['checked_presses']} answered"
    if summary["widening"] > 1:
        tell(
            f"In doubt: one sigma of S_d is {summary['widening']:.2g} times as large as its parts say, because the "
            "intervals held too few of the presses at finite strain."
        )
    tell(f"{summary['presses']} presses; S_d = a f² + b f + c E² + d E + e, with f in gf and E in MPa:")
    print_table(
        [
            *((letter, f"{value:.6g} ± {error:.2g}", unit) for letter, value, error, unit in coefficients),
            ("error of E, max", _percent(summary["max_error"]), answered),
            ("error of E, rms", _percent(summary["rms_error"]), answered),
            ("time", f"{summary['seconds']:.1f}", "s"),
        ]
    )
    tell(_inverse_in_words(inverse))
    if bench := summary["bench"]:
        tell(f"The finger: {bench['status']}; moduli {_moduli(bench)} MPa.")
        answered_of = f"{bench['presses'] - bench['unanswered']} of {bench['presses']} answered"
        worst, rms = (_percent(bench[key]) for key in ("max_error", "rms_error"))
        tell(
            f"Error of E of the measured presses: {worst} % at most, {rms} % rms, {answered_of}; "
            f"the 95 % interval holds it for {bench['inside_interval']}."
        )
    checked = f"{summary['checked_presses']} presses over {summary['checked']}"
    if compact := summary["softness"]["compact"]:
        tell(
            f"Five coefficients (softness.compact; --export-c writes them as C) give moduli that differ from the "
            f"surface's by {compact['rms']:.1%} rms, {compact['max']:.0%} at most, over "
            f"{compact['modulus_MPa'][0]:g}-{compact['modulus_MPa'][1]:g} MPa."
        )
    tell(f"Error of E: of the surface's answer to {checked}, {summary['unanswered']} of them unanswered.")
    if published := summary["published"]:
        loads, presses = (
            [_percent(published[f"{name}{loads_key}"]) for loads_key in ("", "_30_100_gf")]
            for name in ("rms", "press_rms")
        )
        tell(
            f"Published regression (9), one scale factor: rms error {loads[0]} % of its rms over 10-100 gf, "
            f"{loads[1]} % over 30-100 gf; press by press {presses[0]} and {presses[1]} %."
        )
    if truth := summary["truth"]:
        of_sd, of_modulus = truth["sd_max_error"], truth["max_error"]
        parts = (
            f"friction {name} {_percent(of_sd[name])} % of S_d, {_percent(of_modulus[name])} % of E" for name in of_sd
        )
        tell(f"Off {truth['presses']} presses at finite strain on a mesh it never saw by at most: {'; '.join(parts)}.")
        tell(f"The 95 % interval of E holds {_percent(truth['inside_interval'])} % of their moduli.")
    tell(f"Pressed on: {summary['physics']}")
    shares = ", ".join(f"{name} {_percent(sigma)} %" for name, sigma in summary["sigmas"].items() if sigma)
    tell(f"dominant: {summary['dominant']} (one sigma of S_d: {shares}).")
    for note in summary["notes"]:
        tell(f"Doubt: {note}.")
    names = ("calibration", "sweep", "report", "finger")
    tell("Wrote " + ", ".join(summary[name] for name in names if name in summary))
    if verdict is not None:
        _print_check(verdict, check)


def _moduli(bench: dict) -> str:
    layers = (bench["parameters"][f"{layer}_modulus_MPa"] for layer in ("outer", "inner"))
    return ", ".join(
        f"{modulus['value']:.3g} ({modulus['lower']:.3g} to {modulus['upper']:.3g})"
        if modulus["free"]
        else f"{modulus['value']:.3g} (held)"
        for modulus in layers
    )


def _percent(share: float | None) -> str:
    return "none" if share is None or share != share else f"{PER_CENT * share:.3g}"


def _inverse_in_words(inverse: dict) -> str:
    if inverse["modulus_MPa"] is None:
        return "The quadratic nowhere rises with E: it has no inverse."
    sd, f2, f, offset = inverse["coefficients"]
    sign = "-" if inverse["branch"] < 0 else ""
    low, high = inverse["modulus_MPa"]
    root = f"E = {sign}sqrt({sd:.4g} S_d {f2:+.4g} f² {f:+.4g} f {offset:+.4g}) {-inverse['shift']:+.4g}"
    return f"Inverse: {root}, where it rises: {low:.3g} to {high:.3g} MPa (full precision in the file)."


def _print_check(checked: "Check", path: Any) -> None:
    """Print the check as a table: failed presses first, then others up to `MOST_PRINTED_PRESSES`."""
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text(plain(f"check: {path}"), style="table.title"))
    for title in ("force N", "stated MPa", "recovered MPa", "95 % interval MPa"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("", overflow="fold")
    rows = sorted(checked.presses, key=lambda press: press.passed)
    for press in rows[:MOST_PRINTED_PRESSES]:
        recovered = (
            f"{press.recovered_MPa:.4g} ± {press.sigma_MPa:.2g}" if press.recovered_MPa == press.recovered_MPa else "-"
        )
        verdict = press.sentence if press.passed else f"[bold red]MISSED[/]: {press.sentence}"
        interval = f"{press.lower_MPa:.3g} to {press.upper_MPa:.3g}"
        table.add_row(f"{press.force_N:.4g}", f"{press.modulus_MPa:.4g}", recovered, interval, verdict)
    show_table(table)
    tell(
        f"{len(rows)} presses, {checked.answered} with a modulus, {checked.missed} missed "
        f"(stated modulus outside the 95 % interval by more than {PER_CENT * checked.tolerance:g} %)"
    )
