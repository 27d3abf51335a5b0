"""The pressure of the layer, its moments and energies, and the curves through tables, each against its closed form."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import jv

from papilla.core.errors import ContactRangeError
from papilla.fem.pressing import hertz
from papilla.fem.pressing.ellipses import (
    HALF_SPACE_ENERGY,
    SECOND,
    SIXTH,
    STRETCHES,
    layer_factor,
    mean_square,
    peak_over_mean,
)


def mean(of):
    """Mean over an ellipse, u = (x/a)^2 + (y/b)^2 being uniform from 0 to 1."""
    return quad(of, 0, 1)[0]


@pytest.mark.parametrize("q", [-1.5, -0.4, 0.0, 0.3, 1.0])
def test_moments_of_the_pressure_are_its_integrals(q):
    assert mean(lambda u: layer_factor(np.sqrt(1 - u), q)) == pytest.approx(1)
    assert mean(lambda u: u * layer_factor(np.sqrt(1 - u), q)) == pytest.approx(mean_square(q))
    for power, moments in ((1, SECOND), (3, SIXTH)):
        expected = (1 - q) * moments[0] + q * moments[1]
        assert mean(lambda u, n=power: u**n * layer_factor(np.sqrt(1 - u), q)) == pytest.approx(expected)
    t = np.linspace(0, 1, 100_001)
    assert peak_over_mean(q) == pytest.approx(layer_factor(t, q).max(), rel=1e-8)


def test_energies_of_the_terms_on_a_half_space_are_integrals_of_bessel_functions():
    """A pressure t^(2 m - 2) has the transform J_m(x) / x^m; each is scaled to its value at 0."""

    def energy(m, n):
        at_zero = [1 / (2**k * np.prod(np.arange(k, 0, -1.0)) * (np.sqrt(np.pi) if k % 1 else 1)) for k in (m, n)]
        return quad(lambda x: jv(m, x) / x**m * jv(n, x) / x**n, 1e-9, 200, limit=800)[0] / np.prod(at_zero)

    found = np.array([energy(1.5, 1.5), energy(1.5, 2.5), energy(2.5, 2.5)])
    assert found / found[0] == pytest.approx(HALF_SPACE_ENERGY, rel=1e-4)


def test_cubics_through_four_nodes_are_exact_up_to_both_ends():
    nodes = np.array([0.1, 0.15, 0.4, 0.5, 0.9, 1.3])
    cubic = np.polynomial.Polynomial([1.0, -2.0, 0.5, 3.0])
    columns = np.column_stack([cubic(nodes), 2 - cubic(nodes)])
    at = np.array([0.1, 0.12, 0.3, 0.45, 0.6, 1.2, 1.3])
    np.testing.assert_allclose(hertz._through(nodes, columns, at), np.column_stack([cubic(at), 2 - cubic(at)]))


def test_the_stretch_is_where_the_parabola_of_energies_is_least():
    s, least = np.array(STRETCHES)[:, None], np.array([-0.02, 0.0, 0.03])
    energy = 5 + 40 * (s - least) ** 2
    stretch, vouched = hertz._stretch(energy, np.ones(3))
    assert stretch == pytest.approx(least, abs=1e-12) and vouched.all()
    columns = np.stack([energy, (3 - 2 * s + 7 * s**2) * np.ones(3)], axis=-1)
    found = hertz._quadratic(columns, stretch)
    assert found[:, 0] == pytest.approx(5.0) and found[:, 1] == pytest.approx(3 - 2 * least + 7 * least**2)
    half, _ = hertz._stretch(energy, np.full(3, 0.5))
    assert half == pytest.approx(0.5 * least), "a body that is hardly layered is hardly stretched"
    upside_down, vouched = hertz._stretch(-energy, np.ones(3))
    assert (upside_down == 0).all() and not vouched.any()
    _, vouched = hertz._stretch(-energy, np.zeros(3))
    assert vouched.all(), "nothing but a layer stretches an ellipse"


def energies(radius, q, force, scene):
    """The energy of a press over its force, as the docstring of `_least_energy` states it."""
    half_space, limit, bend, change = scene
    c11, c12, c22 = (factor * half_space / (radius * np.exp(limit + one)) for factor, one in zip(
        HALF_SPACE_ENERGY, change(radius), strict=True))  # fmt: skip
    gap = bend * radius**2 * mean_square(q) / SECOND[0]
    return force / 2 * (c11 + 2 * q * (c12 - c11) + q**2 * (c11 - 2 * c12 + c22)) + gap


def test_the_ellipse_has_the_least_energy_in_radius_and_layer_term():
    def change(radius):
        return np.array([2.0 + 0.05 * radius, 1.98 + 0.05 * radius, 1.95 + 0.05 * radius])

    scene, radius, step = (0.6, np.log(0.2), 0.02, change), np.array([2.0, 3.0, 4.0]), 1e-4
    by_radius = np.full((3, 3), 0.05)
    q, force, per_force = hertz._least_energy(radius, 0.6, change(radius), by_radius, scene[1], scene[2])
    assert (np.abs(q) > 0.01).all() and (q > -1.5).all() and (q < 1.0).all() and (force > 0).all()
    size = energies(radius, q, force, scene)
    by_q = (energies(radius, q + step, force, scene) - energies(radius, q - step, force, scene)) / (2 * step)
    by_a = (energies(radius + step, q, force, scene) - energies(radius - step, q, force, scene)) / (2 * step)
    assert by_a / size == pytest.approx(0, abs=1e-6) and by_q / size == pytest.approx(0, abs=1e-4)
    gap = scene[2] * radius**2 * mean_square(q) / SECOND[0]
    assert force / 2 * per_force == pytest.approx(size - gap)


def test_without_layers_the_ellipse_is_hertz():
    """F = 4/3 E* a^3 / R: the energy under a ball's pressure is 3 F^2 / (10 E* a), that of the gap F a^2 / (5 R)."""
    radius, modulus, ball = np.array([0.5, 2.0]), 0.3, 7.0
    zero = np.zeros((3, 2))
    q, force, per_force = hertz._least_energy(radius, 3 / 5, zero, zero, np.log(modulus), 1 / (5 * ball))
    assert (q == 0).all() and force == pytest.approx(4 / 3 * modulus * radius**3 / ball)
    assert per_force == pytest.approx(3 / (5 * modulus * radius))


