"""The commanded contact area of a softness display: that of the finger at this force on this modulus.

People judge softness by the growth of the contact area with the force, so a display can present a modulus by the area
under the operator's finger.
"""

import math
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from papilla.errors import FileFormatError, InputError
from papilla.tables import TableReader

AREA_SIGMA = 0.01
"""Relative standard deviation of an area by the mesh: README, areas of six meshes against axisymmetric rings."""
COLUMNS = ("force_N", "modulus_MPa", "contact_area_mm2")


@dataclass(frozen=True, eq=False)
class ContactArea:
    """Contact area over force and modulus, interpolated linearly in the logarithms of all three; NaN outside.

    Parameters
    ----------
    force_N (m,), modulus_MPa (k,) : rising. area_mm2 : (k, m), NaN if there is none.

    Raises `InputError` for other shapes, axes that do not rise, and fewer than two values of either.
    """

    force_N: np.ndarray
    modulus_MPa: np.ndarray
    area_mm2: np.ndarray

    def __post_init__(self):
        for name in ("force_N", "modulus_MPa"):
            axis = getattr(self, name)
            if axis.ndim != 1 or axis.size < 2 or not (axis[0] > 0 and (np.diff(axis) > 0).all()):
                raise InputError(f"{name} must be two or more positive numbers that rise")
        if self.area_mm2.shape != (self.modulus_MPa.size, self.force_N.size):
            raise InputError(f"area_mm2 must be moduli x forces, got {self.area_mm2.shape}")

    @classmethod
    def of_presses(cls, force_N: ArrayLike, modulus_MPa: ArrayLike, area_mm2: ArrayLike) -> "ContactArea":
        """From presses (n,) on a grid of forces and moduli, in any order, as in a sweep."""
        force, modulus, area = (np.asarray(values, float) for values in (force_N, modulus_MPa, area_mm2))
        forces, moduli = np.unique(force), np.unique(modulus)
        table = np.full((moduli.size, forces.size), math.nan)
        table[np.searchsorted(moduli, modulus), np.searchsorted(forces, force)] = np.where(area > 0, area, math.nan)
        return cls(forces, moduli, table)

    @classmethod
    def load(cls, path: str | PathLike) -> "ContactArea":
        """From the sweep.csv of `papilla calibrate`; raises `FileAccessError` and `FileFormatError`."""
        with TableReader(Path(path), lambda name: name in COLUMNS) as reader:
            table = reader.whole()
        if missing := [name for name in COLUMNS if name not in table.columns]:
            raise FileFormatError(
                f"{path}: no column {', '.join(missing)}: it must be a sweep.csv of papilla calibrate"
            )
        try:
            return cls.of_presses(*(table.columns[name] for name in COLUMNS))
        except InputError as error:
            raise FileFormatError(f"{path}: {error}") from error

    def __call__(self, force_N: float, modulus_MPa: float, modulus_sigma_MPa: float = 0.0) -> tuple[float, float]:
        """(area, its standard deviation) in mm2; NaN outside the table or if force or modulus are not known."""
        (column, along), (row, across) = _cell(self.force_N, force_N), _cell(self.modulus_MPa, modulus_MPa)
        if math.isnan(along + across):
            return math.nan, math.nan
        (a, b), (c, d) = np.log(self.area_mm2[row : row + 2, column : column + 2]).tolist()
        low, high = a + along * (b - a), c + along * (d - c)
        area = math.exp(low + across * (high - low))
        # The error of the modulus acts on the area by d ln A / d ln E.
        slope = (high - low) / math.log(self.modulus_MPa[row + 1] / self.modulus_MPa[row])
        sigma = math.hypot(AREA_SIGMA, slope * modulus_sigma_MPa / modulus_MPa)
        return area, area * sigma


def _cell(axis: np.ndarray, value: float) -> tuple[int, float]:
    """Interval of a rising axis, and the share of its logarithm that lies below the value; NaN outside the axis."""
    if not axis[0] <= value <= axis[-1]:
        return 0, math.nan
    number = min(int(np.searchsorted(axis, value, side="right")) - 1, axis.size - 2)
    return number, math.log(value / axis[number]) / math.log(axis[number + 1] / axis[number])
