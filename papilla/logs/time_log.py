"""Logs of gauge readings over time, read as a whole or block by block in bounded memory."""

import math
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Self

import numpy as np

from papilla.core import checks
from papilla.core.checks import LARGEST_READING, believable
from papilla.core.errors import FileFormatError
from papilla.core.rows import Reader, Table
from papilla.core.short_repr import short_repr
from papilla.logs.columns import TORQUE_COLUMN, check_finite, open_log
from papilla.logs.log_map import LogMap
from papilla.logs.statistics import Magnitudes, Sizes, WhiteNoise

TIME_OPTIONAL = ("force_N", "velocity_mm_s", "position_mm", "tangential_N")
"""Optional columns of a log. `TORQUE` may stand instead of tangential_N."""
LOG_GAP_STEPS = 1.5  # A time step longer than this many median steps is a gap
PREAMBLE_ROWS = 200  # Rows of a pipe that give its sampling rate and noise before the first answer
SHORTEST_STEP_S, LONGEST_STEP_S = 1e-7, 1e5  # Limits of the mean time step: beyond them t_s is not in seconds


@dataclass(frozen=True)
class LogReport:
    """Counts of a time log; no row is dropped silently.

    gaps : time steps longer than 1.5 median steps. duplicates : rows with the time of the row before.
    nan_rows, nan_cells : rows and cells of used columns without a finite number. unbelievable : cells with a number
    beyond `checks.LARGEST`. notes : how the file was read, a sentence each. sizes : columns whose numbers seem
    to be in another unit.
    """

    rows: int
    gaps: int
    duplicates: int
    nan_cells: int
    nan_rows: int
    unbelievable: int
    notes: tuple[str, ...]
    sizes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class TimeLog:
    """Gauge readings over time.

    Parameters
    ----------
    t_s : (n,) times in s, not decreasing, n >= 2.
    readings : (n, g) in microstrain; cells without a number are NaN.
    gauge_names : the g column names, by their number.
    force_N, velocity_mm_s, position_mm, tangential_N : (n,) or None where the log has no such column.
    sample_rate_Hz : mean rate over the steps that are neither gaps nor duplicates. If most rows share the time of the
        row before (samples in packets), the rate of the rows.
    report : counts of the reader.
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
    __repr__ = short_repr

    def __len__(self) -> int:
        return len(self.t_s)


class _Scan:
    """First pass over the blocks of a time log: sampling rate, noise and counts."""

    def __init__(
        self,
        reader: Reader,
        gauges: tuple[str, ...],
        lever_mm: float | None,
        more: tuple[str, ...],
        covered_N: float | None,
    ):
        self._reader, self._steps, self._lever = reader, Magnitudes(), lever_mm
        present = {*reader.names, *(["tangential_N"] if lever_mm else [])}
        self.used = (*gauges, *(name for name in TIME_OPTIONAL if name in present), *more)
        self.noise, self.sizes = WhiteNoise(), Sizes(self.used, len(gauges), covered_N)
        self.counts: Counter[str] = Counter()
        self._last = math.nan

    def add(self, block: Table) -> None:
        """Check and count the rows of the next block."""
        check_finite(block, ("t_s",))
        time = block.columns["t_s"]
        if (np.abs(time) > LARGEST_READING).any():
            index = int(np.argmax(np.abs(time) > LARGEST_READING))
            raise block.fault(index, "t_s", f"expected a time in s, got {time[index]:g}")
        with_last = np.concatenate([[self._last], time])[math.isnan(self._last) :]
        steps = np.diff(with_last)
        if (steps < 0).any():
            at = int(np.argmax(steps < 0))
            problem = f"time goes back from {with_last[at]:g} to {with_last[at + 1]:g} s; sort the log by time"
            raise block.fault(at + 1 + len(time) - len(with_last), "t_s", problem)
        self._last = time[-1]
        self._steps.add(steps[steps > 0])
        rows = rows_of(block, self.used, self._lever)
        bad = ~np.isfinite(rows)
        counted = {"rows": len(rows), "nan_rows": bad.any(axis=1).sum(), "nan_cells": bad.sum()}
        counted |= {"duplicates": (steps == 0).sum(), "unbelievable": (~bad & (np.abs(rows) > LARGEST_READING)).sum()}
        for name, count in counted.items():
            self.counts[name] += int(count)
        rows = believable(rows)
        self.noise.add(rows)
        self.sizes.add(rows)

    def finish(self) -> tuple[float, LogReport]:
        """Sampling rate in Hz and the counts; raises `FileFormatError` if there is no rate."""
        path = self._reader.path
        if self.counts["rows"] < 2:
            raise FileFormatError(f"{path} has one row: a time log needs two at least to have a sampling rate")
        longest = LOG_GAP_STEPS * self._steps.median()
        if math.isnan(longest):
            raise FileFormatError(f"{path}: all rows have the time {self._last:g} s, so there is no sampling rate")
        step, gaps = self._steps.split(longest)
        if not SHORTEST_STEP_S <= step <= LONGEST_STEP_S:
            raise FileFormatError(f"{path}: steps of t_s of {step:g} s on average; are these times in s?")
        # Rows of a packet share its time: the sampling rate is the rate of the rows.
        bunched = 2 * self.counts["duplicates"] > self.counts["rows"]
        step *= 1 - bunched * self.counts["duplicates"] / self.counts["rows"]
        beyond = [f"{self.counts['unbelievable']} cells hold numbers beyond {LARGEST_READING:g}: they count as missing"]
        shared = [f"most rows share their t_s with the row before: they are taken as {1 / step:.4g} Hz, spread evenly"]
        notes = (*shared[: int(bunched)], *beyond[: self.counts["unbelievable"]], *self._reader.notes)
        sizes = tuple(self.sizes.notes(self._reader.called))
        return 1 / step, LogReport(gaps=gaps, notes=notes, sizes=sizes, **self.counts)


class TimeLogFile:
    """A time log that is read block by block: opening it checks the whole file; `blocks` can then be called repeatedly.

    Use it as a context manager. gauge_names : sorted by number. optional : the columns of `TIME_OPTIONAL` in the file,
    then those of `more`, which must be there.
    sample_rate_Hz, report : as in `TimeLog`. noise : column name -> standard deviation of its white noise, NaN if it
    cannot be estimated.

    lever_mm : lever arm of a column `torque_Nmm`, which becomes tangential_N. progress : called with the number of rows
    read so far. covered_N : largest force of the calibration, if there is one: a force far above it may be in gf.
    whole : refuse a log that is known not to fit into memory as a whole (`MemoryEstimateError`).
    Raises what `read_time_log` raises.
    """

    def __init__(
        self,
        path: Any,
        progress: Callable[[int], None] = lambda rows: None,
        *,
        lever_mm: float | None = None,
        log_map: LogMap | str | Path | None = None,
        more: tuple[str, ...] = (),
        covered_N: float | None = None,
        whole: bool = False,
    ):
        self._reader, self.gauge_names = open_log(
            path, ("t_s", *more), (*TIME_OPTIONAL, TORQUE_COLUMN), log_map=log_map
        )
        try:
            if whole:
                self._reader.check_fits()
            self._lever = _lever(self._reader, lever_mm)
            self._scan = partial(_Scan, self._reader, self.gauge_names, self._lever, more, covered_N)
            scan = self._scan()
            for block in self._reader.blocks():
                scan.add(block)
                progress(scan.counts["rows"])
                if self._reader.live and scan.counts["rows"] >= PREAMBLE_ROWS:
                    break
            self.sample_rate_Hz, self.report = scan.finish()
        except BaseException:
            self._reader.__exit__()
            raise
        self.optional = scan.used[len(self.gauge_names) :]
        self.noise = dict(zip(scan.used, scan.noise.sigma, strict=True))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._reader.__exit__()

    @property
    def path(self) -> Path:
        """The file, or the name that messages give a frame."""
        return self._reader.path

    @property
    def live(self) -> bool:
        """Whether this is standard input: its rows come once, and `report` is of the rows so far."""
        return self._reader.live

    def blocks(self) -> Iterator[np.ndarray]:
        """Blocks (n, 1 + gauges + optional columns) of the counted rows: time, readings, optional columns.

        Cells without a finite number, or beyond `checks.LARGEST`, are NaN. Of standard input they come as they
        are there, and raise what opening a file raises.
        """
        remaining, scan = self.report.rows, self._scan()
        blocks = self._reader.blocks()
        if self.live:
            self._reader.once()
        names = ("t_s", *self.gauge_names, *self.optional)
        for block in blocks:
            rows = believable(rows_of(block, names, self._lever))
            if self.live:
                scan.add(block)
                yield rows
                continue
            yield rows[:remaining]
            remaining -= len(block)
            if remaining <= 0:
                return
        self.report = scan.finish()[1] if self.live else self.report


def rows_of(block: Table, names: tuple[str, ...], lever_mm: float | None) -> np.ndarray:
    """Rows (n, columns) of a block; with a lever arm in mm, tangential_N is torque (N mm) / lever arm, in N."""
    columns = dict(block.columns)
    if lever_mm is not None:
        columns["tangential_N"] = columns[TORQUE_COLUMN] / lever_mm
    return np.column_stack([columns[name] for name in names])


def _lever(reader: Reader, lever_mm: float | None) -> float | None:
    """The lever arm, if the log has a torque; raises `FileFormatError` if one is there without the other."""
    if lever_mm is None:
        if TORQUE_COLUMN in reader.names:
            problem = f"column {TORQUE_COLUMN} needs its lever arm (--lever-mm), the distance from its axis to the skin"
            raise FileFormatError(f"{reader.path}, line 1: {problem}")
        return None
    checks.positive("lever_mm", lever_mm)
    if TORQUE_COLUMN not in reader.names:
        raise FileFormatError(f"{reader.path}, line 1: a lever arm is given, but there is no column {TORQUE_COLUMN}")
    if "tangential_N" in reader.names:
        raise FileFormatError(f"{reader.path}, line 1: give one of tangential_N and {TORQUE_COLUMN}, not both")
    return lever_mm


def read_time_log(path: Any, *, lever_mm: float | None = None, log_map: LogMap | str | Path | None = None) -> TimeLog:
    """Read a log `t_s,g1[,g2,...]` with any of `force_N,velocity_mm_s,position_mm,tangential_N`.

    A log with tangential_N needs no gauges. Cells without a finite number up to `checks.LARGEST` become NaN and
    are counted; their rows stay.

    Parameters
    ----------
    path : of a file (CSV, TSV, .gz, Parquet), or a frame: a dict of columns, a structured array, pandas, polars.
    lever_mm : distance from the axis of `torque_Nmm`, which may stand in place of tangential_N, to the skin.
    log_map : meaning of the columns, or its file; None takes `log_map.toml` beside the log, if there is one.

    Raises `FileAccessError` or `FileFormatError` for what `TableReader` refuses, a missing or misspelt
    column, fewer than two rows, a time that is no number or earlier than the one before, or equal times in all rows.
    """
    with TimeLogFile(path, lever_mm=lever_mm, log_map=log_map, whole=True) as file:
        rows = np.concatenate(list(file.blocks()))
    gauges = len(file.gauge_names)
    optional: dict[str, np.ndarray | None] = dict.fromkeys(TIME_OPTIONAL)
    optional |= zip(file.optional, rows.T[1 + gauges :], strict=True)
    return TimeLog(
        t_s=rows[:, 0],
        readings=rows[:, 1 : 1 + gauges],
        gauge_names=file.gauge_names,
        **optional,
        sample_rate_Hz=file.sample_rate_Hz,
        report=file.report,
    )
