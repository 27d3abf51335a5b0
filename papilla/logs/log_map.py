"""Log map: a TOML file that gives meaning and unit of the columns of a foreign log; and papilla's quantities, with the
units and names that labs use.

```toml
decimal = ","                 # also delimiter = ";", header_line = 3, if papilla does not find them by itself
speed_mm_s = 50.0             # a constant speed, if there is no column of it
air_s = [0.0, 1.2]            # time in the air before the touch: the mean there is the zero of gauges and force

[columns]
t_s = { column = "time", unit = "ms" }
force_N = { column = "Fz", unit = "gf" }
g1 = { column = "ch1", unit = "mV/V", gauge_factor = 2.1, active_arms = 1 }
g2 = { column = "ch2", unit = "counts", bits = 16, span_V = 5.0, amplification = 500.0, excitation_V = 2.5, gauge_factor = 2.1 }
g3 = { topic = "/gauges", column = "data[2]", unit = "microstrain" }     # of a bag: topic and field
```

The keys of `[columns]` are papilla's columns. The output of an amplifier becomes strain by the equation of a Wheatstone
bridge at small strain, e = 4 V_out / (active_arms gauge_factor V_excitation).
"""  # noqa: E501

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from papilla.core import checks
from papilla.core.errors import FileFormatError, InputError
from papilla.core.file_models import first_of, in_words, keys_of, table
from papilla.core.outside import read_toml
from papilla.core.rows import LONGEST_CELL
from papilla.core.tables import closest
from papilla.core.units import (
    MICROSTRAIN_PER_STRAIN,
    MM_PER_CM,
    PER_CENT,
    S_PER_MIN,
    SI_KILO,
    SI_MEGA,
    SI_MICRO,
    SI_MILLI,
    SI_NANO,
    gf_to_newton,
)

_TIMES = {"s": 1.0, "ms": SI_MILLI, "us": SI_MICRO, "ns": SI_NANO, "min": S_PER_MIN}
_NEWTON = {"N": 1.0, "mN": SI_MILLI, "kN": SI_KILO}
_FORCES = _NEWTON | {"gf": gf_to_newton(1.0), "g": gf_to_newton(1.0), "kgf": gf_to_newton(SI_KILO)}
_LENGTHS = {"mm": 1.0, "um": SI_MILLI, "cm": MM_PER_CM, "m": SI_KILO}
_SPEEDS = {f"{unit}/s": factor for unit, factor in _LENGTHS.items()}
_PRESSURES = {"MPa": 1.0, "kPa": SI_MILLI, "Pa": SI_MICRO, "GPa": SI_KILO}
_TORQUES = {"Nmm": 1.0, "mNm": 1.0, "Ncm": MM_PER_CM, "Nm": SI_KILO}
ISO_TIME = "iso"
"""Unit of a time written as date and time (2026-05-04T12:30:00.001, also with a zone: +02:00)."""
STRAIN_UNITS = {"microstrain": 1.0, "ue": 1.0, "um/m": 1.0, "strain": SI_MEGA, "m/m": SI_MEGA, "%": SI_MEGA / PER_CENT}
BRIDGE_UNITS = ("mV/V", "V", "counts")
"""Units of an amplifier's output; the gauge factor converts it to strain (`Column`)."""


@dataclass(frozen=True)
class ColumnMeaning:
    """units : name -> factor to the unit of papilla's column. words : names that labs give it, in small letters."""

    units: Mapping[str, float]
    words: tuple[str, ...]

    @property
    def own_unit(self) -> str:
        """The unit of papilla's column; for a column of text the only one in its list."""
        return next((unit for unit, factor in self.units.items() if factor == 1), next(iter(self.units)))


