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

from papilla.estimators.fundamental import (
    CONFIRMED,
    FAINT,
    SLACK,
    SUBHARMONICS,
    Period,
    fundamental_of,
    hints,
    lone,
    no_multiples,
)  # fmt: skip
from papilla.estimators.spectrum import Line, Strokes, middle, share_of, slope, spectrum_of, strokes_of
from papilla.estimators.spread import Pieces
from papilla.estimators.tracking.answer import TrackingStatus
from papilla.estimators.tracking.finding import Finding
from papilla.estimators.tracking.refine import phases_of, regressed, share_kept
from papilla.estimators.tracking.search_task import GRID, MAINS_HZ, Task, bend_of, window_of
from papilla.estimators.tracking.time_lines import HARMONICS, credits_of, forward, levelled, silenced
from papilla.units import TINY

BENT = 0.04
"""Deviation of the path from a straight line over time, in periods (RMS under the taper of a stroke), above which lines
over path and over time can be distinguished. Ramps at the ends of a stroke do not help, because the taper hides them:
with quick turns and a constant speed between them, lines of the surface were taken for lines over time."""
MOST_LINES, TIME_LINES = 8, 3
FALSE_ALARM = 1e-4
"""Probability of a false line in one search, over all wavelengths."""
PROVED, DISTINCT, EXCLUDED = 20.0, 0.02, 4.0
"""Energy over the background that proves a line to be one over the path, or over time; its smallest share of the line's
energy (less comes from an error of its place); and the factor by which the energy over time must be larger."""
MOTORS_HZ = 25.0, 90.0
"""Frequencies (Hz) of motors and mounts: at a constant speed a line there, within its resolution and without a
harmonic, is not accepted."""
KNOWN = 0.02
"""Relative difference of wavenumber up to which a line counts as the known one."""
COHERENT, SCATTERED = 0.8, 0.12
"""Coherence of the blocks' phases below which a line is smeared and searched in a shorter path; and their scatter
beyond the noise, in periods, above which it is."""
LOST, SURE = 0.5, 3.0
"""Share of the amplitude, with so many sigmas, below which the newest periods show another surface."""
PLAY_MM, RELAXED_MM = 0.3, 0.5
"""Standard deviation of the distance by which the skin trails the finger, and the path after a turn over which it
settles again."""
KNOWN_NEAR, SETTLED = 0.1, 0.3
"""Distance in resolutions within which a search continues from the known wavenumber; and the step, in sigmas, after
which no further step is needed."""
LATE_S = 1e-4
"""Recompute the path when the estimated delay changes by more than this; the phases are linear in smaller changes."""
BAND, SHOWN = 0.45, 0.4
"""Frequencies, relative to the sampling rate: above the first an anti-aliasing filter has probably removed harmonics;
below the second they should be visible."""


