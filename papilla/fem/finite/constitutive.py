"""Stress and tangent of a near-incompressible hyperelastic point, in closed form and for many points at once.

W = W_iso(J^(-1/3) F) + mu/3 (J - 1)^2 - p (J - 1) - p^2/(2 lambda), with the pressure p an unknown of its own. For
stationary p the volumetric part is kappa/2 (J - 1)^2 with kappa = lambda + 2 mu/3; at small strain W is mu eps : eps -
p div u - p^2/(2 lambda), term by term that of linear elasticity, and nu = 0.5 (1/lambda = 0) causes no difficulty.
"""

from dataclasses import dataclass

import numpy as np

from papilla.model.materials import FirstInvariantMaterial, Material, Ogden

ONE_THIRD = 1 / 3  # One over the number of dimensions


@dataclass(frozen=True, eq=False)
class Kinematics:
    """Quantities that every material computes from displacement gradients (3, 3, ...), as differences from the state at
    rest without cancellation. Points come last, so that each operation runs over adjacent numbers.

    gradient : H = F - I; cofactor_change : J F^-T - I; volume_change : J - 1 (...).
    """

    gradient: np.ndarray
    cofactor_change: np.ndarray
    volume_change: np.ndarray

    @classmethod
    def of(cls, gradient: np.ndarray) -> "Kinematics":
        """Kinematics of displacement gradients (3, 3, ...)."""
        H, change = gradient, np.empty_like(gradient)
        for i, k in np.ndindex(H.shape[:2]):
            # Index -1 is the last row: rows and columns follow one another in a circle
            ahead, back = H[i - 2, k - 2] * H[i - 1, k - 1], H[i - 2, k - 1] * H[i - 1, k - 2]
            np.subtract(ahead, back, out=change[i, k, ...])
        trace = np.trace(H)
        volume_change = trace + np.trace(change) + np.einsum("k...,k...->...", H[0], change[0])
        # cof(I + H) = I + cof H - H^T + (tr H) I
        change -= H.swapaxes(0, 1)
        return cls(H, _plus_identity(change, trace), volume_change)

    @property
    def deformation(self) -> np.ndarray:
        """F (3, 3, ...)."""
        return _plus_identity(self.gradient.copy(), 1.0)

    @property
    def cofactor(self) -> np.ndarray:
        """J F^-T (3, 3, ...)."""
        return _plus_identity(self.cofactor_change.copy(), 1.0)

    @property
    def jacobian(self) -> np.ndarray:
        """J = det F (...)."""
        return 1 + self.volume_change


def stress(material: Material, kinematics: Kinematics, pressure: np.ndarray) -> np.ndarray:
    """First Piola-Kirchhoff stress (3, 3, ...) in MPa. Every J must be positive."""
    volumetric = _slope(material, kinematics, pressure)
    if isinstance(material, Ogden):
        stretches, spatial, reference = principal(kinematics)
        slope = _ogden_derivatives(material, stretches, kinematics.jacobian)[0]
        return _product(spatial * slope, reference.swapaxes(0, 1)) + volumetric * kinematics.cofactor
    scale, growth = _invariant(kinematics)
    factor = 2 * scale * material.slopes(scale * (len(kinematics.gradient) + growth))[0]
    # P = a (F - F : F / (3 J) cof F) + s cof F = a H + (b - a) (cof F - I) + b I with b = s - a (F : F / (3 J) - 1)
    along = volumetric - factor * (growth * ONE_THIRD - kinematics.volume_change) / kinematics.jacobian
    return _plus_identity(factor * kinematics.gradient + (along - factor) * kinematics.cofactor_change, along)


