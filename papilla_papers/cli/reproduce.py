"""`papilla reproduce`: the published claims compared with the results of papilla."""

from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from papilla.cli.options import option
from papilla.cli.output import CommandResult, plain, progress, show_table, tell

if TYPE_CHECKING:
    from papilla_papers.claims.runner import Result

CLAIMS_PAGE = "reproduce.html"
MOST_NOTES = 12
"""Largest number of rows for which the table shows notes."""


def reproduce(
    only: str = option("", "Claims whose key, source, experiment or words hold this text.", metavar="TEXT"),
    out: Path | None = option(None, f"Folder for {CLAIMS_PAGE}, the page of these claims."),
) -> CommandResult:
    """Compare the papers' claims with the results of papilla: one row per claim, with a verdict and its evidence.

    The whole table takes some minutes, the first time more (meshes and presses are kept); --only is quick.
    """
    from papilla.core.files import check_writable
    from papilla.verify.jobs import fitting_processes
    from papilla_papers.claims.runner import by_evidence, head, results, summary

    began = perf_counter()
    if out is not None:
        check_writable(out)
    with progress() as stages:
        by_experiment = results(only, processes=fitting_processes(), progress=stages)
    seconds = perf_counter() - began
    if out is not None:
        from papilla_papers.claims.page import write_page

        write_page(out / CLAIMS_PAGE, by_experiment, seconds)
    answers = [answer for result in by_experiment for answer in result.answers]
    rows = [
        answer.to_json() | {"noise": result.experiment.noise, "seeds": result.experiment.seeds}
        for result in by_experiment
        for answer in result.answers
    ]
    page = None if out is None else str(out / CLAIMS_PAGE)
    facts = {"claims": rows, "counts": summary(answers), "reproduced": by_evidence(answers), "page": page}
    last = [f"{head(answers)}; {seconds:.0f} s", *([] if page is None else [f"Wrote {page}"])]
    return CommandResult(facts, partial(_print, by_experiment, last))


def _print(by_experiment: "list[Result]", last: list[str]) -> None:
    from rich.markup import escape
    from rich.table import Table

    from papilla_papers.claims.claim import accepted, beside, number, published

    colors = {"reproduced": "green", "not reproduced": "bold red", "not testable here": "dim"}
    answers = [answer for result in by_experiment for answer in result.answers]
    table = Table(padding=(0, 1, 0, 0), box=None)
    table.add_column("", no_wrap=True)
    table.add_column("claim", overflow="fold", ratio=1)
    table.add_column("published", justify="right", overflow="fold", max_width=14)
    table.add_column("papilla", justify="right", no_wrap=True)
    table.add_column("unit", overflow="fold", max_width=14)
    table.add_column("verdict", no_wrap=True)
    table.add_column("evidence", no_wrap=True)
    for answer in answers:
        claim = answer.claim
        verdict = f"[{colors[answer.verdict]}]{answer.verdict}[/]"
        words = escape(plain(f"{claim.source}: {claim.claim}"))
        if len(answers) <= MOST_NOTES:
            why = f" ({claim.tolerance})" if claim.tolerance else ""
            words += f"\n[dim]accepted: {escape(plain(accepted(answer) + why))}. {escape(plain(answer.note))}\n"
            words += f"{escape(plain(aside))}\n" if (aside := beside(answer)) else ""
            words += f"{escape(claim.test or claim.call)}[/]"
        figures = (escape(published(answer)), number(answer.measured), escape(claim.unit))
        table.add_row(claim.key, words, *figures, verdict, claim.evidence)
    show_table(table)
    if len(answers) > MOST_NOTES:
        tell("Notes, tolerances and calls: --only KEY, --json or --out DIR.")
    for line in last:
        tell(line)
