"""The wavelength from the phases between gauges: a distance d apart they differ by 2 pi d / lambda, at any speed.

Phases are known up to whole turns. A velocity that is wrong by a few per cent may be wrong by whole turns over many
wavelengths, so the tracker's wavelength alone does not tell them: it only says where to look. Gauges at uneven
distances fit one number of turns far better than its neighbours, as the scales of a vernier do; where they do not,
nothing is said.
"""

import math
from typing import NamedTuple

SPEED_SD, SPEED_REACH = 0.03, 0.1
"""Relative error of a velocity: its standard deviation, and the largest that is reckoned with."""
CLEAR = 25.0
"""By how much the squared misfit of any other turns must be greater."""
UNKNOWN = math.nan, math.nan
TURN = 2 * math.pi


class _Lag(NamedTuple):
    """A gauge against the first one: distance in mm, phase in rad up to whole turns, sigma of its own phase, and weight
    of the phase between the two."""

    distance: float
    phase: float
    sigma: float
    weight: float


class _Count(NamedTuple):
    """A number of whole turns for each lag: the wavenumber (rad/mm) that fits best then, the squared misfit of the
    phases, and the squared error of the velocity over its standard deviation."""

    wavenumber: float
    misfit: float
    speed: float


def wavelength_between(places, phases, sigmas, wavelength: float) -> tuple[float, float]:
    """(wavelength, sigma) in mm from the phases of two gauges or more; NaN where the whole turns are not clear.

    Parameters
    ----------
    places : (g,) along the sliding direction, mm. phases, sigmas : (g,) of the fundamental under each gauge, rad.
    wavelength : mm, as the velocity has it.
    """
    (origin, *others), (base, *rest), (base_sigma, *spreads) = places, phases, sigmas
    lags = [
        _Lag(place - origin, phase - base, sigma, 1 / (sigma * sigma + base_sigma * base_sigma))
        for place, phase, sigma in zip(others, rest, spreads, strict=True)
    ]
    stiffness = sum([lag.weight * lag.distance * lag.distance for lag in lags])
    counts = _counts(lags, base_sigma, wavelength, stiffness)
    best = min(counts, key=lambda count: count.misfit + count.speed)
    # Birge's ratio (1932, doi:10.1103/PhysRev.40.207): phases may be worse than they say, and tell turns less then.
    ratio = max(1.0, best.misfit / (len(lags) - 1)) if len(lags) > 1 else 1.0
    least = best.misfit / ratio + best.speed + CLEAR
    if best.wavenumber <= 0 or any(count.misfit / ratio + count.speed < least for count in counts if count != best):
        return UNKNOWN
    # The first gauge's phase error is in every lag: it moves the slope by the sum of the weights, and does not average.
    own = sum([(lag.weight * lag.distance * lag.sigma) ** 2 for lag in lags])
    shared = base_sigma * sum([lag.weight * lag.distance for lag in lags])
    found = TURN / best.wavenumber
    return found, found * found / TURN * math.sqrt((own + shared * shared) * ratio) / stiffness


def _counts(lags: list[_Lag], base_sigma: float, wavelength: float, stiffness: float) -> list[_Count]:
    """All whole turns that a velocity within `SPEED_REACH` allows; a step is half a turn at the largest distance."""
    span = max([abs(lag.distance) for lag in lags]) / wavelength
    steps = int(2 * SPEED_REACH * span)
    counts, before = [], None
    for step in range(-steps, steps + 1):
        cycles = (1 + step / (2 * span)) / wavelength
        whole = [round(cycles * lag.distance - lag.phase / TURN) for lag in lags]
        if whole == before:
            continue
        before = whole
        turned = [lag.phase + TURN * turns for lag, turns in zip(lags, whole, strict=True)]
        wavenumber = (
            sum([lag.weight * lag.distance * phase for lag, phase in zip(lags, turned, strict=True)]) / stiffness
        )
        speed = (wavenumber * wavelength / TURN - 1) / SPEED_SD
        counts.append(_Count(wavenumber, _misfit(wavenumber, base_sigma, lags, turned), speed * speed))
    return counts


def _misfit(wavenumber: float, base_sigma: float, lags: list[_Lag], turned: list[float]) -> float:
    """Squared misfit of the phases to a line of this slope, the first gauge's 0 among them, free to shift together."""
    certain, mean, square = base_sigma**-2, 0.0, 0.0
    for lag, phase in zip(lags, turned, strict=True):
        off, sure = phase - wavenumber * lag.distance, lag.sigma**-2
        certain += sure
        mean += sure * off
        square += sure * off * off
    return square - mean * mean / certain
