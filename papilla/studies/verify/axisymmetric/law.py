"""The reference's own law of a nearly incompressible rubber, for the plane and hoop parts of the displacement gradient.

W = mu / (2 m^2) tr(C^m) - (mu/m + p) ln J - p^2 / (2 lambda) + const, m = 1 neo-Hookean and m = alpha/2 Ogden's with
an even alpha; p is the pressure-like unknown: ln J + p / lambda = 0 holds in the mean. First Piola stress:
P = mu/m F C^(m-1) - (mu/m + p) F^-T. Gradients are held as (r,r), (r,z), (z,r), (z,z), (theta,theta).
"""

from dataclasses import dataclass

import numpy as np

ROW, COLUMN = np.array([0, 0, 1, 1, 2]), np.array([0, 1, 0, 1, 2])
"""Positions of the five entries of a gradient in the axisymmetric 3 x 3 matrix."""
ENTRIES = len(ROW)


@dataclass(frozen=True)
class Rubber:
    """Young's `modulus` (MPa) and Poisson's ratio of small strain; `linear` restricts it to small strain.

    half_alpha : half of Ogden's exponent, 1 for neo-Hookean. A modulus of infinity is a rigid body.
    """

    modulus: float
    nu: float = 0.4999
    linear: bool = False
    half_alpha: int = 1

    @property
    def shear_modulus(self) -> float:
        """mu in MPa."""
        return self.modulus / (2 * (1 + self.nu))

    @property
    def compressibility(self) -> float:
        """1/lambda in 1/MPa."""
        return (1 + self.nu) * (1 - 2 * self.nu) / (self.modulus * self.nu)

    def response(self, gradient: np.ndarray, pressure: np.ndarray) -> tuple[np.ndarray, ...]:
        """Stress (..., 5), its derivative (..., 5, 5) by the gradient, ln J (...), and its derivative (..., 5).

        gradient : of the displacement (..., 5); pressure (...) in MPa. The stress's derivative by the pressure is less
        the derivative of ln J. Raises `FloatingPointError` where J is not positive.
        """
        mu, small = self.shear_modulus, _matrix(gradient)
        unit, transposed = np.eye(3), np.equal.outer(ROW, COLUMN) & np.equal.outer(COLUMN, ROW)
        if self.linear:
            stress = mu * (small + small.swapaxes(-1, -2)) - pressure[..., None, None] * unit
            tangent = np.broadcast_to(mu * (np.eye(ENTRIES) + transposed), (*pressure.shape, ENTRIES, ENTRIES))
            slope = np.broadcast_to(unit[ROW, COLUMN], gradient.shape)
            return stress[..., ROW, COLUMN], tangent, small.trace(axis1=-2, axis2=-1), slope
        whole = small + unit
        jacobian = np.linalg.det(whole)
        if not (jacobian > 0).all():
            raise FloatingPointError("a cell is turned inside out")
        inverse = np.linalg.inv(whole).swapaxes(-1, -2)
        power, by = self._power(whole)
        share = mu / self.half_alpha
        stress = share * power - (share + pressure)[..., None, None] * inverse
        turned = inverse[..., ROW[:, None], COLUMN] * inverse[..., ROW, COLUMN[:, None]]
        tangent = share * by + (share + pressure)[..., None, None] * turned
        return stress[..., ROW, COLUMN], tangent, np.log(jacobian), inverse[..., ROW, COLUMN]

    def _power(self, whole: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """F C^(m-1) (..., 3, 3), and its derivative (..., 5, 5) by F."""
        value, by = whole, np.broadcast_to(np.eye(ENTRIES), (*whole.shape[:-2], ENTRIES, ENTRIES))
        directions = np.zeros((ENTRIES, 3, 3))
        directions[np.arange(ENTRIES), ROW, COLUMN] = 1
        slopes = np.broadcast_to(directions, (*whole.shape[:-2], ENTRIES, 3, 3))
        right = whole.swapaxes(-1, -2) @ whole
        for _ in range(self.half_alpha - 1):
            change = directions.swapaxes(-1, -2) @ whole[..., None, :, :]
            change = change + change.swapaxes(-1, -2)
            slopes = slopes @ right[..., None, :, :] + value[..., None, :, :] @ change
            value, by = value @ right, slopes[..., ROW, COLUMN].swapaxes(-1, -2)
        return value, by


def _matrix(entries: np.ndarray) -> np.ndarray:
    """(..., 3, 3) of five entries."""
    whole = np.zeros((*entries.shape[:-1], 3, 3))
    whole[..., ROW, COLUMN] = entries
    return whole
