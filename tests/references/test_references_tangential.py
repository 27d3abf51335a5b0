"""Tangential kernels and frictional contact: against the equations of elasticity, other forms and printed numbers."""

import math

import numpy as np
import pytest
from scipy import integrate, special

from papilla import references as ref
from papilla.core.errors import InputError

NUS = (0.0, 0.3, 0.495, 0.5)


def half_space_green(xy, nu):
    r = np.linalg.norm(xy, axis=-1)[..., None, None]
    e = np.concatenate([xy, np.zeros((*np.shape(xy)[:-1], 1))], axis=-1)[..., None] / r
    down = np.array([[0.0], [0.0], [1.0]])
    coupling = (1 - 2 * nu) / 2 * (down * e.swapaxes(-1, -2) - e * down.T)
    return (1 + nu) / math.pi / r * ((1 - nu) * np.eye(3) + nu * e * e.swapaxes(-1, -2) + coupling)


def layer_compliance(q, h, nu):
    """(3, 3) real amplitudes of displacement along the wave, across it and down over such tractions; 1 MPa."""
    Q, shear = q * h, 1 / (2 * (1 + nu))
    bottom = (3 - 4 * nu) * np.cosh(2 * Q) + 2 * Q**2 + 4 * nu * (2 * nu - 3) + 5
    along, down = ((1 - nu) * ((3 - 4 * nu) * np.sinh(2 * Q) + sign * 2 * Q) / bottom for sign in (1, -1))
    coupling = (2 * Q**2 - (1 - 2 * nu) * (3 - 4 * nu) * (np.cosh(2 * Q) - 1)) / (2 * bottom)
    return np.array([[along, 0, coupling], [0, np.tanh(Q), 0], [coupling, 0, down]]) / (shear * q)


@pytest.mark.parametrize("nu", NUS)
def test_layer_compliance_is_that_of_the_layered_solver(nu):
    h = 2.5
    for Q in (0.05, 0.4, 0.95, 1.5, 4.0, 9.0):
        expected = ref.layered_surface_compliance(Q / h, [ref.StackLayer(h, 1.0, nu)], None)
        assert layer_compliance(Q / h, h, nu)[np.ix_([0, 2], [0, 2])] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("nu", (0.29, 0.48))
