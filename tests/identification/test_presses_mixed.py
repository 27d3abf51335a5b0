"""Responses of presses, mixed by friction and thickness and moved, against power laws with known derivatives."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_finger import BLOCK

from papilla.core.errors import InputError
from papilla.fem.pressing.off_apex import MoveLimits
from papilla.identification.presses import PressedShape, felt_by, needs_places, places, refuse_far, rolled
from papilla.logs import PressLog

GAUGES = ("g1", "g2")
LOG = PressLog(
    np.array([0.1, 0.3, 0.5, 0.9]), np.array([0.1, 0.2, 0.3, 0.4]), np.zeros((4, 2)), GAUGES,
    x_mm=np.array([0.0, 1.0, -2.0, 0.5]), y_mm=np.array([0.0, -0.5, 1.0, 2.0]),
)  # fmt: skip
LIMITS = MoveLimits(5.0, 3.0, np.array([20.0, 30.0]))


def test_without_tilt_a_straight_skin_does_not_roll():
    straight = replace(LIMITS, rolling=np.array([20.0, np.inf]))
    moved, _ = rolled(straight, {"tilt_x_deg": 0.0, "tilt_y_deg": 1.0})
    assert moved == pytest.approx([-20 * np.radians(1), 0.0])


def test_places_are_needed_where_a_contact_a_gauge_or_a_tilt_is_off():
    centred = replace(LOG, x_mm=None, y_mm=None)
    assert (places(centred) == 0).all() and (places(LOG)[:, 1] == LOG.y_mm).all()
    assert needs_places(LOG, (), {}) and not needs_places(centred, ("gain.g1",), {"thickness_mm": 9.0})
    assert needs_places(replace(LOG, y_mm=None), (), {}), "one place is off, others are not"
    assert needs_places(centred, ("place_mm.g1",), {}) and needs_places(centred, (), {"tilt_x_deg": 0.1})
    assert not needs_places(centred, (), {"tilt_x_deg": 0.0, "place_mm.g1": 0.0})


def test_contacts_that_are_too_far_are_refused():
    refuse_far(LOG, replace(LIMITS, reach=2.0), ())
    with pytest.raises(InputError, match=r"x_mm is -2 in press 3: contacts are known within 1.99 mm of the apex$"):
        refuse_far(LOG, replace(LIMITS, reach=1.99), ())
    # 3 degrees on a radius of 30 mm: 1.571 mm are left for the tilt
    refuse_far(LOG, replace(LIMITS, reach=3.6), ("tilt_x_deg",))
    with pytest.raises(InputError, match=r"y_mm is 2 in press 4: .* within 1.93 mm of the apex, tilt included"):
        refuse_far(LOG, replace(LIMITS, reach=3.5), ("tilt_x_deg",))
    with pytest.raises(InputError, match="tilt_x_deg cannot be free: the skin is straight along y"):
        refuse_far(LOG, replace(LIMITS, rolling=np.array([20.0, np.inf])), ("tilt_x_deg",))


@pytest.mark.parametrize("thicknesses", [(), (8.0, 10.0, 12.5)])
def test_equal_responses_mix_to_themselves(smooth, thicknesses):
    """Weights of thicknesses and of stick add up to one; derivatives are those of values."""
    log = replace(LOG, force_N=np.array([0.1, 0.2, 0.3, 0.4]), x_mm=None, y_mm=None)
    shape = PressedShape(np.array([3, 1]), BLOCK, (smooth,) * 2 * max(len(thicknesses), 1), thicknesses)
    values = {"inner_modulus_MPa": 0.03, "outer_modulus_MPa": 0.12, "thickness_mm": 9.1, "stick_share": 0.3}
    names = tuple(f"g{k}" for k in range(1, 6))
    assert shape.friction_open and shape.friction == "not told" and "friction not stated" in shape.physics
    pressed = felt_by((shape,), log, log.modulus_MPa, values, names)
    alone = smooth.felt(log.force_N[[3, 1]], log.modulus_MPa[[3, 1]], 0.12, 0.03)
    assert pressed.values[[3, 1]] == pytest.approx(alone.values) and (pressed.values[[0, 2]] == 0).all()
    assert pressed.depth[[3, 1]] == pytest.approx(alone.indentation)
    for name in ("thickness_mm", "stick_share"):
        assert np.abs(pressed.slopes[name]).max() < 1e-9 * np.abs(pressed.values).max()
    for name in ("inner_modulus_MPa", "outer_modulus_MPa"):
        # The derivative by the outer modulus is at constant inner one, that by the inner one at constant ratio
        steps = [{**values, name: values[name] * np.exp(step)} for step in (1e-4, -1e-4)]
        up, down = (felt_by((shape,), log, log.modulus_MPa, step, names) for step in steps)
        slope = pressed.slopes[name]
        assert slope == pytest.approx((up.values - down.values) / 2e-4, abs=1e-6 * np.abs(slope).max()), name
        assert pressed.depth_slopes[name] == pytest.approx((up.depth - down.depth) / 2e-4, abs=1e-6), name
