"""What the tests of finite strain share: the coarse meshes of the tests of fem."""

import numpy as np
import pytest

from papilla.fem.finite.constitutive import Kinematics
from papilla.model.finger import Finger
from papilla.model.materials import Ogden


@pytest.fixture(scope="session")
def coarse(dome):
    """The default finger and a coarse structured mesh of it."""
    return Finger.default(), dome(Finger.default())


def _density(card, kinematics, pressure, compressibility):
    isochoric = kinematics.deformation / np.cbrt(kinematics.jacobian)[..., None, None]
    invariant = np.linalg.svd(isochoric, compute_uv=False) if isinstance(card, Ogden) else (isochoric**2).sum((-2, -1))
    energy, change = card.energy(invariant), kinematics.volume_change
    return energy + card.shear_modulus / 3 * change**2 - pressure * change - compressibility / 2 * pressure**2


@pytest.fixture(scope="session")
def density():
    """W (...) in MPa of a material, kinematics, pressure and 1/lambda: the definition of the module `constitutive`."""
    return _density


@pytest.fixture(scope="session")
def energy_of():
    """Energy (N mm) of a body at a displacement and pressures, by scikit-fem's interpolation."""

    def energy(body, displacement, pressure):
        space = body.space
        gradient = np.stack([np.asarray(space.displacement.interpolate(one).grad) for one in displacement.T])
        kinematics, total = Kinematics.of(gradient.transpose(2, 3, 0, 1)), 0.0
        local = pressure[space.pressure_dofs] @ space.hats
        for number, card in body.cards.items():
            cells = space.mesh.layer == number
            found = _density(card.material, kinematics[cells], local[cells], card.compressibility)
            total += float((space.displacement.dx[cells] * found).sum())
        return total

    return energy