class LineSearch:
    """A search for lines in a task; `run` does it and returns the finding."""

    def __init__(self, task: Task):
        self._task, self._options = task, task.options
        self.finding = Finding(late_s=task.late_s, late_variance=task.late_variance)
        self._cleaned = False
        self._strokes: Strokes

    def run(self) -> Pieces[Finding]:
        """Search."""
        task, finding = self._task, self.finding
        found = yield from self._line()
        if found is None:
            return finding
        chosen, status, refused = found
        fundamental, other, _ = yield from self._fundamental(chosen)
        bent = self._bend * chosen.wavenumber > BENT
        if status == TrackingStatus.CONSTANT_SPEED and not bent and self._motor_like(fundamental):
            status = TrackingStatus.LONE
        self._hum = self._cleaned or refused
        if self._hum or not bent:
            # Lines over time are equally sharp at any delay, and at a constant speed all lines are.
            finding.score = 0.0
        # A wavelength longer than the range is reported, but not refined: the window has too few periods of it.
        if fundamental * 1.02 < 1 / self._options.high:
            return self._guess(chosen.wavenumber, TrackingStatus.OUT_OF_RANGE)
        # The known wavenumber is nearer to the result of the phases than the place of a peak.
        near = abs(task.before - fundamental) < KNOWN_NEAR / self._strokes.extent
        finding.other = other
        self._wavenumber, self._late = task.before if near else fundamental, task.late_s
        yield
        # The noise comes from the spectrum with all lines; then other lines are subtracted, or they would pull the
        # phases.
        self._level = self._noise(fundamental)
        yield
        self._strokes = yield from self._unmixed()
        # A step moves wavenumber and delay, and a new delay moves the whole path: so a second step may be needed.
        for _ in range(2):
            if (yield from self._refined()):
                break
        yield
        return (yield from self._judged(TrackingStatus.AMBIGUOUS if other else status, refused))

    def _line(self) -> Pieces[tuple[Line, TrackingStatus, bool] | None]:
        """The strongest line that is the surface's, its status, and whether a louder line was refused; or None."""
        if not (yield from self._gathered(self._task.late_s)):
            return None
        # Hum that an earlier search found is subtracted before the lines are sought. Otherwise it would be the
        # strongest line again and again, and its side lobes would hide weaker ones.
        if self._task.known_hums_Hz:
            self._cleaned = True
            self._strokes = yield from silenced(self._strokes, self._time, self._known_hums(), self._task.before)
        if not (yield from self._detected()):
            return None
        yield from self._over_time()
        mains = self._mains()
        return (yield from (self._chosen_without(mains) if mains else self._chosen()))

    def _guess(self, wavenumber: float, status: TrackingStatus) -> Finding:
        """The finding for a wavenumber that may not be used."""
        self.finding.status, self.finding.wavenumber = status, wavenumber
        self.finding.sigma = 0.3 / self._strokes.extent
        return self.finding

    def _gathered(self, late_s: float) -> Pieces[bool]:
        """Collect rows and strokes for a path that is late by `late_s`; returns False, without a change, if there are
        too few."""
        window = window_of(self._task, late_s)
        if window is None:
            return False
        self._time, self._place, self._count, self._stroke, self._begin, readings = window
        yield
        self._strokes = yield from strokes_of(self._place, readings, self._begin)
        return True

    def _known_hums(self) -> list[Line]:
        return [Line(hum, 1.0, 1.0, 0.0) for hum in self._task.known_hums_Hz]

    def _detected(self) -> Pieces[bool]:
        """Find lines over the path, within the range that step and length of the path allow; returns whether there are
        any."""
        task, finding = self._task, self.finding
        self._spectrum = spectrum = yield from spectrum_of(self._strokes, task.grid(self._place), task.size)
        if not np.isfinite(spectrum.own).any():
            return False
        highest = task.highest(self._place)
        resolution = 1 / self._strokes.extent
        found = yield from spectrum.lines(2 * resolution, min(2 / self._options.low, highest * 2), 3 * MOST_LINES)
        yield
        # The more places a search looks at, the more often noise makes a peak at one of them. So the chance at one
        # place is multiplied by the number of resolutions within a factor e of it, and by the number of such factors in
        # the range: each octave gets the same share of false lines. A line that many searches agreed on is sought at
        # one place only, so a larger chance suffices.
        octaves = np.log(max(self._options.high / self._options.low, 2.0)) / resolution
        real = [
            line
            for line in found
            if line.chance * max(octaves * line.wavenumber, 1.0) < FALSE_ALARM
            or (line.chance < CONFIRMED and abs(line.wavenumber - task.proved) < 0.5 * resolution)
        ]
        self._lines = sorted(real, key=lambda line: -line.amplitude)[:MOST_LINES]
        self._inside = [line for line in self._lines if 1 / self._options.high <= line.wavenumber <= highest]
        finding.extent = self._strokes.extent
        finding.lines = tuple((1 / line.wavenumber, line.ratio, line.chance) for line in self._inside)
        finding.score = max((line.ratio for line in found if line.wavenumber >= 1 / self._options.high), default=0.0)
        if not self._inside:
            near = [line for line in found if 1 / self._options.high <= line.wavenumber <= highest]
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
        self._speed = np.abs(slope(self._place)) / np.maximum(np.abs(slope(time)), 1e-9)
        self._usual = float(np.average(self._speed, weights=self._strokes.weight))
        self._bend = max(bend_of(time[r], self._place[r], self._strokes.weight[r]) for r in self._strokes.rows)
        fastest = share_of(self._speed, 0.95)
        # Grid of the spectrum over time: as fine as the shortest wavelength needs at the highest speed, but no finer
        # than the samples are.
        step = max(self._options.low / (GRID * fastest), 0.5 / self._options.rate_Hz)
        self._time_lines = self._known_hums()
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
            if origin == TrackingStatus.TIME_LOCKED and self._bend * line.wavenumber > BENT and not self._cleaned:
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
        if self._cleaned or self._bend * self._inside[0].wavenumber < BENT:
            return []
        # Only a line over time that is louder than the surface's can shift it, and only exact mains frequencies and
        # stated resonances are certain enough to be subtracted unseen.
        sure = [line for line in self._time_lines if line.chance < FALSE_ALARM]
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
        known = [line for line in self._inside if abs(line.wavenumber - before) < near and line.amplitude > 0.85 * most]
        return known[:1] + [line for line in self._inside if line not in known[:1]]

    def _origin(self, line: Line) -> Pieces[TrackingStatus]:
        """OK for a line over the path, CONSTANT_SPEED if it may be one over time, TIME_LOCKED if it is."""
        # Each explanation is credited with the energy that the other one leaves: the line over the path fitted after
        # the lines over time are removed, and the reverse.
        path, time = yield from credits_of(line, self._spectrum, self._strokes, self._time, self._time_lines)
        enough = max(PROVED, DISTINCT * line.ratio)
        # Below this bend both explanations fit equally well, whatever the energies say.
        separable = self._bend * line.wavenumber > BENT
        if separable and path > enough and EXCLUDED * path > time:
            return TrackingStatus.OK
        if separable and time > enough and time > EXCLUDED * path:
            return TrackingStatus.TIME_LOCKED
        # If a longer path once separated a line from the mains, a short one after lost contact does not make it theirs.
        hum = self._near_hum(line) and abs(line.wavenumber - self._task.proved) >= KNOWN * self._task.proved
        return TrackingStatus.TIME_LOCKED if hum else TrackingStatus.CONSTANT_SPEED

    def _exact(self, frequency: float) -> float:
        """The mains harmonic or resonance that a frequency cannot be distinguished from; else the frequency."""
        nearest = min(self._options.hums_Hz, key=lambda hum: abs(hum - frequency), default=frequency)
        return nearest if abs(nearest - frequency) * float(self._spans.max()) < 0.5 else frequency

    def _near_hum(self, line: Line, highest_Hz: float = np.inf, within: float = 1.0) -> bool:
        """Whether a line may be that of the mains or of a resonance up to a frequency, within so many resolutions."""
        frequency, resolution = line.wavenumber * self._usual, within / max(float(self._spans.min()), 1e-9)
        return any(abs(frequency - hum) < resolution for hum in self._options.hums_Hz if hum <= highest_Hz)

    def _motor_like(self, wavenumber: float) -> bool:
        """Whether a line may come from a motor or mount: it has such a frequency, and no sign of the harmonics that
        most surfaces have, although the sampling rate would show the second one."""
        frequency, resolution = wavenumber * self._usual, 1 / max(float(self._spans.min()), 1e-9)
        slowest, fastest = MOTORS_HZ[0] - resolution, MOTORS_HZ[1] + resolution
        if not slowest < frequency < min(fastest, SHOWN * self._options.rate_Hz / 2):
            return False
        return min(self._spectrum.chance(order * wavenumber) for order in range(2, HARMONICS + 1)) > FALSE_ALARM

    def _hidden(self, line: Line, hums: list[Line]) -> bool:
        """Whether a stronger line over time may hide the fundamental of which this line is a harmonic."""
        # The two flanks of a taper overlap.
        reach = 3 / self._strokes.extent
        return any(
            abs(line.wavenumber / order - hum.wavenumber) < reach
            for hum in hums
            for order in range(2, SUBHARMONICS)
            if hum.amplitude > line.amplitude
        )

    def _fundamental(self, chosen: Line) -> Pieces[Period]:
        """The wavenumber of which the chosen line and others are harmonics (its own if there is no sign of a lower
        one), and another possible wavenumber."""
        k = chosen.wavenumber
        reach = SLACK / self._strokes.extent
        # A harmonic of the mains counts as theirs only if other mains lines are present.
        bent = self._bend * k > BENT
        humming = not bent and any(self._near_hum(line, max(MAINS_HZ)) for line in self._lines)
        others = no_multiples([line for line in self._lines if line.amplitude > FAINT * chosen.amplitude], k, reach)
        own = set()
        for line in others:
            timed = humming and self._near_hum(line)
            if bent:
                yield
                timed = (yield from self._origin(line)) == TrackingStatus.TIME_LOCKED
            if not timed:
                own.add(line)
        found = fundamental_of(chosen, others, reach, own, self._options.ridge_pitch_mm > 0)
        if not bent and found.wavenumber == k:
            # At a constant speed a line beside the mains, but not at their frequency, may be the surface's: not proved,
            # only doubtful.
            apart = {line for line in others if not self._near_hum(line, within=SLACK)}
            either = fundamental_of(chosen, others, reach, own | apart, False)
            if either.loud or either.wavenumber < k:
                found = Period(k, either.other or either.wavenumber, True)
        # No line gives a lower fundamental. Look for one that is too weak to be a line: it makes the answer doubtful.
        if found.wavenumber == k and not found.other and not humming:
            divisors = range(2, SUBHARMONICS + 1)
            near, lowest = 2 / self._strokes.extent, 1 / self._options.high
            hinted = (k / n for n in divisors if hints(self._spectrum, self._lines, chosen, n, near, lowest))
            beside = k / 2 if lone(chosen, self._options.ridge_pitch_mm) else 0.0
            found = found._replace(other=next(hinted, beside))
        # Faint lines that come and go do not raise doubt about a wavenumber on which many searches agreed.
        agreed = found.wavenumber == k and abs(k - self._task.proved) < KNOWN * k
        return found._replace(other=0.0) if agreed and not found.loud else found

    def _unmixed(self) -> Pieces[Strokes]:
        """The strokes without lines over time and without lines of another texture."""
        strokes, wavenumber = self._strokes, self._wavenumber
        if self._hum:
            known = np.array((*self._task.known_hums_Hz, *self.finding.hums_Hz, *self._options.hums_Hz))
            near = 2 / max(np.ptp(self._time), 1e-9)
            hums = [line for line in self._time_lines if (np.abs(line.wavenumber - known) < near).any()]
            strokes = yield from silenced(strokes, self._time, hums, wavenumber)
        foreign = no_multiples(self._lines, wavenumber, 2 / strokes.extent)
        strokes = yield from silenced(strokes, forward(strokes), foreign, wavenumber)
        below = self._spectrum.power[1 : int(1 / self._options.high / self._spectrum.step)].max(initial=0.0)
        # If the speed changes, slow changes come mostly from the force, and cause a doubt.
        one = self._bend * wavenumber < BENT and len(self._begin) == 2 and below > self._inside[0].amplitude ** 2
        return (yield from levelled(strokes, wavenumber)) if one else strokes

    def _noise(self, wavenumber: float) -> np.ndarray:
        """(h, g) variance of one sample's noise at the harmonics that the steps can show."""
        spectrum, strokes = self._spectrum, self._strokes
        orders = np.arange(1, HARMONICS + 1)
        at = np.minimum(np.round(orders * wavenumber / spectrum.step).astype(int), len(spectrum.power) - 1)
        level = spectrum.level(at)
        finite = np.isfinite(level)
        level = np.where(finite, level, level[finite].max(initial=1.0))
        band = orders * wavenumber * middle(self._speed) < BAND * self._options.rate_Hz
        reachable = (orders * wavenumber < 2 / self._task.step / GRID * 2) & band
        reachable[0] = True
        level = np.where(reachable, level, np.inf)
        return level[:, None] * spectrum.own / float((strokes.weight**2 / self._count).sum())

    def _refined(self) -> Pieces[bool]:
        """One step of the wavenumber and of the delay; True if another step would change nothing."""
        task = self._task
        if abs(self._late - task.late_s) > LATE_S and (yield from self._gathered(self._late)):
            yield
            self._strokes = yield from self._unmixed()
        # Unknowns of the regression: change of the wavenumber (almost no prior), change of the delay where it is not
        # stated (prior from earlier searches), and the distance by which the skin trails after a turn.
        columns, prior, off = [self._place - self._place[-1]], [1e-12], [0.0]
        if task.late_variance > 0:
            # Derivative of the phase by the delay: k v, so only changes of the speed v determine it.
            columns.append(self._wavenumber * slope(self._place) / np.maximum(slope(self._time), 1e-9))
            prior.append(1 / task.late_variance)
            off.append(task.late_s - self._late)
        regressors = np.column_stack([*columns, self._play()])
        yield
        phases = yield from phases_of(
            self._wavenumber * self._place, regressors, np.maximum(np.abs(slope(self._place)), 1e-12), self._count,
            self._strokes.readings, self._strokes.seen, self._stroke, self._level,
        )  # fmt: skip
        fit = yield from regressed(phases, np.array([*prior, PLAY_MM**-2]), np.array([*off, 0.0]))
        step, limit = float(fit.step[0]), 0.7 / self._strokes.extent
        # A step turns the phase by at most 0.7 cycles over the window: beyond that the blocks' phases are ambiguous.
        self._wavenumber += min(max(step, -limit), limit)
        if task.late_variance > 0:
            self._late += min(max(float(fit.step[1]), -0.004), 0.004)
        self._phases, self._fit = phases, fit
        settled = abs(step) < SETTLED * float(fit.covariance[0, 0]) ** 0.5
        return settled and abs(self._late - task.late_s) < LATE_S

    def _play(self) -> np.ndarray:
        """(m,) phase lag in cycles for a skin that trails the finger by 1 mm after a turn."""
        first = self._begin[:-1]
        along = np.abs(self._place - self._place[first][self._stroke])
        way = np.sign(self._place[self._begin[1:] - 1] - self._place[first])[self._stroke]
        # There was no turn at the beginning of the window.
        return np.where(self._stroke > 0, self._wavenumber * way * np.exp(-along / RELAXED_MM), 0.0)

    def _judged(self, status: TrackingStatus, refused: bool) -> Pieces[Finding]:
        """The finding for a line with this status; refused : whether a louder line was refused."""
        phases, fit = self._phases, self._fit
        if phases.coherence < COHERENT or fit.scatter > SCATTERED or not phases.information.any():
            # A louder line that may be one over time leaves no answer: a longer path, not a shorter one, determines its
            # frequency.
            status = TrackingStatus.TIME_LOCKED if refused else TrackingStatus.INCOHERENT
        # Phase of each gauge at path 0 from the last stroke: the skin shifts the phase at each turn, so strokes are not
        # averaged.
        last = phases.amplitude[-1]
        angle = np.angle(last) / (2 * np.pi)
        power = np.maximum(np.abs(last) ** 2, TINY) * float(self._count[self._begin[-2] :].sum())
        spread = np.sqrt(2 * self._level[0] / power) / (2 * np.pi)
        finding, estimated = self.finding, self._task.late_variance > 0
        # A low-passed velocity is not only late but also too small: in strokes of angular frequency w by (w T)^2 / 2,
        # which no reading shows. This counts as two sigmas.
        smaller = 0.25 * (np.pi * self._late / self._spans.max()) ** 2 * estimated
        finding.status, finding.wavenumber = status, self._wavenumber
        finding.sigma = float(np.hypot(fit.covariance[0, 0] ** 0.5, smaller * self._wavenumber))
        finding.late_s, finding.late_variance = self._late, float(fit.covariance[1, 1]) if estimated else 0.0
        finding.phase, finding.phase_sigma = tuple(angle.tolist()), tuple(spread.tolist())
        finding.amplitude, finding.noise = tuple(last.tolist()), tuple(self._level[0].tolist())
        finding.kept, finding.kept_sigma, finding.mixed = *(yield from self._newest()), refused
        return finding

    def _newest(self) -> Pieces[tuple[float, float]]:
        """Share of the amplitude in the newest whole periods, and its sigma, over as many periods as needed to detect a
        missing line."""
        rows = slice(int(self._begin[-2]), None)
        seen, readings = self._strokes.seen[rows], self._strokes.readings[rows]
        wanted, kept, sigma = self._phases.amplitude[-1], 1.0, 1.0
        for periods in (2, 4, 8, 12, 16):
            found = share_kept(self._place[rows], readings, seen, self._wavenumber, wanted, self._level[0], periods)
            if found is None:
                break
            kept, sigma = found
            if kept + SURE * sigma < LOST:
                break
            yield
        return kept, sigma
