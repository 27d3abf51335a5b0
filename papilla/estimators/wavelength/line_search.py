"""Searches the latest path for the wavelength: its lines, which of them the surface makes, and their period.

Readings y(x) over the path x contain the surface's lines, sum a_n exp(2 pi i n k x), with the unknown wavenumber k, and
lines over time (hum, resonances), drift and noise; the path itself may be late by some milliseconds. The highest peak
of a spectrum is often wrong: it may be hum, a harmonic, or a mixture of both. So the search does, in this order:

1. lines over the path, each compared with the background beside it, by the chance that noise makes it;
2. path or time, for each line: either gets the energy that the other cannot explain. If the speed hardly changed both
   are the same wave, and only the frequency can decide (status: constant speed);
3. the fundamental: the k of which the chosen line and the others are harmonics, even if it is weak or out of range;
4. k from the phases of all harmonics along the path (`tracking.refine`), together with the delay of the path.

A search is spread over some forty samples, tens of microseconds each. It fails if a surface has no period, or if the
path is wrong by more than a fraction of the wavelength within a stroke.

Example: a texture of 2 mm (k = 0.5 per mm) at speeds of 80 to 120 mm/s, with mains hum of 50 Hz. Step 1 finds peaks at
0.5, at 1.0 (the second harmonic) and, broad, at 0.42 to 0.63 per mm (50 Hz at these speeds). Step 2 refuses the broad
one, because a line of 50 Hz explains its energy. Step 3 finds 0.5, which divides 0.5 and 1.0. Step 4 gives 1 / k with
its sigma.
"""

import numpy as np

from papilla.core.units import TINY_DIVISOR
from papilla.estimators.stream import Pieces
from papilla.estimators.wavelength import fundamental as periods
from papilla.estimators.wavelength.fundamental import (
    CONFIRMED_CHANCE,
    FITTED_HARMONICS,
    HARMONIC_SLACK_RESOLUTIONS,
    MOST_SUBHARMONICS,
    FundamentalPeriod,
)
from papilla.estimators.wavelength.memory import (
    CELLS_PER_WAVELENGTH,
    MAINS_LINES_HZ,
    MOST_SEARCH_LINES,
    SAME_WAVELENGTH_DIFFERENCE,
    SearchResult,
    Task,
    TrackingStatus,
)
from papilla.estimators.wavelength.refine import KNOWN_NEAR, PATH_BEND_PERIODS, Refinement
from papilla.estimators.wavelength.spectrum import Line, share_of, slope, spectrum_of, strokes_of
from papilla.estimators.wavelength.time_lines import credits_of, silenced

TIME_LINES = 3
"""Lines over time that are compared with those over the path."""
SEARCH_FALSE_ALARM = 1e-4
"""Probability of a false line in one search, over all wavelengths."""
PROVING_ENERGY, DISTINCT_ENERGY_SHARE, EXCLUDING_ENERGY_RATIO = 20.0, 0.02, 4.0
"""Energy over the background that proves a line to be one over the path, or over time; its smallest share of the line's
energy (less comes from an error of its place); and the factor by which the energy over time must be larger."""
MOTORS_HZ = 25.0, 90.0
"""Frequencies (Hz) of motors and mounts: at a constant speed a line there, within its resolution and without a
harmonic, is not accepted."""
SHOWN_HARMONIC_FREQUENCY = 0.4
"""Frequency, relative to the sampling rate, below which a harmonic should be visible."""


