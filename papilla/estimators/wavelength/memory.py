"""What trackers of a path remember: the latest path in cells, a search for lines in them, and what searches found.

A cell holds the means of time, place and readings of neighbouring samples; the ends of strokes are numbers of cells. A
search is given a `Task`, rows of cells and what is known of them, and returns a `SearchResult`.
"""

import math
from dataclasses import dataclass, field
from operator import add, eq
from typing import NamedTuple

import numpy as np

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.status import Status
from papilla.estimators.stream import Pieces, SpreadTask
from papilla.estimators.wavelength.spectrum import highest_shown, longest_strokes, middle, spectrum_of, strokes_of

LEADING_COLUMNS = 3
"""Columns of a row of the path before the readings: time, place, number of samples."""
MAINS_LINES_HZ = (50.0, 60.0)
MOST_SEARCH_LINES = 8
"""Of a search, strongest first."""
LATEST_S = 0.1
"""Largest delay of a path that may be stated."""
CELLS_PER_WAVELENGTH = 4
"""Grid points in the shortest wavelength: aliases from beyond are then weaker than a third, and none is a sum of
lines."""
WIDEST_RANGE_RATIO = 100
"""Largest ratio of the ends of a range that is searched."""
SAME_WAVELENGTH_DIFFERENCE = 0.02
"""Relative difference up to which two wavelengths count as the same, and a wavelength as inside its range."""
LOST_AMPLITUDE_SHARE, LOST_AMPLITUDE_SIGMAS = 0.5, 3.0
"""Share of the amplitude, with so many sigmas, below which the newest periods show another surface."""
FEWEST_WAVES = 4.0
"""Number of shortest wavelengths that the longest stroke must contain."""


class TrackingStatus(Status):
    """Status of an answer; those that begin with "ok" may be used."""

    OK = "ok"
    SEARCHING = "no wavelength stands out yet: a value, if there is one, is a guess"
    STANDSTILL = "no movement: the wavelength is held"
    MISSING = "the reading is missing, not finite or saturated: the wavelength is held"
    NO_VELOCITY = "no finite velocity or position: the wavelength is held, the frequency is not known"
    ALIASED = "too fast for this sampling rate and wavelength: the wavelength is held"
    NO_TEXTURE = "the line is no longer there: the wavelength is the last one seen"
    TIME_LOCKED = "the line keeps its frequency, or is at one of the mains or a resonance: it may not be the surface's"
    CONSTANT_SPEED = "ok, constant speed: a vibration of that frequency is not excluded"
    OUT_OF_RANGE = "the lines are harmonics of a wavelength outside the search range"
    INCOHERENT = "the line is smeared: no single wavelength, or the path is wrong"
    VAGUE = "the standard deviation of the wavelength is too large"
    AMBIGUOUS = "ambiguous: a line stands out, but it may be a harmonic: the value is a guess"
    LONE = "a line of 25 to 90 Hz at a constant speed, without harmonics: it may be a motor's, not the surface's"


class Options(NamedTuple):
    """low, high : wavelengths in mm. rate_Hz : of the samples. scale_sigma : relative standard deviation of the path's
    scale. latency_s : delay of the path; None means that it is estimated. hums_Hz : frequencies below half the rate
    that a line over time may have. ridge_pitch_mm : of the finger's own ridges, 0 for none or an unknown one."""

    low: float
    high: float
    rate_Hz: float
    scale_sigma: float
    latency_s: float | None
    hums_Hz: tuple[float, ...]
    ridge_pitch_mm: float


def checked(wavelength_range_mm, rate_Hz, scale_sigma, latency_s, resonances_Hz, ridge_pitch_mm=None) -> Options:
    """The options, or `InputError` for unusable ones: a range must span a factor of 1.5 to 100."""
    low, high = checks.rising("wavelength_range_mm", wavelength_range_mm)
    if not 1.5 * low <= high <= WIDEST_RANGE_RATIO * low:
        raise InputError(
            f"wavelength_range_mm must span a factor 1.5 to {WIDEST_RANGE_RATIO}, got {low:g} to {high:g} mm"
        )
    rate = checks.positive("sample_rate_Hz", rate_Hz)
    hums = {n * base for base in MAINS_LINES_HZ for n in range(1, int(0.5 * rate / base) + 1)}
    hums |= {checks.positive("resonances_Hz", value) for value in resonances_Hz}
    late = None if latency_s is None else checks.within("latency_s", latency_s, -LATEST_S, LATEST_S)
    pitch = 0.0 if ridge_pitch_mm is None else checks.within("ridge_pitch_mm", ridge_pitch_mm, 0, 100)
    return Options(low, high, rate, checks.within("scale_sigma", scale_sigma, 0, 0.2), late, tuple(sorted(hums)), pitch)


