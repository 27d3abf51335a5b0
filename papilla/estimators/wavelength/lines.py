"""Spectral lines of a whole log over position: the wavelengths of the surface under the finger.

The spectrum is taken over position, not time, because a surface has one wavelength at any velocity. Power is pooled
over the channels; a line is a peak that the background beside it (drift, rough surface, noise; see
`papilla.estimators.wavelength.spectrum`) would reach by chance in at most the share `false_alarm` of logs.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.units import TINY_DIVISOR
from papilla.estimators.stream import completed
from papilla.estimators.wavelength.fundamental import HARMONIC_SLACK_RESOLUTIONS, fundamental_of
from papilla.estimators.wavelength.spectrum import (
    CUBIC_SHARES,
    FEWEST_STEPS,
    Line,
    Spectrum,
    Strokes,
    background,
    spectrum_of,
    strokes_of,
)

LOG_FALSE_ALARM = 0.01
FEWEST_PATH_PERIODS = 3.0
"""The longest wavelength that is searched is the path divided by this number; a taper cannot separate longer ones from
drift."""
DRIFT_DEGREE = 3
"""Degree of the polynomial in position that is subtracted as drift."""
SPECTRUM_EXTENSION = 4.0
"""Factor by which the spectrum reaches beyond the searched wavenumbers, if the log shows them: it helps to recognise
harmonics and the background."""

POINTS_PER_WAVELENGTH, GRID_PADDING = 8, 8
"""Grid points in the shortest wavelength; and the factor by which the grid is extended with zeros, so that a peak is
sampled near its top."""
IMAGE_AMPLITUDE = 5e-4
"""Amplitude of an image over that of its line, at most: sinc(1 - 1 / POINTS_PER_WAVELENGTH)^4 / sinc(1 /
POINTS_PER_WAVELENGTH)^4. The steps of an even path repeat a line at each multiple of their wavenumber, and the grid
folds these images back. A weaker peak may be an image, unless it is a harmonic."""
MOST_HARMONICS = 12
"""Largest order of a harmonic that is recognised."""
SLACK_SIGMAS, SLACK_RESOLUTIONS = 3.0, 0.25
"""How far a peak may be from a multiple: so many sigmas of the difference plus a share of the resolution."""
LEAST_CHANNEL_CHANGE = 1e-100
"""A channel that changes by less counts as constant: the square of its change would be near the limit of floating-point
numbers."""
LONGEST_GRID = 500_000
"""Largest number of grid points of a spectrum, above which `latest_stretch` shortens a log. It is a little less than
2**19, so that the padded grid has 2**22 points a channel: 2**23 points would take 370 MB."""


@dataclass(frozen=True)
class SpectralLine:
    """One line.

    wavelength_mm, sigma_mm : wavelength, and its standard deviation from the noise around the line; an error of the
    velocity of 1 % adds 1 %. For a line with harmonics it is the common estimate.
    amplitude : root mean square over the channels of the amplitude of the sinusoid, in units of the readings.
    ratio : power over the background; chance : probability that the background reaches this power anywhere in the
    search.
    harmonic, fundamental_mm : the line may be this harmonic of a stronger line with that wavelength, or of a common
    period of loud lines that no line has itself (2.36 and 1.57 mm: 4.71); else 1 and its own wavelength.
    channels : numbers, from 0, of the channels in which the line alone is as significant as in all together.
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
    """The significant lines, largest amplitude first, and the spectrum in which they were found.

    searched_mm : shortest and longest wavelength that was searched: the part of the range that the position step does
    not alias and of which the path contains three periods.
    wavenumber_per_mm, power : (n,) pooled spectrum, in units of the mean background of the channels.
    background : (n,) expected power of noise, infinite if it is not known: nearer than four periods to drift, or at the
    end of the visible range. unused_samples, unused_channels : how many were left out because they contain no number,
    or never change.
    """

    lines: tuple[SpectralLine, ...]
    searched_mm: tuple[float, float]
    wavenumber_per_mm: np.ndarray
    power: np.ndarray
    background: np.ndarray
    unused_samples: int
    unused_channels: int


