"""The section: its mesh, its compliance against the layered kernel, its modes against the full matrices."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu

from papilla import Dome, Layer, Slab
from papilla.core.errors import InputError
from papilla.fem import prepare_section
from papilla.fem.sliding.dynamics import Modal
from papilla.fem.sliding.section import SectionModel
from papilla.mesh.layered import BONE, INNER, OUTER
from papilla.mesh.section import Section, build_section
from papilla.references import StackLayer, layered_surface_compliance
from papilla.verify.sliding import depth_of_a_hump


def areas(section):
    corners = section.points[section.triangles]
    return np.linalg.det(corners[:, 1:] - corners[:, :1]) / 2


@pytest.mark.parametrize("ridges", [True, False])
def test_the_mesh_fills_its_layers_and_mirrors_itself(finger, ridges):
    finger = finger if ridges else replace(finger, ridges=None)
    section = build_section(finger, size_mm=0.2)
    area = areas(section)
    assert area.min() > 1e-3
    wanted = {OUTER: 24 * 20 - 21 * 17, INNER: 21 * 17 - 10 * 6}
    tops = 0.3 * np.ptp(section.points[section.spans, 0], axis=1).sum() if ridges else 0.0
    for layer, product in wanted.items():
        exact = np.pi / 2 * product + (tops if layer == OUTER else 0)
        assert area[section.layer == layer].sum() == pytest.approx(exact, rel=4e-3)
    mirrored = section.points * [-1, 1]
    order, other = np.lexsort(section.points.round(9).T), np.lexsort(mirrored.round(9).T)
    np.testing.assert_allclose(section.points[order], mirrored[other], atol=1e-12)
    again = build_section(finger, size_mm=0.2)
    assert again.points.tobytes() == section.points.tobytes()


def test_a_bone_that_is_meshed_is_a_layer(finger):
    section = build_section(replace(finger, bone=Layer(3000.0, 0.35)), size_mm=0.5)
    area = areas(section)
    assert area.min() > 1e-4
    assert area[section.layer == BONE].sum() == pytest.approx(np.pi / 2 * 60, rel=0.02)
    assert (section.points[section.base, 1] == 0).all()


def test_what_has_no_section_is_refused(finger):
    beside = replace(finger.gauges[0], y_mm=3.0)
    with pytest.raises(InputError, match="gauge g1 sits at y_mm 3: a sliding scene knows only the section"):
        build_section(replace(finger, gauges=(beside,)))
    with pytest.raises(InputError, match="500 at most: take a larger size_mm"):
        build_section(replace(finger, ridges=None), size_mm=0.01)


def strip(width=40.0, across=160, thickness=(1.0, 3.0), rows=(8, 12)):
    """A flat layered strip, clamped below, whose middle half may be loaded."""
    x = np.linspace(-width / 2, width / 2, across + 1)
    below = np.linspace(0, thickness[1], rows[1] + 1)
    z = np.concatenate([below, thickness[1] + np.linspace(0, thickness[0], rows[0] + 1)[1:]])
    number = np.arange(len(x) * len(z)).reshape(len(z), len(x))
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    cells = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    layer = np.tile(np.repeat([INNER] * rows[1] + [OUTER] * rows[0], across), 2)
    points = np.stack(np.meshgrid(x, z), axis=-1).reshape(-1, 2)
    top = number[-1]
    return Section(points, cells, layer, number[0], np.column_stack([top[:-1], top[1:]]), width / 2)


@pytest.mark.slow
@pytest.mark.parametrize("nu", [0.3, 0.4999])
def test_a_layered_strip_answers_as_the_exact_kernel(finger, nu):
    outer, inner = Layer(0.136, nu), Layer(0.034, nu)
    model = SectionModel(replace(finger, outer=outer, inner=inner), strip(80.0, 320))
    means, hats = model.patch_weights
    x = model.section.points[model.patch_vertices, 0]
    q, n = 2 * np.pi / 4.0, len(x)
    load = np.zeros((2 * n, 2))
    load[n:, 0], load[:n, 1] = np.cos(q * x) * hats, np.sin(q * x) * hats  # MPa: inward, then along
    moved = means @ model.solve(means.T @ load)
    middle = np.abs(x) < 8
    C = layered_surface_compliance(q, [StackLayer(1.0, 0.136, nu), StackLayer(3.0, 0.034, nu)], None)
    # A wave as hats, seen by hats: each takes sinc^2
    C *= np.sinc(q * (x[1] - x[0]) / (2 * np.pi)) ** 4
    for column, pick in ((0, 1), (1, 0)):
        found_along = moved[:n, column][middle] @ np.sin(q * x[middle]) / (np.sin(q * x[middle]) ** 2).sum()
        found_inward = moved[n:, column][middle] @ np.cos(q * x[middle]) / (np.cos(q * x[middle]) ** 2).sum()
        scale = abs(C).max()
        assert found_along == pytest.approx(C[0, pick], abs=0.01 * scale)
        assert found_inward == pytest.approx(C[1, pick], abs=0.01 * scale)


def test_an_incompressible_strip_is_the_limit_of_nearly_incompressible_ones(finger):
    """Poisson's ratio 0.5 leaves the pressures no diagonal; the change from 0.4999 to 0.5 is that from 0.4998 twice."""
    moved = []
    for nu in (0.4998, 0.4999, 0.5):
        layer = Layer(0.1, nu)
        model = SectionModel(replace(finger, outer=layer, inner=layer), strip(20.0, 40, rows=(2, 4)))
        means, _ = model.patch_weights
        moved.append(means @ model.solve(means.T.toarray()[:, [20, 55]]))
    change = np.abs(moved[1] - moved[0]).max()
    np.testing.assert_allclose(moved[2] - moved[1], moved[1] - moved[0], atol=0.05 * change)


