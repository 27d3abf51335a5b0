"""`papilla verify`: the table's logic, the references written for it, and the families themselves."""

import json

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from papilla.cli.options import grouped
from papilla.cli.verify import verify as command
from papilla.core.errors import InputError, MissingExtraError, SolverError
from papilla.fem.discrete.assembly import lame
from papilla.mesh.cells import volumes
from papilla.model.finger import Layer
from papilla.model.specimen import HalfSpace
from papilla.references import StackLayer, bonded_layer_sphere, hertz_sphere
from papilla.verify import FAMILIES, Case, verify
from papilla.verify.bodies import stack_sphere
from papilla.verify.elements import Manufactured
from papilla.verify.meshes import crushed
from papilla.verify.structured import cube, cylinder, growing, shell

KEYS = ["name", "measure", "error", "bound", "passed", "seconds"]


@pytest.fixture
def call():
    """Call the command by itself: `call("--only", "patch")`."""
    app = typer.Typer()
    app.command()(grouped(command))
    return lambda *arguments: CliRunner().invoke(app, list(arguments))


def good():
    """A family whose cases hold."""
    yield Case("first", "error of nothing (exactly 0)", 0.0, 1e-10)
    yield Case("second", "at its bound", 0.1, 0.1)


def bad():
    """A family with a case that does not hold."""
    yield from good()
    yield Case("third", "over its bound", 0.2, 0.1)


def broken():
    """A family that stops half way."""
    yield Case("first", "error of nothing (exactly 0)", 0.0, 1e-10)
    raise SolverError("the solver\ngave up")


def absent():
    """A family that needs what is not installed."""
    raise MissingExtraError("another library is not installed; pip install it")
    yield


# ---- The table


@pytest.mark.parametrize("error, passed", [(0.1, True), (0.10001, False), (float("nan"), False), (float("inf"), False)])
def test_a_case_passes_within_its_bound_alone(error, passed):
    assert Case("a", "b", error, 0.1, 0.0).passed is passed


def test_cases_carry_family_measure_and_seconds():
    seen = []
    cases = verify(families={"one": good, "two": bad}, progress=lambda *step: seen.append(step))
    assert [case.what for case in cases] == ["one: first", "one: second", "two: first", "two: second", "two: third"]
    assert [case.passed for case in cases] == [True] * 4 + [False]
    assert all(case.seconds >= 0 for case in cases)
    lines = ["one", "one: first", "one: second", "two", "two: first", "two: second", "two: third"]
    assert seen == [(line, done, 2) for line, done in zip(lines, [0] * 3 + [1] * 4, strict=True)]


def test_only_the_named_families_run():
    assert {case.what.split(":")[0] for case in verify(["two"], families={"one": bad, "two": good})} == {"two"}


def test_a_family_that_stops_is_a_case_that_failed():
    cases = verify(families={"one": broken, "two": good})
    assert [case.passed for case in cases] == [True, False, True, True]
    assert cases[1].what == "one: stopped" and "the solver gave up" in cases[1].cause


def test_a_family_that_needs_what_is_absent_is_skipped_in_a_line():
    lines = []
    cases = verify(families={"one": absent, "two": good}, skipped=lines.append)
    assert [case.what.split(":")[0] for case in cases] == ["two", "two"]
    assert lines == ["one: skipped, another library is not installed; pip install it"]


def test_an_unknown_family_is_refused():
    with pytest.raises(InputError, match="no family of cases is called 'hurtz': expected patch, manufactured, hertz"):
        verify(["hurtz"])


# ---- The command


@pytest.mark.parametrize("family, code", [(good, 0), (bad, 1), (broken, 1)])
def test_json_and_exit_code(call, monkeypatch, family, code):
    monkeypatch.setitem(FAMILIES, "patch", family)
    answer = call("--only", "patch", "--json")
    assert answer.exit_code == code
    assert answer.stdout.count("\n") == 1, "one object and nothing else"
    found = json.loads(answer.stdout)
    assert list(found) == ["seconds", "passed", "cases", "skipped"]
    assert found["skipped"] == []
    assert found["passed"] is (code == 0)
    assert all(list(case) == KEYS for case in found["cases"])
    assert all(case["passed"] for case in found["cases"]) is found["passed"]


def test_the_command_says_what_is_skipped_and_passes(call, monkeypatch):
    monkeypatch.setitem(FAMILIES, "patch", absent)
    answer = call("--only", "patch", "--json")
    assert answer.exit_code == 0
    assert json.loads(answer.stdout)["skipped"] == ["patch: skipped, another library is not installed; pip install it"]
    assert "patch: skipped" in answer.stderr


