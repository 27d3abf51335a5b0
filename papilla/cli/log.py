"""`papilla log map`: proposes the meaning of the columns of a foreign log."""

from pathlib import Path
from typing import Any

from papilla.cli.options import argument, keep_inputs, option
from papilla.cli.output import CommandResult, say, show_table, tell


def map(
    file: Path = argument(..., "Log as a lab writes it (CSV, TSV, .gz).", metavar="FILE"),
    out: Path = option(..., "Map to write (TOML); estimate, identify and calibrate take it by --map."),
) -> CommandResult:
    """Propose for each column of a log its meaning and unit, with the reason; no command uses the map before you pass
    it on."""
    from rich.table import Table

    from papilla.core.files import write_text
    from papilla.logs.proposal import propose

    keep_inputs([file], [out])
    proposed = propose(file)
    write_text(out, proposed.to_toml())
    facts: dict[str, Any] = {"map": str(out), "columns": [vars(guess) for guess in proposed.guesses]}
    facts |= {"delimiter": proposed.delimiter, "decimal": proposed.decimal, "header_line": proposed.header_line}

    def show() -> None:
        rows = ((guess.name, guess.meant or "-", guess.unit, guess.reason) for guess in proposed.guesses)
        show_table(Table("column", "is", "unit", "because"), rows)
        for question in proposed.open_questions:
            say(question)
        tell(f"Wrote {out}: check it, then give it by --map, or leave it beside the log as log_map.toml")

    return CommandResult(facts | {"open_questions": list(proposed.open_questions)}, show)
