"""`papilla bench`: errors and front on figures that are known, the figure of its rows, and the short form."""

import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.text import Text

from papilla.cli.speed import FULL_PLAN, SHORT_PLAN, BenchRow, SpeedBench
from papilla.cli.speed.measure import FINITE_FORCES_GF, FORCES_GF, SWEEP_SPECIMEN, answers, drawn, measure
from papilla.cli.speed.price_figure import price_figure
from papilla.cli.speed.runner import pareto_front, with_front
from papilla.fem import prepare, press
from papilla.mesh import DEFAULT_SIZE_MM
from papilla.model.finger import DEFAULT_FINGER, Finger
from papilla.view.style import ACCENT_COLORS

KEYS = {
    *("fidelity", "element", "size_mm", "dofs", "seconds_setup", "seconds_per_scene", "error_sd", "error_indentation"),
    *("error_area", "peak_memory_MiB", "factor_nonzeros", "patch_nodes", "seconds_thousand", "forces_gf"),
    *("reference_size_mm", "reference", "small_strain_sd", "small_strain_indentation", "pareto", "status"),
}


def measured(size, element="Taylor-Hood", fidelity="contact", *, off=0.0, forces=(10, 30, 100)):
    """A measurement whose answers are `off` (a fraction, or one a force) away from 1000 microstrain, 0.5 mm, 20 mm2."""
    values = np.array([1000.0, 0.5, 20.0])[:, None] * (1 + np.broadcast_to(off, len(forces)))
    stages = {} if fidelity == "finite" else {"basis": 0.1, "assembly": 0.2, "factorisation": 0.001, "reduction": 0.4}
    return BenchRow(fidelity, element, size, forces, 1000, 40, 10**5, stages, 0.002, 3.0, 500.0, values)


def test_errors_are_the_worst_of_the_common_forces():
    reference = measured(0.35, forces=(10, 15, 30, 100))
    row = measured(0.7, off=[0.01, -0.03, 0.02]).against(reference)
    assert (row.error_sd, row.error_indentation, row.error_area) == pytest.approx((0.03, 0.03, 0.03))
    assert row.seconds_setup == pytest.approx(0.701) and row.seconds_thousand == pytest.approx(3.701)
    assert row.reference_size_mm == 0.35 and not row.reference and row.small_strain_sd is None
    own = reference.against(reference)
    assert own.reference and own.error_sd == own.error_indentation == own.error_area == 0
    found = json.loads(json.dumps(row.to_json(), allow_nan=False))
    assert set(found) == KEYS and found["dofs"] == 1000 and found["forces_gf"] == [10, 30, 100]


def test_fidelity_finite_is_compared_with_itself_and_small_strain_with_it():
    finest = measured(0.7, fidelity="finite", off=0.05)
    row = measured(1.4, fidelity="finite", off=0.071).against(finest, measured(1.4, off=0.0))
    assert row.element == "Taylor-Hood" and row.seconds_setup == 0
    assert row.error_sd == pytest.approx(0.02), "of the mesh alone, not the difference of the models"
    assert row.small_strain_sd == pytest.approx(1 - 1 / 1.071)


def test_front_keeps_what_nothing_beats():
    seconds, error = np.array([1.0, 2.0, 2.0, 3.0, 4.0, 4.0]), np.array([5.0, 3.0, 4.0, 3.0, 1.0, 1.0])
    assert pareto_front(seconds, error).tolist() == [True, True, False, False, True, True]
    assert pareto_front(np.array([1.0]), np.array([9.0])).tolist() == [True]
    rows = [measured(2.0, off=0.2), measured(1.4, off=0.1), measured(0.7), measured(2.0, fidelity="finite", off=0.01)]
    marked = [row.pareto for row in with_front([row.against(rows[2]) for row in rows])]
    assert marked == [False, True, False, False], "neither the reference nor finite takes part"


