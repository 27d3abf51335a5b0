"""The wavenumber from the phase of a line along the path, block by block: nearly maximum likelihood.

Step 4 of a search: `Refinement`, on `phases_of` (the blocks) and `regressed` (the regression).

In a block of whole periods the harmonics and an offset are orthogonal. With a trial wavenumber k_0, the phase of block
i (in cycles) differs from the model by

  phi_i = phi_stroke + (k - k_0) x_i + k T v_i,

so a regression of the phases on path and velocity gives the wavenumber k and the delay T of the path. Each stroke has a
phase of its own. Phase regression reaches the Cramér-Rao bound above a threshold (Tretter 1985,
doi:10.1109/TIT.1985.1057115).
"""

from itertools import accumulate, repeat
from typing import NamedTuple

import numpy as np

from papilla.core.units import TINY_DIVISOR
from papilla.estimators.stream import Pieces
from papilla.estimators.wavelength.fundamental import FITTED_HARMONICS, no_multiples
from papilla.estimators.wavelength.memory import (
    CELLS_PER_WAVELENGTH,
    LOST_AMPLITUDE_SHARE,
    LOST_AMPLITUDE_SIGMAS,
    SearchResult,
    Task,
    TrackingStatus,
    window_of,
)
from papilla.estimators.wavelength.spectrum import (
    CYCLE_EXPONENT,
    Line,
    Spectrum,
    Strokes,
    background,
    middle,
    slope,
    strokes_of,
)
from papilla.estimators.wavelength.time_lines import forward, levelled, silenced

MOST_BLOCKS = 24
"""Largest number of blocks along a window; each has whole periods."""
COVERED_BLOCK_SHARE = 0.9
"""Share of a block's length that its rows must cover."""
PRESENT_HARMONIC_ENERGY = 12.0
"""Smallest energy of a harmonic, relative to half the noise, for it to take part: a smaller one is mostly noise."""
MEDIAN_TO_SIGMA = 1.4826
OUTLYING_PHASE_SIGMAS = 3.0
"""Sigmas of a block's phase above which it counts less (Huber 1964, doi:10.1214/aoms/1177703732)."""

LEAST_PHASE_COHERENCE, PHASE_SCATTER = 0.8, 0.12
"""Coherence of the blocks' phases below which a line is smeared and searched in a shorter path; and their scatter
beyond the noise, in periods, above which it is."""
PLAY_MM, RELAXED_MM = 0.3, 0.5
"""Standard deviation of the distance by which the skin trails the finger, and the path after a turn over which it
settles again."""
KNOWN_NEAR, SETTLED_STEPS = 0.1, 0.3
"""Distance in resolutions within which a search continues from the known wavenumber; and the step, in sigmas, after
which no further step is needed."""
LATE_S = 1e-4
"""Recompute the path when the estimated delay changes by more than this; the phases are linear in smaller changes."""
LATE_STEP_S = 0.004
"""Largest step of the delay."""
PATH_BEND_PERIODS = 0.04
"""Deviation of the path from a straight line over time, in periods (RMS under the taper of a stroke), above which lines
over path and over time can be distinguished. Ramps at the ends of a stroke do not help, because the taper hides them:
with quick turns and a constant speed between them, lines of the surface were taken for lines over time."""
PATH_BAND_LIMIT = 0.45
"""Frequency, relative to the sampling rate, above which an anti-aliasing filter has probably removed harmonics."""
STILL_MM = 1e-12
"""Path that a row stands for at least, so that no weight vanishes."""


class Phases(NamedTuple):
    """cycles (b,) : difference of each block's phase from the model, with its stroke's mean; information (b,) of it;
    place (b,), regressors (b, p) : means over the block; stroke (b,). amplitude (s, g) complex: the fundamental of each
    stroke and gauge; coherence : of the blocks, 1 if all agree."""

    cycles: np.ndarray
    information: np.ndarray
    regressors: np.ndarray
    stroke: np.ndarray
    amplitude: np.ndarray
    coherence: float


