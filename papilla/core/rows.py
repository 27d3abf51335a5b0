"""Rows of named columns, block by block: what tables, frames, Parquet files and bags have in common."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Self

import numpy as np

from papilla.core.errors import FileFormatError
from papilla.core.memory import refuse_beyond

BLOCK_ROWS = 8192  # Number of rows that are read at once
CELL_BYTES = 40  # Memory of a number in a table that is read as a whole: itself, and four copies at times
LONGEST_CELL = 1000
"""Most characters of a column's name, and of a cell of text: a longer one is an unclosed quote or no table."""


@dataclass(frozen=True, eq=False)
class Table:
    """Numbers under named columns.

    Parameters
    ----------
    path : where the table was read, for messages.
    columns : name -> (n,) float, an empty cell is NaN; or text, without the spaces around it.
    lines : (n,) int, line of the file on which each row ends.
    called : the file's own names of columns, if they differ.
    """

    path: Path
    columns: Mapping[str, np.ndarray]
    lines: np.ndarray
    called: Mapping[str, str] = field(default_factory=dict)

    def fault(self, index: int, column: str, problem: str) -> FileFormatError:
        """The error for one cell, naming file, line and column."""
        place = f"{self.path}, line {self.lines[index]}, column {self.called.get(column, column)}"
        return FileFormatError(f"{place}: {problem}")

    def __len__(self) -> int:
        return len(self.lines)


class Reader(ABC):
    """Rows of named columns, block by block and as often as asked for. A context manager.

    path : of the source, for messages. header : its columns. names : the wanted ones, in the same order; ignored : the
    others. unusable : columns, or topics, that are no numbers, with the reason. notes : for the user, a
    sentence each. called : the source's own names of columns, if they differ. live : whether the rows come once
    (standard input). rows : their number, if it is known beforehand.
    """

    path: Path
    header: list[str]
    names: tuple[str, ...]
    ignored: tuple[str, ...]
    called: Mapping[str, str] = MappingProxyType({})
    unusable: Mapping[str, str] = MappingProxyType({})
    rows: int | None = None
    delimiter, decimal, live = ",", ".", False

    @property
    @abstractmethod
    def notes(self) -> tuple[str, ...]:
        """Remarks for the user, a sentence each."""

    @abstractmethod
    def blocks(self, size: int = BLOCK_ROWS) -> Iterator[Table]:
        """All rows as tables of `size` rows or less, from the first on; raises `FileFormatError`."""

    def want(self, wanted: Callable[[str], bool], words: tuple[str, ...] = ()) -> None:
        """Change which columns are wanted, and which of them hold text."""
        self._words = words
        self.names = tuple(name for name in self.header if wanted(name))
        self.ignored = tuple(name for name in self.header if name not in self.names)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:  # noqa: B027 - most readers hold nothing open
        """Close what is open."""

    def once(self) -> None:  # noqa: B027 - only standard input is read once
        """From now on read standard input once: rows are no longer kept."""

    def check_fits(self) -> None:
        """Raise `MemoryEstimateError` if all rows of the wanted columns are more than the free memory holds."""
        job = f"reading {self.path} ({self.rows} rows, {len(self.names)} columns)"
        refuse_beyond(CELL_BYTES * (self.rows or 0) * len(self.names), job, lambda free: "name fewer columns in a map")

    def whole(self) -> Table:
        """All rows as one table; raises what `blocks` and `check_fits` raise."""
        self.check_fits()
        blocks = list(self.blocks())
        columns = {name: np.concatenate([block.columns[name] for block in blocks]) for name in self.names}
        return replace(blocks[0], columns=columns, lines=np.concatenate([block.lines for block in blocks]))


def check_names(place: str, names: Sequence[str]) -> None:
    """Raise `FileFormatError` for a name that occurs twice, or that is longer than `LONGEST_CELL`."""
    seen: set[str] = set()
    for name in names:
        if len(name) > LONGEST_CELL:
            raise FileFormatError(
                f"{place}: a column's name has {len(name)} characters; at most {LONGEST_CELL} are one"
            )
        if name in seen:
            raise FileFormatError(f"{place}: column {name} occurs twice")
        seen.add(name)


def text_cells(path: Path, name: str, cells: Iterable[object]) -> np.ndarray:
    """Cells of a column as texts without the spaces around them; raises what `check_text` raises."""
    texts = ["" if cell is None else str(cell).strip() for cell in cells]
    check_text(path, name, max(map(len, texts), default=0))
    return np.array(texts)


def check_text(path: Path, name: str, longest: int) -> None:
    """Raise `FileFormatError` for a column with a text of more than `LONGEST_CELL` characters."""
    if longest > LONGEST_CELL:
        raise FileFormatError(f"{path}, column {name}: a text of {longest} characters; at most {LONGEST_CELL} are one")
