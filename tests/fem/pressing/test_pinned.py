"""Numbers of the default finger, pinned: whoever changes one changes a result, and says so in CHANGELOG.

What the numbers should be is tested elsewhere, against closed forms and better methods with bounds of percents; these
pins find what such bounds let through.
"""

from dataclasses import replace

import pytest

from papilla.fem import press
from papilla.fem.pressing.off_apex import transported_readings
from papilla.model.specimen import Block, HalfSpace, Sphere

BLOCK = Block(0.51, 10)

# Specimen, load and options -> S_d in microstrain, indentation in mm, area in mm2 and peak pressure in MPa
PRESSES = {
    "hertz": (BLOCK, {"force": 0.2, "fidelity": "hertz"}),
    "hertz, light": (BLOCK, {"force": 1e-4, "fidelity": "hertz"}),
    "hertz, soft": (HalfSpace(0.03), {"indentation": 0.8, "fidelity": "hertz"}),
    "hertz, ball": (Sphere(5.0, 12.0), {"force": 0.1, "fidelity": "hertz"}),
    "contact, light": (BLOCK, {"force": 0.02, "fidelity": "contact"}),
    "contact, thin": (Block(0.05, 3), {"force": 0.3, "fidelity": "contact"}),
    "contact, ball": (Sphere(1.0, 5.0), {"indentation": 0.7, "fidelity": "contact"}),
    "stuck": (BLOCK, {"force": 0.2, "fidelity": "contact", "friction": "stick"}),
    "large strain": (BLOCK, {"force": 0.3, "friction": 0}),
    "large strain, stuck": (Block(0.1, 10), {"indentation": 0.9}),
    "large strain, beyond": (BLOCK, {"force": 1.4}),
    "friction": (BLOCK, {"force": 0.05, "fidelity": "contact", "friction": 0.05}),
    "friction, large strain": (BLOCK, {"force": 0.08, "friction": 0.1}),
}
PINNED = {
    "hertz": (14880.6406, 0.440463664, 44.4334037, 0.00632100556),
    "hertz, light": (13.6177424, 0.00207756985, 0.222028555, 0.00067784846),
    "hertz, soft": (8199.7985, 0.8, 89.6500136, 0.00259854846),
    "hertz, ball": (11798.1247, 0.379207488, 8.12970219, 0.0185503818),
    "contact, light": (2389.14302, 0.0869224928, 7.93611648, 0.00378737337),
    "contact, thin": (16388.2342, 0.606883783, 84.6893316, 0.00564556524),
    "contact, ball": (19836.725, 0.7, 7.51857881, 0.0335110442),
    "stuck": (14266.4134, 0.438395346, 44.3245811, 0.00642300039),
    "large strain": (19700.5654, 0.582693788, 61.9267953, 0.00667400257),
    "large strain, stuck": (20305.3604, 0.9, 118.671164, 0.00584720115),
    "large strain, beyond": (35994.679, 1.46277058, 192.90981, 0.00904927777),
    "friction": (5276.08679, 0.168113539, 15.2341819, 0.00484302102),
    "friction, large strain": (7786.94205, 0.236066947, 22.0867532, 0.00543884925),
    "moved": (-3752.29561, -11951.1677, 18267.6627, -11415.766, -7535.69871),
    "off the apex": (-4158.46747, -12475.268, 19016.1467, -5890.09332, -7400.59585),
}


def told(found):
    return found.sd, found.indentation, found.contact_area, found.peak_pressure


@pytest.mark.parametrize("name", PRESSES)
def test_presses(reference, name):
    specimen, options = PRESSES[name]
    assert told(press(reference, specimen, **options)) == pytest.approx(PINNED[name], rel=1e-6)


def test_moved_contacts(coarse_model, coarse):
    traction = press(coarse, BLOCK, force=0.3, fidelity="contact").traction
    found = transported_readings(coarse_model, coarse.patch, traction[None], (2.5,)).ravel()
    assert found == pytest.approx(PINNED["moved"], rel=1e-6)


def test_contacts_off_the_apex(coarse_model, reference):
    found = press(coarse_model.reduce((2.0, 1.0)), BLOCK, force=0.3, fidelity="contact")
    assert found.reading == pytest.approx(PINNED["off the apex"], rel=1e-6)
    beside = press(replace(reference, at=(1.0, 0.0)), BLOCK, force=0.3, fidelity="contact")
    assert beside.status.endswith("; off the apex the mesh is coarser, so readings are accurate to 5 %")
