"""Presses with friction on a finger: against an outside reference, and what must hold of any press."""

import dataclasses

import numpy as np
import pytest

from papilla import Block, PapillaError
from papilla.core.errors import ContactRangeError, InputError
from papilla.fem import press
from papilla.model.specimen import Specimen

BLOCK = Block(0.2, 10)


@pytest.mark.parametrize("friction", ["stick", 0.05])
def test_beside_the_apex_by_nothing_is_the_apex(coarse, coarse_model, friction):
    """Four parities and the whole patch against one and its quarter; and no net shear."""
    beside = coarse_model.reduce((1e-9, 0.0))
    one, other = (press(finger, BLOCK, force=0.3, friction=friction, fidelity="contact") for finger in (coarse, beside))
    assert other.reading == pytest.approx(one.reading, rel=1e-5)
    assert other.indentation == pytest.approx(one.indentation, rel=1e-6)
    assert np.abs(other.shear @ beside.patch.mass).max() < 1e-5 * 0.3


def test_rubber_on_rubber_sticks_and_lowers_sd(reference):
    """By 3 to 5 % at most, and a friction of 0.3 is already full stick (an outside reference: -3.0 on average, -4.2 at
    most, largest ratio of tractions 0.22)."""
    changes = []
    for modulus in (0.1, 0.5):
        specimen = Block(modulus, 10)
        for force in (0.2, 0.4, 0.6, 1.0):
            plain = press(reference, specimen, force=force, fidelity="contact")
            stuck = press(reference, specimen, force=force, friction="stick", fidelity="contact")
            rough = press(reference, specimen, force=force, friction=0.3, fidelity="contact")
            changes.append(stuck.sd / plain.sd - 1)
            assert rough.sd == pytest.approx(stuck.sd, rel=1e-9)
            ratio = np.hypot(*stuck.shear)[stuck.active] / stuck.pressure[stuck.active]
            assert ratio.max() < 0.25
    assert -0.05 < min(changes) < -0.04 and -0.04 < np.mean(changes) < -0.03 and max(changes) < -0.02


def test_friction_between_none_and_stick(reference):
    scene = {"force": 0.4, "fidelity": "contact"}
    found = [press(reference, BLOCK, friction=value, **scene) for value in (0, 0.02, 0.05, "stick")]
    sd = [one.sd for one in found]
    assert sorted(sd, reverse=True) == sd
    assert found[0].shear is None and "friction" not in found[0].status
    assert "contact: friction 0.02: " in found[1].status and "nodes slip, the force grown from" in found[1].status
    assert found[3].status.startswith("contact: stuck from the moment of contact, the force grown from first touch in")
    for one in found:
        assert one.force == pytest.approx(0.4) and one.force_balance < 1e-9
    slid = found[2]
    assert (np.hypot(*slid.shear) <= 0.05 * slid.pressure * (1 + 1e-6)).all()


class Glued(Specimen):
    """A specimen that gives its normal compliance alone, and not a half-space's."""

    def compliance(self, surface):
        return 2 * surface.half_space / self.contact_modulus


def test_what_cannot_rub_is_refused(coarse):
    with pytest.raises(InputError, match='friction must be a number of at least 0 or "stick", got -0.1'):
        press(coarse, BLOCK, force=0.3, friction=-0.1)
    with pytest.raises(InputError, match="hertz has no friction"):
        press(coarse, BLOCK, force=0.3, friction=0.3, fidelity="hertz")
    bare = dataclasses.replace(coarse, tangential_source=None)
    with pytest.raises(InputError, match="has no tangential compliance, which friction needs"):
        press(bare, BLOCK, force=0.3, friction="stick")
    with pytest.raises(InputError, match="traction_compliance, which friction needs, does not fit compliance"):
        press(coarse, Glued(0.2), force=0.3, friction="stick")
    with pytest.raises(ContactRangeError, match="makes no contact on this mesh"):
        press(coarse, BLOCK, indentation=1e-6, friction="stick")
    with pytest.raises(PapillaError, match="rim|beyond the model"):
        press(coarse, BLOCK, force=500.0, friction="stick")