class Fit(NamedTuple):
    """step (p,) : change of the parameters; covariance (p, p), from noise and scatter of the blocks; scatter : of the
    blocks in cycles, beyond the noise."""

    step: np.ndarray
    covariance: np.ndarray
    scatter: float


def phases_of(cycles, regressors, weight, count, readings, seen, stroke, noise) -> Pieces[Phases]:
    """Phases of blocks of whole periods.

    cycles (m,) : the model's phase; regressors (m, p) : its derivatives by the parameters; weight (m,) : of the path,
    so that a block is evenly filled; count (m,) : number of samples in a row; readings (m, g), 0 where not seen;
    stroke (m,) : number of each row's; noise (h, g) : variance of a sample at each harmonic, infinite for none.
    """
    begin = np.flatnonzero(np.diff(stroke, prepend=-1))
    # Cut each stroke into at most MOST_BLOCKS blocks of the same whole number of periods, so that an offset, and every
    # harmonic, is orthogonal to the others within a block. `label` numbers the blocks of all strokes.
    along = cycles - np.minimum.reduceat(cycles, begin)[stroke]
    length = max(int(np.ceil(along.max() / MOST_BLOCKS)), 1)
    label = stroke * (MOST_BLOCKS + 2) + (along / length).astype(int)
    order = np.argsort(label, kind="stable")
    edges = np.flatnonzero(np.diff(label[order], prepend=-1))
    of_stroke = stroke[order][edges]
    turns, orders = np.exp(-CYCLE_EXPONENT * cycles[order]), np.arange(1, len(noise) + 1)
    yield
    weight, along = weight[order], along[order]
    used = weight[:, None] * seen[order]
    values = used * readings[order]
    # exp(-i n phi) of each harmonic by repeated multiplication: one exponential instead of many.
    waves = accumulate(repeat(turns, len(orders)), np.multiply)
    blocks = np.stack([np.add.reduceat(wave[:, None] * values, edges) for wave in waves], axis=1)
    yield
    rows = np.column_stack([used, used * (weight / count[order])[:, None], weight[:, None] * regressors[order]])
    sums, gauges = np.add.reduceat(rows, edges), readings.shape[1]
    amount, square = sums[:, :gauges], sums[:, gauges : 2 * gauges]
    total = np.add.reduceat(weight, edges)
    reach = np.maximum.reduceat(along, edges) - np.minimum.reduceat(along, edges)
    # The remainder at the end of a stroke is not a whole period.
    complete = (reach + middle(np.abs(np.diff(cycles))) > COVERED_BLOCK_SHARE * length)[:, None]
    # Mean amplitude of each stroke and harmonic: the reference against which its blocks' phases are measured.
    first = np.flatnonzero(np.diff(of_stroke, prepend=-1))
    mean = np.add.reduceat(blocks * complete[:, :, None], first)
    mean /= np.maximum(np.add.reduceat(amount * complete, first), TINY_DIVISOR)[:, None, :]
    yield
    # Noise of each block: variance of one quadrature of its mean, per harmonic and gauge.
    spread = (square / np.maximum(amount, TINY_DIVISOR**0.5) ** 2)[:, None, :]
    variance = 0.5 * np.minimum(noise, 1 / TINY_DIVISOR) * spread
    inverse = np.where((complete & (amount > 0))[:, None, :], 1 / np.maximum(variance, TINY_DIVISOR), 0.0)
    # Harmonics that noise could have made take no part: their phases would be random.
    size = np.abs(mean) ** 2
    certain = (size * np.add.reduceat(inverse, first) > PRESENT_HARMONIC_ENERGY)[of_stroke] * inverse
    turn = 2 * np.pi * orders[:, None]
    # Rotate each block by the stroke's reference: its imaginary part is the phase deviation times the amplitude.
    # Harmonic n turns n times as far, so its score and information carry n and n^2. Their ratio is the phase in cycles.
    pull = blocks / np.maximum(amount, TINY_DIVISOR)[:, None, :] * np.conj(mean)[of_stroke]
    score = (turn * pull.imag * certain).sum(axis=(1, 2))
    information = (turn**2 * size[of_stroke] * certain).sum(axis=(1, 2))
    # Coherence: length of the sum of all blocks along the reference, over the length if all pointed along it.
    agreeing = (pull * certain).sum(axis=(1, 2))
    return Phases(
        np.where(information > 0, score / np.maximum(information, TINY_DIVISOR), 0.0),
        information,
        sums[:, 2 * gauges :] / total[:, None],
        of_stroke,
        2 * mean[:, 0],
        float(agreeing.real.sum() / max(np.abs(agreeing).sum(), TINY_DIVISOR)),
    )


