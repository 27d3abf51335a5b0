"""The frequency of the highest peak of a short-time spectrum (2006 paper, section III C), and its correction."""

import math
from dataclasses import dataclass

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.published.corpuscle import fault_of
from papilla.estimators.published.stream import (
    ALIASED,
    DEFAULT_RANGE_MM,
    GAP,
    NO_VELOCITY,
    OK,
    SILENT,
    STANDSTILL,
    WARMING_UP,
    Answers,
    RoughnessStream,
    StreamState,
    checked_ring,
)

MOST_MISSING = 0.1
"""Fraction of a window: with more missing samples than this it has no spectrum."""
PADDING = 4
"""The corrected spectrum is padded with zeros to so many windows, which a parabola then interpolates within 1e-3."""
BY_MATRIX = 128
"""Windows of so many samples or fewer are transformed by a matrix product, longer ones by FFT."""
_NONE = math.nan
_Line = tuple[float, float, float, int]


@dataclass(frozen=True, kw_only=True)
class SpectrumState(StreamState):
    """readings, speeds, missing : the last window, oldest first; a missing reading holds the last one.

    seen : samples so far, up to one window; still : samples since the reading moved, up to one window; until : samples
    to the next spectrum; line : frequency, mean speed, power and status of the last one.
    """

    readings: tuple[float, ...]
    speeds: tuple[float, ...]
    missing: tuple[int, ...]
    seen: int = 0
    still: int = 0
    until: int = 0
    line: _Line = (_NONE, _NONE, _NONE, WARMING_UP)


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

    Parameters
    ----------
    variant : "as_printed" or "corrected".
    window_s, hop_s : length of a window and time between two; hop_s <= window_s.
    sample_rate_Hz, saturation : of the readings; |reading| >= saturation is not used.
    wavelength_range_mm : see above; its low end says from which speed on the sampling rate is too low to answer.

    Raises `InputError` for unusable values.
    """

    def __init__(
        self,
        *,
        variant: str = "as_printed",
        window_s: float = 0.2,
        hop_s: float = 0.01,
        sample_rate_Hz: float = 1000.0,
        wavelength_range_mm: tuple[float, float] = DEFAULT_RANGE_MM,
        saturation: float = math.inf,
    ):
        super().__init__(
            variant=variant,
            window_s=window_s,
            sample_rate_Hz=sample_rate_Hz,
            wavelength_range_mm=wavelength_range_mm,
            saturation=saturation,
        )
        self._hop = round(checks.positive("hop_s", hop_s) * self.sample_rate_Hz)
        if not 1 <= self._hop <= self.window_samples:
            raise InputError(f"hop_s must be between one sample and window_s, got {hop_s:g} s")
        self._corrected = variant == "corrected"
        self._prepare(np.hanning(self.window_samples + 2)[1:-1] if self._corrected else np.ones(self.window_samples))
        self.reset()

    def _prepare(self, taper: np.ndarray) -> None:
        """Constants of the spectrum under this taper."""
        count = self.window_samples
        energy = float(taper @ taper)
        self._taper = taper
        self._length = PADDING * count if self._corrected else count
        self._to_density = 2 / (self.sample_rate_Hz * energy)
        self._weights = taper**2 / energy
        ramp = np.arange(count) - 0.5 * (count - 1)
        self._ramp = ramp / math.sqrt(float(ramp @ ramp))
        self._line_Hz = self.sample_rate_Hz / self._length
        self._lines = self._length // 2 + 1
        self._matrix = None
        if count <= BY_MATRIX:
            # Taper, trend and transform are linear: one product does the three, and only for the lines asked for.
            matrix = np.fft.rfft(self._tapered(np.eye(count)), self._length).T
            self._matrix = np.ascontiguousarray(np.stack([matrix.real, matrix.imag], axis=1))

    def _tapered(self, samples: np.ndarray) -> np.ndarray:
        """Samples (..., n) under the taper, without mean and trend in the corrected variant."""
        if self._corrected:
            samples = samples - samples.mean(axis=-1, keepdims=True)
            samples -= (samples @ self._ramp)[..., None] * self._ramp
        return samples * self._taper

    def reset(self) -> None:
        """Forget everything."""
        nothing = (0.0,) * self.window_samples
        self.state = SpectrumState(readings=nothing, speeds=nothing, missing=(0,) * self.window_samples)

    @property
    def state(self) -> SpectrumState:
        """All that the estimator remembers, to be kept or to be set again."""
        place, count = self._place, self.window_samples
        return SpectrumState(
            last_time_s=self._time,
            readings=tuple(self._readings[place : place + count].tolist()),
            speeds=tuple(self._speeds[place : place + count].tolist()),
            missing=tuple(self._missing[place:] + self._missing[:place]),
            seen=self._seen,
            still=self._still,
            until=self._until,
            line=self._line,
        )

    @state.setter
    def state(self, state: SpectrumState) -> None:
        # Each sample is written twice, a window apart: any window is then one contiguous piece.
        self._readings = np.array(2 * checked_ring("readings", state.readings, self.window_samples))
        self._speeds = np.array(2 * checked_ring("speeds", state.speeds, self.window_samples))
        self._missing = checked_ring("missing", state.missing, self.window_samples)
        self._gaps, self._place, self._last = sum(self._missing), 0, float(self._readings[-1])
        self._time, self._seen, self._still, self._until = state.last_time_s, state.seen, state.still, state.until
        self._line = state.line

    def _advance(self, readings, velocities) -> Answers:
        count, hop, saturation, missing = self.window_samples, self._hop, self._saturation, self._missing
        ring, speeds = self._readings, self._speeds
        answers = Answers([], [], [], [])
        for reading, velocity in zip(readings, velocities, strict=True):
            fault = OK if -saturation < reading < saturation else fault_of(reading)
            if fault or reading == self._last:
                self._still = min(self._still + 1, count)
            else:
                self._still, self._last = 0, reading
            place, speed_now = self._place, abs(velocity)
            ring[place] = ring[place + count] = self._last
            speeds[place] = speeds[place + count] = speed_now
            self._gaps += (1 if fault else 0) - missing[place]
            missing[place] = 1 if fault else 0
            self._place = place + 1 if place + 1 < count else 0
            if self._seen < count:
                self._seen += 1
            if self._seen == count:
                if self._until == 0:
                    self._line = self._spectrum(speed_now)
                    self._until = hop
                self._until -= 1
            frequency, wavelength, power, status = self._answer(speed_now, fault)
            answers.frequency.append(frequency)
            answers.wavelength.append(wavelength)
            answers.power.append(power)
            answers.status.append(status)
        return answers

    def _answer(self, speed_now: float, fault: int) -> _Line:
        """Frequency, wavelength, power and status of one sample, from the last spectrum."""
        frequency, speed, power, status = self._line
        if fault:
            return _NONE, _NONE, _NONE, fault
        if status not in (OK, GAP) or not frequency > 0.0:
            return frequency, _NONE, power, status
        if not self._corrected:
            speed = speed_now
        if not speed < math.inf:
            return frequency, _NONE, power, NO_VELOCITY
        if speed == 0.0:
            return frequency, _NONE, power, STANDSTILL
        return frequency, speed / frequency, power, status

    def _spectrum(self, speed_now: float) -> _Line:
        """Frequency, mean speed, power and status of the window that ends now."""
        place, count = self._place, self.window_samples
        if self._gaps > MOST_MISSING * count:
            return _NONE, _NONE, _NONE, GAP
        if self._still >= count - 1:
            return _NONE, _NONE, _NONE, SILENT
        speed = float(self._speeds[place : place + count] @ self._weights)
        if max(speed_now, speed) > self._fastest:
            return _NONE, _NONE, _NONE, ALIASED
        low, high = self._gate(speed)
        if high - low < 3:
            return _NONE, speed, _NONE, STANDSTILL
        spectrum = self._powers(self._readings[place : place + count], low, high)
        best = int(spectrum.argmax())
        if low + best == self._lines - 1:
            return _NONE, _NONE, _NONE, ALIASED
        offset = 0.0
        if self._corrected:
            if not 0 < best < high - low - 1:
                # The highest line is the edge of the gate: the flank of something outside the wavelength range.
                return _NONE, speed, _NONE, SILENT
            offset = self._between(*spectrum[best - 1 : best + 2].tolist())
        power = float(spectrum[best]) * self._to_density
        return (low + best + offset) * self._line_Hz, speed, power, GAP if self._gaps else OK

    def _powers(self, samples: np.ndarray, low: int, high: int) -> np.ndarray:
        """Squared magnitude of lines low ... high - 1."""
        if self._matrix is None:
            spectrum = np.fft.rfft(self._tapered(samples), self._length)[low:high]
            return spectrum.real**2 + spectrum.imag**2
        parts = self._matrix[low:high].reshape(-1, self.window_samples) @ samples
        parts *= parts
        return parts[0::2] + parts[1::2]

    def _gate(self, speed: float) -> tuple[int, int]:
        """First and one past the last line to look at; without a velocity, all above 0 Hz."""
        if not self._corrected or not speed < math.inf:
            return 1, self._lines
        # One line more at each end, so that a peak inside the range has both neighbours.
        low = max(1, math.floor(speed / (self._high * self._line_Hz)) - 1)
        return low, min(self._lines, math.ceil(speed / (self._low * self._line_Hz)) + 2)

    @staticmethod
    def _between(left: float, middle: float, right: float) -> float:
        """Where between its neighbours the vertex of the parabola through three logarithms is, in lines."""
        if not (left > 0.0 and right > 0.0):
            return 0.0
        left, middle, right = math.log(left), math.log(middle), math.log(right)
        curvature = left - 2 * middle + right
        return 0.5 * (left - right) / curvature if curvature < 0 else 0.0
