"""The follower: the wavelength that searches in the latest path agree on, and how sure it is at every sample.

Samples are averaged in cells of the path, lambda_min / 8 long, of which the newest 16 lambda_max are kept: the memory
is path, not time, however slow the finger is. Every 24 cells a search (`tracking.line_search`) finds the line in them;
one search may be wrong, so two must agree before an answer is "ok". A new surface shows in the newest periods long
before it fills the window: every 8 cells a short test (a glance) measures the share of the known line's amplitude in
them: a(new) / a(known) < 1/2 by three sigmas means another surface, and the search begins again on the newest path
alone. Where the delay T of the path is unknown, x(t + T), one other T is tried after each search and the sharper line
wins.

The answer is late by the two periods that a glance needs. It is wrong if two consecutive searches make the same
mistake.
"""

import math
from typing import NamedTuple

import numpy as np

from papilla.core.errors import InputError
from papilla.core.units import MS_PER_S, TINY_DIVISOR
from papilla.estimators.stream import Pieces, SpreadTask
from papilla.estimators.wavelength.follower_settings import (
    DELAY_SETTINGS,
    PACE_SETTINGS,
    REACH_SETTINGS,
    TRUST_LIMITS,
    WINDOW_SETTINGS,
)
from papilla.estimators.wavelength.line_search import LineSearch
from papilla.estimators.wavelength.memory import (
    CELLS_PER_WAVELENGTH,
    LEADING_COLUMNS,
    LOST_AMPLITUDE_SHARE,
    LOST_AMPLITUDE_SIGMAS,
    SAME_WAVELENGTH_DIFFERENCE,
    Cells,
    Memory,
    Options,
    SearchResult,
    Task,
    TrackingStatus,
)
from papilla.estimators.wavelength.refine import share_kept
from papilla.estimators.wavelength.spectrum import FEWEST_STEPS, size_of, slope


class PathSearch(NamedTuple):
    """A search as a task, in the cells from `begin` to `end`, with path 0 at `origin`; or, if `trial_s` is a number, a
    test how sharp its lines are if the path is late by this, compared with `score`."""

    task: Task
    begin: int
    end: int
    origin: float
    trial_s: float = math.nan
    score: float = 0.0

    def run(self) -> Pieces:
        """The `Finding`, or the sharpness of the lines."""
        return LineSearch(self.task).run() if math.isnan(self.trial_s) else self.task.sharpness(self.trial_s)


