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
from papilla.estimators.tracking.between_gauges import UNKNOWN, wavelength_between
from papilla.estimators.tracking.space_ekf import SpaceTracker

_OK = int(TrackingStatus.OK)
OUTLIER_SD = 4.0
"""A gauge whose wavelength is this many standard deviations from the median is left out."""
_RANK = {status: rank for rank, status in enumerate((0, 2, 7, 6, 3, 5, 4, 1))}


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
    gauge_positions_mm : (g,) along the sliding direction, different from each other; or g, where they are not known:
        then there is no wavelength by phase.
    options : those of `SpaceTracker`.

    Raises `InputError` for fewer than two gauges, positions that are equal, or unusable options.
    """

    def __init__(self, gauge_positions_mm, **options):
        self._places, gauges = None, gauge_positions_mm
        if not isinstance(gauge_positions_mm, int):
            self._places = [checks.finite("gauge position (mm)", place) for place in gauge_positions_mm]
            gauges = len(set(self._places))
        if gauges < 2 or (self._places is not None and gauges < len(self._places)):
            raise InputError(f"gauge_positions_mm must be two or more different places, got {gauge_positions_mm}")
        self._trackers = [SpaceTracker(**options) for _ in range(gauges)]

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
        if rows.ndim != 2 or rows.shape[1] != len(self._trackers) + 1:
            shape = " x ".join(map(str, rows.shape))
            raise InputError(f"a block must be n x {len(self._trackers) + 1} (gauges, then velocity_mm_s), got {shape}")
        answers = self._fused(rows)
        columns = list(zip(*answers, strict=True)) if answers else [()] * 7
        kinds = (float, float, float, int, float, float, int)
        return FusedEstimate(*(np.array(column, kind) for column, kind in zip(columns, kinds, strict=True)))

    def update(self, sample) -> FusedEstimate:
        """The estimate after one more sample (g1, ..., gg, velocity_mm_s); raises `InputError` for another length."""
        *readings, velocity = map(float, sample)
        if len(readings) != len(self._trackers):
            raise InputError(
                f"a sample must be {len(self._trackers)} readings and a velocity, got {len(sample)} values"
            )
        answers = [t.update((reading, velocity)) for t, reading in zip(self._trackers, readings, strict=True)]
        phases = [(tracker.phase_rad, tracker.phase_sigma_rad) for tracker in self._trackers]
        return self._fuse(velocity, answers, phases)

    def _fused(self, rows) -> list[FusedEstimate]:
        """Each gauge's tracker takes the rows as a block, then their answers are put together row by row."""
        velocity, gauges = rows[:, -1], []
        for number, tracker in enumerate(self._trackers):
            estimate, phase, sigma = tracker.process_with_phase(np.column_stack([rows[:, number], velocity]))
            answers = map(
                WavelengthEstimate._make, zip(*(np.asarray(column).tolist() for column in estimate), strict=True)
            )
            gauges.append(zip(answers, zip(phase.tolist(), sigma.tolist(), strict=True), strict=True))
        return [
            self._fuse(speed, *zip(*parts, strict=True))
            for speed, *parts in zip(velocity.tolist(), *gauges, strict=True)
        ]

    def _fuse(self, velocity: float, answers, phases) -> FusedEstimate:
        """One answer from the estimate and the (phase, sigma) of each gauge."""
        status = min((int(answer.status) for answer in answers), key=_RANK.__getitem__)
        good = [number for number, answer in enumerate(answers) if answer.status == status and answer.wavelength_mm > 0]
        kept = _agreeing(answers, good)
        if not kept:
            return FusedEstimate(math.nan, math.nan, math.nan, status, math.nan, math.nan, 0)
        weights = [answers[number].wavelength_sigma_mm ** -2 for number in kept]
        total = math.fsum(weights)
        pairs = zip(weights, kept, strict=True)
        wavelength = math.fsum(weight * answers[number].wavelength_mm for weight, number in pairs) / total
        frequency = math.nan if status == TrackingStatus.NO_VELOCITY else abs(velocity) / wavelength
        by_phase = self._by_phase(kept, wavelength, phases) if status == _OK else UNKNOWN
        return FusedEstimate(wavelength, total**-0.5, frequency, status, *by_phase, len(kept))

    def _by_phase(self, kept: list[int], wavelength: float, phases) -> tuple[float, float]:
        """Wavelength and sigma from the phases between the gauges that agree, where their places are known."""
        if self._places is None or len(kept) < 2:
            return UNKNOWN
        phase, sigma = zip(*(phases[number] for number in kept), strict=True)
        return wavelength_between([self._places[number] for number in kept], phase, sigma, wavelength)


def _agreeing(answers: list[WavelengthEstimate], good: list[int]) -> list[int]:
    """Gauges within `OUTLIER_SD` of the median wavelength, of those that have an answer."""
    if len(good) < 3:
        return good
    middle = sorted(answers[number].wavelength_mm for number in good)[len(good) // 2]
    sigma = sorted(answers[number].wavelength_sigma_mm for number in good)[len(good) // 2]
    limit = OUTLIER_SD * 2 * sigma + 0.002 * middle
    return [number for number in good if abs(answers[number].wavelength_mm - middle) <= limit]
