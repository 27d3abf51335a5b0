"""Logs of presses on specimens of known modulus, one press per row.

Silicone dissipates energy, so a finger is calibrated on loading alone. In a log with `t_s`, consecutive rows on one
specimen are one touch. A row belongs to loading if its force exceeds that of the row before.
"""

from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from papilla.core.checks import LARGEST_READING
from papilla.core.errors import FileFormatError
from papilla.core.rows import Table
from papilla.core.short_repr import short_repr
from papilla.core.tables import write_table
from papilla.core.units import PER_CENT
from papilla.logs.columns import check_finite, open_log
from papilla.logs.log_map import LogMap
from papilla.logs.statistics import of_presses
from papilla.model.specimen import SPECIMEN_KINDS, THICKNESS_MM, Block, Specimen

USUAL_FORCE_ERROR = 0.01
"""Relative error of the force of a usual bench."""
PRESS_OPTIONAL = ("indentation_mm", "x_mm", "y_mm", "sd_microstrain", "t_s")
SPECIMEN_COLUMNS = ("specimen", "thickness_mm", "radius_mm", "modulus_sigma_MPa")
"""Columns that describe the specimen of a press: its kind, its dimension, and the standard deviation of its modulus."""

SPECIMEN_DIMENSIONS: dict[str, str | None] = {"block": "thickness_mm", "half-space": None, "sphere": "radius_mm"}
SD_TOLERANCE = 0.01
"""Relative difference by rounding between a stated S_d and that of the gauges (ddof 0); ddof 1 would differ by 12 %."""


HELD_FORCE_RISE = 0.005
"""Relative rise of the force between two rows up to which the force is held, not raised: noise of a force sensor."""

RETURNED_FORCE_SHARE = 0.2
"""Share of its largest force to which a touch must return for its loop to count as closed."""


@dataclass(frozen=True)
class Loop:
    """A touch with loading and unloading: modulus of the specimen (MPa), largest force (N), and the lost work.

    lost_N_mm : area of the loop of force over indentation. share : this area over the work of loading.
    """

    modulus_MPa: float
    force_N: float
    lost_N_mm: float
    share: float


@dataclass(frozen=True, eq=False)
class PressLog:
    """Presses on specimens of known modulus, one press per row.

    Parameters
    ----------
    force_N, modulus_MPa : (n,), > 0.
    readings : (n, g) in microstrain, all finite.
    gauge_names : the g column names, sorted by number.
    indentation_mm : (n,) > 0, or None.
    x_mm, y_mm : (n,) touch-down points, or None.
    specimens, on : the different specimens (of 1 MPa), and (n,) the number of each press's specimen in that list; empty
        and None if the log does not name specimens.
    modulus_sigma_MPa : (n,) standard deviations of the specimens' moduli, 0 if exact, or None.
    stated_sd : (n,) S_d in microstrain of a log without gauge readings (g = 0), else None.
    t_s : (n,) rising times, or None. loops : of the touches with loading and unloading.
    notes : for the user, a sentence each. sizes : those on columns that seem to have another unit.
    """

    force_N: np.ndarray
    modulus_MPa: np.ndarray
    readings: np.ndarray
    gauge_names: tuple[str, ...]
    indentation_mm: np.ndarray | None = None
    x_mm: np.ndarray | None = None
    y_mm: np.ndarray | None = None
    notes: tuple[str, ...] = ()
    sizes: tuple[str, ...] = ()
    t_s: np.ndarray | None = None
    loops: tuple[Loop, ...] = ()
    specimens: tuple[Specimen, ...] = ()
    on: np.ndarray | None = None
    modulus_sigma_MPa: np.ndarray | None = None
    stated_sd: np.ndarray | None = None
    __repr__ = short_repr

    def __len__(self) -> int:
        return len(self.force_N)

    @cached_property
    def sd_microstrain(self) -> np.ndarray:
        """(n,) population standard deviation (ddof 0) of the readings of each press, or the stated one."""
        return self.readings.std(axis=1) if self.stated_sd is None else self.stated_sd

    def to_csv(self, path: str | Path) -> None:
        """Write the presses and their S_d as a file for `read_presses`; raises `FileAccessError`."""
        columns: dict[str, Any] = {"force_N": self.force_N, "modulus_MPa": self.modulus_MPa}
        columns |= dict(zip(self.gauge_names, self.readings.T, strict=True))
        for name in PRESS_OPTIONAL:
            if (column := getattr(self, name)) is not None:
                columns[name] = column
        if self.on is not None:
            touched = [self.specimens[number] for number in self.on]
            columns["specimen"] = [_kind(specimen) for specimen in touched]
            for name in ("thickness_mm", "radius_mm"):
                columns[name] = np.array([getattr(specimen, name.removesuffix("_mm"), np.nan) for specimen in touched])
        if self.modulus_sigma_MPa is not None:
            columns["modulus_sigma_MPa"] = self.modulus_sigma_MPa
        write_table(path, columns)


