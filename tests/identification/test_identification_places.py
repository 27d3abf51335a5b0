"""What a log may hold besides presses on one block at the apex, and what places and specimens then tell."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.identification import diagnose, identify, record
from papilla.identification.posing import problem_of
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


def measured(log, rng, *, force_error=0.01, noise=5.0):
    """The log as a finger reads it, with noise."""
    loaded = replace(log, force_N=log.force_N * (1 + force_error * rng.normal(size=len(log))))
    posed = problem_of(loaded, Finger.default(), fix=TRUE, size_mm=SIZE_MM)
    values = posed.modelled(posed.start).values
    read = values[:, :5] + noise * rng.normal(size=(len(log), 5))
    return replace(log, readings=read, indentation_mm=values[:, 5] + 0.004 * noise * rng.normal(size=len(log)))


SLOPES = {
    "places": (presses(((1.0, -0.5), (2.0, 1.0))), ("row_along_mm", "row_across_mm", "tilt_x_deg", "tilt_y_deg")),
    "each gauge": (presses(), ("place_mm", "thickness_mm")),
    "specimens": (presses(modulus_sigma_MPa=np.full(6, 0.005)), ()),
    "S_d": (presses(stated_sd=np.full(6, 50.0), readings=np.zeros((6, 0)), gauge_names=()), ("tilt_y_deg",)),
}


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
def test_specimens_of_their_own_shape_and_doubtful_modulus():
    """Of one specimen the label is 8 % off: its neighbours tell, and the moduli are told no better than it allows."""
    log = presses(moduli=(0.089, 0.3, 0.51), modulus_sigma_MPa=np.tile(np.repeat([0.002, 0.03, 0.01], 3), 1))
    log = replace(log, specimens=(Block(1.0, 10.0), HalfSpace(1.0)), on=np.repeat([0, 0, 1], 3))
    lied = replace(log, modulus_MPa=np.where(log.modulus_MPa == 0.3, 0.324, log.modulus_MPa), modulus_sigma_MPa=None)
    lied = measured(lied, np.random.default_rng(7))
    log = replace(log, readings=lied.readings, indentation_mm=lied.indentation_mm)
    found = identify(log, Finger.default(), size_mm=SIZE_MM)
    assert {"specimen_modulus.0.089", "specimen_modulus.0.3", "specimen_modulus.0.51"} < {*found.names}
    value, sigma = found["specimen_modulus.0.3"]
    assert abs(np.log(value / 0.324)) < 3 * sigma
    place = found.names.index("specimen_modulus.0.3")
    far = replace(found, vector=np.where(np.arange(len(found.names)) == place, np.log(0.3) + 0.25, found.vector))
    assert any("the specimen of 0.3 MPa came out at 0.385, 2.5 of the" in doubt for doubt in diagnose(far).notes)
    exact = identify(replace(log, modulus_sigma_MPa=None), Finger.default(), size_mm=SIZE_MM)
    assert found["outer_modulus_MPa"][1] > exact["outer_modulus_MPa"][1]
    kept = record(found, diagnose(found), "block and half-space")
    assert not any(name.startswith("specimen_modulus") for name in kept.parameters)
    assert kept.sigma("outer_modulus_MPa") == pytest.approx(found["outer_modulus_MPa"][1])
