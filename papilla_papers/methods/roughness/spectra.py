"""The frequency of the highest peak of a short-time spectrum, as printed and corrected.

Spectra are of 200 ms (2006 paper, section III C) or of 32 ms, with the amplitude as a quartic of the wavelength
(Okamoto et al. 2011).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.estimators.wavelength.spectrum import vertex
from papilla.telepresence.amplitude import AmplitudeFit as AmplitudeFit
from papilla.telepresence.amplitude import fit_amplitude as fit_amplitude
from papilla_papers.methods.roughness import stream
from papilla_papers.methods.roughness.stream import Finding, RoughnessStream
from papilla_papers.methods.window import SampleWindow

BY_MATRIX = 2**18
"""Largest size of a matrix that levels, tapers and transforms a window in one product; above it an FFT is faster."""


class Method(NamedTuple):
    """window_s, hop_s : of the paper, 0 for one sample; taper : function of the number of samples; padding : length of
    the transform in windows.

    corrected : mean and trend are removed; only lines of the wavelength range count; the peak is interpolated (within
    1e-3 of a line at a padding of 4); the wavelength uses the mean |v| under the taper, not |v(t)|.
    """

    window_s: float
    hop_s: float
    taper: Callable[[int], np.ndarray]
    padding: int
    corrected: bool


def hann(count: int) -> np.ndarray:
    """Hann taper of `count` samples, none of them zero."""
    return np.hanning(count + 2)[1:-1]


@dataclass(eq=False)
class SpectrumMemory:
    """window : of readings and of speeds; line : of the last spectrum, with the mean speed in place of the distance."""

    window: SampleWindow
    line: Finding = Finding(stream.WARMING_UP_CODE)


class ShortTimeSpectrum(RoughnessStream):
    """Streaming frequency from a short-time spectrum; a sample is (reading, velocity_mm_s[, t_s]).

    As printed (2006): 200 ms window every 10 ms, frequency of the highest line above 0 Hz (5 Hz apart), held until the
    next; wavelength = |v(t)| / f. The paper names no taper: none is applied, so slow drift leaks into the low lines and
    hides them, as it reports.

    Corrected: mean and trend removed, Hann taper, peak interpolated by a parabola through the logarithm, only lines
    between |v| / longest and |v| / shortest wavelength, and the wavelength from the mean |v| under the taper instead of
    the velocity at the end.

    Measured (RMS error of the wavelength over 0.6-3.0 mm, synthetic gratings, as printed / corrected): 3.1 / 0.06 % at
    20 dB and 97-103 mm/s, 3.2 / 0.6 % at 0 dB; 125 / 32 % in active touch of 100 sin 2 pi t mm/s and 134 / 54 % of
    197 sin 2 pi 1.07 t: no correction saves a window in which the frequency sweeps over an octave.

    power is the one-sided power spectral density at the peak, in squared units of the reading times s.

    Parameters are those of `RoughnessStream` (window_s None: 0.2 s), and hop_s (None: 10 ms) : time between spectra,
    <= window_s. Raises `InputError` for unusable values.
    """

    VARIANTS = {
        "as_printed": Method(window_s=0.2, hop_s=0.01, taper=np.ones, padding=1, corrected=False),
        "corrected": Method(window_s=0.2, hop_s=0.01, taper=hann, padding=4, corrected=True),
    }

    def __init__(self, *, hop_s: float | None = None, **parameters: Any):
        self._hop_s = None if hop_s is None else checks.positive("hop_s", hop_s)
        super().__init__(**parameters)

    def _prepare(self) -> None:
        count, method = self.window_samples, self._method
        hop_s = max(method.hop_s, 1 / self.sample_rate_Hz) if self._hop_s is None else self._hop_s
        self._hop = round(hop_s * self.sample_rate_Hz)
        if not 1 <= self._hop <= count:
            raise InputError(f"hop_s must be between one sample and window_s, got {hop_s:g} s")
        self._settings += f", every {self._hop} samples"
        # A spectrum is available with the sample that fills its window, not with the next one.
        self._full = count - 1
        self._taper = method.taper(count)
        energy = float(self._taper @ self._taper)
        self._to_density = 2 / (self.sample_rate_Hz * energy)
        self._weights = self._taper**2 / energy
        self._length = method.padding * count
        self._lines, self._line_Hz = self._length // 2 + 1, self.sample_rate_Hz / self._length
        ramp = np.arange(count) - 0.5 * (count - 1)
        self._trend = np.stack([np.full(count, count**-0.5), ramp / np.linalg.norm(ramp)])
        self._matrix = None
        if 2 * self._lines * count <= BY_MATRIX:
            rows = self._transformed(np.eye(count)).T
            self._matrix = np.stack([rows.real, rows.imag], axis=1).reshape(-1, count)

    def _begin(self) -> SpectrumMemory:
        return SpectrumMemory(SampleWindow(1, self.window_samples, self._hop, extra=1))

    def _find(self, method: SpectrumMemory, reading: float, speed: float) -> Finding:
        if method.window.push((reading, speed)):
            method.line = self._spectrum(method.window)
        status, frequency, mean_speed, power = method.line
        return Finding(status, frequency, (mean_speed if self._method.corrected else speed) / frequency, power)

    def _spectrum(self, window: SampleWindow) -> Finding:
        """The strongest line of a window, with the mean speed in place of the distance."""
        if window.torn:
            return Finding(stream.GAP_CODE)
        if window.dead:
            return Finding(stream.SILENT_CODE)
        readings, speeds = window.samples
        speed = float(speeds @ self._weights)
        if max(float(speeds[-1]), speed) > self._fastest:
            return Finding(stream.ALIASED_CODE)
        low, high = self._gate(speed)
        if high - low < 3:
            return Finding(stream.STANDSTILL_CODE)
        power = self._powers(readings, low - 1, high + 1)
        best = low + int(power[1 : high - low + 1].argmax())
        if best == self._lines - 1:
            return Finding(stream.ALIASED_CODE)
        if self._method.corrected and not low < best < high - 1:
            # The highest line is at the edge of the gate: the flank of a line outside the wavelength range.
            return Finding(stream.SILENT_CODE)
        around = power[best - low : best - low + 3].tolist()
        place = best + vertex(around) if self._method.corrected else best
        status = stream.GAP_CODE if window.gaps else stream.OK
        return Finding(status, place * self._line_Hz, speed, around[1] * self._to_density)

    def _powers(self, window: np.ndarray, first: int, last: int) -> np.ndarray:
        """Squared magnitudes of the lines first ... last - 1 of a window (n,), as far as they exist."""
        if self._matrix is None:
            return np.abs(self._transformed(window)[first:last]) ** 2
        parts = self._matrix[2 * first : 2 * last] @ window
        parts *= parts
        return parts[::2] + parts[1::2]

    def _transformed(self, windows: np.ndarray) -> np.ndarray:
        """Spectra (..., lines) of windows (..., n): levelled, tapered, padded with zeros."""
        if self._method.corrected:
            windows = windows - windows @ self._trend.T @ self._trend
        return np.fft.rfft(windows * self._taper, self._length)

    def _gate(self, speed: float) -> tuple[int, int]:
        """First line, and one past the last line, that may be the peak; without a velocity, all above 0 Hz."""
        if not self._method.corrected or not speed < math.inf:
            return 1, self._lines
        # One line more at each end, so that a peak inside the range has both neighbours.
        low = max(1, math.floor(speed / (self._high * self._line_Hz)) - 1)
        return low, min(self._lines, math.ceil(speed / (self._low * self._line_Hz)) + 2)


class Okamoto(ShortTimeSpectrum):
    """Streaming wavelength and power of the strongest line; a sample is (reading, velocity_mm_s[, t_s]).

    As printed (Okamoto et al. 2011, Adv. Robot. 25, section 4): Hamming taper of 32 ms, frequency of the greatest power
    spectral density (lines 31 Hz apart), wavelength = v(t) / f, amplitude = that density. Two things are not printed:
    the window is moved by one sample, because figure 9 averages an estimate per millisecond, and 0 Hz is left out,
    because the offset of a strain gauge would always win.

    Corrected: 80 ms (32 ms hold one period of 3 mm at 100 mm/s), mean and trend removed, interpolated peak, only
    lines of the wavelength range, and the mean |v| under the taper.

    Measured (RMS error of the wavelength over 0.6-3.0 mm, synthetic gratings, as printed / corrected): 17 / 0.26 % at
    20 dB and 97-103 mm/s, 22 / 2.1 % at 0 dB; 25 / 13 % in active touch of 100 sin 2 pi t mm/s and 20 / 8.6 % of
    197 sin 2 pi 1.07 t, the touch that the paper chose its window for.

    Parameters are those of `ShortTimeSpectrum`; hop_s None is one sample.
    """

    VARIANTS = {
        "as_printed": Method(window_s=0.032, hop_s=0.0, taper=np.hamming, padding=1, corrected=False),
        "corrected": Method(window_s=0.08, hop_s=0.0, taper=np.hamming, padding=4, corrected=True),
    }