class Follower:
    """Wavelength of the surface under g gauges; `advance(time_s, place_mm, readings)` takes a sample."""

    def __init__(self, gauges: int, options: Options):
        self.options, self._gauges = options, gauges
        self._cell = WINDOW_SETTINGS.cell * options.low
        self._span = WINDOW_SETTINGS.span * options.high
        # A very wide range of wavelengths gets a shorter path, or it would need too many cells.
        cells = min(math.ceil(self._span / self._cell), WINDOW_SETTINGS.most_cells)
        self._cells = max(cells, math.ceil(WINDOW_SETTINGS.least_span * options.high / self._cell))
        self._kept = 2 * (self._cells + WINDOW_SETTINGS.spare), LEADING_COLUMNS + gauges
        self._grid = options.low / CELLS_PER_WAVELENGTH
        self._size = size_of(WINDOW_SETTINGS.grid_span * options.high, self._grid)
        self._trials = [ms / MS_PER_S for ms in DELAY_SETTINGS.trials_ms]
        self._pieces = max(round(PACE_SETTINGS.pieces_Hz / options.rate_Hz), 1)

    def fresh(self) -> Memory:
        """State without any knowledge."""
        latency_s = self.options.latency_s
        cells = Cells(np.zeros(self._kept), self._cell, 0.5 * self.options.low)
        late_s, variance = (0.0, DELAY_SETTINGS.sigma_s**2) if latency_s is None else (latency_s, 0.0)
        memory = Memory(cells, hop=PACE_SETTINGS.hop, limit=self._span, late_s=late_s, late_variance=variance)
        memory.sharper = [1.0] * len(self._trials)
        return memory

    def remember(self, memory: Memory) -> None:
        """Continue from this state."""
        if memory.cells.rows.shape != self._kept:
            raise InputError(f"the state is not of {self._gauges} gauges and this range of wavelengths")
        self.memory = memory

    def advance(self, time: float, place: float, readings: tuple[float, ...]) -> TrackingStatus:
        """Take one sample; returns the status of what `estimate` then returns."""
        memory = self.memory
        moved = place - memory.place
        if not math.isfinite(place):
            memory.cells.broken = True
            return TrackingStatus.NO_VELOCITY
        step = abs(moved) if moved == moved else 0.0
        # A jump of the path by more than the whole memory: nothing known applies any more.
        if step > self._span:
            self.remember(self.fresh())
            memory, step = self.memory, 0.0
        if step > 0 or memory.place != memory.place:
            memory.moved_s = time
        # Steps are weighted by their length: this gives the distance of the readings on the path.
        memory.step += (step - memory.step) * min(4 * step / self._span, 1.0)
        memory.place = place
        seen = any(map(math.isfinite, readings))
        if seen:
            memory.cells.fill(time, place, readings)
        self._go_on()
        if not seen:
            return TrackingStatus.MISSING
        if time - memory.moved_s > PACE_SETTINGS.still_s:
            return TrackingStatus.STANDSTILL
        # The present speed is too high for the sampling rate: even the longest wavelength would alias.
        if FEWEST_STEPS * step > self.options.high:
            return TrackingStatus.ALIASED
        if memory.status is None:
            memory.status = self._status()
        return memory.status

    def estimate(self) -> tuple[float, float]:
        """Wavelength and its standard deviation in mm; NaN before the first."""
        wavenumber, sigma = self.memory.known
        if wavenumber <= 0:
            return math.nan, math.nan
        return 1 / wavenumber, math.hypot(sigma / wavenumber, self.options.scale_sigma) / wavenumber

    def _status(self) -> TrackingStatus:
        memory, status = self.memory, self.memory.finding.status
        if memory.doubted:
            return TrackingStatus.SEARCHING
        if status in (TrackingStatus.TIME_LOCKED, TrackingStatus.OUT_OF_RANGE):
            return status
        # If a search after the change found anything, its status was returned above.
        if memory.changed:
            return TrackingStatus.NO_TEXTURE
        # The order is that of certainty: what excludes an answer at all comes before what only makes it doubtful.
        if not status.good:
            return status
        if memory.late_variance > 0 and memory.late_s >= self._trials[-1]:
            # The delay is beyond the range, or the velocity is low-passed: the path is wrong.
            return TrackingStatus.INCOHERENT
        wavenumber, sigma = memory.known
        if memory.agreed < (TRUST_LIMITS.agree_humming if memory.hums_Hz else TRUST_LIMITS.agree) or wavenumber <= 0:
            return TrackingStatus.SEARCHING
        if math.hypot(sigma / wavenumber, self.options.scale_sigma) > TRUST_LIMITS.vague:
            return TrackingStatus.VAGUE
        shortest = self.options.low * (1 - SAME_WAVELENGTH_DIFFERENCE)
        longest = self.options.high * (1 + SAME_WAVELENGTH_DIFFERENCE)
        return status if shortest <= 1 / wavenumber <= longest else TrackingStatus.OUT_OF_RANGE

    def _go_on(self) -> None:
        """Do a glance, the next piece of a search, or the first one."""
        memory, end = self.memory, self.memory.cells.end
        memory.waited += 1
        # One job a sample, so that no sample takes long: a glance comes first, because it decides whether a running
        # search looks at a surface that is gone.
        if end - memory.glanced >= PACE_SETTINGS.glance and not memory.doubted and self._glance(end):
            if memory.doubted:
                memory.search = None
        elif memory.search is not None:
            self._advance(memory.search)
        elif memory.doubted or (end - memory.searched >= memory.hop and self._due(end)):
            begin, memory.waited = self._window_begin(end), 0
            # Too little path since the surface changed: wait for more before the first search.
            if end - begin < PACE_SETTINGS.hop:
                memory.searched = end
                return
            origin = float(memory.cells.between(begin, end)[0, 1])
            memory.search = SpreadTask(PathSearch(self._task(begin, end), begin, end, origin))

    def _due(self, end: int) -> bool:
        """Whether the next search is due, a hop after the last one: many that agreed save some time, if glances would
        detect another surface; and as long as glances see the line, a whole window."""
        memory = self.memory
        if end - memory.seen < memory.hop and end - memory.searched < memory.whole:
            return False
        rested = memory.waited >= PACE_SETTINGS.spare_s * self.options.rate_Hz
        return rested or not memory.glances or memory.agreed <= PACE_SETTINGS.steady

    def _advance(self, search: SpreadTask) -> None:
        """Do the next piece of the running search, or several at low rates."""
        size = self._gauges * len(search.task.task.rows)
        for _ in range(max(self._pieces, min(PACE_SETTINGS.light // size, PACE_SETTINGS.most_pieces))):
            result = search.advance()
            if result is not None:
                self.memory.search = self.memory.status = None
                if isinstance(result, SearchResult):
                    return self._conclude(result, search.task)
                return self._weigh(result, search.task.score)

    def _glances(self, finding: SearchResult) -> bool:
        """Whether a glance may find the line missing. It may not if the line is weaker than the rest of the readings,
        which may be another wave as well as noise."""
        power = np.abs(finding.amplitude) ** 2 / 2
        return self._alone(finding) and bool((power > finding.noise).any())

    def _alone(self, finding: SearchResult) -> bool:
        """Whether a glance can measure the line: not if a search must subtract other lines first."""
        return bool(finding.amplitude) and not (finding.mixed or self.memory.hums_Hz)

    def _glance(self, end: int) -> bool:
        """Test whether the newest periods still contain the line; if not, a search is due. False if there was no
        test."""
        memory, finding, cells = self.memory, self.memory.finding, self.memory.cells
        if not (memory.agreed and self._alone(finding) and (memory.glances or memory.whole)):
            return False
        memory.glanced = end
        # The glance compares phases, so it must stay within one stroke, on one surface, in cells that are still stored.
        begin = max(*cells.breaks[-1:], memory.begin, cells.first)
        # The phase is known only in strokes that the search used, and until the next turn.
        along = cells.between(begin, memory.searched)[:, 1]
        if cells.extreme_cell < end - 1 or not len(along) or abs(along[-1] - along[0]) < finding.extent:
            return False
        wavenumber = finding.wavenumber
        rows = cells.between(max(begin, end - int(4 / wavenumber / cells.length)), end)
        if len(rows) < 4:
            return False
        # Path since the finding's origin, corrected for its delay T: x(t + T) = x + T v.
        place = rows[:, 1] - memory.origin + memory.late_s * slope(rows[:, 1]) / slope(rows[:, 0])
        seen = np.isfinite(rows[:, LEADING_COLUMNS:])
        readings = np.where(seen, rows[:, LEADING_COLUMNS:], 0.0)
        share = share_kept(place, readings, seen, wavenumber, finding.amplitude, finding.noise, 2)
        if share is not None:
            memory.status = None
            memory.doubted = memory.glances and share[0] + LOST_AMPLITUDE_SIGMAS * share[1] < LOST_AMPLITUDE_SHARE
            if share[0] - LOST_AMPLITUDE_SIGMAS * share[1] > LOST_AMPLITUDE_SHARE:
                memory.seen = end
        return True

    def _window_begin(self, end: int) -> int:
        """First cell of the window that ends before the cell `end`: the longest allowed path over this texture."""
        memory = self.memory
        begin = max(memory.begin, end - self._cells, memory.cells.first)
        place = memory.cells.between(begin, end)[:, 1]
        path = np.cumsum(np.abs(np.diff(place)))
        over = int(np.searchsorted(path, path[-1] - min(memory.limit, self._span))) if len(path) else 0
        return begin + over

    def _task(self, begin: int, end: int) -> Task:
        memory = self.memory
        rows = memory.cells.between(begin, end).copy()
        # Only differences count: a long path or a late hour must not cost digits.
        rows[:, :2] -= rows[0, :2]
        breaks = tuple(cell - begin for cell in memory.cells.breaks if begin < cell < end)
        wavenumber = memory.known[0] if memory.agreed else 0.0
        late = memory.late_s, memory.late_variance
        return Task(
            rows, breaks, self.options, self._grid, self._size, *late, wavenumber, memory.proved, memory.hums_Hz
        )

    def _conclude(self, finding: SearchResult, search: PathSearch) -> None:
        """Update the state by a finished search."""
        memory, end = self.memory, search.end
        memory.searched = end
        # After each search one other delay of the path is tried on the same cells. A round over all delays takes as
        # many searches.
        if self.options.latency_s is None:
            memory.trial = (memory.trial + 1) % len(self._trials)
            if finding.score > 0:
                memory.search = SpreadTask(search._replace(trial_s=self._trials[memory.trial], score=finding.score))
        if self._held(finding):
            memory.doubted = False
            return
        before, memory.finding, memory.doubted = memory.known[0], finding, False
        # Searching less often saves time. It is safe once many searches agreed (or none found anything), and all delays
        # were tried.
        tried, cells = max(memory.agreed, memory.missed) > PACE_SETTINGS.steady + len(self._trials), end - search.begin
        memory.hummed += 1
        if finding.hums_Hz or memory.hummed > PACE_SETTINGS.humming:
            memory.hums_Hz, memory.hummed = finding.hums_Hz, 0
        memory.glances = self._glances(finding)
        memory.hop = max(PACE_SETTINGS.hop, int(PACE_SETTINGS.grown * cells) if tried else 0)
        if self._pieces > 1:
            # At low rates a search takes few samples, so the next one may come sooner.
            soon = int(PACE_SETTINGS.soon * self.options.high / max(self._cell, memory.step))
            memory.hop = min(max(soon, 2), PACE_SETTINGS.hop)
        if tried and memory.agreed and memory.glances:
            memory.hop = max(PACE_SETTINGS.hop, int(PACE_SETTINGS.spare * cells))
        good = finding.status.good
        memory.missed = 0 if good else memory.missed + 1
        if good:
            memory.origin = search.origin
            # Agreement: within 2 %, or within three sigmas where the wavelength is not known that well.
            change, change_of_proved = (
                abs(finding.wavenumber / max(wavenumber, TINY_DIVISOR) - 1) for wavenumber in (before, memory.proved)
            )
            slack = SAME_WAVELENGTH_DIFFERENCE + LOST_AMPLITUDE_SIGMAS * finding.sigma / max(before, TINY_DIVISOR)
            memory.agreed = memory.agreed + 1 if before > 0 and change < slack else 1
            # A surface that is found again, for example after lost contact, is known.
            if memory.changed and change_of_proved < SAME_WAVELENGTH_DIFFERENCE:
                memory.agreed = max(memory.agreed, TRUST_LIMITS.agree_humming)
            memory.proved = finding.wavenumber if memory.agreed > PACE_SETTINGS.steady else memory.proved
            memory.known, memory.changed, memory.guessed = (finding.wavenumber, finding.sigma), False, False
            if memory.late_variance > 0:
                memory.late_s = min(max(finding.late_s, self._trials[0]), self._trials[-1])
                memory.late_variance = min(finding.late_variance + DELAY_SETTINGS.drift_s**2, DELAY_SETTINGS.sigma_s**2)
        else:
            memory.agreed = 0
            # The known wavelength is better than a guess.
            if finding.wavenumber > 0 and (before <= 0 or memory.guessed):
                memory.known, memory.guessed = (finding.wavenumber, finding.sigma), True
        self._choose_path(finding)
        # The search found the old line, but its newest two periods no longer contain it: begin again with these alone.
        if good and finding.gone:
            self._begin_anew(end, 2 / finding.wavenumber)
        memory.whole = cells if tried and memory.agreed > PACE_SETTINGS.steady else 0

    def _choose_path(self, finding: SearchResult) -> None:
        """Choose the path that the next search may use: see `SearchReach`."""
        memory, good = self.memory, finding.status.good
        lost, least = memory.changed and not good, 2 * self.options.high
        if lost and finding.extent < 1.1 * least:
            memory.limit = self._span
        elif lost or (finding.smeared and finding.extent > REACH_SETTINGS.longer * memory.smeared):
            # A step of the force, for example when contact returns, hides the line until the window has passed it. A
            # line beside a long wave looks smeared in a path that is too short to separate the two: then a longer path
            # is tried.
            memory.limit = max(REACH_SETTINGS.shorter * finding.extent, least)
            memory.smeared = 0.0 if lost else -max(finding.extent, abs(memory.smeared))
        else:
            # Negative until a shorter path turns out to contain no line at all.
            memory.smeared = 0.0 if good else abs(memory.smeared)
            memory.limit = min(REACH_SETTINGS.grows * max(memory.limit, finding.extent), self._span)

    def _held(self, finding: SearchResult) -> bool:
        """Whether a search finds the line on which many agreed, although its phases are too disturbed for
        refinement."""
        memory = self.memory
        near = any(abs(1 / wavelength - memory.proved) < 0.5 / finding.extent for wavelength, *_ in finding.lines)
        return finding.smeared and memory.agreed > PACE_SETTINGS.steady and near and not finding.gone

    def _begin_anew(self, end: int, path: float) -> None:
        """Begin again for another surface, with the newest path alone."""
        memory = self.memory
        place = memory.cells.between(memory.cells.first, end)[:, 1]
        # Path counted backwards from the newest cell.
        travelled = np.cumsum(np.abs(np.diff(place[::-1])))
        memory.begin = end - 1 - int(np.searchsorted(travelled, path))
        memory.agreed, memory.changed, memory.limit = 0, True, self._span

    def _weigh(self, sharp: float, score: float) -> None:
        """Use another delay of the path if it makes the lines sharper than the present one, search after search."""
        memory = self.memory
        if not sharp > 0:
            return
        ratio = min((sharp + DELAY_SETTINGS.plain) / (score + DELAY_SETTINGS.plain), DELAY_SETTINGS.sharpest)
        # A single trial is noisy: half of it enters the running ratio of its delay.
        memory.sharper[memory.trial] += 0.5 * (ratio - memory.sharper[memory.trial])
        best = max(range(len(self._trials)), key=memory.sharper.__getitem__)
        if memory.sharper[best] > DELAY_SETTINGS.sharper:
            # The readings now lie elsewhere on the path, so the agreement of earlier searches does not count.
            memory.late_s, memory.late_variance = self._trials[best], (DELAY_SETTINGS.trials_ms.step / MS_PER_S) ** 2
            memory.sharper = [1.0] * len(self._trials)
            memory.agreed = 0