def regressed(phases: Phases, prior: np.ndarray, off: np.ndarray) -> Pieces[Fit]:
    """Weighted, robust regression of the blocks' phases, a mean for each stroke removed.

    prior (p,) : 1 / variance of each parameter about a known value; off (p,) : that value minus the present one.
    """
    weight, informed = phases.information, phases.information > 0
    stroke = phases.stroke[:, None] == np.arange(phases.stroke[-1] + 1)
    columns = np.column_stack([phases.regressors, phases.cycles])
    spare = max(int(informed.sum()) - stroke.shape[1] - len(prior), 1)
    # Iteratively reweighted least squares; three rounds settle the weights.
    for _ in range(3):
        yield
        # Each stroke has a free phase: subtract its weighted mean instead of adding a parameter for it.
        share = weight[:, None] * stroke
        means = share.T @ columns / np.maximum(share.sum(axis=0), TINY_DIVISOR)[:, None]
        centred = columns - means[phases.stroke]
        regressors, cycles = centred[:, :-1], centred[:, -1]
        normal = (regressors.T * weight) @ regressors + np.diag(prior)
        # Scaled to a unit diagonal, because path (mm) and delay (s) differ by many powers of ten.
        scale = np.sqrt(np.maximum(normal.diagonal(), TINY_DIVISOR))
        inverse = np.linalg.inv(normal / np.outer(scale, scale) + 1e-9 * np.eye(len(prior))) / np.outer(scale, scale)
        step = inverse @ (regressors.T @ (weight * cycles) + prior * off)
        residual = np.abs(cycles - regressors @ step)
        rest = residual * np.sqrt(phases.information)
        # Birge's ratio (1932, doi:10.1103/PhysRev.40.207): blocks may scatter more than noise does.
        usual = MEDIAN_TO_SIGMA * middle(rest[informed]) or 1.0
        # Huber's weights: full up to three robust sigmas, falling as 1 / residual beyond.
        pull = np.minimum(OUTLYING_PHASE_SIGMAS * max(usual, 1.0) / np.maximum(rest, TINY_DIVISOR), 1.0)
        weight = phases.information * pull**2
    ratio = max(float((pull * rest) @ (pull * rest)) / spare, 1.0)
    # Scatter beyond the noise: robust variance of the residuals minus what noise alone would give.
    noise, usual = middle(1 / phases.information[informed]), MEDIAN_TO_SIGMA * middle(residual[informed])
    return Fit(step, inverse * ratio, max(usual**2 - noise, 0.0) ** 0.5)


