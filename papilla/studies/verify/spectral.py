"""Rigid sphere on any stack of layers, by integral transforms: the second method for coated bodies."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Chebyshev
from numpy.polynomial.legendre import leggauss

from papilla.references import StackLayer, halfspace_stiffness, layered_halfspace_stiffness
from papilla.specimen import HalfSpace

CUTOFF = 24.0
"""Wavenumber times thickness of the top layer, above which the lower layers have no effect."""

NODES = 64
"""Gauss-Legendre nodes of the unknown over the contact radius."""


@dataclass(frozen=True)
class StackContact:
    """Force (N), indentation (mm) and peak pressure (MPa) of a contact of a given radius (mm)."""

    contact_radius: float
    force: float
    indentation: float
    peak_pressure: float


def stack_sphere(
    contact_radius: float, radius: float, layers: Sequence[StackLayer], base: HalfSpace | None
) -> StackContact:
    """Rigid frictionless sphere of `radius` mm (as a paraboloid) on a stack, for a contact of `contact_radius` mm.

    With the pressure's Hankel transform int_0^a phi(t) cos(qt) dt and W(q) = 1 - E* q / (2 K(q)), K the stack's
    stiffness and E* its top layer's contact modulus, the displacement d - r^2/(2R) under the sphere demands

        phi(t) - (2/pi) int_0^a phi(s) int_0^inf W(q) cos(qs) cos(qt) dq ds = (E*/pi) (d - t^2/R),  phi(a) = 0,

    which is linear in d and 1/R; F = 2 pi int phi dt and p(0) = -int phi'(t)/t dt.
    Source: Lebedev and Ufliand (1958), PMM 22, 442; the stiffness of stacks is `layered_halfspace_stiffness`.
    """
    top = layers[0]
    e_star = top.modulus / (1 - top.nu**2)
    x, weights = leggauss(NODES)
    tau, weights = np.append((x + 1) / 2, 1.0), np.append(weights / 2, 0.0)
    q, q_weights = _wavenumbers(top.thickness, contact_radius)
    lacking = 1 - halfspace_stiffness(q, e_star) / layered_halfspace_stiffness(q, layers, base)
    waves = np.cos(contact_radius * np.outer(tau, q))
    coupling = 2 / math.pi * contact_radius * (waves * (q_weights * lacking)) @ waves.T
    right = np.stack([np.ones_like(tau), (contact_radius * tau) ** 2 / radius], axis=1)
    flat, bowl = np.linalg.solve(np.eye(len(tau)) - coupling * weights, right).T
    indentation = float(bowl[-1] / flat[-1])
    phi = e_star / math.pi * (indentation * flat - bowl)
    slope = Chebyshev.fit(tau**2, phi, NODES // 2, domain=[0, 1]).deriv()
    return StackContact(
        contact_radius=contact_radius,
        force=2 * math.pi * contact_radius * float(weights @ phi),
        indentation=indentation,
        peak_pressure=-2 / contact_radius * float(weights @ slope(tau**2)),
    )


def _wavenumbers(thickness: float, contact_radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights (1/mm) from 0 to the cutoff; panels shrink towards 0, where a hard coat acts as a plate."""
    longest = CUTOFF / thickness
    widest = min(1 / thickness, 4 / contact_radius)
    edges = np.append(0, np.geomspace(1e-6 * widest, widest, 25))
    edges = np.append(edges, np.linspace(widest, longest, 2 + math.ceil((longest - widest) / widest))[1:])
    x, weights = leggauss(16)
    width = np.diff(edges)
    nodes = edges[:-1, None] + width[:, None] * (x + 1) / 2
    return nodes.ravel(), (width[:, None] * weights / 2).ravel()
