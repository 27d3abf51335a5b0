"""The closed forms against each other, against independent quadrature, and against published numbers."""

import math

import numpy as np
import pytest
from scipy import integrate, special

from papilla import references as ref
from papilla.core.errors import InputError
from papilla.model.specimen import HalfSpace
from papilla.references import hertz

NUS = (0.0, 0.3, 0.495, 0.5)

# chi, F/F_Hertz, a^2/(R d) of a rigid sphere on a bonded incompressible layer, as printed
BONDED_LAYER_TABLE = [(0.19, 1.2789, 1.1730), (0.49, 2.1173, 1.5218), (1.05, 5.5257, 2.0207), (1.92, 16.853, 2.4560)]


def layer_contact(chi, nu=0.5):
    return ref.bonded_layer_sphere(chi**2, radius=1.0, thickness=1.0, modulus=1.0, nu=nu)


def test_hertz_sphere_follows_the_closed_form():
    contact = ref.hertz_sphere_at(0.5, 25.0, 0.2)
    assert contact.force == pytest.approx(4 / 3 * 0.2 * 5 * 0.5**1.5, rel=1e-14)
    assert contact.a == contact.b == pytest.approx(math.sqrt(12.5), rel=1e-14)
    assert contact.area == pytest.approx(math.pi * 12.5, rel=1e-14)
    assert contact.peak_pressure == pytest.approx(1.5 * contact.force / (math.pi * 12.5), rel=1e-14)
    assert ref.hertz_sphere(contact.force, 25.0, 0.2).indentation == pytest.approx(0.5, rel=1e-14)


def test_two_bodies_are_as_one_and_swapped_radii_turn_the_ellipse():
    assert ref.effective_modulus(0.2, 0.3, 0.7, 0.45) == pytest.approx(1 / (0.91 / 0.2 + (1 - 0.45**2) / 0.7))
    assert ref.effective_modulus(0.2, 0.3) == ref.effective_modulus(math.inf, 0.1, 0.2, 0.3) == 0.2 / 0.91
    long, turned = ref.hertz_ellipse(0.7, 60.0, 25.0, 0.2), ref.hertz_ellipse(0.7, 25.0, 60.0, 0.2)
    assert (long.a, long.b, long.indentation) == (turned.b, turned.a, turned.indentation)
    pressed = ref.hertz_ellipse_at(long.indentation, 25.0, 60.0, 0.2)
    assert (pressed.a, pressed.b) == pytest.approx((turned.a, turned.b))
    assert ref.hertz_ellipse(1.0, 1e5, 10.0, 0.1).a > 100
    with pytest.raises(InputError, match="ratio must be at most 10000"):
        ref.hertz_ellipse(1.0, 1.01e5, 10.0, 0.1)
    disc = integrate.quad(lambda r: 8 * r * 0.3 * 2.5 / (math.pi * 0.7) * special.ellipe(r**2), 0, 1)[0]
    assert ref.uniform_disc_mean_displacement(2.5, 0.3, 0.7) == pytest.approx(disc)


@pytest.mark.parametrize("ratio", [1 + 1e-9, 1.25, 2.0, 30.0, 1e3])
def test_hertz_ellipse_satisfies_its_curvature_equations(ratio):
    """The pressure p0 sqrt(1 - x^2/a^2 - y^2/b^2) must bend both surfaces by the prescribed curvatures."""
    e_star, radius_x, radius_y = 0.2, 25.0 * ratio, 25.0
    contact = ref.hertz_ellipse(0.7, radius_x, radius_y, e_star)
    assert contact.pressure(0.0, 0.0) == pytest.approx(1.05 / contact.area, rel=1e-12), "it carries the force"
    assert contact.pressure(0.6 * contact.a, -0.48 * contact.b) == pytest.approx(0.64 * contact.peak_pressure)
    assert contact.pressure(contact.a, contact.b) == 0
    a, b, p0 = contact.a, contact.b, contact.peak_pressure
    # 1/(2 R') = (p0/E*)(b/a^2) (K - E)/m and 1/(2 R'') alike, as Carlson integrals: scipy's, not the package's
    k2 = (b / a) ** 2
    assert p0 * b / (e_star * a**2) * special.elliprd(0, k2, 1) / 3 == pytest.approx(0.5 / radius_x, rel=1e-12)
    assert p0 * b / (e_star * a**2) * special.elliprd(0, 1, k2) / 3 == pytest.approx(0.5 / radius_y, rel=1e-12)
    assert contact.indentation == pytest.approx(p0 * b / e_star * special.ellipkm1(k2), rel=1e-12)
    assert ref.hertz_ellipse_at(contact.indentation, radius_x, radius_y, e_star).force == pytest.approx(0.7, rel=1e-12)


