"""Opens a log: its known columns, read as they are or through a map, with papilla's names and units.

All logs share gauges `g1`, `g2`, ... in microstrain, and named quantities with their unit in the name.
"""

import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from papilla.core.errors import FileFormatError
from papilla.core.rows import BLOCK_ROWS, Reader, Table
from papilla.core.tables import TableReader, closest
from papilla.logs.bags import BagReader
from papilla.logs.frames import PARQUET_SUFFIXES, FrameReader
from papilla.logs.log_map import GAUGE_COLUMN, ISO_TIME, Column, LogMap, column_meant, is_unit, quantity_of, split_unit
from papilla.logs.parquet import ParquetReader

TORQUE_COLUMN = "torque_Nmm"
"""Torque about an axis parallel to y, from a sensor at the base. Divided by the distance of the axis from the skin it
gives the tangential force."""
SD_ALONE = (
    "S_d alone does not determine gain, lever and zero of a gauge: add the readings that it was computed from, in "
    "microstrain. What all gauges have in common papilla identify finds from S_d, too; "
    "papilla.calibration.published.fit_quadratic fits the published quadratic to it"
)
BAG_SUFFIXES = (".bag", ".mcap", ".db3")  # Suffixes of ROS 1 bags, MCAP files and the files of ROS 2 bags
MOST_LISTED_COLUMNS = 40  # Largest number of columns that a message lists


def open_log(
    path: Any,
    needed: tuple[str, ...],
    optional: tuple[str, ...],
    words: tuple[str, ...] = (),
    instead: tuple[str, ...] = ("tangential_N", TORQUE_COLUMN),
    log_map: LogMap | str | Path | None = None,
) -> tuple[Reader, tuple[str, ...]]:
    """A reader of the known columns, and the names of the gauges; refuses missing columns and misspelt names.

    path : of a file, or a frame (`papilla.logs.frames`). words : columns of text. instead : columns of which a log
    without gauges must have one. log_map : meaning of the columns, or its file; None takes the map beside the log, if
    there is one.
    """
    names = (*needed, *optional)
    source = Path(path) if isinstance(path, str | PathLike) else path
    if isinstance(log_map, str | Path):
        log_map = LogMap.load(log_map)
    elif log_map is None and isinstance(source, Path):
        log_map = LogMap.beside(source)

    def wanted(name: str) -> bool:
        return name in names or GAUGE_COLUMN.fullmatch(name) is not None

    reader = unmapped(source, wanted, words, log_map or LogMap())
    try:
        reader = _mapped(reader, wanted, words, log_map)
        return reader, _gauges(reader, needed, names, instead, is_mapped=bool(log_map and log_map.columns))
    except BaseException:
        reader.__exit__()
        raise


def _gauges(
    reader: Reader, needed: tuple[str, ...], names: tuple[str, ...], instead: tuple[str, ...], is_mapped: bool
) -> tuple[str, ...]:
    """Names of the gauges, by their number; raises `FileFormatError` for missing columns and, where no map says what
    the columns are, for misspelt ones."""
    present = ", ".join([*reader.names, *reader.ignored][:MOST_LISTED_COLUMNS])
    absent = [name for name in names if name not in reader.names]
    for name in reader.ignored if not is_mapped else ():
        folded = re.sub("[ _]", "", name.lower())
        meant = folded if GAUGE_COLUMN.fullmatch(folded) else closest(name, absent)
        if meant:
            raise FileFormatError(f"{reader.path}, line 1: unknown column {name}; did you mean {meant}?")
    for name in needed:
        if name in absent:
            _check_usable(reader, name)
            hint = "; papilla log map proposes what the columns are" if reader.ignored else ""
            raise FileFormatError(f"{reader.path}, line 1: column {name} is missing (found {present}){hint}")
    gauges = tuple(sorted((n for n in reader.names if GAUGE_COLUMN.fullmatch(n)), key=lambda name: int(name[1:])))
    if not gauges and not {*instead} & {*reader.names}:
        alone = f"; {SD_ALONE}" if "sd_microstrain" in reader.names else ""
        raise FileFormatError(f"{reader.path}, line 1: no gauge column g1, g2, ... (found {present}){alone}")
    return gauges


def check_finite(table: Table, names: Iterable[str], largest: float = np.inf) -> None:
    """Raise `FileFormatError` for the first row in which one of the columns has no finite number, or one whose
    magnitude is beyond `largest`."""
    names = tuple(names)
    numbers = np.column_stack([table.columns[name] for name in names])
    bad = ~np.isfinite(numbers) | (np.abs(numbers) > largest)
    if bad.any():
        index, column = divmod(int(np.argmax(bad)), len(names))
        limit = "" if np.isinf(largest) or not np.isfinite(numbers[index, column]) else f" of at most {largest:g}"
        raise table.fault(index, names[column], f"expected a finite number{limit}, got {numbers[index, column]}")


