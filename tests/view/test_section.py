"""The cut through a deformed finger: what is drawn is what the model says."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.fem.reduction.patch import Frame
from papilla.mesh.body import surfaces_of
from papilla.model.specimen import Sphere
from papilla.view.section import cell_values, contact_outline, cut, half_skin, specimen_solid, strain_along_layers


@pytest.fixture(scope="module")
def section(scene):
    return cut(scene.field, scene.finger)


def check_colours_at_the_gauges(scene, bound):
    """In both layers; a gauge reads elongation over 2.4 mm, a colour is the strain at a vertex: near, not equal."""
    section = cut(scene.field, scene.finger)
    for face in section.faces:
        for bar, strain in zip(section.gauges, scene.press.strain, strict=True):
            near = np.linalg.norm(face.points - bar.mean(axis=0), axis=1).argmin()
            assert face.values[near] == pytest.approx(100 * strain, abs=bound)


def test_the_colours_at_the_gauges_are_what_the_gauges_read(scene):
    check_colours_at_the_gauges(scene, 0.8)


@pytest.mark.slow
def test_on_the_default_mesh_colours_are_closer_and_the_stress_below_the_contact_is_the_pressure(fine_scene):
    check_colours_at_the_gauges(fine_scene, 0.3)
    mesh = fine_scene.field.mesh
    apex = np.linalg.norm(mesh.points[mesh.tets].mean(axis=1) - [0, 0, 20], axis=1).argmin()
    assert -fine_scene.field.stress[apex, 2, 2] == pytest.approx(fine_scene.press.peak_pressure, rel=0.05)


def test_the_faces_lie_in_the_plane_and_fill_the_section(scene, section):
    """pi/2 (a b - a' b') of the skin's and the bone's half ellipses, up to facets and what the press squeezes out."""
    area = 0.0
    for face in section.faces:
        corners = face.points[face.triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area += 0.5 * np.linalg.norm(normals, axis=1).sum()
        assert np.abs(face.points[:, 1]).max() < 1e-4
    shape = scene.finger.shape
    whole, bone = (axes[0] * axes[2] for axes in (shape.outer, shape.bone))
    assert area == pytest.approx(np.pi / 2 * (whole - bone), rel=0.02)


def test_the_interface_is_drawn_where_it_was_moved_to(scene, section):
    """Undeformed, the interface's section is an ellipse with its top at 17 mm; the press lowers the top."""
    at_rest = cut(replace(scene.field, displacement=0 * scene.field.displacement), scene.finger)
    line = np.concatenate(at_rest.outlines["interface"])
    assert (line[:, 0] / 21) ** 2 + (line[:, 2] / 17) ** 2 == pytest.approx(1, abs=0.01)
    lowered = np.concatenate(section.outlines["interface"])[:, 2].max()
    assert 17 - scene.press.indentation < lowered < 17 - 0.3 * scene.press.indentation


def test_strain_along_the_layers_of_a_uniform_field_is_its_component(scene):
    """Stretch by 1 % along x alone: along a tangent (cos a, sin a) that is 1 % cos^2 a, 1 % at the apex."""
    strain = np.zeros_like(scene.field.strain)
    strain[:, 0, 0] = 0.01
    along = strain_along_layers(replace(scene.field, strain=strain), scene.finger)
    centroids = scene.field.mesh.points[scene.field.mesh.tets].mean(axis=1)
    apex = np.abs(centroids[:, 0]) < 0.3
    assert along[apex & (centroids[:, 2] > 10)] == pytest.approx(1, abs=0.01)
    assert along.min() >= 0 and along.max() <= 1 + 1e-12


@pytest.mark.parametrize("side", [1, -1])
def test_half_of_the_skin_has_normals_that_point_out(scene, side):
    skin = half_skin(scene.field, scale=0.0, side=side)
    outward = skin.points / np.array(scene.finger.shape.outer) ** 2
    assert (side * skin.points[:, 1]).min() > -1e-9
    assert (np.einsum("ij,ij->i", skin.point_data["Normals"], outward) > 0).all()


def test_the_drawn_contact_has_the_stated_area_and_lies_on_the_specimen(scene):
    frame = Frame.at(surfaces_of(scene.finger)["skin"], *scene.reduced.at)
    (line,) = contact_outline(scene.field, scene.reduced, scene.press, frame, 1.0)
    x, y, z = line.T
    area = 0.5 * abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
    assert area == pytest.approx(scene.press.contact_area, rel=1e-3)
    assert z == pytest.approx(20 - scene.press.indentation, abs=0.1)


def test_the_specimen_is_closed_and_its_face_follows_the_finger(scene):
    frame = Frame.at(surfaces_of(scene.finger)["skin"], *scene.reduced.at)
    solid = specimen_solid(scene.specimen, scene.field, frame, scene.press, 13.5, 1.0)
    assert solid.is_manifold
    assert solid.points[:, 2].min() == pytest.approx(20 - scene.press.indentation, abs=1e-6)
    assert solid.points[:, 2].max() == pytest.approx(30 - scene.press.indentation, abs=1e-6)
    ball = specimen_solid(Sphere(0.5, 15.0), scene.field, frame, scene.press, 13.5, 1.0)
    away = np.linalg.norm(ball.points - [0, 0, 35 - scene.press.indentation], axis=1)
    assert ball.is_manifold and away == pytest.approx(15.0, abs=1e-4)


def test_the_shown_stress_is_the_field_s_in_kpa(scene):
    stress = scene.field.stress
    assert cell_values(scene.field, scene.finger, "xz") == pytest.approx(1000 * stress[:, 0, 2])
    a, b, c = (stress[:, i, i] for i in range(3))
    shear = stress[:, 0, 1] ** 2 + stress[:, 1, 2] ** 2 + stress[:, 0, 2] ** 2
    mises = np.sqrt(((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2) / 2 + 3 * shear)
    assert cell_values(scene.field, scene.finger, "mises") == pytest.approx(1000 * mises)