def share_kept(place, readings, seen, wavenumber: float, wanted, noise, periods: int) -> tuple[float, float] | None:
    """Amplitude of a line in the newest `periods`, as a share of its amplitude `wanted` over the whole path, and the
    sigma of this share from the residuals.

    place (m,) : of one stroke; readings, seen (m, g); wanted (g,) : complex amplitude at place 0; noise (g,) : variance
    of a sample. None if the path is less than one period longer.
    """
    cycles = wavenumber * np.abs(place - place[-1])
    first = len(cycles) - int((cycles[::-1] > periods).argmax())
    if cycles.max(initial=0.0) < periods + 1 or first > len(cycles) - 3:
        return None
    place, readings, seen = place[first:], readings[first:], seen[first:]
    path = np.maximum(np.abs(slope(place)), STILL_MM)
    total = np.maximum(path @ seen, TINY_DIVISOR**0.5)
    # A gauge that is lost does not mean that its line is lost.
    weight = np.where(total > 0.5 * path.sum(), 1 / np.asarray(noise), 0.0)
    if not weight.any():
        return None
    wanted = np.asarray(wanted)
    power = np.abs(wanted) ** 2 * weight
    size = max(float(power.sum()), TINY_DIVISOR)
    # Amplitude in whole periods, where the mean is orthogonal to the wave; then the part of it in phase with the known
    # one.
    values = seen * (readings - path @ (seen * readings) / total)
    wave = np.exp(-CYCLE_EXPONENT * wavenumber * place)
    newest = 2 * ((wave * path) @ values) / total
    rest = path @ (values - seen * np.outer(wave.conj(), newest).real) ** 2 / total
    share = path**2 @ seen / total**2
    ratio = float((wanted.conj() * newest * weight).sum().real) / size
    return ratio, float(np.sqrt(2 * (rest * share * power * weight).sum())) / size


