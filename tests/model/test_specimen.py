"""Specimens: frozen, compared by value, and never with a value that cannot be."""

import dataclasses
import math

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.model.specimen import Block, Grating, HalfSpace, Sphere

GOOD = (HalfSpace(0.5), Block(0.5, 10.0), Sphere(0.5, 8.0), Grating(1.5, 0.5, 0.3))
each = pytest.mark.parametrize("specimen", GOOD, ids=lambda specimen: type(specimen).__name__)


@each
def test_specimens_are_values(specimen):
    assert specimen == dataclasses.replace(specimen) and hash(specimen) == hash(dataclasses.replace(specimen))
    with pytest.raises(dataclasses.FrozenInstanceError):
        specimen.modulus = 1.0
    assert len({*GOOD}) == 4


@each
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf, "1", None])
def test_every_length_and_modulus_is_positive_and_finite(specimen, value):
    for item in dataclasses.fields(specimen):
        if item.name in ("nu", "form", "flank"):
            continue
        with pytest.raises(InputError, match=rf"{item.name} .*must be (greater than 0|finite|a number), got "):
            dataclasses.replace(specimen, **{item.name: value})


@pytest.mark.parametrize("specimen", GOOD[:3])
@pytest.mark.parametrize("nu", [-0.01, 0.51, math.nan, "0.3"])
def test_poissons_ratio_is_checked(specimen, nu):
    assert specimen.nu == 0.495
    assert dataclasses.replace(specimen, nu=0.5).nu == 0.5
    with pytest.raises(InputError, match="specimen nu must "):
        dataclasses.replace(specimen, nu=nu)


@pytest.mark.parametrize("changed", [{"form": "square"}, {"flank": -0.1}, {"flank": 0.8}, {"flank": math.nan}])
def test_the_section_of_a_grating_is_checked(changed):
    with pytest.raises(InputError, match=r"grating (form|flank \(mm\)) must "):
        Grating(1.5, 0.5, 0.3, **changed)


def test_the_section_of_a_grating():
    x = np.array([0.0, 0.2, 0.3, 0.55, 1.0, 2.0])
    np.testing.assert_allclose(Grating(1.5, 0.5, 0.3).recess(x), [0, 0, 0.3, 0.3, 0.3, 0])
    np.testing.assert_allclose(Grating(1.5, 0.5, 0.3, flank=0.1).recess(x), [0, 0, 0.15, 0.3, 0.3, 0], atol=1e-12)
    np.testing.assert_allclose(Grating(1.5, 0.5, 0.3, "sine").recess(np.array([0.0, 0.5, 1.0])), [0, 0.15, 0.3])


def test_wavelength_of_a_grating_is_groove_and_ridge():
    assert Grating(1.5, 0.9, 0.3).wavelength == pytest.approx(2.4)
