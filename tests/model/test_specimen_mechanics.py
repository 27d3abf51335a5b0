"""Shapes and mechanics of specimens and textures: closed forms, derivatives, limits of what the model covers."""

import math
from dataclasses import replace

import numpy as np
import pytest

from papilla import Block, Grating, HalfSpace, Sphere
from papilla.core.errors import ContactRangeError, InputError
from papilla.model.materials import Ogden
from papilla.model.specimen import Specimen
from papilla.model.textures import Flat, MeasuredProfile


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_a_small_contact_feels_the_plane_strain_modulus(nu):
    for specimen in (HalfSpace(0.3, nu=nu), Block(0.3, 10.0, nu=nu), Sphere(0.3, 5.0, nu=nu)):
        assert specimen.contact_modulus == pytest.approx(0.3 / (1 - nu**2))


@pytest.mark.parametrize("radius", [0.5, 4.0, 300.0])
def test_a_ball_has_the_height_slope_and_curvature_of_a_circle(radius):
    points = radius * np.random.default_rng(5).uniform(-0.6, 0.6, (40, 2))
    ball, square = Sphere(0.2, radius), (points**2).sum(axis=1)
    height = radius - np.sqrt(radius**2 - square)
    assert ball.gap(points) == pytest.approx(height, rel=1e-9)
    assert ball.slope(points) == pytest.approx(points / np.sqrt(radius**2 - square)[:, None], rel=1e-9)
    assert Specimen.slope(ball, points) == pytest.approx(ball.slope(points), rel=1e-5)
    assert ball.curvature == pytest.approx((1 / radius, 1 / radius))
    beside = np.array([[1.5 * radius, 0.0], [radius, radius]])
    assert (ball.gap(beside) > 100 * radius).all() and not ball.slope(beside).any()
    ball.refuse(0.1, 0.7 * radius)
    with pytest.raises(ContactRangeError, match="45 degrees"):
        ball.refuse(0.1, 0.72 * radius)


def test_slopes_of_a_shape_of_ones_own_come_from_its_gap():
    class Saddle(Specimen):
        def gap(self, points):
            return 0.1 * points[:, 0] ** 2 - 0.3 * points[:, 0] * points[:, 1]

    points = np.random.default_rng(6).uniform(-3, 3, (30, 2))
    expected = np.column_stack([0.2 * points[:, 0] - 0.3 * points[:, 1], -0.3 * points[:, 0]])
    assert Saddle(0.1).slope(points) == pytest.approx(expected, abs=1e-6)
    assert Saddle(0.1).curvature is None and HalfSpace(0.1).curvature == (0.0, 0.0)
    assert not HalfSpace(0.1).slope(points).any()


def test_a_class_that_changes_its_compliance_is_computed_for_every_modulus():
    class Doubled(HalfSpace):
        def compliance(self, surface):
            return 2 * super().compliance(surface)

    assert not Doubled.elastic and Doubled(0.3).unit.modulus == 0.3
    for specimen in (HalfSpace(0.3), Block(0.3, 7.0), Sphere(0.3, 7.0)):
        assert specimen.elastic and specimen.unit == replace(specimen, modulus=1.0)


def test_a_block_gives_way_by_half_its_thickness_at_most():
    Block(0.1, 8.0).refuse(3.99, 2.0)
    with pytest.raises(ContactRangeError, match="more than 50 %"):
        Block(0.1, 8.0).refuse(4.01, 2.0)
    assert "8 mm thick" in Block(0.1, 8.0).words and "sliding" in Block(0.1, 8.0, bonded=False).words
    assert Block(0.1, 8.0).detail == 2.5 * 8 and Sphere(0.1, 8.0).detail == 4 and HalfSpace(0.1).detail == math.inf


