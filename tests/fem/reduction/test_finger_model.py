"""`FingerModel`: reciprocity, mirror symmetry and parities, the bone, the incompressible limit, recovered fields."""

import dataclasses

import meshio
import numpy as np
import pytest
from scipy.spatial import cKDTree

from papilla.core.errors import InputError
from papilla.fem import Field, FingerModel, press, receptive_fields, recover
from papilla.fem.discrete.elements import image_of, interpolation, parity_signs
from papilla.fem.fields import save_field
from papilla.fem.reduction.family import family
from papilla.fem.reduction.gauges import gauge_frame, strain_functional
from papilla.fem.reduction.patch import Frame
from papilla.mesh.cells import volumes
from papilla.model.finger import Finger, Layer
from papilla.model.materials import NeoHookean
from papilla.model.specimen import Block

BLOCK = Block(0.51, 10)


@pytest.mark.parametrize("at", [(0.0, 0.0), (5.0, -3.0)])
def test_quarter_and_whole_mesh_give_the_same_reduced_finger(coarse_model, at):
    """Two paths: four parities on a quarter, or one solve on everything."""
    whole_model = FingerModel(coarse_model.finger, dataclasses.replace(coarse_model.mesh, mirrors=()))
    by_parts, at_once = (press(model.reduce(at), BLOCK, force=0.3) for model in (coarse_model, whole_model))
    assert by_parts.reading == pytest.approx(at_once.reading, rel=1e-9)
    assert by_parts.indentation == pytest.approx(at_once.indentation, rel=1e-9)
    assert 4 - 3 * (at != (0, 0)) == coarse_model.reduce(at).multiplicity
    assert whole_model.reduce(at).multiplicity == 1


@pytest.mark.parametrize("at", [(0.0, 0.0), (4.0, 3.0)])
def test_adjoint_rows_are_the_gauges_of_the_direct_solution(coarse_model, at):
    """Strain rows by the patch's solutions, against the gauge functional of one recovered displacement."""
    reduced = coarse_model.reduce(at)
    pressure = np.random.default_rng(0).random(len(reduced.patch.xy))
    interface = coarse_model.surfaces["interface"]
    for number, gauge in enumerate(coarse_model.finger.gauges):
        functional = strain_functional(gauge, gauge_frame(coarse_model.finger, gauge, interface), interface)
        images = image_of(functional.points, ("x", "y"))
        values = interpolation(coarse_model.space, functional.points * np.column_stack([images, np.ones(len(images))]))
        strain = 0.0
        for parity, field in coarse_model.cell_displacements(pressure, at).items():
            signs = np.stack([parity_signs(parity, tuple(image)) for image in images])
            strain += (functional.weights * signs * (values @ field)).sum()
        assert strain == pytest.approx(reduced.strain_rows[number] @ pressure, rel=1e-9)


def test_receptive_fields_are_presses_of_a_tiny_force(coarse_model, coarse):
    """At the apex by symmetry, and against a narrow load on a vertex: one newton spread over its hat function."""
    fields = receptive_fields(coarse_model)
    points = coarse_model.mesh.points[fields.vertices]
    for axis, order in ((0, slice(None, None, -1)), (1, slice(None))):
        image = cKDTree(points).query(points * np.where(np.arange(3) == axis, -1, 1))[1]
        assert fields.strain_per_newton[:, image] == pytest.approx(fields.strain_per_newton[order], rel=1e-6, abs=1e-9)
    apex = int(np.argmax(points[:, 2]))
    node = int(np.argmin(np.hypot(*coarse.patch.xy.T)))
    spread = coarse.strain_rows[:, node] / (4 * coarse.patch.mass[node])
    found = fields.strain_per_newton[:, apex]
    # A hat of 5 mm against a point: the same signs and size at gauges 14 mm and more away
    assert found[[0, 4]] == pytest.approx(spread[[0, 4]], rel=0.3)
    assert (np.sign(found) == np.sign(spread)).all()


def test_incompressibility_is_approached_smoothly(coarse_model):
    """nu 0.49 to 0.5: readings change by the compressibility, in proportion to 1 - 2 nu, and no more."""
    readings = []
    for nu in (0.49, 0.495, 0.499, 0.4999, 0.5):
        finger = dataclasses.replace(coarse_model.finger, outer=Layer(0.136, nu), inner=Layer(0.034, nu))
        readings.append(press(FingerModel(finger, coarse_model.mesh).reduce(), BLOCK, force=0.3).indentation)
    change = 1 - np.array(readings) / readings[-1]
    assert 1e-4 < abs(change[0]) < 0.1
    assert change[1] / change[0] == pytest.approx(0.5, abs=0.1)
    assert change[2] / change[0] == pytest.approx(0.1, abs=0.03)
    assert change[3] / change[0] == pytest.approx(0.01, abs=0.005)


