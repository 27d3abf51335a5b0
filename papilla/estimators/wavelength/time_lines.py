"""Lines over time (hum, resonances) beside lines over the path: separates them, and removes the former from the
readings.

A wave of wavenumber k over a path x(t) and one of frequency f over time t are the same if the speed is constant. If it
is not, a least-squares fit of both separates their energies, stroke by stroke.
"""

import numpy as np

from papilla.core.units import TINY_DIVISOR
from papilla.estimators.stream import Pieces
from papilla.estimators.wavelength.fundamental import FITTED_HARMONICS
from papilla.estimators.wavelength.spectrum import CYCLE_EXPONENT, Line, Spectrum, Strokes

FOREIGN_ENERGY_SHARE = 0.7
"""Largest share of its energy that a line over time may share with harmonics of the surface if it is to be removed."""
LOUD_ENERGY_RATIO = 0.1
"""Energy of a line over time, relative to the surface's, above which it is removed."""
LEVELLED_HALF_PERIODS = 6.0
"""Number of half periods in a stroke from which long waves are removed from it."""
FIT_RIDGE = 1e-6
"""Of the diagonal of a fit, added to it: waves that the rows cannot tell apart share their energy."""
ALIKE_ENERGY_SHARE = 0.05
"""Share of a line's energy that a line over time must be able to explain to compete with it."""


def forward(strokes: Strokes) -> np.ndarray:
    """(m,) place that grows along each stroke like time; on the way back the phase of a wave runs backwards."""
    first, last = strokes.begin[:-1], strokes.begin[1:] - 1
    way = np.where(strokes.place[last] < strokes.place[first], -1.0, 1.0)
    return np.repeat(way, np.diff(strokes.begin)) * strokes.place


def silenced(strokes: Strokes, time: np.ndarray, lines: list[Line], wavenumber: float = 0.0) -> Pieces[Strokes]:
    """The strokes without the lines over time (m,), except those that are harmonics of a wavenumber. Without a
    wavenumber only lines about as strong as the strongest are removed."""
    if wavenumber == 0:
        most = max((line.amplitude for line in lines), default=0.0)
        lines = [line for line in lines if line.amplitude > 0.5 * most]
    if not lines:
        return strokes
    count = FITTED_HARMONICS if wavenumber else 0
    frequencies = np.array([line.wavenumber for line in lines])[:, None]
    turns = [wavenumber * np.arange(1, count + 1)[:, None] * forward(strokes), frequencies * time]
    atoms = np.exp(CYCLE_EXPONENT * np.concatenate(turns))
    readings = strokes.readings.copy()
    for rows in strokes.rows:
        yield
        waves = atoms[:, rows]
        weighted = np.conj(waves) * strokes.weight[rows]
        gram = weighted @ waves.T
        size = np.maximum(gram.diagonal().real, TINY_DIVISOR)
        alike = np.abs(gram[count:, :count]) ** 2 / np.outer(size[count:], size[:count])
        foreign = count + np.flatnonzero(alike.max(axis=1, initial=0.0) < FOREIGN_ENERGY_SHARE)
        pull = weighted @ readings[rows]
        for _ in range(2):
            used = np.concatenate([np.arange(count), foreign])
            some = gram[np.ix_(used, used)] + FIT_RIDGE * size.max() * np.eye(len(used))
            amplitude = np.linalg.solve(some, pull[used])
            energy = (np.abs(amplitude) ** 2).sum(axis=1)
            # A line that is faint compared with the surface's own may be an error of it, and does no harm.
            loud = energy[count:] > LOUD_ENERGY_RATIO * energy[:count].sum()
            foreign, amplitude = foreign[loud], amplitude[count:][loud]
        readings[rows] -= 2 * (waves[foreign].T @ amplitude).real
    return strokes._replace(readings=np.where(strokes.seen, readings, 0.0))


def levelled(strokes: Strokes, wavenumber: float) -> Pieces[Strokes]:
    """A single stroke minus the mean over one period about each row, if this mean is louder than the rest. Long waves
    leak into blocks of few periods; the mean over a period contains none of the harmonics."""
    readings, half = strokes.readings.copy(), 0.5 / wavenumber
    along = np.maximum.accumulate(np.abs(strokes.place - strokes.place[0]))
    if along[-1] < LEVELLED_HALF_PERIODS * half or not strokes.seen.all():
        return strokes
    sums = np.zeros_like(readings)
    np.cumsum(0.5 * np.diff(along)[:, None] * (readings[1:] + readings[:-1]), axis=0, out=sums[1:])
    # Nearer to an end than half a period, the mean is continued linearly.
    middle, end = np.clip(along, half, along[-1] - half), along[-1]
    at = np.concatenate([middle, [half, 2 * half, end - 2 * half, end - half]])
    beyond = (along - middle) / half
    for gauge, total in enumerate(sums.T):
        yield
        slow = (np.interp(at + half, along, total) - np.interp(at - half, along, total)) / (2 * half)
        slow, (first, second, last_but_one, last) = slow[: len(along)], slow[len(along) :].tolist()
        slow += beyond * np.where(beyond < 0, second - first, last - last_but_one)
        rest = readings[:, gauge] - slow
        if slow @ slow > rest @ rest:
            readings[:, gauge] = rest
    return strokes._replace(readings=readings)


def credits_of(
    line: Line, spectrum: Spectrum, strokes: Strokes, time: np.ndarray, others: list[Line]
) -> Pieces[tuple[float, float]]:
    """Energy over the background that only this line explains, and the largest energy that only one line over time
    explains."""
    turns = [line.wavenumber * forward(strokes), *(timed.wavenumber * time for timed in others)]
    atoms = np.exp(CYCLE_EXPONENT * np.array(turns))
    credit = np.zeros(len(atoms))
    for rows in strokes.rows:
        yield
        waves = atoms[:, rows]
        weighted = np.conj(waves) * strokes.weight[rows]
        gram = weighted @ waves.T
        size = float(gram[0, 0].real)
        if size <= 0:
            continue
        gram += FIT_RIDGE * size * np.eye(len(gram))
        inverse = np.linalg.inv(gram)
        amplitude = inverse @ (weighted @ strokes.readings[rows])
        energy = np.abs(amplitude) ** 2 * size / inverse.diagonal().real[:, None]
        shared = np.abs(gram[0]) ** 2 / (size * gram.diagonal().real)
        credit += np.where(shared > ALIKE_ENERGY_SHARE, energy @ (1 / spectrum.own), 0.0)
    showing = max(int(np.isfinite(spectrum.own).sum()), 1)
    credit /= showing * line.amplitude**2 / line.ratio
    return float(credit[0]), float(credit[1:].max(initial=0.0))
