"""Several gauges over one surface: one wavelength from all of them, and a speed-free one from the phases between them.

Each gauge has a tracker of its own. Their wavelengths are averaged by information, without those that contradict the
others. Between gauges a distance d apart along the sliding direction the phase differs by 2 pi d / lambda whatever the
velocity says, so the two together show a velocity that is wrong by a factor.
"""

import math
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.errors import InputError
from papilla.estimators.tracking.answer import TrackerState, TrackingStatus, WavelengthEstimate
from papilla.estimators.tracking.space_ekf import SpaceTracker

_OK = int(TrackingStatus.OK)
OUTLIER_SD = 4.0
"""A gauge whose wavelength is this many standard deviations from the median is left out."""
_RANK = {status: rank for rank, status in enumerate((0, 2, 6, 3, 5, 4, 1))}


class FusedEstimate(NamedTuple):
    """A `WavelengthEstimate`'s columns, then wavelength_by_phase_mm and its sigma (NaN where unknown), and used: how
    many gauges the wavelength is from. Of a block, arrays (n,)."""

    wavelength_mm: float | np.ndarray
    wavelength_sigma_mm: float | np.ndarray
    frequency_Hz: float | np.ndarray
    status: int | np.ndarray
    wavelength_by_phase_mm: float | np.ndarray
    wavelength_by_phase_sigma_mm: float | np.ndarray
    used: int | np.ndarray


class FusedTracker:
    """Streaming wavelength of g gauges; one sample is (g1, ..., gg, velocity_mm_s).

    Parameters
    ----------
    gauge_positions_mm : (g,) along the sliding direction, different from each other.
    options : those of `SpaceTracker`.

    Raises `InputError` for fewer than two gauges, positions that are equal, or unusable options.
    """

    def __init__(self, gauge_positions_mm, **options):
        self._places = [checks.finite("gauge position (mm)", place) for place in gauge_positions_mm]
        if len(self._places) < 2 or len(set(self._places)) < len(self._places):
            raise InputError(f"gauge_positions_mm must be two or more different places, got {self._places}")
        self._trackers = [SpaceTracker(**options) for _ in self._places]

    @property
    def state(self) -> tuple[TrackerState, ...]:
        """What the tracker of each gauge remembers, to be kept or to be set again."""
        return tuple(tracker.state for tracker in self._trackers)

    @state.setter
    def state(self, state: tuple[TrackerState, ...]) -> None:
        if len(state) != len(self._trackers):
            raise InputError(f"the state is of {len(state)} gauges, this tracker has {len(self._trackers)}")
        for tracker, part in zip(self._trackers, state, strict=True):
            tracker.state = part

    def reset(self) -> None:
        """Forget everything."""
        for tracker in self._trackers:
            tracker.reset()

    def process(self, block) -> FusedEstimate:
        """Estimates after each row of a block (n, g + 1); bit for bit what `update` gives row by row.

        Raises `InputError` for a block of another shape.
        """
        rows = np.asarray(block, float)
        if rows.ndim != 2 or rows.shape[1] != len(self._places) + 1:
            shape = " x ".join(map(str, rows.shape))
            raise InputError(f"a block must be n x {len(self._places) + 1} (gauges, then velocity_mm_s), got {shape}")
        answers = [self.update(row) for row in rows.tolist()]
        columns = list(zip(*answers, strict=True)) if answers else [()] * 7
        kinds = (float, float, float, int, float, float, int)
        return FusedEstimate(*(np.array(column, kind) for column, kind in zip(columns, kinds, strict=True)))

    def update(self, sample) -> FusedEstimate:
        """The estimate after one more sample (g1, ..., gg, velocity_mm_s); raises `InputError` for another length."""
        *readings, velocity = sample
        if len(readings) != len(self._places):
            raise InputError(f"a sample must be {len(self._places)} readings and a velocity, got {len(sample)} values")
        answers = [t.update((reading, velocity)) for t, reading in zip(self._trackers, readings, strict=True)]
        status = min((int(answer.status) for answer in answers), key=lambda code: _RANK[code])
        good = [number for number, answer in enumerate(answers) if answer.status == status and answer.wavelength_mm > 0]
        kept = _agreeing(answers, good)
        if not kept:
            return FusedEstimate(math.nan, math.nan, math.nan, status, math.nan, math.nan, 0)
        weights = [answers[number].wavelength_sigma_mm ** -2 for number in kept]
        total = math.fsum(weights)
        pairs = zip(weights, kept, strict=True)
        wavelength = math.fsum(weight * answers[number].wavelength_mm for weight, number in pairs) / total
        known = status != TrackingStatus.NO_VELOCITY
        frequency = abs(velocity) / wavelength if known else math.nan
        by_phase = self._by_phase(kept, wavelength) if status == _OK else (math.nan, math.nan)
        return FusedEstimate(wavelength, total**-0.5, frequency, status, *by_phase, len(kept))

    def _by_phase(self, kept: list[int], wavelength: float) -> tuple[float, float]:
        """Wavelength and sigma from the phases of neighbours; the whole turns are those of the nearest wavelength."""
        order = sorted(kept, key=self._places.__getitem__)
        if len(order) < 2:
            return math.nan, math.nan
        origin = order[0]
        base, base_sigma = self._trackers[origin].phase_rad, self._trackers[origin].phase_sigma_rad
        top = bottom = 0.0
        for number in order[1:]:
            distance = self._places[number] - self._places[origin]
            expected = 2 * math.pi * distance / wavelength
            lag = self._trackers[number].phase_rad - base
            turns = lag + 2 * math.pi * round((expected - lag) / (2 * math.pi))
            weight = 1 / (self._trackers[number].phase_sigma_rad ** 2 + base_sigma**2)
            top += weight * distance * turns
            bottom += weight * distance * distance
        wavenumber = top / bottom
        if wavenumber <= 0:
            return math.nan, math.nan
        return 2 * math.pi / wavenumber, 2 * math.pi / wavenumber**2 / math.sqrt(bottom)


def _agreeing(answers: list[WavelengthEstimate], good: list[int]) -> list[int]:
    """Gauges within `OUTLIER_SD` of the median wavelength, of those that have an answer."""
    if len(good) < 3:
        return good
    middle = sorted(answers[number].wavelength_mm for number in good)[len(good) // 2]
    sigma = sorted(answers[number].wavelength_sigma_mm for number in good)[len(good) // 2]
    limit = OUTLIER_SD * 2 * sigma + 0.002 * middle
    return [number for number in good if abs(answers[number].wavelength_mm - middle) <= limit]