def layer_share(Q, nu):
    """Normal compliance of a bonded layer over the half-space's, literally as printed."""
    numerator = (3 - 4 * nu) * np.sinh(2 * Q) - 2 * Q
    return numerator / ((3 - 4 * nu) * np.cosh(2 * Q) + 2 * Q**2 + 4 * nu * (2 * nu - 3) + 5)


@pytest.mark.parametrize("nu", NUS)
def test_layer_on_a_rigid_base_is_its_formula_and_its_limits(nu):
    thickness, modulus = 10.0, 0.5
    layer, e_star = [ref.StackLayer(thickness, modulus, nu)], modulus / (1 - nu**2)
    q = np.linspace(0.3, 12, 60) / thickness
    stiffness = ref.layered_halfspace_stiffness(q, layer, None)
    np.testing.assert_allclose(stiffness, ref.halfspace_stiffness(q, e_star) / layer_share(q * 10, nu), rtol=1e-11)
    huge = np.array([1e2, 1e5, 1e12])
    stiffness = ref.layered_halfspace_stiffness(huge, layer, None)
    np.testing.assert_allclose(stiffness, ref.halfspace_stiffness(huge, e_star), rtol=1e-13)
    tiny = np.array([1e-5, 1e-6])
    if nu == 0.5:
        limit = 0.75 * e_star / (tiny**2 * thickness**3)
    else:
        confined = modulus * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
        limit = np.full(2, confined / thickness)
    np.testing.assert_allclose(ref.layered_halfspace_stiffness(tiny, layer, None), limit, rtol=1e-6)


@pytest.mark.parametrize("nu", NUS)
def test_layered_stack_contains_the_simple_bodies(nu):
    q = np.geomspace(1e-7, 1e4, 40)
    bonded = ref.layered_halfspace_stiffness(q, [ref.StackLayer(10.0, 1.3, nu)], None)
    for parts in ((3.0, 7.0), (0.01, 2.0, 7.99)):
        stack = [ref.StackLayer(part, 1.3, nu) for part in parts]
        np.testing.assert_allclose(ref.layered_halfspace_stiffness(q, stack, None), bonded, rtol=1e-11)
    alone = ref.halfspace_stiffness(q, 1.3 / (1 - nu**2))
    np.testing.assert_allclose(ref.layered_halfspace_stiffness(q, [], HalfSpace(1.3, nu)), alone, rtol=1e-13)
    same = ref.layered_halfspace_stiffness(q, [ref.StackLayer(3.0, 1.3, nu)], HalfSpace(1.3, nu))
    np.testing.assert_allclose(same, alone, rtol=1e-12)


def test_stiff_plate_on_soft_base_bends_as_a_plate():
    """A thin, far stiffer layer adds the plate's D q^4, and its own clamping of the base's surface."""
    q, nu = np.array([0.01, 0.02]), 0.3
    plate = 1e7 / (12 * (1 - nu**2)) * q**4
    stiffness = ref.layered_halfspace_stiffness(q, [ref.StackLayer(1.0, 1e7, nu)], HalfSpace(1e-3, 0.5))
    np.testing.assert_allclose(stiffness, plate + ref.halfspace_stiffness(q, 1e-3 / 0.75), rtol=1e-3)


@pytest.mark.parametrize("nu", NUS)
@pytest.mark.parametrize("thickness", [0.5, 10.0, 1000.0])
def test_kernel_against_adaptive_quadrature_of_the_stiffness(nu, thickness):
    """From the formula as printed, not from the deficit that the package integrates."""
    e_star = 1 / (1 - nu**2)

    def integrand(Q, r):
        return (layer_share(Q, nu) - 1) * special.j0(Q / thickness * r) / (math.pi * e_star * thickness)

    distances = np.array([r for r in (0.0, 0.01, 0.7, 5.0, 17.0, 40.0) if r <= 20 * thickness])
    exact = {"limit": 500, "epsabs": 0, "epsrel": 1e-11}
    expected = [integrate.quad(integrand, 1e-12, 22, args=(r,), **exact)[0] for r in distances]
    scale = abs(expected[0])
    np.testing.assert_allclose(ref.LayerKernel(thickness, nu)(distances), expected, rtol=0, atol=1e-9 * scale)


@pytest.mark.parametrize(("chi", "force_ratio", "area_ratio"), BONDED_LAYER_TABLE)
def test_bonded_layer_sphere_reproduces_the_table(chi, force_ratio, area_ratio):
    contact = layer_contact(chi)
    assert contact.hertz_factor == pytest.approx(force_ratio, rel=5e-5)
    assert contact.contact_radius**2 / chi**2 == pytest.approx(area_ratio, abs=6e-5)
    hertz = ref.hertz_sphere_at(chi**2, 1.0, 1 / 0.75)
    assert contact.force == pytest.approx(contact.hertz_factor * hertz.force, rel=1e-14)


