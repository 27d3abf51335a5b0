"""The unit contract: mm, N, MPa, s inside and at the API; strain is dimensionless inside, microstrain in reports.

Gram-force appears only in the published regression (2006, eqs. 9 and 10), and there by name.
"""

import warnings
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np

Number = TypeVar("Number", float, "np.ndarray")

GRAM_FORCE_N = 9.80665e-3
"""One gram-force in newton (standard gravity, exact)."""

STRAIN_PER_MICROSTRAIN = 1e-6
"""One microstrain as a dimensionless strain."""

MICROSTRAIN_PER_STRAIN = 1e6
"""One in microstrain; a product with it may differ in the last digit from a quotient by `STRAIN_PER_MICROSTRAIN`."""

PER_CENT = 100.0
"""One in per cent."""

MS_PER_S, US_PER_S, NS_PER_S = 1e3, 1e6, 10**9
S_PER_MS, S_PER_NS, MS_PER_NS = 1e-3, 1e-9, 1e-6
UM_PER_MM, KPA_PER_MPA = 1e3, 1e3
SI_MILLI, SI_MICRO, SI_NANO, SI_KILO, SI_MEGA = 1e-3, 1e-6, 1e-9, 1e3, 1e6
"""Prefixes of the SI, for tables of units."""
S_PER_MIN, S_PER_H = 60.0, 3600.0
MM_PER_CM = 10.0
"""One centimetre in mm."""
SAMPLE_RATE_HZ = 1000.0
"""Samples a second of readings whose rate is not stated, as in Okamoto et al. 2011, section 3."""
N_PER_MN = 1e-3
"""N of one mN."""

T_MM3_PER_G_CM3 = 1e-9
"""One g/cm3 in t/mm3, the density that is consistent with N, mm and s."""

TINY_DIVISOR = 1e-300
"""Replaces zero as a divisor or under a logarithm: far below every measured value in these units, and its reciprocal is
finite."""

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
    return strain / STRAIN_PER_MICROSTRAIN


_FORMER = {"MS": "MS_PER_S", "UM": "UM_PER_MM", "KPA": "KPA_PER_MPA"}
"""Names until 0.2.0, and what they are called now."""


def __getattr__(name: str) -> float:
    if name not in _FORMER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    warnings.warn(f"papilla.core.units.{name} is now {_FORMER[name]}", DeprecationWarning, stacklevel=2)
    return float(globals()[_FORMER[name]])
