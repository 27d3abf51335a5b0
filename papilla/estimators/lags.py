"""The distance between channels along the movement, from the phase of one line: without a velocity.

A wave a cos(2 pi x / lambda + phi) is fitted to each channel over the path, with a trend. A channel that feels the
surface d later has a phase that is 2 pi d / lambda less at any velocity, so the difference of two phases is the lag d,
up to whole wavelengths. Its sigma is the larger of two: the noise beside the line over its amplitude, and the scatter
of the lags of parts of the path, because a skin that shifts makes them wander. A line that noise alone may have made
has any phase.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.lines import FALSE_ALARM, TREND, usable
from papilla.estimators.spectrum import FEWEST_ROWS
from papilla.units import TINY

NEIGHBOURS = range(3, 9)
"""Distances from the line, in resolutions, at which the noise of its phase is measured."""
PART_WAVES, SHORT_WAVES, INDEPENDENT = 2.0, 1.25, 2.0
FEWEST_PARTS, MOST_PARTS = 3, 8
"""Wavelengths in a part of the path whose lag is compared with others; the smallest number if there are few parts; the
number of neighbouring parts, whose lags wander together, that count as one; and the number of parts."""
SHOWN = np.sqrt(-2 * np.log(FALSE_ALARM))
"""Ratio of amplitude to noise that noise alone exceeds in one of a hundred cases."""
EVENLY = 1 / np.sqrt(12)
"""Standard deviation, in turns, of a phase that may have any value."""
_MEDIAN_TO_SIGMA = 1 / np.sqrt(2 * np.log(2))


@dataclass(frozen=True, eq=False)
class ChannelLags:
    """lag_mm (c,) : distance along the path by which each channel shows the line later than the reference, within +-
    half a wavelength (whole wavelengths cannot be determined). sigma_mm (c,) : its standard deviation, the reference's
    included.

    Sigma holds for this log: it contains noise and, for paths of four wavelengths and more, the variation of the lags
    along the path. With another force or speed the skin shears differently. In logs of recorded boards, lags over the
    two halves of a log agree (97 to 100 % within two sigma), but lags of 4 mm differ by another 0.03 to 0.15 of a
    wavelength from log to log.

    reference : number of the channel, from 0, with the clearest line. amplitude (c,) : of the line, in units of the
    readings.
    """

    lag_mm: np.ndarray
    sigma_mm: np.ndarray
    reference: int
    amplitude: np.ndarray


def channel_lags(position_mm: ArrayLike, readings: ArrayLike, wavelength_mm: float) -> ChannelLags:
    """Lags of a line between channels of readings (n, c) at positions (n,) in mm.

    Between channels at a distance d along the movement the phase is 2 pi d / wavelength at any velocity (2011 Oddo,
    equation (4)), so the lag is d. Raises `InputError` for fewer than two usable channels, and for a path shorter than
    two wavelengths.
    """
    wavelength = checks.positive("wavelength_mm", wavelength_mm)
    position, channels, _, used = usable(position_mm, readings)
    if len(used) < 2 or len(used) < np.shape(readings)[1]:
        raise InputError("lags need two or more channels, all of them with changing, finite readings")
    path = float(np.ptp(position))
    if path < 2 * wavelength:
        raise InputError(f"lags of {wavelength:g} mm need a path of two wavelengths, got {path:.4g} mm")
    at_line = phasors(position, channels, wavelength)
    amplitude = np.abs(at_line)
    noise = _noise(position, channels, 1 / wavelength, 1 / path)
    reference = int(np.argmax(amplitude / np.maximum(noise, 1e-12 * amplitude.max())))
    turns = np.angle(at_line[reference] * np.conj(at_line)) / (2 * np.pi)
    own = noise / np.maximum(amplitude, TINY)
    sigma = np.maximum(np.hypot(own, own[reference]) / (2 * np.pi), _scatter(position, channels, wavelength, reference))
    # If noise alone may cause it, the phase is uniformly distributed over one wavelength.
    shown = amplitude > SHOWN * noise
    sigma = np.where(shown & shown[reference], np.minimum(sigma, EVENLY), EVENLY)
    sigma[reference] = 0.0
    return ChannelLags(turns * wavelength, sigma * wavelength, reference, amplitude)


def phasors(position: np.ndarray, channels: np.ndarray, wavelength_mm: float) -> np.ndarray:
    """(c,) complex amplitudes a of Re(a exp(2 pi i x / wavelength)) in channels (n, c), least squares with a trend.

    Samples are weighted by the path that they represent and by a Hann taper along the log.
    """
    at = 2 * (position - position.min()) / np.ptp(position) - 1
    angle = 2 * np.pi * position / wavelength_mm
    basis = np.column_stack([np.cos(angle), np.sin(angle), np.polynomial.legendre.legvander(at, TREND)])
    root = np.sqrt(np.hanning(len(position) + 2)[1:-1] * np.abs(np.gradient(position)))[:, None]
    solved = np.linalg.lstsq(basis * root, channels * root, rcond=None)[0]
    return solved[0] - 1j * solved[1]


def _scatter(position: np.ndarray, channels: np.ndarray, wavelength_mm: float, reference: int) -> np.ndarray:
    """(c,) standard deviation, in turns, of the mean lag, from the differences between parts of the path.

    The noise beside the line does not show a lag that wanders along the path, as a shifting skin causes it.
    """
    waves = float(np.ptp(position)) / wavelength_mm
    parts = min(max(int(waves / PART_WAVES), min(int(waves / SHORT_WAVES), FEWEST_PARTS)), MOST_PARTS)
    label = np.minimum(((position - position.min()) / np.ptp(position) * parts).astype(int), parts - 1)
    rows = [label == part for part in range(parts)]
    told = np.array([phasors(position[own], channels[own], wavelength_mm) for own in rows if own.sum() > FEWEST_ROWS])
    if len(told) < FEWEST_PARTS:
        return np.zeros(channels.shape[1])
    turned = told[:, [reference]] * np.conj(told)
    weight = np.abs(turned)
    off = np.angle(turned * np.conj(turned.sum(axis=0))) / (2 * np.pi)
    total = np.maximum(weight.sum(axis=0), TINY)
    return np.sqrt((INDEPENDENT * weight**2 * off**2).sum(axis=0) * len(told) / (len(told) - 1)) / total


def _noise(position: np.ndarray, channels: np.ndarray, wavenumber: float, resolution: float) -> np.ndarray:
    """(c,) standard deviation of each quadrature of the amplitude, from wavenumbers next to the line."""
    around = [wavenumber + side * step * resolution for step in NEIGHBOURS for side in (-1, 1)]
    sizes = [np.abs(phasors(position, channels, 1 / k)) for k in around if k > 1.5 * resolution]
    return np.median(sizes, axis=0) * _MEDIAN_TO_SIGMA
