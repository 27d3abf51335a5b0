"""Lines over time (hum, resonances) beside lines over the path: which is which, and readings without the former.

A wave of wavenumber k over a path x(t) and one of frequency f over time t are the same where the speed is constant.
Where it is not, a least-squares fit of both tells their energies apart, stroke by stroke.
"""

import numpy as np

from papilla.estimators.spectrum import Line, Spectrum, Strokes
from papilla.estimators.spread import Pieces

HARMONICS = 5
FOREIGN = 0.7
"""Share of its energy that a line over time may have in common with the surface's harmonics to be taken out."""
LOUD = 0.1
"""Energy of a line over time, beside the surface's, from which it is taken out."""
LEVELLED = 6.0
"""Half periods of a stroke from which long waves are taken out of it."""
ALIKE = 0.05
"""Share of a line's energy that a line over time must be able to explain to be its rival."""


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
    for rows in strokes.rows:
        yield
        own = atoms[:, rows]
        weighted = np.conj(own) * strokes.weight[rows]
        gram = weighted @ own.T
        size = np.maximum(gram.diagonal().real, 1e-300)
        alike = np.abs(gram[count:, :count]) ** 2 / np.outer(size[count:], size[:count])
        foreign = count + np.flatnonzero(alike.max(axis=1, initial=0.0) < FOREIGN)
        pull = weighted @ readings[rows]
        for _ in range(2):
            used = np.concatenate([np.arange(count), foreign])
            some = gram[np.ix_(used, used)] + 1e-6 * size.max() * np.eye(len(used))
            amplitude = np.linalg.solve(some, pull[used])
            energy = (np.abs(amplitude) ** 2).sum(axis=1)
            # What is faint beside the surface's own may be its error, and does no harm.
            kept = energy[count:] > LOUD * energy[:count].sum()
            foreign, amplitude = foreign[kept], amplitude[count:][kept]
        readings[rows] -= 2 * (own[foreign].T @ amplitude).real
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
    turns = [line.wavenumber * forward(strokes), *(other.wavenumber * time for other in others)]
    atoms = np.exp(2j * np.pi * np.array(turns))
    credit = np.zeros(len(atoms))
    for rows in strokes.rows:
        yield
        own = atoms[:, rows]
        weighted = np.conj(own) * strokes.weight[rows]
        gram = weighted @ own.T
        size = float(gram[0, 0].real)
        if size <= 0:
            continue
        gram += 1e-6 * size * np.eye(len(gram))
        inverse = np.linalg.inv(gram)
        amplitude = inverse @ (weighted @ strokes.readings[rows])
        energy = np.abs(amplitude) ** 2 * size / inverse.diagonal().real[:, None]
        shared = np.abs(gram[0]) ** 2 / (size * gram.diagonal().real)
        credit += np.where(shared > ALIKE, energy @ (1 / spectrum.own), 0.0)
    shown = max(int(np.isfinite(spectrum.own).sum()), 1)
    credit /= shown * line.amplitude**2 / line.ratio
    return float(credit[0]), float(credit[1:].max(initial=0.0))
