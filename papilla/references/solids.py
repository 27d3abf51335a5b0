"""Solids with exact solutions: bonded spherical shells on a rigid core, uniaxial and confined compression."""

import math
from collections.abc import Sequence

import numpy as np

from papilla import checks
from papilla.errors import InputError


def oedometric_modulus(modulus: float, nu: float) -> float:
    """Confined compression modulus in MPa: E (1-nu)/((1+nu)(1-2nu)), `inf` for nu = 0.5.

    Raises `InputError` for modulus (MPa) <= 0 or nu outside [0, 0.5]. Source: Hooke's law with one strain free.
    """
    modulus, nu = checks.positive("modulus (MPa)", modulus), checks.poisson("nu", nu)
    return math.inf if nu == 0.5 else modulus * (1 - nu) / ((1 + nu) * (1 - 2 * nu))


def neo_hookean_uniaxial(stretch, modulus: float):
    """Engineering stress in MPa of an incompressible neo-Hookean bar: (E/3)(l - 1/l^2), stretch l of any shape.

    Raises `InputError` for a stretch or a modulus (MPa) that is not positive.
    Source: Treloar (1943), doi:10.1039/tf9433900241.
    """
    stretch = np.asarray(stretch, dtype=float)
    if not np.all(np.isfinite(stretch) & (stretch > 0)):
        raise InputError(f"stretch must be finite and greater than 0, got {np.min(stretch):g} to {np.max(stretch):g}")
    return checks.positive("modulus (MPa)", modulus) / 3 * (stretch - stretch**-2)


def layered_sphere_displacement(
    r, core_radius: float, outer_radii: Sequence[float], moduli: Sequence[float], nus: Sequence[float], pressure: float
):
    """Radial displacement in mm of bonded spherical shells around a rigid core, under an outer pressure (Lame).

    In each shell u = m r/(3K) + b/r^2 and the radial stress is m - 4 G b/r^3, with 1/(3K) = (1 - 2nu)/E; m and b
    follow from u = 0 on the core, continuity of u and radial stress, and -`pressure` (MPa) outside.

    `r` any shape, mm, from `core_radius` to `outer_radii[-1]`; `outer_radii` (mm, increasing), `moduli` (MPa) and `nus`
    from the core outward, one a shell. Raises `InputError` for lists of unequal length, radii that do not increase, r
    outside the shells, or nu outside [0, 0.5]. Source: Timoshenko and Goodier, Theory of Elasticity (1970), chapter 12.
    """
    radii = _increasing(core_radius, outer_radii)
    if not len(outer_radii) == len(moduli) == len(nus):
        raise InputError(
            f"outer_radii, moduli, nus must have one value a shell, got {len(outer_radii)}, {len(moduli)}, {len(nus)}"
        )
    E = np.array([checks.positive("modulus (MPa)", modulus) for modulus in moduli])
    nu = np.array([checks.poisson("nu", ratio) for ratio in nus])
    volumetric, shear = (1 - 2 * nu) / E, E / (2 * (1 + nu))
    r = np.asarray(r, dtype=float)
    if not np.all((r >= radii[0]) & (r <= radii[-1])):
        raise InputError(f"r (mm) must lie between {radii[0]:g} and {radii[-1]:g}, got {np.min(r):g} to {np.max(r):g}")
    m, b = _shell_constants(radii, volumetric, shear, checks.finite("pressure (MPa)", pressure))
    shell = np.searchsorted(radii[1:-1], r)
    return m[shell] * volumetric[shell] * r + b[shell] / r**2


def _shell_constants(radii, volumetric, shear, pressure):
    """Mean stress m (MPa) and b (mm3) of each shell; `volumetric` is 1/(3K), so that nu = 0.5 is no special case."""
    count = len(shear)
    system, right = np.zeros((2 * count, 2 * count)), np.zeros(2 * count)
    for i in range(count):
        here = slice(2 * i, 2 * i + 2)
        for row, radius, sign in ((2 * i, radii[i], 1.0), (2 * i + 2, radii[i + 1], -1.0)):
            # Row 2i: displacement at the inner radius of shell i; row 2i - 1: radial stress there
            if row < 2 * count:
                system[row, here] = sign * np.array([volumetric[i] * radius, radius**-2])
            if row > 0:
                system[row - 1, here] = -sign * np.array([1.0, -4 * shear[i] / radius**3])
    right[-1] = -pressure
    m, b = np.linalg.solve(system, right).reshape(count, 2).T
    return m, b


def _increasing(core_radius, outer_radii):
    radii = [checks.positive("core radius (mm)", core_radius)]
    for outer in outer_radii:
        radii.append(checks.positive("outer radius (mm)", outer))
    if len(radii) < 2 or np.any(np.diff(radii) <= 0):
        raise InputError(f"radii (mm) must increase from the core outward, got {', '.join(f'{x:g}' for x in radii)}")
    return np.array(radii)
