"""The record of a simulated loop, and its measures by an ideal observer: how late a displayed signal is, which
wavelength it has for the hand's motion, and when it has a new texture."""

import itertools
import math
from typing import NamedTuple

import numpy as np

from papilla.core.units import MS_PER_S, S_PER_MS, TINY_DIVISOR
from papilla.telepresence.local_model import DisplayStatus
from papilla.telepresence.messages import Parameters
from papilla.telepresence.motion import HAND_RATE_HZ

FELT_WINDOW_S, WINDOW_QUARTERS = 0.25, 4
"""Length of a window: half a stroke of a hand or less, a dozen periods of a texture. Windows of the felt wavelength
advance by a quarter, and a quarter without a signal is silence."""
EARLIEST_S = -0.05
"""Smallest lag that is searched: a display that is early by chance should not look late."""
SLOW_SPEED_SHARE = 0.3
"""Share of the largest speed below which no wavelength is estimated."""
WAVENUMBER_STEP = 0.1
"""Step of the searched wavenumbers, in units of the resolution, 1 over the longest path of a window."""
SILENT_RMS_SHARE = 0.05
"""Share of the largest rms of a window below which nothing is felt."""

NEAR_S, BROAD_S = 0.15, 0.02
"""Largest difference of a window's lag from the common one, and range of lags over which windows agree: delays vary."""
LEAST_TURNS, LEAST_COHERENCE = 2.0, 0.35
"""Smallest number of periods of the texture in a window, and smallest share of the signal that the fit explains (1 for
a sine)."""
STEADY_SPEED_SHARE = 0.2
"""Share of the largest speed by which the speed must change in a window that determines a lag."""


