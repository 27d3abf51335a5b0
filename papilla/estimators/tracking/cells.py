"""The latest path in cells: mean time, place and readings of neighbouring samples, and the ends of strokes."""

import math
from dataclasses import dataclass, field
from operator import add, eq

import numpy as np


@dataclass(eq=False)
class Cells:
    """rows (2 n, 3 + g) : time, place, samples and mean readings of each cell, oldest first, of which at least the
    newest n are kept; length : of a cell, turn : smallest movement backwards that begins another stroke, mm.

    first : number of the cell in row 0; count : rows in use. open_cell : sums of time, place, samples, readings of each
    gauge, and how many of these there are; began : place at which it began. breaks : cells at which strokes begin;
    direction, extreme, extreme_cell : of the present stroke; broken : whether the path was unknown just now.
    """

    rows: np.ndarray
    length: float
    turn: float
    first: int = 0
    count: int = 0
    open_cell: list[float] = field(default_factory=list)
    began: float = 0.0
    breaks: list[int] = field(default_factory=list)
    direction: float = 0.0
    extreme: float = 0.0
    extreme_cell: int = 0
    broken: bool = False

    @property
    def end(self) -> int:
        """Number of the cell that comes next."""
        return self.first + self.count

    def between(self, begin: int, end: int) -> np.ndarray:
        """Rows of the cells from `begin` to `end`."""
        return self.rows[begin - self.first : end - self.first]

    def place(self, number: int) -> float:
        """Place of a cell along the path."""
        return float(self.rows[number - self.first, 1])

    def fill(self, time: float, place: float, readings: tuple[float, ...]) -> None:
        """Add a sample to the open cell, or close that and begin another."""
        # NaN is the only value that differs from itself: a missing reading adds 0 to the sum and to the count.
        known = (*map(eq, readings, readings),)
        if False in known:
            readings = tuple([value if seen else 0.0 for value, seen in zip(readings, known, strict=True)])
        sample = [time, place, 1.0, *readings, *known]
        if self.open_cell and not self.broken and abs(place - self.began) < self.length:
            self.open_cell = [*map(add, self.open_cell, sample)]
            return
        if self.open_cell:
            self._close(*self.open_cell)
        self.open_cell, self.began = sample, place

    def _close(self, time: float, place: float, samples: float, *sums: float) -> None:
        # Keep the newer half; cells keep their numbers (`first`), so that breaks and searches stay valid.
        if self.count == len(self.rows):
            kept = len(self.rows) // 2
            self.rows[:kept] = self.rows[-kept:]
            self.first += self.count - kept
            self.count = kept
            self.breaks = [cell for cell in self.breaks if cell >= self.first]
        half = len(sums) // 2
        means = [total / number if number else math.nan for total, number in zip(sums[:half], sums[half:], strict=True)]
        self.rows[self.count] = (time / samples, place / samples, samples, *means)
        self.count += 1
        self._turn(self.end - 1, place / samples)

    def _turn(self, number: int, place: float) -> None:
        """Whether a stroke ends: the path turned, or was unknown for a while."""
        if self.broken:
            self.broken = False
            self.breaks.append(number)
            self.extreme, self.extreme_cell, self.direction = place, number, 0.0
        beyond = place - self.extreme
        # Movements back by less than `turn` are encoder noise or a tremor, not the end of a stroke.
        if beyond * self.direction <= 0 and abs(beyond) <= self.turn:
            return
        if beyond * self.direction < 0:
            self.breaks.append(self.extreme_cell + 1)
        self.extreme, self.extreme_cell, self.direction = place, number, math.copysign(1.0, beyond)
