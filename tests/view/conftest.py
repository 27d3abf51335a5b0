"""One press of the default finger with its field, for all tests of pictures."""

from dataclasses import dataclass

import made_up_press
import pytest

from papilla import fem
from papilla.mesh import build
from papilla.model.finger import Finger
from papilla.model.specimen import Block
from papilla.view import strain_field, turning


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


@pytest.fixture
def cube():
    """A field on a cube of side 2."""
    return made_up_press.cube()


@pytest.fixture
def bump():
    """Fields of five gauges on a dome of points."""
    return made_up_press.bump()


@pytest.fixture
def made_up_parts(monkeypatch):
    """Made-up geometry of every scene, for `strain_figure` and `strain_html`, which then draw without VTK."""
    monkeypatch.setattr(strain_field, "drawn", made_up_press.drawn)
    monkeypatch.setattr(turning, "drawn", made_up_press.drawn)
    monkeypatch.setattr(strain_field, "use_offscreen_window", lambda: False)
