"""`papilla bench --estimators`: the wavelength estimators side by side, against the Cramér-Rao bound."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from papilla.cli.output import print_json, progress

if TYPE_CHECKING:
    from papilla.studies.estimators.runner import Comparison


def bench_estimators(only: Sequence[str], seeds: int, as_json: bool) -> None:
    """Compare the estimators whose names contain one of `only` (all without), over `seeds` held-out seeds; print it."""
    from papilla.studies.estimators.runner import compare

    with progress() as shown:
        shown.line("estimators")
        result = compare(only, seeds=seeds, progress=shown.steps)
    if as_json:
        print_json(result.to_json())
    else:
        _print(result)


def _print(result: "Comparison") -> None:
    from rich.console import Console
    from rich.table import Table

    console = Console()
    table = Table(title="RMS error of the wavelength, held-out seeds")
    for title in ("estimator", "scene"):
        table.add_column(title, overflow="fold")
    for title in ("SNR dB", "error %", "median %", "x bound", "> 10 %", "false locks", "error/sigma", "lag ms"):
        table.add_column(title, justify="right")
    for row in result.rows:
        numbers = (100 * row.error, 100 * row.median, row.error / row.bound, row.outliers, row.false_locks)
        texts = [f"{value:.3g}" if value == value else "" for value in (*numbers, row.sigma_ratio, row.lag_ms)]
        table.add_row(row.estimator, row.scene, f"{row.snr_dB:g}", *texts)
    console.print(table)
    costs = Table(title="Steps of the wavelength, late velocity, cost")
    costs.add_column("estimator", overflow="fold")
    steps = list(result.extras[0].settling_ms)
    delays = list(result.extras[0].late)
    for title in (*(f"{step}: ms" for step in steps), *(f"{delay} ms late: %" for delay in delays)):
        costs.add_column(title, justify="right")
    for title in ("us a row", "us an update", "p99.9 us"):
        costs.add_column(title, justify="right")
    for extra in result.extras:
        texts = [f"{median:.0f} ({worst:.0f})" for median, worst in extra.settling_ms.values()]
        texts += [f"{100 * value:.3g}" for value in extra.late.values()]
        costs.add_row(extra.estimator, *texts, *(f"{value:.1f}" for value in extra.cost))
    console.print(costs)
