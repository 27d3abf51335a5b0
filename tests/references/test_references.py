"""The closed forms against each other, against independent quadrature, and against published numbers."""

import inspect
import math

import numpy as np
import pytest
from scipy import integrate, special

from papilla import references as ref
from papilla.core.errors import InputError
from papilla.model.specimen import HalfSpace
from papilla.references.layer import panel_quadrature

NUS = (0.0, 0.3, 0.495, 0.5)

# chi, F/F_Hertz, a^2/(R d) of a rigid sphere on a bonded incompressible layer, as printed
BONDED_LAYER_TABLE = [
    (0.10, 1.1291, 1.0836),
    (0.19, 1.2789, 1.1730),
    (0.34, 1.6233, 1.3439),
    (0.49, 2.1173, 1.5218),
    (0.75, 3.3832, 1.7894),
    (1.05, 5.5257, 2.0207),
    (1.92, 16.853, 2.4560),
]


def layer_contact(chi, nu=0.5):
    return ref.bonded_layer_sphere(indentation=chi**2, radius=1.0, thickness=1.0, modulus=1.0, nu=nu)


# ---- Hertz


def test_effective_modulus():
    assert ref.effective_modulus(0.1, 0.5) == pytest.approx(0.1 / 0.75, rel=1e-15)
    assert ref.effective_modulus(0.1, 0.5, 0.3, 0.2) == pytest.approx(1 / (0.75 / 0.1 + 0.96 / 0.3), rel=1e-15)


def test_hertz_sphere_follows_the_closed_form():
    contact = ref.hertz_sphere_at(0.5, 25.0, 0.2)
    assert contact.force == pytest.approx(4 / 3 * 0.2 * 5 * 0.5**1.5, rel=1e-14)
    assert contact.a == contact.b == pytest.approx(math.sqrt(12.5), rel=1e-14)
    assert contact.area == pytest.approx(math.pi * 12.5, rel=1e-14)
    assert contact.peak_pressure == pytest.approx(1.5 * contact.force / (math.pi * 12.5), rel=1e-14)
    assert ref.hertz_sphere(contact.force, 25.0, 0.2).indentation == pytest.approx(0.5, rel=1e-14)


@pytest.mark.parametrize("ratio", [1 + 1e-9, 1.25, 2.0, 30.0, 1e3])
def test_hertz_ellipse_satisfies_its_curvature_equations(ratio):
    """The pressure p0 sqrt(1 - x^2/a^2 - y^2/b^2) must bend both surfaces by the prescribed curvatures."""
    e_star, radius_x, radius_y = 0.2, 25.0 * ratio, 25.0
    contact = ref.hertz_ellipse(0.7, radius_x, radius_y, e_star)
    a, b, p0 = contact.a, contact.b, contact.peak_pressure
    # 1/(2 R') = (p0/E*)(b/a^2) (K - E)/m and 1/(2 R'') alike, as Carlson integrals: scipy's, not the package's
    k2 = (b / a) ** 2
    assert p0 * b / (e_star * a**2) * special.elliprd(0, k2, 1) / 3 == pytest.approx(0.5 / radius_x, rel=1e-12)
    assert p0 * b / (e_star * a**2) * special.elliprd(0, 1, k2) / 3 == pytest.approx(0.5 / radius_y, rel=1e-12)
    assert contact.indentation == pytest.approx(p0 * b / e_star * special.ellipkm1(k2), rel=1e-12)
    assert ref.hertz_ellipse_at(contact.indentation, radius_x, radius_y, e_star).force == pytest.approx(0.7, rel=1e-12)


def test_hertz_ellipse_is_the_sphere_in_the_circular_limit():
    sphere = ref.hertz_sphere(0.7, 25.0, 0.2)
    assert sphere.a == pytest.approx((0.75 * 0.7 * 25 / 0.2) ** (1 / 3), rel=1e-14)
    for ratio in (1 + 1e-15, 1 + 1e-12, 1 + 1e-7):
        ellipse = ref.hertz_ellipse(0.7, 25.0 * ratio, 25.0 / ratio, 0.2)
        assert ellipse.indentation == pytest.approx(sphere.indentation, rel=1e-12)
        assert ellipse.a / ellipse.b == pytest.approx(ratio ** (4 / 3), rel=1e-14)


