"""The default finger on the shipped meshes, which several families of cases share."""

from functools import lru_cache

import numpy as np

from papilla.fem import FingerModel, Press, ReducedFinger
from papilla.fem.pressing.contact import contact_press
from papilla.fem.reduction.patch import weak_gap
from papilla.finger import Finger
from papilla.mesh import DEFAULT_SIZE_MM, build
from papilla.specimen import THICKNESS_MM, Block, Specimen
from papilla.units import gf_to_newton

BLOCK = Block(0.51, THICKNESS_MM)
"""The specimen of a sweep, of the middle published modulus."""

FORCES_GF = (5, 10, 30, 60, 100)
"""From a light press to the heaviest published one."""


COARSE_MM = 2.0
"""Element size for identities that hold on any mesh."""


@lru_cache(maxsize=1)
def default_model(size_mm: float = DEFAULT_SIZE_MM) -> FingerModel:
    """The default finger; only for symmetric fields, because it keeps every factor."""
    finger = Finger.default()
    return FingerModel(finger, build(finger, size_mm=size_mm))


@lru_cache(maxsize=1)
def default_adjoints(size_mm: float = DEFAULT_SIZE_MM) -> dict[tuple[int, int], np.ndarray]:
    """Its gauges' adjoint displacements by parity, as `FingerModel.gauge_adjoints` has them."""
    model = default_model(size_mm)
    return FingerModel(model.finger, model.mesh).gauge_adjoints()


@lru_cache(maxsize=1)
def default_reduced(size_mm: float = DEFAULT_SIZE_MM) -> ReducedFinger:
    """The default finger condensed at its apex."""
    return default_model(size_mm).reduce()


def pressed_by(reduced: ReducedFinger, force_gf: float, specimen: Specimen = BLOCK) -> Press:
    """The nodal contact under a force in gf, without the ellipse's correction: invariances hold for it on any mesh."""
    return contact_press(reduced, specimen, (gf_to_newton(force_gf), None), 0.0)


def contact_residuals(reduced: ReducedFinger, specimen: Specimen, pressed: Press) -> tuple[float, float, float]:
    """Distance of a press from p >= 0, w >= 0 and p w = 0, in units of peak pressure, indentation, and their product.

    w = (A p + g) / m - delta is the mean gap at each node; recomputed here from the compliance alone.
    """
    patch, pressure = reduced.patch, pressed.pressure
    compliance = reduced.compliance + reduced.specimen_compliance(specimen)
    skin = weak_gap(patch, specimen)
    gap = (compliance @ pressure + skin) / patch.mass - pressed.indentation
    peak, depth = float(pressure.max()), pressed.indentation
    product = float(np.abs(pressure * gap).max()) / (peak * depth)
    return max(0.0, -float(pressure.min())) / peak, max(0.0, -float(gap.min())) / depth, product
