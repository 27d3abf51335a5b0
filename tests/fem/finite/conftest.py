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
    isochoric = np.moveaxis(kinematics.deformation / np.cbrt(kinematics.jacobian), (0, 1), (-2, -1))
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
        local, total = pressure[space.pressure_dofs] @ space.hats, 0.0
        for number, card in body.cards.items():
            cells = space.mesh.layer == number
            kinematics = Kinematics.of(gradient[:, :, cells])
            density = _density(card.material, kinematics, local[cells], card.compressibility)
            total += float((space.displacement.dx[cells] * density).sum())
        return total

    return energy