def test_table_names_what_missed(call, monkeypatch):
    monkeypatch.setitem(FAMILIES, "patch", bad)
    answer = call("--only", "patch")
    assert answer.exit_code == 1
    assert "patch: third" in answer.stdout and "over its bound" in answer.stdout
    assert answer.stdout.count("MISSED") == 1
    assert answer.stdout.splitlines()[-1].startswith("3 cases, 1 outside their bounds")


# ---- References and meshes written for the study


@pytest.mark.parametrize("chi", [0.19, 1.05])
@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_stack_of_one_bonded_layer(chi, nu):
    exact = bonded_layer_sphere(0.01, 100.0, 1 / chi, 2.0, nu)
    found = stack_sphere(exact.contact_radius, 100.0, [StackLayer(1 / chi, 2.0, nu)], None)
    for key in ("force", "indentation", "peak_pressure"):
        assert getattr(found, key) == pytest.approx(getattr(exact, key), rel=1e-7)


def test_stack_of_one_material_is_a_half_space():
    exact = hertz_sphere(1.0, 100.0, 2.0 / (1 - 0.3**2))
    layers = [StackLayer(0.4, 2.0, 0.3), StackLayer(1.3, 2.0, 0.3)]
    found = stack_sphere(exact.a, 100.0, layers, HalfSpace(2.0, 0.3))
    assert found.force == pytest.approx(1.0, rel=1e-9)
    assert found.indentation == pytest.approx(exact.indentation, rel=1e-9)
    assert found.peak_pressure == pytest.approx(exact.peak_pressure, rel=1e-9)


@pytest.mark.parametrize("nu", [0.3, 0.4999, 0.5])
def test_manufactured_solution_is_in_balance(nu):
    """Gradient, divergence and body force against finite differences."""
    exact = Manufactured(Layer(0.1, nu))
    mu, compressibility = lame(exact.layer)
    x, h = np.random.default_rng(2).uniform(0, 1, (3, 20)), 1e-5
    steps = h * np.eye(3)[:, :, None]
    slope = np.stack([(exact.displacement(x + s) - exact.displacement(x - s)) / (2 * h) for s in steps], axis=1)
    np.testing.assert_allclose(exact.gradient(x), slope, atol=1e-8)
    pressure = mu * np.cos(x[0]) * np.sin(x[1])
    np.testing.assert_allclose(np.einsum("iik->k", exact.gradient(x)), -compressibility * pressure, atol=1e-12)
    force = np.zeros_like(x)
    for axis, step in enumerate(steps):
        normal = np.eye(3)[axis][:, None] * np.ones_like(x)
        force -= (exact.traction(x + step, normal) - exact.traction(x - step, normal)) / (2 * h)
    np.testing.assert_allclose(exact.body_force(x), force, atol=1e-8)


def test_structured_meshes_fill_their_bodies():
    assert volumes(*_arrays(cube(4, jitter=0.15, split=True))).sum() == pytest.approx(1)
    ball = volumes(*_arrays(shell(np.linspace(1, 2, 5), 12)))
    assert ball.min() > 0 and ball.sum() == pytest.approx(np.pi / 6 * 7, rel=0.02)
    whole = cylinder(np.linspace(0, 2, 6), growing(0.1, 1.5, 1.0), 2, 6)
    tin = volumes(*_arrays(whole))
    assert tin.min() > 0 and tin.sum() == pytest.approx(np.pi * 4, rel=0.02)
    assert (whole.points[whole.boundaries["skin"]][:, :, 2] == 0).all()


def test_crushed_cells_are_flat_but_not_inverted():
    mesh = cube(6)
    before, after = (volumes(*_arrays(one)) for one in (mesh, crushed(mesh, 5)))
    assert (after > 0).all()
    assert (after < 1e-2 * before).sum() >= 5


def _arrays(mesh):
    return mesh.points, mesh.tets


# ---- The families


@pytest.mark.slow
@pytest.mark.parametrize(
    # A layer of 0.3 mm cannot be had by moving a mesh, and the mesher draws it
    "name",
    [pytest.param(name, marks=pytest.mark.mesher) if name == "thin-layer" else name for name in FAMILIES],
)
def test_a_family_is_within_its_bounds(name):
    assert [case for case in verify([name]) if not case.passed] == []


@pytest.mark.parametrize("name", FAMILIES)
def test_every_family_is_documented(name):
    assert FAMILIES[name].__doc__
