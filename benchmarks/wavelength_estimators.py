"""The wavelength estimators side by side, against the Cramer-Rao bound, on scenes that tuning never saw.

Run with `python benchmarks/wavelength_estimators.py --seeds 6 space bank`: the words select estimators by their names,
none selects all, which takes long. Scenes, measures and estimators are `papilla.studies.estimators`.
"""

import argparse

from rich.console import Console
from rich.table import Table

from papilla.studies.estimators.runner import Comparison, compare


def main() -> None:
    """Compare what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="parts of the estimators' names")
    parser.add_argument("--seeds", type=int, default=2, help="held-out seeds a scene")
    chosen = parser.parse_args()
    show(compare(chosen.names, seeds=chosen.seeds))


def show(result: Comparison) -> None:
    """Print errors, then step times, sensitivity to late velocity, and cost."""
    console = Console(width=140)
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


if __name__ == "__main__":
    main()
