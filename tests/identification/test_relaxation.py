"""Prony terms from a touch that is held: against the finger that crept, and what a log cannot tell."""

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.identification.one_touch import fit_relaxation
from papilla.references import Prony

TIME = np.concatenate([np.linspace(0.05, 1, 20), np.linspace(1.2, 25, 120)])
RAMP = np.minimum(TIME, 1.0)


def made(prony, held, noise=0.0, seed=1):
    """A touch whose answers are a power of the equivalent force; `held` is the force or the depth."""
    random = np.random.default_rng(seed)
    if held == "force":
        force = 0.5 * RAMP
        depth = prony.strained(TIME, force) ** 0.66 + 0.15
    else:
        depth = 0.6 * RAMP
        force = prony.stressed(TIME, (depth) ** 1.5)
        depth = depth + 0.15
    return force, depth + noise * random.normal(size=len(TIME))


@pytest.mark.parametrize("held", ["force", "depth"])
@pytest.mark.parametrize("prony", [Prony((0.3,), (2.0,)), Prony((0.15, 0.25), (0.5, 6.0))], ids=["one", "two"])
def test_its_own_terms_come_back(prony, held):
    force, depth = made(prony, held)
    found = fit_relaxation(TIME, force, depth, terms=len(prony.shares))
    assert found.prony.shares == pytest.approx(prony.shares, rel=0.02)
    assert found.prony.times_s == pytest.approx(prony.times_s, rel=0.03)
    assert found.rms < 1e-3 and found.notes == ()


def test_sigmas_hold_what_noise_does():
    prony, pulls = Prony((0.3,), (2.0,)), []
    for seed in range(30):
        force, depth = made(prony, "force", noise=0.002, seed=seed)
        found = fit_relaxation(TIME, force, depth)
        pulls.append((found.prony.shares[0] - 0.3) / found.share_sigma[0])
        pulls.append(np.log(found.prony.times_s[0] / 2.0) / found.time_sigma[0])
    assert 0.6 < np.sqrt(np.mean(np.square(pulls))) < 1.6


def test_what_a_log_cannot_tell_is_said():
    force, depth = made(Prony((0.3,), (400.0,)), "force", noise=0.002)
    assert any("outside of what the log resolves" in said for said in fit_relaxation(TIME, force, depth).notes)
    force, depth = made(Prony((0.004,), (2.0,)), "force", noise=0.01)
    assert fit_relaxation(TIME, force, depth).notes


@pytest.mark.parametrize(
    "change, message",
    [
        ({"terms": 3}, "must be 1 or 2, got 3"),
        ({"observed": np.ones(4)}, "of one length"),
        ({"force_N": np.zeros(len(TIME))}, "forces greater than 0"),
        ({"observed": np.full(len(TIME), np.nan)}, "must be finite"),
        ({"observed": np.linspace(1, 0, len(TIME))}, "rows while the contact grows are too few"),
    ],
)
def test_what_cannot_be_fitted_is_refused(change, message):
    force, depth = made(Prony((0.3,), (2.0,)), "force")
    given = {"time_s": TIME, "force_N": force, "observed": depth} | change
    with pytest.raises(InputError, match=message):
        fit_relaxation(**given)
