"""Proposes a log map: what the columns of a foreign log probably are, with the reason for each guess.

A column is recognised by its name or a word of it, the unit in its name, and the size of its numbers. Messages of a bag
are taken to be in SI units, as ROS demands. A column that is not recognised is listed but left out of the map, so that
a person decides.
"""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from papilla.core.errors import FileFormatError, one_line
from papilla.core.files import toml_value
from papilla.core.outside import toml
from papilla.core.tables import TableReader
from papilla.logs.columns import instants, is_bag, unmapped
from papilla.logs.frames import PARQUET_SUFFIXES
from papilla.logs.log_map import (
    BRIDGE_UNITS,
    CHANNEL_QUANTITY,
    ISO_TIME,
    LOG_QUANTITIES,
    Column,
    LogMap,
    column_meant,
    quantity_of,
    split_number,
    split_unit,
)
from papilla.logs.statistics import DEPTH_ABOVE_MM, FORCE_ABOVE_N, MODULUS_ABOVE_MPA, SPEED_BELOW_MM_S, STRAIN_BELOW

HEAD_ROWS = 2000
"""Number of rows that are read for the size of the numbers."""

HEAD_CELLS = 50 * HEAD_ROWS
"""Number of cells that are read at most for it: a wide table has fewer rows read."""

RATES_HZ = 8.0, 60_000.0
"""Lowest and highest sampling rate of gauge logs. A time without a unit gets the unit that gives such a rate."""

PROPOSED_COUNTS_FROM = 1500.0
"""Readings that are whole numbers and reach this size are more likely counts of a converter than microstrain."""

LARGEST_IN_UNIT = {
    "force_N": (FORCE_ABOVE_N, "gf"),
    "tangential_N": (FORCE_ABOVE_N, "gf"),
    "indentation_mm": (DEPTH_ABOVE_MM, "um"),
    "modulus_MPa": (MODULUS_ABOVE_MPA, "kPa"),
}
"""Largest numbers that papilla's unit of a column explains, and the unit of larger ones."""

ROS_UNITS = {"position_mm": "m", "velocity_mm_s": "m/s", "indentation_mm": "m", "torque_Nmm": "Nm"}
"""Units of ROS messages where they are not papilla's."""

TELLING_UNITS = dict.fromkeys(("mV/V", "microstrain", "ue", "um/m"), "g") | dict.fromkeys(
    ("mm/s", "um/s", "cm/s", "m/s"), "velocity_mm_s"
)
"""Units that tell what a column is, whatever its name."""

VECTOR_LETTERS = {"force": "f", "torque": "m", "linear": "v"}
"""Vectors in ROS messages, and the letter before the axis in the short name of a component (force.z is fz)."""

LONGEST_COMMENT, MOST_LISTED = 200, 200
"""Most characters of a name in a comment of a map, and most columns that a comment lists."""

MOST_SKIPPED = 60
"""Number of lines that are searched for the header."""


@dataclass(frozen=True)
class Guess:
    """A column of the log, the papilla column that it probably is ("" if not recognised), its unit, and the reason."""

    name: str
    meant: str
    unit: str
    reason: str


@dataclass(frozen=True)
class Proposal:
    """Guesses for the columns in the order of the file, the format of the text, and what a person must decide."""

    path: Path
    guesses: tuple[Guess, ...]
    delimiter: str
    decimal: str
    header_line: int
    open_questions: tuple[str, ...] = field(default=())

    def to_toml(self) -> str:
        """The text of a map, with the reasons as comments. It is read back and compared: raises `FileFormatError` for
        columns that no map can name."""
        name = _comment(self.path.name)
        lines = [f"# What the columns of {name} seem to be: check each line, then", "#"]
        lines += [f"#     papilla estimate {name} --map log_map.toml --out estimates.csv", ""]
        usual = {"delimiter": ",", "decimal": ".", "header_line": 1}
        dialect = {name: getattr(self, name) for name in usual if getattr(self, name) != usual[name]}
        lines += [f"{name} = {toml_value(value)}" for name, value in dialect.items()]
        lines += ["# speed_mm_s = 50.0    # a constant speed, where no column has one"]
        lines += ["# air_s = [0.0, 1.0]   # seconds before the touch: the zero of gauges and force", "", "[columns]"]
        columns = {guess.meant: self._entry(guess) for guess in self.guesses if guess.meant}
        reasons = {guess.meant: guess.reason for guess in self.guesses}
        lines += [f"{meant} = {toml_value(entry)}   # {_comment(reasons[meant])}" for meant, entry in columns.items()]
        rest = [_comment(guess.name) for guess in self.guesses if not guess.meant]
        rest[MOST_LISTED:] = [f"and {len(rest) - MOST_LISTED} more"] if len(rest) > MOST_LISTED else []
        lines += [f"# not used, because they were not recognised: {', '.join(rest)}"] if rest else []
        text = "\n".join([*lines, *(f"# ? {_comment(question)}" for question in self.open_questions)]) + "\n"
        read_back = LogMap.of(toml(text, f"the map of {self.path}"), self.path)
        if read_back != LogMap({meant: Column(**columns[meant]) for meant in columns}, path=self.path, **dialect):
            raise FileFormatError(f"{self.path}: a map cannot express its columns: rename them")
        return text

    def _entry(self, guess: Guess) -> dict[str, Any]:
        """The table of a column in a map, with examples of the numbers of an amplifier."""
        topic, separator, column = guess.name.partition(":")
        in_bag = is_bag(self.path) and bool(separator)
        entry: dict[str, Any] = {"topic": topic, "column": column} if in_bag and topic else {"column": guess.name}
        entry |= {"unit": guess.unit}
        if guess.unit in BRIDGE_UNITS:
            entry |= {"gauge_factor": 2.0, "active_arms": 1}
        if guess.unit in BRIDGE_UNITS[1:]:
            entry |= {"excitation_V": 5.0, "amplification": 1.0}
        return entry | ({"bits": 16, "span_V": 10.0} if guess.unit == "counts" else {})


