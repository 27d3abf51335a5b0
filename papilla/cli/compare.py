"""`papilla compare`: designs and calibrations side by side."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from papilla.cli.options import DEFAULT_PROCESSES, FrictionOption, argument, option, read_friction, ready, surface_files
from papilla.cli.output import CommandResult, progress, show_rows, tell

if TYPE_CHECKING:
    from papilla.identification.comparison import Comparison


def compare(
    candidates: list[str] = argument(
        ...,
        "Two or more designs (TOML), shipped fingers (default, published) or calibrations (.json).",
        metavar="A B ...",
    ),
    html: Path | None = option(
        None, "Page to write: what is better at what, maps, receptive fields.", metavar="FILE.html"
    ),
    csv: Path | None = option(None, "Table to write.", metavar="FILE.csv"),
    friction: FrictionOption = None,
) -> CommandResult:
    """Compare designs and calibrations: S_d, uncertainty of E, receptive fields, computing time.

    A design is calibrated first, as by papilla calibrate; cached results are used.
    """
    rubbing = read_friction(friction)
    written = [path for path in (html, csv) if path is not None]
    from papilla.identification.comparison import candidate
    from papilla.identification.comparison import compare as side_by_side
    from papilla.model.finger import Finger

    designs = [Finger.load(name) for name in candidates if Path(name).suffix.lower() != ".json"]
    ready([*candidates, *(file for design in designs for file in surface_files(design))], written)
    with progress() as shown:
        how = {"friction": rubbing, "processes": DEFAULT_PROCESSES, "progress": shown}
        found = [candidate(one, **how) for one in candidates]
        comparison = side_by_side(found, shown)
        if written:
            from papilla.identification.comparison import write_comparison, write_comparison_table

            if html is not None:
                write_comparison(html, comparison, found)
            if csv is not None:
                write_comparison_table(csv, comparison)
    domain = {
        "force_N": [float(comparison.force_N[0]), float(comparison.force_N[-1])],
        "modulus_MPa": [float(comparison.modulus_MPa[0]), float(comparison.modulus_MPa[-1])],
    }
    facts = {"rows": [row.to_json() for row in comparison.rows], "domain": domain, "verdicts": comparison.verdicts}
    files = {"html": html and str(html), "csv": csv and str(csv)}
    return CommandResult(facts | files, partial(_print, comparison, written))


def _print(comparison: "Comparison", written: list[Path]) -> None:
    """Print the table, the verdicts and the written files."""
    heads = ("", "sigma of E", "identified", "S_d (µε)", "slope", "gauges", "answer (µs)", "press (ms)")
    show_rows(
        heads,
        [
            (
                row.name, f"{row.sigma:.1%}", f"{row.identified:.0%}", f"{row.sd_microstrain:,.0f}", f"{row.slope:.2g}",
                str(row.gauges), f"{row.answer_us:.0f}", "" if row.press_ms is None else f"{row.press_ms:.2g}",
            )
            for row in comparison.rows
        ],
    )  # fmt: skip
    for sentence in comparison.verdicts:
        tell(sentence)
    if written:
        tell(f"Wrote {', '.join(map(str, written))}")
