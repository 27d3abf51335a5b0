"""The wavelength from the phases between gauges: a distance d apart they differ by 2 pi d / lambda, at any speed.

Phases are known up to whole turns. A velocity that is wrong by a few per cent may be wrong by whole turns over many
wavelengths, so the tracker's wavelength alone does not tell them: it only says where to look. Gauges at uneven
distances fit one number of turns far better than its neighbours, as the scales of a vernier do; where they do not,
nothing is said.
"""

import math

import numpy as np

SPEED_SD, SPEED_REACH = 0.03, 0.1
"""Relative error of a velocity: its standard deviation, and the largest that is reckoned with."""
CLEAR = 25.0
"""By how much the squared misfit of any other turns must be greater."""
UNKNOWN = math.nan, math.nan


def wavelength_between(places, phases, sigmas, wavelength: float) -> tuple[float, float]:
    """(wavelength, sigma) in mm from the phases of two gauges or more; NaN where the whole turns are not clear.

    Parameters
    ----------
    places : (g,) along the sliding direction, mm. phases, sigmas : (g,) of the fundamental under each gauge, rad.
    wavelength : mm, as the velocity has it.
    """
    places, phases, sigmas = (np.asarray(values, float) for values in (places, phases, sigmas))
    distance, lag = places[1:] - places[0], phases[1:] - phases[0]
    weight = 1 / (sigmas[1:] ** 2 + sigmas[0] ** 2)
    span = float(np.abs(distance).max()) / wavelength
    steps = int(2 * SPEED_REACH * span)
    factors = 1 + np.arange(-steps, steps + 1)[:, None] / (2 * span)
    turns = lag + 2 * math.pi * np.rint(factors * distance / wavelength - lag / (2 * math.pi))
    pull = weight * distance
    stiffness = float(pull @ distance)
    wavenumber = turns @ pull / stiffness
    misfit = _misfit(turns - wavenumber[:, None] * distance, sigmas)
    speed = ((wavenumber * wavelength / (2 * math.pi) - 1) / SPEED_SD) ** 2
    best = int(np.argmin(misfit + speed))
    # Birge's ratio (1932, doi:10.1103/PhysRev.40.207): phases may be worse than they say, and tell turns less then.
    ratio = max(1.0, float(misfit[best]) / (len(distance) - 1)) if len(distance) > 1 else 1.0
    score = misfit / ratio + speed
    rivals = score[np.abs(turns - turns[best]).max(axis=1) > 1]
    if not wavenumber[best] > 0 or (rivals.size and rivals.min() - score[best] < CLEAR):
        return UNKNOWN
    # The first gauge's phase error is in every lag: it moves the slope by the sum of the weights, and does not average.
    own = float(((pull * sigmas[1:]) ** 2).sum()) + (float(pull.sum()) * sigmas[0]) ** 2
    found = 2 * math.pi / float(wavenumber[best])
    return found, found * found / (2 * math.pi) * math.sqrt(own * ratio) / stiffness


def _misfit(off: np.ndarray, sigmas: np.ndarray) -> np.ndarray:
    """(c,) squared misfit of phases that are off a line by (c, g - 1), the first gauge by 0, free to shift together."""
    certain = sigmas**-2.0
    mean = off @ certain[1:] / certain.sum()
    return (off**2) @ certain[1:] - mean**2 * certain.sum()
