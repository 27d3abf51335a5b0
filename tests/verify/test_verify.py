"""`papilla verify`: the table's logic, what the families are made of, and the families themselves.

A family must miss where something is wrong: a fault is put into what it compares, and a case fails.
"""

import json
import math
import os
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from papilla.cli.options import grouped
from papilla.cli.verify import answer_of, case_keys
from papilla.cli.verify import verify as command
from papilla.core.errors import InputError, MissingExtraError, SolverError
from papilla.fem import FingerModel, press
from papilla.fem.discrete.assembly import lame
from papilla.mesh import build
from papilla.mesh.cells import mean_ratio, volumes
from papilla.mesh.layered import OUTER_LAYER
from papilla.model.finger import Dome, Finger, Layer, Slab
from papilla.model.specimen import Block, HalfSpace
from papilla.references import StackLayer, bonded_layer_sphere, hertz_sphere
from papilla.verify import CASE_FAMILIES, Case, bodies, contact, finger, meshes, verify
from papilla.verify.case import Verdict
from papilla.verify.elements import Discretisation, Manufactured
from papilla.verify.jobs import fitting_processes, run_jobs
from papilla.verify.self_test import self_test
from papilla.verify.structured import cube, cylinder, growing, shell

KEYS = ["name", "measure", "error", "bound", "passed", "seconds"]
TABLE = HalfSpace(1e6)


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


def missed(cases) -> list[str]:
    return [case.what for case in cases if not case.passed]


# ---- The table


@pytest.mark.parametrize(
    "value, bound, verdict",
    [
        (0.1, 0.1, Verdict.WITHIN), (0.10001, 0.1, Verdict.OUTSIDE), (math.nan, 0.1, Verdict.OUTSIDE),
        (math.inf, 0.1, Verdict.OUTSIDE), (None, 0.1, Verdict.UNTESTED), (1.0, (1.0, 2.0), Verdict.WITHIN),
        (0.99, (1.0, 2.0), Verdict.OUTSIDE), (2.01, (1.0, 2.0), Verdict.OUTSIDE),
    ],
)  # fmt: skip
def test_a_case_passes_within_its_bound_alone(value, bound, verdict):
    case = Case("a", "b", value, bound)
    assert case.verdict == verdict and case.passed is (verdict == Verdict.WITHIN)


def test_cases_carry_family_and_seconds_and_progress_counts_families():
    seen = []
    cases = verify(families={"one": good, "two": bad}, progress=seen.append)
    assert [case.what for case in cases] == ["one: first", "one: second", "two: first", "two: second", "two: third"]
    assert missed(cases) == ["two: third"] and all(case.seconds >= 0 for case in cases)
    assert seen == ["one"] * 3 + ["two"] * 4
    assert [(step.done, step.total) for step in seen] == [(0, 2)] * 3 + [(1, 2)] * 4
    assert {case.what.split(":")[0] for case in verify(["two"], families={"one": bad, "two": good})} == {"two"}


def test_a_family_that_stops_failed_and_one_whose_library_is_absent_is_skipped():
    lines = []
    cases = verify(families={"one": broken, "none": absent, "two": good}, skipped=lines.append)
    assert [case.passed for case in cases] == [True, False, True, True]
    assert cases[1].what == "one: stopped" and "the solver gave up" in cases[1].cause
    assert lines == ["none: skipped, another library is not installed; pip install it"]


@pytest.mark.slow
def test_two_processes_give_the_cases_of_one_in_the_same_order():
    families = {"one": bad, "two": good}
    here, there = (verify(families=families, processes=count) for count in (1, 2))
    assert [replace(case, seconds=0) for case in here] == [replace(case, seconds=0) for case in there]


def test_an_unknown_family_is_refused():
    with pytest.raises(InputError, match="no family of cases is called 'hurtz': expected patch, manufactured, hertz"):
        verify(["hurtz"])


# ---- The command


@pytest.mark.parametrize("family, code", [(good, 0), (bad, 1), (broken, 1), (absent, 0)])
def test_exit_code_and_json_follow_the_cases(family, code, capsys):
    skipped = []
    answer = answer_of(verify(families={"one": family}, skipped=skipped.append), skipped)
    assert answer.code == code and list(answer.facts) == ["passed", "cases", "skipped"]
    assert answer.facts["passed"] is (code == 0) and len(answer.facts["skipped"]) == (family is absent)
    assert all(list(case) == KEYS for case in answer.facts["cases"])
    answer.show()
    table = capsys.readouterr().out
    assert table.count("MISSED") == code and f"{code} outside their bounds" in table.splitlines()[-1]


