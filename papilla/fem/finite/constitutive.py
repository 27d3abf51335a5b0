"""Stress and tangent of a near-incompressible hyperelastic point, in closed form and for many points at once.

W = W_iso(J^(-1/3) F) + mu/3 (J - 1)^2 - p (J - 1) - p^2/(2 lambda), with the pressure p an unknown of its own. For
stationary p the volumetric part is kappa/2 (J - 1)^2 with kappa = lambda + 2 mu/3; at small strain W is mu eps : eps -
p div u - p^2/(2 lambda), term by term that of linear elasticity, and nu = 0.5 (1/lambda = 0) causes no difficulty.
"""

from dataclasses import dataclass, fields
from functools import singledispatch

import numpy as np

from papilla.errors import InputError
from papilla.materials import FirstInvariantMaterial, Ogden

_ROWS, _COLUMNS = np.divmod(np.arange(9), 3)


@dataclass(frozen=True, eq=False)
class Kinematics:
    """Quantities that every material computes from displacement gradients (..., 3, 3); J - 1 is computed without
    cancellation.

    gradient : H; deformation : F = I + H; cofactor : J F^-T; volume_change : J - 1 (...).
    """

    gradient: np.ndarray
    deformation: np.ndarray
    cofactor: np.ndarray
    volume_change: np.ndarray

    @classmethod
    def of(cls, gradient: np.ndarray) -> "Kinematics":
        """Kinematics of displacement gradients (..., 3, 3)."""
        deformation = gradient + np.eye(3)
        cofactor = _cofactor(deformation)
        trace = np.trace(gradient, axis1=-2, axis2=-1)
        square = (gradient * gradient.swapaxes(-1, -2)).sum(axis=(-2, -1))
        determinant = (gradient[..., 0, :] * np.cross(gradient[..., 1, :], gradient[..., 2, :])).sum(axis=-1)
        return cls(gradient, deformation, cofactor, trace + (trace**2 - square) / 2 + determinant)

    def __getitem__(self, index) -> "Kinematics":
        """The kinematics of some of the points."""
        return Kinematics(*(getattr(self, item.name)[index] for item in fields(self)))

    @property
    def jacobian(self) -> np.ndarray:
        """J = det F (...)."""
        return 1 + self.volume_change


def stress(material: FirstInvariantMaterial | Ogden, kinematics: Kinematics, pressure: np.ndarray) -> np.ndarray:
    """First Piola-Kirchhoff stress (..., 3, 3) in MPa. Every J must be positive."""
    return isochoric_stress(material, kinematics) + _slope(material, kinematics, pressure) * kinematics.cofactor


