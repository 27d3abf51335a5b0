"""The contact step against closed forms of the half-plane, and against a second solver on the same matrices."""

import numpy as np
import pytest
from scipy.optimize import brentq

from papilla.fem.sliding.coulomb import OPEN_NODE, SLIPS_RIGHT, STICKING_NODE, Laws, relax, rub

E_STAR = 0.1


def half_plane(x):
    """Displacement (n, n) of hat loads on an incompressible half-plane, up to a constant: -2/(pi E*) ln|x| averaged."""
    h = x[1] - x[0]
    lags = np.arange(len(x)) * h

    def primitive(s):
        # Twice integrated ln|s|, and twice more: what two hat functions see of each other is a fourth difference of it
        s = np.abs(s)
        return np.where(s > 0, s**4 / 24 * (np.log(np.where(s > 0, s, 1.0)) - 25 / 12), 0.0)

    weights, shifts = [1, -4, 6, -4, 1], [-2, -1, 0, 1, 2]
    mean = sum(w * primitive(lags + s * h) for w, s in zip(weights, shifts, strict=True)) / h**4
    kernel = -2 / (np.pi * E_STAR) * (mean - np.log(100.0))
    return kernel[np.abs(np.subtract.outer(np.arange(len(x)), np.arange(len(x))))]


def uncoupled(normal):
    zero = np.zeros_like(normal)
    return np.block([[normal, zero], [zero, normal]])


def laws(C, rise, **given):
    n = len(rise)
    given = {"old": np.zeros(n), "drift": 0.0, "friction": 0.0, "free": np.zeros(2 * n), **given}
    return Laws(C, rise, **given)


def test_a_sinusoidal_indenter_is_westergaards():
    n, period, amplitude, share = 256, 1.8, 0.02, 0.4
    x = period * np.arange(n) / n
    q = 2 * np.pi * np.abs(np.fft.fftfreq(n, period / n))
    spectrum = np.divide(2.0, E_STAR * q, out=np.zeros(n), where=q > 0)
    kernel = np.fft.ifft(spectrum).real / (period / n)
    C = kernel[np.subtract.outer(np.arange(n), np.arange(n)) % n] + 1.0
    mean = np.pi * E_STAR * amplitude / period * np.sin(np.pi * share / 2) ** 2
    rise = amplitude * (1 - np.cos(2 * np.pi * x / period))
    found = rub(laws(uncoupled(C), rise, load=mean * period), np.zeros(n, dtype=int))
    # Height amplitude * cos: full contact at pi E* amplitude / period, contact share from sin^2
    assert found.method == "newton"
    assert (found.state != OPEN_NODE).mean() == pytest.approx(share, abs=3 / n)
    pressure = found.force[n:] / (period / n)
    inside = np.abs(np.sin(np.pi * x / period)) < np.sin(np.pi * share / 2) * 0.9
    s = np.sin(np.pi * x[inside] / period)
    exact = 2 * mean * np.abs(np.cos(np.pi * x[inside] / period)) / np.sin(np.pi * share / 2) ** 2
    exact *= np.sqrt(np.sin(np.pi * share / 2) ** 2 - s**2)
    assert np.abs(pressure[inside] - exact).max() < 0.02 * exact.max()


@pytest.fixture(scope="module")
def cylinder():
    x = np.linspace(-1.5, 1.5, 241)
    C = uncoupled(half_plane(x))
    return x, C, x**2 / (2 * 20.0)


def test_a_cylinder_that_begins_to_slip_is_cattaneos_and_mindlins(cylinder):
    x, C, rise = cylinder
    n, mu = len(x), 0.4
    load = np.pi * E_STAR * 1.0**2 / (4 * 20.0)  # Contact of half width 1
    pressed = rub(laws(C, rise, load=load, friction=mu), np.zeros(n, dtype=int))
    assert np.abs(pressed.force[:n]).max() < 1e-12 * load
    assert np.ptp(x[pressed.state != OPEN_NODE]) / 2 == pytest.approx(1.0, abs=2 * (x[1] - x[0]))

    def pulled(drift):
        return rub(laws(C, rise, load=load, friction=mu, drift=drift), pressed.state)

    def short(drift):
        return -pulled(drift).force[:n].sum() - 0.6 * mu * load

    found = pulled(brentq(short, 1e-3, 1.0, xtol=1e-7))
    stuck = x[found.state == STICKING_NODE]
    assert np.ptp(stuck) / 2 == pytest.approx(np.sqrt(1 - 0.6), abs=2 * (x[1] - x[0]))
    assert set(found.state) == {OPEN_NODE, STICKING_NODE, SLIPS_RIGHT}


def coupled_body(n, rng):
    """Compliance of a body whose directions are coupled, well conditioned."""
    x = np.arange(n)
    near = np.exp(-np.abs(np.subtract.outer(x, x)) / 6.0)
    odd = 0.2 * np.sign(np.subtract.outer(x, x)) * near
    # On the flank of a ridge a node's own directions are coupled, too
    odd += np.diag(rng.uniform(-0.3, 0.3, n))
    C = np.block([[1.3 * near, odd], [odd.T, near]])
    return C + 0.2 * np.eye(2 * n)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("given", ["depth", "load"])
def test_newton_and_relaxation_agree(seed, given):
    rng = np.random.default_rng(seed)
    n = 16
    C = coupled_body(n, rng)
    mu = float(rng.uniform(0.1, 1.5))
    step = laws(
        C, rng.uniform(0, 0.5, n), friction=mu, drift=float(rng.uniform(-1, 1)), old=rng.normal(0, 0.2, n),
        **{given: 1.0},
    )  # fmt: skip
    newton, relaxed = rub(step, np.zeros(n, dtype=int)), relax(step)
    assert relaxed.violation < 1e-8
    np.testing.assert_allclose(newton.force, relaxed.force, atol=1e-6 * np.abs(newton.force).max())
    np.testing.assert_allclose(newton.moved, C @ newton.force, atol=1e-9)
    assert newton.depth == pytest.approx(relaxed.depth, rel=1e-6) and (newton.state == relaxed.state).all()
    assert newton.force[n:].sum() == pytest.approx(1.0) if given == "load" else newton.depth == 1.0
