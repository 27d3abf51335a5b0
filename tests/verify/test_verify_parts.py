"""What the families of `papilla verify` are made of, on small bodies and closed forms."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.core.errors import ContactRangeError
from papilla.core.units import MICROSTRAIN
from papilla.mesh.cells import volumes
from papilla.model.finger import Dome, Finger, Layer, Slab
from papilla.references import boussinesq_displacement, hertz_sphere
from papilla.verify import bodies, contact, elements, finger, hard, identification, meshes, sliding
from papilla.verify.case import Case, Verdict
from papilla.verify.structured import cube, cylinder, growing


@pytest.fixture(scope="module")
def layer():
    """A layer of 1 mm on a table, with a patch of 1 mm and gauges half a millimetre down."""
    mesh = cylinder(np.linspace(0, 2, 9), np.linspace(0, 1, 5), 2, 4)
    return bodies.FlatModel(mesh, Layer(1.0, 0.4), Layer(1.0, 0.4), 1.0, interface=0.5, sites=(0.0, 0.5)).reduce()


def integral(reduced, values):
    """The integral over the whole patch of a function of points (k, 2)."""
    points, weights, _ = bodies.quadrature(reduced.patch)
    return reduced.multiplicity * float(weights @ values(points))


# ---- Families that take seconds


@pytest.mark.parametrize("family", [elements.exact_fields, hard.engines])
def test_a_quick_family_is_within_its_bounds(family):
    cases = list(family())
    assert len(cases) > 4 and [case for case in cases if not case.passed] == []


def test_waves_are_closed_to_westergaards_share():
    assert sliding._westergaard().passed


# ---- Cases


def test_a_case_without_a_value_is_not_tested_and_an_interval_has_two_ends():
    assert Case("a", "b", None, 0.1).verdict == Verdict.UNTESTED
    inside, below = (Case("a", "b", value, (1.0, 2.0)).verdict for value in (1.0, 0.99))
    assert (inside, below) == (Verdict.WITHIN, Verdict.OUTSIDE)


def test_errors_are_relative_and_of_the_largest():
    assert bodies.off(0.9, 1.2) == bodies.off(1.5, 1.2) == pytest.approx(0.25)
    assert bodies.apart(np.array([1.0, -5.0]), np.array([2.0, -4.0])) == pytest.approx(0.25)


def test_what_is_compared_is_named_and_radius_and_area_follow_from_each_other():
    exact = hertz_sphere(1.0, 100.0, 2.0)
    found = SimpleNamespace(force=1.1, contact_area=1.21 * math.pi * exact.a**2)
    cases = list(bodies.compared("ball", "against Hertz", found, exact, force=0.2, radius=0.05, area=0.3))
    assert [case.what for case in cases] == ["ball, force", "ball, radius", "ball, area"]
    assert [case.cause for case in cases] == [
        f"{what} against Hertz" for what in ("force", "contact radius", "contact area")
    ]
    assert [case.value for case in cases] == pytest.approx([0.1, 0.1, 0.21])
    assert [case.passed for case in cases] == [True, False, True]


# ---- Flat bodies


def test_a_nodal_pressure_is_points_with_forces_all_around(layer):
    places, forces = bodies.surface_pressure(layer, np.ones(len(layer.patch.xy)))
    assert forces.sum() == pytest.approx(integral(layer, lambda x: np.ones(len(x))), rel=1e-12)
    assert forces @ places == pytest.approx([0, 0], abs=1e-12)
    assert forces @ places[:, 0] ** 2 == pytest.approx(integral(layer, lambda x: x[:, 0] ** 2), rel=0.02)


def test_a_bowl_has_the_gap_of_its_radii(layer):
    bowl = bodies.with_gap(layer, 100.0, 40.0)
    more = layer.multiplicity * (bowl.patch.gap - layer.patch.gap).sum()
    expected = integral(layer, lambda x: x[:, 0] ** 2 / 200 + x[:, 1] ** 2 / 80)
    assert more == pytest.approx(expected, rel=1e-12)


def test_the_moment_of_the_shear_is_its_integral(layer):
    """A shear that grows with the place, q = x: int r^2 dA up to the interpolation between nodes."""
    shear = np.vstack([np.zeros(len(layer.patch.xy)), layer.patch.xy.T])
    assert contact.shear_moment(layer, shear) == pytest.approx(integral(layer, lambda x: (x**2).sum(axis=1)), rel=0.02)


def test_point_forces_strain_a_gauge_by_boussinesq(layer):
    """All force on the node in the middle is nearly one point force."""
    middle = int(np.argmin(np.linalg.norm(layer.patch.xy, axis=1)))
    pressure = np.where(np.arange(len(layer.patch.xy)) == middle, 1.0, 0.0)
    force, depth, half = bodies.surface_pressure(layer, pressure)[1].sum(), 3.0, contact.GIVEN.gauge_half_mm
    (found,) = contact._boussinesq_strain(layer, pressure, (2.0,), depth)
    ends = np.array([[2.0 - half, 0.0, depth], [2.0 + half, 0.0, depth]])
    moved = boussinesq_displacement(ends, force, contact.MODULUS, contact.NU)[:, 0]
    assert found == pytest.approx((moved[1] - moved[0]) / (2 * half), rel=0.05)


def test_a_press_of_a_flat_layer_obeys_its_inequalities(layer):
    pressed = finger.pressed_by(bodies.with_gap(layer, 100.0, 100.0), 0.2, bodies.HalfSpace(1e6))
    reduced = bodies.with_gap(layer, 100.0, 100.0)
    assert max(finger.contact_residuals(reduced, bodies.HalfSpace(1e6), pressed)) < 1e-9
    pulled = replace(pressed, pressure=pressed.pressure - 0.1 * pressed.pressure.max())
    assert finger.contact_residuals(reduced, bodies.HalfSpace(1e6), pulled)[0] > 0.1


def test_the_ball_is_pressed_to_a_contact_of_a_millimetre():
    thickness, indentation = bodies.at_unit_contact(0.5, 2.0)
    found = bodies.bonded_layer_sphere(indentation, bodies.BALL_RADIUS, thickness, 2.0, 0.5)
    assert found.contact_radius == pytest.approx(1.0, rel=1e-6)
    assert math.sqrt(bodies.BALL_RADIUS * indentation) / thickness == pytest.approx(0.5, rel=1e-9)


def test_steps_grow_by_their_ratio_up_to_the_end():
    places = growing(0.1, 1.5, 3.0)
    steps = np.diff(places)
    assert places[0] == 0 and places[-1] == pytest.approx(3.0)
    assert steps[1:] / steps[:-1] == pytest.approx(np.full(len(steps) - 1, 1.5)) and 0.05 < steps[0] <= 0.1


# ---- Meshes


def test_spread_is_of_a_sample_and_over_a_scale():
    assert meshes._spread([1.0, 3.0]) == pytest.approx(math.sqrt(2) / 2)
    assert meshes._spread([-1.0, -3.0], 4.0) == pytest.approx(math.sqrt(2) / 4)


def test_stored_presses_are_those_of_their_fingers():
    """S_d is the deviation of the five gauges; gauges in mirrored places read the same."""
    made = meshes.fingers()
    assert [type(one.shape) for one in made.values()] == [Dome, Dome, Slab]
    default = Finger.default().gauges
    assert [one.gauges == default for one in made.values()] == [True, False, True]
    for name, one in made.items():
        given = meshes.MOVED.fingers[name]
        rows = np.array(given.stored)
        assert rows.shape == (len(meshes.MOVED.forces_gf), 8)
        assert one.shape.outer == given.axes_mm[0] and one.shape.bone == given.axes_mm[2]
        assert rows[:, 1:6].std(axis=1) == pytest.approx(rows[:, 0], rel=2e-3)
        assert (np.diff(rows[:, [0, 6, 7]], axis=0) > 0).all(), "a firmer press is deeper, wider and read more strongly"
        if one.gauges == default:
            assert rows[:, 1:6] == pytest.approx(rows[:, 5:0:-1])


def test_a_moved_finger_is_read_row_by_row(monkeypatch):
    """A row for each modulus and force, NaN where the contact leaves its patch."""

    def press(reduced, block, force, fidelity, friction):
        if force > 0.2:
            raise ContactRangeError("too far")
        return SimpleNamespace(sd=block.modulus, reading=np.arange(5), indentation=force, contact_area=7.0)

    model = SimpleNamespace(reduce=lambda: SimpleNamespace(gauge_names=tuple("abcde")))
    monkeypatch.setattr(meshes, "FingerModel", lambda one, mesh: model if (one, mesh) == ("finger", "mesh") else None)
    monkeypatch.setattr(meshes, "press", press)
    found = meshes.pressed("finger", "mesh", [0.1, 0.5], [10.0, 50.0])
    assert found.shape == (4, 8) and np.isnan(found[[1, 3]]).all()
    assert found[[0, 2], 0].tolist() == [0.1, 0.5] and (found[0, 1:6] == np.arange(5)).all()
    assert found[0, 6:] == pytest.approx([0.0980665, 7.0])


def test_a_flat_cell_is_flat_and_refused(monkeypatch):
    mesh, seen = cube(4), []
    assert meshes._refuses_flat_cell(mesh)
    monkeypatch.setattr(meshes, "refuse_unusable", seen.append)
    assert not meshes._refuses_flat_cell(mesh)
    crushed = volumes(seen[0].points, mesh.tets)[len(mesh.tets) // 2]
    assert crushed == pytest.approx(0, abs=1e-12)


# ---- Logs of the identification


def test_a_log_is_what_a_drawn_finger_feels():
    """Without noise a reading is gain x strain + lever x curvature + zero, of gains and levers in their ranges."""

    def felt(force, modulus, outer, inner):
        values = np.ones((len(force), 2, 5)) * [[[1000 * MICROSTRAIN], [0.0]]]
        return SimpleNamespace(values=values, indentation=2.0 * force)

    log = identification._log(
        SimpleNamespace(felt=felt), np.random.default_rng(3), forces_N=(0.1, 0.5), moduli_MPa=(0.2, 0.7), deep=True
    )
    own = identification.GIVEN.drawn
    assert log.force_N.tolist() == [0.1, 0.5, 0.1, 0.5] and log.modulus_MPa.tolist() == [0.2, 0.2, 0.7, 0.7]
    assert log.readings.shape == (4, 5) and log.gauge_names == ("g1", "g2", "g3", "g4", "g5")
    assert np.ptp(log.readings, axis=0).max() < 10 * own.noise_microstrain
    assert (np.abs(log.readings) < 1000 + 2 * own.zero_microstrain).all()
    assert log.indentation_mm == pytest.approx(2 * log.force_N + own.depth_zero_mm, abs=0.15)
