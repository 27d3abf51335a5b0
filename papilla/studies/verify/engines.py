"""The two factorisations against each other."""

from collections.abc import Iterator

import numpy as np

from papilla.fem.discrete.solver import factorise
from papilla.finger import Layer
from papilla.studies import parameters
from papilla.studies.case import Case
from papilla.studies.verify.flat import FlatModel
from papilla.studies.verify.structured import cylinder

GIVEN = parameters.parameters(__name__)


def engines() -> Iterator[Case]:
    """Displacements of a bonded layer of two halves under random loads, rslab against SuperLU."""
    rings, sheets = GIVEN.rings, GIVEN.sheets
    mesh = cylinder(np.linspace(0, GIVEN.radius_mm, rings + 1), np.linspace(0, 1, sheets + 1), sheets // 2, sheets)
    for nu, contrast in GIVEN.materials:
        model = FlatModel(mesh, Layer(contrast, nu), Layer(1.0, nu), 1.0, interface=GIVEN.interface_mm)
        free, factor = model.factor()
        loaded = int(free[: 3 * model.space.nodes].sum())
        rhs = np.zeros((int(free.sum()), 3))
        rhs[:loaded] = np.random.default_rng(GIVEN.seed).standard_normal((loaded, 3))
        negative = int(free[3 * model.space.nodes :].sum())
        found = [factorise(factor.matrix, negative, engine=name).solve(rhs)[:loaded] for name in ("rslab", "superlu")]
        away = np.linalg.norm(found[0] - found[1], axis=0) / np.linalg.norm(found[1], axis=0)
        name = f"rslab and SuperLU, nu {nu:g}, contrast {contrast:g}"
        yield Case(name, "displacements under random loads, against each other", float(away.max()), GIVEN.agreement)
