"""Presses moved along the skin: at the apex they are presses there, beside it they are the real contacts."""

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.fem import press
from papilla.fem.pressing.off_apex import transported_readings
from papilla.model.specimen import Block

PLACES = (-3.0, 0.0, 3.0)


@pytest.fixture(scope="module", params=[0.0, "stick"])
def pressed(coarse, request):
    return press(coarse, Block(0.3, 10.0), force=0.6, fidelity="contact", friction=request.param)


def test_at_the_apex_it_is_the_press_itself(coarse_model, coarse, pressed):
    found = transported_readings(coarse_model, coarse.patch, pressed.traction[None], PLACES)
    assert found.shape == (3, 1, 5)
    # The patch's own integrals are over facets, here of 4 mm, these over the exact skin.
    np.testing.assert_allclose(found[1, 0], pressed.reading, atol=0.05 * np.abs(pressed.reading).max())
    np.testing.assert_allclose(found[0, 0], found[2, 0, ::-1], rtol=1e-9)
    assert np.abs(found[2] - found[1]).max() > 0.1 * np.abs(found[1]).max()


def test_unusable_values_are_refused(coarse_model, coarse, pressed):
    with pytest.raises(InputError, match=r"tractions must be \(m, 3, \d+\), one row per press, got shape \(3,\)"):
        transported_readings(coarse_model, coarse.patch, np.ones(3), (0.0,))
    with pytest.raises(InputError, match="no skin to touch at x 50"):
        transported_readings(coarse_model, coarse.patch, pressed.traction[None], (50.0,))
    with pytest.raises(InputError, match="place x"):
        transported_readings(coarse_model, coarse.patch, pressed.traction[None], (np.nan,))


@pytest.fixture(scope="module")
def beside(reference_model):
    """The finger reduced where it is touched, 3 mm beside the apex."""
    return reference_model.reduce((3.0, 0.0))


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, "stick"])
def test_it_is_the_real_contact_beside_the_apex(reference_model, reference, beside, friction):
    """Change of each reading from the apex, against contacts solved at x: within 2 % of it and 0.5 % of the largest
    reading, which two meshes differ by at the apex already; 1 % where the contact sticks."""
    places, cases = (0.0, 3.0), [(0.05, 0.3), (0.3, 0.15), (0.3, 0.6), (1.0, 0.9)]
    blocks = [(Block(modulus, 10.0), force) for modulus, force in cases]
    apex = [press(reference, block, force=force, fidelity="contact", friction=friction) for block, force in blocks]
    start = np.array([found.reading for found in apex])
    moved = transported_readings(reference_model, reference.patch, np.array([one.traction for one in apex]), places)
    np.testing.assert_allclose(moved[0], start, atol=1e-3 * np.abs(start).max())
    there = [
        press(beside, block, force=force, fidelity="contact", friction=friction).reading for block, force in blocks
    ]
    real, change = np.array(there) - start, moved[1] - moved[0]
    allowed = 0.02 * np.abs(real) + (0.01 if friction else 0.005) * np.abs(start).max(axis=1, keepdims=True)
    assert (np.abs(change - real) < allowed).all()
    assert (np.abs(real) > 3 * allowed).any(axis=1).all()
