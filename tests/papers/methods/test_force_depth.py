"""Modulus from force and depth, on presses whose depth is a law of its own."""

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla_papers.methods.force_depth import DepthErrors, ForceDepth

FORCES, MODULI = np.geomspace(0.05, 1.0, 12), np.geomspace(0.05, 1.0, 20)
NONE = DepthErrors(0, 0, 0, 0)


def law(force, modulus):
    return force**0.6 * (0.5 + 0.2 * modulus**-0.5)


@pytest.fixture(scope="module")
def model() -> ForceDepth:
    force, modulus = (axis.ravel() for axis in np.meshgrid(FORCES, MODULI))
    return ForceDepth(force, modulus, law(force, modulus))


@pytest.mark.parametrize("errors", [{"depth_mm": 0.01}, {"contact_mm": 0.01}, {"force_N": 0.002}, {"model": 0.02}])
def test_it_inverts_the_law_and_its_sigma_is_the_change_by_an_error(model, errors):
    force, modulus = np.random.default_rng(1).uniform(0.06, 0.9, (2, 300))
    depth, ((name, size),) = law(force, modulus), errors.items()
    found, sigma, _ = model.process(force, depth, DepthErrors(**{**vars(NONE), **errors}))
    np.testing.assert_allclose(found, modulus, rtol=2e-3)
    moved = {"force_N": (force + 1e-2 * size, depth), "model": (force, depth * (1 + 1e-2 * size))}
    changed = model.process(*moved.get(name, (force, depth + 1e-2 * size)), NONE)[0]
    np.testing.assert_allclose(sigma, 100 * np.abs(changed - found), rtol=0.08)


def test_it_says_where_it_has_no_answer(model):
    cases = {"BAD_INPUT": (0.5, np.nan), "NO_CONTACT": (0.0, 0.0), "FORCE_BELOW": (0.04, 0.2), "OK": (1.0, law(1, 0.3))}
    cases |= {"FORCE_ABOVE": (2.0, 1.0), "HARDER": (0.5, 0.3), "SOFTER": (0.5, 3.0)}
    cases |= {"NOT_IDENTIFIABLE": (0.05, law(0.05, 0.99))}
    modulus, sigma, status = model.process(*np.array([*cases.values()]).T, DepthErrors(depth_mm=0.01))
    assert [one.name for one in status] == [*cases]
    answered = [name in ("OK", "NOT_IDENTIFIABLE") for name in cases]
    assert np.isfinite(modulus).tolist() == np.isfinite(sigma).tolist() == answered
    assert modulus[3] == pytest.approx(0.3, rel=2e-3), "at the sweep's own greatest force"
    assert vars(model.errors_of(0.1, 0.2)) == vars(DepthErrors()) | {"depth_mm": 0.1, "force_N": 0.2}
    assert model.errors_of(0.0, 0.0) == DepthErrors()
    with pytest.raises(InputError, match="the sweep must hold the depth"):
        ForceDepth(FORCES, FORCES, FORCES)


def test_the_ends_of_the_sweep_are_answered_and_what_was_not_pressed_is_left_out(model):
    """At the sweep's corners; in no order; a modulus whose depths are missing ends the range."""
    corners = np.array([(force, modulus) for force in (0.05, 1.0) for modulus in (0.0501, 0.3, 0.998)])
    answer, sigma, status = model.process(corners[:, 0], law(*corners.T), NONE)
    assert {one.name for one in status} == {"OK"} and np.all(sigma == 0)
    np.testing.assert_allclose(answer, corners[:, 1], rtol=2e-3)
    force, modulus = (axis.ravel() for axis in np.meshgrid(FORCES[::3], MODULI[::-5]))
    assert ForceDepth(force, modulus, law(force, modulus)).force_N == (FORCES[0], FORCES[9]), "four of each will do"
    for forces, moduli in ((FORCES[:3], MODULI), (FORCES, MODULI[:3])):
        few = [axis.ravel() for axis in np.meshgrid(forces, moduli)]
        with pytest.raises(InputError):
            ForceDepth(*few, law(*few))
    force, modulus = (axis.ravel() for axis in np.meshgrid(FORCES, MODULI))
    shuffled = np.random.default_rng(3).permutation(force.size)
    depth = np.where(modulus > 0.9, np.nan, law(force, modulus))
    holed = ForceDepth(force[shuffled], modulus[shuffled], depth[shuffled])
    answer, _, status = holed.process(np.full(2, 0.4), law(0.4, np.array([0.5, 0.95])), NONE)
    assert answer[0] == pytest.approx(0.5, rel=2e-3) and [one.name for one in status] == ["OK", "HARDER"]
    near = model.process(
        np.array([0.05 * (1 - 1e-10), 1 + 1e-10, 0.05 * 0.999, 1.001]), np.full(4, law(0.2, 0.3)), NONE
    )[2]
    assert [one.name for one in near[2:]] == ["FORCE_BELOW", "FORCE_ABOVE"] and "FORCE" not in near[0].name + near[
        1
    ].name
    assert vars(DepthErrors()) == {"depth_mm": 1e-3, "force_N": 1e-3, "contact_mm": 0.005, "model": 0.005}