def test_the_command_runs_the_named_family_and_prints_one_object():
    app = typer.Typer()
    app.command()(grouped(command))
    done = CliRunner().invoke(app, ["--only", "engines", "--json"])
    assert done.exit_code == 0 and done.stdout.count("\n") == 1
    told = json.loads(done.stdout)
    assert list(told) == ["seconds", "passed", "cases", "skipped"] and told["passed"] and len(told["cases"]) > 4
    assert all(case["name"].startswith("engines: ") and case["error"] <= case["bound"] for case in told["cases"])
    assert case_keys(Case("a", "b", 1.0, 2.0, 3.0)) == dict(zip(KEYS, ("a", "b", 1.0, 2.0, True, 3.0), strict=True))


# ---- Flat bodies: what is computed, against closed forms; and what a fault does to a case


@pytest.fixture(scope="module")
def layer():
    """A layer of 1 mm on a table, with a patch of 1 mm and gauges half a millimetre down."""
    mesh = cylinder(np.linspace(0, 2, 9), np.linspace(0, 1, 5), 2, 4)
    return bodies.FlatModel(mesh, Layer(1.0, 0.4), Layer(1.0, 0.4), 1.0, interface=0.5, sites=(0.0, 0.5)).reduce()


@pytest.mark.slow
@pytest.mark.parametrize("modulus, fault", [(1.0, False), (1.02, True)])
def test_a_layer_of_another_modulus_than_stated_misses_its_exact_force(modulus, fault):
    thickness, indentation = bodies.at_unit_contact(1.0, 1.0)
    exact = bonded_layer_sphere(indentation, bodies.BALL_RADIUS, thickness, 1.0, 0.5)
    pressed = press(
        bodies.bonded_layer(Layer(modulus, 0.5), thickness).reduce(), bodies.BALL_SPECIMEN, indentation=indentation,
        fidelity="contact",
    )  # fmt: skip
    cases = list(bodies.compared("ball", "against the exact solution", pressed, exact, force=0.01, area=0.02))
    assert missed(cases) == (["ball, force"] if fault else [])


def test_a_coarse_mesh_misses_the_bounds_of_a_fine_one():
    """Four elements over the contact: far from Hertz's bonded layer."""
    thickness, indentation = bodies.at_unit_contact(1.0, 1.0)
    exact = bonded_layer_sphere(indentation, bodies.BALL_RADIUS, thickness, 1.0, 0.5)
    mesh = cylinder(np.linspace(0, 8, 9), np.linspace(0, thickness, 3), 1, 4)
    coarse = bodies.FlatModel(mesh, Layer(1.0, 0.5), Layer(1.0, 0.5), 3.0, interface=thickness / 2).reduce()
    pressed = press(coarse, bodies.BALL_SPECIMEN, indentation=indentation, fidelity="contact")
    cases = list(bodies.compared("ball", "against", pressed, exact, force=0.01, radius=0.01, area=0.02))
    assert [case.what for case in cases] == ["ball, force", "ball, radius", "ball, area"] and missed(cases)
    area, radius = cases[2].value, cases[1].value
    assert {round(abs((1 + sign * radius) ** 2 - 1), 9) for sign in (1, -1)} >= {round(area, 9)}, (
        "area is radius squared"
    )


def test_a_press_obeys_its_inequalities_and_one_that_is_pulled_does_not(layer):
    bowl = bodies.with_gap(layer, 100.0, 100.0)
    pressed = finger.pressed_by(bowl, 0.2, TABLE)
    assert max(finger.contact_residuals(bowl, TABLE, pressed)) < 1e-9
    pulled = replace(pressed, pressure=pressed.pressure - 0.1 * pressed.pressure.max())
    assert finger.contact_residuals(bowl, TABLE, pulled)[0] == pytest.approx(1 / 9)
    deeper = finger.contact_residuals(bowl, TABLE, replace(pressed, indentation=1.1 * pressed.indentation))
    assert deeper == pytest.approx((0, 1 / 11, 1 / 11))


def integral(reduced, values):
    """The integral over the whole patch of a function of points (k, 2)."""
    points, weights, _ = bodies.quadrature(reduced.patch)
    return reduced.multiplicity * float(weights @ values(points))


