"""`papilla bench --estimators`: share of answers, share of false ones, and errors, as tables, JSON and a picture."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from papilla.cli.output import Answer, Stopwatch, progress, show_rows, tell
from papilla.units import PER_CENT

if TYPE_CHECKING:
    from papilla.calibration import Calibration
    from papilla.studies.estimator_bench.honesty import Row
    from papilla.studies.estimator_bench.touches import TouchRow

WORKERS = 2
PLOT = "estimators.png"
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


def bench_estimators(short: bool, out: Path | None) -> Answer:
    """Compare the wavelength estimators on every scene and the softness estimators on every touch.

    `short` makes one run per scene, and leaves out softness, which needs a calibrated finger. The picture is written to
    the folder `out`. Raises `FileAccessError` before any work if that is not possible.
    """
    from papilla.files import check_writable
    from papilla.studies.estimator_bench.cost import costs
    from papilla.studies.estimator_bench.runner import LONG, SHORT, compare
    from papilla.view.estimator_plots import honesty_figure
    from papilla.view.style import write_png

    if out is not None:
        check_writable(out)
    watch = Stopwatch()
    calibration: Calibration | None = None
    touches: tuple[TouchRow, ...] = ()
    with progress() as shown:
        if not short:
            from papilla.calibrate.job import calibrate_finger
            from papilla.finger import Finger
            from papilla.studies.estimator_bench.touches import feel

            finger = Finger.default()
            calibration = calibrate_finger(finger, progress=shown.line).calibration
        shown.line("timing")
        priced = costs(calibration, COST_SECONDS / 4 if short else COST_SECONDS)
        shown.line("scenes")
        rows = compare(SHORT if short else LONG, workers=WORKERS, progress=shown.steps)
        if calibration is not None:
            touches = feel(calibration, finger, progress=shown.stage)
    if out is not None:
        write_png(honesty_figure([asdict(row) for row in rows]), out / PLOT)
    tables: dict[str, Sequence[Any]] = {"scenes": rows, "softness": touches, "costs": priced}
    facts: dict[str, Any] = {name: [asdict(row) for row in table] for name, table in tables.items()}
    facts |= {"short": short, "plots": [str(out / PLOT)] if out else []}
    return Answer(facts, partial(_show, rows, touches, priced, out, f"{watch.seconds:.0f} s" + SHORT_REMARK * short))


def _show(rows: "Sequence[Row]", touches: Sequence[Any], priced: Sequence[Any], out: Path | None, took: str) -> None:
    """Print the tables of scenes, touches and costs, and the path of the plot."""
    print_scenes(rows)
    if touches:
        _print("Softness, at the end of a touch; false confident: ok, off by more than 3 sigma and 5 %",
               "disturbed by", touches, "touch", _TOUCH)  # fmt: skip
    _print("What a sample of five gauges costs, in microseconds", "output", priced, "output", _COST)
    tell(took)
    if out is not None:
        tell(f"plot: {out / PLOT}")


def print_scenes(rows: "Sequence[Row]") -> None:
    """Print a table of each form of the pipeline, the targets that were missed, and all methods side by side."""
    methods = {row.method: row.kind for row in rows}
    for method in (name for name, kind in methods.items() if kind.startswith("product")):
        _print(method, "scene", [row for row in rows if row.method == method], "scene", _WAVELENGTH)
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


def _print(title: str, first: str, rows: Iterable[Any], name: str, columns: dict[str, str]) -> None:
    lines = ([getattr(row, name), *(_shown(head, getattr(row, key)) for head, key in columns.items())] for row in rows)
    show_rows([first, *columns], lines, title)


def _shown(column: str, value: Any) -> str:
    """A number with three digits, in % if its column says so; nothing for NaN, a name unchanged."""
    if isinstance(value, str):
        return value
    return "" if value != value else f"{PER_CENT * value if '%' in column else value:.3g}"