def test_hertz_ellipse_keeps_its_orientation():
    along_x, along_y = ref.hertz_ellipse(1.0, 60.0, 20.0, 0.1), ref.hertz_ellipse(1.0, 20.0, 60.0, 0.1)
    assert along_x.a > along_x.b
    assert (along_x.a, along_x.b) == (along_y.b, along_y.a)
    assert along_x.pressure(1.0, 2.0) == pytest.approx(along_y.pressure(2.0, 1.0), rel=1e-14)
    assert along_x.pressure(8.0, 0.0) > 0 == along_x.pressure(0.0, 8.0)


@pytest.mark.parametrize(("ratio", "cost"), [(2.0, 0.007), (3.0, 0.017)])
def test_mean_radius_costs_what_is_stated(ratio, cost):
    sphere = ref.hertz_sphere(1.0, 25.0, 0.1)
    ellipse = ref.hertz_ellipse(1.0, 25.0 * math.sqrt(ratio), 25.0 / math.sqrt(ratio), 0.1)
    assert sphere.indentation / ellipse.indentation - 1 == pytest.approx(cost, abs=5e-4)


def test_hertz_pressure_carries_the_force():
    contact = ref.hertz_ellipse(0.7, 60.0, 20.0, 0.2)
    x = np.linspace(-contact.a, contact.a, 801) * 1.1
    y = np.linspace(-contact.b, contact.b, 801) * 1.1
    pressure = contact.pressure(x[:, None], y)
    assert pressure.sum() * (x[1] - x[0]) * (y[1] - y[0]) == pytest.approx(0.7, rel=1e-4)
    assert pressure.max() == pytest.approx(contact.peak_pressure, rel=1e-14)
    assert pressure[0, 0] == 0


def test_hertz_scales_with_its_units():
    """Lengths times 1000 and forces times 1e-6 (mm to um, N to MN) leave the dimensionless answer alone."""
    contact, scaled = ref.hertz_ellipse(1.0, 60.0, 20.0, 0.1), ref.hertz_ellipse(1e-6, 6e4, 2e4, 1e-13)
    assert scaled.indentation / 1000 == pytest.approx(contact.indentation, rel=1e-12)
    assert scaled.b / 1000 == pytest.approx(contact.b, rel=1e-12)


# ---- Layers in wavenumber


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
        limit = np.full(2, oedometric_modulus(modulus, nu) / thickness)
    np.testing.assert_allclose(ref.layered_halfspace_stiffness(tiny, layer, None), limit, rtol=1e-6)


def oedometric_modulus(modulus, nu):
    """Modulus of confined compression."""
    return modulus * (1 - nu) / ((1 + nu) * (1 - 2 * nu))


@pytest.mark.parametrize("nu", NUS)
def test_deficit_is_what_the_layer_lacks(nu):
    Q = np.geomspace(1e-2, 40, 80)
    np.testing.assert_allclose(1 - ref.bonded_layer_deficit(Q, nu), layer_share(Q, nu), rtol=0, atol=1e-14)
    assert ref.bonded_layer_deficit(0.0, nu) == pytest.approx(1.0, rel=1e-15)


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


def test_hard_layer_on_soft_halfspace_goes_from_base_to_layer():
    q = np.geomspace(1e-4, 10, 60)
    hard, soft = 0.136 / (1 - 0.5**2), 0.034 / (1 - 0.5**2)
    stiffness = ref.layered_halfspace_stiffness(q, [ref.StackLayer(3.0, 0.136, 0.5)], HalfSpace(0.034, 0.5))
    effective = 2 * stiffness / q
    assert np.all(np.diff(effective) > -1e-12)
    assert effective[0] == pytest.approx(soft, rel=2e-3)
    assert effective[-1] == pytest.approx(hard, rel=1e-12)


def test_unlike_layers_are_springs_in_series_at_long_wavelengths():
    stack = [ref.StackLayer(3.0, 0.136, 0.3), ref.StackLayer(11.0, 0.034, 0.45)]
    flexibility = sum(layer.thickness / oedometric_modulus(layer.modulus, layer.nu) for layer in stack)
    stiffness = ref.layered_halfspace_stiffness(np.array([1e-7, 1e-5]), stack, None)
    np.testing.assert_allclose(stiffness, 1 / flexibility, rtol=1e-6)


