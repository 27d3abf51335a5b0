"""Stress and tangent of a near-incompressible hyperelastic point, in closed form and for many points at once.

W = W_iso(J^(-1/3) F) + mu/3 (J - 1)^2 - p (J - 1) - p^2/(2 lambda), with the pressure p an unknown of its own. For
stationary p the volumetric part is kappa/2 (J - 1)^2 with kappa = lambda + 2 mu/3; at small strain W is mu eps : eps -
p div u - p^2/(2 lambda), term by term that of linear elasticity, and nu = 0.5 (1/lambda = 0) causes no difficulty.
"""

from dataclasses import dataclass, fields

import numpy as np

from papilla.model.materials import FirstInvariantMaterial, Material, Ogden

ONE_THIRD = 1 / 3  # One over the number of dimensions


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
        deformation = gradient + np.eye(gradient.shape[-1])
        # The rows of the cofactor are the cross products of the two other rows
        following, last = (np.roll(deformation, -shift, axis=-2) for shift in (1, 2))
        trace = np.trace(gradient, axis1=-2, axis2=-1)
        square = (gradient * gradient.swapaxes(-1, -2)).sum(axis=(-2, -1))
        first, second, third = np.moveaxis(gradient, -2, 0)
        determinant = (first * np.cross(second, third)).sum(axis=-1)
        return cls(gradient, deformation, np.cross(following, last), trace + (trace**2 - square) / 2 + determinant)

    def __getitem__(self, index) -> "Kinematics":
        """The kinematics of some of the points."""
        return Kinematics(*(getattr(self, item.name)[index] for item in fields(self)))

    @property
    def jacobian(self) -> np.ndarray:
        """J = det F (...)."""
        return 1 + self.volume_change


def stress(material: Material, kinematics: Kinematics, pressure: np.ndarray) -> np.ndarray:
    """First Piola-Kirchhoff stress (..., 3, 3) in MPa. Every J must be positive."""
    return isochoric_stress(material, kinematics) + _slope(material, kinematics, pressure) * kinematics.cofactor


