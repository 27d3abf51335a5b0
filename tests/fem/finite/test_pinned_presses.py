"""Presses at finite strain on a very coarse mesh, pinned: whoever changes one changes a result, and says so in
CHANGELOG.

What the numbers should be is tested elsewhere, against the linear limit, work and second paths; these pins find what
bounds of percents let through.
"""

import math

import pytest

from papilla.fem import press_finite
from papilla.fem.finite import pressing
from papilla.model.finger import Finger
from papilla.model.materials import Ogden
from papilla.model.specimen import Block, HalfSpace, Sphere

PRESSES = {
    "by depth": (Block(0.3, 10), {"indentation": 0.7}),
    "another law": (Sphere(0.5, 20.0), {"force": 0.3, "materials": {"outer": Ogden(0.045, 4.0)}}),
    "stuck": (Block(0.3, 10), {"force": 0.3, "friction": "stick"}),
    "friction": (HalfSpace(0.5), {"force": 0.4, "friction": 0.1}),
    "beside the apex": (HalfSpace(0.5), {"force": 0.3, "at": (3.0, 0.0)}),
}
# S_d in microstrain, indentation in mm, area in mm2, peak pressure in MPa and force in N; Newton steps and load steps
PINNED = {
    "by depth": ((23562.5694, 0.7, 74.105341, 0.0162043317, 0.335278651), (11, 1)),
    "another law": ((23003.8464, 0.804251793, 18.0864811, 0.0165869744, 0.3), (8, 1)),
    "stuck": ((22244.0004, 0.667573604, 74.1462068, 0.0163418928, 0.3), (55, 16)),
    "friction": ((26563.2412, 0.774277869, 74.0594367, 0.0173400059, 0.4), (59, 16)),
    "beside the apex": ((6315.66145, 0.590973747, 46.2619907, 0.00887803346, 0.3), (8, 1)),
}


@pytest.fixture(scope="module")
def coarser(dome):
    return Finger.default(), dome(Finger.default(), outer_layers=1, inner_layers=2)


@pytest.mark.parametrize("name", PRESSES)
def test_presses(coarser, name):
    specimen, options = PRESSES[name]
    found = press_finite(*coarser, specimen, **options)
    told = found.sd, found.indentation, found.contact_area, found.peak_pressure, found.force
    numbers, (steps, loads) = PINNED[name]
    assert told == pytest.approx(numbers, rel=1e-6)
    made = [int(word) for word in found.status.split(",")[0].split() if word.isdigit()]
    friction = options.get("friction", 0.0)
    assert (found.fidelity, found.large_strain, found.modulus) == ("finite", True, specimen.modulus)
    assert found.friction == (math.inf if friction == "stick" else friction)
    assert found.force_balance == 0 if "indentation" in options else found.force_balance < 1e-7
    assert not found.resolved and "; mesh too coarse for this light press: a contact radius of" in found.status
    # Rounding may take a step more or less
    assert made == [pytest.approx(steps, abs=2), loads]


def test_a_press_that_the_mesh_resolves_has_no_remark(coarser, monkeypatch):
    monkeypatch.setattr(pressing, "too_coarse", lambda *_: None)
    found = press_finite(*coarser, HalfSpace(0.5), force=0.2)
    assert found.resolved and found.status.split("; ")[1:] == [
        "laws stable over the strains reached, stretches up to 1.03"
    ]