def _comment(text: str) -> str:
    """A text of the log inside a comment: its beginning, without line ends and control characters."""
    return one_line(text[:LONGEST_COMMENT]) + "..." * (len(text) > LONGEST_COMMENT)


_ALL = (*LOG_QUANTITIES.values(), CHANNEL_QUANTITY)


def propose(path: Path) -> Proposal:
    """Guesses for the columns of a log; raises `FileAccessError`, or `FileFormatError` if there is no table."""
    line = 1 if path.suffix in PARQUET_SUFFIXES or is_bag(path) else _header_line(path)
    with unmapped(path, _all, (), LogMap(header_line=line)) as reader:
        reader.want(_all, tuple(reader.header))
        head = next(reader.blocks(max(2, min(HEAD_ROWS, HEAD_CELLS // len(reader.header)))))
        values = {name: _floats(cells, reader.decimal) for name, cells in head.columns.items()}
        dates = {name for name, cells in head.columns.items() if _is_date(cells)}
        in_bag = is_bag(path)
        guesses = _unique([_guess(name, numbers, name in dates, in_bag) for name, numbers in values.items()])
        unread = (f"{name} is not read: {why}" for name, why in reader.unusable.items() if f"{name}[0]" not in values)
        questions = (*_questions(guesses), *unread)
        return Proposal(path, guesses, reader.delimiter, reader.decimal, line, questions)


def _all(name: str) -> bool:
    """Every column is wanted."""
    return True


def _header_line(path: Path) -> int:
    """Number (from 1) of the first line that two rows of equally many cells, several of them numbers, follow."""
    fault = ""
    for line in range(1, MOST_SKIPPED + 1):
        try:
            with TableReader(path, _all, header_line=line) as reader:
                reader.want(_all, tuple(reader.header))
                rows = next(reader.blocks(2)).columns
                numbers = [np.isfinite(_floats(cells, reader.decimal)).any() for cells in rows.values()]
                are_names = np.isnan(_floats(np.array(reader.header), reader.decimal)).any()
                if are_names and (sum(numbers) > 1 or len(rows) == 1 and all(numbers)):
                    return line
        except FileFormatError as error:
            fault = fault or f" ({str(error).removeprefix(str(path)).lstrip(', :')})"
    raise FileFormatError(
        f"{path}: no table in its first {MOST_SKIPPED} lines: no row of names above rows of numbers{fault}"
    )


def _guess(name: str, values: np.ndarray, is_date: bool, in_bag: bool) -> Guess:
    finite = values[np.isfinite(values)]
    in_bag = in_bag and ":" in name
    if is_date:
        return Guess(name, "t_s", ISO_TIME, "dates and times")
    if not len(finite):
        return Guess(name, "", "", "no numbers")
    # An element of a list: gauges[0] is "gauges 0"
    stem, unit = (name, None) if in_bag else split_unit(re.sub(r"\[([0-9]+)\]\Z", r" \1", name))
    meant = _in_message(*name.split(":", 1)) if in_bag else _meant(stem, unit)
    if not meant:
        return Guess(name, "", "", "unknown name")
    if unit in quantity_of(meant).units:
        return Guess(name, meant, str(unit), "its name has the unit")
    if in_bag and meant in ROS_UNITS:
        return Guess(name, meant, ROS_UNITS[meant], "its name; ROS has SI units")
    sized, reason = _unit_by_size(meant, finite)
    return Guess(name, meant, sized, f"its name; {reason}")


def _meant(stem: str, unit: str | None = None) -> str:
    """Papilla's column for a name, else for a word of it from the last on, else for its unit; "" for none.

    A gauge without a number is "g", one with the number 0 "g0". What has another quantity's unit is not that column.
    """
    if stem in LOG_QUANTITIES:
        return stem
    base, number = split_number(stem)
    words = [word for word in re.split(r"[\W\d_]+", base.lower()) if len(word) > 1]
    for word in (base, *reversed(words)):
        gauge = word in CHANNEL_QUANTITY.words or any(
            word.startswith(candidate) for candidate in ("channel", "gauge", "strain")
        )
        column = ("g" if number is None else f"g{number}") if gauge else column_meant(word)
        if column and (unit in quantity_of(column).units or not any(unit in candidate.units for candidate in _ALL)):
            return column
    return TELLING_UNITS.get(unit or "", "")


def _in_message(topic: str, name: str) -> str:
    """The same for a number in a message: by its field, or by the topic where the field is only called data."""
    if axis := re.search(r"(force|torque|linear)\.([xyz])$", name):
        return _meant(VECTOR_LETTERS[axis[1]] + axis[2])
    stem, number = split_number(name.replace("]", ""))
    stem = topic if stem.startswith("data") else stem.replace("[", "")
    return _meant(stem if number is None else f"{stem} {number}")


def _unit_by_size(meant: str, values: np.ndarray) -> tuple[str, str]:
    """The unit of a column whose name has none, and why."""
    largest = float(np.abs(values).max())
    if meant == "t_s":
        steps = np.diff(values)
        step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0
        for unit in ("s", "ms", "us", "ns"):
            rate = 1 / (step * LOG_QUANTITIES["t_s"].units[unit])
            if RATES_HZ[0] <= rate <= RATES_HZ[1]:
                return unit, f"steps of {step:g} are {rate:.4g} Hz"
        return "s", f"steps of {step:g}: a rate that no unit explains"
    if meant not in LOG_QUANTITIES:
        if largest < STRAIN_BELOW:
            return "strain", f"at most {largest:.2g}"
        integral = bool((values == np.round(values)).all())
        if integral and largest >= PROPOSED_COUNTS_FROM:
            return "counts", f"whole numbers up to {largest:.0f}"
        return "microstrain", f"at most {largest:.3g}"
    limit, larger = LARGEST_IN_UNIT.get(meant, (np.inf, ""))
    if largest > limit:
        larger = "Pa" if meant == "modulus_MPa" and largest > 1e3 * limit else larger
        return larger, f"up to {largest:.3g}, too much in {meant.split('_')[1]}"
    if meant == "velocity_mm_s" and 0 < largest < SPEED_BELOW_MM_S:
        return "m/s", f"up to {largest:.3g}, too slow in mm/s"
    return quantity_of(meant).own_unit, f"up to {largest:.3g}"


def _unique(guesses: list[Guess]) -> tuple[Guess, ...]:
    """Guesses with a number for each gauge; if two columns have one meaning, the first keeps it.

    Gauges that count from 0 count from 1 here. A torque beside the tangential force is not needed.
    """
    first = Counter(guess.meant for guess in guesses)
    shift = 1 if first["g0"] == 1 and not first["g"] else 0
    named = [
        f"g{int(proposed.meant[1:]) + shift}" if re.fullmatch(r"g\d+", proposed.meant) else proposed.meant
        for proposed in guesses
    ]
    taken, result = Counter(named), []
    used = {"torque_Nmm"} if taken["tangential_N"] else set()
    for guess, meant in zip(guesses, named, strict=True):
        if meant in ("g", "g0") or (meant.startswith("g") and meant in used):
            meant = next(f"g{k}" for k in range(1, len(guesses) + 1) if f"g{k}" not in used and not taken[f"g{k}"])
        if meant in used:
            result.append(Guess(guess.name, "", "", f"{meant} is another column already, or not needed beside it"))
            continue
        used |= {meant} - {""}
        result.append(Guess(guess.name, meant, guess.unit, guess.reason))
    return tuple(result)


def _questions(guesses: tuple[Guess, ...]) -> Iterator[str]:
    """What a map still needs and no column gives."""
    meant = {guess.meant for guess in guesses}
    if not meant & {"t_s", "modulus_MPa"}:
        yield "no column seems to be a time (t_s), as an estimate needs, or a modulus (modulus_MPa), as presses need"
    if not any(column.startswith("g") for column in meant):
        yield "no column seems to be a gauge (g1, g2, ...)"
    if "force_N" not in meant:
        yield "no column seems to be a force (force_N): without one there is no modulus"
    if "modulus_MPa" not in meant and not meant & {"velocity_mm_s", "position_mm"}:
        yield "no column seems to be a velocity or a position: state speed_mm_s, or there is no wavelength"
    if "torque_Nmm" in meant:
        yield "a torque needs the lever arm from its axis to the skin: give --lever-mm, or remove the line"
    if any(guess.unit in BRIDGE_UNITS and guess.meant for guess in guesses):
        yield "the numbers of the gauges' amplifier are examples: gauge_factor and what stands beside it are yours"
    if any(guess.unit == "counts" for guess in guesses):
        yield "counts have a zero of their own: state air_s, the seconds before the touch"


def _floats(cells: np.ndarray, decimal: str) -> np.ndarray:
    """Cells of text as floats, NaN for other text."""
    result = np.full(len(cells), np.nan)
    for index, cell in enumerate(cells.tolist()):
        try:
            result[index] = float(cell.replace(",", ".") if decimal == "," else cell)
        except ValueError:
            continue
    return result


def _is_date(cells: np.ndarray) -> bool:
    try:
        instants(cells[:1])
    except ValueError:
        return False
    return "-" in str(cells[0]) and ":" in str(cells[0])
