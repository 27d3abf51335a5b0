"""The last samples of channels, as one contiguous array, for methods that transform them every few samples."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

MOST_MISSING = 0.1
"""Fraction of missing samples above which a window has no spectrum."""


@dataclass(eq=False)
class SampleWindow:
    """The last `count` samples of `channels`; NaN is missing, and holds the value before.

    Once it is full, `push` returns True every `hop` samples, when there is a new window to transform. extra : number of
    further channels, whose values are stored unchanged.
    """

    channels: int
    count: int
    hop: int
    extra: int = 0
    _ring: np.ndarray = field(init=False)
    _missing: list[bool] = field(init=False)
    _last: list[float] = field(init=False)
    _still: list[int] = field(init=False)
    _place: int = 0
    gaps: int = 0
    """Number of samples in the window of which a value is missing."""

    def __post_init__(self) -> None:
        # Each sample is written twice, a window apart, so that any window is one contiguous piece.
        self._ring = np.zeros((self.channels + self.extra, 2 * self.count))
        self._missing, self._until = [False] * self.count, self.count
        self._last, self._still = [0.0] * self.channels, [0] * self.channels

    def push(self, sample: Sequence[float]) -> bool:
        """Take one value of each channel; returns whether there is a new window to transform."""
        place, count, gap = self._place, self.count, False
        for channel, value in enumerate(sample):
            if channel < self.channels:
                if value != value:
                    gap, value = True, self._last[channel]
                self._still[channel] = min(self._still[channel] + 1, count) if value == self._last[channel] else 0
                self._last[channel] = value
            self._ring[channel, place] = self._ring[channel, place + count] = value
        self.gaps += gap - self._missing[place]
        self._missing[place] = gap
        self._place = (place + 1) % count
        self._until = (self._until or self.hop) - 1
        return self._until == 0

    @property
    def samples(self) -> np.ndarray:
        """(channels + extra, count) values, oldest first."""
        return self._ring[:, self._place : self._place + self.count]

    @property
    def torn(self) -> bool:
        """Whether more than `MOST_MISSING` of the samples are missing."""
        return self.gaps > MOST_MISSING * self.count

    @property
    def dead(self) -> bool:
        """Whether a channel is constant over the window."""
        return max(self._still) >= self.count - 1
