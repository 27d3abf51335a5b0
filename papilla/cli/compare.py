"""`papilla compare`: designs and calibrations side by side."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from papilla.cli.options import DEFAULT_PROCESSES, FrictionOption, argument, option, read_friction, ready, surface_files
from papilla.cli.output import CommandResult, progress, show_rows, tell
from papilla.core.errors import InputError

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
    if len(candidates) < 2:
        raise InputError("a comparison needs at least two designs or calibrations")
    written = [path for path in (html, csv) if path is not None]
    from papilla.identification.comparison import candidate, write_comparison, write_comparison_table
    from papilla.identification.comparison import compare as side_by_side
    from papilla.model.finger import Finger

    designs = [Finger.load(name) for name in candidates if Path(name).suffix.lower() != ".json"]
    ready([*candidates, *(file for design in designs for file in surface_files(design))], written)
    with progress() as reporter:
        how = {"friction": rubbing, "processes": DEFAULT_PROCESSES, "progress": reporter}
        compared = [candidate(candidate_path, **how) for candidate_path in candidates]
        comparison = side_by_side(compared, reporter)
        if html is not None:
            write_comparison(html, comparison, compared)
        if csv is not None:
            write_comparison_table(csv, comparison)
    domain = {
        "force_N": [float(comparison.force_N[0]), float(comparison.force_N[-1])],
        "modulus_MPa": [float(comparison.modulus_MPa[0]), float(comparison.modulus_MPa[-1])],
    }
    facts = {
        "rows": [candidate_row.to_json() for candidate_row in comparison.rows],
        "domain": domain,
        "verdicts": comparison.verdicts,
    }
    files = {"html": html and str(html), "csv": csv and str(csv)}
    return CommandResult(facts | files, partial(_print, comparison, written))


def _print(comparison: "Comparison", written: list[Path]) -> None:
    """Print the table, the verdicts and the written files."""
    heads = ("", "sigma of E", "identified", "S_d (µε)", "slope", "gauges", "answer (µs)", "press (ms)")
    show_rows(
        heads,
        [
            (
                candidate.name, f"{candidate.sigma:.1%}", f"{candidate.identified:.0%}",
                f"{candidate.sd_microstrain:,.0f}", f"{candidate.slope:.2g}", str(candidate.gauges),
                f"{candidate.answer_us:.0f}", "" if candidate.press_ms is None else f"{candidate.press_ms:.2g}",
            )
            for candidate in comparison.rows
        ],
    )  # fmt: skip
    for sentence in comparison.verdicts:
        tell(sentence)
    if written:
        tell(f"Wrote {', '.join(map(str, written))}")