def test_sentences_name_the_stages_and_what_small_strain_costs():
    truth = measured(0.35)
    rows = [measured(0.7, off=0.01).against(truth), measured(2.0, "P1", off=0.9).against(truth), truth.against(truth)]
    rows.append(measured(1.4, fidelity="finite", off=0.04).against(measured(0.7, fidelity="finite", off=0.03), truth))
    default = replace(rows[0], stages={"factorisation": 2.0, "reduction": 3.0})
    found = SpeedBench("a finger", tuple(rows), default, 2)
    assert set(found.to_json()) == {"finger", "cores", "rows", "profile", "largest_contact"}
    assert any(line.startswith("small strain costs up to 3.8 % in S_d") for line in found.sentences())
    assert found.to_json()["profile"] == {"size_mm": 0.7, "seconds": {"factorisation": 2.0, "reduction": 3.0}}
    assert "set-up of Taylor-Hood on 0.7 mm: factorisation 2.00 s, reduction 3.00 s" in found.sentences()


def test_scenes_are_drawn_in_their_ranges_and_answers_are_presses():
    reduced = prepare(Finger.default(), size_mm=2.8)
    seconds = drawn(reduced, 4, seed=5, fidelity="hertz")
    assert len(seconds) == 4 and 0 <= min(seconds) <= max(seconds) < 2
    asked = []
    values = answers(lambda force: asked.append(force) or press(reduced, SWEEP_SPECIMEN, force=force), FINITE_FORCES_GF)
    assert asked == pytest.approx([0.0980665, 0.2941995, 0.980665]) and values.shape == (3, 3)
    middle = press(reduced, SWEEP_SPECIMEN, force=asked[1])
    assert values[:, 1] == pytest.approx([middle.sd, middle.indentation, middle.contact_area])
    assert (np.diff(values, axis=1) > 0).all() and (SWEEP_SPECIMEN.modulus, SWEEP_SPECIMEN.thickness) == (0.51, 10)
    assert 100 * FORCES_GF[0] == 10 * FORCES_GF[-1] == 1000 and set(FINITE_FORCES_GF) <= set(FORCES_GF)


@pytest.mark.parametrize("plan", [FULL_PLAN, SHORT_PLAN])
def test_plans_hold_what_rows_are_compared_with(plan):
    assert plan.default_mm in plan.sizes_mm and min(plan.sizes_mm) == plan.sizes_mm[-1]
    assert set(plan.finite_sizes_mm) <= set(plan.sizes_mm), "small strain is taken on the mesh of a finite row"
    assert min(plan.finite_sizes_mm) == plan.finite_sizes_mm[-1]
    shipped = {float(path.name.split("_")[1]) for path in (DEFAULT_FINGER.parent / "meshes").glob("dome_[0-9]*.npz")}
    finest = DEFAULT_SIZE_MM / 2 if plan is FULL_PLAN else DEFAULT_SIZE_MM
    every = {*plan.sizes_mm, *plan.other_sizes_mm, *plan.finite_sizes_mm}
    assert every <= shipped | {finest} and plan.sizes_mm[-1] == finest and set(plan.other_sizes_mm) < set(plan.sizes_mm)
    assert set(plan.finite_forces_gf) <= set(FORCES_GF)