def read_presses(
    path: Any,
    *,
    whole: bool = False,
    mixed: Specimen | None = None,
    sd_alone: bool = False,
    log_map: LogMap | str | Path | None = None,
) -> PressLog:
    """Read a bench log `force_N,modulus_MPa,g1[,g2,...]` with any of `indentation_mm,x_mm,y_mm,sd_microstrain,t_s`.

    Parameters
    ----------
    path, log_map : as of `read_time_log`.
    whole : keep all rows of a log with `t_s`. By default only the rows of loading are kept; `notes` and `loops` report
        the others.
    mixed : specimen of presses for which the log names none; with it the log may have the columns `SPECIMEN_COLUMNS`.
    sd_alone : the log may have `sd_microstrain` instead of gauges; with `mixed` it always may.

    Raises `FileAccessError` or `FileFormatError` for what `papilla.core.tables.TableReader` refuses, a missing or
    misspelt column, fewer than two presses, a cell without a finite number up to `papilla.core.checks.LARGEST`, a
    force, modulus or indentation that is not positive, an `sd_microstrain` that is not the population standard
    deviation of the gauges, a `t_s` that does not rise, or a specimen without its dimension or with that of another
    kind.
    """
    instead = ("sd_microstrain",) if sd_alone or mixed is not None else ()
    optional = (*PRESS_OPTIONAL, *SPECIMEN_COLUMNS)
    reader, gauges = open_log(path, ("force_N", "modulus_MPa"), optional, SPECIMEN_COLUMNS[:1], instead, log_map)
    with reader:
        table = reader.whole()
    if len(table) < 2:
        raise FileFormatError(f"{table.path} has one row: one press is too few to fit anything")
    check_finite(table, tuple(name for name in table.columns if name not in SPECIMEN_COLUMNS), LARGEST_READING)
    for name in ("force_N", "modulus_MPa", "indentation_mm"):
        if name in table.columns and (table.columns[name] <= 0).any():
            index = int(np.argmax(table.columns[name] <= 0))
            raise table.fault(index, name, f"must be greater than 0, got {table.columns[name][index]:g}")
    columns: dict[str, Any] = dict(table.columns)
    of_specimens = {name: columns.pop(name) for name in SPECIMEN_COLUMNS if name in columns}
    if of_specimens and mixed is None:
        name = next(iter(of_specimens))
        raise FileFormatError(
            f"{table.path}: column {name}: presses on specimens of their own are for papilla identify"
        )
    readings = np.column_stack([columns.pop(name) for name in gauges] or [np.zeros((len(table), 0))])
    stated = columns.pop("sd_microstrain", None)
    if mixed is not None:
        columns |= _specimens(table, of_specimens, mixed)
    log = PressLog(
        readings=readings, gauge_names=gauges, notes=reader.notes, stated_sd=None if gauges else stated, **columns
    )
    _check_sd(table, log, stated)
    log = replace(
        log, sizes=(*of_presses(log.readings, log.force_N, log.modulus_MPa, log.indentation_mm, reader.called),)
    )
    if log.t_s is None:
        return log
    if (late := np.diff(log.t_s) <= 0).any():
        index = int(np.argmax(late)) + 1
        raise table.fault(index, "t_s", f"must rise, got {log.t_s[index]:g} after {log.t_s[index - 1]:g}")
    return log if whole else loaded_part(log)


def _kind(specimen: Specimen) -> str:
    return next(name for name, specimen_type in SPECIMEN_KINDS.items() if type(specimen) is specimen_type)


def _check_sd(table: Table, log: PressLog, stated: np.ndarray | None) -> None:
    sd = log.sd_microstrain
    if stated is not None and (wrong := np.abs(stated - sd) > np.maximum(SD_TOLERANCE * sd, 0.5)).any():
        index = int(np.argmax(wrong))
        problem = f"{stated[index]:g} is not the population standard deviation of the gauges, {sd[index]:g}"
        raise table.fault(index, "sd_microstrain", problem)
    if log.stated_sd is not None and (sd <= 0).any():
        index = int(np.argmax(sd <= 0))
        raise table.fault(index, "sd_microstrain", f"must be greater than 0, got {sd[index]:g}")


def _specimens(table: Table, columns: dict[str, np.ndarray], otherwise: Specimen) -> dict[str, Any]:
    """`specimens`, `on` and `modulus_sigma_MPa` of a table; an empty cell means the specimen `otherwise`."""
    described: dict[str, Any] = {}
    if (sigma := columns.get("modulus_sigma_MPa")) is not None:
        if (wrong := ~(sigma >= 0) | ~np.isfinite(sigma)).any():
            index = int(np.argmax(wrong))
            raise table.fault(index, "modulus_sigma_MPa", f"expected a number of at least 0, got {sigma[index]:g}")
        described["modulus_sigma_MPa"] = sigma
    if not {*columns} - {"modulus_sigma_MPa"}:
        return described
    touched = [_specimen(table, index, columns, otherwise) for index in range(len(table))]
    kinds = tuple(dict.fromkeys(touched))
    return described | {"specimens": kinds, "on": np.array([kinds.index(specimen) for specimen in touched])}