def response(
    material: FirstInvariantMaterial | Ogden, kinematics: Kinematics, pressure: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Stress (..., 3, 3) and its derivative by F (..., 9, 9), MPa, pressure (...) held fixed.

    Index pairs are flattened as 3 * i + K for component i and reference direction K. Every J must be positive.
    """
    tangent, cofactor = isochoric_tangent(material, kinematics), kinematics.cofactor
    inverse = cofactor / kinematics.jacobian[..., None, None]
    flat, inverse_flat = _flat(cofactor), _flat(inverse)
    # d cof F / dF = cof F (x) F^-T - swapped(cof F, F^-T)
    turned = _dyad(flat, inverse_flat) - _swapped(cofactor, inverse)
    tangent = tangent + _slope(material, kinematics, pressure) * turned
    return stress(material, kinematics, pressure), tangent + 2 * material.shear_modulus / 3 * _dyad(flat, flat)


def _slope(material, kinematics: Kinematics, pressure: np.ndarray) -> np.ndarray:
    """Derivative (..., 1, 1) of the volumetric energy by J, MPa."""
    return (2 * material.shear_modulus / 3 * kinematics.volume_change - pressure)[..., None, None]


def energy(
    material: FirstInvariantMaterial | Ogden, kinematics: Kinematics, pressure: np.ndarray, compressibility: float
) -> np.ndarray:
    """W (...) in MPa, `compressibility` being 1/lambda in 1/MPa."""
    change = kinematics.volume_change
    volumetric = material.shear_modulus / 3 * change**2 - pressure * change - compressibility / 2 * pressure**2
    return isochoric_energy(material, kinematics) + volumetric


@singledispatch
def isochoric_stress(material: object, kinematics: Kinematics) -> np.ndarray:
    """dW_iso/dF (..., 3, 3) of a material, MPa."""
    raise InputError(f"no stress is known for {type(material).__name__}")


@singledispatch
def isochoric_tangent(material: object, kinematics: Kinematics) -> np.ndarray:
    """d2W_iso/dF2 (..., 9, 9) of a material, MPa."""
    raise InputError(f"no tangent is known for {type(material).__name__}")


@singledispatch
def isochoric_energy(material: object, kinematics: Kinematics) -> np.ndarray:
    """W_iso (...) of a material, MPa."""
    raise InputError(f"no energy is known for {type(material).__name__}")


@isochoric_energy.register
def _(material: FirstInvariantMaterial, kinematics):
    return material.energy((kinematics.deformation**2).sum(axis=(-2, -1)) * kinematics.jacobian ** (-2 / 3))


@isochoric_stress.register
def _(material: FirstInvariantMaterial, kinematics):
    scale, square, direction, _ = _invariant(kinematics)
    return material.slopes(scale * square)[0][..., None, None] * direction


@isochoric_tangent.register
def _(material: FirstInvariantMaterial, kinematics):
    """The derivative of dI/dF by the product rule."""
    scale, square, direction, inverse = _invariant(kinematics)
    first, second = (slope[..., None, None] for slope in material.slopes(scale * square))
    square, scale = square[..., None, None], scale[..., None, None]
    f, g, d = _flat(kinematics.deformation), _flat(inverse), _flat(direction)
    mixed = _dyad(f, g)
    tangent = 4 / 9 * square * _dyad(g, g) - 4 / 3 * (mixed + mixed.swapaxes(-1, -2))
    tangent += 2 / 3 * square * _swapped(inverse, inverse)
    tangent[..., np.arange(9), np.arange(9)] += 2
    return first * scale * tangent + second * _dyad(d, d)


def _invariant(kinematics: Kinematics):
    """J^(-2/3), F : F, dI/dF = J^(-2/3) (2 F - 2/3 (F : F) F^-T) for I = J^(-2/3) F : F, and F^-T."""
    F = kinematics.deformation
    inverse = kinematics.cofactor / kinematics.jacobian[..., None, None]
    scale, square = kinematics.jacobian ** (-2 / 3), (F**2).sum(axis=(-2, -1))
    return scale, square, scale[..., None, None] * (2 * F - (2 / 3 * square)[..., None, None] * inverse), inverse


@isochoric_energy.register
def _(material: Ogden, kinematics):
    stretches, _, _ = principal(kinematics)
    return material.energy(stretches * kinematics.jacobian[..., None] ** (-1 / 3))


@isochoric_stress.register
def _(material: Ogden, kinematics):
    stretches, spatial, reference = principal(kinematics)
    slope = _ogden_derivatives(material, stretches, kinematics.jacobian)[0]
    return (spatial * slope[..., None, :]) @ reference.swapaxes(-1, -2)


@isochoric_tangent.register
def _(material: Ogden, kinematics):
    """In principal axes n (x) N the stress is diag(W_i) and the tangent couples ab with ab and ba alone.

    A_abab + A_abba = (W_a - W_b)/(l_a - l_b), A_abab - A_abba = (W_a + W_b)/(l_a + l_b) (Ogden 1997, section 6.1.4).
    """
    stretches, spatial, reference = principal(kinematics)
    slope, hessian, quotient = _ogden_derivatives(material, stretches, kinematics.jacobian)
    total = (slope[..., :, None] + slope[..., None, :]) / (stretches[..., :, None] + stretches[..., None, :])
    local = np.zeros((*stretches.shape[:-1], 3, 3, 3, 3))
    for a in range(3):
        for b in range(3):
            local[..., a, a, b, b] += hessian[..., a, b]
            if a != b:
                local[..., a, b, a, b] += (quotient[..., a, b] + total[..., a, b]) / 2
                local[..., a, b, b, a] += (quotient[..., a, b] - total[..., a, b]) / 2
    local = local.reshape(*stretches.shape[:-1], 9, 9)
    # Column 3 a + b of the rotation is n_a (x) N_b
    rotation = (spatial[..., :, None, :, None] * reference[..., None, :, None, :]).reshape(*stretches.shape[:-1], 9, 9)
    return rotation @ local @ rotation.swapaxes(-1, -2)


def principal(kinematics: Kinematics) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Principal stretches (..., 3), and their spatial and reference axes (..., 3, 3) in columns."""
    H = kinematics.gradient
    strain = H + H.swapaxes(-1, -2) + H.swapaxes(-1, -2) @ H
    values, reference = np.linalg.eigh(strain)
    stretches = np.sqrt(1 + values)
    return stretches, kinematics.deformation @ reference / stretches[..., None, :], reference


def _ogden_derivatives(material: Ogden, stretches, jacobian):
    """W_i (..., 3), W_ij (..., 3, 3) and the quotient (W_i - W_j)/(l_i - l_j) (..., 3, 3), smooth for equal stretches.

    W = c (J^(-alpha/3) S - 3), c = 2 mu/alpha^2, S = sum l^alpha, so
    W_i = c alpha J^(-alpha/3) (l_i^(alpha-1) - S/(3 l_i)).
    """
    alpha = material.alpha
    scale = (2 * material.mu / alpha * jacobian ** (-alpha / 3))[..., None]
    powers = stretches**alpha
    total = powers.sum(axis=-1, keepdims=True)
    slope = scale * (powers - total / 3) / stretches
    column, row = stretches[..., :, None], stretches[..., None, :]
    mixed = -(powers[..., :, None] + powers[..., None, :]) * alpha / 3 + alpha / 9 * total[..., None]
    hessian = mixed / (column * row)
    diagonal = ((alpha - 1) * powers + total / 3) / stretches**2
    hessian[..., np.arange(3), np.arange(3)] += diagonal
    quotient = row ** (alpha - 2) * _power_quotient((column - row) / row, alpha - 1) + total[..., None] / (
        3 * column * row
    )
    return slope, scale[..., None] * hessian, scale[..., None] * quotient


def _power_quotient(x, exponent):
    """((1 + x)^exponent - 1) / x; for x = 0 its limit, the exponent."""
    safe = np.where(x == 0, 1.0, x)
    return np.where(x == 0, exponent, np.expm1(exponent * np.log1p(safe)) / safe)


def _cofactor(F):
    rows = [np.cross(F[..., (i + 1) % 3, :], F[..., (i + 2) % 3, :]) for i in range(3)]
    return np.stack(rows, axis=-2)


def _flat(tensor):
    return tensor.reshape(*tensor.shape[:-2], 9)


def _dyad(a, b):
    return a[..., :, None] * b[..., None, :]


def _swapped(a, b):
    """T with T_(iK)(jL) = a_jK b_iL, (..., 9, 9)."""
    return a[..., _ROWS[None, :], _COLUMNS[:, None]] * b[..., _ROWS[:, None], _COLUMNS[None, :]]
