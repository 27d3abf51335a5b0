"""The wavelength from the phases between gauges: at a distance d they differ by 2 pi d / lambda, at any speed.

Phases are known up to whole turns. A velocity error of a few per cent may become whole turns over many wavelengths, so
the tracker's wavelength alone does not determine the number of turns: it only limits the search. Gauges at uneven
distances fit one number of turns far better than its neighbours, like the scales of a vernier. If no number fits
clearly better, there is no answer.
"""

import math

import numpy as np

SPEED_SD, SPEED_REACH = 0.03, 0.1
"""Relative error of a velocity: its standard deviation, and the largest error that is searched."""
CLEAR = 25.0
"""Smallest difference of squared misfit to any other number of turns."""
UNKNOWN = math.nan, math.nan
TURN = 2 * math.pi


def wavelength_between(places, phases, sigmas, wavelength: float) -> tuple[float, float]:
    """(wavelength, sigma) in mm from the phases of two gauges or more; NaN if the number of whole turns is not clear.

    Parameters
    ----------
    places : (g,) along the sliding direction, mm. phases, sigmas : (g,) of the fundamental under each gauge, rad.
    wavelength : in mm, from the velocity.
    """
    base, *others = sigmas = np.asarray(sigmas, float)
    distance, phase = (np.subtract(own[1:], own[0]) for own in (places, phases))
    # Weighted regression of the phase differences on the distances, for all numbers of turns at once.
    pull = distance / (np.square(others) + base**2)
    stiffness = float(pull @ distance)
    turned = phase + TURN * _turns(distance, phase, wavelength)
    wavenumber = turned @ pull / stiffness
    # The first gauge's phase is 0, and all of them are free to shift together.
    left = np.pad(turned - np.outer(wavenumber, distance), ((0, 0), (1, 0)))
    misfit = left**2 @ sigmas**-2 - (left @ sigmas**-2) ** 2 / (sigmas**-2).sum()
    speed = ((wavenumber * wavelength / TURN - 1) / SPEED_SD) ** 2
    best = int((misfit + speed).argmin())
    # Birge's ratio (1932, doi:10.1103/PhysRev.40.207): if phases scatter more than their sigmas, they distinguish turns
    # less.
    ratio = max(1.0, float(misfit[best]) / (len(distance) - 1)) if len(distance) > 1 else 1.0
    price = misfit / ratio + speed
    if wavenumber[best] <= 0 or (np.delete(price, best) < price[best] + CLEAR).any():
        return UNKNOWN
    # The first gauge's phase error enters every lag: it shifts the slope by the sum of the weights, and does not
    # average out.
    error = math.hypot(*(pull * others), base * float(pull.sum())) * math.sqrt(ratio) / stiffness
    found = TURN / float(wavenumber[best])
    return found, found**2 / TURN * error


def _turns(distance: np.ndarray, phase: np.ndarray, wavelength: float) -> np.ndarray:
    """(n, g - 1) all numbers of whole turns that a velocity within `SPEED_REACH` allows; a step is half a turn at the
    largest distance."""
    span = float(np.abs(distance).max()) / wavelength
    steps = int(2 * SPEED_REACH * span)
    cycles = (1 + np.arange(-steps, steps + 1) / (2 * span)) / wavelength
    return np.unique(np.round(np.outer(cycles, distance) - phase / TURN), axis=0)
