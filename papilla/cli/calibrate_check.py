"""Output of `papilla calibrate --check`: which presses of known modulus are recovered."""

from typing import TYPE_CHECKING, Any

from papilla.cli.output import show_table, tell
from papilla.units import PER_CENT

if TYPE_CHECKING:
    from papilla.calibrate.checking import Check

CHECK_FAILED = 1
MOST_ROWS = 20
"""Largest number of presses in the table; the JSON has all."""


def print_check(found: "Check", path: Any) -> None:
    """Print the check as a table: failed presses first, then others up to `MOST_ROWS`."""
    from rich.table import Table

    table = Table(title=f"check: {path}")
    for title in ("force N", "stated MPa", "recovered MPa", "95 % interval MPa"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("", overflow="fold")
    rows = sorted(found.presses, key=lambda one: one.passed)
    for one in rows[:MOST_ROWS]:
        recovered = f"{one.recovered_MPa:.4g} ± {one.sigma_MPa:.2g}" if one.recovered_MPa == one.recovered_MPa else "-"
        verdict = one.sentence if one.passed else f"[bold red]MISSED[/]: {one.sentence}"
        interval = f"{one.lower_MPa:.3g} to {one.upper_MPa:.3g}"
        table.add_row(f"{one.force_N:.4g}", f"{one.modulus_MPa:.4g}", recovered, interval, verdict)
    show_table(table)
    tell(
        f"{len(rows)} presses, {found.answered} with a modulus, {found.missed} missed "
        f"(stated modulus outside the 95 % interval by more than {PER_CENT * found.tolerance:g} %)"
    )
