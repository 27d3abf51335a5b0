"""Columns that all logs of a finger share: gauges `g1`, `g2`, ... in microstrain, and named quantities with a unit."""

import re
from collections.abc import Iterable
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from papilla.errors import FileFormatError
from papilla.logs.log_map import GAUGE_COLUMN, LogMap
from papilla.logs.mapped import opened
from papilla.tables import Reader, Table, closest

TORQUE = "torque_Nmm"
"""Torque about an axis parallel to y, from a sensor at the base. Divided by the distance of the axis from the skin it
gives the tangential force."""
SD_ALONE = (
    "S_d alone does not determine gain, lever and zero of a gauge: add the readings that it was computed from, in "
    "microstrain. What all gauges have in common papilla identify finds from S_d, too; "
    "papilla.calibrate.published_form.fit_quadratic fits the published quadratic to it"
)
MOST_NAMED = 40  # Largest number of columns that a message lists


def open_log(
    path: Any,
    needed: tuple[str, ...],
    optional: tuple[str, ...],
    words: tuple[str, ...] = (),
    instead: tuple[str, ...] = ("tangential_N", TORQUE),
    log_map: LogMap | str | Path | None = None,
) -> tuple[Reader, tuple[str, ...]]:
    """A reader of the known columns, and the names of the gauges; refuses missing columns and misspelt names.

    path : of a file, or a frame (`papilla.logs.frames`). words : columns of text. instead : columns of which a log
    without gauges must have one. log_map : meaning of the columns, or its file; None takes the map beside the log, if
    there is one.
    """
    known = (*needed, *optional)
    source = Path(path) if isinstance(path, str | PathLike) else path
    if isinstance(log_map, str | Path):
        log_map = LogMap.load(log_map)
    elif log_map is None and isinstance(source, Path):
        log_map = LogMap.beside(source)
    reader = opened(source, lambda name: name in known or GAUGE_COLUMN.fullmatch(name) is not None, words, log_map)
    try:
        return reader, _gauges(reader, needed, known, instead)
    except BaseException:
        reader.__exit__()
        raise


def _gauges(
    reader: Reader, needed: tuple[str, ...], known: tuple[str, ...], instead: tuple[str, ...]
) -> tuple[str, ...]:
    found = ", ".join([*reader.names, *reader.ignored][:MOST_NAMED])
    absent = [name for name in known if name not in reader.names]
    for name in reader.ignored:
        folded = re.sub("[ _]", "", name.lower())
        meant = folded if GAUGE_COLUMN.fullmatch(folded) else closest(name, absent)
        if meant:
            raise FileFormatError(f"{reader.path}, line 1: unknown column {name}; did you mean {meant}?")
    for name in needed:
        if name in absent:
            hint = "; papilla log map proposes what the columns are" if reader.ignored else ""
            raise FileFormatError(f"{reader.path}, line 1: column {name} is missing (found {found}){hint}")
    gauges = tuple(sorted((n for n in reader.names if GAUGE_COLUMN.fullmatch(n)), key=lambda name: int(name[1:])))
    if not gauges and not {*instead} & {*reader.names}:
        alone = f"; {SD_ALONE}" if "sd_microstrain" in reader.names else ""
        raise FileFormatError(f"{reader.path}, line 1: no gauge column g1, g2, ... (found {found}){alone}")
    return gauges


def check_finite(table: Table, names: Iterable[str]) -> None:
    """Raise `FileFormatError` for the first row in which one of the columns has no finite number."""
    names = tuple(names)
    bad = ~np.isfinite(np.column_stack([table.columns[name] for name in names]))
    if bad.any():
        row, column = divmod(int(np.argmax(bad)), len(names))
        name = names[column]
        raise table.fault(row, name, f"expected a finite number, got {table.columns[name][row]}")
