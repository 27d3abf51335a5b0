"""`papilla verify`: compares papilla with exact solutions, second methods and hard cases."""

from functools import partial
from typing import TYPE_CHECKING, Any

from papilla.cli.options import option
from papilla.cli.output import CHECK_FAILED, CommandResult, progress, say, show_table

if TYPE_CHECKING:
    from papilla.verify import Case


def verify(only: list[str] | None = option(None, "Run this family of cases alone (may be repeated).")) -> CommandResult:
    """Check papilla against closed forms, exact solutions, second methods and hard cases.

    Each case has a bound; exit code 1 means that a case exceeds its bound.
    """
    from papilla.verify import verify as run_families
    from papilla.verify.jobs import fitting_processes

    skipped: list[str] = []
    with progress() as reporter:
        cases = run_families(only or (), processes=fitting_processes(), progress=reporter, skipped=skipped.append)
    for sentence in skipped:
        say(sentence)
    return answer_of(cases, skipped)


def answer_of(cases: "list[Case]", skipped: list[str]) -> CommandResult:
    """The JSON, the table and the exit code of cases and of the families that were skipped."""
    passed = all(case.passed for case in cases)
    facts = {"passed": passed, "cases": [case_keys(case) for case in cases], "skipped": skipped}
    return CommandResult(facts, partial(_print, cases), 0 if passed else CHECK_FAILED)


def case_keys(case: "Case") -> dict[str, Any]:
    """The documented keys of a case, as plain values."""
    plain = {"name": case.what, "measure": case.cause, "error": case.value, "bound": case.bound}
    return plain | {"passed": case.passed, "seconds": case.seconds}


def _print(cases: "list[Case]") -> None:
    from rich.table import Table

    table = Table()
    for title in ("case", "measure"):
        table.add_column(title, overflow="fold")
    for title in ("error", "bound"):
        table.add_column(title, justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    table.add_column("s", justify="right", no_wrap=True)
    for case in cases:
        verdict = "ok" if case.passed else "[bold red]MISSED[/]"
        table.add_row(case.what, case.cause, f"{case.value:.1e}", f"{case.bound:.0e}", verdict, f"{case.seconds:.1f}")
    show_table(table)
    missed = sum(not case.passed for case in cases)
    seconds = sum(case.seconds for case in cases)
    print(f"{len(cases)} cases, {missed} outside their bounds, {seconds:.0f} s")