LOG_QUANTITIES = {
    "t_s": ColumnMeaning(_TIMES | {ISO_TIME: 1.0}, ("t", "time", "timestamp", "stamp", "elapsed", "zeit")),
    "force_N": ColumnMeaning(
        _FORCES, ("force", "fz", "fn", "load", "normal_force", "normal", "kraft", "loadcell", "normalkraft")
    ),
    "tangential_N": ColumnMeaning(_FORCES, ("tangential", "ft", "fx", "shear", "tangential_force", "friction_force")),
    "torque_Nmm": ColumnMeaning(_TORQUES, ("torque", "moment", "tz", "mz", "my")),
    "velocity_mm_s": ColumnMeaning(_SPEEDS, ("velocity", "speed", "vel", "v", "vx", "geschwindigkeit")),
    "position_mm": ColumnMeaning(_LENGTHS, ("position", "pos", "stage", "encoder", "travel", "weg")),
    "indentation_mm": ColumnMeaning(_LENGTHS, ("indentation", "depth", "displacement", "z")),
    "modulus_MPa": ColumnMeaning(_PRESSURES, ("modulus", "e", "young", "youngs_modulus", "stiffness")),
    "modulus_sigma_MPa": ColumnMeaning(_PRESSURES, ("modulus_sigma",)),
    "thickness_mm": ColumnMeaning(_LENGTHS, ("thickness",)),
    "radius_mm": ColumnMeaning(_LENGTHS, ("radius",)),
    "x_mm": ColumnMeaning(_LENGTHS, ("x",)),
    "y_mm": ColumnMeaning(_LENGTHS, ("y",)),
    "sd_microstrain": ColumnMeaning(STRAIN_UNITS, ("sd", "s_d")),
    "specimen": ColumnMeaning({"text": 1.0}, ("specimen",)),
}
"""Papilla's column -> its quantity; gauges g1, g2, ... are those of `CHANNEL_QUANTITY`."""

CHANNEL_QUANTITY = ColumnMeaning(
    STRAIN_UNITS | dict.fromkeys(BRIDGE_UNITS, 1.0), ("g", "ch", "channel", "gauge", "strain", "sg", "dms", "ai")
)

# No part can match where its neighbour does: the time is proportional to the length of a name
_BRACKETS = re.compile(r"(?P<stem>.*)(?:\[(?P<a>[^\[\]]+)\]|\((?P<b>[^()]+)\)|\s/\s(?P<c>[^\s\[\]()]+))\s*", re.DOTALL)
GAUGE_DIGITS = 3
"""Most digits of a gauge's number in a foreign log; a longer number is no count of gauges."""


def quantity_of(column: str) -> ColumnMeaning:
    """The quantity of one of papilla's columns, `LOG_QUANTITIES` or a gauge."""
    return LOG_QUANTITIES.get(column, CHANNEL_QUANTITY)


def split_unit(name: str) -> tuple[str, str | None]:
    """Name and unit of "Fz [N]", "time(s)", "force / N", "force_gf" or "speed_mm_s"; None if there is no unit.

    A part after an underscore counts as a unit only if some quantity has exactly this unit.
    """
    if (match := _BRACKETS.fullmatch(name)) is not None:
        unit = next(unit for unit in match.group("a", "b", "c") if unit)
        return match["stem"].rstrip("_ \t\r\n").strip(), plain_unit(unit)
    parts = name.split("_")
    for count in (2, 1):
        unit = plain_unit("/".join(parts[-count:]))
        if len(parts) > count and is_unit(unit):
            return "_".join(parts[:-count]), unit
    return name, None


def is_unit(text: str) -> bool:
    """Whether a text is a unit of some quantity."""
    return any(plain_unit(text) in quantity.units for quantity in (*LOG_QUANTITIES.values(), CHANNEL_QUANTITY))


def plain_unit(unit: str) -> str:
    """A unit in the spelling of `LOG_QUANTITIES`: u for micro, no spaces, points or powers of -1."""
    text = re.sub(r"[\s.·*]", "", unit).replace("µ", "u").replace("μ", "u").replace("s^-1", "/s").replace("ε", "e")
    return {"uStrain": "microstrain", "ustrain": "microstrain", "grams": "g", "sec": "s"}.get(text, text)