class LineSearch(Refinement):
    """A search for lines in a task; `run` does it and returns the finding."""

    def __init__(self, task: Task):
        super().__init__(task)
        self._cleaned = False

    def run(self) -> Pieces[SearchResult]:
        """Search."""
        task, finding = self._task, self.finding
        choice = yield from self._line()
        if choice is None:
            return finding
        chosen, status, refused = choice
        fundamental, second, _ = yield from self._fundamental(chosen)
        bent = self._bend * chosen.wavenumber > PATH_BEND_PERIODS
        if status == TrackingStatus.CONSTANT_SPEED and not bent and self._motor_like(fundamental):
            status = TrackingStatus.LONE
        self._hum = self._cleaned or refused
        if self._hum or not bent:
            # Lines over time are equally sharp at any delay, and at a constant speed all lines are.
            finding.score = 0.0
        # A wavelength longer than the range is reported, but not refined: the window has too few periods of it.
        if fundamental * (1 + SAME_WAVELENGTH_DIFFERENCE) < 1 / self._options.high:
            return self._guess(chosen.wavenumber, TrackingStatus.OUT_OF_RANGE)
        # The known wavenumber is nearer to the result of the phases than the place of a peak.
        near = abs(task.before - fundamental) < KNOWN_NEAR / self._strokes.extent
        finding.other = second
        self._wavenumber = task.before if near else fundamental
        return (yield from self._by_phases(fundamental, TrackingStatus.AMBIGUOUS if second else status, refused))

    def _line(self) -> Pieces[tuple[Line, TrackingStatus, bool] | None]:
        """The strongest line that is the surface's, its status, and whether a louder line was refused; or None."""
        if not (yield from self._gathered(self._task.late_s)):
            return None
        # Hum that an earlier search found is subtracted before the lines are sought. Otherwise it would be the
        # strongest line again and again, and its side lobes would hide weaker ones.
        if self._task.known_hums_Hz:
            self._cleaned = True
            self._strokes = yield from silenced(self._strokes, self._time, self._time_lines, self._task.before)
        if not (yield from self._detected()):
            return None
        yield from self._over_time()
        mains = self._mains()
        return (yield from (self._chosen_without(mains) if mains else self._chosen()))

    def _guess(self, wavenumber: float, status: TrackingStatus) -> SearchResult:
        """The finding for a wavenumber that may not be used."""
        self.finding.status, self.finding.wavenumber = status, wavenumber
        self.finding.sigma = 0.3 / self._strokes.extent
        return self.finding

    def _detected(self) -> Pieces[bool]:
        """Find lines over the path, within the range that step and length of the path allow; returns whether there are
        any."""
        task, finding = self._task, self.finding
        self._spectrum = spectrum = yield from spectrum_of(self._strokes, task.grid(self._place), task.size)
        if not np.isfinite(spectrum.own).any():
            return False
        highest = task.highest(self._place)
        resolution = 1 / self._strokes.extent
        widest = min(2 / self._options.low, highest * 2)
        peaks = yield from spectrum.lines(2 * resolution, widest, 3 * MOST_SEARCH_LINES)
        yield
        # The more places a search looks at, the more often noise makes a peak at one of them. So the chance at one
        # place is multiplied by the number of resolutions within a factor e of it, and by the number of such factors in
        # the range: each octave gets the same share of false lines. A line that many searches agreed on is sought at
        # one place only, so a larger chance suffices.
        octaves = np.log(max(self._options.high / self._options.low, 2.0)) / resolution
        real = [
            line
            for line in peaks
            if line.chance * max(octaves * line.wavenumber, 1.0) < SEARCH_FALSE_ALARM
            or (line.chance < CONFIRMED_CHANCE and abs(line.wavenumber - task.proved) < 0.5 * resolution)
        ]
        self._lines = sorted(real, key=lambda line: -line.amplitude)[:MOST_SEARCH_LINES]
        self._inside = [line for line in self._lines if 1 / self._options.high <= line.wavenumber <= highest]
        finding.extent = self._strokes.extent
        finding.lines = tuple((1 / line.wavenumber, line.ratio, line.chance) for line in self._inside)
        finding.score = max((line.ratio for line in peaks if line.wavenumber >= 1 / self._options.high), default=0.0)
        if not self._inside:
            near = [line for line in peaks if 1 / self._options.high <= line.wavenumber <= highest]
            if near:
                self._guess(max(near, key=lambda line: line.amplitude).wavenumber, TrackingStatus.SEARCHING)
            elif self._lines:
                finding.status = TrackingStatus.OUT_OF_RANGE
            finding.score *= not self._cleaned
        return bool(self._inside)

    def _over_time(self) -> Pieces[None]:
        """Find lines over time at the frequencies that lines in the range have at the speeds of the strokes."""
        time = self._time
        self._spans = time[self._begin[1:] - 1] - time[self._begin[:-1]]
        self._speed = np.abs(slope(self._place)) / np.maximum(np.abs(slope(time)), TINY_DIVISOR)
        self._usual = float(np.average(self._speed, weights=self._strokes.weight))
        self._bend = max(_bend_of(time[r], self._place[r], self._strokes.weight[r]) for r in self._strokes.rows)
        fastest = share_of(self._speed, 0.95)
        # Grid of the spectrum over time: as fine as the shortest wavelength needs at the highest speed, but no finer
        # than the samples are.
        step = max(self._options.low / (CELLS_PER_WAVELENGTH * fastest), 0.5 / self._options.rate_Hz)
        shortest, longest = float(self._spans.min()), float(self._spans.max())
        if shortest <= 0:
            return
        size = 1 << max(int(np.ceil(np.log2(1.5 * longest / step))), 4)
        # A longer grid (a very slow finger) would take too long for one search; then lines over time remain unknown,
        # and lines of the path can only be called CONSTANT_SPEED.
        if size <= 4096:
            readings = np.where(self._strokes.seen, self._strokes.readings, np.nan)
            strokes = yield from strokes_of(time, readings, self._begin, 1)
            spectrum = yield from spectrum_of(strokes, step, size)
            self._time_lines += yield from spectrum.lines(2 / shortest, fastest / self._options.low, TIME_LINES)

    def _chosen(self) -> Pieces[tuple[Line, TrackingStatus, bool] | None]:
        """The strongest line that is the surface's, as `_line` returns it."""
        hums: list[Line] = []
        for line in self._ranked():
            yield
            origin = yield from self._origin(line)
            # The strongest line is hum and can be separated: subtract it and look again, once. What is left may be the
            # surface.
            separable = self._bend * line.wavenumber > PATH_BEND_PERIODS
            if origin == TrackingStatus.TIME_LOCKED and separable and not self._cleaned:
                self._time_lines = [line._replace(wavenumber=self._exact(line.wavenumber)) for line in self._time_lines]
                return (yield from self._chosen_without(self._time_lines))
            # Accept the first line that is not hum, unless it may be a harmonic of a fundamental that hum hides.
            if origin != TrackingStatus.TIME_LOCKED and not self._hidden(line, hums):
                return line, origin, bool(hums)
            hums.append(line)
        self._guess(self._inside[0].wavenumber, TrackingStatus.TIME_LOCKED).score = 0.0
        return None

    def _mains(self) -> list[Line]:
        """Lines over time at mains harmonics or resonances that are loud enough to shift the surface's line when the
        speed stays near their frequency; none if time and path cannot be distinguished."""
        if self._cleaned or self._bend * self._inside[0].wavenumber < PATH_BEND_PERIODS:
            return []
        # Only a line over time that is louder than the surface's can shift it, and only exact mains frequencies and
        # stated resonances are certain enough to be subtracted unseen.
        sure = [line for line in self._time_lines if line.chance < SEARCH_FALSE_ALARM]
        loud = [line for line in sure if line.amplitude > self._inside[0].amplitude]
        exact = [line._replace(wavenumber=self._exact(line.wavenumber)) for line in loud]
        return [line for line in exact if line.wavenumber in self._options.hums_Hz]

    def _chosen_without(self, hums: list[Line]) -> Pieces[tuple[Line, TrackingStatus, bool] | None]:
        """The result of `_chosen` after lines over time are removed from the readings; None if no line is left."""
        self._cleaned = True
        self._strokes = yield from silenced(self._strokes, self._time, hums)
        most = max(hum.amplitude for hum in hums)
        self.finding.hums_Hz = tuple(hum.wavenumber for hum in hums if hum.amplitude > 0.2 * most)
        return (yield from self._chosen()) if (yield from self._detected()) else None

    def _ranked(self) -> list[Line]:
        """Lines in the range, strongest first; the known one comes first unless another is much stronger."""
        before, most = self._task.before, self._inside[0].amplitude
        near = 1 / self._strokes.extent
        familiar = [
            line for line in self._inside if abs(line.wavenumber - before) < near and line.amplitude > 0.85 * most
        ]
        return familiar[:1] + [line for line in self._inside if line not in familiar[:1]]

    def _origin(self, line: Line) -> Pieces[TrackingStatus]:
        """OK for a line over the path, CONSTANT_SPEED if it may be one over time, TIME_LOCKED if it is."""
        # Each explanation is credited with the energy that the other one leaves: the line over the path fitted after
        # the lines over time are removed, and the reverse.
        path, time = yield from credits_of(line, self._spectrum, self._strokes, self._time, self._time_lines)
        enough = max(PROVING_ENERGY, DISTINCT_ENERGY_SHARE * line.ratio)
        # Below this bend both explanations fit equally well, whatever the energies say.
        separable = self._bend * line.wavenumber > PATH_BEND_PERIODS
        if separable and path > enough and EXCLUDING_ENERGY_RATIO * path > time:
            return TrackingStatus.OK
        if separable and time > enough and time > EXCLUDING_ENERGY_RATIO * path:
            return TrackingStatus.TIME_LOCKED
        # If a longer path once separated a line from the mains, a short one after lost contact does not make it theirs.
        proved = self._task.proved
        unproved = abs(line.wavenumber - proved) >= SAME_WAVELENGTH_DIFFERENCE * proved
        return TrackingStatus.TIME_LOCKED if unproved and self._near_hum(line) else TrackingStatus.CONSTANT_SPEED

    def _exact(self, frequency: float) -> float:
        """The mains harmonic or resonance that a frequency cannot be distinguished from; else the frequency."""
        nearest = min(self._options.hums_Hz, key=lambda hum: abs(hum - frequency), default=frequency)
        return nearest if abs(nearest - frequency) * float(self._spans.max()) < 0.5 else frequency

    def _near_hum(self, line: Line, highest_Hz: float = np.inf, within: float = 1.0) -> bool:
        """Whether a line may be that of the mains or of a resonance up to a frequency, within so many resolutions."""
        frequency, resolution = line.wavenumber * self._usual, within / max(float(self._spans.min()), TINY_DIVISOR)
        return any(abs(frequency - hum) < resolution for hum in self._options.hums_Hz if hum <= highest_Hz)

    def _motor_like(self, wavenumber: float) -> bool:
        """Whether a line may come from a motor or mount: it has such a frequency, and no sign of the harmonics that
        most surfaces have, although the sampling rate would show the second one."""
        frequency, resolution = wavenumber * self._usual, 1 / max(float(self._spans.min()), TINY_DIVISOR)
        slowest, fastest = MOTORS_HZ[0] - resolution, MOTORS_HZ[1] + resolution
        if not slowest < frequency < min(fastest, SHOWN_HARMONIC_FREQUENCY * self._options.rate_Hz / 2):
            return False
        harmonics = (order * wavenumber for order in range(2, FITTED_HARMONICS + 1))
        return min(map(self._spectrum.chance, harmonics)) > SEARCH_FALSE_ALARM

    def _hidden(self, line: Line, hums: list[Line]) -> bool:
        """Whether a stronger line over time may hide the fundamental of which this line is a harmonic."""
        # The two flanks of a taper overlap.
        reach = 3 / self._strokes.extent
        return any(
            abs(line.wavenumber / order - hum.wavenumber) < reach
            for hum in hums
            for order in range(2, MOST_SUBHARMONICS)
            if hum.amplitude > line.amplitude
        )

    def _fundamental(self, chosen: Line) -> Pieces[FundamentalPeriod]:
        """The wavenumber of which the chosen line and others are harmonics (its own if there is no sign of a lower
        one), and another possible wavenumber."""
        k = chosen.wavenumber
        reach = HARMONIC_SLACK_RESOLUTIONS / self._strokes.extent
        # A harmonic of the mains counts as theirs only if other mains lines are present.
        bent = self._bend * k > PATH_BEND_PERIODS
        humming = not bent and any(self._near_hum(line, max(MAINS_LINES_HZ)) for line in self._lines)
        loud = [line for line in self._lines if line.amplitude > periods.FAINTEST_HARMONIC * chosen.amplitude]
        others = periods.no_multiples(loud, k, reach)
        possible = set()
        for line in others:
            timed = humming and self._near_hum(line)
            if bent:
                yield
                timed = (yield from self._origin(line)) == TrackingStatus.TIME_LOCKED
            if not timed:
                possible.add(line)
        period = periods.fundamental_of(chosen, others, reach, possible, self._options.ridge_pitch_mm > 0)
        if not bent and period.wavenumber == k:
            # At a constant speed a line beside the mains, but not at their frequency, may be the surface's: not proved,
            # only doubtful.
            apart = {line for line in others if not self._near_hum(line, within=HARMONIC_SLACK_RESOLUTIONS)}
            either = periods.fundamental_of(chosen, others, reach, possible | apart, False)
            if either.loud or either.wavenumber < k:
                period = FundamentalPeriod(k, either.other or either.wavenumber, True)
        # No line gives a lower fundamental. Look for one that is too weak to be a line: it makes the answer doubtful.
        if period.wavenumber == k and not period.other and not humming:
            divisors = range(2, MOST_SUBHARMONICS + 1)
            near, lowest = 2 / self._strokes.extent, 1 / self._options.high
            hinted = (k / n for n in divisors if periods.hints(self._spectrum, self._lines, chosen, n, near, lowest))
            hidden = k / 2 if periods.lone(chosen, self._options.ridge_pitch_mm) else 0.0
            period = period._replace(other=next(hinted, hidden))
        # Faint lines that come and go do not raise doubt about a wavenumber on which many searches agreed.
        agreed = period.wavenumber == k and abs(k - self._task.proved) < SAME_WAVELENGTH_DIFFERENCE * k
        return period._replace(other=0.0) if agreed and not period.loud else period


def _bend_of(time: np.ndarray, place: np.ndarray, weight: np.ndarray) -> float:
    """Deviation of a stroke from a straight line over time: root mean square in mm, with weights (m,)."""
    total = float(weight.sum())
    t, x = time - float(weight @ time) / total, place - float(weight @ place) / total
    off = x - t * (float(weight @ (t * x)) / max(float(weight @ t**2), TINY_DIVISOR))
    return (float(weight @ off**2) / total) ** 0.5
