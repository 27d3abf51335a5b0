"""Tables of numbers as CSV text: strict reading with the place of each fault, atomic writing at full precision."""

import csv
import difflib
import io
import math
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np

from papilla.core.errors import FileFormatError, InputError
from papilla.core.files import replacing
from papilla.core.outside import repeatable_stream
from papilla.core.pipes import LONGEST_TABLE_LINE, PIPE_NAME, LiveText, ShortLines
from papilla.core.rows import BLOCK_ROWS, Reader, Table, check_names, text_cells

CUT_OFF_MESSAGE = "the last line has no line end: if the file was cut off, its last number may be too short"
DELIMITER_WORDS = {",": "commas", ";": "semicolons", "\t": "tabs", " ": "spaces"}
COMMA_NUMBER = re.compile(r"[-+]?[0-9]*,[0-9]+([eE][-+]?[0-9]+)?")
_AROUND_UNITS, _NUMBER = ' \t\r\n"[]()', re.compile(r"[-+.]*[0-9].*|nan|[-+]?inf", re.IGNORECASE)
MAX_COLUMNS = 1000  # More columns are refused


class TableReader(Reader):
    """The `wanted` columns of a text table with one header row, block by block, as often as needed.

    The file is UTF-8 with or without byte order mark, and may be compressed (.gz). A stream that cannot be read
    twice is copied to a temporary file. Use it as a context manager.

    Parameters
    ----------
    words : wanted columns that hold text.
    delimiter, decimal, header_line : format of the table; None detects it, and `notes` mention it unless it is comma
        and point.
    is_unit : whether a text is a unit. If the first row has such a cell and no number, it is a row of units: a column
        "Fz" with "N" below it is then called "Fz [N]".

    names : the wanted columns in the file's order. ignored : the other columns, which are not read. header : all
    columns.

    Raises `FileAccessError` (missing, unreadable) or `FileFormatError` (not UTF-8, no header, more than `MAX_COLUMNS`
    columns, a column name empty or twice).
    """

    def __init__(
        self,
        path: str | Path,
        wanted: Callable[[str], bool],
        words: tuple[str, ...] = (),
        *,
        delimiter: str | None = None,
        decimal: str | None = None,
        header_line: int = 1,
        is_unit: Callable[[str], bool] = lambda cell: False,
    ):
        self.path, self._skipped = Path(path), header_line - 1
        self.live = self.path == PIPE_NAME
        self._raw: Any = None if self.live else ShortLines(repeatable_stream(self.path), self.path)
        self._text: Any = LiveText() if self.live else io.TextIOWrapper(self._raw, encoding="utf-8-sig", newline="")
        try:
            self._cut_off = self._raw is not None and _last_byte(self._raw) not in b"\r\n"
            self._written, self.delimiter, self.decimal, units = self._dialect(delimiter, decimal, is_unit)
            self._rows_above = 1
            self.header, _ = self._begin()
            _check_header(self.path, self.header, header_line)
            if len(units) == len(self.header):
                self._rows_above = 2
                named = zip(self.header, units, strict=True)
                self.header = [f"{name} [{unit}]" if unit else name for name, unit in named]
        except BaseException:
            self._text.close()
            raise
        self.want(wanted, words)

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks for the user about the file, a sentence each."""
        ignored = f"ignored columns: {', '.join(self.ignored)}" if self.ignored else ""
        return tuple(note for note in (self._written, ignored, CUT_OFF_MESSAGE if self._cut_off else "") if note)

    @property
    def _used(self) -> list[int]:
        """Numbers of the wanted columns."""
        return [self.header.index(name) for name in self.names]

    def __exit__(self, *_error: object) -> None:
        self._text.close()

    def blocks(self, size: int = BLOCK_ROWS) -> Iterator[Table]:
        """All rows as tables of `size` rows or less, from the first on.

        Empty cells and `nan` become NaN, `inf` stays infinite; the caller decides what these mean. Raises
        `FileFormatError`, naming line and column: no rows, a row with too few or too many cells, text where a number
        was expected.
        """
        _, rows = self._begin()
        empty, before = True, rows.line_num + self._skipped
        if self.live:
            chunks: Iterator[list[str]] = iter(())
        else:
            chunks = iter(lambda: list(islice(self._text, size)), [])
        with self._faults(rows, before):
            for lines in chunks:
                numbers = self._plain(lines)
                if numbers is not None:
                    columns = dict(zip(self.names, numbers, strict=True))
                    yield Table(self.path, columns, np.arange(before + 1, before + 1 + len(lines)))
                    empty, before = False, before + len(lines)
                    continue
                # A quoted cell may continue in the next chunk
                rest = chain(lines, self._text) if any('"' in line for line in lines) else lines
                for block in self._careful(csv.reader(rest, delimiter=self.delimiter, strict=True), size, before):
                    empty = False
                    yield block
                before += len(lines)
            if self.live:
                for block in self._careful(rows, size, self._skipped):
                    empty = False
                    yield block
        if empty:
            raise FileFormatError(f"{self.path} holds a header but no rows")

    def _careful(self, rows: Any, size: int, before: int) -> Iterator[Table]:
        """Blocks of rows from `csv.reader`; `before` lines precede its first one."""
        with self._faults(rows, before):
            while taken := [
                (self._whole_row(cells, rows.line_num + before), rows.line_num + before)
                for cells in self._some(rows, size)
            ]:
                if filled := [item for item in taken if item[0]]:
                    yield self._table(*zip(*filled, strict=True))

    def _whole_row(self, cells: list[str], line: int) -> list[str]:
        """A row with a cell for each column, or an empty one; raises `FileFormatError` for another one."""
        if cells and len(cells) != len(self.header):
            problem = f"{len(cells)} cells where the header has {len(self.header)} columns"
            raise FileFormatError(f"{self.path}, line {line}: {problem}")
        return cells

    def _plain(self, lines: list[str]) -> np.ndarray | None:
        """Wanted columns (columns, rows) of lines with a number in each cell, else None.

        NumPy reads twice as fast as `csv.reader`, and suffices for most logs. `_table` handles the rest: empty cells,
        quotes and the place of a fault.
        """
        if self._words or self.decimal == "," or lines[0].count(self.delimiter) + 1 != len(self.header):
            return None
        try:
            numbers = np.loadtxt(lines, delimiter=self.delimiter, comments=None, ndmin=2)
        except ValueError:
            return None
        # NumPy leaves out empty lines
        fits = numbers.shape == (len(lines), len(self.header))
        return np.ascontiguousarray(numbers.T[self._used]) if fits else None

    def once(self) -> None:
        """From now on read standard input once: rows are no longer kept."""
        self._text.once()

    def _some(self, rows: Iterator[list[str]], size: int) -> Iterator[list[str]]:
        """The next rows, at most `size`; from standard input those that are available, at least one."""
        for count, cells in enumerate(rows, 1):
            yield cells
            if count == size or self.live and not self._text.pending():
                return

    def _dialect(
        self, delimiter: str | None, decimal: str | None, is_unit: Callable[[str], bool]
    ) -> tuple[str, str, str, list[str]]:
        """A note on the format, the delimiter and the decimal mark; detected from the first two rows if not given. And
        the units in the row below the header, none if that is a row of numbers."""
        header, first = self._rows_of_text(2)
        if delimiter is None:
            names, cells = (re.sub('"[^"]*"', "", text) for text in (header, first))
            marks = [mark for mark in ",;\t" if mark in names] or [","]
            delimiter = next((mark for mark in marks if names.count(mark) == cells.count(mark)), marks[0])
        units = [cell.strip(_AROUND_UNITS) for cell in first.split(delimiter)]
        if any(map(_NUMBER.fullmatch, units)) or not any(map(is_unit, units)):
            units = []
        else:
            first = self._rows_of_text(3)[-1]
        if decimal is None:
            german = delimiter != "," and any(COMMA_NUMBER.fullmatch(cell.strip()) for cell in first.split(delimiter))
            decimal = "," if german else "."
        notes = [f"cells are separated by {DELIMITER_WORDS[delimiter]}"] if delimiter != "," else []
        notes += ["decimal commas"] if decimal == "," else []
        return ", ".join(notes), delimiter, decimal, units

    def _rows_of_text(self, count: int) -> list[str]:
        """The header and the rows after it, `count` in all, undivided; a quoted cell may have several lines."""
        with self._faults(None):
            self._to_header()
            rows = []
            for _ in range(count):
                text = line = self._text.readline()
                while line and text.count('"') % 2 and len(text) < LONGEST_TABLE_LINE:
                    text += (line := self._text.readline())
                rows.append(text)
        return rows

    def _to_header(self) -> None:
        self._text.seek(0)
        for _ in range(self._skipped):
            if not self._text.readline():
                raise FileFormatError(f"{self.path} ends above line {self._skipped + 1}, where its header should be")

    def _begin(self) -> tuple[list[str], Any]:
        """The names of the header, and the rows after it and after the row of units."""
        self._to_header()
        rows = csv.reader(self._text, delimiter=self.delimiter, strict=True)
        with self._faults(rows, self._skipped):
            names, *_ = (next(rows, []) for _ in range(self._rows_above))
            return [name.strip() for name in names], rows

    def _table(self, rows: tuple[list[str], ...], lines: tuple[int, ...]) -> Table:
        """Rows and their line numbers as a `Table`; raises `FileFormatError` for text in a column of numbers."""
        cells = list(zip(*rows, strict=True))
        columns = {}
        try:
            for name, number in zip(self.names, self._used, strict=True):
                cell = cells[number]
                columns[name] = text_cells(self.path, name, cell) if name in self._words else self._numbers(cell)
        except FileFormatError:
            raise
        except ValueError:
            raise self._text_fault(rows, lines) from None
        return Table(self.path, columns, np.array(lines))

    def _text_fault(self, rows: tuple[list[str], ...], lines: tuple[int, ...]) -> FileFormatError:
        """The error for the first used cell that is not a number."""
        for cells, line in zip(rows, lines, strict=True):
            for number in (index for index in self._used if self.header[index] not in self._words):
                try:
                    _number(self._point(cells[number]))
                except ValueError:
                    place = f"{self.path}, line {line}, column {self.header[number]}"
                    return FileFormatError(f"{place}: expected a number, got {cells[number][:40]!r}")
        raise AssertionError("every cell is a number")

    def _numbers(self, cells: Sequence[str]) -> np.ndarray:
        """Cells of a column as floats; raises `ValueError`."""
        if self.decimal == ",":
            cells = [self._point(cell) for cell in cells]
        together = "".join(cells)
        if "_" not in together and together.isascii():
            with suppress(ValueError):
                return np.array(list(map(float, cells)))
        return np.array([_number(cell) for cell in cells])

    def _point(self, cell: str) -> str:
        """The cell of a number, with a decimal point."""
        if self.decimal == ".":
            return cell
        # With decimal commas a point can only separate thousands, and cannot be distinguished from a decimal point
        return "." + cell if "." in cell else cell.replace(",", ".", 1)

    @contextmanager
    def _faults(self, rows: Any, before: int = 0) -> Iterator[None]:
        """Errors while reading become errors of this file, with the line."""
        try:
            yield
        except csv.Error as error:
            raise FileFormatError(
                f"{self.path}, line {rows.line_num + before}: not readable as CSV ({error})"
            ) from error
        except UnicodeDecodeError:
            line = self._raw.line_without_text() if self._raw else 0
            raise FileFormatError(f"{self.path}, line {line}: not a text file in UTF-8") from None


@contextmanager
def table_writer(path: str | Path, names: Iterable[str]) -> Iterator[Callable[[Iterable[Any]], None]]:
    """Yields a function that writes one block of columns to a CSV table; the file appears when all blocks are written.

    Floats are written as the shortest text that reads back bit for bit, NaN as an empty cell. Raises `FileAccessError`
    if the file cannot be written. `-` is standard output, which gets each block at once.
    """
    if Path(path) == PIPE_NAME:
        writer = csv.writer(sys.stdout, lineterminator="\n")
        writer.writerow(names)

        def write(columns: Iterable[Any]) -> None:
            writer.writerows(zip(*map(_cells, columns), strict=True))
            sys.stdout.flush()

        yield write
        return
    with replacing(path) as temporary, open(temporary, "w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(names)
        yield lambda columns: writer.writerows(zip(*map(_cells, columns), strict=True))


def write_table(path: str | Path, columns: Mapping[str, Sequence | np.ndarray]) -> None:
    """Write columns of equal length as CSV, as `table_writer` does; raises `InputError` where the lengths differ."""
    lengths = {name: len(values) for name, values in columns.items()}
    if len(set(lengths.values())) > 1:
        raise InputError(f"columns of a table must be equally long, got {lengths}")
    with table_writer(path, columns) as write:
        write(columns.values())


def closest(name: str, names: Sequence[str]) -> str | None:
    """The known column name that `name` is probably a misspelling of, or None."""
    folded = {candidate.lower(): candidate for candidate in names}
    match = difflib.get_close_matches(name.lower(), folded, n=1, cutoff=0.8)
    return folded[match[0]] if match else None


def _cells(values: Sequence | np.ndarray) -> Sequence:
    """Values as `csv.writer` writes them: a float as the shortest text that reads back bit for bit, None as nothing."""
    if isinstance(values, np.ndarray) and values.dtype.kind == "f":
        absent = np.isnan(values)
        if absent.all():
            return [None] * len(values)
        cells = values.astype(object)
        cells[absent] = None
        return cells.tolist()
    plain = values.tolist() if isinstance(values, np.ndarray) else values
    return [None if x != x else x for x in plain]


def _last_byte(stream: ShortLines) -> bytes:
    """The last byte of a file, b"" for an empty one."""
    size = stream.seek(0, io.SEEK_END)
    stream.seek(max(size - 1, 0))
    return stream.read(1)


def _check_header(path: Path, names: list[str], line: int) -> None:
    """Raise `FileFormatError` for a header without names, with too many, or with one that is empty or occurs twice."""
    if not any(names):
        begins = "starts with an empty line" if line == 1 else f"has nothing in line {line}"
        raise FileFormatError(f"{path} is empty or {begins}; expected a header of column names")
    if len(names) > MAX_COLUMNS:
        raise FileFormatError(
            f"{path}, line {line}: {len(names)} columns; no table of papilla has more than {MAX_COLUMNS}"
        )
    if "" in names:
        raise FileFormatError(f"{path}, line {line}: column {names.index('') + 1} has no name")
    check_names(f"{path}, line {line}", names)


def _number(cell: str) -> float:
    """A cell as float, NaN if it is empty; Python's 1_000 and digits of other scripts are not accepted."""
    text = cell.strip()
    if "_" in text or not text.isascii():
        raise ValueError
    return float(text) if text else math.nan
