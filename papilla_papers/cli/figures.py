"""`papilla figures`: the papers' figures, computed."""

from pathlib import Path
from time import perf_counter

from papilla.cli.options import option
from papilla.cli.output import CommandResult, progress, tell


def figures(
    paper: str = option("", "Only this paper's, such as 2006; all without it.", metavar="NAME"),
    out: Path = option(Path("figures"), "Folder for the page, and an SVG and a CSV file a figure."),
) -> CommandResult:
    """Compute the figures and tables of the papers, each with the printed values as points and its data as CSV.

    The first run takes some minutes; results are kept, so the next one takes seconds.
    """
    from papilla.core.files import check_writable
    from papilla.verify.jobs import fitting_processes
    from papilla_papers.figures.runner import chosen, write
    from papilla_papers.figures.runner import figures as compute

    began = perf_counter()
    chosen(paper)
    check_writable(out)
    with progress() as stages:
        computed = compute(paper, processes=fitting_processes(), progress=stages)
    seconds = perf_counter() - began
    paths = write(out, computed, seconds)
    rows = [
        {
            "paper": drawn.paper,
            "name": drawn.figure.name,
            "title": drawn.figure.title,
            "found": drawn.picture.found,
            "claims": list(drawn.figure.claims),
            "svg": str(paths[f"{drawn.stem}.svg"]),
            "csv": str(paths[f"{drawn.stem}.csv"]),
        }
        for drawn in computed
    ]

    def show() -> None:
        for row in rows:
            tell(f"{row['paper']} {row['name']}: {row['title']}")
            if row["found"]:
                tell(f"    {row['found']}")
        tell(f"{len(computed)} figures in {seconds:.0f} s; wrote {paths['page']} and an SVG and a CSV file each")

    return CommandResult({"figures": rows, "page": str(paths["page"])}, show)
