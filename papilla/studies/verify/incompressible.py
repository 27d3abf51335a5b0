"""Up to nu = 0.5 exactly: no locking, no loss of digits, and a limit that is reached smoothly."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from papilla.fem import FingerModel, press
from papilla.finger import Layer
from papilla.references import bonded_layer_sphere
from papilla.studies import parameters
from papilla.studies.case import Case
from papilla.studies.verify.bodies import BALL, BALL_RADIUS, at_unit_contact, bonded_layer, compared
from papilla.studies.verify.finger import COARSE_MM, default_model, pressed_by

GIVEN = parameters.parameters(__name__)


def incompressible() -> Iterator[Case]:
    """A bonded layer against its exact solution, and the default finger against its own limit."""
    yield from _bonded_layer()
    yield from _finger()


def _bonded_layer() -> Iterator[Case]:
    """A layer between ball and table, whose response depends most on nu."""
    chi, modulus = GIVEN.chi, GIVEN.modulus_MPa
    thickness, indentation = at_unit_contact(chi, modulus)
    ratios = []
    for nu in GIVEN.poissons:
        model = bonded_layer(Layer(modulus, nu), thickness)
        found = press(model.reduce(), BALL, indentation=indentation, fidelity="contact")
        exact = bonded_layer_sphere(indentation, BALL_RADIUS, thickness, modulus, nu)
        ratios.append(found.force / exact.force)
        name = f"bonded layer, nu {nu:g}"
        against = "at given indentation, against the dual integral equation (exact solution)"
        yield from compared(name, against, found, exact, force=GIVEN.force_bound)
        yield residual(name, model)
    stiffening = max(ratios) / ratios[0] - 1
    yield Case(
        "bonded layer, locking", "rise of force over exact force above that at nu 0.49", stiffening, GIVEN.even_bound
    )


def _finger() -> Iterator[Case]:
    readings = []
    base = default_model(COARSE_MM)
    for nu in GIVEN.poissons:
        finger = replace(base.finger, outer=replace(base.finger.outer, nu=nu), inner=replace(base.finger.inner, nu=nu))
        model = FingerModel(finger, base.mesh)
        found = pressed_by(model.reduce(), GIVEN.firm_gf)
        readings.append((found.sd, found.indentation))
        yield residual(f"finger, nu {nu:g}", model)
    compressibility = 1 - 2 * np.array(GIVEN.poissons)
    # From nu = 0.4999 on, where the term in (1 - 2 nu)^2 is gone
    changes = np.array(readings) / readings[-1] - 1
    slope = changes[2] / compressibility[2]
    for column, name in enumerate(("S_d", "indentation")):
        away = float(np.abs(changes[2:, column] - slope[column] * compressibility[2:]).max())
        measure = f"{name} at {GIVEN.firm_gf} gf from nu 0.4999 on, against its limit plus a term in 1 - 2 nu"
        yield Case(f"finger, {name} smooth in nu", measure, away, GIVEN.smooth_bound)
        kept = float(np.abs(changes[2, column]))
        yield Case(
            f"finger, {name} at nu 0.4999", f"{name} at {GIVEN.firm_gf} gf, against nu = 0.5", kept, GIVEN.even_bound
        )


def residual(name: str, model: FingerModel, columns: int = 4) -> Case:
    """Largest relative residual over random displacement loads, with the true matrix, each column by itself."""
    free, factor = model.factor()
    loaded = int(free[: 3 * model.space.nodes].sum())
    rhs = np.zeros((int(free.sum()), columns))
    rhs[:loaded] = np.random.default_rng(3).standard_normal((loaded, columns))
    full = factor.matrix + sp.tril(factor.matrix, -1).T
    worst = (np.linalg.norm(full @ factor.solve(rhs) - rhs, axis=0) / np.linalg.norm(rhs, axis=0)).max()
    return Case(f"{name}, residual", "residual of a solve over its load", float(worst), GIVEN.residual_bound)
