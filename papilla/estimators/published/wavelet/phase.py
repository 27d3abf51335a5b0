"""Spatial period from the phase between two sensing elements, without a velocity (2011 Oddo, equation (4))."""

import numpy as np

from papilla import checks


def periods_of_phase(phase, distance_mm: float, period_range_mm: tuple[float, float]) -> np.ndarray:
    """All spatial periods in mm, longest first, that agree with a phase (rad) between elements at a distance.

    Phase = 2 pi distance / period (4), known only up to whole turns: period = distance / (phase / 2 pi + n). It is one
    answer only for periods over twice the distance (or over the distance, when the direction of sliding is known and
    the phase is given between 0 and 2 pi); below that every period of the range that fits is listed. Raises
    `InputError` for a range that does not rise or a distance that is not positive.
    """
    distance = checks.positive("distance_mm", distance_mm)
    low, high = checks.rising("period_range_mm", period_range_mm)
    turns = checks.finite("phase", phase) / (2 * np.pi)
    first, last = np.ceil(distance / high - turns - 1e-12), np.floor(distance / low - turns + 1e-12)
    whole = turns + np.arange(first, last + 1)
    return distance / whole[whole > 0]


def lag_of_phase(phase, period_mm: float) -> float:
    """Distance in mm along the movement that corresponds to a phase in radians on a surface of this period (4)."""
    return checks.finite("phase", phase) / (2 * np.pi) * checks.positive("period_mm", period_mm)