class Springs:
    """A patch of two nodes far apart: what it is asked for comes back, so that the parts can be told apart."""

    half_space = np.array([[2.0, 0.5], [0.5, 2.0]])

    def kernel(self, kernel):
        return kernel(np.array([[0.0, 5.0], [5.0, 0.0]]))

    def half_space_tractions(self, nu):
        return np.eye(6) * (1 - nu**2)

    def green_tractions(self, green):
        offsets = np.array([[[0.0, 0.0], [5.0, 0.0]], [[-5.0, 0.0], [0.0, 0.0]]])
        return green(offsets).transpose(2, 0, 3, 1).reshape(6, 6)


def test_a_thin_block_is_stiffer_and_a_thick_one_a_half_space():
    patch, half_space = Springs(), HalfSpace(0.2)
    for compliance, thick in (("compliance", 3e-3), ("traction_compliance", 3e-3)):
        free = getattr(half_space, compliance)(patch)
        layers = [getattr(Block(0.2, thickness), compliance)(patch) for thickness in (2.0, 6.0, 4000.0)]
        stiffness = [layer[0, 0] for layer in layers]
        assert stiffness == sorted(stiffness) and stiffness[0] < 0.9 * free[0, 0]
        assert layers[2] == pytest.approx(free, abs=thick * free[0, 0])
        assert getattr(Block(0.4, 6.0), compliance)(patch) == pytest.approx(layers[1] / 2)
    assert half_space.compliance(patch) == pytest.approx(patch.half_space * (1 - half_space.nu**2) / 0.2)
    with pytest.raises(InputError, match="bonded"):
        Block(0.2, 6.0, bonded=False).traction_compliance(patch)


def test_a_profile_is_measured_from_its_highest_point():
    x, height = np.linspace(0, 4, 41), np.random.default_rng(7).uniform(-0.2, 0.3, 41)
    profile = MeasuredProfile(x, height)
    assert profile.recess(x) == pytest.approx(height.max() - height) and profile.recess(x).min() == 0
    middles = (x[1:] + x[:-1]) / 2
    assert profile.recess(middles) == pytest.approx((profile.recess(x)[1:] + profile.recess(x)[:-1]) / 2)
    assert profile.span == (0, 4) and profile.wavelength is None
    assert not Flat().recess(x).any() and Flat().wavelength is None
    assert Grating(groove=1.5, ridge=0.5, depth=0.2).wavelength == 2.0


@pytest.mark.parametrize(
    ("x", "height", "message"),
    [
        ([0, 1, 2, 3, 8.1], [0.0] * 5, "gap from x_mm 3 to 8.1"), ([0, 2.1, 4.2], [0, 1, 0], "in mm"),
        ([0, 1, 2], [0, 20.1, 0], "in mm"), ([0, 0.4, 0.9], [0, 0.1, 0], "shorter than a contact"),
        ([0, 1], [0, 1], "three points"), ([0, 1, 1], [0, 1, 2], r"point 3"), ([0, 1, math.nan], [0, 1, 2], "point 3"),
    ],
)  # fmt: skip
def test_what_is_no_profile_is_refused(x, height, message):
    with pytest.raises(InputError, match=message):
        MeasuredProfile(np.array(x), np.array(height))


def test_limits_of_a_profile_are_allowed():
    MeasuredProfile(np.array([0.0, 1, 2, 3, 8.0]), np.array([0.0, 20, 0, 0, 0]))
    MeasuredProfile(np.array([0.0, 2, 4]), np.zeros(3))


@pytest.mark.parametrize("alpha", [-2.0, 1.3, 4.0])
def test_an_undeformed_rubber_has_no_energy_and_others_have(alpha):
    card = Ogden(0.1, alpha)
    assert card.energy(np.ones(3)) == pytest.approx(0, abs=1e-15)
    stretches = np.random.default_rng(8).uniform(0.7, 1.4, (20, 2))
    whole = np.column_stack([stretches, 1 / stretches.prod(axis=1)])
    assert (card.energy(whole) > 0).all()
    # By Hooke: mu times the sum of the squared logarithmic strains
    assert card.energy(np.exp(1e-4 * np.array([1, -0.5, -0.5]))) == pytest.approx(0.1 * 1.5e-8, rel=1e-2)
