"""A texture as the skin's nodes feel it: its recess averaged over each node's hat function (the weak gap).

Contact is solved with weak gaps, so node i does not feel the texture's recess r at its place x, but

  r_i(x) = integral of hat_i(s) r(x + s) ds / integral of hat_i(s) ds.

This mean is tabulated over x once for each kind of hat (width to the left, width to the right), and then interpolated
linearly. Example: hats of 0.4 mm to both sides over a sine grating of 1.8 mm wavelength reduce its amplitude to [sin(u)
/ u]^2 = 0.85, with u = pi 0.4 / 1.8. The table fails for gratings that the hats do not resolve; these are refused.
"""

from dataclasses import dataclass

import numpy as np

from papilla.core.errors import InputError
from papilla.model.textures import Texture

AVERAGE_POINTS, KNOTS_A_HAT, MOST_KNOTS = 120, 25, 1_000_000
"""Number of points of an average, number of knots of the table per hat width, and largest number of knots of a
table."""

COARSEST_GRATING_ELEMENTS = 2.0
"""Smallest wavelength in elements of a grating that is resolved."""

FAR_MM = 1e3
"""Recess (mm) beyond the ends of a texture: there is nothing to touch."""


@dataclass(frozen=True, eq=False)
class FeltProfile:
    """The recess of a texture, averaged over the nodes' hat functions: one table for each pair of widths of a hat.

    kinds : (n,) number of the table of each node. start, step : first place of the tables and distance of their places,
    mm. values : (tables, places) mean recess, mm. period : of the texture, mm; 0 if there is none. span : first and
    last place of the texture, mm.
    """

    kinds: np.ndarray
    start: float
    step: float
    values: np.ndarray
    period: float
    span: tuple[float, float]

    @classmethod
    def of(cls, texture: Texture, hats: np.ndarray, reach: tuple[float, float]) -> "FeltProfile":
        """The tables of hats (n, 2) with the given widths to the left and to the right, for places within `reach` (mm).

        Raises `InputError` for a period that the hats do not resolve, and for a table of more than `MOST_KNOTS`.
        """
        shapes, kinds = np.unique(hats.round(9), axis=0, return_inverse=True)
        fine, widest = float(hats[hats > 0].min()) / KNOTS_A_HAT, float(hats.max())
        period = texture.wavelength or 0.0
        if period and period < COARSEST_GRATING_ELEMENTS * widest * (1 + 1e-6):
            raise InputError(
                f"wavelength {period:g} mm is not resolved by the skin's elements of {widest:.2g} mm: "
                f"more than {COARSEST_GRATING_ELEMENTS * widest:.4g} mm are"
            )
        if period and period < reach[1] - reach[0]:
            start, length = 0.0, period
        else:
            period = 0.0
            low, high = (max(texture.span[0] - 2 * widest, reach[0]), min(texture.span[1] + 2 * widest, reach[1]))
            start, length = low, max(high - low, fine)
        count = max(2, int(np.ceil(length / fine)))
        if count > MOST_KNOTS:
            raise InputError(f"{length:g} mm of texture are too long for elements of {widest:.2g} mm: slide less far")
        knots = start + length / count * np.arange(count + 1)
        values = np.empty((len(shapes), len(knots)))
        middles = (np.arange(AVERAGE_POINTS) + 0.5) / AVERAGE_POINTS
        for averages, (width_left, width_right) in zip(values, shapes, strict=True):
            offsets = -width_left + (width_left + width_right) * middles
            weight = np.where(offsets < 0, 1 + offsets / (width_left or 1.0), 1 - offsets / (width_right or 1.0))
            averages[:] = sum(
                w * _inside(texture, knots + offset) for w, offset in zip(weight / weight.sum(), offsets, strict=True)
            )
        return cls(kinds.ravel(), start, length / count, values, period, texture.span)

    def recess(self, x: np.ndarray) -> np.ndarray:
        """Averaged recess (n,) under nodes at the places x (n,) on the texture."""
        place = (x % self.period if self.period else x - self.start) / self.step
        place = np.clip(place, 0.0, self.values.shape[1] - 1.000001)
        below = place.astype(np.int64)
        share = place - below
        return (1 - share) * self.values[self.kinds, below] + share * self.values[self.kinds, below + 1]


def _inside(texture: Texture, x: np.ndarray) -> np.ndarray:
    low, high = texture.span
    return np.where((x >= low) & (x <= high), texture.recess(x), FAR_MM)
