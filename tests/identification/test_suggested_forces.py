"""Suggested presses are presses that the finger can make, of any size and hardness."""

import pytest
from scaled_finger import scaled_finger

from papilla import fem
from papilla.core.errors import InputError
from papilla.core.units import gf_to_newton
from papilla.design.geometry import borrow
from papilla.identification import suggest_presses
from papilla.mesh import default_size_mm
from papilla.model.finger import Finger

MODULI = (0.05, 0.72)


@pytest.mark.slow
@pytest.mark.parametrize("length, stress", [(0.35, 1.0), (1.5, 0.3)])
def test_each_suggested_press_can_be_pressed(length, stress, monkeypatch, tmp_path):
    """Also if the heaviest candidates are far too heavy."""
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path))
    finger = scaled_finger(Finger.default(), length, stress)
    borrow(finger, Finger.default())
    size, moduli = 4 * default_size_mm(finger), tuple(stress * modulus for modulus in MODULI)
    reduced = fem.prepare(finger, size_mm=size)
    heavy = tuple(length**2 * stress * gf_to_newton(gf) for gf in (50, 1000, 20000))
    for forces in (None, heavy):
        suggestion = suggest_presses(finger, 3, moduli, forces=forces, size_mm=size)
        for force, modulus in zip(suggestion.force_N, suggestion.modulus_MPa, strict=True):
            pressed = fem.press(reduced, finger.bench.specimen(modulus), force=force)
            assert pressed.large_strain and pressed.sd > 0
    with pytest.raises(InputError, match="no press to suggest: the model of this finger covers none"):
        suggest_presses(finger, 3, moduli, forces=heavy[2:], size_mm=size)