ZEROED_COLUMNS = ("force_N", "tangential_N")
"""Columns besides the gauges whose zero is their mean in the air."""


class MappedReader(Reader):
    """Another reader's rows with papilla's names and units."""

    def __init__(self, reader: Reader, log_map: LogMap, wanted: Callable[[str], bool]):
        self._reader, self._map, self.path = reader, log_map, reader.path
        self._columns = {name: column for name, column in log_map.columns.items() if wanted(name)}
        self.called = {name: column.name for name, column in self._columns.items()}
        self._constant = {"velocity_mm_s": log_map.speed_mm_s} if log_map.speed_mm_s is not None else {}
        self.names, self.live = (*self._columns, *self._constant), reader.live
        self.ignored, self.unusable, self.rows = reader.ignored, reader.unusable, reader.rows
        self._factors = {name: column.factor(name) for name, column in self._columns.items()}
        self._start, self._zeros = self._first_time(), {name: 0.0 for name in self._columns}
        if log_map.air_s is not None and self.live:
            raise FileFormatError(f"{log_map.path}: air_s needs the whole log, which a pipe does not give: use a file")
        if log_map.air_s is not None:
            self._zeros |= self._in_air(*log_map.air_s)

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks for the user, one sentence each."""
        return *self._own_notes(), *self._reader.notes

    def __exit__(self, *error: object) -> None:
        self._reader.__exit__(*error)

    def once(self) -> None:
        """From now on read standard input once."""
        self._reader.once()

    def blocks(self, size: int = BLOCK_ROWS) -> Iterator[Table]:
        """All rows in blocks; raises what `TableReader.blocks` raises."""
        for block in self._reader.blocks(size):
            table = Table(block.path, block.columns, block.lines, self.called)
            columns = {name: self._values(table, name) for name in self._columns}
            columns |= {name: np.full(len(block), value) for name, value in self._constant.items()}
            yield replace(table, columns=columns)

    def _values(self, block: Table, name: str) -> np.ndarray:
        column = self._columns[name]
        cells = block.columns[column.name]
        if cells.dtype.kind != "U":
            return cells * self._factors[name] - self._zeros[name]
        return (
            cells if column.unit != ISO_TIME else (_instants(block, name, cells) - self._start) / np.timedelta64(1, "s")
        )

    def _first_time(self) -> np.datetime64:
        """The date and time at which seconds start, if times are dates."""
        column = self._columns.get("t_s")
        if column is None or column.unit != ISO_TIME:
            return np.datetime64(0, "ns")
        block = next(self._reader.blocks(1))
        table = Table(block.path, block.columns, block.lines, {"t_s": column.name})
        return _instants(table, "t_s", block.columns[column.name])[0]

    def _in_air(self, first: float, last: float) -> dict[str, float]:
        """Mean of gauges and force between two times (s) of the log."""
        names = [name for name in self._columns if GAUGE_COLUMN.fullmatch(name) or name in ZEROED_COLUMNS]
        total, count = np.zeros(len(names)), np.zeros(len(names))
        for block in self.blocks() if "t_s" in self._columns else ():
            rows = np.column_stack([block.columns[name] for name in names])
            rows = rows[(first <= block.columns["t_s"]) & (block.columns["t_s"] <= last)]
            total, count = total + np.nansum(rows, axis=0), count + np.isfinite(rows).sum(axis=0)
        if not count.all():
            absent = ", ".join(name for name, rows in zip(names, count, strict=True) if not rows)
            raise FileFormatError(f"{self.path}: air_s {first:g} to {last:g} s holds no row of {absent}")
        return dict(zip(names, (total / count).tolist(), strict=True))

    def _own_notes(self) -> Iterator[str]:
        where = f"by {self._map.path.name}" if self._map.path else "by its name"
        read = [
            f"{column.name} is {name}" + (f" in {column.unit}" if column.factor(name) != 1 else "")
            for name, column in self._columns.items()
            if column.name != name or self._factors[name] != 1
        ]
        if read:
            yield f"columns {where}: {', '.join(read)}"
        if self._map.air_s is not None:
            yield "gauges and forces count from their mean over {:g} to {:g} s, in the air".format(*self._map.air_s)


def _mapped(reader: Reader, wanted: Callable[[str], bool], words: tuple[str, ...], log_map: LogMap | None) -> Reader:
    """A log with papilla's names and units, by its map or the units in its column names; the reader itself if it has
    them. Raises `FileFormatError` for a map that does not fit the log."""
    meaning = log_map or LogMap()
    mapped = {column.name for column in meaning.columns.values()}
    rest = [name for name in reader.header if name not in mapped]
    named = by_name(reader.path, rest, lambda name: wanted(name) and name not in meaning.columns)
    chosen = replace(meaning, columns=named | dict(meaning.columns))
    absent = next((column for column in chosen.columns.values() if column.name not in reader.header), None)
    if absent is not None:
        _check_usable(reader, absent.topic or absent.column)
        raise FileFormatError(f"{meaning.path}: the log {reader.path} has no {_lacking(absent, reader.header)}")
    if log_map is None and all(name == column.name for name, column in chosen.columns.items()):
        return reader
    text = [column.name for name, column in chosen.columns.items() if name in words or column.unit == ISO_TIME]
    reader.want({column.name for column in chosen.columns.values()}.__contains__, tuple(text))
    return MappedReader(reader, chosen, wanted)


def _check_usable(reader: Reader, name: str) -> None:
    """Raise `FileFormatError` for a column or topic that is there, but holds no numbers."""
    why = reader.unusable.get(name) or reader.unusable.get(name.split("[")[0])
    if why:
        raise FileFormatError(f"{reader.path}: {name} cannot be used: {why}")


def unmapped(source: Any, wanted: Callable[[str], bool], words: tuple[str, ...], how: LogMap) -> Reader:
    """A reader of a log (path or frame) with its own names and units; how : the dialect of a text."""
    if not isinstance(source, Path):
        return FrameReader(source, wanted, words)
    if source.suffix in PARQUET_SUFFIXES:
        return ParquetReader(source, wanted, words)
    if is_bag(source):
        return BagReader(source, wanted)
    dialect: dict[str, Any] = {"delimiter": how.delimiter, "decimal": how.decimal, "header_line": how.header_line}
    return TableReader(source, wanted, words, **dialect, is_unit=is_unit)


def is_bag(path: Path) -> bool:
    """Whether a path is a ROS 1 bag, an MCAP file, or the folder of a ROS 2 bag."""
    return path.suffix in BAG_SUFFIXES or (path / "metadata.yaml").is_file()


def _lacking(column: Column, header: Sequence[str]) -> str:
    """What a log lacks, with the nearest name that it has: a column, a topic of a bag, or a field of the topic."""
    item, name, candidates = "column", column.column, [*header]
    if column.topic is not None:
        topics = list(dict.fromkeys(head.split(":")[0] for head in header if ":" in head))
        item, name, candidates = "topic", column.topic, topics
        if column.topic in topics:
            item, name = f"field of {column.topic}", column.column
            candidates = [head.split(":", 1)[1] for head in header if head.startswith(f"{column.topic}:")]
    meant = closest(name, candidates)
    return f"{item} {name!r}" + (f"; did you mean {meant}?" if meant else f" (found {', '.join(candidates)[:400]})")


def by_name(path: Path, header: Sequence[str], wanted: Callable[[str], bool]) -> dict[str, Column]:
    """Columns that have papilla's names, or a known name with a unit ("Fz [N]", "t_ms")."""
    columns: dict[str, Column] = {}
    for name in header:
        stem, unit = split_unit(name)
        column = name if wanted(name) else (stem if wanted(stem) else column_meant(stem)) if unit else None
        if column is None or not wanted(column) or (column != name and unit not in quantity_of(column).units):
            continue
        if column in columns and column != name and columns[column].column != column:
            both = f"{columns[column].column} and {name}"
            raise FileFormatError(f"{path}: {both} are both {column}: say which one is in a map (papilla log map)")
        if column not in columns or column == name:
            columns[column] = Column(name, unit if column != name and unit else quantity_of(column).own_unit)
    return columns


def _instants(block: Table, name: str, cells: np.ndarray) -> np.ndarray:
    """Dates and times (n,) as `datetime64`; raises `FileFormatError` for the first cell that is none."""
    try:
        return instants(cells)
    except ValueError:
        for index, cell in enumerate(cells):
            try:
                instants(cells[[index]])
            except ValueError:
                raise block.fault(index, name, f"expected a date and time, got {str(cell)[:40]!r}") from None
        raise


def instants(cells: np.ndarray) -> np.ndarray:
    """Dates and times (n,) of texts such as 2026-05-04 12:30:00.001+02:00, as `datetime64` in UTC or, if they state no
    zone, in that of the log; raises `ValueError`."""
    plain = np.char.replace(np.char.replace(cells, " ", "T", count=1), " ", "")
    with warnings.catch_warnings():
        # NumPy converts times with a zone to UTC, which is right here, and warns that it does
        warnings.simplefilter("ignore", UserWarning)
        return plain.astype("datetime64[ns]")
