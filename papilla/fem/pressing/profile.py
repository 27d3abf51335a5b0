"""The pressure profile of a contact ellipse, and the area and peak that a nodal pressure has by its moments.

p = F / (pi a b) [(1 - q) 3/2 t + q 5/2 t^3], t = sqrt(1 - u), u = (x/a)^2 + (y/b)^2. With q = 0 it is Hertz's; a hard
layer over a soft one makes it flatter (q < 0), a thin soft layer on hard ground more pointed (q > 0).

Counting active nodes steps by a whole row of elements, and single nodes overshoot at the edge; moments are as smooth
and accurate as the gauge rows. The second and fourth give a, b and q in closed form. The fourth is at the mercy of the
edge: where few elements lie across the contact, q is that of the Hertz fidelity, which takes it from the energy.
"""

from dataclasses import dataclass

import numpy as np

from papilla.fem.reduction.compliance import quadrature
from papilla.fem.reduction.patch import Patch

SECOND = (2 / 5, 2 / 7)
FOURTH = (8 / 35, 8 / 63)
SIXTH = (16 / 105, 16 / 231)
"""Moments of u, u^2 and u^3 under the two terms, per unit force."""

HALF_SPACE_ENERGY = (1.0, 15 / 14, 25 / 21)
"""Energy of the pairs of terms (Hertz with itself, with the other, the other with itself) on a half-space, in Hertz's:
integrals of (J_m(x) / x^m) (J_n(x) / x^n) over x, m, n = 3/2 and 5/2."""

FLATTEST, SHARPEST = -1.5, 1.0
"""Bounds of q, beyond which the pressure is negative in the middle or at the edge."""


TRUSTED = 0.05
"""Mismatch of the sixth moment above which the contact is no such ellipse (a slab's line contact, say)."""

CUT_OFF = 0.01
"""Share of the peak pressure that, at the patch's outline, means that the contact is cut off there."""

TELLING_ELEMENTS, RESOLVING_ELEMENTS = 4.0, 8.0
"""Elements across the contact radius from which the moments tell q better than Hertz's 0, and than the energy's q."""

EDGE_BAND = 0.5
"""Elements around the edge by which the active nodes of a true ellipse may differ from it (0.36 was measured at most; a
slab's line contact, whose low moments an ellipse can match, gives 0.8)."""


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


@dataclass(frozen=True)
class ContactShape:
    """Area (mm2) and peak pressure (MPa); `elliptic` tells whether the moments fit, else nodes were counted."""

    area: float
    peak_pressure: float
    elliptic: bool


def contact_shape(patch: Patch, pressure: np.ndarray, expected_q: float | None = None) -> ContactShape:
    """Area and peak of a nodal pressure (n,) in MPa on a patch with all its images.

    `expected_q` is the profile's layer term as the energy has it, for contacts too small for their moments to tell.
    """
    points, weights, hats = quadrature(patch)
    load = weights * (hats @ pressure)
    total = float(load.sum())
    share = load / total
    mirrored = (patch.images < 0).any(axis=0)
    x, y = (points - np.where(mirrored, 0.0, share @ points)).T
    xx, yy = float(share @ x**2), float(share @ y**2)
    xy = 0.0 if mirrored.any() else float(share @ (x * y))
    determinant = xx * yy - xy**2
    counted = ContactShape(len(patch.images) * float(patch.mass[pressure > 0].sum()), float(pressure.max()), False)
    # Cut off by the skin's own edge, as on a slab, it is no ellipse either
    cut_off = pressure[patch.outline].max() > CUT_OFF * pressure.max()
    if cut_off or determinant <= 0:
        return counted
    square = (yy * x**2 - 2 * xy * x * y + xx * y**2) / (2 * determinant)
    q = _layer_term(float(share @ square**2))
    if q is None:
        return counted
    sixth = ((1 - q) * SIXTH[0] + q * SIXTH[1]) / mean_square(q) ** 3
    if abs(sixth / float(share @ square**3) - 1) > TRUSTED:
        return counted
    # By Hertz alone the radius is nearly right already: enough to count the elements across it
    edge = patch.edge_length[pressure > 0].mean()
    spread = float(np.sqrt(determinant))
    elements = float(np.sqrt(2 * spread / SECOND[0]) / edge)
    known, needed = (0.0, TELLING_ELEMENTS) if expected_q is None else (expected_q, RESOLVING_ELEMENTS)
    q = known + (q - known) / (1 + (needed / elements) ** 6)
    area = 2 * np.pi * spread / mean_square(q)
    if abs(area - counted.area) > EDGE_BAND * edge * 2 * np.sqrt(np.pi * area):
        return counted
    mean = len(patch.images) * total / area
    return ContactShape(area, mean * peak_over_mean(q), True)


def _layer_term(fourth: float) -> float | None:
    """q from the mean of the squared normalised radius; None where the family has no such member."""
    d1, d2 = SECOND[0] - SECOND[1], FOURTH[0] - FOURTH[1]
    square, linear = fourth * d1**2, d2 - 2 * SECOND[0] * d1 * fourth
    constant = SECOND[0] ** 2 * fourth - FOURTH[0]
    discriminant = linear**2 - 4 * square * constant
    if discriminant < 0:
        return None
    q = -2 * constant / (linear + np.copysign(np.sqrt(discriminant), linear))
    return float(q) if FLATTEST <= q <= SHARPEST else None
