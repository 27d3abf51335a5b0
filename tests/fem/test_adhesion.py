"""Adhesion: JKR on a half-space, nothing without energy, and what it does to a finger."""

import numpy as np
import pytest

from papilla.errors import InputError
from papilla.fem import press
from papilla.fem.pressing.effects import adhesive_press
from papilla.specimen import Block, HalfSpace

E_STAR, RADIUS = 0.05, 20.0


@pytest.fixture(scope="module")
def sphere(disc, stand_in):
    """A half-space with the gap of a sphere; its first gauge feels the force."""
    return stand_in(disc(6.0, 24, lambda x, y: (x**2 + y**2) / (2 * RADIUS)), E_STAR)


@pytest.mark.parametrize("work", [0.01, 0.05])
@pytest.mark.parametrize("force", [0.1, 0.3])
def test_a_sphere_on_a_half_space_is_jkr(sphere, work, force):
    specimen = HalfSpace(1e6)
    found = adhesive_press(sphere, specimen, work, force_N=force)
    energy = 3 * np.pi * work * 1e-3 * RADIUS
    held = force + energy + np.sqrt(2 * energy * force + energy**2)
    radius = (3 * held * RADIUS / (4 * E_STAR)) ** (1 / 3)
    pulled = np.sqrt(2 * np.pi * work * 1e-3 * radius / E_STAR)
    assert found.contact_area == pytest.approx(np.pi * radius**2, rel=0.03)
    assert found.indentation == pytest.approx(radius**2 / RADIUS - pulled, rel=0.01)
    assert found.strain[0] == pytest.approx(force, rel=1e-3), "what a gauge feels of the force alone is the force"
    carried = sphere.multiplicity * sphere.patch.mass @ found.pressure
    assert carried == pytest.approx(force, rel=1e-3), "tension at the edge takes away what holds the contact"


def test_without_energy_it_is_the_press(reference):
    block = Block(0.3, 10)
    plain = press(reference, block, force=0.2, fidelity="contact")
    found = adhesive_press(reference, block, 1e-9, force_N=0.2)
    assert found.sd == pytest.approx(plain.sd, rel=1e-3) and found.indentation == pytest.approx(
        plain.indentation, rel=1e-3
    )


def test_it_widens_the_contact_and_matters_at_light_forces(reference):
    block = Block(0.3, 10)
    rises = []
    for force in (0.05, 0.6):
        plain = press(reference, block, force=force, fidelity="contact")
        found = adhesive_press(reference, block, 0.05, force_N=force)
        assert found.contact_area > plain.contact_area and found.indentation < plain.indentation * 1.2
        assert "adhesion holds the contact" in found.status and found.force == force
        rises.append(found.sd / plain.sd - 1)
    assert 0.02 < rises[0] < 0.2 and abs(rises[1]) < 0.25 * rises[0]


@pytest.mark.parametrize("work", [0.0, -1.0, np.nan])
def test_energy_must_be_positive(reference, work):
    with pytest.raises(InputError, match="work of adhesion"):
        adhesive_press(reference, Block(0.3, 10), work, force_N=0.2)
