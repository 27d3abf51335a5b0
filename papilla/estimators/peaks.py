"""Peaks of a spectrum: the place of their tops, which may be harmonics of which, and their common wavenumber."""

import math
from collections.abc import Sequence

import numpy as np

from papilla.estimators.spectrum import Line

MOST_HARMONICS = 12
SLACK_SIGMAS, SLACK_RESOLUTIONS = 3.0, 0.25
"""How far a peak may be from a multiple: so many sigmas of the difference plus a share of the resolution."""


def vertex(powers: Sequence[float] | np.ndarray) -> float:
    """Place of a line's top, in steps from the middle of three powers: that of the parabola through their
    logarithms."""
    if not min(powers) > 0:
        return 0.0
    left, middle, right = map(math.log, powers)
    curvature = left - 2 * middle + right
    return 0.5 * (left - right) / curvature if curvature < 0 else 0.0


def order_of(peak: Line, fundamental: Line, resolution: float) -> int:
    """Which harmonic of the fundamental a peak may be, 1 for none."""
    order = round(peak.wavenumber / fundamental.wavenumber)
    if not 2 <= order <= MOST_HARMONICS:
        return 1
    slack = SLACK_SIGMAS * np.hypot(peak.sigma, order * fundamental.sigma) + SLACK_RESOLUTIONS * resolution
    off = abs(peak.wavenumber - order * fundamental.wavenumber)
    return order if off <= min(slack, 0.25 * fundamental.wavenumber) else 1


def with_harmonics(fundamental: Line, peaks: list[Line], resolution: float) -> Line:
    """The fundamental with the common wavenumber of itself and its weaker harmonics, weighted by inverse variance.

    The n-th harmonic determines the wavenumber n times better at the same power. If they disagree by more than their
    sigmas, sigma grows in proportion (Birge's ratio); a period that drifts along the path does that.
    """
    values, sigmas = [fundamental.wavenumber], [fundamental.sigma]
    for peak in sorted(peaks):
        order = order_of(peak, fundamental, resolution)
        if order > 1 and peak.amplitude < fundamental.amplitude:
            values.append(peak.wavenumber / order)
            sigmas.append(peak.sigma / order)
    if len(values) == 1:
        return fundamental
    weights = 1 / np.square(sigmas)
    mean = float(np.average(values, weights=weights))
    spread = float(weights @ np.square(np.array(values) - mean)) / (len(values) - 1)
    return fundamental._replace(wavenumber=mean, sigma=float(np.sqrt(max(spread, 1.0) / weights.sum())))
