"""Specimens: frozen, compared by value, and never with a value that cannot be."""

import dataclasses
import math

import pytest

from papilla.errors import InputError
from papilla.specimen import Block, Grating, HalfSpace, Sphere

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
        if item.name == "nu":
            continue
        with pytest.raises(InputError, match=rf"{item.name} .*must be (greater than 0|finite|a number), got "):
            dataclasses.replace(specimen, **{item.name: value})


@each
@pytest.mark.parametrize("nu", [-0.01, 0.51, math.nan, "0.3"])
def test_poissons_ratio_is_checked(specimen, nu):
    if isinstance(specimen, Grating):
        assert not hasattr(specimen, "nu"), "a grating is rigid"
        return
    assert specimen.nu == 0.495
    assert dataclasses.replace(specimen, nu=0.5).nu == 0.5
    with pytest.raises(InputError, match="specimen nu must "):
        dataclasses.replace(specimen, nu=nu)


def test_wavelength_of_a_grating_is_groove_and_ridge():
    assert Grating(1.5, 0.9, 0.3).wavelength == pytest.approx(2.4)
