"""The latest path in cells: mean time, place and readings of samples that lie close together, and where strokes end."""

import math
from dataclasses import dataclass, field

import numpy as np


@dataclass(eq=False)
class Cells:
    """rows (2 n, 3 + g) : time, place, samples and mean readings of each cell, oldest first, of which at least the
    newest n are kept; length : of a cell, turn : the way back from which a stroke is another one, mm.

    first : number of the cell in row 0; count : rows in use. open_cell : sums of time, place, samples, and of each
    gauge's readings and their number; began : place at which it began. breaks : cells at which strokes begin;
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
        """Rows of cells begin to end."""
        return self.rows[begin - self.first : end - self.first]

    def place(self, number: int) -> float:
        """Place of a cell along the path."""
        return float(self.rows[number - self.first, 1])

    def fill(self, time: float, place: float, readings: tuple[float, ...]) -> None:
        """Add a sample to the open cell, or close that and begin another."""
        own = self.open_cell
        if own and (abs(place - self.began) >= self.length or self.broken):
            self._close(*own)
            own = []
        if not own:
            self.open_cell = own = [0.0] * (3 + 2 * len(readings))
            self.began = place
        own[0] += time
        own[1] += place
        own[2] += 1
        for number, value in enumerate(readings):
            if math.isfinite(value):
                own[3 + 2 * number] += value
                own[4 + 2 * number] += 1

    def _close(self, time: float, place: float, samples: float, *sums: float) -> None:
        if self.count == len(self.rows):
            kept = len(self.rows) // 2
            self.rows[:kept] = self.rows[-kept:]
            self.first += self.count - kept
            self.count = kept
            self.breaks = [cell for cell in self.breaks if cell >= self.first]
        means = [total / number if number else math.nan for total, number in zip(sums[::2], sums[1::2], strict=True)]
        self.rows[self.count] = (time / samples, place / samples, samples, *means)
        self.count += 1
        self._turn(self.end - 1, place / samples)

    def _turn(self, number: int, place: float) -> None:
        """Whether a stroke ends: the path turned, or was not known for a while."""
        if self.broken:
            self.broken = False
            self.breaks.append(number)
            self.extreme, self.extreme_cell, self.direction = place, number, 0.0
        beyond = place - self.extreme
        if beyond * self.direction <= 0 and abs(beyond) <= self.turn:
            return
        if beyond * self.direction < 0:
            self.breaks.append(self.extreme_cell + 1)
        self.extreme, self.extreme_cell, self.direction = place, number, math.copysign(1.0, beyond)