def split_number(name: str) -> tuple[str, int | None]:
    """Stem in small letters and number of "Strain 3" or "ch1"; None if there is no number."""
    name = name.strip()
    stem = name.rstrip("0123456789")
    digits = name[len(stem) :]
    number = int(digits) if 0 < len(digits) <= GAUGE_DIGITS else None
    words = name if number is None else stem
    return re.sub(r"[\s_.-]+", "_", words.strip().lower()).removesuffix("_" if number is not None else ""), number


def column_meant(stem: str) -> str | None:
    """Papilla's column for a lab's name without its unit; None if no quantity has this name."""
    word, number = split_number(stem)
    if number is not None:
        return f"g{number}" if word in CHANNEL_QUANTITY.words and number > 0 else None
    return next((column for column, quantity in LOG_QUANTITIES.items() if word in quantity.words), None)


MAP_FILE_NAME = "log_map.toml"
"""Name under which a map in the folder of a log is found."""
GAUGE_COLUMN = re.compile(r"g[1-9][0-9]{0,3}")

CHANNEL_BOUNDS = {
    "gauge_factor": (0.1, 1000.0),  # metal foil has 2, semiconductors up to 200
    "active_arms": (0.1, 4.0),  # a bridge has four arms; Poisson's arms count as a part
    "amplification": (1e-3, 1e6),  # between a divider and the highest gain of instrumentation amplifiers
    "excitation_V": (1e-3, 1e3),  # bridges have 1 to 10 V
    "bits": (1, 64),  # converters have up to 32
    "span_V": (1e-6, 1e4),  # converters have 1 mV to 20 V
}
"""Smallest and largest value of each number of a column: beyond them it is in another unit, or a slip."""
FASTEST_CONSTANT_MM_S = 1e6
"""Largest constant speed (mm/s), three times that of sound: no finger slides so fast."""
LONGEST_TIME_S = 1e11
"""Largest time (s): 3000 years, more than the seconds since 1970 of any log."""
LAST_HEADER_LINE = 1000
"""Largest number of the line of a header: programs write some dozens of lines above it."""


@dataclass(frozen=True)
class Column:
    """A column of a log: its name and unit, and for the output of an amplifier the constants that convert it to strain.

    unit : one of the quantity's units in `papilla.logs.log_map.QUANTITIES`. gauge_factor, active_arms : of the bridge
    (1 quarter, 2 half, 4 full). amplification, excitation_V : for voltages and counts. bits, span_V : of the converter,
    one count is `span_V / 2**bits` V. topic : of a bag, where `column` is a field of its messages. Raises `InputError`
    for a number outside `CHANNEL_BOUNDS`, and for a name longer than `LONGEST_NAME`.
    """

    column: str
    unit: str
    gauge_factor: float | None = None
    active_arms: float = 1.0
    amplification: float = 1.0
    excitation_V: float | None = None
    bits: int | None = None
    span_V: float | None = None
    topic: str | None = None

    @property
    def name(self) -> str:
        """The column as the reader calls it."""
        return f"{self.topic}:{self.column}" if self.topic else self.column

    def __post_init__(self) -> None:
        for name, (low, high) in CHANNEL_BOUNDS.items():
            if (value := getattr(self, name)) is not None:
                checks.within(name, value, low, high)
        for name in ("column", "topic"):
            if (length := len(getattr(self, name) or "")) > LONGEST_CELL:
                raise InputError(f"{name} has {length} characters; at most {LONGEST_CELL} are a name")

    def factor(self, to: str) -> float:
        """Factor from the log's unit to that of papilla's column `to`; raises `InputError` for an unfit unit."""
        units = quantity_of(to).units
        if self.unit not in units:
            meant = closest(self.unit, [*units])
            hint = f"; did you mean {meant}?" if meant else ""
            raise InputError(f"columns.{to}: unit must be one of {', '.join(units)}, got {self.unit!r}{hint}")
        if to in LOG_QUANTITIES or self.unit not in BRIDGE_UNITS:
            return units[self.unit]
        needed = {"mV/V": (), "V": ("excitation_V",), "counts": ("excitation_V", "bits", "span_V")}[self.unit]
        for name in ("gauge_factor", *needed):
            if getattr(self, name) is None:
                raise InputError(f"columns.{to}: a gauge in {self.unit} needs {name}")
        ratio = 1e-3 if self.unit == "mV/V" else 1 / (self.excitation_V * self.amplification)  # type: ignore[operator]
        if self.unit == "counts":
            ratio *= self.span_V / 2**self.bits  # type: ignore[operator]
        return MICROSTRAIN_PER_STRAIN * ratio * 4 / (self.active_arms * self.gauge_factor)  # type: ignore[operator]


