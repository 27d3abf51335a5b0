"""`papilla bench`: speed against error of fidelities, elements and meshes, and compared with other libraries."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from papilla.cli.options import FingerOption, keep_inputs, option
from papilla.cli.output import Answer, plain, progress, say, show_rows, tell
from papilla.units import MS_PER_S, PER_CENT

if TYPE_CHECKING:
    from papilla.studies.bench import Bench

PLOT = "speed_against_error.png"


def bench(
    finger: FingerOption = None,
    short: bool = option(False, "Coarse meshes and few rows.", "--short"),
    estimators: bool = option(False, "Compare the estimators instead.", "--estimators"),
    physics: bool = option(False, "What the press leaves out, effect by effect.", "--physics"),
    out: Path | None = option(None, f"Folder for {PLOT}; the working directory without it."),
) -> Answer:
    """Measure every fidelity, element and mesh: seconds and memory against the difference from the finest mesh, as
    table and plot.

    Each row is measured in a separate process. Other libraries (extra `peers`), if installed, make one press on the
    same mesh. The errors of the fidelities are kept for `papilla press --fidelity auto`, but not by --short. The
    command takes several minutes, mostly for fidelity finite and the finest mesh.
    """
    from papilla.errors import InputError

    if estimators and physics:
        raise InputError("give --estimators or --physics, not both")
    if physics:
        from papilla.cli.bench_physics import bench_physics

        return bench_physics(finger, short)
    if estimators:
        if finger is not None:
            raise InputError("--finger is for the fidelities, not for --estimators")
        from papilla.cli.bench_estimators import bench_estimators

        return bench_estimators(short, out)
    from papilla.fem.pressing.pricing import price
    from papilla.files import check_writable
    from papilla.finger import Finger
    from papilla.studies import bench as study
    from papilla.studies.bench.peers import missing_peers, run_peers
    from papilla.view.price_plot import price_figure
    from papilla.view.style import write_png

    folder = out or Path.cwd()
    plot = folder / PLOT
    keep_inputs([finger], [plot])
    check_writable(folder)
    design = Finger.load(finger or "default")
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