def test_integrals_over_the_patch_are_moments_of_its_disc(layer):
    """Force, centre and second moment of a unit pressure; the gap of a bowl; the moment of a shear q = x."""
    places, forces = bodies.surface_pressure(layer, np.ones(len(layer.patch.xy)))
    assert forces.sum() == pytest.approx(integral(layer, lambda x: np.ones(len(x))), rel=1e-12)
    assert forces @ places == pytest.approx([0, 0], abs=1e-12)
    assert forces @ places[:, 0] ** 2 == pytest.approx(integral(layer, lambda x: x[:, 0] ** 2), rel=0.02)
    more = layer.multiplicity * (bodies.with_gap(layer, 100.0, 40.0).patch.gap - layer.patch.gap).sum()
    assert more == pytest.approx(integral(layer, lambda x: x[:, 0] ** 2 / 200 + x[:, 1] ** 2 / 80), rel=1e-12)
    shear = np.vstack([np.zeros(len(layer.patch.xy)), layer.patch.xy.T])
    assert contact.shear_moment(layer, shear) == pytest.approx(integral(layer, lambda x: (x**2).sum(axis=1)), rel=0.02)


@pytest.mark.parametrize("chi", [0.19, 1.05])
@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_a_stack_of_one_bonded_layer_is_that_layer(chi, nu):
    exact = bonded_layer_sphere(0.01, 100.0, 1 / chi, 2.0, nu)
    found = bodies.stack_sphere(exact.contact_radius, 100.0, [StackLayer(1 / chi, 2.0, nu)], None)
    for key in ("force", "indentation", "peak_pressure"):
        assert getattr(found, key) == pytest.approx(getattr(exact, key), rel=1e-7)


def test_a_stack_of_one_material_is_a_half_space():
    exact = hertz_sphere(1.0, 100.0, 2.0 / (1 - 0.3**2))
    layers = [StackLayer(0.4, 2.0, 0.3), StackLayer(1.3, 2.0, 0.3)]
    found = bodies.stack_sphere(exact.a, 100.0, layers, HalfSpace(2.0, 0.3))
    assert found.force == pytest.approx(1.0, rel=1e-9)
    assert found.indentation == pytest.approx(exact.indentation, rel=1e-9)
    assert found.peak_pressure == pytest.approx(exact.peak_pressure, rel=1e-9)


# ---- Exact fields and meshes of the study


@pytest.mark.parametrize("nu", [0.3, 0.4999, 0.5])
def test_the_manufactured_solution_is_in_balance(nu):
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


def test_the_patch_test_fails_where_one_node_is_held_elsewhere():
    """Stretch by 1 %: exact inside the cube, and not where a node of the boundary has a tenth more."""
    discrete = Discretisation(cube(3, jitter=0.15), "Taylor-Hood")
    exact = 0.01 * discrete.points.T * [1.0, -0.5, -0.5]
    held = ((discrete.points == 0) | (discrete.points == 1)).any(axis=0)
    layers, none = dict.fromkeys((0, 1), Layer(1.0, 0.49)), np.zeros_like(exact)
    assert np.abs(discrete.solve(layers, none, held, exact) - exact)[~held].max() < 1e-12
    wrong = exact.copy()
    wrong[np.flatnonzero(held & (discrete.points[2] == 1))[7]] *= 1.1
    assert np.abs(discrete.solve(layers, none, held, wrong) - exact)[~held].max() > 1e-6


def area(points, triangles):
    corners = points[triangles]
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2


def test_a_cylinder_has_its_rings_sheets_layers_and_sides():
    """Inner rings have as many chords as their number; volume and sides are those of a polygon of two chords."""
    radii, depths = np.array([0.0, 0.5, 1.2, 2.0]), np.array([0.0, 0.3, 1.0, 1.5])
    whole = cylinder(radii, depths, 2, 2)
    cell, flat = whole.cell(), 4 * np.sin(np.pi / 4)
    sheets, counts = np.unique(-cell.points[:, 2], return_counts=True)
    assert sheets == pytest.approx(depths) and set(counts) == {1 + 2 + 3 + 3}
    away, rings = np.unique(np.hypot(*cell.points[:, :2].T).round(9), return_counts=True)
    assert away == pytest.approx(radii) and rings.tolist() == [4, 8, 12, 12]
    tin = volumes(*arrays(cell))
    assert tin.min() > 0 and tin.sum() == pytest.approx(1.5 * flat) and volumes(*arrays(whole)).sum() == 4 * tin.sum()
    middle = cell.points[cell.tets].mean(axis=1)[:, 2]
    assert ((middle > -1) == (cell.layer == OUTER_LAYER)).all() and set(cell.layer) == {0, 1}
    for name, expected in (("skin", flat), ("interface", flat), ("base", flat + 2 * 4 * np.sin(np.pi / 8) * 1.5)):
        assert area(cell.points, cell.boundaries[name]) == pytest.approx(expected), name
    assert (cell.points[cell.boundaries["skin"]][:, :, 2] == 0).all()
    assert cell.points[cell.boundaries["interface"]][:, :, 2] == pytest.approx(-1)


