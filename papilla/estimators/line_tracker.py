"""The strongest spectral line of the latest stretch of the path: wavelengths of slow or coarsely sampled sliding.

A window of the path is kept and its spectrum taken over position, background and all, as `papilla.estimators.lines`
does of a whole log. It needs a stretch of many periods, but neither a fast sampling nor a weak drift.
"""

import math
from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.lines import FEWEST_STEPS, find_lines
from papilla.estimators.status_words import status_in_words
from papilla.estimators.tracking.answer import TrackingStatus

WINDOW = 20.0
"""The window, in longest wavelengths."""
CELL = 0.125
"""Samples closer together than this part of the shortest wavelength are averaged: 3 % off the line, and no memory."""
HOP = 0.5
"""Distance between two spectra, in longest wavelengths."""
_OK, _SEARCHING, _STANDSTILL, _MISSING, _NO_VELOCITY, _ALIASED, _NO_TEXTURE, _ = map(int, TrackingStatus)
_NONE = math.nan


class LineEstimate(NamedTuple):
    """wavelength_mm, wavelength_sigma_mm (NaN where there is no answer), status: the value of a `TrackingStatus`.

    Of a block, arrays (n,).
    """

    wavelength_mm: float | np.ndarray
    wavelength_sigma_mm: float | np.ndarray
    status: int | np.ndarray

    @property
    def sentence(self):
        """The status in words: a string, or a list of them."""
        return status_in_words(TrackingStatus, self.status)


@dataclass(frozen=True)
class LineState:
    """cells : (path travelled, position, readings) of each cell of the window, oldest first.

    open_cell, count : sums of position and readings of the samples in the newest one, and their number; began :
    position at which it began.

    last : position of the last sample; travelled : path so far; looked : path at the last spectrum; answer : its
    wavelength and sigma; clear : it had a line.
    """

    cells: tuple[tuple[float, ...], ...] = ()
    open_cell: tuple[float, ...] = ()
    count: int = 0
    began: float = _NONE
    last: float = _NONE
    travelled: float = 0.0
    looked: float = 0.0
    answer: tuple[float, float] = (_NONE, _NONE)
    clear: bool = False


class LineTracker:
    """Streaming wavelength of the strongest significant line; one sample is (g1, ..., gg, position_mm).

    Between two spectra, half of the longest wavelength apart, the answer is held. A spectrum takes some 10 ms, so this
    is not for a loop at 1 kHz.

    Parameters
    ----------
    channels : g, number of readings in a sample.
    wavelength_range_mm : (shortest, longest) wavelength that is looked for; the window is 20 times the longest.

    Raises `InputError` for unusable values.
    """

    def __init__(self, channels: int, *, wavelength_range_mm: tuple[float, float] = (0.4, 6.0)):
        if channels < 1:
            raise InputError(f"channels must be at least 1, got {channels}")
        low, high = (checks.positive("wavelength_range_mm", value) for value in wavelength_range_mm)
        if low >= high:
            raise InputError(f"wavelength_range_mm must rise, got {low:g} and {high:g}")
        self._channels, self._range = int(channels), (low, high)
        self._cell, self._hop, self._window = CELL * low, HOP * high, WINDOW * high
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.state = LineState()

    @property
    def state(self) -> LineState:
        """All that the tracker remembers, to be kept or to be set again."""
        return LineState(
            tuple(self._cells), tuple(self._open), self._count, self._began, self._last, self._travelled, self._looked,
            self._answer, self._clear,
        )  # fmt: skip

    @state.setter
    def state(self, state: LineState) -> None:
        sizes = {len(cell) for cell in state.cells} | ({len(state.open_cell) + 1} if state.open_cell else set())
        if sizes - {self._channels + 2}:
            raise InputError(f"the state is not of {self._channels} channels")
        self._cells, self._open = deque(state.cells), list(state.open_cell)
        self._count, self._began, self._last = state.count, state.began, state.last
        self._travelled, self._looked = state.travelled, state.looked
        self._answer, self._clear = state.answer, state.clear

    def process(self, block) -> LineEstimate:
        """Estimates after each row of a block (n, g + 1); bit for bit what `update` gives row by row.

        Raises `InputError` for a block of another shape.
        """
        rows = np.asarray(block, float)
        if rows.ndim != 2 or rows.shape[1] != self._channels + 1:
            shape = " x ".join(map(str, rows.shape))
            raise InputError(f"a block must be n x {self._channels + 1} (readings, then position_mm), got {shape}")
        answers = [self.update(row) for row in rows.tolist()]
        wavelength, sigma, status = zip(*answers, strict=True) if answers else ((), (), ())
        return LineEstimate(np.array(wavelength, float), np.array(sigma, float), np.array(status, int))

    def update(self, sample) -> LineEstimate:
        """The estimate after one more sample (g1, ..., gg, position_mm); raises `InputError` for another length."""
        *readings, position = map(float, sample)
        if len(readings) != self._channels:
            raise InputError(f"a sample must be {self._channels} readings and a position, got {len(sample)} values")
        if not math.isfinite(position):
            return LineEstimate(*self._answer, _NO_VELOCITY)
        step = 0.0 if self._last != self._last else abs(position - self._last)
        self._last = position
        if step > self._window:
            # Nothing that is kept overlaps with what comes.
            self.reset()
            self._last, step = position, 0.0
        self._travelled += step
        if step == 0.0 and self._count:
            return LineEstimate(*self._answer, _STANDSTILL)
        if not any(map(math.isfinite, readings)):
            return LineEstimate(*self._answer, _MISSING)
        self._take(readings, position)
        if FEWEST_STEPS * step >= self._range[1]:
            return LineEstimate(*self._answer, _ALIASED)
        if self._travelled - self._looked >= self._hop:
            self._look()
        if self._answer[0] != self._answer[0]:
            return LineEstimate(_NONE, _NONE, _SEARCHING)
        return LineEstimate(*self._answer, _OK if self._clear else _NO_TEXTURE)

    def _take(self, readings: list[float], position: float) -> None:
        """Add a sample to the newest cell, or begin another one."""
        if self._count and abs(position - self._began) >= self._cell:
            mean = [value / self._count for value in self._open]
            self._cells.append((self._travelled, *mean))
            self._count = 0
            while self._cells and self._travelled - self._cells[0][0] > self._window:
                self._cells.popleft()
        if self._count == 0:
            self._open, self._began = [position, *readings], position
        else:
            self._open = [total + value for total, value in zip(self._open, (position, *readings), strict=True)]
        self._count += 1

    def _look(self) -> None:
        """The spectrum of the window."""
        self._looked = self._travelled
        if not self._cells:
            return
        table = np.array(self._cells)
        try:
            lines = find_lines(table[:, 1], table[:, 2:], wavelength_range_mm=self._range).lines
        except InputError:
            # Too short a stretch, or too few whole rows: what was known before is all that is known.
            self._clear = False
            return
        self._clear = bool(lines)
        if lines:
            self._answer = (lines[0].wavelength_mm, lines[0].sigma_mm)