def travelled(t_s: ArrayLike, velocity_mm_s: ArrayLike) -> np.ndarray:
    """Position in mm (n,) at times (n,), from a velocity in mm/s, scalar or (n,): its trapezoidal integral from 0.

    Raises `InputError` for times that fall or are not finite, and for a velocity that is not finite.
    """
    from scipy.integrate import cumulative_trapezoid

    time = np.asarray(t_s, float)
    velocity = np.asarray(velocity_mm_s, float)
    if velocity.shape not in ((), time.shape):
        raise InputError(f"velocity_mm_s must be one number or one a time, got {velocity.shape} for {time.shape}")
    velocity = np.broadcast_to(velocity, time.shape)
    if time.ndim != 1 or not len(time) or not (np.isfinite(time).all() and np.isfinite(velocity).all()):
        raise InputError("t_s must be one column, and it and velocity_mm_s must be finite, to integrate a position")
    falls = np.diff(time) < 0
    if falls.any():
        raise InputError(f"t_s must not fall; it does after row {int(np.argmax(falls))}")
    return cumulative_trapezoid(velocity, time, initial=0.0)


def find_lines(
    position_mm: ArrayLike,
    readings: ArrayLike,
    *,
    wavelength_range_mm: tuple[float, float] | None = None,
    false_alarm: float = LOG_FALSE_ALARM,
) -> LineSpectrum:
    """All significant lines of readings (n,) or (n, channels) at positions (n,) in mm, greatest amplitude first.

    Positions need not be evenly spaced or rising. Rows and channels without a finite number are left out and counted.
    A peak of less than `IMAGE_AMPLITUDE` of the greatest one's amplitude that is no harmonic may be an image of that
    one, and counts as no line. Raises `InputError` for unequal lengths, fewer than 16 usable rows, no movement, no
    usable channel, and a range of which nothing can be searched."""
    false_alarm = checks.within("false_alarm", false_alarm, 1e-12, 0.5)
    position, channels, unused_samples, used = usable(position_mm, readings)
    shortest = _shortest(position)
    low, high = _searched(position, shortest, wavelength_range_mm)
    # Minus their mean, so that an offset costs no digits.
    channels = channels - channels.mean(axis=0)
    strokes = completed(strokes_of(position, channels, np.array([0, len(position)]), DRIFT_DEGREE))
    finest = max(shortest, low / SPECTRUM_EXTENSION)
    step = finest / POINTS_PER_WAVELENGTH
    size = 1 << int(np.ceil(np.log2(GRID_PADDING * (int(strokes.extent / step) + 2))))
    count = int((1 / finest + 3 / strokes.extent) * size * step) + 1
    spectrum = completed(spectrum_of(strokes, step, size, count, CUBIC_SHARES))
    octaves = float(np.log(high / low)) * strokes.extent
    peaks = _peaks(spectrum, strokes, used, false_alarm, octaves)
    wavenumber = spectrum.step * np.arange(len(spectrum.power))
    inside = np.flatnonzero((wavenumber >= 1 / high) & (wavenumber <= 1 / low))
    return LineSpectrum(
        tuple(_lines(peaks, 1 / strokes.extent, (low, high), octaves)),
        (low, high),
        wavenumber[inside],
        spectrum.power[inside],
        background(spectrum.power, inside, spectrum.resolution).power,
        unused_samples,
        1 - len(used) if np.ndim(readings) == 1 else np.shape(readings)[1] - len(used),
    )


def latest_stretch(position_mm, wavelength_range_mm: tuple[float, float] | None = None) -> int:
    """First row (from 0) of the longest stretch at the end of positions (n,) whose spectrum has at most `LONGEST_GRID`
    points.

    Raises `InputError` for no movement and an unusable range.
    """
    position = checks.believable(np.asarray(position_mm, float))
    rows = np.flatnonzero(np.isfinite(position))
    places = position[rows]
    if places.size < 2:
        raise InputError("a spectrum over position needs rows with a position")
    low = _shortest(places)
    if wavelength_range_mm is not None:
        low = max(wavelength_range_mm[0] / SPECTRUM_EXTENSION, low)
    # For each row: the length of the path from it to the end.
    reach = np.maximum.accumulate(places[::-1]) - np.minimum.accumulate(places[::-1])
    fits = int(np.searchsorted(reach, LONGEST_GRID * low / POINTS_PER_WAVELENGTH, side="right"))
    return int(rows[places.size - fits]) if fits < places.size else 0