def test_a_shell_and_a_cube_fill_their_bodies():
    ball = shell(np.linspace(1, 2, 5), 12)
    assert volumes(*arrays(ball)).min() > 0 and volumes(*arrays(ball)).sum() == pytest.approx(np.pi / 6 * 7, rel=0.02)
    assert len(ball.points) == 5 * 13 * 14 / 2 and (ball.layer == OUTER_LAYER).all()
    for name, radius in (("skin", 2.0), ("base", 1.0)):
        triangles = ball.boundaries[name]
        assert len(triangles) == 144 and area(ball.points, triangles) == pytest.approx(np.pi / 2 * radius**2, rel=0.02)
        assert np.linalg.norm(ball.points[triangles], axis=2) == pytest.approx(radius)
    plain, moved, halves = cube(4), cube(4, jitter=0.15), cube(4, jitter=0.15, split=True)
    assert np.unique(plain.points) == pytest.approx([0, 0.25, 0.5, 0.75, 1])
    inside = ((plain.points > 0) & (plain.points < 1)).all(axis=1)
    between = inside & (plain.points[:, 2] != 0.5)
    for mesh, free in ((moved, inside), (halves, between)):
        away = np.abs(mesh.points - plain.points)
        assert (away[~free] == 0).all() and 0.03 < away[free].max() <= 0.15 / 4 and (away[free] > 0).all()
        assert volumes(*arrays(mesh)).min() > 0 and volumes(*arrays(mesh)).sum() == pytest.approx(1)
        assert [area(mesh.points, mesh.boundaries[name]) for name in ("skin", "base")] == pytest.approx([1, 1])
        assert (mesh.points[mesh.boundaries["skin"]][:, :, 2] == 1).all()
    middle = halves.points[halves.tets].mean(axis=1)[:, 2]
    assert ((middle > 0.5) == (halves.layer == OUTER_LAYER)).all() and (moved.layer == OUTER_LAYER).all()
    places = growing(0.1, 1.5, 1.0)
    steps = np.diff(places)
    assert places[[0, -1]] == pytest.approx([0, 1]) and steps[1:] / steps[:-1] == pytest.approx(1.5)
    assert 0.07 < steps[0] <= 0.1


def test_errors_and_loads_of_known_fields():
    """u = (x, 0, 0) on the unit cube: a tenth more, a shift by a tenth, and loads of one newton in all."""
    mesh = cube(2)
    discrete = Discretisation(mesh, "Taylor-Hood")
    exact = np.outer(discrete.points[0], [1.0, 0.0, 0.0])

    def field(x):
        return np.stack([x[0], 0 * x[0], 0 * x[0]])

    def gradient(x):
        return np.eye(3)[:1].T[:, :, None, None] * np.eye(3)[0][None, :, None, None] * np.ones_like(x[0])

    assert discrete.errors(1.1 * exact, field, gradient) == pytest.approx((0.1, 0.1))
    assert discrete.errors(exact + [0, 0.1, 0], field, gradient) == pytest.approx((0.1 * 3**0.5, 0), abs=1e-9)

    def push(x):
        return np.stack([0 * x[0], 2 + 0 * x[0], x[0]])

    assert discrete.body_load(push).sum(axis=0) == pytest.approx([0, 2, 0.5])
    facets = discrete.space.facets(mesh.boundaries["skin"])
    load = discrete.surface_load(push, facets)
    assert load.sum(axis=0) == pytest.approx([0, 2, 0.5]) and np.abs(load[discrete.points[2] < 1]).max() < 1e-12


