"""Proposes a log map: what the columns of a foreign log probably are, with the reason for each guess.

A column is recognised by its name, the unit in its name, and the size of its numbers. A column that is not recognised
is listed but left out of the map, so that a person decides.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from papilla.errors import FileFormatError
from papilla.logs.bags import BagReader, is_bag
from papilla.logs.frames import PARQUET, FrameReader, parquet
from papilla.logs.quantities import BRIDGES, GAUGE, ISO, QUANTITIES, column_meant, quantity_of, split_number, split_unit
from papilla.tables import TableReader

HEAD = 2000
"""Number of rows that are read for the size of the numbers."""

RATES_HZ = 8.0, 60_000.0
"""Lowest and highest sampling rate of gauge logs. A time without a unit gets the unit that gives such a rate."""

STRAIN_BELOW, COUNTS_FROM = 0.05, 1500.0
"""Largest reading that is more likely strain than microstrain, and from which whole numbers are more likely counts."""

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
        """The text of a map, with the reasons as comments."""
        lines = [f"# What the columns of {self.path.name} seem to be: check each line, then", "#"]
        lines += [f"#     papilla estimate {self.path.name} --map log_map.toml --out estimates.csv", ""]
        lines += [f"delimiter = {_quoted(self.delimiter)}"] if self.delimiter != "," else []
        lines += ['decimal = ","'] if self.decimal == "," else []
        lines += [f"header_line = {self.header_line}"] if self.header_line != 1 else []
        lines += ["# speed_mm_s = 50.0    # a constant speed, where no column has one"]
        lines += ["# air_s = [0.0, 1.0]   # seconds before the touch: the zero of gauges and force", "", "[columns]"]
        for guess in (one for one in self.guesses if one.meant):
            bridge = ", gauge_factor = 2.0, active_arms = 1" if guess.unit in BRIDGES else ""
            bridge += ", excitation_V = 5.0, amplification = 1.0" if guess.unit in BRIDGES[1:] else ""
            bridge += ", bits = 16, span_V = 10.0" if guess.unit == "counts" else ""
            entry = f"{guess.meant} = {{ column = {_quoted(guess.name)}, unit = {_quoted(guess.unit)}{bridge} }}"
            lines.append(f"{entry}   # {guess.reason}")
        rest = [one.name for one in self.guesses if not one.meant]
        lines += [f"# not used, because they were not recognised: {', '.join(rest)}"] if rest else []
        return "\n".join([*lines, *(f"# ? {question}" for question in self.open_questions)]) + "\n"


def propose(path: Path) -> Proposal:
    """Guesses for the columns of a log; raises `FileAccessError`, or `FileFormatError` if there is no table."""
    line = 1 if path.suffix in PARQUET or is_bag(path) else _header_line(path)
    with _opened(path, line) as reader:
        reader.want(_all, tuple(reader.header))
        head = next(reader.blocks(HEAD))
        values = {name: _floats(cells, reader.decimal) for name, cells in head.columns.items()}
        dates = {name for name, cells in head.columns.items() if _is_date(cells)}
        guesses = _unique([_guess(name, found, name in dates) for name, found in values.items()])
        return Proposal(path, guesses, reader.delimiter, reader.decimal, line, tuple(_questions(guesses)))


def _opened(path: Path, line: int) -> TableReader | FrameReader:
    if is_bag(path):
        return BagReader(path, _all)
    return parquet(path, _all) if path.suffix in PARQUET else TableReader(path, _all, header_line=line)


def _all(name: str) -> bool:
    """Every column is wanted."""
    return True


def _header_line(path: Path) -> int:
    """Number (from 1) of the first line that two rows of equally many cells, several of them numbers, follow."""
    for line in range(1, MOST_SKIPPED):
        try:
            with TableReader(path, _all, header_line=line) as reader:
                reader.want(_all, tuple(reader.header))
                rows = next(reader.blocks(2)).columns
                numbers = [np.isfinite(_floats(cells, reader.decimal)).any() for cells in rows.values()]
                if sum(numbers) > 1 or len(rows) == 1 and all(numbers):
                    return line
        except FileFormatError:
            continue
    raise FileFormatError(f"{path}: no table in its first {MOST_SKIPPED} lines: no row of names above rows of numbers")


def _guess(name: str, values: np.ndarray, is_date: bool) -> Guess:
    stem, unit = split_unit(name)
    found = values[np.isfinite(values)]
    meant = name if name in QUANTITIES else column_meant(stem) or ""
    if is_date:
        return Guess(name, "t_s", ISO, "dates and times")
    if not len(found):
        return Guess(name, "", "", "no numbers")
    if not meant:
        word, number = split_number(stem)
        known = unit in GAUGE.units or any(word.startswith(one) for one in GAUGE.words if len(one) > 1)
        if not known:
            return Guess(name, "", "", "unknown name")
        meant = f"g{number}" if number else "g"
    if unit in quantity_of(meant).units:
        return Guess(name, meant, str(unit), "its name has the unit")
    sized, reason = _unit_by_size(meant, found)
    return Guess(name, meant, sized, f"its name; {reason}")


def _unit_by_size(meant: str, values: np.ndarray) -> tuple[str, str]:
    """The unit of a column whose name has none, and why."""
    largest = float(np.abs(values).max())
    if meant == "t_s":
        steps = np.diff(values)
        step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0
        for unit in ("s", "ms", "us", "ns"):
            rate = 1 / (step * QUANTITIES["t_s"].units[unit])
            if RATES_HZ[0] <= rate <= RATES_HZ[1]:
                return unit, f"steps of {step:g} are {rate:.4g} Hz"
        return "s", f"steps of {step:g}: a rate that no unit explains"
    if meant not in QUANTITIES:
        if largest < STRAIN_BELOW:
            return "strain", f"at most {largest:.2g}"
        whole = bool((values == np.round(values)).all())
        if whole and largest >= COUNTS_FROM:
            return "counts", f"whole numbers up to {largest:.0f}"
        return "microstrain", f"at most {largest:.3g}"
    if meant in ("force_N", "tangential_N") and largest > 20:
        return "gf", f"up to {largest:.3g}, too much in N for a soft finger"
    if meant == "modulus_MPa" and largest > 20:
        return ("kPa" if largest < 2e4 else "Pa"), f"up to {largest:.3g}, too stiff in MPa"
    return next(unit for unit, factor in QUANTITIES[meant].units.items() if factor == 1), f"up to {largest:.3g}"


def _unique(guesses: list[Guess]) -> tuple[Guess, ...]:
    """Guesses with a number for each gauge; if two columns have one meaning, the first keeps it."""
    taken, result = Counter(guess.meant for guess in guesses), []
    used: set[str] = set()
    for guess in guesses:
        meant = guess.meant
        if meant == "g" or (meant.startswith("g") and meant in used):
            meant = next(f"g{k}" for k in range(1, len(guesses) + 1) if f"g{k}" not in used and not taken[f"g{k}"])
        if meant in used:
            result.append(Guess(guess.name, "", "", f"{meant} is another column already"))
            continue
        used |= {meant} - {""}
        result.append(Guess(guess.name, meant, guess.unit, guess.reason))
    return tuple(result)


def _questions(guesses: tuple[Guess, ...]) -> Iterator[str]:
    """What a map still needs and no column gives."""
    meant = {guess.meant for guess in guesses}
    if not meant & {"t_s", "modulus_MPa"}:
        yield "no column seems to be a time (t_s), as an estimate needs, or a modulus (modulus_MPa), as presses need"
    if not any(one.startswith("g") for one in meant):
        yield "no column seems to be a gauge (g1, g2, ...)"
    if "force_N" not in meant:
        yield "no column seems to be a force (force_N): without one there is no modulus"
    for guess in guesses:
        if guess.unit in BRIDGES and guess.meant:
            yield "the numbers of the gauges' amplifier are examples: gauge_factor and what stands beside it are yours"
            return


def _floats(cells: np.ndarray, decimal: str) -> np.ndarray:
    """Cells of text as floats, NaN for other text."""
    result = np.full(len(cells), np.nan)
    for row, cell in enumerate(cells.tolist()):
        try:
            result[row] = float(cell.replace(",", ".") if decimal == "," else cell)
        except ValueError:
            continue
    return result


def _is_date(cells: np.ndarray) -> bool:
    try:
        np.datetime64(str(cells[0]).replace(" ", "T").rstrip("Z"), "ns")
    except ValueError:
        return False
    return "-" in str(cells[0]) and ":" in str(cells[0])


def _quoted(text: str) -> str:
    """A TOML string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t")
    return f'"{escaped}"'
