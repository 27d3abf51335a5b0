"""Chebyshev polynomials in the logarithms of several variables, as terms to fit and to evaluate with derivatives.

Trefethen, Approximation Theory and Approximation Practice (SIAM 2019), chapters 7 and 8.
"""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product

import numpy as np
from numpy.polynomial.chebyshev import chebder, chebvander


@dataclass(frozen=True)
class LogPolynomial:
    """Products of Chebyshev polynomials in ln of v variables; m terms.

    limits : (v) lowest and highest value of each. degrees : (v) largest power of each. total : largest sum of a term's
    shares of these.
    """

    limits: tuple[tuple[float, float], ...]
    degrees: tuple[int, ...]
    total: float

    @cached_property
    def powers(self) -> np.ndarray:
        """(m, v) of each term."""
        every = product(*(range(degree + 1) for degree in self.degrees))
        shares = ((powers, sum(p / d for p, d in zip(powers, self.degrees, strict=True))) for powers in every)
        return np.array([powers for powers, share in shares if share <= self.total])

    def terms(self, values: tuple[np.ndarray, ...]) -> np.ndarray:
        """(1 + v, n, m) terms at values (n,) of each variable, and their derivatives by its logarithm.

        Beyond the limits they go on as their derivatives there say.
        """
        at, beyond = zip(*(_scaled(one, ends) for one, ends in zip(values, self.limits, strict=True)), strict=True)
        bases = [chebvander(one, degree) for one, degree in zip(at, self.degrees, strict=True)]
        found = [self._product(bases)]
        for axis, (low, high) in enumerate(self.limits):
            steeper = [*bases]
            steeper[axis] = bases[axis] @ _derivative(self.degrees[axis]) * (2 / math.log(high / low))
            found.append(self._product(steeper))
        found[0] = found[0] + sum(over[:, None] * slope for over, slope in zip(beyond, found[1:], strict=True))
        return np.array(found)

    def _product(self, bases: list[np.ndarray]) -> np.ndarray:
        columns = [basis[:, powers] for basis, powers in zip(bases, self.powers.T, strict=True)]
        return np.prod(columns, axis=0)


def _scaled(values: np.ndarray, limits: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,) from -1 to 1 of values between the limits, and how far their logarithms lie beyond the limits."""
    low, high = math.log(limits[0]), math.log(limits[1])
    at = np.log(values)
    held = np.clip(at, low, high)
    return 2 * (held - low) / (high - low) - 1, at - held


@lru_cache
def _derivative(degree: int) -> np.ndarray:
    """Matrix (degree + 1, degree + 1) that maps Chebyshev coefficients to those of the derivative."""
    found = np.zeros((degree + 1, degree + 1))
    for k in range(1, degree + 1):
        found[:k, k] = chebder(np.eye(degree + 1)[k])[:k]
    return found
