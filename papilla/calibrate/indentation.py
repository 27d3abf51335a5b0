"""Young's modulus from a series of force and indentation: the slow method that the estimate from gauges replaces."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import RectBivariateSpline
from scipy.optimize import least_squares
from scipy.special import stdtrit

from papilla import checks
from papilla.calibrate.press_table import Sweep
from papilla.errors import InputError
from papilla.references import bonded_layer_sphere

Depth = Callable[[float, np.ndarray], np.ndarray]
"""Indentation (n,) in mm that a specimen of a modulus (MPa) takes at forces (n,) in N."""
LEVEL = 0.95
FEWEST = 4
"""Smallest number of points of a series: two unknowns, and some degrees of freedom for their errors."""
STEP = 1e-4


@dataclass(frozen=True)
class IndentationModulus:
    """modulus_MPa, its standard deviation and 95 % interval; offset_mm : indentation at which contact begins.

    rms_N : root mean square residual of the force; freedom : number of points minus two.
    """

    modulus_MPa: float
    sigma_MPa: float
    interval: tuple[float, float]
    offset_mm: float
    offset_sigma_mm: float
    rms_N: float
    freedom: int


def on_half_space(radius_mm: float, nu: float = 0.5) -> Depth:
    """A rigid ball on a thick and wide specimen: Hertz, d = (3 F / (4 E* sqrt(R)))^(2/3)."""
    radius = checks.positive("radius_mm", radius_mm)
    factor = 0.75 * (1 - checks.poisson("nu", nu) ** 2) / math.sqrt(radius)
    return lambda modulus, force: (factor * force / modulus) ** (2 / 3)


def on_bonded_layer(radius_mm: float, thickness_mm: float, deepest_mm: float, nu: float = 0.5) -> Depth:
    """A rigid ball on a layer bonded to a rigid table (exact solution), up to an indentation of `deepest_mm`."""
    depth = np.geomspace(1e-3 * checks.positive("deepest_mm", deepest_mm), deepest_mm, 60)
    force = [bonded_layer_sphere(float(one), radius_mm, thickness_mm, 1.0, nu).force for one in depth]
    return lambda modulus, given: np.exp(np.interp(np.log(given / modulus), np.log(force), np.log(depth)))


def on_finger(sweep: Sweep) -> Depth:
    """A finger with its specimen; the indentations come from a sweep over force and modulus, NaN outside of it."""
    forces, moduli = np.unique(sweep.force_N), np.unique(sweep.modulus_MPa)
    order = np.lexsort((sweep.modulus_MPa, sweep.force_N))
    depth = sweep.indentation_mm[order].reshape(len(forces), len(moduli))
    whole = np.isfinite(depth).all(axis=0)
    spline = RectBivariateSpline(np.log(forces), np.log(moduli[whole]), np.log(depth[:, whole]))
    low, high = moduli[whole][0], moduli[whole][-1]

    def depth_at(modulus: float, force: np.ndarray) -> np.ndarray:
        inside = (force >= forces[0]) & (force <= forces[-1]) & (low <= modulus <= high)
        return np.where(inside, np.exp(spline.ev(np.log(force), np.full(len(force), np.log(modulus)))), np.nan)

    return depth_at


def fit_indentation(
    force_N: ArrayLike, indentation_mm: ArrayLike, depth: Depth, start_MPa: float = 0.3
) -> IndentationModulus:
    """Fit modulus and point of contact to a series; residuals are those of the force.

    Parameters
    ----------
    force_N, indentation_mm : (n,), n >= 4, of a loading. Points without a positive force are before contact and are
        left out. The indentation has an offset, which is fitted.
    depth : one of `on_half_space`, `on_bonded_layer`, `on_finger`, or your own.
    start_MPa : where the search begins.

    The interval uses Student's t and the linearised fit. Raises `InputError` for a series that is too short or that the
    model does not explain.
    """
    force, found = np.asarray(force_N, float), np.asarray(indentation_mm, float)
    whole = force.ndim == 1 and force.shape == found.shape and np.isfinite([force, found]).all()
    if not whole:
        raise InputError(f"force and indentation must be two equal finite columns, got {force.shape} and {found.shape}")
    touching = force > 0
    force, found = force[touching], found[touching]
    if len(force) < FEWEST:
        raise InputError(f"a series needs {FEWEST} points in contact at least, got {len(force)}")
    start = math.log(checks.positive("start_MPa", start_MPa))

    def lacking(values: np.ndarray) -> np.ndarray:
        return found - values[1] - depth(math.exp(values[0]), force)

    def stiffness(values: np.ndarray) -> np.ndarray:
        modulus = math.exp(values[0])
        more, less = depth(modulus, force * (1 + STEP)), depth(modulus, force * (1 - STEP))
        middle = depth(modulus, force)
        forward, backward = (more - middle) / (force * STEP), (middle - less) / (force * STEP)
        return 1 / np.where(np.isfinite(forward), forward, backward)

    try:
        first = least_squares(lacking, (start, float(np.min(found - depth(math.exp(start), force)))))
        weights = stiffness(first.x)
        best = least_squares(lambda values: weights * lacking(values), first.x)
    except ValueError as error:
        raise InputError("the series leaves the range of the indentation model") from error
    freedom = len(force) - 2
    variance = float(best.fun @ best.fun) / freedom
    covariance = variance * np.linalg.inv(best.jac.T @ best.jac)
    modulus, relative = math.exp(best.x[0]), math.sqrt(covariance[0, 0])
    reach = float(stdtrit(freedom, 0.5 + LEVEL / 2)) * relative
    interval = modulus * math.exp(-reach), modulus * math.exp(reach)
    offset = float(best.x[1]), math.sqrt(covariance[1, 1])
    return IndentationModulus(modulus, relative * modulus, interval, *offset, math.sqrt(variance), freedom)
