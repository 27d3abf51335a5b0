"""Spectral lines of a whole log in the position domain: the wavelengths of what the finger slid over.

The spectrum is taken over position, not time: a surface has one wavelength whatever the velocity was. Power is pooled
over the channels; a line is a peak that the background beside it (drift, rough surface, noise; see
`papilla.estimators.background`) reaches by chance in `false_alarm` of all logs at most.
"""

from dataclasses import dataclass

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.background import Level, background
from papilla.estimators.peaks import Peak, order_of, vertex, with_harmonics
from papilla.estimators.position_spectrum import GRID_PER_PERIOD, PositionSpectrum, position_spectrum

FALSE_ALARM = 0.01
FEWEST_PERIODS = 3.0
"""A wavelength is searched up to the path divided by this; a taper cannot tell longer ones from drift."""
FEWEST_STEPS = 2.2
"""A wavelength is searched down to so many position steps; two are the aliasing limit."""
TREND = 3
"""Degree of the polynomial in position that is taken for drift."""
BEYOND = 4.0
"""The spectrum reaches to wavenumbers so many times higher than those searched, where the log shows them: a line that
is also a harmonic, or a background, is seen there."""

LEAST = 1e-100
"""No reading changes by less; the square's square of more is not zero."""
LONGEST_GRID = 2**19
"""Points of the grid of a spectrum above which `latest_stretch` shortens a log: 4 million padded points a channel."""


@dataclass(frozen=True)
class SpectralLine:
    """One line.

    wavelength_mm, sigma_mm : and its standard deviation from the noise around the line; an error of the velocity adds
    to it in full, 1 % for 1 %. A line with harmonics has the wavelength on which it and they agree.
    amplitude : root mean square over the channels of the amplitude of the sinusoid, in units of the readings.
    ratio : power over the background; chance : probability of it or more from the background anywhere in the search.
    harmonic, fundamental_mm : it may be that harmonic of a stronger line of that wavelength, or 1 and its own.
    channels : numbers, from 0, of those in which it stands out by itself, as rarely by chance as in all together.
    """

    wavelength_mm: float
    sigma_mm: float
    amplitude: float
    ratio: float
    chance: float
    harmonic: int
    fundamental_mm: float
    channels: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class LineSpectrum:
    """The significant lines, greatest amplitude first, and what they were found in.

    searched_mm : shortest and longest wavelength that was looked at: the part of the range asked for which the position
    step does not alias and of which the path holds three periods.
    wavenumber_per_mm, power : (n,) pooled spectrum, in units of the mean background of the channels.
    background : (n,) expected power of noise, infinite where it cannot be told: nearer than four periods to drift, or
    at the end of what the steps show. unused_samples, unused_channels : how many were left out because they hold no
    number, or never change.
    """

    lines: tuple[SpectralLine, ...]
    searched_mm: tuple[float, float]
    wavenumber_per_mm: np.ndarray
    power: np.ndarray
    background: np.ndarray
    unused_samples: int
    unused_channels: int


def travelled(t_s, velocity_mm_s) -> np.ndarray:
    """Position in mm (n,) at times (n,), from a velocity in mm/s, scalar or (n,): its trapezoidal integral from 0.

    Raises `InputError` for times that fall or are not finite, and for a velocity that is not finite.
    """
    from scipy.integrate import cumulative_trapezoid

    time = np.asarray(t_s, float)
    velocity = np.broadcast_to(np.asarray(velocity_mm_s, float), time.shape)
    if time.ndim != 1 or not len(time) or not (np.isfinite(time).all() and np.isfinite(velocity).all()):
        raise InputError("t_s must be one column, and it and velocity_mm_s must be finite, to integrate a position")
    falls = np.diff(time) < 0
    if falls.any():
        raise InputError(f"t_s must not fall; it does after row {int(np.argmax(falls))}")
    return cumulative_trapezoid(velocity, time, initial=0.0)


