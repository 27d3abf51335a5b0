"""`papilla bench`: speed against error of fidelities, elements and meshes."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from papilla.cli.options import FingerOption, design_of, keep_inputs, option, surface_files
from papilla.cli.output import CommandResult, plain, progress, show_rows, tell
from papilla.core.units import MS_PER_S, PER_CENT

if TYPE_CHECKING:
    from papilla.cli.speed import SpeedBench

PLOT_FILE = "speed_against_error.png"


def bench(
    finger: FingerOption = None,
    short: bool = option(False, "Coarse meshes and few rows.", "--short"),
    out: Path | None = option(None, f"Folder for {PLOT_FILE}; the working directory without it."),
) -> CommandResult:
    """Measure every fidelity, element and mesh: seconds and memory against the difference from the finest mesh, as
    table and plot.

    Each row is measured in a separate process. The errors of the fidelities are kept for `papilla press --fidelity
    auto`, but not by --short. The command takes several minutes, mostly for fidelity finite and the finest mesh.
    """
    from papilla.cli import speed
    from papilla.cli.speed.price_figure import price_figure
    from papilla.core.files import check_writable
    from papilla.fem.pressing.pricing import price
    from papilla.view.style import write_png

    folder = out or Path.cwd()
    plot = folder / PLOT_FILE
    design = design_of(finger)
    keep_inputs([finger, *surface_files(design)], [plot])
    check_writable(folder)
    with progress() as reporter:
        measured = speed.bench(design, speed.SHORT_PLAN if short else speed.FULL_PLAN, progress=reporter)
        if not short:
            price(design, progress=reporter)
    write_png(
        price_figure([bench_row.to_json() for bench_row in measured.rows], measured.default.reference_size_mm), plot
    )
    return CommandResult(measured.to_json() | {"plot": str(plot)}, partial(_print, measured, plot))


def _print(measured: "SpeedBench", plot: Path) -> None:
    heads = ("fidelity", "element", "mm", "unknowns", "set-up s", "ms a scene", "+ 1000 s")
    rows = []
    for row in measured.rows:
        seconds = (row.seconds_setup, MS_PER_S * row.seconds_per_scene, row.seconds_thousand)
        errors = (PER_CENT * error for error in (row.error_sd, row.error_indentation, row.error_area))
        numbers = [*(f"{value:.3g}" for value in seconds), *(f"{error:.2f}" for error in errors)]
        mark = "reference" if row.reference else "*" if row.pareto else ""
        cells = [value.replace("nan", "-") for value in numbers] + [f"{row.peak_memory_MiB:.0f}", mark]
        rows.append([row.fidelity, row.element, f"{row.size_mm:g}", f"{row.dofs:,}", *cells])
    title = f"{plain(measured.finger_name)}: errors in %, worst of 10-100 gf; * on the Pareto front"
    show_rows((*heads, "S_d", "indentation", "area", "MiB", ""), rows, title)
    for line in measured.sentences():
        tell(line)
    tell(f"plot: {plot}")