def usable(position_mm, readings) -> tuple[np.ndarray, np.ndarray, int, np.ndarray]:
    """Positions and readings (n, c) without unusable rows and constant channels; the number of rows left out, and the
    numbers (c,) of the channels."""
    position, table = (checks.believable(np.asarray(column, float)) for column in (position_mm, readings))
    table = table[:, None] if table.ndim == 1 else table
    if position.ndim != 1 or table.ndim != 2 or len(table) != len(position):
        raise InputError(f"position_mm (n,) and readings (n, channels) do not fit: {position.shape}, {table.shape}")
    # A channel that mostly has no number is dead: it must not exclude every row.
    alive = np.isfinite(table).mean(axis=0) > 0.5 if len(table) else np.zeros(table.shape[1], bool)
    rows = np.isfinite(position) & np.isfinite(table[:, alive]).all(axis=1)
    if rows.sum() < 16:
        raise InputError(f"a spectrum needs 16 rows with a position and finite readings, got {int(rows.sum())}")
    values = table[np.ix_(rows, alive)]
    changing = np.ptp(values, axis=0) > LEAST_CHANNEL_CHANGE
    if not changing.any():
        raise InputError("no channel has changing, finite readings")
    return position[rows], values[:, changing], int((~rows).sum()), np.flatnonzero(alive)[changing]


def _shortest(position: np.ndarray) -> float:
    """Shortest wavelength that these positions can show."""
    steps = np.abs(np.diff(position))
    if not steps.any():
        raise InputError("the position never changes: there is no wavelength without movement")
    return FEWEST_STEPS * float(np.average(steps, weights=steps))


def _searched(position: np.ndarray, shortest: float, asked: tuple[float, float] | None) -> tuple[float, float]:
    """The wavelengths that these positions allow, inside the requested range."""
    path = float(np.ptp(position))
    longest = path / FEWEST_PATH_PERIODS
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


def _spread(strokes: Strokes) -> float:
    """Standard deviation of a line's wavenumber if its power equals the background.

    The maximum of a weighted periodogram has the angular variance W0^2 sum(w^2 x^2) / (2 r sum(w^2) W2^2), with r the
    power over the background, W0 = sum w, W2 = sum w x^2 and x from the weighted middle.
    """
    weight = strokes.weight
    x = strokes.place - float(weight @ strokes.place) / float(weight.sum())
    square = weight**2
    variance = weight.sum() ** 2 * (square @ x**2) / (2 * square.sum() * (weight @ x**2) ** 2)
    return float(np.sqrt(variance) / (2 * np.pi))


def _lines(peaks: list[Line], resolution: float, searched: tuple[float, float], octaves: float) -> list[SpectralLine]:
    """The peaks inside the searched range as lines, strongest first; later ones may be harmonics of them."""
    lines: list[SpectralLine] = []
    fundamentals: list[tuple[Line, float]] = []
    for peak in peaks:
        if not searched[0] <= 1 / peak.wavenumber <= searched[1]:
            continue
        orders = ((order_of(peak, stronger, resolution), agreed) for stronger, agreed in fundamentals)
        order, fundamental = next((match for match in orders if match[0] > 1), (1, 0.0))
        if order == 1 and peak.amplitude < IMAGE_AMPLITUDE * peaks[0].amplitude:
            continue
        agreed = peak if order > 1 else with_harmonics(peak, peaks, resolution)
        wavelength, sigma = 1 / agreed.wavenumber, agreed.sigma / agreed.wavenumber**2
        if order == 1:
            base = _common(peak, peaks, resolution, searched[1])
            order, fundamental = round(peak.wavenumber / base), wavelength * round(peak.wavenumber / base)
            fundamentals.append((peak._replace(wavenumber=1 / fundamental, sigma=peak.sigma / order), fundamental))
        rarely = min(max(octaves * peak.wavenumber, 1.0) * peak.chance, 1.0)
        properties = peak.amplitude, peak.ratio, rarely, order, fundamental, peak.channels
        lines.append(SpectralLine(wavelength, sigma, *properties))
    return lines