def test_stiff_plate_on_soft_base_bends_as_a_plate():
    """A thin, far stiffer layer adds the plate's D q^4, and its own clamping of the base's surface."""
    q, nu = np.array([0.01, 0.02]), 0.3
    plate = 1e7 / (12 * (1 - nu**2)) * q**4
    stiffness = ref.layered_halfspace_stiffness(q, [ref.StackLayer(1.0, 1e7, nu)], HalfSpace(1e-3, 0.5))
    np.testing.assert_allclose(stiffness, plate + ref.halfspace_stiffness(q, 1e-3 / 0.75), rtol=1e-3)


# ---- The bonded layer's kernel


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


@pytest.mark.parametrize("nu", NUS)
def test_kernel_table_is_its_quadrature_everywhere(nu):
    r = np.linspace(0.0, 49.9, 1777)
    Q, weights = panel_quadrature(0.0, 24.0, 150)
    kernel = ref.LayerKernel(1.0, nu)
    assert kernel(r[:, None]).shape == (1777, 1)
    transform = special.j0(np.outer(r, Q)) @ (weights * ref.bonded_layer_deficit(Q, nu))
    expected = -(1 - nu**2) / math.pi * transform
    np.testing.assert_allclose(kernel(r), expected, rtol=0, atol=1e-10 * abs(kernel(0.0)))


@pytest.mark.parametrize("nu", NUS)
def test_kernel_limits(nu):
    """Stiffer than the half-space everywhere; nothing left far away; a thick layer is a half-space."""
    r = np.linspace(0.1, 40.0, 200)
    halfspace = (1 - nu**2) / (math.pi * r)
    thin, thick = ref.LayerKernel(0.5, nu), ref.LayerKernel(1000.0, nu)
    assert np.all(thin(r) < 0)
    assert np.all(thick(r) < 0)
    np.testing.assert_allclose(thin(r[-1:]), -halfspace[-1:], rtol=1e-13)
    assert np.max(np.abs(thick(r) / halfspace)) < 0.08
    np.testing.assert_allclose(ref.LayerKernel(1e9, nu)(r), 0.0, rtol=0, atol=1e-9)
    # The kernel depends on r/h alone, times 1/h
    np.testing.assert_allclose(thick(r), thin(r / 2000) / 2000, rtol=1e-12)


@pytest.mark.parametrize("nu", (0.3, 0.5))
@pytest.mark.parametrize("radius", (0.3, 1.0, 8.0))
def test_kernel_gives_the_mean_displacement_of_a_disc(nu, radius):
    """Mean over pairs of points of a disc, by the density of their distances, against the spectrum of the disc."""
    thickness, modulus = 2.0, 0.4
    kernel = ref.LayerKernel(thickness, nu)
    force = math.pi * radius**2
    e_star = modulus / (1 - nu**2)

    def pair_density(s):
        x = s / (2 * radius)
        return 4 * s / (math.pi * radius**2) * (math.acos(x) - x * math.sqrt(1 - x * x))

    pairs = integrate.quad(lambda s: kernel(s) * pair_density(s), 0, 2 * radius, epsrel=1e-10, limit=200)[0]
    mean = ref.uniform_disc_mean_displacement(radius, 1.0, e_star) + force / modulus * pairs

    def spectral(q):
        shortfall = 2 / (e_star * q) * (1 - layer_share(q * thickness, nu))
        return shortfall * 2 * special.j1(q * radius) ** 2 / q

    shortfall = integrate.quad(spectral, 1e-12, 24 / thickness, epsrel=1e-10, limit=500)[0]
    assert mean == pytest.approx(ref.uniform_disc_mean_displacement(radius, 1.0, e_star) - shortfall, rel=1e-7)


# ---- Sphere on a bonded layer


@pytest.mark.parametrize(("chi", "force_ratio", "area_ratio"), BONDED_LAYER_TABLE)
def test_bonded_layer_sphere_reproduces_the_table(chi, force_ratio, area_ratio):
    contact = layer_contact(chi)
    assert contact.hertz_factor == pytest.approx(force_ratio, rel=5e-5)
    assert contact.contact_radius**2 / chi**2 == pytest.approx(area_ratio, abs=6e-5)
    hertz = ref.hertz_sphere_at(chi**2, 1.0, 1 / 0.75)
    assert contact.force == pytest.approx(contact.hertz_factor * hertz.force, rel=1e-14)


