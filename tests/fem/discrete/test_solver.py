"""The factorisation: both engines, their checks, and the incompressible limit."""

import dataclasses

import numpy as np
import pytest
import scipy.sparse as sp

from papilla.core.errors import SolverError
from papilla.fem import FingerModel
from papilla.fem.discrete.solver import SOLVER_ENGINES, factorise
from papilla.mesh.layered import INNER_LAYER, OUTER_LAYER
from papilla.model.finger import Finger, Layer


@pytest.fixture(scope="module")
def system(box_space):
    """A clamped box: lower triangle and number of pressures."""
    matrix = box_space.matrix({OUTER_LAYER: Layer(0.136, 0.4999), INNER_LAYER: Layer(0.034, 0.4999)})
    free = box_space.free((1, 1), ())
    return matrix.tocsr()[free][:, free].tocsc(), box_space.pressures


def relative_residual(matrix, x, b):
    full = matrix + sp.tril(matrix, -1).T
    return np.linalg.norm(full @ x - b) / np.linalg.norm(b)


def test_engines_agree_and_keep_the_residual(system):
    matrix, negative = system
    # Columns do not mix: of loads 1e12 apart the small one is solved as well as the large
    b = np.random.default_rng(1).standard_normal((matrix.shape[0], 2)) * [1.0, 1e-12]
    found = {name: factorise(matrix, negative, engine=name) for name in SOLVER_ENGINES}
    x = {name: factor.solve(b) for name, factor in found.items()}
    assert np.linalg.norm(x["rslab"] - x["superlu"]) <= 1e-9 * np.linalg.norm(x["superlu"])
    for name in SOLVER_ENGINES:
        assert found[name].engine == name
        assert max(relative_residual(matrix, x[name][:, [k]], b[:, [k]]) for k in (0, 1)) <= 1e-9
        assert found[name].nonzeros > matrix.nnz / 2
    assert found["rslab"].inertia == (matrix.shape[0] - negative, negative, 0)


def test_wrong_inertia_is_not_accepted(system):
    """An extra negative eigenvalue is what a negative stiffness would show."""
    matrix, negative = system
    with pytest.warns(UserWarning, match=r"rslab did not factor the matrix \(inertia .* where .* was expected"):
        factor = factorise(matrix, negative + 1)
    assert factor.engine == "superlu"


def test_the_environment_names_the_engine(system, monkeypatch):
    monkeypatch.setenv("PAPILLA_SOLVER", "superlu")
    assert factorise(*system).engine == "superlu"
    assert factorise(*system, engine="rslab").engine == "rslab", "an argument outranks the environment"
    monkeypatch.setenv("PAPILLA_SOLVER", "")
    assert factorise(*system).engine == "rslab"


@pytest.mark.filterwarnings("ignore:rslab did not factor")
def test_a_singular_matrix_is_an_error():
    with pytest.raises(SolverError, match="SuperLU could not factor the matrix"):
        factorise(sp.csc_matrix(np.diag([1.0, 0.0, 2.0])), 0)


@pytest.mark.parametrize("engine", SOLVER_ENGINES)
def test_refinement_reaches_the_true_matrix_from_a_stabilised_one(system, engine):
    matrix, negative = system
    near = (matrix + 1e-4 * sp.diags(matrix.diagonal())).tocsc()
    factor = factorise(matrix, negative, stabilised=near, engine=engine)
    b = np.random.default_rng(3).standard_normal((matrix.shape[0], 2))
    assert relative_residual(matrix, factor.solve(b), b) <= 1e-10


def test_a_stabilised_matrix_too_far_away_is_an_error_not_an_answer(system):
    matrix, negative = system
    factor = factorise(matrix, negative, stabilised=(0.3 * matrix).tocsc())
    with pytest.raises(SolverError, match="left a relative residual of .*, more than 1e-10"):
        factor.solve(np.ones((matrix.shape[0], 1)))


@pytest.mark.parametrize("stress, length", [(16.0, 1.0), (1.0, 4.0), (2.0**-8, 2.0**-6)])
def test_the_matrix_that_is_factored_has_no_units(dome, stress, length):
    """Scaled by powers of 2, so that not even rounding tells a finger from one in other units."""
    finger = Finger.default()
    mesh = dome(finger, divisions=3, outer_layers=1, inner_layers=1)
    units = dataclasses.replace(
        finger, outer=Layer(finger.outer.modulus * stress, 0.4999), inner=Layer(finger.inner.modulus * stress, 0.4999)
    )
    here, there = FingerModel(finger, mesh).matrix, FingerModel(units, mesh.scaled(length)).matrix
    assert abs(there - here).max() < 1e-12 * abs(here).max()
    diagonal = np.abs(here.diagonal()[here.diagonal() > 0])
    assert 0.01 < np.median(diagonal) < 100
