"""Relaxing silicone: Prony series against quadrature."""

import numpy as np
import pytest
from scipy.integrate import quad

from papilla.core.errors import InputError
from papilla.references import Prony


@pytest.mark.parametrize("prony", [Prony((0.3,), (2.0,)), Prony((0.2, 0.25), (0.5, 10.0)), Prony((), ())])
def test_creep_undoes_relaxation(prony):
    """The integral of J(t - s) E(s) is t (Ferry, Viscoelastic Properties of Polymers, chapter 3)."""
    for t in (0.3, 2.0, 30.0):
        total = quad(lambda s, t=t: float(prony.creep(t - s) * prony.relaxation(s)), 0, t, epsabs=1e-12, limit=200)[0]
        assert total == pytest.approx(t, rel=1e-8)
    assert prony.relaxation(0) == prony.creep(0) == 1
    assert prony.creep(1e6) == pytest.approx(1 / prony.relaxation(1e6))
    time = np.linspace(0, 8, 4001)
    strain = 0.3 + np.sin(time) ** 2
    assert prony.strained(time, prony.stressed(time, strain)) == pytest.approx(strain, abs=1e-5)


@pytest.mark.parametrize(
    "shares, times, message",
    [
        ((0.5, 0.5), (1, 2), "sum to less than 1, got 1"),
        ((0.1, 0.1), (1, 1), "times must differ, got 1, 1 s"),
        ((0.1,), (0,), r"relaxation time \(s\) must be greater than 0"),
    ],
)
def test_series_that_are_none(shares, times, message):
    with pytest.raises(InputError, match=message):
        Prony(shares, times)
