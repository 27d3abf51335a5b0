"""What a look is at, and what keeps a frequency instead of a wavelength in it."""

from typing import NamedTuple

import numpy as np

from papilla.estimators.spectrum import Line, Spectrum, Strokes, middle, share_of
from papilla.estimators.spread import Pieces

GRID = 4
"""Grid points in the shortest wavelength: what lies beyond then folds back weaker than a third, and not into sums."""
HARMONICS = 5
MAINS_HZ = (50.0, 60.0)
FOREIGN = 0.7
"""Share of its energy that a line over time may have in common with the surface's harmonics to be taken out."""
LOUD = 0.1
"""Energy of a line over time, beside the surface's, from which it is taken out."""
LEVELLED = 6.0
"""Half periods of a stroke from which long waves are taken out of it."""
ALIKE = 0.05
"""Share of a line's energy that a line over time must be able to explain to be its rival."""


class Task(NamedTuple):
    """What a look is at: rows (m, 3 + g) of time, place, samples, readings; breaks : rows at which strokes begin.

    low, high : wavelengths in mm; step, size : the grid; late_s : of the path, and its variance (0: known); before :
    the wavenumber that was known, 0 for none; proved : the one that many looks agreed on, 0 for none.
    hums_Hz : frequencies that time may be locked to, known_hums_Hz : that it was of late; rate_Hz : of the samples.
    ridge_pitch_mm : of the finger's own ridges, 0 where there are none or nobody knows.
    """

    rows: np.ndarray
    breaks: tuple[int, ...]
    low: float
    high: float
    step: float
    size: int
    late_s: float
    late_variance: float
    before: float
    proved: float
    hums_Hz: tuple[float, ...]
    known_hums_Hz: tuple[float, ...]
    rate_Hz: float
    ridge_pitch_mm: float

    def highest(self, place: np.ndarray) -> float:
        """The highest wavenumber of the range that the steps between these places show."""
        return min(1 / self.low, 0.45 / max(share_of(np.abs(np.diff(place)), 0.9), 1e-12))

    def grid(self, place: np.ndarray) -> float:
        """Step of the grid in mm: the path's own where that is longer. Images of a line, which even steps make, then
        fall on the line itself, and not, folded, beside it as a line of another texture."""
        return max(self.step, middle(np.abs(np.diff(place))))


def window_of(task: Task, late_s: float):
    """Time, place, count, stroke (m,), begin (s + 1,) and readings (m, g) of the strokes that are long enough.

    The path is late: at a time t the finger is where the path says at t + late. None where there is too little.
    """
    rows = task.rows
    time, place = rows[:, 0], rows[:, 1]
    breaks = np.array(task.breaks, int)
    if late_s:
        at = time + late_s
        known = (at >= time[0]) & (at <= time[-1])
        place = np.interp(at, time, place)
        # Where the path turned at t + late, the finger did at t.
        breaks = np.searchsorted(at, time[breaks])
        first, last = int(known.argmax()), len(known) - int(known[::-1].argmax())
        rows, place, time = rows[first:last], place[first:last], time[first:last]
        breaks = breaks - first
    edges = [0, *(int(b) for b in breaks if 0 < b < len(rows)), len(rows)]
    pieces = [(a, b) for a, b in zip(edges[:-1], edges[1:], strict=True) if b - a > 8]
    extents = [float(np.ptp(place[a:b])) for a, b in pieces]
    longest = max(extents, default=0.0)
    if longest < 4 * task.low:
        return None
    kept = [piece for piece, extent in zip(pieces, extents, strict=True) if extent >= 0.6 * longest]
    index = np.concatenate([np.arange(a, b) for a, b in kept])
    begin = np.concatenate([[0], np.cumsum([b - a for a, b in kept])])
    stroke = np.repeat(np.arange(len(kept)), np.diff(begin))
    return time[index], place[index], rows[index, 2], stroke, begin, rows[index, 3:]


def forward(strokes: Strokes) -> np.ndarray:
    """(m,) place that grows along each stroke, as time does: on the way back a wave turns the other way."""
    first, last = strokes.begin[:-1], strokes.begin[1:] - 1
    way = np.where(strokes.place[last] < strokes.place[first], -1.0, 1.0)
    return np.repeat(way, np.diff(strokes.begin)) * strokes.place