def find_lines(
    position_mm, readings, *, wavelength_range_mm: tuple[float, float] | None = None, false_alarm: float = FALSE_ALARM
) -> LineSpectrum:
    """All significant lines of readings (n,) or (n, channels) at positions (n,) in mm, greatest amplitude first.

    Positions need be neither even nor rising. Rows and channels without a finite number are left out and counted.
    Raises `InputError` for unequal lengths, fewer than 16 usable rows, no movement, no usable channel, and a range of
    which nothing can be searched.
    """
    false_alarm = checks.within("false_alarm", false_alarm, 1e-12, 0.5)
    position, channels, unused_samples, used = usable(position_mm, readings)
    shortest = _shortest(position)
    low, high = _searched(position, shortest, wavelength_range_mm)
    spectrum = position_spectrum(position, channels, 1 / max(shortest, low / BEYOND), TREND)
    power, octaves = spectrum.pooled(), float(np.log(high / low)) / spectrum.resolution
    peaks = _peaks(spectrum, power, used, false_alarm, octaves)
    inside = np.flatnonzero((spectrum.wavenumber >= 1 / high) & (spectrum.wavenumber <= 1 / low))
    return LineSpectrum(
        tuple(_lines(peaks, spectrum.resolution, (low, high), octaves)),
        (low, high),
        spectrum.wavenumber[inside],
        power[inside],
        _level(spectrum, power, inside).power,
        unused_samples,
        1 - len(used) if np.ndim(readings) == 1 else np.shape(readings)[1] - len(used),
    )


def latest_stretch(position_mm, wavelength_range_mm: tuple[float, float] | None = None) -> int:
    """First row (from 0) of the latest stretch of positions (n,) whose spectrum has no more than `LONGEST_GRID` points.

    Raises `InputError` for no movement and an unusable range.
    """
    position = checks.believable(np.asarray(position_mm, float))
    rows = np.flatnonzero(np.isfinite(position))
    known = position[rows]
    if known.size < 2:
        raise InputError("a spectrum over position needs rows with a position")
    low = _shortest(known) if wavelength_range_mm is None else max(wavelength_range_mm[0] / BEYOND, _shortest(known))
    # How far the path of the last rows reaches, for each row that it may begin with.
    reach = np.maximum.accumulate(known[::-1]) - np.minimum.accumulate(known[::-1])
    fits = int(np.searchsorted(reach, LONGEST_GRID * low / GRID_PER_PERIOD, side="right"))
    return int(rows[known.size - fits]) if fits < known.size else 0


def usable(position_mm, readings) -> tuple[np.ndarray, np.ndarray, int, np.ndarray]:
    """Positions and readings (n, c) of rows that a sensor may give, and of changing channels; how many rows were left
    out, and the numbers (c,) of the channels."""
    position, table = (checks.believable(np.asarray(own, float)) for own in (position_mm, readings))
    table = table[:, None] if table.ndim == 1 else table
    if position.ndim != 1 or table.ndim != 2 or len(table) != len(position):
        raise InputError(f"position_mm (n,) and readings (n, channels) do not fit: {position.shape}, {table.shape}")
    # A channel without a number most of the time is dead: it must not take every row with it.
    alive = np.isfinite(table).mean(axis=0) > 0.5 if len(table) else np.zeros(table.shape[1], bool)
    rows = np.isfinite(position) & np.isfinite(table[:, alive]).all(axis=1)
    if rows.sum() < 16:
        raise InputError(f"a spectrum needs 16 rows with a position and finite readings, got {int(rows.sum())}")
    kept = table[np.ix_(rows, alive)]
    changing = np.ptp(kept, axis=0) > LEAST
    if not changing.any():
        raise InputError("no channel has changing, finite readings")
    return position[rows], kept[:, changing], int((~rows).sum()), np.flatnonzero(alive)[changing]


def _shortest(position: np.ndarray) -> float:
    """Shortest wavelength that the steps of these positions show."""
    steps = np.abs(np.diff(position))
    if not steps.any():
        raise InputError("the position never changes: there is no wavelength without movement")
    return FEWEST_STEPS * float(np.average(steps, weights=steps))


