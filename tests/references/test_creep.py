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


def test_histories_of_steps_and_ramps_are_the_integrals_of_creep_and_relaxation():
    """A step at the first time gives creep or relaxation; a ramp their integrals; a long sine the loss factor."""
    prony, start = Prony((0.2, 0.25), (0.5, 10.0)), 1.7
    time = start + np.array([0.0, 0.1, 0.4, 1.0, 2.5, 7.0, 30.0])
    for history, memory in ((prony.stressed, prony.relaxation), (prony.strained, prony.creep)):
        assert history(time, np.full(7, 3.0)) == pytest.approx(3 * memory(time - start), rel=1e-12)
        ramp = [quad(lambda t, memory=memory: float(memory(t)), 0, end)[0] for end in time - start]
        assert history(time, 2 * (time - start)) == pytest.approx(2 * np.array(ramp), rel=1e-9)
    omega, time = 1.3, np.linspace(0, 120, 24001)
    late = time > 100
    waves = np.column_stack([np.sin(omega * time), np.cos(omega * time)])[late]
    stored, lost = np.linalg.lstsq(waves, prony.stressed(time, np.sin(omega * time))[late], rcond=None)[0]
    assert prony.loss_factor([omega, 1e9]) == pytest.approx([lost / stored, 0], abs=1e-4)


@pytest.mark.parametrize(
    "time, values", [([0, 1], [1]), ([0, 1, 1], [1, 1, 1]), ([0, 2, 1], [1, 1, 1]), ([[0]], [[1]])]
)
def test_histories_that_are_none(time, values):
    with pytest.raises(InputError, match="as many values as times, and times that rise"):
        Prony((0.3,), (2.0,)).stressed(time, values)


@pytest.mark.parametrize(
    "shares, times, message",
    [
        ((0.5, 0.5), (1, 2), "sum to less than 1, got 1"),
        ((0.1, 0.1), (1, 1), "times must differ, got 1, 1 s"),
        ((0.1, 0.2), (1,), "2 shares of relaxation and 1 times"),
        ((0.0,), (1,), "relaxation share must be greater than 0"),
        ((0.1,), (0,), r"relaxation time \(s\) must be greater than 0"),
    ],
)
def test_series_that_are_none(shares, times, message):
    with pytest.raises(InputError, match=message):
        Prony(shares, times)
