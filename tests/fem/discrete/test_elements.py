"""P1 and P2 beside Taylor-Hood: an independent assembly, the patch test, how they lock, and what is refused."""

import dataclasses

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementVector
from skfem.helpers import ddot, div, sym_grad

from papilla.core.errors import InputError
from papilla.fem import FingerModel, ReducedFinger, press, receptive_fields, recover
from papilla.fem.discrete.assembly import lame
from papilla.fem.discrete.elements import ELEMENTS_BY_NAME, P1, P2
from papilla.mesh.layered import INNER_LAYER, OUTER_LAYER
from papilla.model.finger import Finger, Layer
from papilla.model.specimen import Block

BLOCK = Block(0.51, 10)
LAYERS = {OUTER_LAYER: Layer(0.136, 0.45), INNER_LAYER: Layer(0.034, 0.3)}
GRADIENT = np.array([[0.3, -0.2, 0.5], [0.1, 0.7, -0.4], [0.25, 0.6, -0.35]])


@pytest.fixture(scope="module")
def finger_of(dome):
    """Function: the coarse default finger with an element, and with one Poisson's ratio in all layers."""

    def make(element, nu=0.4999):
        finger = Finger.default()
        finger = dataclasses.replace(finger, outer=Layer(0.136, nu), inner=Layer(0.034, nu))
        return FingerModel(finger, dome(finger), element)

    return make


def whole(lower):
    return (lower + sp.tril(lower, -1).T).tocsr()


@pytest.mark.parametrize("space", [P1, P2])
def test_matrix_is_that_of_the_form_of_scikit_fem(box, space):
    """An assembly that shares nothing but the mesh, of two layers."""
    space = space(box((2, 2, 4)))
    basis = Basis(space.skmesh, ElementVector(space.scalar_element), intorder=2)
    constants = np.array([lame(LAYERS[number]) for number in space.mesh.layer])
    mu, lam = constants[:, :1], 1 / constants[:, 1:]
    form = BilinearForm(lambda u, v, w: 2 * mu * ddot(sym_grad(u), sym_grad(v)) + lam * div(u) * div(v))
    expected, number = form.assemble(basis), np.empty(3 * space.nodes, dtype=int)
    for c in range(3):
        number[basis.nodal_dofs[c]] = 3 * space.displacement.nodal_dofs[0] + c
        if space.name == "P2":
            number[basis.edge_dofs[c]] = 3 * space.displacement.edge_dofs[0] + c
    difference = whole(space.matrix(LAYERS))[number][:, number] - expected
    assert abs(difference).max() < 1e-13 * abs(expected).max()


@pytest.mark.parametrize("space", [P1, P2])
def test_patch_test_and_rigid_motions(box, space):
    space = space(box((3, 3, 3), split=False))
    x = space.displacement.doflocs.T
    matrix = whole(space.matrix({OUTER_LAYER: LAYERS[OUTER_LAYER]}))
    forces = (matrix @ (x @ GRADIENT.T).ravel()).reshape(-1, 3)
    inside = ((x > 1e-9) & (x < 1 - 1e-9)).all(axis=1)
    assert inside.sum() >= 8
    assert np.abs(forces[inside]).max() < 1e-13 * np.abs(forces).max()
    turn = (matrix @ (x @ (GRADIENT - GRADIENT.T)).ravel()).reshape(-1, 3)
    assert np.abs(turn).max() < 1e-13 * np.abs(forces).max()


def test_displacement_elements_lock_where_taylor_hood_does_not(finger_of):
    """Indentation by one force, over nu 0.4999 and 0.3: a locked finger is too stiff, a compressible one nobody's."""
    depth = {
        (element, nu): press(finger_of(element, nu).reduce(), BLOCK, force=0.3, fidelity="contact").indentation
        for element in ELEMENTS_BY_NAME
        for nu in (0.3, 0.4999)
    }
    assert depth["P2", 0.3] == pytest.approx(depth["Taylor-Hood", 0.3], rel=0.01)
    assert depth["P2", 0.4999] < 0.97 * depth["Taylor-Hood", 0.4999]
    assert depth["P1", 0.3] < depth["P2", 0.3]
    assert depth["P1", 0.4999] < 0.5 * depth["Taylor-Hood", 0.4999]


@pytest.mark.slow
@pytest.mark.parametrize("element", ["P1", "P2"])
def test_all_that_a_model_gives_is_there_for_every_element(finger_of, element, tmp_path):
    """Parities, adjoint rows, fields: off the apex, by quarters and by the whole mesh."""
    model = finger_of(element, 0.45)
    at_once = FingerModel(model.finger, dataclasses.replace(model.mesh, mirrors=()), element)
    reduced = model.reduce((5.0, -3.0))
    found, same = (press(which, BLOCK, force=0.3) for which in (reduced, at_once.reduce((5.0, -3.0))))
    assert found.reading == pytest.approx(same.reading, rel=1e-9)
    field = recover(model, reduced, found)
    assert -0.9 * found.indentation < field.displacement[:, 2].min() < 0
    assert np.isfinite(receptive_fields(model).strain_per_newton).all()
    assert model.factor()[1].inertia == (int(model.factor()[0].sum()), 0, 0)
    reduced.save(tmp_path / "reduced.npz")
    assert ReducedFinger.load(tmp_path / "reduced.npz").element == element
    with pytest.raises(InputError, match="finger, mesh or element differ"):
        recover(finger_of("Taylor-Hood", 0.45), reduced, found)


def test_what_no_element_can_do_is_refused(finger_of):
    with pytest.raises(InputError, match="element must be one of Taylor-Hood, P2, P1, got 'Q1'"):
        finger_of("Q1")
    with pytest.raises(InputError, match="element P2 needs nu below 0.5 in every layer, got 0.5: use Taylor-Hood"):
        finger_of("P2", 0.5).reduce()
