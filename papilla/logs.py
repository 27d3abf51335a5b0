"""Logs of a finger: gauge readings over time, and presses on specimens of known modulus.

Readings are in microstrain, one column a gauge (`g1`, `g2`, ...); other units stand in the column names.
"""

import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from papilla.errors import FileFormatError
from papilla.tables import Table, closest, read_table, write_table

__all__ = ["BenchLog", "LogReport", "TimeLog", "read_bench", "read_time_log", "white_noise", "write_table"]

GAUGE_COLUMN = re.compile(r"g[1-9][0-9]*")
TIME_OPTIONAL = ("force_N", "velocity_mm_s", "position_mm", "tangential_N")
BENCH_OPTIONAL = ("indentation_mm", "x_mm", "y_mm", "sd_microstrain")
GAP_STEPS = 1.5
"""A step of time longer than this many median steps is a gap."""
SD_TOLERANCE = 0.01
"""A stated S_d may differ from that of the gauges by rounding, this fraction of it; ddof 1 would differ by 12 %."""


@dataclass(frozen=True)
class LogReport:
    """What a reader of a time log has to know: counts, never silently dropped rows.

    `gaps` counts steps over 1.5 median steps, `duplicates` rows that repeat the time before them, `nan_rows` rows where
    any used column holds no finite number, `ignored` names the columns that papilla does not know, `ends_open` says
    that the last line has no line end, as in a file that was cut off.
    """

    rows: int
    gaps: int
    duplicates: int
    nan_cells: int
    nan_rows: int
    ignored: tuple[str, ...]
    ends_open: bool

    @property
    def notes(self) -> tuple[str, ...]:
        """What a person should be told of the file, a sentence each."""
        return _notes(self.ignored, self.ends_open)


@dataclass(frozen=True, eq=False)
class TimeLog:
    """Gauge readings over time.

    Parameters
    ----------
    t_s : (n,) times in s, not decreasing, n >= 2.
    readings : (n, g) in microstrain; cells without a number are NaN.
    gauge_names : the g column names, by their number.
    force_N, velocity_mm_s, position_mm, tangential_N : (n,) or None where the log has no such column.
    sample_rate_Hz : mean rate over the steps that are neither gaps nor duplicates.
    report : what was counted while reading.
    """

    t_s: np.ndarray
    readings: np.ndarray
    gauge_names: tuple[str, ...]
    force_N: np.ndarray | None
    velocity_mm_s: np.ndarray | None
    position_mm: np.ndarray | None
    tangential_N: np.ndarray | None
    sample_rate_Hz: float
    report: LogReport

    def __len__(self) -> int:
        return len(self.t_s)


