"""`papilla bench`: speed against error of fidelities, elements and meshes, and compared with other libraries."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from papilla.cli.options import PROCESSES, FingerOption, design_of, keep_inputs, option, surface_files
from papilla.cli.output import Answer, plain, progress, say, show_rows, tell
from papilla.core.errors import InputError
from papilla.core.units import MS_PER_S, PER_CENT

if TYPE_CHECKING:
    from papilla.calibration import Calibration
    from papilla.cli.speed import Bench
    from benchmarks.estimators.comparison import Row
    from benchmarks.estimators.touches import TouchRow

PLOT, HONESTY_PLOT = "speed_against_error.png", "estimators.png"
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


def bench(
    finger: FingerOption = None,
    short: bool = option(False, "Coarse meshes and few rows.", "--short"),
    estimators: bool = option(False, "Compare the estimators instead.", "--estimators"),
    out: Path | None = option(None, f"Folder for {PLOT}; the working directory without it."),
) -> Answer:
    """Measure every fidelity, element and mesh: seconds and memory against the difference from the finest mesh, as
    table and plot.

    Each row is measured in a separate process. Other libraries (extra `peers`), if installed, make one press on the
    same mesh. The errors of the fidelities are kept for `papilla press --fidelity auto`, but not by --short. The
    command takes several minutes, mostly for fidelity finite and the finest mesh.
    """
    if estimators:
        if finger is not None:
            raise InputError("--finger is for the fidelities, not for --estimators")
        return bench_estimators(short, out)
    from papilla.fem.pressing.pricing import price
    from papilla.core.files import check_writable
    from papilla.cli import speed as study
    from benchmarks.presses.peers import missing_peers, run_peers
    from papilla_papers.study_plots import price_figure
    from papilla.view.style import write_png

    folder = out or Path.cwd()
    plot = folder / PLOT
    design = design_of(finger)
    keep_inputs([finger, *surface_files(design)], [plot])
    check_writable(folder)
    with progress() as shown:
        found = study.bench(design, study.SHORT if short else study.FULL, progress=shown.line)
        if not short:
            price(design, progress=shown.line)
        peers = run_peers(design, found.peer_mesh, threads=found.cores, progress=shown.line)
    for sentence in missing_peers():
        say(sentence)
    write_png(price_figure([row.to_json() for row in found.rows], found.default.reference_size_mm), plot)
    ratios = [{**peer.to_json(), "ratio": found.ratio(peer.seconds_one_press)} for peer in peers]
    facts = found.to_json() | {"peers": ratios, "peers_missing": list(missing_peers()), "plot": str(plot)}
    return Answer(facts, partial(_print, found, ratios, plot))


def _print(found: "Bench", peers: list[dict[str, Any]], plot: Path) -> None:
    heads = ("fidelity", "element", "mm", "unknowns", "set-up s", "ms a scene", "+ 1000 s")
    rows = []
    for row in found.rows:
        seconds = (row.seconds_setup, MS_PER_S * row.seconds_per_scene, row.seconds_thousand)
        errors = (PER_CENT * error for error in (row.error_sd, row.error_indentation, row.error_area))
        numbers = [*(f"{value:.3g}" for value in seconds), *(f"{error:.2f}" for error in errors)]
        mark = "reference" if row.reference else "*" if row.pareto else ""
        cells = [value.replace("nan", "-") for value in numbers] + [f"{row.peak_memory_MiB:.0f}", mark]
        rows.append([row.fidelity, row.element, f"{row.size_mm:g}", f"{row.dofs:,}", *cells])
    title = f"{plain(found.finger_name)}: errors in %, worst of 10-100 gf; * on the Pareto front"
    show_rows((*heads, "S_d", "indentation", "area", "MiB", ""), rows, title)
    for line in found.sentences():
        tell(line)
    for peer in peers:
        tell(
            f"{peer['name']}: {peer['seconds_one_press']:.2f} s for one press on {found.default.size_mm:g} mm; "
            f"papilla's set-up and 1000 scenes take {peer['ratio']:.3g} of it"
        )
    tell(f"plot: {plot}")


def bench_estimators(short: bool, out: Path | None) -> Answer:
    """Compare the wavelength estimators on every scene and the softness estimators on every touch.

    `short` makes one run per scene, and leaves out softness, which needs a calibrated finger. The picture is written to
    the folder `out`. Raises `FileAccessError` before any work if that is not possible.
    """
    from papilla.core.files import check_writable
    from benchmarks.estimators.comparison import LONG, SHORT, compare
    from benchmarks.estimators.cost import costs
    from papilla_papers.study_plots import honesty_figure
    from papilla.view.style import write_png

    if out is not None:
        check_writable(out)
    began = perf_counter()
    calibration: Calibration | None = None
    touches: tuple[TouchRow, ...] = ()
    with progress() as shown:
        if not short:
            from papilla.calibration.fitting.job import calibrate_finger
            from papilla.model.finger import Finger
            from benchmarks.estimators.touches import feel

            finger = Finger.default()
            calibration = calibrate_finger(finger, progress=shown.line).calibration
        shown.line("timing")
        priced = costs(calibration, COST_SECONDS / 4 if short else COST_SECONDS)
        shown.line("scenes")
        rows = compare(SHORT if short else LONG, workers=PROCESSES, progress=shown.steps)
        if calibration is not None:
            touches = feel(calibration, finger, progress=shown.stage)
    if out is not None:
        write_png(honesty_figure([asdict(row) for row in rows]), out / HONESTY_PLOT)
    tables: dict[str, Sequence[Any]] = {"scenes": rows, "softness": touches, "costs": priced}
    facts: dict[str, Any] = {name: [asdict(row) for row in table] for name, table in tables.items()}
    facts |= {"short": short, "plots": [str(out / HONESTY_PLOT)] if out else []}
    last = f"{perf_counter() - began:.0f} s" + SHORT_REMARK * short
    return Answer(facts, partial(_print_estimators, rows, touches, priced, out, last))


def _print_estimators(
    rows: "Sequence[Row]", touches: Sequence[Any], priced: Sequence[Any], out: Path | None, took: str
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


def print_scenes(rows: "Sequence[Row]") -> None:
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
