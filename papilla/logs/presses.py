"""Logs of presses on specimens of known modulus, a row a press."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from papilla.errors import FileFormatError
from papilla.logs.columns import check_finite, open_log
from papilla.logs.loading import Loop, loading, loops
from papilla.short_repr import short_repr
from papilla.tables import write_table

PRESS_OPTIONAL = ("indentation_mm", "x_mm", "y_mm", "sd_microstrain", "t_s")
SD_TOLERANCE = 0.01
"""A stated S_d may differ from that of the gauges by rounding, this fraction of it; ddof 1 would differ by 12 %."""


@dataclass(frozen=True, eq=False)
class PressLog:
    """Presses on specimens of known modulus, a row a press.

    Parameters
    ----------
    force_N, modulus_MPa : (n,), > 0.
    readings : (n, g) in microstrain, all finite.
    gauge_names : the g column names, by their number.
    indentation_mm : (n,) > 0, or None.
    x_mm, y_mm : (n,) touch-down points, or None.
    t_s : (n,) rising, when each row was taken, or None. loops : of the touches that were loaded and unloaded.
    notes : what a person should be told of the file, a sentence each.
    """

    force_N: np.ndarray
    modulus_MPa: np.ndarray
    readings: np.ndarray
    gauge_names: tuple[str, ...]
    indentation_mm: np.ndarray | None = None
    x_mm: np.ndarray | None = None
    y_mm: np.ndarray | None = None
    notes: tuple[str, ...] = ()
    t_s: np.ndarray | None = None
    loops: tuple[Loop, ...] = ()
    __repr__ = short_repr

    def __len__(self) -> int:
        return len(self.force_N)

    @cached_property
    def sd_microstrain(self) -> np.ndarray:
        """(n,) population standard deviation (ddof 0) of the gauge readings of each press."""
        return self.readings.std(axis=1)

    def to_csv(self, path: str | Path) -> None:
        """Write the presses in the form that `read_presses` reads, with their S_d; raises `FileAccessError`."""
        columns = {"force_N": self.force_N, "modulus_MPa": self.modulus_MPa}
        columns |= dict(zip(self.gauge_names, self.readings.T, strict=True))
        for name in PRESS_OPTIONAL:
            if (column := getattr(self, name)) is not None:
                columns[name] = column
        write_table(path, columns)


def read_presses(path: str | Path, *, whole: bool = False) -> PressLog:
    """Read a bench log `force_N,modulus_MPa,g1[,g2,...]` with any of `indentation_mm,x_mm,y_mm,sd_microstrain,t_s`.

    With `t_s` the rows in which a touch is loaded are kept alone, and `notes` and `loops` tell of the others, unless
    the `whole` log is asked for.

    Raises `FileAccessError` or `FileFormatError`: what `papilla.tables.TableReader` refuses, a missing or misspelt
    column, fewer than two presses, a cell without a finite number, a force, modulus or indentation that is not
    positive, an `sd_microstrain` that is not the population standard deviation of the gauges, a `t_s` that does not
    rise.
    """
    reader, gauges = open_log(path, ("force_N", "modulus_MPa"), PRESS_OPTIONAL)
    with reader:
        table = reader.whole()
    if len(table) < 2:
        raise FileFormatError(f"{table.path} has one row: one press is too few to fit anything")
    check_finite(table, tuple(table.columns))
    for name in ("force_N", "modulus_MPa", "indentation_mm"):
        if name in table.columns and (table.columns[name] <= 0).any():
            row = int(np.argmax(table.columns[name] <= 0))
            raise table.fault(row, name, f"must be greater than 0, got {table.columns[name][row]:g}")
    columns: dict[str, Any] = dict(table.columns)
    readings = np.column_stack([columns.pop(name) for name in gauges])
    stated = columns.pop("sd_microstrain", None)
    log = PressLog(readings=readings, gauge_names=gauges, notes=reader.notes, **columns)
    sd = log.sd_microstrain
    if stated is not None and (wrong := np.abs(stated - sd) > np.maximum(SD_TOLERANCE * sd, 0.5)).any():
        row = int(np.argmax(wrong))
        problem = f"{stated[row]:g} is not the population standard deviation of the gauges, {sd[row]:g}"
        raise table.fault(row, "sd_microstrain", problem)
    if log.t_s is None:
        return log
    if (late := np.diff(log.t_s) <= 0).any():
        row = int(np.argmax(late)) + 1
        raise table.fault(row, "t_s", f"must rise, got {log.t_s[row]:g} after {log.t_s[row - 1]:g}")
    return log if whole else loaded_part(log)


def loaded_part(log: PressLog) -> PressLog:
    """The rows of a log over time that load the finger, with notes on the others and the loops that they close.

    Raises `FileFormatError` where fewer than two rows do.
    """
    kept = loading(log.force_N, log.modulus_MPa)
    if kept.all():
        return log
    if kept.sum() < 2:
        raise FileFormatError(f"only {kept.sum()} of {len(log)} rows load the finger: too few to fit anything")
    closed = () if log.indentation_mm is None else loops(log.force_N, log.modulus_MPa, log.indentation_mm)
    said = f"{len(log) - kept.sum()} of {len(log)} rows hold or unload the finger (t_s): the fit is of loading alone"
    lost = [
        f"a loop to {one.force_N:.3g} N on {one.modulus_MPa:g} MPa lost {one.lost_N_mm:.3g} N mm, "
        f"{100 * one.share:.2g} % of the work of loading"
        for one in closed
    ]
    names = ("force_N", "modulus_MPa", "readings", "indentation_mm", "x_mm", "y_mm", "t_s")
    rows = {name: column[kept] for name in names if (column := getattr(log, name)) is not None}
    return replace(log, **rows, notes=(*log.notes, said, *lost), loops=closed)