def _specimen(table: Table, index: int, columns: dict[str, np.ndarray], otherwise: Specimen) -> Specimen:
    """The specimen of a row, with 1 MPa: of the named kind, or of the kind that has the given dimension."""
    measures = {name: float(columns[name][index]) for name in ("thickness_mm", "radius_mm") if name in columns}
    measures = {name: value for name, value in measures.items() if not np.isnan(value)}
    shape = str(columns["specimen"][index]) if "specimen" in columns else ""
    if shape not in ("", *SPECIMEN_DIMENSIONS):
        raise table.fault(index, "specimen", f"expected {', '.join(SPECIMEN_DIMENSIONS)}, got {shape!r}")
    if not shape and not measures:
        return replace(otherwise, modulus=1.0)
    shape = shape or ("sphere" if "radius_mm" in measures else "block")
    for name, value in measures.items():
        if name != SPECIMEN_DIMENSIONS[shape]:
            raise table.fault(index, name, f"a {shape} has none, got {value:g}: leave the cell empty")
        if not 0 < value < np.inf:
            raise table.fault(index, name, f"must be greater than 0, got {value:g}")
    if measures or SPECIMEN_DIMENSIONS[shape] is None:
        return SPECIMEN_KINDS[shape](1.0, *measures.values())
    if shape != "block":
        raise table.fault(index, "specimen", f"a {shape} needs its {SPECIMEN_DIMENSIONS[shape]}")
    return replace(otherwise, modulus=1.0) if isinstance(otherwise, Block) else Block(1.0, THICKNESS_MM)


def loaded_part(log: PressLog) -> PressLog:
    """The rows of loading of a log over time, with notes on the other rows, and the loops.

    Raises `FileFormatError` if fewer than two rows load the finger.
    """
    loaded = loading(log.force_N, log.modulus_MPa)
    if loaded.all():
        return log
    if loaded.sum() < 2:
        raise FileFormatError(f"only {loaded.sum()} of {len(log)} rows load the finger: too few to fit anything")
    closed = () if log.indentation_mm is None else loops(log.force_N, log.modulus_MPa, log.indentation_mm)
    note = f"{len(log) - loaded.sum()} of {len(log)} rows hold or unload the finger (t_s): the fit is of loading alone"
    lost = [
        f"a loop to {loop.force_N:.3g} N on {loop.modulus_MPa:g} MPa lost {loop.lost_N_mm:.3g} N mm, "
        f"{PER_CENT * loop.share:.2g} % of the work of loading"
        for loop in closed
    ]
    values = {item.name: getattr(log, item.name) for item in fields(log)}
    columns = {name: value[loaded] for name, value in values.items() if isinstance(value, np.ndarray)}
    return replace(log, **columns, notes=(*log.notes, note, *lost), loops=closed)


def touches(modulus_MPa: np.ndarray) -> list[np.ndarray]:
    """Row numbers of each touch: consecutive rows on a specimen of one modulus."""
    starts = np.flatnonzero(np.diff(modulus_MPa) != 0) + 1
    return np.split(np.arange(len(modulus_MPa)), starts)


def loading(force_N: np.ndarray, modulus_MPa: np.ndarray) -> np.ndarray:
    """(n,) bool: rows with a higher force than the row before, and the first row of each touch."""
    rising = np.zeros(len(force_N), bool)
    for rows in touches(modulus_MPa):
        force = force_N[rows]
        rising[rows] = np.concatenate([[True], force[1:] > (1 + HELD_FORCE_RISE) * force[:-1]])
    return rising


def loops(force_N: np.ndarray, modulus_MPa: np.ndarray, indentation_mm: np.ndarray) -> tuple[Loop, ...]:
    """The loops of all touches that return to `RETURNED_FORCE_SHARE` of their largest force."""
    closed = []
    for rows in touches(modulus_MPa):
        force, depth = force_N[rows], indentation_mm[rows]
        top = int(np.argmax(force))
        if len(rows) < 4 or top == 0 or force[-1] > RETURNED_FORCE_SHARE * force[top]:
            continue
        taken = float(np.trapezoid(force[: top + 1], depth[: top + 1]))
        returned = -float(np.trapezoid(force[top:], depth[top:]))
        if taken > 0:
            lost = taken - returned
            closed.append(Loop(float(modulus_MPa[rows[0]]), float(force[top]), lost, lost / taken))
    return tuple(closed)