def response(material: Material, kinematics: Kinematics, pressure: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stress (3, 3, ...) and its derivative by F (9, 9, ...), MPa, pressure (...) held fixed.

    Index pairs are flattened as 3 * i + K for component i and reference direction K. Every J must be positive.
    """
    tangent, cofactor = isochoric_tangent(material, kinematics), kinematics.cofactor
    inverse, flat = cofactor / kinematics.jacobian, _flat(cofactor)
    # d cof F / dF = cof F (x) F^-T - swapped(cof F, F^-T)
    turned = _dyad(flat, _flat(inverse)) - _swapped(cofactor, inverse)
    tangent = tangent + _slope(material, kinematics, pressure) * turned
    return stress(material, kinematics, pressure), tangent + 2 * material.shear_modulus * ONE_THIRD * _dyad(flat, flat)


def _slope(material: Material, kinematics: Kinematics, pressure: np.ndarray) -> np.ndarray:
    """Derivative (...) of the volumetric energy by J, MPa."""
    return 2 * material.shear_modulus * ONE_THIRD * kinematics.volume_change - pressure


def isochoric_tangent(material: Material, kinematics: Kinematics) -> np.ndarray:
    """d2W_iso/dF2 (9, 9, ...) of a material, MPa."""
    if isinstance(material, Ogden):
        return _ogden_tangent(material, kinematics)
    return _invariant_tangent(material, kinematics)


def _invariant_tangent(material: FirstInvariantMaterial, kinematics: Kinematics) -> np.ndarray:
    """The derivative of dI/dF = J^(-2/3) (2 F - 2/3 (F : F) F^-T), by the product rule."""
    scale, growth = _invariant(kinematics)
    square = len(kinematics.gradient) + growth
    first, second = material.slopes(scale * square)
    inverse, share = kinematics.cofactor / kinematics.jacobian, 2 * ONE_THIRD * square
    f, g = _flat(kinematics.deformation), _flat(inverse)
    direction, mixed = scale * (2 * f - share * g), _dyad(f, g)
    tangent = 2 * ONE_THIRD * (share * _dyad(g, g) - 2 * (mixed + mixed.swapaxes(0, 1)))
    tangent = _plus_identity(tangent + share * _swapped(inverse, inverse), 2.0)
    return first * scale * tangent + second * _dyad(direction, direction)


def _invariant(kinematics: Kinematics) -> tuple[np.ndarray, np.ndarray]:
    """J^(-2/3) and F : F - 3, of which the first invariant is I = J^(-2/3) F : F."""
    H = kinematics.gradient
    growth = 2 * np.trace(H) + np.einsum("ik...,ik...->...", H, H)
    return kinematics.jacobian ** (-2 * ONE_THIRD), growth


def _ogden_tangent(material: Ogden, kinematics: Kinematics) -> np.ndarray:
    """In principal axes n (x) N the stress is diag(W_i) and the tangent couples ab with ab and ba alone.

    A_abab + A_abba = (W_a - W_b)/(l_a - l_b), A_abab - A_abba = (W_a + W_b)/(l_a + l_b) (Ogden 1997, section 6.1.4).
    """
    stretches, spatial, reference = principal(kinematics)
    slope, hessian, quotient = _ogden_derivatives(material, stretches, kinematics.jacobian)
    total = (slope[:, None] + slope) / (stretches[:, None] + stretches)
    axes, *points = stretches.shape
    local = np.zeros((axes, axes, axes, axes, *points))
    for a, b in np.ndindex(axes, axes):
        local[a, a, b, b] += hessian[a, b]
        if a != b:
            local[a, b, a, b] += (quotient[a, b] + total[a, b]) / 2
            local[a, b, b, a] += (quotient[a, b] - total[a, b]) / 2
    local = local.reshape(axes**2, axes**2, *points)
    # Column 3 a + b of the rotation is n_a (x) N_b
    rotation = np.einsum("ia...,kb...->ikab...", spatial, reference).reshape(local.shape)
    return _product(_product(rotation, local), rotation.swapaxes(0, 1))


def principal(kinematics: Kinematics) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Principal stretches (3, ...), and their spatial and reference axes (3, 3, ...) in columns."""
    H = kinematics.gradient
    strain = H + H.swapaxes(0, 1) + _product(H.swapaxes(0, 1), H)
    values, axes = np.linalg.eigh(np.moveaxis(strain, (0, 1), (-2, -1)))
    stretches, reference = np.sqrt(1 + np.moveaxis(values, -1, 0)), np.moveaxis(axes, (-2, -1), (0, 1))
    return stretches, _product(kinematics.deformation, reference) / stretches, reference


def _ogden_derivatives(material: Ogden, stretches, jacobian):
    """W_i (3, ...), W_ij (3, 3, ...) and the quotient (W_i - W_j)/(l_i - l_j) (3, 3, ...), smooth for equal stretches.

    W = c (J^(-alpha/3) S - 3), c = 2 mu/alpha^2, S = sum l^alpha, so
    W_i = c alpha J^(-alpha/3) (l_i^(alpha-1) - S/(3 l_i)).
    """
    alpha = material.alpha
    scale = 2 * material.mu / alpha * jacobian ** (-alpha * ONE_THIRD)
    powers = stretches**alpha
    mean = powers.sum(axis=0) * ONE_THIRD
    slope = scale * (powers - mean) / stretches
    stretch_i, stretch_j = stretches[:, None], stretches[None]
    both = stretch_i * stretch_j
    hessian = alpha * ONE_THIRD * (mean - powers[:, None] - powers) / both
    hessian = _plus_identity(hessian, ((alpha - 1) * powers + mean) / stretches**2)
    quotient = stretch_j ** (alpha - 2) * _power_quotient((stretch_i - stretch_j) / stretch_j, alpha - 1)
    return slope, scale * hessian, scale * (quotient + mean / both)


def _power_quotient(x, exponent):
    """((1 + x)^exponent - 1) / x; for x = 0 its limit, the exponent."""
    safe = np.where(x == 0, 1.0, x)
    return np.where(x == 0, exponent, np.expm1(exponent * np.log1p(safe)) / safe)


def _plus_identity(tensor, factor):
    """The tensor (k, k, ...) itself, to whose diagonal a factor (...) or (k, ...) is added."""
    diagonal = np.einsum("kk...->k...", tensor)
    diagonal += factor
    return tensor


def _product(a, b):
    return np.einsum("ij...,jk...->ik...", a, b)


def _flat(tensor):
    return tensor.reshape(-1, *tensor.shape[2:])


def _dyad(a, b):
    return a[:, None] * b[None]


def _swapped(a, b):
    """T with T_(iK)(jL) = a_jK b_iL, (9, 9, ...)."""
    pairs = np.einsum("jk...,il...->ikjl...", a, b)
    return pairs.reshape(a.shape[0] ** 2, -1, *a.shape[2:])
