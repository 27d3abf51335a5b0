"""Parquet files as tables: wanted columns alone are read, block by block.

A column of lists of equally many numbers, as robot-learning sets have, is a column for each element: `name[k]`. Columns
of other types than numbers, text, dates and such lists are named with the reason, and not read.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from papilla.core.errors import FileAccessError, FileFormatError, InputError
from papilla.core.outside import checked_file, reason
from papilla.core.rows import BLOCK_ROWS, Reader, Table, check_names, check_text
from papilla.logs.frames import column_of

MOST_ELEMENTS = 64
"""Largest number of elements of a list, or of an array in a message of a bag, that become columns."""
MOST_FIELDS = 20_000
"""Largest number of columns of a Parquet file or a bag: a hundred topics with two hundred numbers each."""


class ParquetReader(Reader):
    """Reads columns of a Parquet file; raises `FileAccessError`, `FileFormatError`, or `InputError` if the extra
    `tables` is missing."""

    def __init__(self, path: Path, wanted: Callable[[str], bool], words: tuple[str, ...] = ()):
        self.path = path
        with _faults(path):
            self._file = _opened(path)
            self.rows = max(self._file.metadata.num_rows, 0)
            self._places: dict[str, tuple[str, int | None]] = {}
            self._lengths: dict[str, int] = {}
            unusable = {}
            for field in self._file.schema_arrow:
                if fault := self._add(field):
                    unusable[field.name] = fault
        self.unusable, self.header = unusable, [*self._places]
        check_names(str(path), self.header)
        self.want(wanted, words)

    def _add(self, field: Any) -> str:
        """Add the columns of a field of the schema to the header; returns why its own name is none, "" if it is one."""
        from pyarrow import types

        column_type = field.type
        if not (types.is_nested(column_type) or types.is_interval(column_type) or "binary" in str(column_type)):
            self._places[field.name] = (field.name, None)
            return ""
        if not any(is_list(column_type) for is_list in (types.is_list, types.is_large_list, types.is_fixed_size_list)):
            return f"it holds {column_type}, not numbers"
        if not any(
            is_number(column_type.value_type) for is_number in (types.is_integer, types.is_floating, types.is_boolean)
        ):
            return f"it holds lists of {column_type.value_type}, not of numbers"
        first = next((batch.column(field.name)[0].as_py() for batch in self._batches([field.name], 1)), None) or []
        if not 0 < len(first) <= MOST_ELEMENTS:
            return f"its first list has {len(first)} numbers; 1 to {MOST_ELEMENTS} become columns"
        self._lengths[field.name] = len(first)
        self._places |= {f"{field.name}[{number}]": (field.name, number) for number in range(len(first))}
        return f"it holds lists of {len(first)} numbers: name one of them, {field.name}[0] to [{len(first) - 1}]"

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks for the user, a sentence each."""
        unread = tuple(
            f"column {name} is not read: {why}" for name, why in self.unusable.items() if name not in self._lengths
        )
        return (*unread, *((f"ignored columns: {', '.join(self.ignored)}",) if self.ignored else ()))

    def blocks(self, size: int = BLOCK_ROWS) -> Iterator[Table]:
        """All rows, in tables of at most `size`; raises `FileFormatError` if there are none, or text for numbers."""
        first = 0
        with _faults(self.path):
            for batch in self._batches(list(dict.fromkeys(self._places[name][0] for name in self.names)), size):
                lists = {
                    name: self._list(batch.column(name), name, first)
                    for name in self._lengths
                    if name in batch.schema.names
                }
                columns = {}
                for name in self.names:
                    source, element = self._places[name]
                    values = (
                        _plain(self.path, name, batch.column(source)) if element is None else lists[source][:, element]
                    )
                    columns[name] = column_of(self.path, name, values, name in self._words)
                yield Table(self.path, columns, np.arange(first, first + len(batch)))
                first += len(batch)
        if not first:
            raise FileFormatError(f"{self.path} holds columns but no rows")

    def _batches(self, columns: list[str], size: int) -> Iterator[Any]:
        """Batches of at least one row."""
        return (batch for batch in self._file.iter_batches(size, columns=columns, use_threads=False) if len(batch))

    def _list(self, lists: Any, name: str, first: int) -> np.ndarray:
        """Lists as rows (n, elements), NaN for a missing one; raises `FileFormatError` for one of another length."""
        from pyarrow import compute

        length = self._lengths[name]
        valid = lists.is_valid().to_numpy(zero_copy_only=False)
        lengths = compute.list_value_length(lists).fill_null(length).to_numpy(zero_copy_only=False)
        if (wrong := lengths != length).any():
            index = int(np.argmax(wrong))
            problem = f"{lengths[index]} numbers in row {first + index}, {length} in the first"
            raise FileFormatError(f"{self.path}, column {name}: {problem}")
        rows = np.full((len(lists), length), np.nan)
        rows[valid] = compute.list_flatten(lists).to_numpy(zero_copy_only=False).astype(float).reshape(-1, length)
        return rows


def _opened(path: Path) -> Any:
    """A `ParquetFile` whose texts stay dictionaries: a text is long once, however often it occurs."""
    from pyarrow import types
    from pyarrow.parquet import ParquetFile

    source = checked_file(path)
    schema = ParquetFile(source, memory_map=True).schema_arrow
    if len(schema) > MOST_FIELDS:
        raise FileFormatError(f"{path} has {len(schema)} columns; at most {MOST_FIELDS} are read")
    check_names(str(path), schema.names)
    texts = [field.name for field in schema if types.is_string(field.type) or types.is_large_string(field.type)]
    return ParquetFile(source, memory_map=True, read_dictionary=texts)


def _plain(path: Path, name: str, array: Any) -> np.ndarray:
    """The values of an Arrow array; an empty cell in a column of numbers is NaN."""
    from pyarrow import compute, types

    if types.is_dictionary(array.type):
        if types.is_string(array.type.value_type) or types.is_large_string(array.type.value_type):
            longest = compute.max(compute.utf8_length(array.dictionary)).as_py() or 0
            check_text(path, name, longest)
        array = array.dictionary_decode()
    return array.to_numpy(zero_copy_only=False)


@contextmanager
def _faults(path: Path) -> Iterator[None]:
    """What pyarrow raises becomes an error of this file."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise InputError(f"{path}: Parquet files need pyarrow: pip install papilla[tables]") from None
    try:
        yield
    except (FileAccessError, FileFormatError):
        raise
    except (OSError, MemoryError) as error:
        raise FileAccessError(f"cannot read {path}: {reason(error)}") from error
    except (pyarrow.ArrowException, ValueError, TypeError, LookupError, OverflowError) as error:
        raise FileFormatError(f"{path} is no Parquet file that pyarrow can read ({error})") from error
