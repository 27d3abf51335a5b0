"""What a contact beside the apex changes in the gauges' readings: optional part of a calibration.

At the apex the gauges' own surfaces hold; a contact x further along the finger adds force * change(force, modulus, x),
a tricubic spline that is zero at x = 0. Its cells are few: a contact is displaced, hardly deformed.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from papilla.calibration.surface import POWERS, Axis
from papilla.errors import InputError


@dataclass(frozen=True, eq=False)
class PositionTerms:
    """Change of readings per newton over (ln force, ln modulus, x); m, n and k uniform cells, g gauges.

    Parameters
    ----------
    force_N, modulus_MPa : (low, high) of the domain; reach_mm : |x| up to which it holds, mm.
    coefficients : (g, m + 3, n + 3, k + 3) B-spline coefficients, microstrain / N.
    error : (g, k + 1) standard deviation of the change at the nodes of x, microstrain / N, linear in between.

    Raises `InputError` for shapes that do not fit, or values that are not finite.
    """

    force_N: tuple[float, float]
    modulus_MPa: tuple[float, float]
    reach_mm: float
    coefficients: np.ndarray
    error: np.ndarray

    def __post_init__(self):
        if not 0 < self.reach_mm < math.inf:
            raise InputError(f"the reach of contact positions (mm) must be greater than 0, got {self.reach_mm:g}")
        shape = self.coefficients.shape
        if len(shape) != 4 or min(shape[1:]) < 4:
            raise InputError(f"contact positions need at least 4 x 4 x 4 coefficients a gauge, got {shape}")
        if self.error.shape != (shape[0], shape[3] - 2) or not (self.error >= 0).all():
            raise InputError(f"contact positions need {shape[0]} x {shape[3] - 2} errors of at least 0")
        if not (np.isfinite(self.coefficients).all() and np.isfinite(self.error).all()):
            raise InputError("the coefficients and errors of contact positions must be finite")

    @property
    def cells(self) -> tuple[int, int, int]:
        """Number of cells over force, over modulus and over x."""
        _, m, n, k = self.coefficients.shape
        return m - 3, n - 3, k - 3

    @cached_property
    def force_axis(self) -> Axis:
        """The uniform cells over ln force."""
        return Axis.between(*self.force_N, self.cells[0])

    @cached_property
    def modulus_axis(self) -> Axis:
        """The uniform cells over ln modulus."""
        return Axis.between(*self.modulus_MPa, self.cells[1])

    @property
    def step_mm(self) -> float:
        """Width of a cell of x."""
        return 2 * self.reach_mm / self.cells[2]

    @cached_property
    def polynomials(self) -> np.ndarray:
        """(m, n, k, g, 4, 4, 4) powers of the places in a cell over force, modulus and x (0 to 1 each)."""
        windows = np.lib.stride_tricks.sliding_window_view(self.coefficients, (4, 4, 4), axis=(1, 2, 3))
        return np.einsum("pa,gijkpqr,qb,rc->ijkgabc", POWERS, windows, POWERS, POWERS)

    def change(self, force_N, modulus_MPa, position_mm) -> np.ndarray:
        """(..., g) change in microstrain / N at forces, moduli and positions that broadcast; NaN outside the domain."""
        force, modulus, position = np.broadcast_arrays(
            *(np.asarray(value, float) for value in (force_N, modulus_MPa, position_mm))
        )
        inside_x = np.abs(position) <= self.reach_mm
        place = (np.where(inside_x, position, 0.0) + self.reach_mm) / self.step_mm
        cell = np.clip(place.astype(int), 0, self.cells[2] - 1)
        i, t, inside_force = self.force_axis.locate(force)
        j, u, inside_modulus = self.modulus_axis.locate(modulus)
        powers = [np.stack([np.ones_like(v), v, v * v, v**3], axis=-1) for v in (t, u, place - cell)]
        value = np.einsum("...gabc,...a,...b,...c->...g", self.polynomials[i, j, cell], *powers)
        return np.where((inside_force & inside_modulus & inside_x)[..., None], value, np.nan)