def test_the_figure_shows_curves_front_and_the_best_price():
    names = ("fidelity", "element", "size_mm", "seconds_thousand", "error_sd", "pareto")
    rows = [
        dict(zip(names, values, strict=True))
        for values in (
            ("contact", "P1", 0.7, 40.0, 0.01, False), ("contact", "P1", 1.4, 9.0, 0.04, True),
            ("contact", "TH", 1.4, 20.0, 0.005, True), ("contact", "TH", 0.35, 900.0, 0.0, False),
            ("hertz", "P1", 1.4, 2.0, 0.2, True),
        )
    ]  # fmt: skip
    figure = price_figure(rows, 0.35)
    (axes,) = figure.axes
    curve = next(line for line in axes.lines if line.get_marker() == "o" and line.get_color() == ACCENT_COLORS[0])
    assert list(curve.get_xdata()) == [9.0, 40.0] and list(curve.get_ydata()) == pytest.approx([4.0, 1.0])
    hertz = next(line for line in axes.lines if line.get_marker() == "^" and len(line.get_xdata()))
    assert (curve.get_markerfacecolor(), hertz.get_markerfacecolor()) == (ACCENT_COLORS[0], "white")
    front = next(line for line in axes.lines if line.get_linestyle() == ":")
    assert list(front.get_xdata()) == [2.0, 9.0, 20.0] and front.get_ydata() == pytest.approx([20.0, 4.0, 0.5])
    assert axes.get_xscale() == axes.get_yscale() == "log" and 5.0 in axes.get_xticks()
    assert sorted(text.get_text() for text in axes.texts) == ["0.7", "1.4", "1.4", "1.4"]
    keys = [text.get_text() for text in axes.get_legend().get_texts()]
    assert keys == ["fidelity hertz", "fidelity contact", "P1", "TH", "Pareto front of hertz and contact"]
    slow = price_figure(
        [row | {"seconds_thousand": 600 * row["seconds_thousand"], "fidelity": "finite"} for row in rows], 1
    )
    said, told = (
        " ".join(" ".join(text.get_text() for text in one.findobj(match=Text)).split()) for one in (figure, slow)
    )
    assert "0.5 % in $S_d$ for 20 s a thousand presses: contact, TH, 1.4 mm" in said and "finite" not in said
    assert 5.0 not in slow.axes[0].get_xticks() and "finite: to itself on a finer mesh" in told


def test_a_fidelity_that_refuses_has_no_figures():
    """No patch holds a contact of 50 N: nothing is left out, and nothing is made up."""
    hertz, contact = measure(Finger.default(), 2.8, "P1", forces_gf=(10, 5000))
    assert hertz.status.startswith("refused: ") and contact.status.startswith("refused: ")
    assert np.isnan(contact.answers).all() and np.isnan(contact.seconds_thousand) and contact.dofs > 100
    assert 20 < contact.peak_memory_MiB < 20_000
    assert contact.patch_nodes == hertz.patch_nodes and contact.factor_nonzeros > contact.dofs
    row = contact.against(measured(0.35))
    assert row.status == contact.status and np.isnan(row.error_sd) and row.seconds_setup > 0


@pytest.mark.slow
def test_short_form(papilla, tmp_path):
    answer = papilla("bench", "--short", "--json", "--out", tmp_path / "priced")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    rows = {(row["fidelity"], row["element"], row["size_mm"]): row for row in found["rows"]}
    assert len(rows) == len(found["rows"]) == 12
    for row in found["rows"]:
        assert set(row) == KEYS and row["seconds_setup"] >= 0 and row["peak_memory_MiB"] > 50
        if row["fidelity"] == "hertz" and row["size_mm"] > 1 and row["status"].startswith("refused"):
            assert row["seconds_per_scene"] is None, "no ellipse has the least energy on some meshes this coarse"
            continue
        assert row["status"] == "answered"
        assert 0 <= row["error_sd"] < 1 and row["seconds_per_scene"] > 0
    assert rows["contact", "P1", 2.8]["error_sd"] > 0.9, "P1 locks"
    # Meshes this coarse scatter by as much as they differ: no order is asserted between them, only between elements.
    assert max(rows["contact", "Taylor-Hood", size]["error_sd"] for size in (2.0, 2.8)) < 0.2
    assert rows["contact", "Taylor-Hood", 0.7]["reference"] and rows["contact", "Taylor-Hood", 0.7]["error_sd"] == 0
    assert rows["hertz", "Taylor-Hood", 0.7]["error_sd"] < 0.03
    # A contact one element wide: 0.055 on the mesh that ships
    assert 0.01 < rows["finite", "Taylor-Hood", 2.8]["small_strain_sd"] < 0.06
    assert any(row["pareto"] for row in found["rows"])
    assert found["plot"] == str(tmp_path / "priced" / "speed_against_error.png")
    assert (tmp_path / "priced" / "speed_against_error.png").read_bytes().startswith(b"\x89PNG")
    assert "fidelity finite on 2.8 mm" in answer.err