@dataclass(frozen=True)
class LogMap:
    """Meaning and units of the columns of a log.

    columns : papilla's column -> column of the log. delimiter, decimal, header_line : of the text; None lets papilla
    find them. speed_mm_s : a constant speed. air_s : (from, to) in s, in the air before the touch. path : of the map.
    Raises `InputError` for unknown columns and units, and for numbers out of bounds.
    """

    columns: Mapping[str, Column] = field(default_factory=dict)
    delimiter: str | None = None
    decimal: str | None = None
    header_line: int = 1
    speed_mm_s: float | None = None
    air_s: tuple[float, float] | None = None
    path: Path | None = None

    def __post_init__(self) -> None:
        for name, column in self.columns.items():
            if name not in LOG_QUANTITIES and not GAUGE_COLUMN.fullmatch(name):
                meant = closest(name, [*LOG_QUANTITIES])
                hint = (
                    f"; did you mean {meant}?" if meant else f": papilla knows {', '.join(LOG_QUANTITIES)}, g1, g2, ..."
                )
                raise InputError(f"columns.{name} is no column of papilla{hint}")
            column.factor(name)
        if self.decimal not in (None, ".", ",") or self.delimiter not in (None, ",", ";", "\t", " "):
            raise InputError('decimal must be "." or ",", delimiter ",", ";", "\\t" or " "')
        checks.within("header_line", self.header_line, 1, LAST_HEADER_LINE)
        if self.air_s is not None:
            first, last = (checks.within("air_s", value, -LONGEST_TIME_S, LONGEST_TIME_S) for value in self.air_s)
            if first >= last:
                raise InputError(f"air_s must rise, got {first:g} and {last:g}")
        if self.speed_mm_s is not None:
            checks.within("speed_mm_s", self.speed_mm_s, -FASTEST_CONSTANT_MM_S, FASTEST_CONSTANT_MM_S)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> "LogMap":
        """Read a map; raises `FileAccessError`, or `FileFormatError` with the key that is wrong."""
        return cls.of(read_toml(path, "log map"), Path(path))

    @classmethod
    def of(cls, tables: Mapping[str, Any], path: Path) -> "LogMap":
        """A map from the tables of its file; raises `FileFormatError` with the key that is wrong."""
        try:
            return _ADAPTER.validate_python({"columns": {}} | dict(tables) | {"path": path})
        except ValidationError as error:
            raise FileFormatError(f"{path}: {in_words(first_of(error))}") from error

    @classmethod
    def beside(cls, log: Path) -> "LogMap | None":
        """The map in the folder of a log, None if there is none; raises what `load` raises."""
        path = log.with_name(MAP_FILE_NAME)
        return cls.load(path) if path.is_file() else None


_COLUMN_KEYS = keys_of(Column)
_COLUMNS: Any = dict.__class_getitem__((str, table(Column, _COLUMN_KEYS, strict_keys=True)))
_MAP_KEYS = keys_of(LogMap, columns=_COLUMNS, path=Any, air_s=tuple[float, float])
_ADAPTER: TypeAdapter[LogMap] = TypeAdapter(table(LogMap, _MAP_KEYS, strict_keys=True))
