"""`papilla identify --compare`: tests whether new presses are from the finger that was identified."""

from pathlib import Path

import typer

from papilla.cli.options import about
from papilla.cli.output import print_json, progress, tell
from papilla.errors import InputError

CHANGED = 1
MOST_NAMED = 4
"""Largest number of explanations that are printed; the JSON has all."""


def compare_with(old: Path, log: Path | None, log_map: Path | None, as_json: bool, **given: object) -> None:
    """Compare the presses of a log with a stored identification; exit code 1 means "recalibrate"."""
    if log is None:
        raise InputError("--compare needs the log of the new presses")
    if asked := [name for name, value in given.items() if value]:
        raise InputError(f"--{asked[0].replace('_', '-')} does not go with --compare: the identified design says all")
    from papilla.calibrate.identification import compare
    from papilla.finger import Finger
    from papilla.logs import read_presses

    finger, presses = Finger.load(old), read_presses(log, log_map=log_map)
    with progress() as shown, about(log):
        found = compare(finger, presses, progress=shown.line)
    if as_json:
        shares = ("presses", "chi_square", "freedom", "probability", "same", "verdict")
        changes = [vars(one) | {"words": one.words} for one in found.changes]
        print_json({name: getattr(found, name) for name in shares} | {"changes": changes})
    else:
        tell(f"{found.verdict}.")
        for one in found.changes[:MOST_NAMED] if not found.same else ():
            tell(f"{one.words} would explain {one.chi_square:.3g} of it.")
    if not found.same:
        raise typer.Exit(CHANGED)
