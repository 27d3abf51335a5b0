"""`FingerScale`: how large and how hard a finger is, relative to the default one.

Strains of fingers of one form depend on F / (E_inner H^2) and E / E_inner alone, so forces and moduli that suit the
default finger suit another one after multiplication by these factors. H is `narrowest_mm`.
"""

import math
from dataclasses import dataclass

from papilla.mesh.body import narrowest_mm
from papilla.model.finger import Finger

DEFAULT_NARROWEST_MM, DEFAULT_INNER_MPA = 20.0, 0.034
"""`narrowest_mm` of the default finger, and the modulus of its inner layer."""

ROUND_FACTORS = (1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0)
"""Factors of `FingerScale.rounded` within a decade; their neighbours differ by a factor of 1.3 to 1.7."""


@dataclass(frozen=True)
class FingerScale:
    """Factors from the default finger to another one: of lengths, and of moduli."""

    length: float = 1.0
    modulus: float = 1.0

    @classmethod
    def of(cls, finger: Finger) -> "FingerScale":
        """The scale of a finger; raises what `narrowest_mm` raises."""
        return cls(narrowest_mm(finger) / DEFAULT_NARROWEST_MM, finger.inner.modulus / DEFAULT_INNER_MPA)

    @property
    def area(self) -> float:
        """Factor of areas."""
        return self.length**2

    @property
    def force(self) -> float:
        """Factor of forces at equal strain."""
        return self.modulus * self.area


def rounded(factor: float) -> float:
    """The round factor nearest to a positive one: 1, 1.5, 2, 3, 5 or 7, times a power of ten.

    Ranges are multiplied by it, so that they are round numbers, and so that fingers of one size whose silicones differ
    by a batch, a finger and what was identified of it among them, have the same ranges.
    """
    decade = 10.0 ** math.floor(math.log10(factor))
    nearest = min(ROUND_FACTORS, key=lambda step: abs(math.log(factor / decade / step)))
    return float(f"{nearest * decade:.2g}")
