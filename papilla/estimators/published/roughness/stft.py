"""The frequency of the highest peak of a short-time spectrum (2006 paper, section III C), and its correction."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.published.roughness.answer import (
    ALIASED,
    GAP,
    NONE,
    OK,
    SILENT,
    STANDSTILL,
    WARMING_UP,
    Finding,
    first_reason,
    found_nothing,
)
from papilla.estimators.published.roughness.moving_sum import checked_ring
from papilla.estimators.published.roughness.peaks import peaks
from papilla.estimators.published.roughness.stream import DEFAULT_RANGE_MM, RoughnessStream

MOST_MISSING = 0.1
"""Fraction of a window: with more missing samples than this it has no spectrum."""


class Method(NamedTuple):
    """window_s : of the paper; taper : of so many samples; levelled : mean and trend are removed.

    padding : length of the transform in windows. gated : only lines of the wavelength range; between : the peak is
    interpolated by a parabola (within 1e-3 of a line at a padding of 4); mean_speed : wavelength by the mean |v| under
    the taper, not by |v(t)|.
    """

    window_s: float
    taper: Callable[[int], np.ndarray]
    levelled: bool
    padding: int
    gated: bool
    between: bool
    mean_speed: bool


def hann(count: int) -> np.ndarray:
    """Hann taper of `count` samples, none of them zero."""
    return np.hanning(count + 2)[1:-1]


@dataclass(frozen=True)
class SpectrumMemory:
    """readings, speeds, missing : the last window, oldest first; a missing reading holds the last one.

    still : samples since the reading moved, up to one window; until : samples to the next spectrum; line : frequency,
    mean speed (in the place of a distance), power and status of the last one.
    """

    readings: tuple[float, ...]
    speeds: tuple[float, ...]
    missing: tuple[int, ...]
    still: int = 0
    until: int = 0
    line: Finding = found_nothing(WARMING_UP)


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

    Parameters are those of `RoughnessStream` (window_s None: 0.2 s), and hop_s : time between two spectra, <= window_s.
    Raises `InputError` for unusable values.
    """

    VARIANTS = {
        "as_printed": Method(
            window_s=0.2, taper=np.ones, levelled=False, padding=1, gated=False, between=False, mean_speed=False
        ),
        "corrected": Method(
            window_s=0.2, taper=hann, levelled=True, padding=4, gated=True, between=True, mean_speed=True
        ),
    }

    def __init__(
        self,
        *,
        variant: str = "as_printed",
        window_s: float | None = None,
        hop_s: float = 0.01,
        sample_rate_Hz: float = 1000.0,
        wavelength_range_mm: tuple[float, float] = DEFAULT_RANGE_MM,
        saturation: float = math.inf,
    ):
        self._hop_s = checks.positive("hop_s", hop_s)
        super().__init__(
            variant=variant,
            window_s=window_s,
            sample_rate_Hz=sample_rate_Hz,
            wavelength_range_mm=wavelength_range_mm,
            saturation=saturation,
        )

    def _prepare(self) -> None:
        super()._prepare()
        count, method = self.window_samples, self._method
        self._hop = round(self._hop_s * self.sample_rate_Hz)
        if not 1 <= self._hop <= count:
            raise InputError(f"hop_s must be between one sample and window_s, got {self._hop_s:g} s")
        # A spectrum answers with the sample that makes its window full, not with the one after.
        self._full = count - 1
        taper = method.taper(count)
        energy = float(taper @ taper)
        self._to_density = 2 / (self.sample_rate_Hz * energy)
        self._weights = taper**2 / energy
        self._peaks = peaks(taper, method.levelled, method.padding * count)
        self._line_Hz = self.sample_rate_Hz / (method.padding * count)

    def _forget(self) -> None:
        nothing = (0.0,) * self.window_samples
        self._memory = SpectrumMemory(readings=nothing, speeds=nothing, missing=(0,) * self.window_samples)

    @property
    def _memory(self) -> SpectrumMemory:
        place, count = self._place, self.window_samples
        return SpectrumMemory(
            readings=tuple(self._readings[place : place + count].tolist()),
            speeds=tuple(self._speeds[place : place + count].tolist()),
            missing=tuple(self._missing[place:] + self._missing[:place]),
            still=self._still,
            until=self._until,
            line=self._line,
        )

    @_memory.setter
    def _memory(self, memory: SpectrumMemory) -> None:
        # Each sample is written twice, a window apart: any window is then one contiguous piece.
        self._readings = np.array(2 * checked_ring("readings", memory.readings, self.window_samples))
        self._speeds = np.array(2 * checked_ring("speeds", memory.speeds, self.window_samples))
        self._missing = checked_ring("missing", memory.missing, self.window_samples)
        self._gaps, self._place, self._last = sum(self._missing), 0, float(self._readings[-1])
        self._still, self._until, self._line = memory.still, memory.until, memory.line

    def _find(self, reading: float, speed: float) -> Finding:
        count, place, gap = self.window_samples, self._place, 1 if reading != reading else 0
        self._still = min(self._still + 1, count) if gap or reading == self._last else 0
        if not gap:
            self._last = reading
        self._readings[place] = self._readings[place + count] = self._last
        self._speeds[place] = self._speeds[place + count] = speed
        self._gaps += gap - self._missing[place]
        self._missing[place] = gap
        self._place = place + 1 if place + 1 < count else 0
        if self._seen > self._full:
            if self._until == 0:
                window = slice(self._place, self._place + count)
                self._line = self._spectrum(self._readings[window], self._speeds[window], self._gaps, self._still)
                self._until = self._hop
            self._until -= 1
        frequency, mean_speed, power, status = self._line
        return Finding(frequency, (mean_speed if self._method.mean_speed else speed) / frequency, power, status)

    def _find_all(self, readings: np.ndarray, speeds: np.ndarray) -> Finding:
        count, past, number = self.window_samples, self._memory, np.arange(len(readings))
        missing = np.isnan(readings)
        known = np.maximum.accumulate(np.where(missing, -1, number))
        held = np.where(known < 0, self._last, readings[known])
        moved = np.maximum.accumulate(np.where(held != np.append(self._last, held[:-1]), number, -1))
        still = np.minimum(np.where(moved < 0, self._still + number + 1, number - moved), count)
        held, every_speed = np.append(past.readings, held), np.append(past.speeds, speeds)
        every_gap = np.append(past.missing, missing).astype(int)
        gaps = np.cumsum(every_gap)
        gaps = gaps[count:] - gaps[:-count]
        first = max(self._full - self._seen, 0) + self._until
        hops = slice(first, None, self._hop)
        # The window that ends with sample n begins at n + 1 of these, which have one window more in front.
        windows, paces = (sliding_window_view(values[1:], count)[hops] for values in (held, every_speed))
        lines = np.column_stack([np.array(self._line), self._spectra(windows, paces, gaps[hops], still[hops])])
        latest = np.where(number < first, 0, (number - first) // self._hop + 1)
        frequency, mean_speed, power, status = lines[:, latest]
        found = lines[:, -1].tolist()
        self._memory = SpectrumMemory(
            readings=tuple(held[-count:].tolist()),
            speeds=tuple(every_speed[-count:].tolist()),
            missing=tuple(every_gap[-count:].tolist()),
            still=int(still[-1]),
            until=(first - len(number)) % self._hop if len(windows) else min(first - len(number), self._until),
            line=Finding(found[0], found[1], found[2], int(found[3])),
        )
        distance = (mean_speed if self._method.mean_speed else speeds) / frequency
        return Finding(frequency, distance, power, status.astype(int))

    def _spectrum(self, readings: np.ndarray, speeds: np.ndarray, gaps: int, still: int) -> Finding:
        """The strongest line of one window (n,), with the mean speed in the place of the distance.

        gaps : samples missing in it; still : samples since the reading moved.
        """
        count = self.window_samples
        if gaps > MOST_MISSING * count:
            return found_nothing(GAP)
        if still >= count - 1:
            return found_nothing(SILENT)
        speed = float(np.vecdot(speeds, self._weights))
        if max(float(speeds[-1]), speed) > self._fastest:
            return found_nothing(ALIASED)
        low, high = self._gate(speed)
        if high - low < 3:
            return found_nothing(STANDSTILL)
        best, powers = self._peaks.highest(readings, low, high)
        if best == self._peaks.lines - 1:
            return found_nothing(ALIASED)
        if self._method.gated and not low < best < high - 1:
            # The highest line is the edge of the gate: the flank of something outside the wavelength range.
            return found_nothing(SILENT)
        offset = self._between(*powers) if self._method.between else 0.0
        return Finding((best + offset) * self._line_Hz, speed, powers[1] * self._to_density, GAP if gaps else OK)

    def _spectra(self, readings: np.ndarray, speeds: np.ndarray, gaps: np.ndarray, still: np.ndarray) -> np.ndarray:
        """What `_spectrum` finds in each of m windows (m, n), gaps and still (m,), as the columns of (4, m)."""
        count = self.window_samples
        speed = np.vecdot(speeds, self._weights)
        low, high = self._gates(speed)
        fast = (speeds[:, -1] > self._fastest) | (speed > self._fastest)
        lost, dead, narrow = gaps > MOST_MISSING * count, still >= count - 1, high - low < 3
        lines = np.full((4, len(speed)), NONE)
        reasons = [(lost, GAP), (dead, SILENT), (fast, ALIASED), (narrow, STANDSTILL), (gaps > 0, GAP)]
        lines[3] = first_reason(reasons, OK)
        looked = np.flatnonzero(~(lost | dead | fast | narrow))
        low, high = low[looked], high[looked]
        best, powers = self._peaks.highest_of_all(readings, looked, low, high)
        last = best == self._peaks.lines - 1
        edge = self._method.gated & ~((low < best) & (best < high - 1))
        lines[3, looked] = first_reason([(last, ALIASED), (edge, SILENT)], lines[3, looked])
        kept = ~(last | edge)
        found, best, powers = looked[kept], best[kept], powers[kept]
        offset = list(map(self._between, *powers.T.tolist())) if self._method.between else 0.0
        lines[:3, found] = (best + offset) * self._line_Hz, speed[found], powers[:, 1] * self._to_density
        return lines

    def _gate(self, speed: float) -> tuple[int, int]:
        """First and one past the last line to look at; without a velocity, all above 0 Hz."""
        if not self._method.gated or not speed < math.inf:
            return 1, self._peaks.lines
        # One line more at each end, so that a peak inside the range has both neighbours.
        low = max(1, math.floor(speed / (self._high * self._line_Hz)) - 1)
        return low, min(self._peaks.lines, math.ceil(speed / (self._low * self._line_Hz)) + 2)

    def _gates(self, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The gates at speeds (m,), two arrays (m,)."""
        gated = self._method.gated & (speed < math.inf)
        speed = np.where(gated, np.minimum(speed, self._fastest), 0.0)
        low = np.maximum(1, np.floor(speed / (self._high * self._line_Hz)) - 1)
        high = np.minimum(self._peaks.lines, np.ceil(speed / (self._low * self._line_Hz)) + 2)
        return low.astype(int), np.where(gated, high, self._peaks.lines).astype(int)

    @staticmethod
    def _between(left: float, middle: float, right: float) -> float:
        """Where between its neighbours the vertex of the parabola through three logarithms is, in lines."""
        if not (left > 0.0 and right > 0.0):
            return 0.0
        down, up = math.log(left / middle), math.log(right / middle)
        return 0.5 * (down - up) / (down + up) if down + up < 0 else 0.0