def _common(peak: Line, peaks: list[Line], resolution: float, longest_mm: float) -> float:
    """The wavenumber of which this peak and others as loud are, or may be, harmonics, even if no peak has it; its own
    if there is none in the range."""
    k, reach = peak.wavenumber, HARMONIC_SLACK_RESOLUTIONS * resolution
    others = [line for line in peaks if abs(line.wavenumber - round(line.wavenumber / k) * k) > reach]
    period = fundamental_of(peak, others, reach, set(others), False)
    base = period.other if period.loud else period.wavenumber
    return base if base * longest_mm > 1 else k


def order_of(peak: Line, fundamental: Line, resolution: float) -> int:
    """Which harmonic of the fundamental a peak may be, 1 for none."""
    order = round(peak.wavenumber / fundamental.wavenumber)
    if not 2 <= order <= MOST_HARMONICS:
        return 1
    slack = SLACK_SIGMAS * np.hypot(peak.sigma, order * fundamental.sigma) + SLACK_RESOLUTIONS * resolution
    off = abs(peak.wavenumber - order * fundamental.wavenumber)
    return order if off <= min(slack, 0.25 * fundamental.wavenumber) else 1


def with_harmonics(fundamental: Line, peaks: list[Line], resolution: float) -> Line:
    """The fundamental with the common wavenumber of itself and its weaker harmonics, weighted by inverse variance.

    The n-th harmonic determines the wavenumber n times better at the same power. If they disagree by more than their
    sigmas, sigma grows in proportion (Birge's ratio); a period that drifts along the path does that.
    """
    values, sigmas = [fundamental.wavenumber], [fundamental.sigma]
    for peak in sorted(peaks):
        order = order_of(peak, fundamental, resolution)
        if order > 1 and peak.amplitude < fundamental.amplitude:
            values.append(peak.wavenumber / order)
            sigmas.append(peak.sigma / order)
    if len(values) == 1:
        return fundamental
    weights = 1 / np.square(sigmas)
    mean = float(np.average(values, weights=weights))
    spread = float(weights @ np.square(np.array(values) - mean)) / (len(values) - 1)
    return fundamental._replace(wavenumber=mean, sigma=float(np.sqrt(max(spread, 1.0) / weights.sum())))


def _peaks(spectrum: Spectrum, strokes: Strokes, used: np.ndarray, false_alarm: float, octaves: float) -> list[Line]:
    """All peaks that noise would reach less often than `false_alarm` in all trials, largest first; used : the channels'
    numbers."""
    power, powers, resolution = spectrum.power, np.maximum(spectrum.each, TINY_DIVISOR), spectrum.resolution
    tops = spectrum.tops(1, len(power) - 1)
    # A line that few channels show disappears in the mean with others: the most significant channel counts, with as
    # many trials as channels.
    alone = np.array([background(values, tops, resolution).chance(values[tops]) for values in powers])
    chance = 2 * np.minimum(background(power, tops, resolution).chance(power[tops]), len(used) * alone.min(axis=0))
    # Wavelengths of all sizes are equally likely, so each octave has as many independent trials and false alarms.
    rare = false_alarm / np.maximum(octaves * (tops * spectrum.step), 1.0)
    tops, chance, showing = tops[chance < rare], chance[chance < rare], (alone < rare)[:, chance < rare]
    level = background(power, tops, resolution)
    ratio = power[tops] / level.power
    # Channels with common noise count according to the scatter of the pooled power, not according to their number.
    sigma = _spread(strokes) / np.sqrt(ratio * np.minimum(level.freedom / 2, len(used)))
    amplitude = np.sqrt(np.mean(spectrum.each[:, tops], axis=0)) / (0.5 * float(strokes.weight.sum()))
    rows = (values.tolist() for values in (spectrum.vertices(tops), ratio, amplitude, chance, sigma))
    channels = (tuple(used[values].tolist()) for values in showing.T)
    return sorted(map(Line._make, zip(*rows, channels, strict=True)), key=lambda peak: -peak.amplitude)
