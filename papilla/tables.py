"""Tables of numbers as CSV text: strict reading with the place of each fault, atomic writing at full precision."""

import csv
import difflib
import io
import math
import shutil
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import IO, Any, Self

import numpy as np

from papilla.errors import FileAccessError, FileFormatError, InputError
from papilla.files import reason, replacing

BLOCK = 8192  # Rows that are read at once
CUT_OFF = "the last line has no line end: if the file was cut off, its last number may be too short"
MAX_COLUMNS, MAX_HEADER = 1000, 2**20  # More columns, or characters in the header, are no table of papilla


@dataclass(frozen=True, eq=False)
class Table:
    """Numbers under named columns.

    Parameters
    ----------
    path : where the table was read, for messages.
    columns : name -> (n,) float, an empty cell is NaN; or text, without the spaces around it.
    lines : (n,) int, the line of the file that each row ends on.
    """

    path: Path
    columns: Mapping[str, np.ndarray]
    lines: np.ndarray

    def fault(self, row: int, column: str, problem: str) -> FileFormatError:
        """The error for one cell, naming file, line and column."""
        return FileFormatError(f"{self.path}, line {self.lines[row]}, column {column}: {problem}")

    def __len__(self) -> int:
        return len(self.lines)


class TableReader:
    """The `wanted` columns of a comma-separated table with one header row, block by block and as often as asked for.

    The file is UTF-8 with or without byte order mark; a stream that cannot be read twice is copied to a temporary file.
    Use it as a context manager. names : the wanted columns in the file's order; ignored : the others, whose cells are
    not looked at; words : wanted columns that hold text; notes : what a person should be told of the file, a sentence
    each. Raises `FileAccessError` (missing,
    unreadable) or `FileFormatError` (not UTF-8, no header, more than `MAX_COLUMNS` columns, a column name empty or
    twice).
    """

    def __init__(self, path: str | Path, wanted: Callable[[str], bool], words: tuple[str, ...] = ()):
        self.path, self._words = Path(path), words
        self._raw = _opened(self.path)
        self._text = io.TextIOWrapper(self._raw, encoding="utf-8-sig", newline="")
        try:
            cut_off = _last_byte(self._raw) not in b"\r\n"
            self._header, _ = self._begin()
            _check_header(self.path, self._header)
        except BaseException:
            self._text.close()
            raise
        self._used = [number for number, name in enumerate(self._header) if wanted(name)]
        self.names = tuple(self._header[number] for number in self._used)
        self.ignored = tuple(name for name in self._header if name not in self.names)
        notes = {f"ignored columns: {', '.join(self.ignored)}": bool(self.ignored), CUT_OFF: cut_off}
        self.notes = tuple(note for note, holds in notes.items() if holds)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._text.close()

    def blocks(self, size: int = BLOCK) -> Iterator[Table]:
        """All rows as tables of `size` rows or less, from the first on.

        Empty cells and `nan` become NaN, `inf` stays infinite; what these mean is the caller's business. Raises
        `FileFormatError`, naming line and column: no rows, a row with too few or too many cells, text where a number
        was expected.
        """
        _, rows = self._begin()
        empty = True
        with self._faults(rows):
            while taken := [(row, rows.line_num) for row in islice(rows, size)]:
                if kept := [item for item in taken if item[0]]:
                    empty = False
                    yield self._table(*zip(*kept, strict=True))
        if empty:
            raise FileFormatError(f"{self.path} holds a header but no rows")

    def whole(self) -> Table:
        """All rows as one table; raises what `blocks` raises."""
        blocks = list(self.blocks())
        columns = {name: np.concatenate([block.columns[name] for block in blocks]) for name in self.names}
        lines = np.concatenate([block.lines for block in blocks])
        return Table(self.path, columns, lines)

    def _begin(self) -> tuple[list[str], Any]:
        """The names of the header, and the rows after it."""
        self._text.seek(0)
        rows = csv.reader(self._text, strict=True)
        with self._faults(rows):
            if len(self._text.readline(MAX_HEADER)) == MAX_HEADER:
                raise FileFormatError(f"{self.path}, line 1: longer than {MAX_HEADER} characters; this is no table")
            self._text.seek(0)
            return [name.strip() for name in next(rows, [])], rows

    def _table(self, rows: tuple[list[str], ...], lines: tuple[int, ...]) -> Table:
        width = len(self._header)
        for row, line in zip(rows, lines, strict=True):
            if len(row) != width:
                problem = f"{len(row)} cells where the header has {width} columns"
                raise FileFormatError(f"{self.path}, line {line}: {problem}")
        cells = list(zip(*rows, strict=True))
        columns = {}
        try:
            for name, number in zip(self.names, self._used, strict=True):
                cell = cells[number]
                columns[name] = np.array([one.strip() for one in cell]) if name in self._words else _numbers(cell)
        except ValueError:
            raise self._text_fault(rows, lines) from None
        return Table(self.path, columns, np.array(lines))

    def _text_fault(self, rows: tuple[list[str], ...], lines: tuple[int, ...]) -> FileFormatError:
        """The error for the first used cell that is no number."""
        for row, line in zip(rows, lines, strict=True):
            for number in (one for one in self._used if self._header[one] not in self._words):
                try:
                    _number(row[number])
                except ValueError:
                    place = f"{self.path}, line {line}, column {self._header[number]}"
                    return FileFormatError(f"{place}: expected a number, got {row[number][:40]!r}")
        raise AssertionError("every cell is a number")

    @contextmanager
    def _faults(self, rows: Any) -> Iterator[None]:
        """Errors while reading become errors of this file, with the line."""
        try:
            yield
        except csv.Error as error:
            raise FileFormatError(f"{self.path}, line {rows.line_num}: not readable as CSV ({error})") from error
        except UnicodeDecodeError:
            raise FileFormatError(f"{self.path}, line {self._undecodable()}: not a text file in UTF-8") from None

    def _undecodable(self) -> int:
        """The first line that is not UTF-8."""
        self._raw.seek(0)
        for number, line in enumerate(self._raw, start=1):
            try:
                line.decode()
            except UnicodeDecodeError:
                return number
        raise AssertionError("every line is UTF-8")


