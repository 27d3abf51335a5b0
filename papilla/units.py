"""The unit contract: mm, N, MPa, s inside and at the API; strain is dimensionless inside, microstrain in reports.

Gram-force appears only in the published regression (2006, eqs. 9 and 10), and there by name.
"""

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np

Number = TypeVar("Number", float, "np.ndarray")

GRAM_FORCE_N = 9.80665e-3
"""One gram-force in newton (standard gravity, exact)."""

MICROSTRAIN = 1e-6
"""One microstrain as a dimensionless strain."""

PER_CENT = 100.0
"""One in per cent."""

MS, UM, KPA = 1000.0, 1000.0, 1000.0
"""One second in ms, one mm in micrometres, one MPa in kPa."""

INCH_MM = 25.4
"""One inch in mm (exact)."""


def newton_to_gf(force_N: Number) -> Number:
    """Force in gram-force of a force in newton (scalar or array)."""
    return force_N / GRAM_FORCE_N


def gf_to_newton(force_gf: Number) -> Number:
    """Force in newton of a force in gram-force (scalar or array)."""
    return force_gf * GRAM_FORCE_N


def to_microstrain(strain: Number) -> Number:
    """Microstrain of a dimensionless strain (scalar or array)."""
    return strain / MICROSTRAIN
