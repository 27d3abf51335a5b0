"""Tables in memory: frames, dicts and structured arrays, with the interface of `TableReader`; and Parquet for answers.

A frame is any object that lists its columns (`columns`, `keys()`, or the names of a dtype) and returns one by
`frame[name]`. Frames of pandas and polars are such objects; neither package is imported.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from papilla.core.errors import FileFormatError, InputError
from papilla.core.files import replacing
from papilla.core.rows import BLOCK_ROWS, Reader, Table, check_names, text_cells
from papilla.core.tables import table_writer

PARQUET_SUFFIXES = (".parquet", ".pq")
"""Suffixes of Parquet files."""

FRAME_NAME = Path("the frame")
"""Name of a table in memory in messages."""


class FrameReader(Reader):
    """Reads columns in memory block by block."""

    def __init__(self, frame: Any, wanted: Callable[[str], bool], words: tuple[str, ...] = (), path: Path = FRAME_NAME):
        self.path, self._frame = path, frame
        self.header: list[str] = [str(name) for name in _names(frame)]
        check_names(str(path), self.header)
        self.want(wanted, words)

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks for the user, a sentence each."""
        return (f"ignored columns: {', '.join(self.ignored)}",) if self.ignored else ()

    def blocks(self, size: int = BLOCK_ROWS) -> Iterator[Table]:
        """All rows, in tables of at most `size`; raises `FileFormatError` if there are none, or text for numbers."""
        columns = {name: self._column(name) for name in self.names}
        lengths = {len(column) for column in columns.values()}
        if lengths - {0} == set():
            raise FileFormatError(f"{self.path} holds columns but no rows")
        if len(lengths) > 1:
            raise FileFormatError(f"{self.path}: columns must be equally long, got {sorted(lengths)}")
        for first in range(0, lengths.pop(), size):
            parts = {name: column[first : first + size] for name, column in columns.items()}
            rows = np.arange(first, first + len(next(iter(parts.values()))))
            yield Table(self.path, parts, rows)

    def _column(self, name: str) -> np.ndarray:
        return column_of(self.path, name, np.asarray(self._frame[name]), name in self._words)


def column_of(path: Path, name: str, values: np.ndarray, is_text: bool) -> np.ndarray:
    """A column (n,) as floats, or as text; raises `FileFormatError` for other values."""
    if is_text:
        return text_cells(path, name, values) if values.dtype.kind == "O" else values.astype(str)
    if values.dtype.kind in "Mm":
        hint = ": give it the unit iso in a map" if values.dtype.kind == "M" else ", such as seconds"
        raise FileFormatError(f"{path}, column {name}: expected numbers{hint}, got {values.dtype}")
    if values.ndim != 1 or (values.dtype.kind not in "fiub" and not _all_numbers(values)):
        raise FileFormatError(f"{path}, column {name}: expected one number per row, got {values.dtype}")
    return values.astype(float)


@contextmanager
def estimates_writer(path: Path, names: Sequence[str]) -> Iterator[Callable[[Sequence[Any]], None]]:
    """`table_writer`, or the same for a Parquet file, where a cell without a number is null.

    Raises `FileAccessError`, or `InputError` if the extra `tables` is missing.
    """
    if path.suffix not in PARQUET_SUFFIXES:
        with table_writer(path, names) as write:
            yield write
        return
    try:
        import pyarrow
        from pyarrow.parquet import ParquetWriter
    except ImportError:
        raise InputError(f"{path}: Parquet files need pyarrow: pip install papilla[tables]") from None
    texts = [name for name in names if name.endswith(("status", "sha256"))]
    schema = pyarrow.schema([(name, pyarrow.string() if name in texts else pyarrow.float64()) for name in names])
    with replacing(path) as temporary, ParquetWriter(temporary, schema) as stream:
        yield lambda columns: stream.write_batch(
            pyarrow.record_batch([pyarrow.array(column, from_pandas=True) for column in columns], schema=schema)
        )


def _names(frame: Any) -> Sequence[Any]:
    if getattr(getattr(frame, "dtype", None), "names", None):
        return frame.dtype.names
    if hasattr(frame, "columns"):
        return list(frame.columns)
    if hasattr(frame, "keys"):
        return list(frame.keys())
    raise InputError(f"a log is a file, a frame, a dict of columns or a structured array, got {type(frame).__name__}")


def _all_numbers(values: np.ndarray) -> bool:
    try:
        values.astype(float)
    except (TypeError, ValueError):
        return False
    return True