def test_a_solve_of_a_flat_body_has_a_small_residual_and_its_name():
    mesh = cylinder(np.linspace(0, 2, 5), np.linspace(0, 1, 3), 1, 3)
    model = bodies.FlatModel(mesh, Layer(1.0, 0.5), Layer(0.1, 0.4), 1.0, interface=0.5)
    case = finger.residual("flat", model)
    assert case.what == "flat, residual" and 0 < case.value < case.bound == 1e-10
    points = np.array([[3.0, 4.0, 5.0], [1.0, -1.0, -0.5]])
    plane = model.surfaces["interface"]
    assert plane.level(points) == pytest.approx([5.5, 0]) and plane.height(points[:, :2]) == pytest.approx([-0.5, -0.5])
    assert plane.project(points) == pytest.approx(points * [1, 1, 0] - [0, 0, 0.5])
    assert (
        (plane.normal(points) == [0, 0, 1]).all() and model.surfaces["bone"].z == -1 and model.surfaces["skin"].z == 0
    )


def test_rows_of_presses_are_those_of_each_modulus_and_force():
    made, mesh = Finger.default(), build(Finger.default(), size_mm=2.8)
    rows, reduced = meshes.pressed(made, mesh, (0.1, 1.0), (10.0, 30.0, 1e5)), FingerModel(made, mesh).reduce()
    assert rows.shape == (6, 8) and np.isnan(rows[[2, 5]]).all()
    for row, (modulus, force) in zip(rows[[0, 1, 3, 4]], ((0.1, 10), (0.1, 30), (1.0, 10), (1.0, 30)), strict=True):
        one = press(reduced, Block(modulus, 10.0), force=force * 9.80665e-3, fidelity="contact", friction=0.0)
        assert row == pytest.approx([one.sd, *one.reading, one.indentation, one.contact_area])


def test_jobs_give_their_results_in_order_and_say_how_many_are_done():
    def add(one, two, progress):
        progress(f"{one} and {two}")
        return one + two

    seen = []
    jobs = {"first": (1, 2), "second": (3, 4)}
    assert list(run_jobs(add, jobs, progress=seen.append)) == [("first", 3), ("second", 7)]
    counted = [(str(step), step.done, step.total) for step in seen if hasattr(step, "done")]
    assert counted[0] == ("first", 0, 2) and ("second", 1, 2) in counted
    assert 1 <= fitting_processes() <= 2


def test_crushed_cells_are_flat_but_not_inverted():
    mesh = cube(6)
    before, after = (volumes(*arrays(one)) for one in (mesh, meshes.crushed(mesh, 5)))
    assert (after > 0).all() and after.sum() == pytest.approx(1)
    assert 5 <= (after < 1e-2 * before).sum() <= 30
    ruined = meshes.crushed(mesh, 5)
    assert mean_ratio(ruined.points, ruined.tets).min() < 0.05


def arrays(mesh):
    return mesh.points, mesh.tets


def test_stored_presses_are_those_of_their_fingers():
    """S_d is the deviation of the five gauges; gauges in mirrored places read the same."""
    made, default = meshes.fingers(), Finger.default().gauges
    assert [type(one.shape) for one in made.values()] == [Dome, Dome, Slab]
    for name, one in made.items():
        rows = np.array(meshes.MOVED_SETTINGS.fingers[name].stored)
        assert rows[:, 1:6].std(axis=1) == pytest.approx(rows[:, 0], rel=2e-3)
        assert (np.diff(rows[:, [0, 6, 7]], axis=0) > 0).all(), "a firmer press is deeper, wider and read more strongly"
        settings = meshes.MOVED_SETTINGS.fingers[name]
        axes = [one.shape.outer, one.shape.interface, one.shape.bone]
        assert [list(axis) for axis in axes] == [list(axis) for axis in settings.axes_mm] and one.ridges is None
        assert getattr(one.shape, "depth", 14.0) == 14.0
        if one.gauges == default:
            assert rows[:, 1:6] == pytest.approx(rows[:, 5:0:-1])


def test_errors_are_relative_to_what_is_exact():
    assert bodies.off(1.1, 1.0) == pytest.approx(0.1) and bodies.off(1.0, 1.1) == pytest.approx(1 / 11)
    assert bodies.apart(np.array([1.0, 5.0]), np.array([1.5, 4.0])) == pytest.approx(1 / 4)


