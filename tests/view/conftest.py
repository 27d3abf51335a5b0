"""One press of the default finger with its field, for all tests of pictures."""

from dataclasses import dataclass

import pytest

from papilla import fem
from papilla.finger import Finger
from papilla.mesh import build
from papilla.specimen import Block


@dataclass(frozen=True)
class Scene:
    """A finger, what it was reduced to, a press and its field."""

    finger: Finger
    model: fem.FingerModel
    reduced: fem.ReducedFinger
    specimen: Block
    press: fem.Press
    field: fem.Field


@pytest.fixture(scope="session")
def scene() -> Scene:
    """0.588 N on a 10 mm block of 0.51 MPa."""
    finger, specimen = Finger.default(), Block(0.51, 10)
    model = fem.FingerModel(finger, build(finger))
    reduced = fem.prepare(finger)
    press = fem.press(reduced, specimen, force=0.588, fidelity="contact")
    return Scene(finger, model, reduced, specimen, press, fem.recover(model, reduced, press))