@dataclass(frozen=True, eq=False)
class BenchLog:
    """Presses on specimens of known modulus, a row a press.

    Parameters
    ----------
    force_N, modulus_MPa : (n,), > 0.
    readings : (n, g) in microstrain, all finite.
    gauge_names : the g column names, by their number.
    indentation_mm : (n,) > 0, or None.
    x_mm, y_mm : (n,) touch-down points, or None.
    ignored : names of columns that papilla does not know.
    ends_open : the last line has no line end, as in a file that was cut off.
    """

    force_N: np.ndarray
    modulus_MPa: np.ndarray
    readings: np.ndarray
    gauge_names: tuple[str, ...]
    indentation_mm: np.ndarray | None = None
    x_mm: np.ndarray | None = None
    y_mm: np.ndarray | None = None
    ignored: tuple[str, ...] = ()
    ends_open: bool = False

    def __len__(self) -> int:
        return len(self.force_N)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a person should be told of the file, a sentence each."""
        return _notes(self.ignored, self.ends_open)

    @cached_property
    def sd_microstrain(self) -> np.ndarray:
        """(n,) population standard deviation (ddof 0) of the gauge readings of each press."""
        return self.readings.std(axis=1)

    def to_csv(self, path) -> None:
        """Write the presses in the form that `read_bench` reads, with their S_d; raises `FileAccessError`."""
        columns = {"force_N": self.force_N, "modulus_MPa": self.modulus_MPa}
        columns |= dict(zip(self.gauge_names, self.readings.T, strict=True))
        for name in BENCH_OPTIONAL:
            if (column := getattr(self, name)) is not None:
                columns[name] = column
        write_table(path, columns)


def white_noise(samples) -> float:
    """Standard deviation of the white noise of an evenly sampled signal; NaN for fewer than three finite samples.

    From the median of the second differences, which a ramp does not move and a few steps hardly: 0.6745 is the median
    of |normal|, and the second difference of white noise has 6 times its variance.
    """
    second = np.diff(np.asarray(samples, float), n=2)
    second = second[np.isfinite(second)]
    return float(np.median(np.abs(second)) / (0.6744897501960817 * np.sqrt(6))) if second.size else float("nan")


def read_time_log(path) -> TimeLog:
    """Read a log `t_s,g1[,g2,...]` with any of `force_N,velocity_mm_s,position_mm,tangential_N`.

    Cells without a finite number are kept as they are and counted: they are answered row by row. Raises
    `FileAccessError` or `FileFormatError`: what `papilla.tables.read_table` refuses, a missing or misspelt column,
    fewer than two rows, a time that is no number or earlier than the one before, all times equal.
    """
    table, gauges = _read(path, ("t_s",), TIME_OPTIONAL)
    time = table.columns["t_s"]
    _check_finite(table, ("t_s",))
    if len(table) < 2:
        raise FileFormatError(f"{table.path} has one row: a time log needs two at least to have a sampling rate")
    steps = np.diff(time)
    if (steps < 0).any():
        row = int(np.argmax(steps < 0)) + 1
        raise table.fault(row, "t_s", f"time goes back from {time[row - 1]:g} to {time[row]:g} s; sort the log by time")
    if not (steps > 0).any():
        raise FileFormatError(f"{table.path}: all rows have the time {time[0]:g} s, so there is no sampling rate")
    gap = steps > GAP_STEPS * np.median(steps[steps > 0])
    regular = steps[(steps > 0) & ~gap]
    used = [name for name in (*gauges, *TIME_OPTIONAL) if name in table.columns]
    bad = ~np.isfinite(np.column_stack([table.columns[name] for name in used]))
    report = LogReport(
        rows=len(table),
        gaps=int(gap.sum()),
        duplicates=int((steps == 0).sum()),
        nan_cells=int(bad.sum()),
        nan_rows=int(bad.any(axis=1).sum()),
        ignored=table.ignored,
        ends_open=table.ends_open,
    )
    return TimeLog(
        t_s=time,
        readings=_readings(table, gauges),
        gauge_names=gauges,
        **{name: table.columns.get(name) for name in TIME_OPTIONAL},
        sample_rate_Hz=float(1 / regular.mean()),
        report=report,
    )


def read_bench(path) -> BenchLog:
    """Read a bench log `force_N,modulus_MPa,g1[,g2,...]` with any of `indentation_mm,x_mm,y_mm,sd_microstrain`.

    Raises `FileAccessError` or `FileFormatError`: what `papilla.tables.read_table` refuses, a missing or misspelt
    column, fewer than two presses, a cell without a finite number, a force, modulus or indentation that is not
    positive, an `sd_microstrain` that is not the population standard deviation of the gauges.
    """
    table, gauges = _read(path, ("force_N", "modulus_MPa"), BENCH_OPTIONAL)
    if len(table) < 2:
        raise FileFormatError(f"{table.path} has one row: one press is too few to fit anything")
    _check_finite(table, tuple(table.columns))
    for name in ("force_N", "modulus_MPa", "indentation_mm"):
        if name in table.columns and (table.columns[name] <= 0).any():
            row = int(np.argmax(table.columns[name] <= 0))
            raise table.fault(row, name, f"must be greater than 0, got {table.columns[name][row]:g}")
    log = BenchLog(
        force_N=table.columns["force_N"],
        modulus_MPa=table.columns["modulus_MPa"],
        readings=_readings(table, gauges),
        gauge_names=gauges,
        indentation_mm=table.columns.get("indentation_mm"),
        x_mm=table.columns.get("x_mm"),
        y_mm=table.columns.get("y_mm"),
        ignored=table.ignored,
        ends_open=table.ends_open,
    )
    if "sd_microstrain" in table.columns:
        _check_sd(table, log.sd_microstrain)
    return log


def _read(path, needed: tuple[str, ...], optional: tuple[str, ...]) -> tuple[Table, tuple[str, ...]]:
    """The table of the known columns, and its gauges; refuses missing columns and probable slips of known names."""
    known = (*needed, *optional)
    table = read_table(path, lambda name: name in known or GAUGE_COLUMN.fullmatch(name) is not None)
    names = (*table.columns, *table.ignored)
    absent = [name for name in known if name not in table.columns]
    for name in table.ignored:
        folded = re.sub("[ _]", "", name.lower())
        meant = folded if GAUGE_COLUMN.fullmatch(folded) else closest(name, absent)
        if meant:
            raise FileFormatError(f"{table.path}, line 1: unknown column {name}; did you mean {meant}?")
    for name in needed:
        if name in absent:
            raise FileFormatError(f"{table.path}, line 1: column {name} is missing (found {', '.join(names)})")
    gauges = tuple(sorted((n for n in table.columns if GAUGE_COLUMN.fullmatch(n)), key=lambda name: int(name[1:])))
    if not gauges:
        raise FileFormatError(f"{table.path}, line 1: no gauge column g1, g2, ... (found {', '.join(names)})")
    return table, gauges


def _notes(ignored: tuple[str, ...], ends_open: bool) -> tuple[str, ...]:
    notes = [f"ignored columns: {', '.join(ignored)}"] if ignored else []
    if ends_open:
        notes.append("the last line has no line end: if the file was cut off, its last number may be too short")
    return tuple(notes)


def _readings(table: Table, gauges: tuple[str, ...]) -> np.ndarray:
    return np.column_stack([table.columns[name] for name in gauges])


def _check_finite(table: Table, names) -> None:
    """Refuse the first row in which a column holds no finite number."""
    bad = ~np.isfinite(np.column_stack([table.columns[name] for name in names]))
    if bad.any():
        row, column = divmod(int(np.argmax(bad)), len(names))
        name = names[column]
        raise table.fault(row, name, f"expected a finite number, got {table.columns[name][row]}")


def _check_sd(table: Table, sd: np.ndarray) -> None:
    stated = table.columns["sd_microstrain"]
    wrong = np.abs(stated - sd) > np.maximum(SD_TOLERANCE * sd, 0.5)
    if wrong.any():
        row = int(np.argmax(wrong))
        problem = f"{stated[row]:g} is not the population standard deviation of the gauges, {sd[row]:g}"
        raise table.fault(row, "sd_microstrain", problem)