@pytest.mark.parametrize("nu", NUS)
def test_bonded_layer_sphere_tends_to_hertz(nu):
    contact, hertz = layer_contact(1e-5, nu), ref.hertz_sphere_at(1e-10, 1.0, 1 / (1 - nu**2))
    assert contact.force == pytest.approx(hertz.force, rel=2e-5)
    assert contact.area == pytest.approx(hertz.area, rel=2e-5)
    assert contact.peak_pressure == pytest.approx(hertz.peak_pressure, rel=2e-5)
    r = np.linspace(0, 1.2 * hertz.a, 50)
    np.testing.assert_allclose(contact.pressure(r), hertz.pressure(r, 0.0), rtol=0, atol=1e-4 * hertz.peak_pressure)


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


@pytest.mark.parametrize("chi", (0.1, 1.0, 10.0))
def test_bonded_layer_pressure_carries_the_force(chi):
    contact = layer_contact(chi)
    v, weights = np.polynomial.legendre.leggauss(200)
    rise = 0.5 * (v + 1)
    # r = a sqrt(1 - rise^2) removes the square root at the rim
    pressure = contact.pressure(contact.contact_radius * np.sqrt(1 - rise**2))
    assert 2 * contact.area * (pressure * rise) @ (0.5 * weights) == pytest.approx(contact.force, rel=1e-8)
    assert contact.pressure(1.01 * contact.contact_radius) == 0


def test_thin_incompressible_layer_tends_to_lubrication():
    """F -> pi E* a^6/(128 R h^3) and a^2 -> 4 R d, with corrections in h/a that shrink as they should."""
    force_error, area_error = [], []
    for chi in (2.5, 5.0, 10.0):
        contact = layer_contact(chi)
        force_error.append(contact.force / (math.pi / 0.75 * contact.contact_radius**6 / 128) - 1)
        area_error.append(4 - contact.contact_radius**2 / chi**2)
    assert all(2.0 < fine / coarse < 3.2 for coarse, fine in zip(force_error[1:], force_error, strict=False))
    assert area_error[0] > area_error[1] > area_error[2] > 0
    assert area_error[1] / area_error[2] > 1.6


def test_thin_compressible_layer_tends_to_an_elastic_foundation():
    """Winkler: a^2 -> 2 R d and F -> pi M R d^2/h, M the oedometric modulus."""
    contact = layer_contact(10.0, 0.2)
    assert contact.contact_radius**2 / 100 == pytest.approx(2.0, rel=0.05)
    foundation = math.pi * oedometric_modulus(1.0, 0.2) * contact.indentation**2
    assert contact.force == pytest.approx(foundation, rel=0.1)
    thicker = layer_contact(5.0, 0.2)
    assert thicker.force / thicker.indentation**2 > contact.force / contact.indentation**2 > foundation / 100**2


def test_commonly_quoted_polynomial_is_off():
    """1 + 1.133 chi + 1.283 chi^2 + 0.769 chi^3 + 0.0975 chi^4 loses 7 % at chi 0.49 and 17 % at 1.05."""
    for chi, loss in ((0.49, 0.07), (1.05, 0.17)):
        quoted = np.polynomial.polynomial.polyval(chi, [1, 1.133, 1.283, 0.769, 0.0975])
        assert 1 - quoted / layer_contact(chi).hertz_factor == pytest.approx(loss, abs=0.006)


def test_compressibility_costs_what_is_stated():
    """nu = 0.49 instead of 0.5 (same E) costs 1.8 / 3.4 / 8 % of force at chi 0.19 / 0.5 / 1.06."""
    for chi, cost in ((0.19, 0.018), (0.5, 0.034), (1.06, 0.08)):
        assert 1 - layer_contact(chi, 0.49).force / layer_contact(chi).force == pytest.approx(cost, abs=0.004)


# ---- Half-space


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


