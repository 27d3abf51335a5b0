"""The pressure profile of a contact ellipse: Hertz's, and one term more for layers.

p = F / (pi a b) [(1 - q) 3/2 t + q 5/2 t^3], t = sqrt(1 - u), u = (x/a)^2 + (y/b)^2. With q = 0 it is Hertz's; a hard
layer over a soft one makes it flatter (q < 0), a thin soft layer on hard ground more pointed (q > 0).
"""

import numpy as np

SECOND = (2 / 5, 2 / 7)
FOURTH = (8 / 35, 8 / 63)
SIXTH = (16 / 105, 16 / 231)
"""Moments of u, u^2 and u^3 under the two terms, per unit force."""

HALF_SPACE_ENERGY = (1.0, 15 / 14, 25 / 21)
"""Energy of the pairs of terms (Hertz with itself, with the other, the other with itself) on a half-space, in Hertz's:
integrals of (J_m(x) / x^m) (J_n(x) / x^n) over x, m, n = 3/2 and 5/2."""

FLATTEST, SHARPEST = -1.5, 1.0
"""Bounds of q, beyond which the pressure is negative in the middle or at the edge."""


def layer_factor(t, q):
    """Pressure over mean pressure at t = sqrt(1 - u), for t in [0, 1]."""
    return 1.5 * (1 - q) * t + 2.5 * q * t**3


def mean_square(q):
    """Mean of u under the profile."""
    return SECOND[0] - (SECOND[0] - SECOND[1]) * q


def peak_over_mean(q: float) -> float:
    """Largest pressure over mean pressure."""
    values = [layer_factor(1.0, q)]
    if q < 0:
        t = np.sqrt((1 - q) / (-5 * q))
        if t < 1:
            values.append(layer_factor(t, q))
    return float(max(values))
