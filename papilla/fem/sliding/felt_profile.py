"""A texture as the skin's nodes feel it: its recess averaged over each node's hat function (the weak gap)."""

from dataclasses import dataclass

import numpy as np

from papilla.textures import Texture

POINTS, KNOTS = 120, 25
"""Points of an average, and knots of the table a hat's width."""

FAR_MM = 1e3
"""Beyond the ends of a texture there is nothing to touch."""


@dataclass(frozen=True, eq=False)
class FeltProfile:
    """Tables of averaged recesses, one for each kind of hat.

    kinds : (n,) table of each node. knots : (t,) places in mm; values : (kinds, t). period : mm, 0 where there is none.
    """

    kinds: np.ndarray
    start: float
    step: float
    values: np.ndarray
    period: float
    span: tuple[float, float]

    @classmethod
    def of(cls, texture: Texture, hats: np.ndarray) -> "FeltProfile":
        """The tables of hats (n, 2) with the given widths to the left and to the right."""
        shapes, kinds = np.unique(hats.round(9), axis=0, return_inverse=True)
        fine, widest = float(hats[hats > 0].min()) / KNOTS, float(hats.max())
        period = texture.wavelength or 0.0
        if period:
            start, length = 0.0, period
        else:
            low, high = texture.span
            start, length = (low - 2 * widest, high - low + 4 * widest) if np.isfinite(low) else (0.0, fine)
        count = max(2, int(np.ceil(length / fine)))
        knots = start + length / count * np.arange(count + 1)
        values = np.empty((len(shapes), len(knots)))
        middles = (np.arange(POINTS) + 0.5) / POINTS
        for row, (left, right) in zip(values, shapes, strict=True):
            offsets = -left + (left + right) * middles
            weight = np.where(offsets < 0, 1 + offsets / (left or 1.0), 1 - offsets / (right or 1.0))
            row[:] = sum(
                w * _inside(texture, knots + offset) for w, offset in zip(weight / weight.sum(), offsets, strict=True)
            )
        return cls(kinds.ravel(), start, length / count, values, period, texture.span)

    def recess(self, x: np.ndarray) -> np.ndarray:
        """Averaged recess (n,) under nodes at x (n,) of the texture."""
        place = (x % self.period if self.period else x - self.start) / self.step
        place = np.clip(place, 0.0, self.values.shape[1] - 1.000001)
        below = place.astype(np.int64)
        share = place - below
        return (1 - share) * self.values[self.kinds, below] + share * self.values[self.kinds, below + 1]


def _inside(texture: Texture, x: np.ndarray) -> np.ndarray:
    low, high = texture.span
    return np.where((x >= low) & (x <= high), texture.recess(x), FAR_MM)