def test_mean_of_a_disc_is_that_of_its_point_loads():
    """1/r over all pairs of points of a disc, by the density of their distances."""

    def pairs(s):
        return 4 / (math.pi * 9) * (math.acos(s / 6) - s / 6 * math.sqrt(1 - (s / 6) ** 2))

    total = 0.2 * math.pi * 9 / (math.pi * 0.5) * integrate.quad(pairs, 0, 6)[0]
    assert ref.uniform_disc_mean_displacement(3.0, 0.2, 0.5) == pytest.approx(total, rel=1e-8)


# ---- What is refused, and what is documented

BAD_INPUT = [
    (lambda: ref.effective_modulus(-1, 0.3), "modulus of the first body"),
    (lambda: ref.effective_modulus(1, 0.3, 1, 0.6), "nu of the second body"),
    (lambda: ref.effective_modulus(math.inf, 0.3), "both bodies are rigid"),
    (lambda: ref.hertz_sphere(0.0, 25, 0.1), "force"),
    (lambda: ref.hertz_sphere_at(-0.1, 25, 0.1), "indentation"),
    (lambda: ref.hertz_ellipse(1.0, 25, math.nan, 0.1), "radius_y"),
    (lambda: ref.hertz_ellipse(1.0, 1e6, 1, 0.1), "ratio must be at most"),
    (lambda: ref.hertz_ellipse(1.0, 25, 25, 0), "contact modulus"),
    (lambda: ref.bonded_layer_deficit(-1.0, 0.5), "scaled wavenumber"),
    (lambda: ref.sliding_layer_deficit([0.0, -1.0]), "scaled wavenumber"),
    (lambda: ref.StackLayer(1.0, -1.0, 0.5), "layer modulus"),
    (lambda: ref.layered_halfspace_stiffness(1.0, [], None), "no layer on a rigid base"),
    (lambda: ref.LayerKernel(-10, 0.5), "layer thickness"),
    (lambda: ref.LayerKernel(10, 0.5)([0.0, math.inf]), "distance r"),
    (lambda: ref.bonded_layer_sphere(1.0, 25, 0.1, 1.0), "must be at most 10"),
    (lambda: ref.bonded_layer_sphere(1.0, 25, 10, 1.0, -0.1), "layer nu"),
    (lambda: ref.boussinesq_displacement([0.0, 0.0, 0.0], 1, 1, 0.5), "away from the origin"),
    (lambda: ref.boussinesq_displacement([0.0, 1.0, -1.0], 1, 1, 0.5), "depth z >= 0"),
    (lambda: ref.boussinesq_displacement([0.0, 1.0], 1, 1, 0.5), "shape"),
    (lambda: ref.boussinesq_displacement([0.0, 0.0, 1.0], 1, 0, 0.5), "modulus"),
    (lambda: ref.halfspace_stiffness([math.nan], 1.0), "wavenumber"),
    (lambda: ref.uniform_disc_mean_displacement(1, math.nan, 1), "pressure"),
]


@pytest.mark.parametrize(("call", "message"), BAD_INPUT)
def test_bad_input_is_refused_in_one_line(call, message):
    with pytest.raises(InputError, match=message) as caught:
        call()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", [name for name in ref.__all__ if inspect.isfunction(getattr(ref, name))])
def test_every_function_states_what_it_raises_and_its_source(name):
    text = inspect.getdoc(getattr(ref, name))
    assert "Raises `InputError`" in text
    assert "Source:" in text or "doi:" in text


def test_two_equal_spheres_share_the_approach_and_the_printed_area_is_twice_too_large():
    from papilla.references import hertz_sphere, printed_area, printed_area_per_approach, shared_approach
    from papilla.references.hertz import effective_modulus

    found = shared_approach(0.5, 25.0, 0.1, 0.3)
    assert found.second / found.first == pytest.approx(0.1 / 0.3, rel=1e-12)
    whole = hertz_sphere(0.5, 12.5, effective_modulus(0.1, 0.5, 0.3, 0.5))
    assert found.first + found.second == pytest.approx(whole.indentation, rel=1e-12)
    assert printed_area(found.first, found.second, 25.0) == pytest.approx(2 * found.area, rel=1e-12)
    per = printed_area_per_approach(0.1, 0.3, 25.0)
    assert per * found.first == pytest.approx(printed_area(found.first, found.second, 25.0), rel=1e-12)
