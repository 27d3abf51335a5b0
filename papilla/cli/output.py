"""Output of a command: one JSON object or a table on stdout; messages and progress on stderr."""

import json
import math
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

from papilla.core import seams
from papilla.core.errors import one_line as plain
from papilla.core.progress import CountedStep

CHECK_FAILED, EXIT_BAD_INPUT, EXIT_INTERNAL, EXIT_INTERRUPTED, BROKEN_PIPE, EXIT_TERMINATED = 1, 2, 70, 130, 141, 143
"""Exit codes besides 0 (done)."""
REPEAT_S = 5.0
"""Seconds after which a long stage reports again, in a pipe or file, that it is running."""

if TYPE_CHECKING:
    from rich.progress import Progress as Bar
    from rich.table import Table


class CommandResult(NamedTuple):
    """Result of a command: plain values for `--json`, the function that prints them for a reader, and the exit code."""

    facts: Mapping[str, Any]
    show: Callable[[], object]
    code: int = 0


class CommandGroup(NamedTuple):
    """Commands of `papilla NAME`, or of `papilla` itself if the name is empty.

    A room or package brings its own with an entry point of the group `BROUGHT_COMMANDS_GROUP`: a module that has them
    as `command_group`.
    """

    name: str
    commands: tuple[Callable[..., CommandResult | None], ...]
    help: str = ""


BROUGHT_COMMANDS_GROUP = "papilla.commands"


def print_json(value: Mapping) -> None:
    """Print exactly one JSON object; NaN and infinities, which JSON does not have, become null."""
    print(json_text(value, ascii_only=not (sys.stdout.encoding or "").lower().startswith("utf")))


def json_text(value: Mapping, ascii_only: bool = True) -> str:
    """One JSON object as text, NaN and infinities as null."""
    text = json.dumps(finite(value), allow_nan=False, ensure_ascii=ascii_only)
    return re.sub("[\x7f-\x9f]", lambda sign: f"\\u{ord(sign[0]):04x}", text)


def say(message: str) -> None:
    """A message for the person at the terminal, on stderr."""
    print(plain(message), file=sys.stderr)


def tell(line: str) -> None:
    """A line of the answer, on stdout."""
    print(plain(line))


def print_table(rows: Sequence[tuple[str, str, str]]) -> None:
    """A table of quantity, value and unit on stdout."""
    from rich.table import Table

    table = Table(show_header=False)
    table.add_column(style="bold")
    table.add_column(justify="right", no_wrap=True)
    table.add_column(style="dim", no_wrap=True)
    show_table(table, rows)


def show_table(table: "Table", rows: Iterable[Sequence[str]] = ()) -> None:
    """Add rows of text to a table, without markup, and print it on stdout, as wide as its `no_wrap` columns need:
    numbers are neither cut nor wrapped."""
    from rich.console import Console
    from rich.measure import Measurement
    from rich.text import Text

    for row_cells in rows:
        table.add_row(*(Text(plain(cell)) for cell in row_cells))
    console = Console()
    options = console.options.update(width=10_000)
    for column in table.columns:
        if column.no_wrap:
            cells = [Measurement.get(console, options, cell).maximum for cell in (column.header, *column.cells)]
            column.min_width = max(cells)
    needed = Measurement.get(console, options, table).minimum
    Console(width=max(console.width, needed)).print(table)


def show_rows(heads: Sequence[str], rows: Iterable[Sequence[str]], title: str | None = None) -> None:
    """Print a table on stdout: the first column has names, the others numbers."""
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text(plain(title or "")), title_justify="left", title_style="bold")
    for number, head in enumerate(heads):
        table.add_column(head, justify="right" if number else "left", no_wrap=True)
    show_table(table, rows)


class ShownProgress:
    """Shows the stage and the progress of a long job: a `Progress`.

    If stderr is not a terminal, a stage (the text before the comma) is named when it begins and every `REPEAT_S` while
    it lasts.
    """

    def __init__(self, bar: "Bar | None") -> None:
        self._bar = bar
        self._task: Any = bar.add_task("", total=None) if bar is not None else None
        self._stage, self._said = "", 0.0

    def __call__(self, stage: str) -> None:
        """Show what is done now, such as "meshing, 3 s", and how many of how many steps are done."""
        if self._bar is not None:
            done, total = (stage.done, stage.total) if isinstance(stage, CountedStep) else (0, 0)
            self._bar.update(self._task, description=plain(stage), completed=done, total=total or None)
            return
        begun, now = stage.split(",")[0], seams.now_s()
        if begun != self._stage or now - self._said >= REPEAT_S:
            self._stage, self._said = begun, now
            say(stage)


@contextmanager
def progress() -> Iterator[ShownProgress]:
    """A `ShownProgress` on stderr during the block; it leaves nothing on the terminal."""
    if not sys.stderr.isatty():
        yield ShownProgress(None)
        return
    from rich import progress as rich_progress
    from rich.console import Console

    columns = (
        rich_progress.SpinnerColumn(),
        rich_progress.TextColumn("{task.description}", markup=False),
        rich_progress.BarColumn(),
        rich_progress.MofNCompleteColumn(),
        rich_progress.TimeElapsedColumn(),
    )
    with rich_progress.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        yield ShownProgress(bar)


def finite(value: Any) -> Any:
    """A value of JSON, with null for NaN and infinities."""
    if isinstance(value, Mapping):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value