def lag_s(shown, turns, place_mm, rate_Hz: float, longest_s: float) -> float:
    """Delay of a displayed signal behind the hand: the shift with which it fits the texture under the hand best.

    In windows of 0.25 s, |sum shown(t) exp(-2 pi i turns(t - lag))| over lags from -0.05 s to `longest_s`. Both
    directions of a stroke fit equally well, so a single window also fits half a stroke later; the sum over windows does
    not, if strokes differ. The result is the median over windows of the best lag within 0.15 s of the best lag of that
    sum. NaN if nothing is displayed, if the signal does not contain the texture, or if the speed never changes, because
    a steady sine fits at any lag.

    Parameters
    ----------
    shown : (n,) displacement. turns : (n,) periods of the texture that the hand has passed, with sign.
    place_mm : (n,) position of the hand. rate_Hz : of all. longest_s : greater than 0.
    """
    signal = np.asarray(shown, float)
    passed, place = np.asarray(turns, float), np.asarray(place_mm, float)
    wave = np.exp(-2j * math.pi * passed)
    size, first, last = (round(seconds * rate_Hz) for seconds in (FELT_WINDOW_S, EARLIEST_S, longest_s))
    loudest, scores = _loudest(signal, size), []
    for begin in range(last, signal.size - size + first, size // 2):
        window, around = signal[begin : begin + size], slice(begin - last, begin - first + size)
        speeds = np.abs(np.diff(place[around]))
        if (
            loudest == 0
            or window.std() < SILENT_RMS_SHARE * loudest
            or np.ptp(speeds) < STEADY_SPEED_SHARE * speeds.max()
        ):
            continue
        if np.abs(np.diff(passed[begin : begin + size])).sum() < LEAST_TURNS:
            continue
        # `correlate` conjugates its second argument, which has no effect on a real signal.
        score = np.abs(np.correlate(wave[around], window - window.mean(), "valid"))[::-1]
        if score.max() * math.sqrt(2) > LEAST_COHERENCE * size * window.std():
            scores.append(score / score.max())
    if not scores:
        return math.nan
    near, lags_s = round(NEAR_S * rate_Hz), []
    broad = np.convolve(np.sum(scores, axis=0), np.ones(round(BROAD_S * rate_Hz)), "same")
    middle = int(np.argmax(broad))
    low = max(0, middle - near)
    for score in scores:
        best = low + int(np.argmax(score[low : middle + near + 1]))
        if 0 < best < score.size - 1:
            lags_s.append((first + best + _vertex(score[best - 1 : best + 2])) / rate_Hz)
    return float(np.median(lags_s)) if lags_s else math.nan


class FeltWavelengths(NamedTuple):
    """(m,) times of windows, the felt wavelength (NaN if nothing is displayed) and the true one, both in mm."""

    time_s: np.ndarray
    wavelength_mm: np.ndarray
    truth_mm: np.ndarray

    @property
    def error(self) -> float:
        """RMS of felt over true minus 1 (cut to -1 ... 3) over the windows that are not silent; NaN without any."""
        ratio = self.wavelength_mm / self.truth_mm - 1
        ratio = np.clip(ratio[np.isfinite(ratio)], -1, 3)
        return float(np.sqrt(np.mean(ratio**2))) if ratio.size else math.nan

    @property
    def silent(self) -> float:
        """Share of the windows in which nothing is displayed."""
        return float(np.mean(np.isnan(self.wavelength_mm))) if self.time_s.size else math.nan


def felt_wavelength(shown, place_mm, truth_mm, rate_Hz: float, range_mm=(0.3, 8.0)) -> FeltWavelengths:
    """The strongest line of what is displayed over the hand's own path, in windows of 0.25 s, each a quarter later.

    An ideal observer, who knows the hand's movement exactly, would obtain it from speed over frequency. Windows in
    which the hand is slower than 30 % of its peak, or the true wavelength changes, are left out; in a window with a
    quarter of silence nothing is felt.

    Parameters
    ----------
    shown, place_mm, truth_mm : (n,) displacement, position of the hand, wavelength under it. rate_Hz : of all.
    range_mm : range of wavelengths.
    """
    signal, place, truth = (np.asarray(values, float) for values in (shown, place_mm, truth_mm))
    size, speed = round(FELT_WINDOW_S * rate_Hz), np.abs(np.gradient(place)) * rate_Hz
    loudest, peak = _loudest(signal, size), speed.max()
    wavenumbers = np.arange(1 / range_mm[1], 1 / range_mm[0], WAVENUMBER_STEP / max(peak * FELT_WINDOW_S, TINY_DIVISOR))
    times, felt, true = [], [], []
    for begin in range(0, signal.size - size + 1, size // WINDOW_QUARTERS):
        rows = slice(begin, begin + size)
        if speed[rows].min() < SLOW_SPEED_SHARE * peak or np.ptp(truth[rows]) > 0:
            continue
        window = signal[rows] - signal[rows].mean()
        times.append((begin + size) / rate_Hz)
        true.append(truth[begin])
        quarters = window[: size // WINDOW_QUARTERS * WINDOW_QUARTERS].reshape(WINDOW_QUARTERS, -1).std(axis=1)
        if loudest == 0 or quarters.min() < SILENT_RMS_SHARE * loudest:
            felt.append(math.nan)
            continue
        power = np.abs(np.exp(-2j * math.pi * np.outer(wavenumbers, place[rows])) @ window)
        best = int(np.argmax(power))
        shift = _vertex(power[best - 1 : best + 2]) if 0 < best < power.size - 1 else 0.0
        felt.append(1 / (wavenumbers[best] + shift * (wavenumbers[1] - wavenumbers[0])))
    return FeltWavelengths(np.array(times), np.array(felt), np.array(true))


def _loudest(signal: np.ndarray, size: int) -> float:
    parts = signal[: signal.size // size * size].reshape(-1, size)
    return float(parts.std(axis=1).max()) if parts.size else 0.0


def _vertex(three: np.ndarray) -> float:
    """Place of the vertex of a parabola through values at -1, 0, 1."""
    before, middle, after = three
    bend = before - 2 * middle + after
    return 0.5 * (before - after) / bend if bend < 0 else 0.0


UNMEASURED_START_S = 1.0
"""Time at the beginning that no measure uses."""
LARGEST_LAG_TRIPS, EXTRA_S, MOST_OF_RECORD = 1.5, 0.3, 0.4
"""The largest lag that is searched: 1.5 median round trips, because delays vary, and 0.3 s for the display itself; at
most 0.4 of the record, so that windows are left in which to search."""


class LoopRecord(NamedTuple):
    """(n,) a row per ms: time_s, hand_mm and truth_mm (wavelength under the hand); displacement in um of each display;
    wavelength_mm of the local model; direct_mm : that of the texture at the place of the displayed sample; status of
    both. bytes_per_s : payload of messages down, `with_headers` with those of UDP and IPv4; round_trip_ms (n,) : time
    since the hand was at the place of the displayed sample, including queues; lost : share of the messages that were
    sent down; messages (n,) : the last message that had arrived."""

    time_s: np.ndarray
    hand_mm: np.ndarray
    truth_mm: np.ndarray
    local_um: np.ndarray
    direct_um: np.ndarray
    wavelength_mm: np.ndarray
    direct_mm: np.ndarray
    local_status: np.ndarray
    direct_status: np.ndarray
    bytes_per_s: dict[str, float]
    with_headers: dict[str, float]
    round_trip_ms: np.ndarray
    lost: dict[str, float]
    messages: list[Parameters | None]

    @property
    def judged(self) -> slice:
        """Rows after the beginning."""
        return slice(int(np.searchsorted(self.time_s, UNMEASURED_START_S)), None)

    @property
    def late_ms(self) -> float:
        """The median round trip after the beginning."""
        late = self.round_trip_ms[self.judged]
        return float(np.median(late[np.isfinite(late)])) if np.isfinite(late).any() else math.nan

    def lag_ms(self, which: str) -> float:
        """Lag of a display ("local" or "direct") behind the hand."""
        rows, displacement = self.judged, getattr(self, f"{which}_um")
        steps = np.diff(self.hand_mm, prepend=self.hand_mm[0])
        turns = np.cumsum(np.nan_to_num(steps / self.truth_mm))
        late_ms = self.late_ms if math.isfinite(self.late_ms) else 0.0
        longest = min(LARGEST_LAG_TRIPS * S_PER_MS * late_ms + EXTRA_S, MOST_OF_RECORD * self.time_s[-1])
        return MS_PER_S * lag_s(displacement[rows], turns[rows], self.hand_mm[rows], HAND_RATE_HZ, longest)

    def felt(self, which: str) -> FeltWavelengths:
        """`FeltWavelengths` of a display: its wavelength over the hand's own path."""
        rows, displacement = self.judged, getattr(self, f"{which}_um")
        return felt_wavelength(displacement[rows], self.hand_mm[rows], self.truth_mm[rows], HAND_RATE_HZ)

    def crossings(self, which: str, within: float = 0.1) -> np.ndarray:
        """(m, 2) for each time that the hand comes onto another texture: time (ms) for which the display still has the
        old wavelength within 10 %, and time until it has the new one; NaN if it does not have it before the next
        crossing."""
        displayed_mm = self.wavelength_mm if which == "local" else self.direct_mm
        places = np.flatnonzero(np.abs(np.diff(self.truth_mm)) > 0) + 1
        delays = []
        for begin, end in itertools.pairwise([*places.tolist(), len(displayed_mm)]):
            old, new = (
                np.abs(displayed_mm[begin:end] / self.truth_mm[sample] - 1) < within for sample in (begin - 1, begin)
            )
            delays.append([np.argmin(old) if not old.all() else math.nan, np.argmax(new) if new.any() else math.nan])
        return np.array(delays).reshape(-1, 2) * MS_PER_S / HAND_RATE_HZ

    def stale_ms(self, which: str) -> float:
        """Median time for which a display still has the old texture after a crossing; NaN without crossings."""
        return _median(self.crossings(which)[:, 0])

    def change_ms(self, which: str) -> float:
        """Median time until a display has the new texture; NaN if it never has it, or without crossings."""
        return _median(self.crossings(which)[:, 1])

    def statuses(self, which: str) -> dict[str, float]:
        """Share of the rows of each status, by its sentence."""
        codes, counts = np.unique(getattr(self, f"{which}_status"), return_counts=True)
        shares = (counts / self.time_s.size).tolist()
        return {DisplayStatus(code).sentence: share for code, share in zip(codes.tolist(), shares, strict=True)}


def _median(times) -> float:
    """The median of times. NaN is an event that never came and counts as the latest; the median may be such a NaN."""
    ordered = np.sort(np.where(np.isnan(times), math.inf, times))
    middle = float(ordered[len(ordered) // 2]) if len(ordered) else math.inf
    return middle if math.isfinite(middle) else math.nan
