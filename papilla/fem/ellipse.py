"""Contact area and peak pressure from the moments of the nodal pressure.

Counting active nodes steps by a whole row of elements, and single nodes overshoot at the edge; moments are as smooth
and accurate as the gauge rows. The pressure is taken as F / (pi a b) [(1 - q) 3/2 sqrt(1 - u) + q 5/2 (1 - u)^(3/2)]
with u = (x/a)^2 + (y/b)^2: Hertz's, and one term more for layers; its second and fourth moments give a, b and q in
closed form.
"""

from dataclasses import dataclass

import numpy as np

from papilla.fem.compliance import quadrature
from papilla.fem.patch import Patch

_SECOND = (2 / 5, 2 / 7)
_FOURTH = (8 / 35, 8 / 63)
_SIXTH = (16 / 105, 16 / 231)
"""Moments of u, u^2 and u^3 under the two profiles, per unit force."""

TRUSTED = 0.05
"""Mismatch of the sixth moment above which the contact is no such ellipse (a slab's line contact, say)."""

CUT_OFF = 0.01
"""Share of the peak pressure that, at the patch's outline, means that the contact is cut off there."""

RESOLVING_ELEMENTS = 4.0
"""Elements across the contact radius that tell q from the mesh's noise; with fewer, q goes to Hertz's 0."""

EDGE_BAND = 0.5
"""Elements around the edge by which the active nodes of a true ellipse may differ from it (0.36 was measured at most; a
slab's line contact, whose low moments an ellipse can match, gives 0.8)."""


@dataclass(frozen=True)
class ContactShape:
    """Area (mm2) and peak pressure (MPa); `elliptic` tells whether the moments fit, else nodes were counted."""

    area: float
    peak_pressure: float
    elliptic: bool


def contact_shape(patch: Patch, pressure: np.ndarray) -> ContactShape:
    """Area and peak of a nodal pressure (n,) in MPa on a patch with all its images."""
    points, weights, hats = quadrature(patch)
    load = weights * (hats @ pressure)
    share = load / load.sum()
    mirrored = (patch.images < 0).any(axis=0)
    centred = points - np.where(mirrored, 0.0, share @ points)
    covariance = centred.T @ (share[:, None] * centred)
    if mirrored.any():
        covariance = np.diag(np.diag(covariance))
    counted = ContactShape(len(patch.images) * float(patch.mass[pressure > 0].sum()), float(pressure.max()), False)
    # Cut off by the skin's own edge, as on a slab, it is no ellipse either
    cut_off = pressure[patch.outline].max() > CUT_OFF * pressure.max()
    if cut_off or np.linalg.det(covariance) <= 0:
        return counted
    square = np.einsum("ki,ij,kj->k", centred, np.linalg.inv(covariance), centred) / 2
    solution = _profile(float(share @ square**2))
    if solution is None:
        return counted
    q, scale = solution
    sixth = scale**3 * ((1 - q) * _SIXTH[0] + q * _SIXTH[1])
    if abs(sixth / float(share @ square**3) - 1) > TRUSTED:
        return counted
    # By Hertz alone the radius is nearly right already: enough to count the elements across it
    edge = patch.edge_length[pressure > 0].mean()
    elements = np.sqrt(2 * np.sqrt(np.linalg.det(covariance)) / _SECOND[0]) / edge
    q /= 1 + (RESOLVING_ELEMENTS / elements) ** 6
    area = 2 * np.pi * _scale(q) * float(np.sqrt(np.linalg.det(covariance)))
    if abs(area - counted.area) > EDGE_BAND * edge * 2 * np.sqrt(np.pi * area):
        return counted
    mean = len(patch.images) * float(load.sum()) / area
    return ContactShape(area, mean * _peak_over_mean(q), True)


def _profile(fourth: float) -> tuple[float, float] | None:
    """(q, scale of u) from the mean of the squared normalised radius; None where the family has no such member."""
    d1, d2 = _SECOND[0] - _SECOND[1], _FOURTH[0] - _FOURTH[1]
    roots = np.roots([fourth * d1**2, d2 - 2 * _SECOND[0] * d1 * fourth, _SECOND[0] ** 2 * fourth - _FOURTH[0]])
    roots = roots[np.isreal(roots)].real
    if len(roots) == 0:
        return None
    q = float(roots[np.abs(roots).argmin()])
    # Outside, the pressure would be negative at the centre or at the edge
    if not -1.5 <= q <= 1:
        return None
    return q, _scale(q)


def _scale(q: float) -> float:
    """Scale of u that makes its mean, 1 by construction, that of the profile."""
    return 1 / (_SECOND[0] - (_SECOND[0] - _SECOND[1]) * q)


def _peak_over_mean(q: float) -> float:
    """Largest value of (1 - q) 3/2 t + q 5/2 t^3 over 0 <= t <= 1."""
    values = [1.5 * (1 - q) + 2.5 * q]
    if q < 0:
        t = np.sqrt((1 - q) / (-5 * q))
        if t < 1:
            values.append(1.5 * (1 - q) * t + 2.5 * q * t**3)
    return float(max(values))
