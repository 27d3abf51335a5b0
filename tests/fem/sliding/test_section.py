"""The section: its mesh, its compliance against the layered kernel, its modes against the full matrices."""

from dataclasses import replace

import numpy as np
import pytest

from papilla import Layer, Slab
from papilla.fem.sliding.section import SectionModel
from papilla.mesh.layered import INNER_LAYER, OUTER_LAYER
from papilla.mesh.section import Section
from papilla.model.finger import Gauge
from papilla.references import StackLayer, layered_surface_compliance


def strip(width=40.0, across=160, thickness=(1.0, 3.0), rows=(8, 12)):
    """A flat layered strip, clamped below, whose middle half may be loaded."""
    x = np.linspace(-width / 2, width / 2, across + 1)
    below = np.linspace(0, thickness[1], rows[1] + 1)
    z = np.concatenate([below, thickness[1] + np.linspace(0, thickness[0], rows[0] + 1)[1:]])
    number = np.arange(len(x) * len(z)).reshape(len(z), len(x))
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    cells = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    layer = np.tile(np.repeat([INNER_LAYER] * rows[1] + [OUTER_LAYER] * rows[0], across), 2)
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


def test_the_first_mode_of_a_soft_layer_is_its_shear_wave(finger):
    """A wide strip sheared sideways: f = c / (4 h), c^2 = G / rho."""
    soft = Layer(0.034, 0.4999)
    flat = Slab((60.0, 4.0), (59.0, 3.0), (1.0, 0.5))
    flat_finger = replace(finger, shape=flat, outer=soft, inner=soft, gauges=(Gauge("g", x_mm=0.0),), ridges=None)
    wide = SectionModel(flat_finger, strip(width=120.0, across=80, rows=(2, 4)))
    speed = np.sqrt(0.034 / 3 / 1.07e-9)
    assert wide.modes(3).omega[0] / (2 * np.pi) == pytest.approx(speed / 16.0, rel=0.02)
