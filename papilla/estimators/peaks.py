"""Peaks of a spectrum: where their tops are, which may be harmonics of which, and what they say of it together."""

import math
from collections.abc import Sequence

import numpy as np

from papilla.estimators.spectrum import Line

MOST_HARMONICS = 12
SLACK_SIGMAS, SLACK_RESOLUTIONS = 3.0, 0.25
"""How far from a multiple a peak may be: so many sigmas of the difference plus a part of the resolution."""


def vertex(powers: Sequence[float] | np.ndarray) -> float:
    """Where a line's top is, in steps from the middle of three powers: of the parabola through their logarithms."""
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
    """The fundamental with the wavenumber that it and its weaker harmonics give together, by inverse variance.

    The n-th harmonic knows the wavenumber n times better for the same power. Where they disagree by more than their
    sigmas the sigma grows by as much (Birge's ratio): a period that drifts along the path does that.
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
