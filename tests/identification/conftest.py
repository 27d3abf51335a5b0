"""The made-up finger, its sweep and its calibration; and presses of drawn fingers on a coarse mesh."""

import pytest
from drawn_finger import BLOCK, SIZE_MM
from made_up_finger_fixtures import calibration as calibration
from made_up_finger_fixtures import made_up as made_up
from made_up_finger_fixtures import truth as truth

from papilla.fem.pressing.response import response
from papilla.identification.posing import family_of
from papilla.model.finger import Finger


@pytest.fixture(scope="session")
def smooth():
    """The response of the default finger's family to a block."""
    return response(family_of(Finger.default(), size_mm=SIZE_MM), BLOCK)
