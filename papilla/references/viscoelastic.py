"""Viscoelastic silicone: Prony series (MPa, s).

The strain under a history of stress also gives the force of an elastic contact with the same area. Lee and Radok, The
contact problem for viscoelastic bodies, J. Appl. Mech. 27 (1960), doi:10.1115/1.3644020: while the contact grows, the
elastic solution holds if each product with the modulus becomes a convolution over the history.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from papilla.core import checks
from papilla.core.errors import InputError


@dataclass(frozen=True)
class Prony:
    """Relaxation of a modulus after a step of strain: E(t) / E(0) = 1 - sum g (1 - exp(-t / tau)).

    shares : the g, each > 0, their sum below 1. times_s : the tau, all different. Two empty tuples mean no relaxation.
    Raises `InputError` for other values.
    """

    shares: tuple[float, ...]
    times_s: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.shares) != len(self.times_s):
            raise InputError(f"{len(self.shares)} shares of relaxation and {len(self.times_s)} times: expected as many")
        for share, time in zip(self.shares, self.times_s, strict=True):
            checks.positive("relaxation share", share)
            checks.positive("relaxation time (s)", time)
        if sum(self.shares) >= 1:
            raise InputError(f"relaxation shares must sum to less than 1, got {sum(self.shares):g}")
        if len(set(self.times_s)) != len(self.times_s):
            raise InputError(
                f"relaxation times must differ, got {', '.join(f'{time_s:g}' for time_s in self.times_s)} s"
            )

    def relaxation(self, time_s: ArrayLike) -> np.ndarray:
        """E(t) / E(0) at times (...) >= 0 after a step of strain."""
        decayed = (share * -np.expm1(-np.asarray(time_s) / tau) for share, tau in self._terms)
        return np.asarray(1.0 - sum(decayed, start=np.zeros(np.shape(time_s))))

    def creep(self, time_s: ArrayLike) -> np.ndarray:
        """E(0) J(t) at times (...) >= 0 after a step of stress: the strain over the immediate strain."""
        grown = (share * -np.expm1(-np.asarray(time_s) / tau) for share, tau in self.retardation)
        return np.asarray(1.0 + sum(grown, start=np.zeros(np.shape(time_s))))

    @cached_property
    def retardation(self) -> tuple[tuple[float, float], ...]:
        """Pairs (c, lambda in s) of E(0) J(t) = 1 + sum c (1 - exp(-t / lambda)).

        The Laplace transform of J is 1 / (s^2 E(s)), so s = -1 / lambda are the zeros of
        s E(s) / E(0) = 1 - sum g / (1 + s tau).
        """
        if not self.shares:
            return ()
        factors = [np.poly1d([tau, 1.0]) for _, tau in self._terms]
        product = math.prod(factors[1:], start=factors[0])
        zeros = product
        for k, (share, _) in enumerate(self._terms):
            others = factors[:k] + factors[k + 1 :]
            zeros = zeros - share * math.prod(others, start=np.poly1d([1.0]))
        pairs = []
        for zero in np.sort(zeros.roots.real):
            slope = sum(share * tau / (1 + zero * tau) ** 2 for share, tau in self._terms)
            pairs.append((float(-1 / (zero * slope)), float(-1 / zero)))
        return tuple(pairs)

    def loss_factor(self, omega: ArrayLike) -> np.ndarray:
        """E'' / E' at angular frequencies w (...) in rad/s: E(w) / E(0) = 1 - sum g / (1 + i w tau)."""
        turns = np.asarray(omega, float)
        relaxed = (share / (1 + 1j * turns * tau) for share, tau in self._terms)
        modulus = 1 - sum(relaxed, start=np.zeros(turns.shape, complex))
        return np.asarray(modulus.imag / modulus.real)

    def strained(self, time_s: ArrayLike, stress: ArrayLike) -> np.ndarray:
        """E(0) times the strain (n,) under a history of stress (n,), which is linear between the times (n,).

        The stress starts with a step at the first time.
        """
        return _history(time_s, stress, [(-share, tau) for share, tau in self.retardation])

    def stressed(self, time_s: ArrayLike, strain: ArrayLike) -> np.ndarray:
        """Stress (n,) over E(0) under a history of strain (n,), which is linear between the times (n,)."""
        return _history(time_s, strain, self._terms)

    @property
    def _terms(self) -> list[tuple[float, float]]:
        return list(zip(self.shares, self.times_s, strict=True))


def _history(time_s: ArrayLike, values: ArrayLike, terms: list[tuple[float, float]]) -> np.ndarray:
    """int K(t - s) dv(s) at each time, with K(t) = 1 - sum a (1 - exp(-t / tau)) and v linear between the times."""
    time, value = np.asarray(time_s, float), np.asarray(values, float)
    if time.shape != value.shape or time.ndim != 1 or not (np.diff(time) > 0).all():
        raise InputError("a history needs as many values as times, and times that rise")
    response = value.copy()
    for share, tau in terms:
        memory = np.empty_like(value)
        memory[0] = value[0]
        for k, step in enumerate(np.diff(time)):
            decay = -np.expm1(-step / tau)
            memory[k + 1] = memory[k] * (1 - decay) + (value[k + 1] - value[k]) * tau / step * decay
        response -= share * (value - memory)
    return response
