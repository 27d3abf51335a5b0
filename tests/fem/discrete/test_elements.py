"""Assembly: exact on what Taylor-Hood represents, equal to an independent assembly, convergent on what it does not."""

import dataclasses

import numpy as np
import pytest
import scipy.sparse as sp
from skfem import Basis, BilinearForm, ElementVector
from skfem.helpers import ddot, div, sym_grad

from papilla.core.errors import InputError
from papilla.fem import FingerModel, press, recover
from papilla.fem.discrete.assembly import lame
from papilla.fem.discrete.elements import P1, P2, TaylorHood, interpolation, locate
from papilla.fem.discrete.solver import factorise
from papilla.mesh.layered import INNER_LAYER, OUTER_LAYER
from papilla.model.finger import Finger, Layer
from papilla.model.specimen import Block
from papilla.references import boussinesq_displacement


def whole(lower):
    return (lower + sp.tril(lower, -1).T).tocsr()


def nodes_inside(space):
    """Mask (nodes,) of the P2 nodes off the box's boundary."""
    x = space.displacement.doflocs
    return ((x > x.min(axis=1)[:, None] + 1e-9) & (x < x.max(axis=1)[:, None] - 1e-9)).all(axis=0)


def residual(space, layers, field):
    """Largest out-of-balance force inside over the largest nodal force, pressures answering to `field` (nodes, 3)."""
    size, matrix = 3 * space.nodes, whole(space.matrix(layers))
    u = field.ravel()
    pressure = sp.linalg.spsolve(matrix[size:, size:].tocsc(), -matrix[size:, :size] @ u)
    forces = (matrix[:size, :size] @ u + matrix[:size, size:] @ pressure).reshape(-1, 3)
    inside = nodes_inside(space)
    assert inside.sum() > 50
    return np.abs(forces[inside]).max() / np.abs(forces).max()


def solve_inside(space, layers, boundary):
    """Displacement (nodes, 3) with that of `boundary` (nodes, 3) on the box's boundary."""
    size, matrix = 3 * space.nodes, space.matrix(layers)
    free = np.ones(space.unknowns, dtype=bool)
    free[:size] = np.repeat(nodes_inside(space), 3)
    known = np.where(free, 0.0, np.append(boundary.ravel(), np.zeros(space.pressures)))
    load = -(whole(matrix) @ known)[free]
    factor = factorise(matrix.tocsr()[free][:, free].tocsc(), space.pressures)
    known[free] = factor.solve(load[:, None])[:, 0]
    return known[:size].reshape(-1, 3)


