"""What the follower remembers: the latest path in cells, and what searches in it found.

A cell holds the means of time, place and readings of neighbouring samples; the ends of strokes are numbers of cells.
"""

import math
from dataclasses import dataclass, field
from operator import add, eq

import numpy as np

from papilla.estimators.spread import Spread
from papilla.estimators.tracking.search_task import Finding, TrackingStatus


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


@dataclass(eq=False)
class Memory:
    """cells : the latest path. place, moved_s : place of the last sample, time of its last movement; step : its step,
    fading.

    begin : first cell of the present texture; limit : mm of path that a search may use; smeared : mm in which the last
    search saw a smeared line. searched : cell of the last search; hop : cells until the next; waited : samples since;
    search : the one under way. finding : of the last search, whose path begins at origin. known : wavenumber and sigma
    of the answer; guessed : whether no search was sure of them; agreed : searches that agree; missed : searches in a
    row without a line; proved : wavenumber that many agreed on, 0 for none. glances : whether glances are possible;
    glanced, seen : cell of the last, and of the last that saw the line; whole : cells until the next search as long as
    glances see it; doubted : whether one missed it; changed : whether a new surface was found and not yet measured.
    status : of the answer, None if it may have changed. hums_Hz : lines over time, hummed : searches since they were
    found. late_s, late_variance : delay of
    the path; trial, sharper : number of the delay that is tried, and how much sharper lines are for each.
    """

    cells: Cells
    place: float = math.nan
    moved_s: float = 0.0
    step: float = 0.0
    begin: int = 0
    limit: float = math.inf
    smeared: float = 0.0
    searched: int = 0
    hop: int = 0
    waited: int = 0
    search: Spread | None = None
    finding: Finding = field(default_factory=Finding)
    known: tuple[float, float] = (0.0, 0.0)
    agreed: int = 0
    missed: int = 0
    origin: float = 0.0
    proved: float = 0.0
    glances: bool = False
    glanced: int = 0
    seen: int = 0
    whole: int = 0
    doubted: bool = False
    changed: bool = False
    guessed: bool = False
    status: TrackingStatus | None = None
    hums_Hz: tuple[float, ...] = ()
    hummed: int = 0
    late_s: float = 0.0
    late_variance: float = 0.0
    trial: int = 0
    sharper: list[float] = field(default_factory=list)
