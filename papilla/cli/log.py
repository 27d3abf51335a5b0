"""`papilla log map`: what the columns of somebody's log seem to be."""

from pathlib import Path
from typing import Annotated

import typer

from papilla.cli.options import JsonOption, keep_inputs
from papilla.cli.output import print_json, say, show_table, tell


def map(
    file: Annotated[Path, typer.Argument(help="Log as a lab writes it (CSV, TSV, .gz).", metavar="FILE")],
    out: Annotated[Path, typer.Option(help="Map to write (TOML); estimate, identify and calibrate take it by --map.")],
    as_json: JsonOption = False,
) -> None:
    """Propose which column of a log is what, in which unit, and why; nothing is read by it before you say so."""
    from rich.table import Table
    from rich.text import Text

    from papilla.cli.output import plain
    from papilla.files import write_text
    from papilla.logs.proposal import propose

    keep_inputs([file], [out])
    found = propose(file)
    write_text(out, found.to_toml())
    if as_json:
        columns = [vars(guess) for guess in found.guesses]
        how = {"delimiter": found.delimiter, "decimal": found.decimal, "header_line": found.header_line}
        print_json({"map": str(out), "columns": columns, "open_questions": list(found.open_questions)} | how)
        return
    table = Table("column", "is", "unit", "because")
    for guess in found.guesses:
        table.add_row(*(Text(plain(cell)) for cell in (guess.name, guess.meant or "-", guess.unit, guess.reason)))
    show_table(table)
    for question in found.open_questions:
        say(question)
    tell(f"Wrote {out}: check it, then give it by --map, or leave it beside the log as log_map.toml")
