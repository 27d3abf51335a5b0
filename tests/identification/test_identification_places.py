"""What a log may hold besides presses on one block at the apex, and what places and specimens then tell."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.identification import PARAMETERS_BY_NAME, diagnose, identify, record
from papilla.identification.parameters import kind
from papilla.identification.posing import problem_of
from papilla.identification.suggest import suggest_presses
from papilla.logs import PressLog
from papilla.model.finger import Finger
from papilla.model.specimen import Block, HalfSpace

SIZE_MM = 2.8
NAMES = tuple(f"g{k}" for k in range(1, 6))
TRUE = {"outer_modulus_MPa": 0.18, "inner_modulus_MPa": 0.04, "touch_down_mm": 0.2}
TRUE |= {f"gain.{name}": gain for name, gain in zip(NAMES, (0.8, -0.3, 0.5, 0.1, 1.0), strict=True)}
TRUE |= {f"lever_mm.{name}": -0.6 * TRUE[f"gain.{name}"] for name in NAMES}
TRUE |= {f"zero_microstrain.{name}": zero for name, zero in zip(NAMES, (10.0, -20.0, 5.0, 0.0, 15.0), strict=True)}


def presses(places=((0.0, 0.0),), moduli=(0.089, 0.51), forces=(0.15, 0.4, 0.9), **columns) -> PressLog:
    """A log of all combinations that has measured nothing yet."""
    at, modulus, force = np.meshgrid(np.arange(len(places)), moduli, forces, indexing="ij")
    spots, n = np.array(places)[at.ravel()], force.size
    log = PressLog(force.ravel(), modulus.ravel(), np.full((n, 5), 100.0), NAMES, np.full(n, 1.0), *spots.T)
    return replace(log, **columns)


def measured(log, truth, rng, *, force_error=0.01, noise=5.0):
    """The log as the finger of some parameter values reads it, with noise."""
    loaded = replace(log, force_N=log.force_N * (1 + force_error * rng.normal(size=len(log))))
    posed = problem_of(loaded, Finger.default(), fix={**TRUE, **truth}, size_mm=SIZE_MM)
    values = posed.modelled(posed.start).values
    if log.stated_sd is not None:
        return replace(log, stated_sd=values[:, 0], indentation_mm=values[:, 1] + 0.02 * rng.normal(size=len(log)))
    read = values[:, :5] + noise * rng.normal(size=(len(log), 5))
    return replace(log, readings=read, indentation_mm=values[:, 5] + 0.004 * noise * rng.normal(size=len(log)))


def pull(found, name, true):
    value, sigma = found[name]
    return (np.log(value / true) if PARAMETERS_BY_NAME[kind(name)].logarithmic else value - true) / sigma


AROUND = ((0.0, 0.0), (3.0, 0.0), (-2.0, 1.5), (0.0, -3.0))
SLOPES = {
    "places": (presses(((1.0, -0.5), (2.0, 1.0))), ("row_along_mm", "row_across_mm", "tilt_x_deg", "tilt_y_deg")),
    "each gauge": (presses(), ("place_mm", "thickness_mm")),
    "specimens": (presses(modulus_sigma_MPa=np.full(6, 0.005)), ()),
    "S_d": (presses(stated_sd=np.full(6, 50.0), readings=np.zeros((6, 0)), gauge_names=()), ("tilt_y_deg",)),
}


def test_all_parameters_are_among_those_whose_derivatives_are_checked():
    usual = {"outer_modulus_MPa", "inner_modulus_MPa", "gain", "lever_mm", "zero_microstrain", "touch_down_mm"}
    besides = {name for _, free in SLOPES.values() for name in free}
    assert usual | besides | {"specimen_modulus", "stick_share", "common_gain", "common_lever_mm"} == set(
        PARAMETERS_BY_NAME
    )


@pytest.mark.slow
@pytest.mark.parametrize("case", SLOPES)
def test_the_jacobian_is_that_of_the_residuals(case):
    log, free = SLOPES[case]
    posed = problem_of(log, Finger.default(), free, size_mm=SIZE_MM).weighted()
    rng = np.random.default_rng(2)
    vector = posed.start + 0.05 * rng.normal(size=len(posed.free))
    posed = posed.weighted(vector)
    jacobian = posed.jacobian(vector)
    for place, name in enumerate(posed.free):
        step = 1e-5 * (np.arange(len(vector)) == place)
        two_sided = (posed.residuals(vector + step) - posed.residuals(vector - step)) / 2e-5
        assert jacobian[:, place] == pytest.approx(two_sided, abs=1e-5 * np.abs(two_sided).max()), name


@pytest.mark.slow
def test_a_gauge_that_was_glued_beside_its_place_comes_back():
    log = measured(presses(AROUND), {"place_mm.g2": 0.9}, np.random.default_rng(5))
    found = identify(log, Finger.default(), free=("place_mm",), size_mm=SIZE_MM)
    for name in NAMES:
        assert abs(pull(found, f"place_mm.{name}", 0.9 if name == "g2" else 0.0)) < 3.5
    assert found["place_mm.g2"][1] < 0.6


@pytest.mark.slow
def test_s_d_alone_tells_moduli_and_what_all_gauges_have_in_common():
    truth = {"gain": 1.0, "lever_mm": 0.0, "zero_microstrain": 0.0, "common_gain": 0.2, "common_lever_mm": -0.7}
    log = presses(stated_sd=np.full(9, 50.0), readings=np.zeros((9, 0)), gauge_names=(), moduli=(0.089, 0.51, 0.72))
    log = measured(log, truth, np.random.default_rng(6))
    found = identify(log, Finger.default(), size_mm=SIZE_MM)
    told = diagnose(found)
    for name in ("outer_modulus_MPa", "inner_modulus_MPa", "common_gain", "common_lever_mm"):
        assert abs(pull(found, name, {**TRUE, **truth}[name])) < 4, name
    kept = record(found, told, "block")
    assert kept.parameters[-10:] == tuple(f"{name}.{gauge}" for gauge in NAMES for name in ("gain", "lever_mm"))
    assert kept.values[-10] == found.finger.gauges[0].membrane_gain == pytest.approx(found["common_gain"][0])
    assert kept.sigma("gain.g1") == pytest.approx(found["common_gain"][0] * found["common_gain"][1])


@pytest.mark.slow
def test_specimens_of_their_own_shape_and_doubtful_modulus():
    """Of one specimen the label is 8 % off: its neighbours tell, and the moduli are told no better than it allows."""
    log = presses(moduli=(0.089, 0.3, 0.51), modulus_sigma_MPa=np.tile(np.repeat([0.002, 0.03, 0.01], 3), 1))
    log = replace(log, specimens=(Block(1.0, 10.0), HalfSpace(1.0)), on=np.repeat([0, 0, 1], 3))
    true = {"specimen_modulus.0.3": 0.324}
    lied = replace(log, modulus_MPa=np.where(log.modulus_MPa == 0.3, 0.324, log.modulus_MPa), modulus_sigma_MPa=None)
    lied = measured(lied, {}, np.random.default_rng(7))
    log = replace(log, readings=lied.readings, indentation_mm=lied.indentation_mm)
    found = identify(log, Finger.default(), size_mm=SIZE_MM)
    assert {"specimen_modulus.0.089", "specimen_modulus.0.3", "specimen_modulus.0.51"} < {*found.names}
    for name, value in true.items():
        assert abs(pull(found, name, value)) < 3
    place = found.names.index("specimen_modulus.0.3")
    far = replace(found, vector=np.where(np.arange(len(found.names)) == place, np.log(0.3) + 0.25, found.vector))
    assert any("the specimen of 0.3 MPa came out at 0.385, 2.5 of the" in doubt for doubt in diagnose(far).doubts)
    exact = identify(replace(log, modulus_sigma_MPa=None), Finger.default(), size_mm=SIZE_MM)
    assert found["outer_modulus_MPa"][1] > exact["outer_modulus_MPa"][1]
    kept = record(found, diagnose(found), "block and half-space")
    assert not any(name.startswith("specimen_modulus") for name in kept.parameters)
    assert kept.sigma("outer_modulus_MPa") == pytest.approx(found["outer_modulus_MPa"][1])


@pytest.mark.slow
def test_presses_beside_the_apex_may_be_suggested():
    log = measured(presses(), {}, np.random.default_rng(8))
    found = identify(log, Finger.default(), free=("row_along_mm", "tilt_y_deg"), size_mm=SIZE_MM)
    both = suggest_presses(found, 1, (0.089, 0.51), places=((0.0, 0.0), (3.0, 0.0)), size_mm=SIZE_MM)
    apex, beside = (suggest_presses(found, 1, (0.089, 0.51), places=(one,), size_mm=SIZE_MM) for one in AROUND[:2])
    assert apex.place_mm == ((0.0, 0.0),) and beside.place_mm == ((3.0, 0.0),)
    assert both.sigma_after == pytest.approx(min(apex.sigma_after, beside.sigma_after))
    assert apex.sigma_after != beside.sigma_after
    with pytest.raises(InputError, match="x_mm is 9 in press 1: contacts are known within 3.* mm"):
        suggest_presses(found, 3, (0.089,), places=((9.0, 0.0),), size_mm=SIZE_MM)
