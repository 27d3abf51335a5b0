"""Responses of presses, mixed by friction and thickness and moved, against power laws with known derivatives."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.fem.pressing.off_apex import MoveLimits
from papilla.identification.presses import Shape, felt_by, needs_places, places, refuse_far, rolled
from papilla.logs import PressLog
from papilla.model.specimen import Block

GAUGES = ("g1", "g2")
LOG = PressLog(
    np.array([0.1, 0.3, 0.5, 0.9]), np.array([0.1, 0.2, 0.3, 0.4]), np.zeros((4, 2)), GAUGES,
    x_mm=np.array([0.0, 1.0, -2.0, 0.5]), y_mm=np.array([0.0, -0.5, 1.0, 2.0]),
)  # fmt: skip
VALUES = {
    "inner_modulus_MPa": 0.04, "outer_modulus_MPa": 0.15, "thickness_mm": 7.0, "stick_share": 0.3,
    "row_along_mm": 0.2, "row_across_mm": -0.3, "place_mm.g1": 0.1, "place_mm.g2": -0.4,
    "tilt_x_deg": 1.1, "tilt_y_deg": -0.7,
}  # fmt: skip
POWERS = np.array([0.6, 0.2, -0.3])
LIMITS = MoveLimits(5.0, 3.0, np.array([20.0, 30.0]))


@dataclass(frozen=True)
class PowerLaw:
    """A response: a size, times powers of force and modulus over the inner modulus, and of the ratio of moduli."""

    size: float
    friction: float = 0.0

    def felt(self, force, modulus, outer, inner):
        law = self.size * (force / inner) ** 0.6 * (modulus / inner) ** 0.2 * (outer / inner) ** -0.3
        values = law[:, None, None] * np.array([[1.0, 2.0], [-3.0, 0.5]])
        slopes = [np.multiply.outer(POWERS, part) for part in (values, 0.1 * law)]
        return SimpleNamespace(
            values=values, indentation=0.1 * law, slope_values=slopes[0], slope_indentation=slopes[1]
        )


@dataclass(frozen=True)
class LinearMove:
    """Changes that are linear in place and shift, with a size like that of a response."""

    limits: MoveLimits = LIMITS

    def changed(self, force, modulus, outer, inner, place, shift):
        law = PowerLaw(1.0).felt(force, modulus, outer, inner)
        by = {"x": 0.3, "y": -0.2, "along": 0.5, "across": 0.7}
        moved = by["x"] * place[:, 0, None] + by["y"] * place[:, 1, None]
        moved = (moved + by["along"] * shift[0] + by["across"] * shift[1])[:, None, :]
        slopes = {name: law.values * size for name, size in by.items()}
        slopes |= {
            name: moved * part for name, part in zip(("force", "modulus", "ratio"), law.slope_values, strict=True)
        }
        return SimpleNamespace(values=moved * law.values, slopes=slopes)


def thick(thickness):
    """A size that is quadratic in the logarithm of the thickness, which three thicknesses determine."""
    return 1 + 0.3 * np.log(thickness) + 0.2 * np.log(thickness) ** 2


def shapes(off_apex=None):
    """A block of three thicknesses whose friction is open, and another shape with friction that is stated."""
    nodes = (5.0, 8.0, 12.0)
    stuck, free = (tuple(PowerLaw(share * thick(node)) for node in nodes) for share in (2.0, 1.0))
    return (
        Shape(np.array([0, 2]), Block(1.0, 10.0), (*stuck, *free), nodes, off_apex),
        Shape(np.array([1, 3]), Block(1.0, 10.0), (PowerLaw(4.0, 0.4),), (), off_apex),
    )


def felt(values, force=1.0, modulus=1.0, off_apex=None):
    log = replace(LOG, force_N=LOG.force_N * force)
    return felt_by(shapes(off_apex), log, LOG.modulus_MPa * modulus, values, GAUGES)


def test_friction_that_is_open_is_a_share_of_stick_and_thickness_is_interpolated():
    found = felt(VALUES)
    first, second = shapes()
    assert first.friction_open and first.friction == "not told"
    assert not second.friction_open and second.friction == 0.4
    sizes = np.array([0.3 * 2 + 0.7, 4.0])[[0, 1, 0, 1]] * np.array([thick(7.0), 1.0])[[0, 1, 0, 1]]
    one = PowerLaw(1.0).felt(LOG.force_N, LOG.modulus_MPa, 0.15, 0.04)
    assert found.values == pytest.approx(sizes[:, None, None] * one.values)
    assert found.depth == pytest.approx(sizes * one.indentation) and (found.changed == 0).all()
    alone = felt(VALUES | {"stick_share": 1.0})
    assert felt({name: value for name, value in VALUES.items() if name != "stick_share"}).depth == pytest.approx(
        alone.depth
    )


@pytest.mark.parametrize("name", ["force", "modulus", *VALUES])
def test_derivatives_are_those_of_two_sided_differences(name):
    """By the logarithm, but for the share of stick, shifts and tilts."""
    step, off_apex = 1e-5, LinearMove()

    def at(sign):
        if name in ("force", "modulus"):
            return felt(VALUES, **{name: np.exp(sign * step)}, off_apex=off_apex)
        logarithmic = name.endswith("MPa") or name == "thickness_mm"
        value = VALUES[name] * np.exp(sign * step) if logarithmic else VALUES[name] + sign * step
        return felt(VALUES | {name: value}, off_apex=off_apex)

    found, more, less = at(0), at(1), at(-1)
    assert found.slopes[name] == pytest.approx((more.values - less.values) / (2 * step), rel=1e-6, abs=1e-8)
    assert found.depth_slopes[name] == pytest.approx((more.depth - less.depth) / (2 * step), rel=1e-6, abs=1e-8)
    assert np.abs(found.slopes[name]).max() > 1e-3


def test_moved_contacts_and_gauges_add_their_change():
    found, alone = felt(VALUES, off_apex=LinearMove()), felt(VALUES)
    assert found.values == pytest.approx(alone.values + found.changed)
    one = PowerLaw(1.0).felt(LOG.force_N, LOG.modulus_MPa, 0.15, 0.04).values
    # A tilt about y rolls the contact to smaller x, one about x to greater y
    x, y = LOG.x_mm + 20 * np.radians(0.7), LOG.y_mm + 30 * np.radians(1.1)
    along, across = 0.2 + np.array([0.1, -0.4]), -0.3
    moved = 0.3 * x[:, None] - 0.2 * y[:, None] + 0.5 * along + 0.7 * across
    assert found.changed == pytest.approx(one * moved[:, None, :])


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
