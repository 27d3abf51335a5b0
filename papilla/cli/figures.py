"""`papilla figures`: the papers' figures, computed."""

from pathlib import Path
from typing import Annotated

import typer

from papilla.cli.output import Stopwatch, print_json, progress, tell


def figures(
    paper: Annotated[str, typer.Option(metavar="NAME", help="Only this paper's, such as 2006; all without it.")] = "",
    out: Annotated[Path, typer.Option(help="Folder for the page, and an SVG and a CSV file a figure.")] = Path(
        "figures"
    ),
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Compute the figures and tables of the papers, each with the printed values as points and its data as CSV.

    The first time takes some minutes; figures are kept, so that the second takes seconds.
    """
    from papilla.files import check_writable
    from papilla.studies.figures.runner import chosen, write
    from papilla.studies.figures.runner import figures as compute
    from papilla.studies.runner import fitting_processes

    watch = Stopwatch()
    chosen(paper)
    check_writable(out)
    with progress() as shown:
        made = compute(paper, processes=fitting_processes(), progress=shown.stage)
    paths = write(out, made, watch.seconds)
    if as_json:
        rows = [
            {
                "paper": one.paper,
                "name": one.figure.name,
                "title": one.figure.title,
                "found": one.picture.found,
                "claims": list(one.figure.claims),
                "svg": str(paths[f"{one.stem}.svg"]),
                "csv": str(paths[f"{one.stem}.csv"]),
            }
            for one in made
        ]
        print_json({"figures": rows, "page": str(paths["page"]), "seconds": watch.seconds})
        return
    for one in made:
        tell(f"{one.paper} {one.figure.name}: {one.figure.title}")
        if one.picture.found:
            tell(f"    {one.picture.found}")
    tell(f"{len(made)} figures in {watch.seconds:.0f} s; wrote {paths['page']} and an SVG and a CSV file each")
