"""One press by other libraries on the same mesh, and its cost against that of papilla.

Run with `python benchmarks/peers.py` (`--finger`, `--json`), with the extra `peers`; it takes a minute.
"""

import os
import sys
from functools import partial
from pathlib import Path
from typing import Any

import typer

from papilla.cli.options import FingerOption, design_of, grouped
from papilla.cli.output import CommandResult, progress, say, tell
from papilla.cli.speed.measure import FORCES_GF, measure_apart
from papilla.fem.discrete.elements import DEFAULT_ELEMENT
from papilla.mesh import DEFAULT_SIZE_MM, build

sys.path.append(str(Path(__file__).parents[1]))
from benchmarks.presses.peers import missing_peers, run_peers  # noqa: E402


def peers(finger: FingerOption = None) -> CommandResult:
    """Compare the seconds of one press by each installed library with papilla's set-up and 1000 scenes."""
    design = design_of(finger)
    with progress() as shown:
        mesh = build(design, size_mm=DEFAULT_SIZE_MM, progress=shown)
        rows = measure_apart(design, DEFAULT_SIZE_MM, DEFAULT_ELEMENT, FORCES_GF)
        (ours,) = (row.seconds_thousand for row in rows if row.fidelity == "contact")
        pressed = run_peers(design, mesh, threads=os.cpu_count() or 1, progress=shown)
    for sentence in missing_peers():
        say(sentence)
    table = [{**peer.to_json(), "ratio": ours / peer.seconds_one_press} for peer in pressed]
    facts = {"finger": design.name, "size_mm": DEFAULT_SIZE_MM, "seconds_thousand": ours, "peers": table}
    return CommandResult(facts | {"peers_missing": list(missing_peers())}, partial(_print, table))


def _print(table: list[dict[str, Any]]) -> None:
    for row in table:
        tell(
            f"{row['name']}: {row['seconds_one_press']:.2f} s for one press on {DEFAULT_SIZE_MM:g} mm; "
            f"papilla's set-up and 1000 scenes take {row['ratio']:.3g} of it"
        )


def main() -> None:
    """Run the command."""
    app = typer.Typer()
    app.command()(grouped(peers))
    app(standalone_mode=False)


if __name__ == "__main__":
    main()