@contextmanager
def table_writer(path: str | Path, names: Iterable[str]) -> Iterator[Callable[[Iterable[Any]], None]]:
    """Writes a CSV table block by block: called with one block's columns; the file appears when all is written.

    Floats become the shortest text that reads back bit for bit, NaN an empty cell. Raises `FileAccessError` where the
    file cannot be written.
    """
    with replacing(path) as temporary, open(temporary, "w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(names)
        yield lambda columns: writer.writerows(zip(*map(_texts, columns), strict=True))


def write_table(path: str | Path, columns: Mapping[str, Sequence | np.ndarray]) -> None:
    """Write columns of equal length as CSV, as `table_writer` does; raises `InputError` where the lengths differ."""
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(f"columns of a table must be equally long, got {lengths}")
    with table_writer(path, columns) as write:
        write(columns.values())


def closest(name: str, known: Sequence[str]) -> str | None:
    """The known column name that `name` is probably a slip of, or None."""
    folded = {candidate.lower(): candidate for candidate in known}
    match = difflib.get_close_matches(name.lower(), folded, n=1, cutoff=0.8)
    return folded[match[0]] if match else None


def _texts(values: Sequence | np.ndarray) -> list[str]:
    plain = values.tolist() if isinstance(values, np.ndarray) else values
    return ["" if x != x else float.__repr__(x) if isinstance(x, float) else str(x) for x in plain]


def _opened(path: Path) -> IO[bytes]:
    """The file, to be read as often as needed."""
    try:
        stream: IO[bytes] = open(path, "rb")  # noqa: SIM115
        if not stream.seekable():
            with stream as once:
                stream = tempfile.TemporaryFile()  # noqa: SIM115
                shutil.copyfileobj(once, stream)
    except (OSError, ValueError) as error:
        raise FileAccessError(f"cannot read {path}: {reason(error)}") from error
    return stream


def _last_byte(stream: IO[bytes]) -> bytes:
    """The last byte of a file, b"" of an empty one."""
    size = stream.seek(0, io.SEEK_END)
    stream.seek(max(size - 1, 0))
    return stream.read(1)


def _check_header(path: Path, names: list[str]) -> None:
    if not any(names):
        raise FileFormatError(f"{path} is empty or starts with an empty line; expected a header of column names")
    if len(names) == 1 and any(mark in names[0] for mark in ";\t"):
        raise FileFormatError(f"{path}, line 1: columns must be separated by commas, got {names[0]!r}")
    if len(names) > MAX_COLUMNS:
        raise FileFormatError(f"{path}, line 1: {len(names)} columns; no table of papilla has more than {MAX_COLUMNS}")
    seen: set[str] = set()
    for number, name in enumerate(names, start=1):
        if not name:
            raise FileFormatError(f"{path}, line 1: column {number} has no name")
        if name in seen:
            raise FileFormatError(f"{path}, line 1: column {name} occurs twice")
        seen.add(name)


def _numbers(cells: Sequence[str]) -> np.ndarray:
    """Cells of a column as floats; raises `ValueError`."""
    together = "".join(cells)
    if "_" not in together and together.isascii():
        with suppress(ValueError):
            return np.array(list(map(float, cells)))
    return np.array([_number(cell) for cell in cells])


def _number(cell: str) -> float:
    """A cell as float, NaN where it is empty; Python's 1_000 and digits of other scripts are no numbers of a table."""
    text = cell.strip()
    if "_" in text or not text.isascii():
        raise ValueError
    return float(text) if text else math.nan
