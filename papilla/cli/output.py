"""What a command says: one JSON object or a table on stdout; messages and progress on stderr."""

import json
import math
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager


def print_json(value: Mapping) -> None:
    """Print exactly one JSON object; NaN and infinities, which JSON has not, become null."""
    print(json.dumps(_finite(value), allow_nan=False, ensure_ascii=False))


def say(message: str) -> None:
    """A message for the person at the terminal."""
    print(message, file=sys.stderr)


def print_table(rows: Sequence[tuple[str, str, str]]) -> None:
    """A table of quantity, value and unit on stdout."""
    from rich.console import Console
    from rich.table import Table

    table = Table(show_header=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    table.add_column(style="dim")
    for row in rows:
        table.add_row(*row)
    Console().print(table)


class Progress:
    """Shows the stage that a long job is in, and how far it got; `line` and `steps` are handed to the library."""

    def __init__(self, bar) -> None:
        self._bar = bar
        self._task = bar.add_task("", total=None) if bar is not None else None
        self._stage = ""

    def line(self, text: str) -> None:
        """Show one line of text, such as "meshing, 3 s"; away from a terminal each stage is named once."""
        if self._bar is not None:
            self._bar.update(self._task, description=text, total=None)
        elif (stage := text.split(",")[0]) != self._stage:
            self._stage = stage
            say(stage)

    def steps(self, done: int, total: int) -> None:
        """Show that `done` of `total` scenes are done."""
        if self._bar is not None:
            self._bar.update(self._task, completed=done, total=total)


@contextmanager
def progress() -> Iterator[Progress]:
    """A `Progress` on stderr while the block runs; it leaves nothing behind on the terminal."""
    if not sys.stderr.isatty():
        yield Progress(None)
        return
    from rich import progress as rich_progress
    from rich.console import Console

    columns = (
        rich_progress.SpinnerColumn(),
        rich_progress.TextColumn("{task.description}"),
        rich_progress.BarColumn(),
        rich_progress.MofNCompleteColumn(),
        rich_progress.TimeElapsedColumn(),
    )
    with rich_progress.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        yield Progress(bar)


class Stopwatch:
    """Wall-clock seconds since it was made."""

    def __init__(self) -> None:
        self._began = time.perf_counter()

    @property
    def seconds(self) -> float:
        """Seconds so far."""
        return time.perf_counter() - self._began


def _finite(value):
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value