def test_a_body_is_layered_the_more_its_modulus_changes():
    """Half of the way at a change of a tenth in ln E*, with the fourth power of it."""
    assert hertz._layered(np.array([0.0, 0.1, -0.1, 0.2, 10.0])) == pytest.approx(
        [0, 1 / 2, 1 / 2, 16 / 17, 1], abs=1e-7
    )


@pytest.mark.parametrize("least, vouched", [(0.149, True), (0.151, False), (-0.149, True), (-0.151, False)])
def test_parabolas_are_used_up_to_a_stretch_of_015(least, vouched):
    s = np.array(STRETCHES)[:, None]
    stretch, found = hertz._stretch((s - least) ** 2, np.ones(1))
    assert found.tolist() == [vouched] and stretch == pytest.approx([least if vouched else 0.0])


@pytest.mark.parametrize("layered, vouched", [(0.0099, True), (0.0101, False)])
def test_a_parabola_without_a_minimum_counts_for_layers_alone(layered, vouched):
    s = np.array(STRETCHES)[:, None]
    stretch, found = hertz._stretch(-((s - 0.01) ** 2), np.full(1, layered))
    assert found.tolist() == [vouched] and stretch == [0.0]


def made_up(monkeypatch, columns):
    """The table of a family whose ellipses have these columns at a cube root of the force that equals their radius."""
    radius = columns.pop("radius")
    nothing = np.zeros_like(radius)
    rows = np.column_stack([columns["depth"] / (2 * radius**2), columns["a"] / radius, columns["q"], nothing, nothing])
    family = SimpleNamespace(radius=radius, aspects=np.exp(STRETCHES), bend=lambda aspect: 0 * aspect)
    monkeypatch.setattr(hertz, "ellipse_family", lambda *_: family)
    monkeypatch.setattr(hertz, "moduli", lambda *_: ())
    monkeypatch.setattr(hertz, "_branches", lambda *_: 3 * [(radius, rows)])
    return hertz._table.__wrapped__(SimpleNamespace(outer_modulus=1.0), SimpleNamespace(unit=None))


@pytest.mark.parametrize("column", ["a", "depth", "sharp", "flat", None])
def test_a_table_ends_where_its_radius_or_depth_falls_or_its_profile_pulls(monkeypatch, column):
    """At the sixtieth of eighty radii: a fall of a hundredth, or a layer term out of its bounds by a hundredth."""
    radius, later = np.linspace(0.1, 4.0, 80), np.arange(80) >= 60
    columns = {"radius": radius, "a": radius.copy(), "depth": radius**2, "q": np.zeros(80)}
    if column in ("a", "depth"):
        columns[column][later] = columns[column][59] * (1 - 0.01 * (radius[later] - radius[59]))
    elif column:
        columns["q"] = np.where(later, {"sharp": 1.01, "flat": -1.51}[column], {"sharp": 0.99, "flat": -1.49}[column])
    table = made_up(monkeypatch, columns)
    assert len(table.cube_root) == 1 + (60 if column else 80) and table.complete == (column is None)
    assert table.cube_root[-1] == pytest.approx(radius[59 if column else 79])
    assert table.indentation == pytest.approx(table.cube_root**2), "without a gap the depth is twice the energy"
    assert table.end == ("the contact to the rim of its patch" if table.complete else
                         "the contact beyond the ellipses of this skin")  # fmt: skip


def test_too_few_ellipses_are_no_table(monkeypatch):
    radius = np.linspace(0.1, 4.0, 80)
    for sound, refused in ((10, False), (9, True)):
        depth = np.where(np.arange(80) < sound, radius**2, 0.0)
        columns = {"radius": radius, "a": radius.copy(), "depth": depth, "q": np.zeros(80)}
        if refused:
            with pytest.raises(ContactRangeError, match="no pressure ellipse has the least energy"):
                made_up(monkeypatch, columns)
        else:
            assert len(made_up(monkeypatch, columns).force) == 11


@pytest.mark.parametrize("ratio, kept", [(1.49, 9), (1.51, 5)])
def test_a_branch_ends_at_a_gap_between_its_radii(ratio, kept):
    """On a homogeneous body every ellipse is one of least energy, and its force rises with the third power."""
    radius = np.append(np.linspace(1.0, 1.4, 5), ratio * np.linspace(1.4, 1.8, 4))
    felt = np.ones((3, 2, len(radius), 2))
    family = SimpleNamespace(radius=radius, aspects=np.exp(STRETCHES), half_space=np.full(3, 0.6), influence=felt)
    family.bend = lambda aspect: np.full(3, 0.1)
    zero = np.zeros((3, 3, len(radius)))
    for root, columns in hertz._branches(family, zero, zero, 0.0):
        assert len(root) == len(columns) == kept
        assert root / radius[:kept] == pytest.approx(root[0] / radius[0])
        assert columns[:, 1] == pytest.approx(radius[:kept] / root) and (columns[:, 4:] == 1).all()