def silenced(strokes: Strokes, time: np.ndarray, lines: list[Line], wavenumber: float = 0.0) -> Pieces[Strokes]:
    """The strokes without the lines over time (m,), but for those that the harmonics of a wavenumber make; without
    one, less those alone that are as strong as the strongest."""
    if wavenumber == 0:
        most = max((line.amplitude for line in lines), default=0.0)
        lines = [line for line in lines if line.amplitude > 0.5 * most]
    if not lines:
        return strokes
    count = HARMONICS if wavenumber else 0
    frequencies = np.array([line.wavenumber for line in lines])[:, None]
    turns = [wavenumber * np.arange(1, count + 1)[:, None] * forward(strokes), frequencies * time]
    atoms = np.exp(2j * np.pi * np.concatenate(turns))
    readings = strokes.readings.copy()
    for first, last in zip(strokes.begin[:-1], strokes.begin[1:], strict=True):
        yield
        own, weight = atoms[:, first:last], strokes.weight[first:last]
        weighted = np.conj(own) * weight
        gram = weighted @ own.T
        size = np.maximum(gram.diagonal().real, 1e-300)
        alike = np.abs(gram[count:, :count]) ** 2 / np.outer(size[count:], size[:count])
        foreign = count + np.flatnonzero(alike.max(axis=1, initial=0.0) < FOREIGN)
        pull = weighted @ readings[first:last]
        for _ in range(2):
            used = np.concatenate([np.arange(count), foreign])
            some = gram[np.ix_(used, used)] + 1e-6 * size.max() * np.eye(len(used))
            amplitude = np.linalg.solve(some, pull[used])
            energy = (np.abs(amplitude) ** 2).sum(axis=1)
            # What is faint beside the surface's own may be its error, and does no harm.
            kept = energy[count:] > LOUD * energy[:count].sum()
            foreign, amplitude = foreign[kept], amplitude[count:][kept]
        readings[first:last] -= 2 * (own[foreign].T @ amplitude).real
    return strokes._replace(readings=np.where(strokes.seen, readings, 0.0))


def levelled(strokes: Strokes, wavenumber: float) -> Pieces[Strokes]:
    """A single stroke less the mean over a period about each row, where that is louder than what is left: long waves
    leak into blocks of few periods, and the mean over one holds no harmonic."""
    readings, half = strokes.readings.copy(), 0.5 / wavenumber
    along = np.maximum.accumulate(np.abs(strokes.place - strokes.place[0]))
    if along[-1] < LEVELLED * half or not strokes.seen.all():
        return strokes
    sums = np.zeros_like(readings)
    np.cumsum(0.5 * np.diff(along)[:, None] * (readings[1:] + readings[:-1]), axis=0, out=sums[1:])
    # Nearer to an end than half a period the mean goes on as it does over the next half.
    middle, end = np.clip(along, half, along[-1] - half), along[-1]
    at = np.concatenate([middle, [half, 2 * half, end - 2 * half, end - half]])
    beyond = (along - middle) / half
    for gauge, total in enumerate(sums.T):
        yield
        slow = (np.interp(at + half, along, total) - np.interp(at - half, along, total)) / (2 * half)
        slow = slow[:-4] + beyond * np.where(beyond < 0, slow[-3] - slow[-4], slow[-1] - slow[-2])
        rest = readings[:, gauge] - slow
        if slow @ slow > rest @ rest:
            readings[:, gauge] = rest
    return strokes._replace(readings=readings)


def credits_of(
    line: Line, spectrum: Spectrum, strokes: Strokes, time: np.ndarray, others: list[Line]
) -> Pieces[tuple[float, float]]:
    """Energy over the background that only this line explains, and the most that only one of time's lines does."""
    weight = strokes.weight
    turns = [line.wavenumber * forward(strokes), *(other.wavenumber * time for other in others)]
    atoms = np.exp(2j * np.pi * np.array(turns))
    credit = np.zeros(len(atoms))
    for first, last in zip(strokes.begin[:-1], strokes.begin[1:], strict=True):
        yield
        own = atoms[:, first:last]
        weighted = np.conj(own) * weight[first:last]
        gram = weighted @ own.T
        size = float(gram[0, 0].real)
        if size <= 0:
            continue
        gram += 1e-6 * size * np.eye(len(gram))
        inverse = np.linalg.inv(gram)
        amplitude = inverse @ (weighted @ strokes.readings[first:last])
        energy = np.abs(amplitude) ** 2 * size / inverse.diagonal().real[:, None]
        shared = np.abs(gram[0]) ** 2 / (size * gram.diagonal().real)
        credit += np.where(shared > ALIKE, energy @ (1 / spectrum.own), 0.0)
    shown = max(int(np.isfinite(spectrum.own).sum()), 1)
    credit /= shown * line.amplitude**2 / line.ratio
    return float(credit[0]), float(credit[1:].max(initial=0.0))
