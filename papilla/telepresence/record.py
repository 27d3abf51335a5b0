"""The record of a simulated loop, and its measures: lag, felt wavelength, delay of a new texture."""

import itertools
import math
from typing import NamedTuple

import numpy as np

from papilla.telepresence.answer import DisplayStatus
from papilla.telepresence.measures import Felt, felt_wavelength, lag_s
from papilla.telepresence.messages import Parameters
from papilla.telepresence.motion import RATE_HZ
from papilla.units import MS_PER_S, S_PER_MS

SETTLE_S = 1.0
"""Time at the beginning that no measure uses."""
TRIPS, EXTRA_S, MOST_OF_RECORD = 1.5, 0.3, 0.4
"""The largest lag that is searched: 1.5 median round trips, because delays vary, and 0.3 s for the display itself; at
most 0.4 of the record, so that windows are left in which to search."""


class Record(NamedTuple):
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
        return slice(int(np.searchsorted(self.time_s, SETTLE_S)), None)

    @property
    def late_ms(self) -> float:
        """The median round trip after the beginning."""
        late = self.round_trip_ms[self.judged]
        return float(np.median(late[np.isfinite(late)])) if np.isfinite(late).any() else math.nan

    def lag_ms(self, which: str) -> float:
        """Lag of a display ("local" or "direct") behind the hand."""
        rows, shown = self.judged, self._displacement(which)
        steps = np.diff(self.hand_mm, prepend=self.hand_mm[0])
        turns = np.cumsum(np.nan_to_num(steps / self.truth_mm))
        late_ms = self.late_ms if math.isfinite(self.late_ms) else 0.0
        longest = min(TRIPS * S_PER_MS * late_ms + EXTRA_S, MOST_OF_RECORD * self.time_s[-1])
        return MS_PER_S * lag_s(shown[rows], turns[rows], self.hand_mm[rows], RATE_HZ, longest)

    def _displacement(self, which: str) -> np.ndarray:
        return self.local_um if which == "local" else self.direct_um

    def felt(self, which: str) -> Felt:
        """`Felt` of a display: its wavelength over the hand's own path."""
        rows, shown = self.judged, self._displacement(which)
        return felt_wavelength(shown[rows], self.hand_mm[rows], self.truth_mm[rows], RATE_HZ)

    def crossings(self, which: str, within: float = 0.1) -> np.ndarray:
        """(m, 2) for each time that the hand comes onto another texture: time (ms) for which the display still has the
        old wavelength within 10 %, and time until it has the new one; NaN if it does not have it before the next
        crossing."""
        shown = self.wavelength_mm if which == "local" else self.direct_mm
        places = np.flatnonzero(np.abs(np.diff(self.truth_mm)) > 0) + 1
        found = []
        for begin, end in itertools.pairwise([*places.tolist(), len(shown)]):
            old, new = (np.abs(shown[begin:end] / self.truth_mm[row] - 1) < within for row in (begin - 1, begin))
            found.append([np.argmin(old) if not old.all() else math.nan, np.argmax(new) if new.any() else math.nan])
        return np.array(found).reshape(-1, 2) * MS_PER_S / RATE_HZ

    def stale_ms(self, which: str) -> float:
        """Median time for which a display still has the old texture after a crossing; NaN without crossings."""
        return _median(self.crossings(which)[:, 0])

    def change_ms(self, which: str) -> float:
        """Median time until a display has the new texture; NaN if it never has it, or without crossings."""
        return _median(self.crossings(which)[:, 1])

    def statuses(self, which: str) -> dict[str, float]:
        """Share of the rows of each status, by its sentence."""
        codes, counts = np.unique(self.local_status if which == "local" else self.direct_status, return_counts=True)
        return {
            DisplayStatus(int(code)).sentence: float(count) / self.time_s.size
            for code, count in zip(codes, counts, strict=True)
        }


def _median(times) -> float:
    """The median of times. NaN is an event that never came and counts as the latest; the median may be such a NaN."""
    found = np.sort(np.where(np.isnan(times), math.inf, times))
    middle = float(found[len(found) // 2]) if len(found) else math.inf
    return middle if math.isfinite(middle) else math.nan
