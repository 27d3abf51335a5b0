"""Foils on the interface, and the finger's own weight."""

from functools import cache

import numpy as np
import pytest
from skfem import Basis, ElementVector, LinearForm

from papilla.errors import InputError
from papilla.fem import FingerModel, press
from papilla.fem.discrete.elements import SYMMETRIC
from papilla.fem.pressing.effects import FoiledModel, weight_readings
from papilla.fem.reduction.gauges import gauge_functionals, gauge_weights
from papilla.finger import Finger
from papilla.specimen import Block


@pytest.fixture(scope="module")
def coarse(dome):
    finger = Finger.default()
    return finger, dome(finger, outer_layers=1, inner_layers=2)


@pytest.fixture(scope="module")
def foiled(coarse):
    """Function: the model with foils of a membrane (N/mm) and a bending (N mm) stiffness.

    Bending is no part of the matrix, so models of one membrane share their factors.
    """
    factors = {}

    def make(membrane, bending):
        model = FoiledModel(*coarse, membrane, bending)
        model._factors = factors.setdefault(membrane, model._factors)
        return model

    return make


@pytest.fixture(scope="module")
def reduced(foiled):
    """Function: the finger with such foils, reduced once at its apex."""
    return cache(lambda membrane, bending: foiled(membrane, bending).reduce())


def pressed(finger):
    return press(finger, Block(0.3, 10), force=0.6, fidelity="contact")


def test_a_foil_without_stiffness_is_none(coarse, reduced):
    plain = pressed(FingerModel(*coarse).reduce())
    for stiffness in ((0.0, 0.0), (0.0, 1e-12)):
        assert pressed(reduced(*stiffness)).values == pytest.approx(plain.values, rel=1e-5)


def test_membranes_take_the_strain_and_plates_the_curvature(reduced):
    plain, membrane, plate = (pressed(reduced(*stiffness)) for stiffness in ((0.0, 0.0), (300.0, 0.0), (0.0, 0.5)))
    assert np.abs(membrane.strain).max() < 0.1 * np.abs(plain.strain).max()
    assert np.abs(plate.curvature).max() < 0.8 * np.abs(plain.curvature).max()
    assert plate.strain == pytest.approx(plain.strain, rel=0.1, abs=0.01 * np.abs(plain.strain).max())
    assert membrane.indentation < plain.indentation


def test_a_foil_makes_nothing_softer(reduced):
    """The work of any tractions is less with springs."""
    plain, *foiled = (reduced(*one).compliance for one in ((0.0, 0.0), (300.0, 0.0), (0.0, 0.5)))
    for one in foiled:
        lost = np.linalg.eigvalsh(plain - one)
        assert lost[0] > -1e-9 * lost[-1] and lost[-1] > 1e-5 * np.linalg.eigvalsh(plain)[-1]


def test_a_rigid_plate_does_not_bend(reduced):
    """Without bending, 1 / k of the curvature is left for a spring that is k times as stiff."""
    plain, stiff, stiffer = (pressed(reduced(0.0, bending)) for bending in (0.0, 1e4, 2e4))
    assert np.abs(stiff.curvature).max() < 1e-2 * np.abs(plain.curvature).max()
    assert stiffer.curvature == pytest.approx(stiff.curvature / 2, rel=0.01)


def test_a_foil_is_symmetric_beside_the_apex_too(foiled):
    """The influence of a load on one side is that of its mirror image on the mirrored gauges: all parities agree."""
    model = foiled(300.0, 0.25)
    right, left = (press(model.reduce((x, 0.0)), Block(0.3, 10), force=0.3, fidelity="contact") for x in (3.0, -3.0))
    assert right.reading == pytest.approx(left.reading[::-1], rel=1e-6, abs=1e-6 * np.abs(right.reading).max())
    middle = press(model.reduce((1e-6, 0.0)), Block(0.3, 10), force=0.3, fidelity="contact")
    apex = press(model.reduce(), Block(0.3, 10), force=0.3, fidelity="contact")
    assert middle.reading == pytest.approx(apex.reading, rel=1e-4, abs=1e-4 * np.abs(apex.reading).max())


def test_stiffness_is_not_negative(coarse):
    with pytest.raises(InputError, match=r"foil membrane \(N/mm\)"):
        FoiledModel(*coarse, -1.0)


def test_weight_is_what_a_body_force_does(coarse):
    """By reciprocity in the product; here the body force is solved for."""
    model = FingerModel(*coarse)
    found = weight_readings(model, 1.2)
    space = model.space
    basis = Basis(space.skmesh, ElementVector(space.scalar_element), intorder=6)
    force = LinearForm(lambda v, w: -9.80665e-6 * 1.2 * v[2]).assemble(basis)
    moved = model._solve(SYMMETRIC, force[:, None])
    values = model.rows(gauge_functionals(model.finger, model.surfaces["interface"]), SYMMETRIC) @ moved
    direct = 1e6 * (gauge_weights(model.finger) * values.reshape(2, -1)).sum(axis=0)
    assert np.abs(direct).max() > 10
    assert found == pytest.approx(direct, rel=1e-6)


def test_a_backing_covers_what_lies_on_it_and_nothing_on_the_far_side(foiled):
    """Inside of its rectangle, down to its longer side below its site: there the interface of a slim finger returns."""
    model = foiled(0.0, 0.0)
    gauge, frame = model._frames[2]
    length, width = gauge.backing_mm
    assert length > width
    places = [(0, 0, 0), (0.49, 0, 0), (0.51, 0, 0), (0, 0.49, 0), (0, 0.51, 0), (0, 0, -0.99), (0, 0, -1.01)]
    points = np.array([frame.site + length * a * frame.along + width * b * frame.across + length * c * frame.normal
                       for a, b, c in places])  # fmt: skip
    # A gauge on both mirror planes covers its middle once by each of its four images
    assert (model._cover(points.T[:, :, None])[:, 0] / 4).tolist() == [1, 1, 0, 1, 0, 1, 0]
