"""What `papilla calibrate` may do besides: check the calibration on presses of known modulus, and export it to C."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from papilla.cli.options import about
from papilla.cli.output import say, show_table, tell

if TYPE_CHECKING:
    from papilla.calibrate.checking import Check
    from papilla.calibration import Calibration
    from papilla.finger import Finger
    from papilla.logs import PressLog

CHECK_FAILED = 1
MOST_ROWS = 20
"""Presses in the table; the JSON has all."""


def presses_to_check(path: Path | None, design: "Finger", log_map: Path | None) -> "PressLog | None":
    """The presses of a check, of as many gauges as the design has."""
    if path is None:
        return None
    from papilla.errors import InputError
    from papilla.logs import read_presses

    presses = read_presses(path, log_map=log_map)
    if len(design.gauges) != len(presses.gauge_names):
        raise InputError(f"{path} has {len(presses.gauge_names)} gauges, the finger {len(design.gauges)}")
    for note in presses.notes:
        say(f"{path}: {note}")
    return presses


def checked(calibration: "Calibration", presses: "PressLog | None", path: Path | None) -> "Check | None":
    """The presses recovered, if there are any."""
    if presses is None or path is None:
        return None
    from papilla.calibrate.checking import check

    with about(path):
        return check(calibration, presses)


def header_of(calibration: "Calibration", path: Path | None) -> str | None:
    """The C header, if it is asked for."""
    if path is None:
        return None
    from papilla.calibrate.export_c import c_header

    return c_header(calibration)


def print_check(found: "Check", path: Any) -> None:
    """The check as a table: what did not pass first, then the others up to `MOST_ROWS`."""
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
        f"(stated modulus outside the 95 % interval by more than {100 * found.tolerance:g} %)"
    )
