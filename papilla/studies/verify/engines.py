"""The two factorisations against each other."""

from collections.abc import Iterator

import numpy as np

from papilla.fem.discrete.solver import factorise
from papilla.finger import Layer
from papilla.studies.case import Case
from papilla.studies.verify.flat import FlatModel
from papilla.studies.verify.structured import cylinder

AGREEMENT = 1e-9

MATERIALS = ((0.3, 1.0), (0.4999, 1.0), (0.4999, 1e-3), (0.4999, 1e3), (0.499999, 1.0))
"""nu, and modulus of the upper half over that of the lower."""


def engines() -> Iterator[Case]:
    """Displacements of a bonded layer of two halves under random loads, rslab against SuperLU."""
    mesh = cylinder(np.linspace(0, 2, 7), np.linspace(0, 1, 5), 2, 4)
    for nu, contrast in MATERIALS:
        model = FlatModel(mesh, Layer(contrast, nu), Layer(1.0, nu), 1.0, interface=0.5)
        free, factor = model.factor()
        loaded = int(free[: 3 * model.space.nodes].sum())
        rhs = np.zeros((int(free.sum()), 3))
        rhs[:loaded] = np.random.default_rng(5).standard_normal((loaded, 3))
        negative = int(free[3 * model.space.nodes :].sum())
        found = [factorise(factor.matrix, negative, engine=name).solve(rhs)[:loaded] for name in ("rslab", "superlu")]
        away = np.linalg.norm(found[0] - found[1], axis=0) / np.linalg.norm(found[1], axis=0)
        name = f"rslab and SuperLU, nu {nu:g}, contrast {contrast:g}"
        yield Case(name, "displacements under random loads, against each other", float(away.max()), AGREEMENT)