class Refinement:
    """Step 4 of a search: its window, and the finding that the phases of the chosen line give.

    The steps before (`tracking.line_search`) fill in the lines, over the path and over time.
    """

    def __init__(self, task: Task):
        self._task, self._options = task, task.options
        self.finding = SearchResult(late_s=task.late_s, late_variance=task.late_variance)
        self._late = task.late_s
        self._strokes: Strokes
        self._spectrum: Spectrum
        self._speed: np.ndarray
        self._spans: np.ndarray
        self._lines: list[Line] = []
        self._inside: list[Line] = []
        self._wavenumber, self._bend, self._hum = 0.0, 0.0, False
        self._time_lines = [Line(hum, 1.0, 1.0, 0.0) for hum in task.known_hums_Hz]

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

    def _by_phases(self, fundamental: float, status: TrackingStatus, refused: bool) -> Pieces[SearchResult]:
        """The finding for a line of this fundamental and status; refused : whether a louder line was refused."""
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
        return (yield from self._judged(status, refused))

    def _noise(self, wavenumber: float) -> np.ndarray:
        """(h, g) variance of one sample's noise at the harmonics that the steps can show."""
        spectrum, strokes = self._spectrum, self._strokes
        orders = np.arange(1, FITTED_HARMONICS + 1)
        at = np.minimum(np.round(orders * wavenumber / spectrum.step).astype(int), len(spectrum.power) - 1)
        level = background(spectrum.power, at, spectrum.resolution, pooled=False).power
        finite = np.isfinite(level)
        level = np.where(finite, level, level[finite].max(initial=1.0))
        band = orders * wavenumber * middle(self._speed) < PATH_BAND_LIMIT * self._options.rate_Hz
        reachable = (orders * wavenumber < 2 / self._task.step / CELLS_PER_WAVELENGTH * 2) & band
        reachable[0] = True
        level = np.where(reachable, level, np.inf)
        return level[:, None] * spectrum.own / float((strokes.weight**2 / self._count).sum())

    def _unmixed(self) -> Pieces[Strokes]:
        """The strokes without lines over time and without lines of another texture."""
        strokes, wavenumber = self._strokes, self._wavenumber
        if self._hum:
            hums_Hz = np.array((*self._task.known_hums_Hz, *self.finding.hums_Hz, *self._options.hums_Hz))
            near = 2 / max(np.ptp(self._time), TINY_DIVISOR)
            hums = [line for line in self._time_lines if (np.abs(line.wavenumber - hums_Hz) < near).any()]
            strokes = yield from silenced(strokes, self._time, hums, wavenumber)
        foreign = no_multiples(self._lines, wavenumber, 2 / strokes.extent)
        strokes = yield from silenced(strokes, forward(strokes), foreign, wavenumber)
        below = self._spectrum.power[1 : int(1 / self._options.high / self._spectrum.step)].max(initial=0.0)
        # If the speed changes, slow changes come mostly from the force, and cause a doubt.
        straight = self._bend * wavenumber < PATH_BEND_PERIODS and len(self._begin) == 2
        drifting = straight and below > self._inside[0].amplitude ** 2
        return (yield from levelled(strokes, wavenumber)) if drifting else strokes

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
            columns.append(self._wavenumber * slope(self._place) / np.maximum(slope(self._time), TINY_DIVISOR))
            prior.append(1 / task.late_variance)
            off.append(task.late_s - self._late)
        regressors = np.column_stack([*columns, self._play()])
        yield
        phases = yield from phases_of(
            self._wavenumber * self._place, regressors, np.maximum(np.abs(slope(self._place)), STILL_MM), self._count,
            self._strokes.readings, self._strokes.seen, self._stroke, self._level,
        )  # fmt: skip
        fit = yield from regressed(phases, np.array([*prior, PLAY_MM**-2]), np.array([*off, 0.0]))
        step, limit = float(fit.step[0]), 0.7 / self._strokes.extent
        # A step turns the phase by at most 0.7 cycles over the window: beyond that the blocks' phases are ambiguous.
        self._wavenumber += min(max(step, -limit), limit)
        if task.late_variance > 0:
            self._late += min(max(float(fit.step[1]), -LATE_STEP_S), LATE_STEP_S)
        self._phases, self._fit = phases, fit
        settled = abs(step) < SETTLED_STEPS * float(fit.covariance[0, 0]) ** 0.5
        return settled and abs(self._late - task.late_s) < LATE_S

    def _play(self) -> np.ndarray:
        """(m,) phase lag in cycles for a skin that trails the finger by 1 mm after a turn."""
        first = self._begin[:-1]
        along = np.abs(self._place - self._place[first][self._stroke])
        way = np.sign(self._place[self._begin[1:] - 1] - self._place[first])[self._stroke]
        # There was no turn at the beginning of the window.
        return np.where(self._stroke > 0, self._wavenumber * way * np.exp(-along / RELAXED_MM), 0.0)

    def _judged(self, status: TrackingStatus, refused: bool) -> Pieces[SearchResult]:
        """The finding for a line with this status; refused : whether a louder line was refused."""
        phases, fit = self._phases, self._fit
        if phases.coherence < LEAST_PHASE_COHERENCE or fit.scatter > PHASE_SCATTER or not phases.information.any():
            # A louder line that may be one over time leaves no answer: a longer path, not a shorter one, determines its
            # frequency.
            status = TrackingStatus.TIME_LOCKED if refused else TrackingStatus.INCOHERENT
        # Phase of each gauge at path 0 from the last stroke: the skin shifts the phase at each turn, so strokes are not
        # averaged.
        last = phases.amplitude[-1]
        angle = np.angle(last) / (2 * np.pi)
        power = np.maximum(np.abs(last), TINY_DIVISOR**0.25) ** 2 * float(self._count[self._begin[-2] :].sum())
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
        wanted, share, sigma = self._phases.amplitude[-1], 1.0, 1.0
        for periods in (2, 4, 8, 12, 16):
            measured = share_kept(self._place[rows], readings, seen, self._wavenumber, wanted, self._level[0], periods)
            if measured is None:
                break
            share, sigma = measured
            if share + LOST_AMPLITUDE_SIGMAS * sigma < LOST_AMPLITUDE_SHARE:
                break
            yield
        return share, sigma
