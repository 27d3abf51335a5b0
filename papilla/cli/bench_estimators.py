"""`papilla bench --estimators`: the wavelength estimators side by side, as tables, JSON and plots."""

import math
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

from papilla.cli.output import Stopwatch, print_json, progress, say

if TYPE_CHECKING:
    from papilla.studies.estimator_bench.rows import SceneRow
    from papilla.studies.estimator_bench.runner import Comparison
    from papilla.studies.estimator_bench.softness import SoftnessRow
    from papilla.studies.estimator_bench.targets import Verdict
    from papilla.studies.estimator_bench.timing import Cost

WORKERS = 2
DETAIL_DB = 20.0
PIPED_WIDTH = 150
_WORDS = {
    "ratio": "error / bound",
    "error_over_bound": "error / bound",
    "bias_over_bound": "bias / bound",
    "error": "RMS error",
    "median": "median error",
    "aligned": "error, aligned",
    "outliers": "beyond 10 %",
    "sigma_ratio": "error / sigma",
    "lag_ms": "lag",
    "median_ms": "to 5 %, median",
    "block_us": "a row of a block",
    "update_us": "an update",
    "update_p999_us": "an update, p99.9",
    "error_answered": "RMS error",
}
_FRACTIONS = ("error", "median", "aligned", "outliers", "error_answered")


def bench_estimators(short: bool, out: Path | None, as_json: bool) -> None:
    """Compare all estimators of wavelength and softness; PNG plots go to the folder `out`.

    `short` compares a few on two gratings, and leaves softness out, which needs a calibrated finger. Raises
    `FileAccessError` before any work where `out` cannot be written.
    """
    from papilla.files import check_writable
    from papilla.studies.estimator_bench.plan import LONG, SHORT
    from papilla.studies.estimator_bench.runner import compare
    from papilla.studies.estimator_bench.touch import compare_touch

    if out is not None:
        check_writable(out)
    watch = Stopwatch()
    with progress() as shown:
        result = compare(SHORT if short else LONG, workers=WORKERS, progress=shown.stage)
        touch = None if short else compare_touch(shown.line, shown.steps)
    plots = [] if out is None else _write_plots(result, out)
    if as_json:
        tables = result.to_json() | (touch.to_json() if touch else {})
        print_json({"short": short, **tables, "plots": [str(path) for path in plots], "seconds": watch.seconds})
        return
    print_tables(result)
    if touch is not None:
        for table in (_softness(touch.softness), _costs(touch.costs), _targets(touch.targets)):
            _print(*table)
    print(f"{watch.seconds:.0f} s" + ("; --short has too few seeds for a verdict on a target" if short else ""))


def print_tables(result: "Comparison") -> None:
    """Print everything that a comparison found."""
    for title, columns, rows in (
        *_errors(result.scenes),
        _against_bound(result.scenes),
        _behaviour(result.scenes),
        _steps_and_velocity(result),
        _costs(result.costs),
        _likelihood(result),
        _prototypes(result),
        _targets(result.targets),
    ):
        if rows:
            _print(title, columns, rows)


def _write_plots(result: "Comparison", out: Path) -> list[Path]:
    from papilla.view import estimator_plots
    from papilla.view.style import write_png

    paths = []
    for name, figure in estimator_plots.all_plots(result.to_json()).items():
        paths.append(out / f"estimators_{name}.png")
        write_png(figure, paths[-1])
        say(f"wrote {paths[-1]}")
    return paths