class Task(NamedTuple):
    """rows (m, `LEADING_COLUMNS` + g) of time, place, samples, readings; breaks : rows at which strokes begin.

    step, size : the grid; late_s : delay of the path behind the readings, and its variance (0: known); before : the
    known wavenumber, 0 for none; proved : the one on which many searches agreed, 0 for none. known_hums_Hz :
    frequencies of lines over time that were found recently.
    """

    rows: np.ndarray
    breaks: tuple[int, ...]
    options: Options
    step: float
    size: int
    late_s: float
    late_variance: float
    before: float
    proved: float
    known_hums_Hz: tuple[float, ...]

    def highest(self, place: np.ndarray) -> float:
        """The highest wavenumber of the range that the distance of these places can show."""
        return min(1 / self.options.low, highest_shown(place))

    def grid(self, place: np.ndarray) -> float:
        """Step of the grid in mm: that of the path if it is longer. Even steps make images of a line; with this grid
        they fall on the line itself, and not beside it, where they would look like another texture."""
        return max(self.step, middle(np.abs(np.diff(place))))

    def sharpness(self, late_s: float) -> Pieces[float]:
        """Power over the background of the sharpest line if the path were late by `late_s`; 0 if there is none.

        With a wrong delay T the place is off by v T. Where the speed v changes within a stroke, that smears a line; the
        right delay makes it sharp again. At a constant speed a line is equally sharp at any delay, and nothing is
        learnt.
        """
        window = window_of(self, late_s)
        if window is None:
            return 0.0
        strokes = yield from strokes_of(window.place, window.readings, window.begin)
        spectrum = yield from spectrum_of(strokes, self.grid(window.place), self.size)
        lines = yield from spectrum.lines(1 / self.options.high, self.highest(window.place), MOST_SEARCH_LINES)
        return max((line.ratio for line in lines), default=0.0)


@dataclass
class SearchResult:
    """Result of a search.

    status : of this search alone. wavenumber (1/mm) and its sigma, 0 before the first; extent : mm of path that was
    used.

    lines : (wavelength_mm, ratio, chance) of the lines in the range, strongest first. late_s, late_variance : of the
    path. phase, phase_sigma : per gauge, cycles of the fundamental at path 0, NaN where unknown. amplitude, noise : of
    the fundamental in the last stroke, from path 0 on, and variance of a sample about it. kept : share of the amplitude
    that is left in the newest periods, and its sigma. hums_Hz : lines over time; mixed : True if a louder line that was
    not removed may be one. other : other possible wavenumber of the surface, 0 for none.
    """

    status: TrackingStatus = TrackingStatus.SEARCHING
    wavenumber: float = 0.0
    sigma: float = 0.0
    extent: float = 0.0
    lines: tuple[tuple[float, float, float], ...] = ()
    late_s: float = 0.0
    late_variance: float = 0.0
    phase: tuple[float, ...] = ()
    phase_sigma: tuple[float, ...] = ()
    amplitude: tuple[complex, ...] = ()
    noise: tuple[float, ...] = ()
    kept: float = 1.0
    kept_sigma: float = 0.0
    score: float = 0.0
    hums_Hz: tuple[float, ...] = ()
    mixed: bool = False
    other: float = 0.0

    @property
    def gone(self) -> bool:
        """Whether the newest periods no longer contain the line."""
        return self.kept + LOST_AMPLITUDE_SIGMAS * self.kept_sigma < LOST_AMPLITUDE_SHARE

    @property
    def smeared(self) -> bool:
        """Whether the line has no single wavelength in this path."""
        return self.status == TrackingStatus.INCOHERENT


class PathWindow(NamedTuple):
    """time, place, samples (m,) and number of the stroke (m,) of each row; begin (s + 1,) : first row of each stroke;
    readings (m, g)."""

    time: np.ndarray
    place: np.ndarray
    samples: np.ndarray
    stroke: np.ndarray
    begin: np.ndarray
    readings: np.ndarray


def window_of(task: Task, late_s: float) -> PathWindow | None:
    """The strokes of a task that are long enough; None if there are none.

    The path is late: at a time t the finger is where the path says at t + late.
    """
    rows = task.rows
    time, place = rows[:, 0], rows[:, 1]
    breaks = np.array(task.breaks, int)
    if late_s:
        at = time + late_s
        inside = (at >= time[0]) & (at <= time[-1])
        # Where the stated path turned at t + late, the finger turned at t.
        breaks = np.searchsorted(at, time[breaks]) - int(inside.argmax())
        rows, place, time = rows[inside], np.interp(at[inside], time, place), time[inside]
    edges = [0, *(row for row in breaks.tolist() if 0 < row < len(rows)), len(rows)]
    strokes = longest_strokes(place, edges, FEWEST_WAVES * task.options.low)
    if strokes is None:
        return None
    index, begin = strokes
    stroke = np.repeat(np.arange(len(begin) - 1), np.diff(begin))
    # Only strokes nearly as long as the longest are used: the shortest sets the resolution of all.
    return PathWindow(time[index], place[index], rows[index, 2], stroke, begin, rows[index, LEADING_COLUMNS:])


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
        valid = (*map(eq, readings, readings),)
        if False in valid:
            readings = tuple([value if seen else 0.0 for value, seen in zip(readings, valid, strict=True)])
        sample = [time, place, 1.0, *readings, *valid]
        if self.open_cell and not self.broken and abs(place - self.began) < self.length:
            self.open_cell = [*map(add, self.open_cell, sample)]
            return
        if self.open_cell:
            self._close(*self.open_cell)
        self.open_cell, self.began = sample, place

    def _close(self, time: float, place: float, samples: float, *sums: float) -> None:
        # Keep the newer half; cells keep their numbers (`first`), so that breaks and searches stay valid.
        if self.count == len(self.rows):
            newer = len(self.rows) // 2
            self.rows[:newer] = self.rows[-newer:]
            self.first += self.count - newer
            self.count = newer
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
    search: SpreadTask | None = None
    finding: SearchResult = field(default_factory=SearchResult)
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
