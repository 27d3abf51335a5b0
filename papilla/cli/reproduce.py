"""`papilla reproduce`: the published claims beside what papilla finds."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from papilla.cli.output import Stopwatch, plain, print_json, progress, show_table, tell

if TYPE_CHECKING:
    from papilla.studies.reproduce.runner import Result

PAGE = "reproduce.html"
MOST_NOTES = 12
"""Rows in the table up to which each has its note."""


def reproduce(
    only: Annotated[
        str, typer.Option(metavar="TEXT", help="Claims whose key, source, experiment or words hold this text.")
    ] = "",
    out: Annotated[Path | None, typer.Option(help=f"Folder for {PAGE}, with a picture an experiment.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Put what the papers claim beside what papilla finds, one row a claim, with a verdict and what stands behind it.

    All of it takes some minutes, the first time more (meshes and presses are kept); --only is quick.
    """
    from papilla.files import check_writable
    from papilla.studies.reproduce.runner import by_evidence, head, results, summary
    from papilla.studies.runner import fitting_processes

    watch = Stopwatch()
    if out is not None:
        check_writable(out)
    with progress() as shown:
        found = results(only, processes=fitting_processes(), progress=shown.stage)
    if out is not None:
        from papilla.studies.reproduce.page import write_page

        write_page(out / PAGE, found, watch.seconds)
    answers = [answer for result in found for answer in result.answers]
    if as_json:
        rows = [
            answer.to_json() | {"noise": result.experiment.noise, "seeds": result.experiment.seeds}
            for result in found
            for answer in result.answers
        ]
        page = None if out is None else str(out / PAGE)
        counts = {"counts": summary(answers), "reproduced": by_evidence(answers)}
        print_json({"claims": rows, **counts, "seconds": watch.seconds, "page": page})
        return
    _print(found)
    tell(f"{head(answers)}; {watch.seconds:.0f} s")
    if out is not None:
        tell(f"Wrote {out / PAGE}")


def _print(found: "list[Result]") -> None:
    from rich.markup import escape
    from rich.table import Table

    from papilla.studies.reproduce.claim import accepted, number, published

    colors = {"reproduced": "green", "not reproduced": "bold red", "not testable here": "dim"}
    answers = [answer for result in found for answer in result.answers]
    table = Table(padding=(0, 1, 0, 0), box=None)
    table.add_column("", no_wrap=True)
    table.add_column("claim", overflow="fold", ratio=1)
    table.add_column("published", justify="right", overflow="fold", max_width=14)
    table.add_column("papilla", justify="right", no_wrap=True)
    table.add_column("unit", overflow="fold", max_width=14)
    table.add_column("verdict", no_wrap=True)
    table.add_column("evidence", no_wrap=True)
    for answer in answers:
        one = answer.claim
        verdict = f"[{colors[answer.verdict]}]{answer.verdict}[/]"
        words = escape(plain(f"{one.source}: {one.claim}"))
        if len(answers) <= MOST_NOTES:
            why = f" ({one.tolerance})" if one.tolerance else ""
            words += f"\n[dim]accepted: {escape(plain(accepted(answer) + why))}. {escape(plain(answer.note))}\n"
            words += f"{escape(one.test or one.call)}[/]"
        figures = (escape(published(answer)), number(answer.measured), escape(one.unit))
        table.add_row(one.key, words, *figures, verdict, one.evidence)
    show_table(table)
    if len(answers) > MOST_NOTES:
        tell("Notes, tolerances and calls: --only KEY, --json or --out DIR.")
