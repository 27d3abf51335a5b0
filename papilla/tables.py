"""Tables of numbers as CSV text: strict reading with the place of each fault, atomic writing at full precision."""

import csv
import difflib
import io
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from papilla.errors import FileAccessError, FileFormatError, InputError
from papilla.files import write_text


@dataclass(frozen=True, eq=False)
class Table:
    """Numbers under named columns.

    Parameters
    ----------
    path : where the table was read, for messages.
    columns : name -> (n,) float; an empty cell is NaN.
    lines : (n,) int, the line of the file that each row ends on.
    ignored : names of the columns that were not asked for; their cells were not looked at.
    ends_open : the last line has no line end: a file that was cut off in its last number looks like that.
    """

    path: Path
    columns: Mapping[str, np.ndarray]
    lines: np.ndarray
    ignored: tuple[str, ...]
    ends_open: bool

    def fault(self, row: int, column: str, problem: str) -> FileFormatError:
        """The error for one cell, naming file, line and column."""
        return FileFormatError(f"{self.path}, line {self.lines[row]}, column {column}: {problem}")

    def __len__(self) -> int:
        return len(self.lines)


def read_table(path, wanted: Callable[[str], bool]) -> Table:
    """Read the `wanted` columns of a comma-separated table with one header row, UTF-8 with or without byte order mark.

    Empty cells and `nan` become NaN, `inf` stays infinite; what these mean is the caller's business. Raises
    `FileAccessError` (missing, unreadable) or `FileFormatError` (not UTF-8, empty, header only, a column name empty or
    twice, a row with too few or too many cells, text where a number was expected), naming line and column.
    """
    path = Path(path)
    text = _decode(path)
    rows = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        names = [name.strip() for name in next(rows, [])]
        _check_header(path, names)
        used = [number for number, name in enumerate(names) if wanted(name)]
        cells: list[list[float]] = []
        lines: list[int] = []
        for row in rows:
            if not row:
                continue
            if len(row) != len(names):
                problem = f"{len(row)} cells where the header has {len(names)} columns"
                raise FileFormatError(f"{path}, line {rows.line_num}: {problem}")
            try:
                cells.append([_number(row[number]) for number in used])
            except ValueError:
                raise _text_fault(path, rows.line_num, names, row, used) from None
            lines.append(rows.line_num)
    except csv.Error as error:
        raise FileFormatError(f"{path}, line {rows.line_num}: not readable as CSV ({error})") from error
    if not cells:
        raise FileFormatError(f"{path} holds a header but no rows")
    values = np.array(cells)
    columns = {names[number]: values[:, i] for i, number in enumerate(used)}
    ignored = tuple(name for name in names if name not in columns)
    return Table(path, columns, np.array(lines), ignored, ends_open=not text.endswith(("\n", "\r")))


def write_table(path, columns: Mapping[str, Sequence | np.ndarray]) -> None:
    """Write columns of equal length as CSV, atomically; floats as the shortest text that reads back bit for bit.

    NaN becomes an empty cell. Raises `InputError` where the lengths differ, `FileAccessError` where the file cannot be
    written.
    """
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(f"columns of a table must be equally long, got {lengths}")
    buffer = io.StringIO(newline="")
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(_texts(values) for values in columns.values()), strict=True))
    write_text(path, buffer.getvalue())


def closest(name: str, known: Sequence[str]) -> str | None:
    """The known column name that `name` is probably a slip of, or None."""
    folded = {candidate.lower(): candidate for candidate in known}
    match = difflib.get_close_matches(name.lower(), folded, n=1, cutoff=0.8)
    return folded[match[0]] if match else None


def _texts(values: Sequence | np.ndarray) -> list[str]:
    return [_text(value) for value in (values.tolist() if isinstance(values, np.ndarray) else values)]


def _text(value) -> str:
    if isinstance(value, float):
        return "" if value != value else float.__repr__(value)
    return str(value)


def _decode(path: Path) -> str:
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {error.strerror}") from error
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise FileFormatError(f"{path}, line {line}: not a text file in UTF-8") from error


def _check_header(path: Path, names: list[str]) -> None:
    if not any(names):
        raise FileFormatError(f"{path} is empty or starts with an empty line; expected a header of column names")
    if len(names) == 1 and any(mark in names[0] for mark in ";\t"):
        raise FileFormatError(f"{path}, line 1: columns must be separated by commas, got {names[0]!r}")
    for number, name in enumerate(names, start=1):
        if not name:
            raise FileFormatError(f"{path}, line 1: column {number} has no name")
        if name in names[: number - 1]:
            raise FileFormatError(f"{path}, line 1: column {name} occurs twice")


def _number(cell: str) -> float:
    return float(cell) if cell and not cell.isspace() else math.nan


def _text_fault(path: Path, line: int, names: list[str], row: list[str], used: list[int]) -> FileFormatError:
    """The error for the first used cell of a row that is no number."""
    for number in used:
        try:
            _number(row[number])
        except ValueError:
            place = f"{path}, line {line}, column {names[number]}"
            return FileFormatError(f"{place}: expected a number, got {row[number][:40]!r}")
    raise AssertionError("every cell of the row is a number")