def response(material: Material, kinematics: Kinematics, pressure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stress (..., 3, 3) and its derivative by F (..., 9, 9), MPa, pressure (...) held fixed.

    Index pairs are flattened as 3 * i + K for component i and reference direction K. Every J must be positive.
    """
    tangent, cofactor = isochoric_tangent(material, kinematics), kinematics.cofactor
    inverse = cofactor / kinematics.jacobian[..., None, None]
    flat = _flat(cofactor)
    # d cof F / dF = cof F (x) F^-T - swapped(cof F, F^-T)
    turned = _dyad(flat, _flat(inverse)) - _swapped(cofactor, inverse)
    tangent = tangent + _slope(material, kinematics, pressure) * turned
    return stress(material, kinematics, pressure), tangent + 2 * material.shear_modulus * ONE_THIRD * _dyad(flat, flat)


def _slope(material: Material, kinematics: Kinematics, pressure: np.ndarray) -> np.ndarray:
    """Derivative (..., 1, 1) of the volumetric energy by J, MPa."""
    return (2 * material.shear_modulus * ONE_THIRD * kinematics.volume_change - pressure)[..., None, None]


def isochoric_stress(material: Material, kinematics: Kinematics) -> np.ndarray:
    """dW_iso/dF (..., 3, 3) of a material, MPa."""
    if isinstance(material, Ogden):
        stretches, spatial, reference = principal(kinematics)
        slope = _ogden_derivatives(material, stretches, kinematics.jacobian)[0]
        return (spatial * slope[..., None, :]) @ reference.swapaxes(-1, -2)
    scale, square, direction, _ = _invariant(kinematics)
    return material.slopes(scale * square)[0][..., None, None] * direction


def isochoric_tangent(material: Material, kinematics: Kinematics) -> np.ndarray:
    """d2W_iso/dF2 (..., 9, 9) of a material, MPa."""
    if isinstance(material, Ogden):
        return _ogden_tangent(material, kinematics)
    return _invariant_tangent(material, kinematics)


def _invariant_tangent(material: FirstInvariantMaterial, kinematics: Kinematics) -> np.ndarray:
    """The derivative of dI/dF by the product rule."""
    scale, square, direction, inverse = _invariant(kinematics)
    first, second = (slope[..., None, None] for slope in material.slopes(scale * square))
    share, scale = 2 * ONE_THIRD * square[..., None, None], scale[..., None, None]
    f, g, d = _flat(kinematics.deformation), _flat(inverse), _flat(direction)
    mixed = _dyad(f, g)
    tangent = 2 * ONE_THIRD * (share * _dyad(g, g) - 2 * (mixed + mixed.swapaxes(-1, -2)))
    tangent += share * _swapped(inverse, inverse)
    diagonal = np.einsum("...kk->...k", tangent)
    diagonal += 2
    return first * scale * tangent + second * _dyad(d, d)


def _invariant(kinematics: Kinematics):
    """J^(-2/3), F : F, dI/dF = J^(-2/3) (2 F - 2/3 (F : F) F^-T) for I = J^(-2/3) F : F, and F^-T."""
    F = kinematics.deformation
    inverse = kinematics.cofactor / kinematics.jacobian[..., None, None]
    scale, square = kinematics.jacobian ** (-2 * ONE_THIRD), (F**2).sum(axis=(-2, -1))
    direction = scale[..., None, None] * (2 * F - (2 * ONE_THIRD * square)[..., None, None] * inverse)
    return scale, square, direction, inverse


def _ogden_tangent(material: Ogden, kinematics: Kinematics) -> np.ndarray:
    """In principal axes n (x) N the stress is diag(W_i) and the tangent couples ab with ab and ba alone.

    A_abab + A_abba = (W_a - W_b)/(l_a - l_b), A_abab - A_abba = (W_a + W_b)/(l_a + l_b) (Ogden 1997, section 6.1.4).
    """
    stretches, spatial, reference = principal(kinematics)
    slope, hessian, quotient = _ogden_derivatives(material, stretches, kinematics.jacobian)
    total = (slope[..., :, None] + slope[..., None, :]) / (stretches[..., :, None] + stretches[..., None, :])
    *points, axes = stretches.shape
    local = np.zeros((*points, axes, axes, axes, axes))
    for a, b in np.ndindex(axes, axes):
        local[..., a, a, b, b] += hessian[..., a, b]
        if a != b:
            local[..., a, b, a, b] += (quotient[..., a, b] + total[..., a, b]) / 2
            local[..., a, b, b, a] += (quotient[..., a, b] - total[..., a, b]) / 2
    local = local.reshape(*points, axes**2, axes**2)
    # Column 3 a + b of the rotation is n_a (x) N_b
    rotation = (spatial[..., :, None, :, None] * reference[..., None, :, None, :]).reshape(local.shape)
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
    scale = (2 * material.mu / alpha * jacobian ** (-alpha * ONE_THIRD))[..., None]
    powers = stretches**alpha
    mean = powers.sum(axis=-1, keepdims=True) * ONE_THIRD
    slope = scale * (powers - mean) / stretches
    stretch_i, stretch_j = stretches[..., :, None], stretches[..., None, :]
    both = stretch_i * stretch_j
    hessian = alpha * ONE_THIRD * (mean[..., None] - powers[..., :, None] - powers[..., None, :]) / both
    diagonal = np.einsum("...kk->...k", hessian)
    diagonal += ((alpha - 1) * powers + mean) / stretches**2
    quotient = stretch_j ** (alpha - 2) * _power_quotient((stretch_i - stretch_j) / stretch_j, alpha - 1)
    quotient = quotient + mean[..., None] / both
    return slope, scale[..., None] * hessian, scale[..., None] * quotient


def _power_quotient(x, exponent):
    """((1 + x)^exponent - 1) / x; for x = 0 its limit, the exponent."""
    safe = np.where(x == 0, 1.0, x)
    return np.where(x == 0, exponent, np.expm1(exponent * np.log1p(safe)) / safe)


def _flat(tensor):
    return tensor.reshape(*tensor.shape[:-2], -1)


def _dyad(a, b):
    return a[..., :, None] * b[..., None, :]


def _swapped(a, b):
    """T with T_(iK)(jL) = a_jK b_iL, (..., 9, 9)."""
    rows, columns = np.indices(a.shape[-2:]).reshape(2, -1)
    return a[..., rows, columns[:, None]] * b[..., rows[:, None], columns]