def test_layer_responds_to_a_smooth_load_as_its_spectrum_says(nu):
    """A Gaussian load: its Hankel transform times the compliance, against the Green's tensor integrated in space."""
    h, width, at = 1.3, 0.8, np.array([1.1, 0.6])
    layer = ref.BondedLayerGreen(h, nu)
    x, w = np.polynomial.legendre.leggauss(60)
    r, angle = 3.5 * (x + 1), (np.arange(64) + 0.5) * math.pi / 32
    offset = r[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    load = np.exp(-((at - offset) ** 2).sum(-1) / (2 * width**2)) / (2 * math.pi * width**2)
    in_space = np.einsum(
        "r,ra,raij->ij", 3.5 * w * r * math.pi / 32, load, layer(offset) + half_space_green(offset, nu)
    )

    def spectrum(i, j, bessel, order):
        def integrand(q):
            return q * layer_compliance(q, h, nu)[i, j] * math.exp(-((q * width) ** 2) / 2) * bessel(order, q * s)

        return integrate.quad(integrand, 1e-9, 12.0, limit=200)[0] / (2 * math.pi)

    s = math.hypot(*at)
    e = at / s
    even = [spectrum(k, k, special.jv, 0) for k in (0, 1)]
    second = [spectrum(k, k, special.jv, 2) for k in (0, 1)]
    twist = 2 * np.outer(e, e) - np.eye(2)
    tangential = (even[0] + even[1]) / 2 * np.eye(2) - (second[0] - second[1]) / 2 * twist
    assert in_space[:2, :2] == pytest.approx(tangential, rel=2e-6, abs=1e-9)
    assert in_space[2, 2] == pytest.approx(spectrum(2, 2, special.jv, 0), rel=2e-6)
    assert in_space[:2, 2] == pytest.approx(spectrum(0, 2, special.jv, 1) * e, rel=2e-5)
    assert in_space[2, :2] == pytest.approx(-in_space[:2, 2])


@pytest.mark.parametrize("nu", (0.0, 0.2, 0.3, 0.45))
def test_sticking_punch_and_sphere_are_mossakovskii_s(nu):
    """Force of the punch ln(3-4nu)(1-nu)/(1-2nu); depth of the sphere by Borodich and Keer's integral,
    doi:10.1098/rspa.2003.1224: 1/(2 int t cos(theta ln((1-t)/(1+t))) dt)."""
    found = ref.frictional_punch(ref.dundurs_beta(1.0, nu))
    assert found.force_factor == pytest.approx(math.log(3 - 4 * nu) * (1 - nu) / (1 - 2 * nu), rel=1e-10)
    theta = math.log(3 - 4 * nu) / (2 * math.pi)
    integral = integrate.quad(lambda v: math.tanh(v) * math.cos(2 * theta * v) / math.cosh(v) ** 2, 0, 30)[0]
    assert found.depth_factor == pytest.approx(1 / (2 * integral), rel=1e-9)
    assert found.stick_radius == 1.0


def test_slip_tends_to_goodman_s_for_small_coupling_and_to_stick_for_high_friction():
    for friction in (0.01, 0.02, 0.04):
        found = ref.frictional_punch(0.02, friction)
        assert found.stick_radius == pytest.approx(ref.goodman_stick_radius(0.02, friction), abs=5e-4)
        found = ref.frictional_punch(1e-3, friction / 20)
        assert found.stick_radius == pytest.approx(ref.goodman_stick_radius(1e-3, friction / 20), abs=8e-6)
    stuck, rubbed = ref.frictional_punch(0.25), ref.frictional_punch(0.25, 0.9)
    assert rubbed.force_factor == pytest.approx(stuck.force_factor, rel=1e-3)
    assert rubbed.depth_factor == pytest.approx(stuck.depth_factor, rel=1e-3)
    assert rubbed.shear_moment == pytest.approx(stuck.shear_moment, rel=5e-3)


@pytest.mark.parametrize("nu", (0.2, 0.5))
def test_far_from_the_force_a_layer_does_not_move(nu):
    layer, xy = ref.BondedLayerGreen(0.1, nu), np.array([[3.0, 4.0], [-12.0, 5.0]])
    assert layer(xy) == pytest.approx(-half_space_green(xy, nu), rel=1e-12)
    assert ref.LayerKernel(0.1, nu)(5.0) == pytest.approx(-(1 - nu**2) / (5 * math.pi), rel=1e-12)


def test_a_sliding_layer_is_half_of_one_that_is_pressed_from_both_sides():
    nu, h = 0.37, 2.0

    def deficit(Q):
        return 1 - (np.cosh(2 * Q) - 1) / (np.sinh(2 * Q) + 2 * Q)

    Q = np.array([0.01, 0.3, 1.0, 4.0])
    assert ref.sliding_layer_deficit(Q) == pytest.approx(deficit(Q), rel=1e-10)
    assert ref.sliding_layer_deficit([0.0, 20.0]) == pytest.approx([1, 80 * math.exp(-40)], rel=1e-9)
    for r in (0.0, 1.0, 7.0):
        exact = integrate.quad(lambda Q, r=r: deficit(Q) * special.j0(Q * r / h), 1e-9, 18, limit=200)[0]
        kernel = ref.LayerKernel(h, nu, bonded=False)(r)
        assert kernel == pytest.approx(-(1 - nu**2) / (math.pi * h) * exact, rel=1e-6)


def test_dundurs_beta_and_the_sphere_of_a_punch():
    """Swapped bodies change its sign, like ones have none; without friction the sphere is Hertz's."""
    assert ref.dundurs_beta(0.7, 0.2) == pytest.approx((1 - 0.4) / (2 * (1 - 0.2)))
    assert ref.dundurs_beta(0.7, 0.2, 1.9, 0.4) == pytest.approx(-ref.dundurs_beta(1.9, 0.4, 0.7, 0.2))
    first, second = ((1 - 2 * nu) * (1 + nu) / modulus for modulus, nu in ((0.7, 0.2), (1.9, 0.4)))
    e_star = ref.effective_modulus(0.7, 0.2, 1.9, 0.4)
    assert ref.dundurs_beta(0.7, 0.2, 1.9, 0.4) == pytest.approx((first - second) * e_star / 2)
    force, depth = ref.frictional_punch(0.0).sphere(0.3, 20.0, 0.5)
    hertz = ref.hertz_sphere_at(depth, 20.0, 0.5)
    assert (hertz.a, hertz.force) == pytest.approx((0.3, force))


def test_unusable_values_are_refused():
    for arguments, message in (((0.7,), "Dundurs' beta"), ((0.2, 0.0), "friction must be greater than 0")):
        with pytest.raises(InputError, match=message):
            ref.frictional_punch(*arguments)
    with pytest.raises(InputError, match="layer thickness"):
        ref.BondedLayerGreen(0.0, 0.3)
