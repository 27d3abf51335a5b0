"""Errors of one press against another, the largest of them in words, and an indentation that corrections change."""

from types import SimpleNamespace

import numpy as np
import pytest

from papilla.fem.pressing import fidelity as fidelity_module
from papilla.fem.pressing.fidelity import PROBE_FORCES, QUANTITIES, Worst, _settled, relative_errors


def pressed(sd, indentation, contact_area, reading):
    silent = sd == 0
    return SimpleNamespace(
        sd=sd, indentation=indentation, contact_area=contact_area, reading=np.array(reading), silent=silent
    )


def test_errors_are_relative_and_of_readings_where_s_d_is_silent():
    truth = pressed(100.0, 0.5, 40.0, [-100.0, 100.0])
    found = pressed(90.0, 0.51, 50.0, [-90.0, 95.0])
    assert relative_errors(found, truth) == pytest.approx([0.1, 0.02, 0.25])
    silent = pressed(0.0, 0.5, 40.0, [80.0, 80.0])
    assert relative_errors(pressed(1.0, 0.5, 40.0, [76.0, 78.0]), silent) == pytest.approx([0.05, 0.0, 0.0])
    nothing = pressed(0.0, 0.5, 40.0, [0.0, 0.0])
    assert relative_errors(pressed(0.0, 0.5, 40.0, [0.0, 0.0]), nothing) == [0.0, 0.0, 0.0]


def test_the_worst_error_is_named_with_its_quantity():
    assert Worst.of({"sd": 0.02, "indentation": 0.031, "contact_area": 0.01}) == Worst(0.031, "indentation")
    assert str(Worst(0.0314, "indentation")) == "3.1 % in indentation"


@pytest.mark.parametrize("share", [1.0, 0.8, 1.1])
def test_a_given_indentation_is_that_after_all_corrections(share):
    """A correction that shrinks with the indentation: the linear press is made deeper until it is met."""
    asked = []

    def made(load):
        asked.append(load)
        return SimpleNamespace(indentation=load[1] * (share + (1 - share) * 0.2 * load[1]) if load[1] else 0.3)

    found = _settled((None, 0.5), made)
    assert found.indentation == pytest.approx(0.5, rel=1e-4)
    assert len(asked) == 1 if share == 1 else len(asked) > 2
    asked.clear()
    assert _settled((0.4, None), made).indentation == 0.3 and asked == [(0.4, None)]
    assert _settled((None, 0.5), made, lambda found: None) is None


@pytest.mark.parametrize("place, near", [(0.0, (0, 1)), (0.5, (0, 1)), (1.0, (0, 1)), (1.5, (1, 2)), (-0.1, None)])
def test_hertz_has_the_larger_error_of_the_probe_forces_around_a_load(monkeypatch, place, near):
    """A load at so many steps from the first probe force; none below it."""
    monkeypatch.setattr(fidelity_module, "_prices", lambda reduced: None)
    errors = np.outer(1 + np.arange(len(PROBE_FORCES)), [0.01] + [0.001] * (len(QUANTITIES) - 1))
    monkeypatch.setattr(fidelity_module, "probe_hertz", lambda reduced, specimen: errors)
    force = float(np.interp(place, [-1, *range(len(PROBE_FORCES))], [0.0, *PROBE_FORCES]))
    found = fidelity_module.hertz_error(None, None, (force, None))
    assert (found and (found.error, found.quantity)) == (near and (pytest.approx(0.01 * (1 + near[1])), QUANTITIES[0]))


def test_hertz_is_probed_at_six_forces_and_an_indentation_is_found_in_four_presses():
    assert pytest.approx(0.02 * 50 ** (np.arange(6) / 5)) == PROBE_FORCES
    asked = []

    def stiffening(load):
        asked.append(load)
        return SimpleNamespace(indentation=load[1] ** 1.5)

    _settled((None, 0.5), stiffening)
    assert len(asked) == 5


@pytest.mark.parametrize("error, fidelity", [(0.0999, "hertz"), (0.1001, "contact")])
def test_hertz_answers_for_presses_too_light_for_the_mesh_up_to_a_tenth(monkeypatch, error, fidelity):
    light = SimpleNamespace(resolved=False, status="light", fidelity="contact")
    monkeypatch.setattr(fidelity_module, "hertz_error", lambda *_: None)
    monkeypatch.setattr(fidelity_module, "_contact", lambda *_: light)
    monkeypatch.setattr(fidelity_module, "lightest_error", lambda *_: Worst(error, "sd"))
    monkeypatch.setattr(fidelity_module, "hertz_press", lambda reduced, specimen, load, reason: SimpleNamespace(
        fidelity="hertz", status=reason))  # fmt: skip
    found = fidelity_module._cheapest(None, None, 0.02, (0.001, None))
    assert found.fidelity == fidelity and ("10.0 % in S_d from Hertzian at the lightest" in found.status) == (
        fidelity == "hertz"
    )


def test_a_coefficient_between_none_and_stick_is_between_the_two_presses_with_large_strain(monkeypatch):
    known, asked = {0.0: "free, strained", np.inf: "stuck, strained"}, []
    monkeypatch.setattr(fidelity_module, "_contact", lambda finger, touched, friction, load: (friction, load))
    monkeypatch.setattr(
        fidelity_module, "with_large_strain", lambda finger, one, *, beyond: asked.append(beyond) or known.get(one[0])
    )
    monkeypatch.setattr(fidelity_module, "between_ends", lambda *parts: parts)
    flat, found = SimpleNamespace(curvature=(0.0, 0.0)), SimpleNamespace(friction=0.3, force=0.4)
    *parts, linear = fidelity_module.including_large_strain("finger", flat, found, beyond=True)
    ends = (0.0, (0.4, None)), (np.inf, (0.4, None))
    assert parts == ["finger", found, ends, ("free, strained", "stuck, strained")] and asked == [True, True]
    assert linear(0.2) == (0.2, (0.4, None))
    known.pop(np.inf)
    assert fidelity_module.including_large_strain("finger", flat, found) is None
    assert fidelity_module.including_large_strain("finger", SimpleNamespace(curvature=(0.1, 0.0)), found) is None