def _searched(position: np.ndarray, shortest: float, asked: tuple[float, float] | None) -> tuple[float, float]:
    """The wavelengths that these positions allow, inside the range asked for."""
    path = float(np.ptp(position))
    longest = path / FEWEST_PERIODS
    low, high = shortest, longest
    if asked is not None:
        first, last = checks.rising("wavelength_range_mm", asked)
        low, high = max(low, first), min(high, last)
    if low >= high:
        wanted = "" if asked is None else f" of the {asked[0]:g} to {asked[1]:g} mm asked for"
        raise InputError(
            f"no wavelength{wanted} can be searched: {path:.4g} mm of path in steps of {shortest / FEWEST_STEPS:.3g} "
            f"mm show {shortest:.3g} to {longest:.3g} mm"
        )
    return low, high


def _level(spectrum: PositionSpectrum, power: np.ndarray, at: np.ndarray) -> Level:
    """Background at these indices of the spectrum."""
    return background(power, at, spectrum.resolution / spectrum.step)


def _lines(peaks: list[Peak], resolution: float, searched: tuple[float, float], octaves: float) -> list[SpectralLine]:
    """The peaks inside the searched range as lines: strongest first, the later ones may be harmonics of them."""
    lines: list[SpectralLine] = []
    fundamentals: list[tuple[Peak, float]] = []
    for peak in peaks:
        if not searched[0] <= 1 / peak.wavenumber <= searched[1]:
            continue
        orders = ((order_of(peak, stronger, resolution), agreed) for stronger, agreed in fundamentals)
        order, fundamental = next((found for found in orders if found[0] > 1), (1, 0.0))
        agreed = peak if order > 1 else with_harmonics(peak, peaks, resolution)
        wavelength, sigma = 1 / agreed.wavenumber, agreed.sigma / agreed.wavenumber**2
        if order == 1:
            fundamental = wavelength
            fundamentals.append((peak, fundamental))
        rarely = min(_trials(octaves, peak.wavenumber) * peak.chance, 1.0)
        lines.append(
            SpectralLine(wavelength, sigma, peak.amplitude, peak.ratio, rarely, order, fundamental, peak.channels)
        )
    return lines


def _trials(octaves: float, wavenumber: float) -> float:
    """How often noise is looked at: a wavelength of any size is as likely, so each octave has as many false alarms."""
    return max(octaves * wavenumber, 1.0)


def _peaks(
    spectrum: PositionSpectrum, power: np.ndarray, used: np.ndarray, false_alarm: float, octaves: float
) -> list[Peak]:
    """All peaks that noise reaches more rarely than `false_alarm` in all trials, greatest first; used : the channels'
    numbers."""
    from scipy.ndimage import maximum_filter1d

    # A side lobe, or the shoulder of a stronger line, is within the width of the taper.
    highest = maximum_filter1d(power, 2 * round(2 * spectrum.resolution / spectrum.step) + 1)
    tops = 1 + np.flatnonzero((power == highest)[1:-1] & (power[1:-1] > power[:-2]))
    level = _level(spectrum, power, tops)
    # A line that a few channels show is lost in the mean with others: the most telling one counts, for as many trials.
    each = np.maximum(spectrum.power, 1e-300).T
    alone = np.array([_level(spectrum, own, tops).chance(own[tops]) for own in each])
    chances = 2 * np.minimum(level.chance(power[tops]), len(used) * alone.min(axis=0))
    # Channels that share their noise count as often as the scatter of the power says, not as they are many.
    independents = np.minimum(level.freedom / 2, len(used))
    found = []
    for top, noise, chance, single, independent in zip(
        tops.tolist(), level.power, chances, alone.T, independents, strict=True
    ):
        rare = false_alarm / _trials(octaves, top * spectrum.step)
        if chance >= rare:
            continue
        over = float(power[top] / noise)
        place = (top + vertex(power[top - 1 : top + 2])) * spectrum.step
        amplitude = float(np.sqrt(np.mean(spectrum.power[top]))) / spectrum.gain
        sigma = spectrum.spread / float(np.sqrt(over * independent))
        found.append(Peak(place, sigma, amplitude, over, float(chance), tuple(used[single < rare].tolist())))
    return sorted(found, key=lambda peak: -peak.amplitude)
