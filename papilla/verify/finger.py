"""The default finger on the shipped meshes, and checks of any finger, which several families of cases share."""

from functools import lru_cache

import numpy as np
import scipy.sparse as sp

from papilla.core.units import gf_to_newton
from papilla.fem import FingerModel, Press, ReducedFinger
from papilla.fem.pressing.contact import contact_press
from papilla.fem.reduction.patch import weak_gap
from papilla.mesh import DEFAULT_SIZE_MM, build
from papilla.model.finger import Finger
from papilla.model.specimen import THICKNESS_MM, Block, Specimen
from papilla.verify.case import Case

SWEEP_BLOCK = Block(0.51, THICKNESS_MM)
"""The specimen of a sweep, of the middle published modulus."""

COARSE_MM = 2.0
"""Element size for identities that hold on any mesh."""
FINGER_RESIDUAL_BOUND = 1e-10
"""Largest residual of a solve over its load."""


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


def pressed_by(reduced: ReducedFinger, force_gf: float, specimen: Specimen = SWEEP_BLOCK) -> Press:
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


def random_loads(model: FingerModel, columns: int, seed: int) -> np.ndarray:
    """(free unknowns, columns) of normal loads on the free displacements, and none on the pressures."""
    free = model.factor()[0]
    loads = np.zeros((int(free.sum()), columns))
    loaded = int(free[: 3 * model.space.nodes].sum())
    loads[:loaded] = np.random.default_rng(seed).standard_normal((loaded, columns))
    return loads


def residual(name: str, model: FingerModel) -> Case:
    """Largest relative residual over random displacement loads, with the true matrix, each column by itself."""
    factor, loads = model.factor()[1], random_loads(model, 4, seed=3)
    full = factor.matrix + sp.tril(factor.matrix, -1).T
    worst = (np.linalg.norm(full @ factor.solve(loads) - loads, axis=0) / np.linalg.norm(loads, axis=0)).max()
    return Case(f"{name}, residual", "residual of a solve over its load", float(worst), FINGER_RESIDUAL_BOUND)
