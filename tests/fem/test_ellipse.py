"""Contact area and peak pressure from the moments of a nodal pressure."""

import numpy as np
import pytest
from skfem import Basis, ElementTriP1, MeshTri

from papilla.fem.ellipse import contact_shape
from papilla.references import HertzContact


def projected(patch, pressure):
    """Nodal values of the least-squares projection of pressure(x, y)."""
    basis = Basis(MeshTri(patch.xy.T.copy(), patch.triangles.T.copy()), ElementTriP1(), intorder=10)
    return basis.project(lambda x: pressure(x[0], x[1]))


@pytest.mark.parametrize("semi_axes", [(2.0, 2.0), (1.2, 2.6), (3.0, 1.5)])
def test_hertzian_pressure(disc, semi_axes):
    exact = HertzContact(0.7, 0.1, *semi_axes)
    patch = disc(4.0, 20)
    shape = contact_shape(patch, projected(patch, exact.pressure))
    assert shape.elliptic
    assert shape.area == pytest.approx(exact.area, rel=0.01)
    assert shape.peak_pressure == pytest.approx(exact.peak_pressure, rel=0.01)


@pytest.mark.parametrize("angle", [0.0, 30.0, 45.0, -70.0])
def test_an_ellipse_off_the_middle_and_turned(disc, angle):
    """Off-centre contact: no plane of symmetry, and the middle is not where the specimen touched down."""
    exact = HertzContact(0.7, 0.1, 2.4, 1.2)
    turn = np.radians(angle)

    def pressure(x, y):
        x, y = x - 0.6, y + 0.4
        return exact.pressure(np.cos(turn) * x + np.sin(turn) * y, -np.sin(turn) * x + np.cos(turn) * y)

    patch = disc(4.0, 16, quarter=False)
    shape = contact_shape(patch, projected(patch, pressure))
    assert shape.elliptic
    assert shape.area == pytest.approx(exact.area, rel=0.015)
    assert shape.peak_pressure == pytest.approx(exact.peak_pressure, rel=0.015)


@pytest.mark.parametrize("q", [-0.8, -0.3, 0.4, 1.0])
def test_the_layer_term_is_recovered(disc, q):
    """F/(pi a b) [(1 - q) 3/2 t + q 5/2 t^3], t = sqrt(1 - r^2/a^2): flatter or more pointed than Hertz's."""

    def pressure(x, y):
        t = np.sqrt(np.maximum(0, 1 - (x**2 + y**2) / 9))
        return 0.1 * ((1 - q) * 1.5 * t + q * 2.5 * t**3)

    patch = disc(4.0, 20)
    shape = contact_shape(patch, projected(patch, pressure))
    t = np.linspace(0, 1, 100_001)
    assert shape.elliptic
    assert shape.area == pytest.approx(np.pi * 9, rel=0.015)
    assert shape.peak_pressure == pytest.approx(0.1 * np.max((1 - q) * 1.5 * t + q * 2.5 * t**3), rel=0.015)


def test_scaling_and_units(disc):
    patch = disc(4.0, 12)
    pressure = projected(patch, HertzContact(0.7, 0.1, 2.0, 3.0).pressure)
    shape, scaled = contact_shape(patch, pressure), contact_shape(patch, 1e-9 * pressure)
    assert scaled.area == pytest.approx(shape.area, rel=1e-12)
    assert scaled.peak_pressure == pytest.approx(1e-9 * shape.peak_pressure, rel=1e-12)


def test_a_quarter_reads_as_the_whole(disc):
    patches = disc(4.0, 10), disc(4.0, 10, quarter=False)
    # The moments agree to rounding; the mean element size counts nodes of the planes once or four times
    shapes = [contact_shape(p, HertzContact(0.7, 0.1, 1.5, 2.5).pressure(*p.xy.T)) for p in patches]
    assert shapes[0].area == pytest.approx(shapes[1].area, rel=2e-3)
    assert shapes[0].peak_pressure == pytest.approx(shapes[1].peak_pressure, rel=2e-3)


@pytest.mark.parametrize("quarter", [True, False])
def test_a_line_contact_is_counted(disc, quarter):
    """A stripe along the whole patch, as on a slab, is no ellipse: nodes are counted, and the shape says so."""
    patch = disc(4.0, 12, quarter=quarter)
    pressure = np.where(np.abs(patch.xy[:, 0]) < 0.5, 0.2, 0.0)
    shape = contact_shape(patch, pressure)
    assert not shape.elliptic
    assert shape.area == pytest.approx((1 if not quarter else 4) * patch.mass[pressure > 0].sum())
    assert shape.peak_pressure == 0.2


def test_a_ring_is_counted(disc):
    patch = disc(4.0, 12)
    distance = np.hypot(*patch.xy.T)
    shape = contact_shape(patch, np.where(distance > 3.0, 1.0, 0.0))
    assert not shape.elliptic
