"""A family of fingers over the moduli of their layers, against fingers that were reduced one by one."""

import dataclasses

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.fem import press
from papilla.fem.reduction.family import family
from papilla.model.finger import Finger, Layer
from papilla.model.materials import NeoHookean
from papilla.model.specimen import Block

SIZE_MM = 2.8


@pytest.fixture(scope="module")
def relatives():
    return family(Finger.default(), size_mm=SIZE_MM)


@pytest.mark.parametrize("outer, inner", [(1.0, 0.05), (0.04, 0.05)])
def test_ratios_beyond_the_family_are_refused(relatives, outer, inner):
    with pytest.raises(InputError, match="outer over inner modulus"):
        relatives.at(outer, inner)


def test_cards_and_elastic_bones_are_refused():
    card = dataclasses.replace(Finger.default(), outer=Layer.of(NeoHookean(0.05), 0.4999))
    with pytest.raises(InputError, match="material card"):
        family(card, size_mm=SIZE_MM)
    boned = dataclasses.replace(Finger.default(), bone=Layer(3000.0, 0.37))
    with pytest.raises(InputError, match="rigid bone"):
        family(boned, size_mm=SIZE_MM)


@pytest.mark.parametrize("ratio", [1.45, 4.6, 13.1])
def test_between_its_ratios_it_is_the_finger_reduced_by_itself(dome, ratio):
    """Compliance, rows, and S_d and indentation of a press, on a coarse mesh."""
    few = family(Finger.default(), mesh=dome(Finger.default(), outer_layers=1, inner_layers=2))
    inner = Finger.default().inner.modulus
    alone, found = few.model(ratio).reduce(), few.at(ratio * inner, inner)
    for name in ("compliance", "rows"):
        expected = getattr(alone, name)
        assert np.abs(getattr(found, name) - expected).max() < 1e-4 * np.abs(expected).max()
    there, here = (press(one, Block(0.3, 10), force=0.5, fidelity="contact", friction=0) for one in (alone, found))
    assert (here.sd, here.indentation) == pytest.approx((there.sd, there.indentation), rel=4e-5)