def test_flat_bodies_have_their_layers_gauges_and_places():
    """A coat of 1 mm on 3 mm, and a layer whose lower half is of another material."""
    coat, below = Layer(10.0, 0.4), Layer(1.0, 0.4)
    made = bodies.coated(coat, below, 1.0, 3.0, 6.0)
    heights = np.unique(made.mesh.points[:, 2])
    assert heights[[0, -1]] == pytest.approx([-4, 0]) and np.abs(heights + 1).min() < 1e-12
    middle = made.mesh.points[made.mesh.tets].mean(axis=1)[:, 2]
    assert ((middle > -1) == (made.mesh.layer == OUTER_LAYER)).all()
    assert [made.finger.outer, made.finger.inner] == [coat, below]
    for gauge, x in zip(bodies.bonded_layer(coat, 0.8, below, (0.0, 0.5)).finger.gauges, (0.0, 0.5), strict=True):
        assert (gauge.x_mm, gauge.length_mm, gauge.backing_mm) == (x, 1.0, (2.0, 1.0))


def test_vertices_of_a_shell_are_spread_evenly_along_its_sides():
    made = shell(np.array([1.0, 2.0]), 6)
    side = made.points[(made.points[:, 2] == 0) & (np.linalg.norm(made.points, axis=1) < 1.5)]
    assert np.sort(np.degrees(np.arctan2(side[:, 1], side[:, 0]))) == pytest.approx(np.arange(0, 91, 15))


# ---- The families

CASE_WORDS = {
    "sliding": ("refinement in", "element size", "full slip", "reversed", "a period further", "two solvers", "energy"),
    "invariance": ("strain energy", "work of a press", "force balance", "mirrored design, readings"),
    "incompressible": ("nu 0.49, force", "nu 0.49, residual"),
    "contrast": ("0.001, force", "0.001, area", "0.001, residual"),
    "patch": ("constant strain", "constant stress"),
}
"""What the first cases of a family are called."""


def test_the_self_test_of_an_installation_passes(monkeypatch, tmp_path):
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path))
    cases = self_test()
    assert len(cases) > 4 and missed(cases) == [] and os.environ["PAPILLA_CACHE"] == str(tmp_path)
    balance, near = cases[-2:]
    assert (balance.what, near.what) == ("press, force", "press, S_d") and balance.value < 1e-9 < 1e-4 < near.value
    assert min(case.seconds for case in cases) > 0 and sum(case.seconds for case in cases) < 100
    assert not [path for path in tmp_path.iterdir() if "reduced" in path.name], "the finger is reduced anew each time"


@pytest.mark.parametrize(
    "name, count, first, measure",
    [
        ("patch", 11, "constant strain, Taylor-Hood, nu 0.3", "displacement inside"),
        ("invariance", 21, "reciprocity of gauge rows", "adjoint rows"),
        ("sliding", 8, "sinusoidal indenter", "share in contact"),
        ("layer", 3, "sphere on incompressible layer, chi 0.19, force", "force at given"),
        ("incompressible", 2, "bonded layer, nu 0.49, force", "force at given"),
        ("contrast", 3, "modulus contrast 0.001, force", "force at given"),
        pytest.param("moved", 4, "dome of revolution, 10 gf, S_d", "S_d on a moved mesh", marks=pytest.mark.slow),
        pytest.param("revolution", 5, "0.05 MPa, 5 gf, S_d", "S_d against axisymmetric rings", marks=pytest.mark.slow),
        pytest.param("slivers", 4, "66 slivers", "S_d at 30 gf", marks=pytest.mark.slow),
        ("identification", 2, "least chi-square, 15 presses", "above what Minuit's"),
    ],
)  # fmt: skip
def test_the_first_cases_of_a_family_have_errors_of_a_discretisation_within_their_bounds(name, count, first, measure):
    if name == "identification":
        pytest.importorskip("iminuit")
    cases = list(islice(CASE_FAMILIES[name](), count))
    assert len(cases) == len({case.what for case in cases}) == count and missed(cases) == []
    assert cases[0].what.startswith(first) and cases[0].cause.startswith(measure)
    assert all(case.value >= 0 and "against" not in case.what for case in cases)
    told = " ".join(case.what for case in cases)
    assert all(word in told for word in CASE_WORDS.get(name, ()))
    assert name == "identification" or max(case.value for case in cases) > 0


def test_a_manufactured_solution_converges_at_its_order():
    cases = list(islice(CASE_FAMILIES["manufactured"](), 8))
    assert missed(cases) == [] and len({case.what for case in cases}) == 8


@pytest.mark.slow
@pytest.mark.parametrize(
    # A layer of 0.3 mm cannot be had by moving a mesh, and the mesher draws it
    "name",
    [pytest.param(name, marks=pytest.mark.mesher) if name == "thin-layer" else name for name in CASE_FAMILIES],
)
def test_a_family_is_within_its_bounds(name):
    assert missed(verify([name])) == []
