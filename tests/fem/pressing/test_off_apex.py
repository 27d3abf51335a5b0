"""Moved contacts and gauges: against gauges of another design, and their own differences."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.fem import press
from papilla.fem.pressing import off_apex
from papilla.fem.pressing.off_apex import MoveLimits, OffApex, off_apex_change, transported_readings
from papilla.fem.reduction.family import family
from papilla.model.finger import Finger
from papilla.model.specimen import Block

SIZE_MM = 2.8
BLOCK = Block(1.0, 10.0)
CASES = [(0.4, 0.3), (0.7, 0.3), (0.9, 0.6), (0.9, 0.15)]
"""Presses of many elements: lighter ones on this mesh grow in steps, which the polynomial averages over."""


@pytest.fixture(scope="module")
def made_up() -> OffApex:
    """Changes of any shape, which vanish where nothing is moved."""
    terms = len(off_apex.OFF_APEX_POLYNOMIAL.powers)
    coefficients = np.random.default_rng(4).normal(size=(terms, *off_apex.PLACE_NODES, *off_apex.SHIFT_NODES, 2, 5))
    coefficients[:, *off_apex.MIDDLE_NODES] = 0.0
    return OffApex(coefficients, MoveLimits(5.0, 3.0, np.array([20.0, np.inf])))


def changed(moved, outer, inner, place=(0.0, 0.0), shift=(0.0, 0.0)):
    force, modulus = np.array(CASES).T
    places = np.tile(np.array(place), (len(CASES), 1))
    return moved.changed(force, modulus, outer, inner, places, np.tile(np.array(shift)[:, None], (1, 5)))


def off(told, before, after):
    """Root mean square, in that of what the gauges feel, of a told change."""
    size = np.sqrt((before**2).mean(axis=2, keepdims=True))
    return np.sqrt(np.mean(((told - (after - before)) / size) ** 2)), np.sqrt(np.mean(((after - before) / size) ** 2))


def presses(member):
    return np.array([press(member, Block(e, 10.0), force=f, fidelity="contact", friction=0.0).values for f, e in CASES])


@pytest.mark.slow
def test_it_is_the_gauge_that_was_moved():
    relatives = family(Finger.default(), size_mm=SIZE_MM)
    moved = off_apex_change(relatives, BLOCK, 0.0)
    outer, inner, shift = 0.17, relatives.finger.inner.modulus, (1.2, -0.8)
    finger = relatives.finger
    design = replace(finger, gauges=tuple(replace(gauge, moved_mm=shift) for gauge in finger.gauges))
    model = relatives.model(outer / inner)
    elsewhere = type(model)(replace(design, outer=model.finger.outer, inner=model.finger.inner), model.mesh)
    before, after = (presses(one.reduce()) for one in (model, elsewhere))
    missed, size = off(changed(moved, outer, inner, shift=shift).values, before, after)
    assert missed < 0.05 and size > 3 * missed


def test_its_slopes_are_derivatives_and_at_the_apex_nothing_changes(made_up):
    moved, outer, inner, place, shift, step = made_up, 0.15, 0.04, np.array([1.0, -2.0]), np.array([0.5, 0.3]), 1e-5
    assert np.abs(changed(moved, outer, inner).values).max() < 1e-12
    told = changed(moved, outer, inner, place, shift)

    def two_sided(make):
        return (make(step).values - make(-step).values) / (2 * step)

    x, y = np.eye(2)
    differences = {
        "ratio": two_sided(lambda h: changed(moved, outer * np.exp(h), inner, place, shift)),
        "x": two_sided(lambda h: changed(moved, outer, inner, place + h * x, shift)),
        "y": two_sided(lambda h: changed(moved, outer, inner, place + h * y, shift)),
        "along": two_sided(lambda h: changed(moved, outer, inner, place, shift + h * x)),
        "across": two_sided(lambda h: changed(moved, outer, inner, place, shift + h * y)),
    }
    for name, slope in differences.items():
        assert told.slopes[name] == pytest.approx(slope, abs=1e-6 * np.abs(slope).max()), name
    scaled = changed(moved, outer * np.exp(step), inner * np.exp(step), place, shift).values - told.values
    homogeneous = -sum(told.slopes[name] for name in ("force", "modulus"))
    assert scaled / step == pytest.approx(homogeneous, abs=1e-3 * np.abs(homogeneous).max())


def test_what_is_too_far_is_refused(made_up):
    changed(made_up, 0.136, 0.034, place=(5.0, -5.0), shift=(-3.0, 3.0))
    with pytest.raises(InputError, match="contacts must lie within 5 mm along x and y, got 6 mm"):
        changed(made_up, 0.136, 0.034, place=(6.0, 0.0))
    with pytest.raises(InputError, match="shifts must lie within 3 mm along x and y, got 4 mm"):
        changed(made_up, 0.136, 0.034, shift=(0.0, 4.0))
    assert "contacts within 5 mm, gauges within 3 mm)" in repr(made_up)


@pytest.fixture(scope="module", params=[0.0, "stick"])
def pressed(coarse, request):
    return press(coarse, Block(0.3, 10.0), force=0.6, fidelity="contact", friction=request.param)


def test_at_the_apex_it_is_the_press_itself(coarse_model, coarse, pressed):
    found = transported_readings(coarse_model, coarse.patch, pressed.traction[None], (-3.0, 0.0, 3.0))
    assert found.shape == (3, 1, 5)
    # The patch's own integrals are over facets, here of 4 mm, these over the exact skin.
    np.testing.assert_allclose(found[1, 0], pressed.reading, atol=0.05 * np.abs(pressed.reading).max())
    np.testing.assert_allclose(found[0, 0], found[2, 0, ::-1], rtol=1e-9)
    assert np.abs(found[2] - found[1]).max() > 0.1 * np.abs(found[1]).max()


def test_unusable_values_are_refused(coarse_model, coarse, pressed):
    with pytest.raises(InputError, match=r"tractions must be \(m, 3, \d+\), one row per press, got shape \(3,\)"):
        transported_readings(coarse_model, coarse.patch, np.ones(3), (0.0,))
    with pytest.raises(InputError, match="no skin to touch at x 50"):
        transported_readings(coarse_model, coarse.patch, pressed.traction[None], (50.0,))
    with pytest.raises(InputError, match="place x"):
        transported_readings(coarse_model, coarse.patch, pressed.traction[None], (np.nan,))
