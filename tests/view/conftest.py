"""One press of the default finger with its field, on a coarse mesh, for all tests of pictures."""

from dataclasses import dataclass

import pytest

from papilla import fem
from papilla.mesh import DEFAULT_SIZE_MM, build
from papilla.model.finger import Finger
from papilla.model.specimen import Block
from papilla.view import render

SIZE_MM = 2.0


@dataclass(frozen=True)
class Scene:
    """A finger, what it was reduced to, a press and its field."""

    finger: Finger
    model: fem.FingerModel
    reduced: fem.ReducedFinger
    specimen: Block
    press: fem.Press
    field: fem.Field


def pressed(size_mm: float) -> Scene:
    """0.588 N on a 10 mm block of 0.51 MPa, on a mesh of some element size."""
    finger, specimen = Finger.default(), Block(0.51, 10)
    model = fem.FingerModel(finger, build(finger, size_mm=size_mm))
    reduced = fem.prepare(finger, size_mm=size_mm)
    press = fem.press(reduced, specimen, force=0.588, fidelity="contact")
    return Scene(finger, model, reduced, specimen, press, fem.recover(model, reduced, press))


@pytest.fixture(scope="session")
def scene() -> Scene:
    """The press on a coarse mesh."""
    return pressed(SIZE_MM)


@pytest.fixture(scope="session")
def fine_scene() -> Scene:
    """The press on the default mesh."""
    return pressed(DEFAULT_SIZE_MM)


@pytest.fixture(params=[pytest.param("vtk", marks=pytest.mark.slow), "matplotlib"])
def renderer(request, monkeypatch) -> str:
    """VTK where it can render, and matplotlib alone as where VTK has no window."""
    render.use_offscreen_window.cache_clear()
    if request.param == "matplotlib":
        monkeypatch.setenv(render.WINDOW_VARIABLE, "no such window")
    elif not render.use_offscreen_window():
        pytest.skip("VTK cannot render on this machine")
    assert render.use_offscreen_window() == (request.param == "vtk")
    yield request.param
    render.use_offscreen_window.cache_clear()
