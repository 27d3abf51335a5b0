"""`papilla identify` on a log over time: loading alone, the loops, and how the silicone relaxes."""

from pathlib import Path
from typing import TYPE_CHECKING

from papilla.cli.output import print_table, tell
from papilla.errors import InputError

if TYPE_CHECKING:
    from papilla.calibrate.identification import Identification
    from papilla.logs import PressLog


def loops_of(log: "PressLog") -> dict:
    """The loops of a log as plain values; an empty dict if there are none."""
    return {"loops": [vars(one) for one in log.loops]} if log.loops else {}


def relaxation_of(path: Path, found: "Identification", terms: str | None, log_map: Path | None) -> tuple[dict, dict]:
    """Relaxation fitted to the longest touch of a log: its Prony terms as plain values for `--json`, and what the table
    `[identified]` of the design keeps of them. Both are empty without `--relaxation`."""
    from papilla.calibrate.relaxation import fit_touch
    from papilla.logs import read_presses

    if terms is None:
        return {}, {}
    if found.problem.log.stated_sd is not None or len(found.problem.log.specimens) > 1:
        raise InputError(f"{path}: --relaxation needs readings, of presses on one specimen")
    log = read_presses(path, whole=True, mixed=found.problem.shapes[0].specimen, log_map=log_map)
    touch = fit_touch(found, log, int(terms))
    return {"relaxation": touch.to_json()}, touch.recorded


def print_relaxation(summary: dict) -> None:
    """Show the relaxation of a summary."""
    if "relaxation" not in summary:
        return
    fitted = summary["relaxation"]
    tell(f"Relaxation of the silicone, one factor for both layers, by {fitted['by']} on {fitted['modulus_MPa']:g} MPa:")
    print_table(
        [
            (f"term {number}", f"{one['share']:.3g} ± {one['share_sigma']:.2g} at {one['time_s']:.3g}", "s")
            for number, one in enumerate(fitted["terms"], start=1)
        ]
    )
    for doubt in fitted["doubts"]:
        tell(f"Doubt: {doubt}.")