def test_the_kernel_is_symmetric_and_holds_the_half_plane():
    q = np.array([0.3, 3.0, 30.0])
    deep = layered_surface_compliance(q, [StackLayer(1000.0, 0.1, 0.5)], None)
    np.testing.assert_allclose(deep[:, 1, 1], 2 * 0.75 / (0.1 * q), rtol=1e-9)
    np.testing.assert_allclose(deep[:, 0, 0], deep[:, 1, 1], rtol=1e-9)
    C = layered_surface_compliance(q, [StackLayer(1.0, 0.1, 0.3), StackLayer(2.0, 0.03, 0.45)], None)
    np.testing.assert_allclose(C[:, 0, 1], C[:, 1, 0], rtol=1e-9)


@pytest.mark.slow
def test_compliance_settles_as_elements_shrink_at_second_order(finger):
    """Straight edges for the curved skin are a second-order error; that of the elements is less."""
    found = [depth_of_a_hump(prepare_section(replace(finger, ridges=None), size_mm=size)) for size in (1.0, 0.5, 0.25)]
    coarse, fine = np.abs(np.diff(found))
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.4)
    assert fine < 0.005 * found[2]


@pytest.mark.slow
def test_modes_and_static_rest_answer_a_harmonic_force_as_the_whole_does(model):
    compliance, _ = model.condense()
    modes = model.modes(30)
    means, _ = model.patch_weights
    n = len(compliance) // 2
    stiffness, mass = (matrix[model.free][:, model.free] for matrix in model.system)
    load = np.zeros(len(compliance))
    load[n // 2], load[n + n // 2] = 0.5, 1.0
    inside = model.free < 2 * model.nodes
    full = np.zeros(len(model.free))
    full[inside] = (means.T @ load)[model.free[inside]]
    for factor in (0.5, 1.5, 2.6):
        omega = factor * modes.omega[0]
        exact = np.zeros(2 * model.nodes)
        exact[model.free[inside]] = splu((stiffness - omega**2 * mass).tocsc()).solve(full)[inside]
        square = modes.omega**2
        share = modes.patch.T @ load
        found = compliance @ load + modes.patch @ (share / (square - omega**2) - share / square)
        np.testing.assert_allclose(found, means @ exact, atol=0.015 * np.abs(found).max())


def test_the_first_mode_of_a_soft_layer_is_its_shear_wave(finger):
    """A wide strip sheared sideways: f = c / (4 h), c^2 = G / rho."""
    soft = Layer(0.034, 0.4999)
    wide = SectionModel(replace(finger, outer=soft, inner=soft), strip(width=120.0, across=80, rows=(2, 4)))
    wide.__dict__["gauge_rows"] = csr_matrix((2 * len(finger.gauges), 2 * wide.nodes))  # It has no place for gauges
    speed = np.sqrt(0.034 / 3 / 1.07e-9)
    assert wide.modes(3).omega[0] / (2 * np.pi) == pytest.approx(speed / 16.0, rel=0.02)


@pytest.mark.slow
def test_a_slab_and_a_dome_of_one_section_are_one(finger, coarse):
    slab = replace(finger, shape=Slab((24.0, 20.0), (21.0, 17.0), (10.0, 6.0), 8.0))
    assert isinstance(finger.shape, Dome)
    np.testing.assert_array_equal(prepare_section(slab, size_mm=0.3).compliance, coarse.compliance)


@pytest.mark.slow
def test_a_wave_on_smooth_skin_fades_as_the_half_planes(finger):
    """Strain at depth z under a pressure wave goes as kz exp(-kz): 3 mm below, a fine grating is not heard."""
    section = prepare_section(replace(finger, ridges=None), size_mm=0.25)
    n, middle = len(section.x), 2
    width = section.hats.sum(axis=1) / 2 * np.exp(-((section.x / 5.0) ** 2))
    strain = {}
    for wavelength in (6.0, 4.0, 3.0):
        k = 2 * np.pi / wavelength
        strain[wavelength] = abs(section.rows[0, middle, n:] @ (np.exp(1j * k * section.x) * width)) / np.sinc(
            2.4 / wavelength
        )
    for one, other in ((6.0, 4.0), (4.0, 3.0)):
        fading = [3 * k * np.exp(-3 * k) for k in (2 * np.pi / one, 2 * np.pi / other)]
        assert 0.4 < (strain[one] / strain[other]) / (fading[0] / fading[1]) < 2.5


@pytest.mark.slow
def test_modes_follow_a_force_in_time_as_the_whole_does(model):
    """A smooth knock, against all unknowns by the trapezoidal rule (inf-sup pressure included), without loss."""
    compliance, rows = model.condense()
    modes, step, count = model.modes(30), 5e-4, 60
    n = len(compliance) // 2
    readings = 1e6 * rows[0]
    load = np.zeros(2 * n)
    load[n // 2], load[n + n // 2] = 0.3, 1.0
    knock = np.sin(np.pi * np.minimum(np.arange(count + 1) / 40, 1.0)) ** 2
    moving = Modal(modes, compliance, readings, 1e6 * modes.gauges[0], step, 0.0 * modes.omega, 0.0 * load)
    found = []
    for size in knock[1:]:
        moving.accept(size * load)
        found.append(moving.readings(size * load))
    stiffness, mass = (matrix[model.free][:, model.free].tocsc() for matrix in model.system)
    inside = model.free < 2 * model.nodes
    means, _ = model.patch_weights
    full = np.zeros(len(model.free))
    full[inside] = (means.T @ load)[model.free[inside]]
    factor = splu((stiffness + 4 / step**2 * mass).tocsc())
    u, speed, pull = np.zeros(len(full)), np.zeros(len(full)), 0.0 * full
    gauges = 1e6 * model.gauge_rows[: len(readings)]
    exact = []
    for size in knock[1:]:
        # Trapezoidal: M a = f - K u at both ends; `pull` is M a
        new = factor.solve(size * full + mass @ (4 / step**2 * u + 4 / step * speed) + pull)
        speed = 2 / step * (new - u) - speed
        u, pull = new, np.where(inside, size * full - stiffness @ new, 0.0)
        field = np.zeros(2 * model.nodes)
        field[model.free[inside]] = u[inside]
        exact.append(gauges @ field)
    exact = np.array(exact)
    assert np.abs(np.array(found) - exact).max() < 0.03 * np.abs(exact).max()


def test_means_over_the_skin_are_those_of_gauss_points(model):
    """A constant field and a linear one, integrated by another rule."""
    means, hats = model.patch_weights
    vertices, points = model.patch_vertices, model.section.points
    for field in (lambda x: 0 * x + 3.0, lambda x: 2 + x):
        moved = np.zeros(2 * model.nodes)
        places = model.scalar.doflocs[0]
        moved[model.component[0]] = field(places)
        found = (means @ moved)[: len(vertices)]
        expected, weight = np.zeros(len(points)), np.zeros(len(points))
        gauss, weights = np.polynomial.legendre.leggauss(3)
        for a, b in model.section.spans:
            length = np.linalg.norm(points[b] - points[a])
            for s, w in zip((gauss + 1) / 2, weights / 2, strict=True):
                value = field(points[a, 0] * (1 - s) + points[b, 0] * s) * w * length
                expected[[a, b]] += np.array([1 - s, s]) * value
                weight[[a, b]] += np.array([1 - s, s]) * w * length
        np.testing.assert_allclose(hats, weight[vertices], rtol=1e-9)
        np.testing.assert_allclose(found, (expected / np.maximum(weight, 1e-300))[vertices], rtol=1e-9)