def surface_displacement(contact, x, thickness, nu):
    """Surface displacement (E = 1) at distance x inside the contact: the pressure against both kernels, about x."""
    kernel, a = ref.LayerKernel(thickness, nu), contact.contact_radius
    angles = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    v, weights = (lambda n, w: (0.5 * (n + 1), 0.5 * w))(*np.polynomial.legendre.leggauss(96))
    reach = -x * np.cos(angles) + np.sqrt(a**2 - (x * np.sin(angles)) ** 2)
    s = reach[:, None] * (1 - v**2)
    r = np.sqrt(x**2 + s**2 + 2 * x * s * np.cos(angles)[:, None])
    integrand = contact.pressure(r) * ((1 - nu**2) / np.pi + s * kernel(s)) * 2 * v * reach[:, None]
    return float((integrand @ weights).mean() * 2 * np.pi)


@pytest.mark.parametrize("nu", (0.3, 0.5))
@pytest.mark.parametrize("chi", (0.1, 1.0, 1.92, 5.0))
def test_bonded_layer_pressure_makes_the_sphere_fit(chi, nu):
    """Pressure and kernel come from different solutions; together they must give u = d - r^2/2R in the contact."""
    contact = layer_contact(chi, nu)
    for x in (0.0, 0.35 * contact.contact_radius, 0.8 * contact.contact_radius):
        expected = contact.indentation - x**2 / 2
        assert surface_displacement(contact, x, 1.0, nu) == pytest.approx(expected, abs=1e-6 * contact.indentation)


@pytest.mark.parametrize("nu", (0.0, 0.3, 0.49))
def test_boussinesq_is_in_equilibrium_and_balances_its_force(nu):
    """Navier's equations by differences, and on the surface the known 1/r."""
    h = 1e-3
    steps = h * np.eye(3)

    def moved(shift):
        return ref.boussinesq_displacement(np.array([0.7, -0.4, 0.9]) + shift, 2.0, 0.7, nu)

    second = np.array([[moved(a + b) - moved(a - b) - moved(b - a) + moved(-a - b) for b in steps] for a in steps])
    second /= 4 * h * h
    navier = np.einsum("aai->i", second) + np.einsum("iaa->i", second) / (1 - 2 * nu)
    assert np.abs(navier).max() < 1e-5 * np.abs(second).max() / (1 - 2 * nu)
    on_surface = ref.boussinesq_displacement([3.0, 4.0, 0.0], 2.0, 0.7, nu)
    assert on_surface[2] == pytest.approx(2.0 * (1 - nu**2) / (math.pi * 0.7 * 5.0), rel=1e-14)
    assert on_surface[:2] == pytest.approx(-2.0 * (1 + nu) * (1 - 2 * nu) / (2 * math.pi * 0.7 * 25) * np.array([3, 4]))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: ref.effective_modulus(1, 0.3, 1, 0.6), "nu of the second body"),
        (lambda: ref.effective_modulus(math.inf, 0.3), "both bodies are rigid"),
        (lambda: ref.hertz_sphere(0.0, 25, 0.1), "force"),
        (lambda: ref.hertz_ellipse(1.0, 25, math.nan, 0.1), "radius_y"),
        (lambda: ref.hertz_ellipse(1.0, 1e6, 1, 0.1), "ratio must be at most"),
        (lambda: ref.bonded_layer_deficit(-1.0, 0.5), "scaled wavenumber"),
        (lambda: ref.StackLayer(1.0, -1.0, 0.5), "layer modulus"),
        (lambda: ref.layered_halfspace_stiffness(1.0, [], None), "no layer on a rigid base"),
        (lambda: ref.LayerKernel(10, 0.5)([0.0, math.inf]), "distance r"),
        (lambda: ref.bonded_layer_sphere(1.0, 25, 0.1, 1.0), "must be at most 10"),
        (lambda: ref.boussinesq_displacement([0.0, 0.0, 0.0], 1, 1, 0.5), "away from the origin"),
        (lambda: ref.boussinesq_displacement([0.0, 1.0], 1, 1, 0.5), "shape"),
    ],
)
def test_bad_input_is_refused_in_one_line(call, message):
    with pytest.raises(InputError, match=message) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_two_equal_spheres_share_the_approach_and_the_printed_area_is_twice_too_large():
    found = hertz.shared_approach(0.5, 25.0, 0.1, 0.3)
    assert found.second / found.first == pytest.approx(0.1 / 0.3, rel=1e-12)
    whole = hertz.hertz_sphere(0.5, 12.5, hertz.effective_modulus(0.1, 0.5, 0.3, 0.5))
    assert found.first + found.second == pytest.approx(whole.indentation, rel=1e-12)
    printed = hertz.printed_area(found.first, found.second, 25.0)
    assert printed == pytest.approx(2 * found.area, rel=1e-12)
    assert hertz.printed_area_per_approach(0.1, 0.3, 25.0) * found.first == pytest.approx(printed, rel=1e-12)