def test_a_hard_bone_is_a_rigid_one_and_a_soft_one_is_not(dome, coarse):
    rigid = press(coarse, BLOCK, force=0.3, fidelity="contact")
    found = {}
    for modulus in (3000.0, 0.034):
        finger = dataclasses.replace(Finger.default(), bone=Layer(modulus, 0.35))
        found[modulus] = press(FingerModel(finger, dome(finger)).reduce(), BLOCK, force=0.3, fidelity="contact")
    assert found[3000.0].reading == pytest.approx(rigid.reading, rel=1e-3)
    assert found[3000.0].indentation == pytest.approx(rigid.indentation, rel=1e-3)
    assert found[0.034].indentation > 1.05 * rigid.indentation


def test_bone_and_mesh_go_together(dome):
    soft = dataclasses.replace(Finger.default(), bone=Layer(3000.0, 0.35))
    for finger, mesh in ((soft, dome(Finger.default())), (Finger.default(), dome(soft))):
        with pytest.raises(InputError, match="the mesh does not fit the finger: bone cells and a bone with a modulus"):
            FingerModel(finger, mesh)


def test_the_stress_carries_the_force_through_the_finger(coarse_model):
    """Of a press at the apex and of one beside it, in a plane between the contact and the bone."""
    import pyvista as pv

    mesh = coarse_model.mesh
    for at in ((0.0, 0.0), (5.0, -3.0)):
        reduced = coarse_model.reduce(at)
        found = press(reduced, BLOCK, force=0.3, fidelity="contact", friction=0)
        field = recover(coarse_model, reduced, found)
        stress = field.stress
        assert np.abs(field.displacement[np.unique(mesh.boundaries["base"])]).max() == 0
        assert -found.indentation < field.displacement[:, 2].min() < -0.3 * found.indentation
        # Incompressible in the mean of each patch of cells, so for the whole; on so coarse a mesh not cell by cell
        volume, size = np.trace(field.strain, axis1=1, axis2=2), volumes(mesh.points, mesh.tets)
        assert abs(volume @ size) < 1e-3 * (np.abs(field.strain).max(axis=(1, 2)) @ size)
        assert np.array_equal(stress, stress.transpose(0, 2, 1))
        grid = pv.UnstructuredGrid({pv.CellType.TETRA: mesh.tets}, mesh.points)
        grid.cell_data["down"] = stress[:, 2]
        plane = grid.slice("z", origin=(0, 0, 12.01)).compute_cell_sizes()
        force = plane["Area"] @ plane["down"]
        assert force == pytest.approx(-0.3 * Frame.at(coarse_model.surfaces["skin"], *at).axes[2], abs=0.03)


def test_cards_and_elastic_bones_are_refused():
    with pytest.raises(InputError, match="material card"):
        family(dataclasses.replace(Finger.default(), outer=Layer.of(NeoHookean(0.05), 0.4999)))
    with pytest.raises(InputError, match="rigid bone"):
        family(dataclasses.replace(Finger.default(), bone=Layer(3000.0, 0.37)))


@pytest.mark.parametrize("ratio", [1.45, 4.6, 13.1])
def test_between_its_ratios_it_is_the_finger_reduced_by_itself(dome, ratio):
    """Compliance, rows, and S_d and indentation of a press, on a coarse mesh."""
    few = family(Finger.default(), mesh=dome(Finger.default(), outer_layers=1, inner_layers=2))
    inner = Finger.default().inner.modulus
    alone, found = few.model(ratio).reduce(), few.at(ratio * inner, inner)
    for name in ("compliance", "rows"):
        expected = getattr(alone, name)
        assert np.abs(getattr(found, name) - expected).max() < 1e-4 * np.abs(expected).max()
    there, here = (press(one, Block(0.3, 10), force=0.5, fidelity="contact", friction=0) for one in (alone, found))
    assert (here.sd, here.indentation) == pytest.approx((there.sd, there.indentation), rel=4e-5)
    for outer in (1.0, 0.04):
        with pytest.raises(InputError, match="outer over inner modulus"):
            few.at(outer, 0.05)


def test_a_field_file_has_its_tensor_in_paraviews_order(coarse_model, tmp_path):
    mesh = coarse_model.mesh
    strain = np.arange(9 * len(mesh.tets), dtype=float).reshape(-1, 3, 3)
    strain += strain.transpose(0, 2, 1)
    field = Field(mesh, 0.1 * mesh.points, strain, 2 * strain)
    save_field(field, tmp_path / "field.vtu")
    back = meshio.vtu.read(str(tmp_path / "field.vtu"))
    assert np.array_equal(back.points, field.mesh.points)
    assert np.array_equal(back.point_data["displacement_mm"], field.displacement)
    strain = back.cell_data["strain"][0]
    for k, (row, column) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))):
        assert np.array_equal(strain[:, k], field.strain[:, row, column])
    assert np.array_equal(back.cell_data["stress_MPa"][0], 2 * strain)
    assert np.array_equal(back.cell_data["layer"][0], field.mesh.layer)
