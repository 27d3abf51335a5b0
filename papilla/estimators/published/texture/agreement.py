"""Lin's concordance correlation coefficient with its interval."""

from dataclasses import dataclass

import numpy as np

from papilla import checks
from papilla.errors import InputError


@dataclass(frozen=True)
class Concordance:
    """coefficient : Lin's concordance; low, high : its interval of the stated level; correlation : Pearson's.

    bias : coefficient / correlation, 1 without a difference of mean or scale; count : pairs.
    """

    coefficient: float
    low: float
    high: float
    correlation: float
    bias: float
    count: int


def concordance(first, second, level: float = 0.95) -> Concordance:
    """Concordance of pairs (n,) and (n,), n >= 4: 2 s12 / (s1^2 + s2^2 + (m1 - m2)^2), moments with divisor n.

    Interval by Fisher's transformation (Lin 1989, Biometrics 45:255, doi 10.2307/2532051, with the variance as
    corrected in Biometrics 56:324, 2000). It is asymptotic and holds for many pairs: of the four fabrics of the textile
    paper its formula gives, at best, an interval of 0.78 to 1.00 for 0.985; for fewer than ten pairs the true interval
    is wider. Raises `InputError` for unequal or short columns, values that are not finite, and columns that do not
    change.
    """
    from scipy.stats import norm

    level = checks.within("level", level, 0.5, 0.9999)
    x, y = np.asarray(first, float), np.asarray(second, float)
    if x.ndim != 1 or x.shape != y.shape or x.size < 4:
        raise InputError(f"concordance needs two equal columns of 4 or more values, got {x.shape} and {y.shape}")
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise InputError("concordance needs finite values")
    dx, dy = x - x.mean(), y - y.mean()
    sx, sy = float(np.sqrt(dx @ dx / x.size)), float(np.sqrt(dy @ dy / x.size))
    if not (sx > 0 and sy > 0):
        raise InputError("concordance of a column that does not change is not defined")
    r = float(np.clip(dx @ dy / (x.size * sx * sy), -1, 1))
    shift = float(x.mean() - y.mean())
    bias = 2 * sx * sy / (sx**2 + sy**2 + shift**2)
    c = r * bias
    if 1 - abs(c) < 1e-12:
        return Concordance(c, c, c, r, bias, x.size)
    # The variance of arctanh(c), in a form that also holds at r = 0, where c / r is the bias.
    u2 = shift**2 / (sx * sy)
    room = 1 - c**2
    variance = (
        (1 - r**2) * bias**2 / room + 2 * c**2 * bias * (1 - c) * u2 / room**2 - 0.5 * (c * bias * u2 / room) ** 2
    )
    half = float(norm.ppf(0.5 + 0.5 * level)) * np.sqrt(max(variance, 0.0) / (x.size - 2))
    z = np.arctanh(c)
    return Concordance(c, float(np.tanh(z - half)), float(np.tanh(z + half)), r, bias, x.size)
