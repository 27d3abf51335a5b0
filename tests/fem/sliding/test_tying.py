"""A section at rest on a flat is the finger pressed in three dimensions: depth, force and every gauge."""

import numpy as np
import pytest

from papilla import Grating
from papilla.core.errors import ContactRangeError
from papilla.fem import Motion, prepare, press, slide
from papilla.fem.sliding.tying import RIGID_FLAT, refuse_end
from papilla.model.textures import Flat

STILL = Motion.steady(0.0, 0.01)


@pytest.mark.slow
@pytest.mark.parametrize("load", [{"force": 0.3}, {"indentation": 0.4}])
@pytest.mark.parametrize("friction", [None, 0.0, 0.3])
def test_at_rest_it_is_a_press(finger, coarse, load, friction):
    """What `papilla.fem.press` says of the same scene, whatever the load and the friction are told as."""
    true = press(prepare(finger), RIGID_FLAT, friction=friction, **load)
    held = {"force": load.get("force"), "depth": load.get("indentation")}
    found = slide(finger, Flat(), STILL, section=coarse, friction=friction, dynamics="quasi-static", **held)
    np.testing.assert_allclose(found.readings, np.broadcast_to(true.reading, found.readings.shape), rtol=1e-6)
    np.testing.assert_allclose(found.depth_mm, true.indentation, rtol=1e-6)
    np.testing.assert_allclose(found.force_N, true.force, rtol=1e-6)
    assert found.tied.press.friction == true.friction
    assert found.friction == (friction or 0.0)


@pytest.mark.slow
def test_what_a_texture_changes_is_the_sections_own(finger, coarse):
    """The tie adds a constant under a held force: the swing over a grating is that of the untied section."""
    scene = {"section": coarse, "force": 0.3, "friction": 0.0, "dynamics": "quasi-static"}
    motion = Motion.steady(36.0, 0.1)
    tied = slide(finger, Grating(0.9, 0.9, 0.3), motion, **scene)
    alone = slide(finger, Grating(0.9, 0.9, 0.3), motion, **scene, length_mm=tied.length_mm)
    assert alone.tied is None
    np.testing.assert_allclose(tied.readings - alone.readings, np.tile(tied.tied.lacking, (100, 1)), rtol=1e-6)


def test_a_section_whose_contact_reaches_its_end_is_refused(coarse):
    for end in (0, -1):
        pressing = np.zeros(len(coarse.x))
        pressing[len(pressing) // 2] = 1.0
        refuse_end(pressing, coarse)
        pressing[end] = 1e-3
        with pytest.raises(ContactRangeError, match=r"reaches the end of its patch, \S+ mm from the apex: press less"):
            refuse_end(pressing, coarse)