def _print(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(title=title, title_justify="left", title_style="bold")
    table.add_column(columns[0], no_wrap=True)
    for column in columns[1:]:
        table.add_column(column, justify="right")
    for row in rows:
        table.add_row(*row)
    Console(width=None if sys.stdout.isatty() else PIPED_WIDTH).print(table)


_Table = tuple[str, Sequence[str], list[Sequence[str]]]
_Cell = Callable[[Any], str]


def _errors(rows: Sequence["SceneRow"]) -> "list[_Table]":
    """A table a scene: RMS error over SNR, and the Cramér-Rao bounds of the declared memories."""
    tables: list[_Table] = []
    for scene in dict.fromkeys(row.scene for row in rows):
        here = [row for row in rows if row.scene == scene]
        levels = sorted({row.snr_dB for row in here}, reverse=True)
        found = {(row.estimator, row.snr_dB): row for row in here}
        lines: list[Sequence[str]] = []
        for name in dict.fromkeys(row.estimator for row in here):
            line = [found.get((name, level)) for level in levels]
            lines.append((name, *("" if row is None else _percent(row.error) for row in line)))
        title = f"RMS error in {scene}, %; no answer counts as 300"
        tables.append((title, ("estimator", *(f"{level:g} dB" for level in levels)), lines))
    return tables


def _listed(title: str, rows: Iterable[Any], columns: Sequence[str], shown: Sequence[str | _Cell]) -> _Table:
    """A line a row: what is `shown` of it, an attribute or what a function makes of it, under each column's name.

    Fractions under a name with a % are in percent.
    """

    def cell(column: str, what: str | _Cell, row: Any) -> str:
        value = what(row) if callable(what) else getattr(row, what)
        if not isinstance(value, float):
            return str(value)
        return _percent(value) if "%" in column else _number(value)

    return title, columns, [[cell(*pair, row) for pair in zip(columns, shown, strict=True)] for row in rows]


def _against_bound(rows: Sequence["SceneRow"]) -> _Table:
    columns = ("estimator", "scene", "RMS %", "median %", "answered %", "RMS of these %", "bound %", "x bound")
    shown = ("estimator", "scene", "error", "median", "answered", "error_answered", "bound", "ratio")
    title = f"Errors at {DETAIL_DB:g} dB, and the Cramer-Rao bound of the declared memory"
    return _listed(title, [row for row in rows if row.snr_dB == DETAIL_DB], columns, shown)


def _behaviour(rows: Sequence["SceneRow"]) -> _Table:
    columns = ("estimator", "scene", "> 10 % off: %", "false locks: % of runs", "error / sigma", "lag ms", "aligned %")
    shown = (
        "estimator",
        "scene",
        "outliers",
        "false_locks",
        "sigma_ratio",
        lambda row: _decimal(row.lag_ms),
        "aligned",
    )
    title = f"Outliers, false locks, stated sigma and lag at {DETAIL_DB:g} dB"
    return _listed(title, [row for row in rows if row.snr_dB == DETAIL_DB], columns, shown)


def _steps_and_velocity(result: "Comparison") -> _Table:
    steps = {(row.estimator, row.from_mm, row.to_mm): row for row in result.steps}
    changes = {(row.estimator, row.delay_ms, row.gain): row for row in result.velocity}
    kinds = list(dict.fromkeys(key[1:] for key in steps))
    wrongs = list(dict.fromkeys(key[1:] for key in changes))
    columns = ["estimator", *(f"{before:g} to {after:g} mm: ms (90 %)" for before, after in kinds)]
    columns += [f"{delay} ms late: %" if gain == 1 else f"x {gain:g}: %" for delay, gain in wrongs]
    lines: list[Sequence[str]] = []
    for name in dict.fromkeys(row.estimator for row in result.steps):
        times = [steps[name, *kind] for kind in kinds]
        errors = [changes[name, *wrong].error for wrong in wrongs]
        lines.append(
            (name, *(f"{row.median_ms:.0f} ({row.p90_ms:.0f})" for row in times), *map(_percent, errors)),
        )
    return "Time to 5 % after a step of the wavelength; error in act1 with a late or wrong velocity", columns, lines


def _costs(costs: Sequence["Cost"]) -> _Table:
    columns = ("estimator", "kernel", "us a row of a block", "us an update, median", "p99.9", "p99.9 of one run")
    shown = ("estimator", "kernel", "block_us", "update_us", "update_p999_us", "loop_p999_us")
    return _listed("What a sample costs, timed while nothing else of the comparison runs", costs, columns, shown)


def _likelihood(result: "Comparison") -> _Table:
    columns = ("scene", "SNR dB", "window s", "scatter of the fit %", "bound %", "ratio", "fits")
    shown = ("scene", "snr_dB", "window_s", "scatter", "bound", "ratio", "fits")
    title = "Is the bound real? Maximum likelihood of whole windows, over many noises"
    return _listed(title, result.likelihood, columns, shown)


def _prototypes(result: "Comparison") -> _Table:
    columns = ("as printed", "scene", "SNR dB", "measure", "prototype", "ours", "ratio", "differs by > 30 %")
    shown = (
        *("estimator", "scene", "snr_dB", lambda row: _WORDS[row.measure]),
        *(lambda row: _measured(row.measure, row.prototype), lambda row: _measured(row.measure, row.ours)),
        *("ratio", lambda row: row.note or "yes" if row.differs else ""),
    )
    return _listed(
        "Published estimators as printed, against prototypes written apart", result.prototypes, columns, shown
    )


def _targets(targets: Sequence["Verdict"]) -> _Table:
    def wanted(row: "Verdict") -> str:
        span = f"{_measured(row.measure, row.low)} ... " if math.isfinite(row.low) else "<= "
        return span + _measured(row.measure, row.high) + " (stretch)" * row.stretch

    columns = ("target", "where", "measure", "wanted", "measured", "")
    shown = (
        *("estimator", "where", lambda row: _WORDS[row.measure], wanted),
        *(lambda row: _measured(row.measure, row.measured), lambda row: "met" if row.met else "[bold red]NOT MET[/]"),
    )
    title = f"Targets: {sum(row.met for row in targets)} of {len(targets)} met"
    return _listed(title, targets, columns, shown)


def _softness(rows: Sequence["SoftnessRow"]) -> _Table:
    """A line for each estimator, place and profile: the median over moduli and noises."""
    columns = ("softness", "readings of", "force", "RMS of ln E %", "x bound", "bias / bound", "error / sigma",
               "in stated 95 %", "answered %")  # fmt: skip
    groups: dict[tuple[str, str, str], list] = {}
    for row in rows:
        groups.setdefault((row.estimator, row.place, row.profile), []).append(row)

    def middle(name: str) -> _Cell:
        return lambda own: median([x for row in own if math.isfinite(x := getattr(row, name))] or [math.nan])

    measures = ("error", "error_over_bound", "bias_over_bound", "sigma_ratio", "coverage", "answered")
    names = [lambda own: own[0].estimator, lambda own: own[0].place, lambda own: own[0].profile]
    title = "Softness: medians over moduli and noises"
    return _listed(title, groups.values(), columns, [*names, *map(middle, measures)])


def _measured(measure: str, value: float) -> str:
    if measure in _FRACTIONS:
        return f"{_percent(value)} %"
    unit = next((unit for ending, unit in (("_ms", " ms"), ("_us", " us")) if measure.endswith(ending)), "")
    return f"{_decimal(value) if measure == 'lag_ms' else _number(value)}{unit}"


def _number(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.3g}"


def _decimal(value: float) -> str:
    return "" if math.isnan(value) else f"{round(value, 2) + 0.0:.2f}"


def _percent(value: float) -> str:
    return _number(100 * value)
