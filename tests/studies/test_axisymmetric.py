"""The axisymmetric reference: its tangents, its linear limit, and the 3-D presses on the same finger."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from papilla.fem import prepare, press, press_finite
from papilla.fem.finite.body import Card
from papilla.fem.reduction.finger_model import FingerModel
from papilla.finger import Layer
from papilla.materials import NeoHookean, Ogden
from papilla.mesh import build
from papilla.specimen import Block
from papilla.studies.verify.axisymmetric.bodies import FINE, Bodies, Shape
from papilla.studies.verify.axisymmetric.path import Contact, press_path
from papilla.studies.verify.axisymmetric.rings import Rings
from papilla.studies.verify.revolution import LINEAR
from papilla.units import gf_to_newton

COARSE = Shape(cells=(20, 3, 4, 5))


def _card(modulus, nu=0.4999, alpha=None):
    mu = modulus / (2 * (1 + nu))
    return Card(NeoHookean(mu) if alpha is None else Ogden(mu, alpha), nu)


def _bodies(shape, specimen=0.51, linear=False, alpha=None):
    return Bodies(shape, [_card(0.136, alpha=alpha), _card(0.034, alpha=alpha), _card(specimen, 0.495)], linear)


def test_tangents_are_derivatives_of_the_forces():
    bodies = _bodies(COARSE)
    contact, rng = Contact(bodies, stick=False), np.random.default_rng(4)
    at, along = rng.normal(size=(2, bodies.unknowns)) * [[1e-4], [1.0]]
    at[: 2 * bodies.nodes].reshape(-1, 2)[bodies.parameters[1] > 5, 1] -= 0.2
    for part in (bodies.forces, contact.forces):
        up, down = (part(at + sign * 1e-7 * along)[0] for sign in (1, -1))
        matrix = part(at)[1].tocsr()
        whole = matrix if part == contact.forces else matrix + sp.tril(matrix, -1).T
        change = whole @ along
        assert np.abs(change).max() > 0
        assert (up - down) / 2e-7 == pytest.approx(change, abs=2e-6 * np.abs(change).max())


def test_without_strain_large_strain_is_small_strain():
    forces = [press_path(_bodies(COARSE, linear=linear), 1e-3, 1).force[-1] for linear in (True, False)]
    assert forces[1] == pytest.approx(forces[0], rel=2e-3)


@pytest.mark.slow
def test_ogden_layers_change_what_the_reference_says_they_change():
    """Both on a rigid flat. The ratio of finite to linear is almost free of the mesh: gauges by 0.6 %, S_d by less.

    Neo-Hookean layers, stuck ones too, are a family of `papilla verify`.
    """
    layers = {
        name: Layer.of(_card(modulus, alpha=6.0).material, 0.4999)
        for name, modulus in (("outer", 0.136), ("inner", 0.034))
    }
    finger = replace(FINE.finger, **layers)
    mesh, specimen = build(finger), Block(100.0, 10)
    linear = press(FingerModel(finger, mesh).reduce(), specimen, force=0.6, fidelity="contact")
    finite = press_finite(finger, mesh, specimen, force=0.6)
    reference = [press_path(_bodies(Shape(), 100.0, one, 6.0), 1.05, 14).at(0.6) for one in (True, False)]
    assert linear.indentation == pytest.approx(reference[0][0], rel=5e-3)
    assert linear.strain[2:] == pytest.approx(reference[0][2:], rel=2e-2)
    change = reference[1] / reference[0] - 1
    assert finite.indentation / linear.indentation - 1 == pytest.approx(change[0], abs=2e-3)
    assert (finite.strain / linear.strain - 1)[2:] == pytest.approx(change[2:], abs=1e-2)
    spread = [np.std([path[4], path[3], path[2], path[3], path[4]]) for path in reference]
    assert finite.sd / linear.sd == pytest.approx(spread[1] / spread[0], abs=3e-3)


@pytest.mark.slow
def test_rings_and_penalty_are_the_same_press():
    bodies = _bodies(Shape(cells=(40, 3, 4, 5)), linear=True)
    rings, path = Rings(bodies).press(0.3), press_path(bodies, 0.7, 6).at(0.3)
    assert rings.indentation == pytest.approx(path[0], rel=2e-3)
    assert rings.strain == pytest.approx(path[2:], rel=2e-2)


@pytest.mark.slow
def test_a_skin_of_six_tenths_is_seen_by_elements_about_as_large():
    """Elements of about 0.4 mm where it is touched, and of 0.55 and more elsewhere."""
    shape = replace(FINE, interface=(23.4, 19.4))
    rings, reduced = Rings(_bodies(shape, linear=True)), prepare(shape.finger, size_mm=0.55)
    for force_gf in (5, 20, 50):
        force = gf_to_newton(force_gf)
        found, exact = press(reduced, Block(0.51, 10), force=force, fidelity="contact"), rings.press(force)
        assert found.resolved and found.indentation == pytest.approx(exact.indentation, rel=3e-3)
        assert found.strain.std() == pytest.approx(np.std(exact.strain[[2, 1, 0, 1, 2]]), rel=1.5e-2)
        assert found.contact_area == pytest.approx(exact.contact_area, rel=0.08)


@pytest.mark.slow
def test_presses_on_other_triangulations_are_the_references():
    """Every machine makes meshes of its own: the bounds are those of `papilla verify`, twice the worst of six."""
    rings, specimen = Rings(_bodies(FINE, 0.05, linear=True)), Block(0.05, 10)
    reduced = [prepare(FINE.finger, variant=variant) for variant in (1, 2)]
    for force_gf in (5, 20, 50):
        force = gf_to_newton(force_gf)
        exact = rings.press(force)
        sd = np.std(exact.strain[[2, 1, 0, 1, 2]])
        for finger in reduced:
            found = press(finger, specimen, force=force, fidelity="contact")
            assert found.strain.std() == pytest.approx(sd, rel=LINEAR["S_d"])
            assert found.strain[2:] == pytest.approx(exact.strain, rel=LINEAR["gauges"])
            assert found.indentation == pytest.approx(exact.indentation, rel=LINEAR["indentation"])
            assert found.contact_area == pytest.approx(exact.contact_area, rel=LINEAR["contact area"])
            assert found.peak_pressure == pytest.approx(exact.peak_pressure, rel=LINEAR["peak pressure"])
