"""All estimators in all scenes, and what they cost.

Run with `python benchmarks/estimator_comparison.py` (`--short`, `--out DIR`, `--json`); it takes some minutes.
"""

import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import typer

from papilla.calibration import Calibration
from papilla.cli.options import DEFAULT_PROCESSES, grouped, option
from papilla.cli.output import CommandResult, progress, show_rows, tell
from papilla.core.files import check_writable
from papilla.core.units import PER_CENT
from papilla.identification.bench import calibrate
from papilla.model.finger import Finger
from papilla.view.style import write_png

sys.path.append(str(Path(__file__).parents[1]))
from benchmarks.estimators.comparison import LONG, SHORT, Row, compare  # noqa: E402
from benchmarks.estimators.cost import Cost, costs  # noqa: E402
from benchmarks.estimators.honesty_figure import honesty_figure  # noqa: E402
from benchmarks.estimators.touches import TouchRow, feel  # noqa: E402

HONESTY_PLOT = "estimators.png"
COST_SECONDS = 4.0
SHORT_REMARK = "; one run per scene is not enough for a verdict"
_WAVELENGTH = {
    "asked %": "asked", "answered %": "answered", "false %": "false", "steady %": "false_steady",
    "settled %": "false_settled",
    "in 2 sigma %": "covered", "error / sigma": "over_sigma", "median %": "median", "> 5 % off: %": "over_5",
    "RMS %": "rms", "x bound": "over_bound", "first right s": "first_right_s", "us": "us",
}  # fmt: skip
_TOUCH = {
    "estimator": "method", "answered %": "answered", "false confident %": "false_confident",
    "in 2 sigma %": "covered", "error / sigma": "over_sigma", "median %": "median", "RMS %": "rms",
    "x bound": "over_bound",
}  # fmt: skip
_COST = {
    "us a row of a block": "block_us", "an update, median": "update_us", "mean": "update_mean_us",
    "p99.9": "update_p999_us", "p99.9 of one run": "loop_p999_us",
}  # fmt: skip


def estimators(
    short: bool = option(False, "One run per scene, without softness, which needs a calibrated finger.", "--short"),
    out: Path | None = option(None, f"Folder for {HONESTY_PLOT}."),
    scene: list[str] | None = option(None, "This scene alone (may be repeated)."),
    method: list[str] | None = option(None, "This estimator alone (may be repeated)."),
) -> CommandResult:
    """Compare the wavelength estimators in every scene and the softness estimators in every touch."""
    if out is not None:
        check_writable(out)
    began = perf_counter()
    calibration: Calibration | None = None
    touches: tuple[TouchRow, ...] = ()
    with progress() as shown:
        if not short:
            finger = Finger.default()
            calibration = calibrate(finger, progress=shown).calibration
        shown("timing")
        priced = costs(calibration, COST_SECONDS / 4 if short else COST_SECONDS)
        shown("scenes")
        plan = replace(SHORT if short else LONG, scenes=tuple(scene or ()), methods=tuple(method or ()))
        rows = compare(plan, workers=DEFAULT_PROCESSES, progress=shown)
        if calibration is not None:
            touches = feel(calibration, finger, progress=shown)
    return answer_of(rows, touches, priced, out, short, perf_counter() - began)


def answer_of(
    rows: Sequence[Row],
    touches: Sequence[TouchRow],
    priced: Sequence[Cost],
    out: Path | None,
    short: bool,
    took_s: float,
) -> CommandResult:
    """The JSON and the tables of all results; the plot is written to a folder, if there is one."""
    if out is not None:
        write_png(honesty_figure([asdict(row) for row in rows]), out / HONESTY_PLOT)
    tables: dict[str, Sequence[Any]] = {"scenes": rows, "softness": touches, "costs": priced}
    facts: dict[str, Any] = {name: [asdict(row) for row in table] for name, table in tables.items()}
    facts |= {"short": short, "plots": [str(out / HONESTY_PLOT)] if out else []}
    last = f"{took_s:.0f} s" + SHORT_REMARK * short
    return CommandResult(facts, partial(_print_estimators, rows, touches, priced, out, last))


def _print_estimators(
    rows: Sequence[Row], touches: Sequence[Any], priced: Sequence[Any], out: Path | None, took: str
) -> None:
    """Print the tables of scenes, touches and costs, and the path of the plot."""
    print_scenes(rows)
    if touches:
        _print_rows("Softness, at the end of a touch; false confident: ok, off by more than 3 sigma and 5 %",
               "disturbed by", touches, "touch", _TOUCH)  # fmt: skip
    _print_rows("What a sample of five gauges costs, in microseconds", "output", priced, "output", _COST)
    tell(took)
    if out is not None:
        tell(f"plot: {out / HONESTY_PLOT}")


def print_scenes(rows: Sequence[Row]) -> None:
    """Print a table of each form of the pipeline, the targets that were missed, and all methods side by side."""
    methods = {row.method: row.kind for row in rows}
    for method in (name for name, kind in methods.items() if kind.startswith("product")):
        _print_rows(method, "scene", [row for row in rows if row.method == method], "scene", _WAVELENGTH)
    for row in rows:
        if row.faults:
            tell(f"missed, {row.method}, {row.scene}: {'; '.join(row.faults)}")
    shown: dict[str, Callable[[Row], str]] = {
        "Median error of the wavelength, %": lambda row: _shown("%", row.median),
        "Answered, and false among these, %": lambda row: f"{_shown('%', row.answered)} {_shown('%', row.false)}",
    }
    for title, cell in shown.items():
        found = {(row.scene, row.method): cell(row) for row in rows}
        scenes = dict.fromkeys(row.scene for row in rows)
        lines = ([scene, *(found[scene, name] for name in methods)] for scene in scenes)
        show_rows(["scene", *methods], lines, title)


def _print_rows(title: str, first: str, rows: Iterable[Any], name: str, columns: dict[str, str]) -> None:
    lines = ([getattr(row, name), *(_shown(head, getattr(row, key)) for head, key in columns.items())] for row in rows)
    show_rows([first, *columns], lines, title)


def _shown(column: str, value: Any) -> str:
    """A number with three digits, in % if its column says so; nothing for NaN, a name unchanged."""
    if isinstance(value, str):
        return value
    return "" if value != value else f"{PER_CENT * value if '%' in column else value:.3g}"


def main() -> None:
    """Run the command."""
    app = typer.Typer()
    app.command()(grouped(estimators))
    app(standalone_mode=False)


if __name__ == "__main__":
    main()