@pytest.mark.parametrize("contrast", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("nus", [(0.3, 0.4999), (0.4999, 0.0)])
def test_patch_test_across_the_layers(box_space, contrast, nus):
    """Shear and compression whose stress is continuous across z = 1/2: displacement bends there and pressure jumps."""
    layers = {OUTER_LAYER: Layer(0.1 * contrast, nus[0]), INNER_LAYER: Layer(0.1, nus[1])}
    z = box_space.displacement.doflocs[2]
    slopes = {}
    for number, layer in layers.items():
        mu, compressibility = lame(layer)
        slopes[number] = np.array([0.02 / mu, -0.01 / mu, 0.03 / (2 * mu + 1 / compressibility)])
    low, high = np.minimum(z, 0.5), np.maximum(z - 0.5, 0)
    field = low[:, None] * slopes[INNER_LAYER] + high[:, None] * slopes[OUTER_LAYER]
    # Rounding of a displacement, times a lambda 1e7 times the softer modulus; a pressure that cannot jump gives 1e-2
    assert residual(box_space, layers, field) < 1e-8


@pytest.mark.parametrize("nu", [0.3, 0.4999, 0.499999])
def test_converges_to_the_point_force_field(box, nu):
    """Boussinesq's field on a box below the surface: third order in displacement, and 2e-3 on 6 cells an edge."""
    layers = {OUTER_LAYER: Layer(0.1, nu), INNER_LAYER: Layer(0.1, nu)}
    errors = []
    for divisions in (3, 6):
        space = TaylorHood(box((divisions,) * 3, (0.2, 0.1, 0.8), (1.4, 1.3, 2.0), jitter=0))
        x = space.displacement.doflocs.T
        exact = boussinesq_displacement(x, 1.0, 0.1, nu)
        found = solve_inside(space, layers, exact)
        errors.append(np.linalg.norm(found - exact) / np.linalg.norm(exact) / np.sqrt(nodes_inside(space).mean()))
    assert errors[1] < 2e-3
    assert np.log2(errors[0] / errors[1]) > 2.5


BLOCK = Block(0.51, 10)
LAYERS = {OUTER_LAYER: Layer(0.136, 0.45), INNER_LAYER: Layer(0.034, 0.3)}


@pytest.fixture(scope="module")
def finger_of(dome):
    """Function: the coarse default finger with an element, and with one Poisson's ratio in all layers."""

    def make(element, nu=0.4999):
        finger = Finger.default()
        finger = dataclasses.replace(finger, outer=Layer(0.136, nu), inner=Layer(0.034, nu))
        return FingerModel(finger, dome(finger), element)

    return make


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


def test_a_field_of_a_displacement_element_carries_its_own_force(finger_of):
    """Without pressure unknowns the pressure is -lambda div u: the stress is that of Hooke's law, cell by cell."""
    model = finger_of("P2", 0.45)
    reduced = model.reduce((5.0, -3.0))
    field = recover(model, reduced, press(reduced, BLOCK, force=0.3))
    constants = np.array([lame(model.layers[number]) for number in model.mesh.layer])
    mu, dilatation = constants[:, :1, None], np.trace(field.strain, axis1=1, axis2=2) / constants[:, 1]
    hooke = 2 * mu * field.strain + dilatation[:, None, None] * np.eye(3)
    assert field.stress == pytest.approx(hooke, abs=1e-12 * np.abs(hooke).max())
    assert model.factor()[1].inertia == (int(model.factor()[0].sum()), 0, 0)
    with pytest.raises(InputError, match="finger, mesh or element differ"):
        recover(finger_of("Taylor-Hood", 0.45), reduced, press(reduced, BLOCK, force=0.3))


def test_what_no_element_can_do_is_refused(finger_of):
    with pytest.raises(InputError, match="element must be one of Taylor-Hood, P2, P1, got 'Q1'"):
        finger_of("Q1")
    with pytest.raises(InputError, match="element P2 needs nu below 0.5 in every layer, got 0.5: use Taylor-Hood"):
        finger_of("P2", 0.5).reduce()


def quadratic(x):
    return 1 + x @ [2.0, -1, 0.5] + x[:, 0] ** 2 - 3 * x[:, 0] * x[:, 2] + 2 * x[:, 1] ** 2


def test_quadratics_are_exact_everywhere(box_space):
    """Inside, on faces, on edges and on vertices."""
    mesh = box_space.mesh
    inside = np.random.default_rng(0).uniform(0.01, 0.99, (200, 3))
    corners = mesh.points[mesh.tets]
    points = np.concatenate([inside, corners[:, :3].mean(axis=1), corners[:, :2].mean(axis=1), mesh.points])
    values = interpolation(box_space, points) @ quadratic(box_space.displacement.doflocs.T)
    assert np.abs(values - quadratic(points)).max() < 1e-12


def test_a_point_is_extrapolated_up_to_a_quarter_of_a_cell(box):
    """In shares of the barycentric coordinate that is negative there: of a cell's height over its lowest face."""
    space = TaylorHood(box((1, 1, 1), split=False))
    assert locate(space, np.array([[0.3, 0.3, -0.249]]))[1].min() == pytest.approx(-0.249)
    with pytest.raises(InputError, match=r"point \(0.3, 0.3, -0.251\) mm lies outside the mesh"):
        locate(space, np.array([[0.3, 0.3, -0.251]]))
