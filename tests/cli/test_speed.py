"""`papilla bench`: errors and front on figures that are known, and a set-up in stages."""

import json
from dataclasses import replace

import numpy as np
import pytest

from papilla.cli.speed import FULL_PLAN, SHORT_PLAN, BenchRow, SpeedBench
from papilla.cli.speed.measure import SWEEP_SPECIMEN, answers, measure, peak_memory_MiB, set_up, thousand
from papilla.cli.speed.price_figure import price_figure
from papilla.cli.speed.runner import pareto_front
from papilla.core.units import gf_to_newton
from papilla.fem import FingerModel, press
from papilla.mesh import build
from papilla.model.finger import Finger
from papilla.view.style import png

KEYS = {
    *("fidelity", "element", "size_mm", "dofs", "seconds_setup", "seconds_per_scene", "error_sd", "error_indentation"),
    *("error_area", "peak_memory_MiB", "factor_nonzeros", "patch_nodes", "seconds_thousand", "forces_gf"),
    *("reference_size_mm", "reference", "small_strain_sd", "small_strain_indentation", "pareto", "status"),
}


def measured(size, element="Taylor-Hood", fidelity="contact", *, dofs=1000, off=0.0, forces=(10, 30, 100)):
    """A measurement whose answers are `off` (a fraction, or one a force) away from 1000 microstrain, 0.5 mm, 20 mm2."""
    values = np.array([1000.0, 0.5, 20.0])[:, None] * (1 + np.broadcast_to(off, len(forces)))
    stages = {"basis": 0.1, "assembly": 0.2, "factorisation": 1e-9 * dofs**2, "reduction": 0.4}
    nonzeros = int(10 * dofs ** (4 / 3))
    return BenchRow(fidelity, element, size, forces, dofs, 40, nonzeros,
                    {} if fidelity == "finite" else stages, 0.002, 3.0, 500.0, values)  # fmt: skip


# ---- Rows


def test_errors_are_the_worst_of_the_common_forces():
    reference = measured(0.35, forces=(10, 15, 30, 100))
    row = measured(0.7, off=[0.01, -0.03, 0.02]).against(reference)
    assert (row.error_sd, row.error_indentation, row.error_area) == pytest.approx((0.03, 0.03, 0.03))
    assert row.seconds_setup == pytest.approx(0.701) and row.seconds_thousand == pytest.approx(3.701)
    assert row.reference_size_mm == 0.35 and not row.reference and row.small_strain_sd is None
    own = reference.against(reference)
    assert own.reference and own.error_sd == own.error_indentation == own.error_area == 0


def test_fidelity_finite_is_compared_with_itself_and_small_strain_with_it():
    finest = measured(0.7, fidelity="finite", off=0.05)
    row = measured(1.4, fidelity="finite", off=0.071).against(finest, measured(1.4, off=0.0))
    assert row.element == "Taylor-Hood" and row.seconds_setup == 0
    assert row.error_sd == pytest.approx(0.02), "of the mesh alone, not the difference of the models"
    assert row.small_strain_sd == pytest.approx(1 - 1 / 1.071)


def test_json_of_a_row_has_the_documented_keys():
    row = measured(0.7).against(measured(0.35))
    found = json.loads(json.dumps(row.to_json(), allow_nan=False))
    assert set(found) == KEYS
    assert found["dofs"] == 1000 and found["forces_gf"] == [10, 30, 100]


# ---- Front, ratio, sentences


def test_front_keeps_what_nothing_beats():
    seconds, error = np.array([1.0, 2.0, 2.0, 3.0, 4.0, 4.0]), np.array([5.0, 3.0, 4.0, 3.0, 1.0, 1.0])
    assert pareto_front(seconds, error).tolist() == [True, True, False, False, True, True]
    assert pareto_front(np.array([1.0]), np.array([9.0])).tolist() == [True]


def bench_of(rows) -> SpeedBench:
    default = replace(rows[0], stages={"factorisation": 2.0, "reduction": 3.0})
    return SpeedBench("a finger", tuple(rows), default, 2)


def test_sentences_and_plot():
    truth = measured(0.35)
    rows = [replace(measured(0.7, off=0.01).against(truth), pareto=True), measured(2.0, "P1", off=0.9).against(truth)]
    finite = measured(1.4, fidelity="finite", off=0.04).against(measured(0.7, fidelity="finite", off=0.03), truth)
    found = bench_of([*rows, truth.against(truth), finite])
    assert set(found.to_json()) == {"finger", "cores", "rows", "profile", "largest_contact"}
    assert any(line.startswith("small strain costs up to 3.8 % in S_d") for line in found.sentences())
    assert found.to_json()["profile"] == {"size_mm": 0.7, "seconds": {"factorisation": 2.0, "reduction": 3.0}}
    assert "set-up of Taylor-Hood on 0.7 mm: factorisation 2.00 s, reduction 3.00 s" in found.sentences()
    figure = price_figure([row.to_json() for row in found.rows], found.default.reference_size_mm)
    assert png(figure, dpi=30).startswith(b"\x89PNG")


@pytest.mark.parametrize("plan", [FULL_PLAN, SHORT_PLAN])
def test_plans_hold_what_rows_are_compared_with(plan):
    assert plan.default_mm in plan.sizes_mm and min(plan.sizes_mm) == plan.sizes_mm[-1]
    assert set(plan.finite_sizes_mm) <= set(plan.sizes_mm), "small strain is taken on the mesh of a finite row"
    assert min(plan.finite_sizes_mm) == plan.finite_sizes_mm[-1]


# ---- Measuring


@pytest.mark.slow
def test_set_up_goes_through_its_stages():
    finger = Finger.default()
    mesh = build(finger)
    model, reduced, stages = set_up(finger, mesh, "P2")
    assert list(stages) == ["basis", "assembly", "factorisation", "reduction"] and min(stages.values()) > 0
    assert isinstance(model, FingerModel) and reduced.element == "P2"
    assert 10 < peak_memory_MiB() < 1e6
    found = answers(lambda force: press(reduced, SWEEP_SPECIMEN, force=force, fidelity="hertz"), (10, 100))
    assert found.shape == (3, 2) and (found[:, 1] > found[:, 0]).all()
    total, median = thousand(reduced, "hertz")
    assert total >= 500 * median > 0
    assert SWEEP_SPECIMEN.modulus == 0.51 and gf_to_newton(100) < 1


@pytest.mark.slow
def test_a_fidelity_that_refuses_says_so_and_has_no_figures():
    """No patch holds a contact of 50 N: nothing is left out, and nothing is made up."""
    hertz, contact = measure(Finger.default(), 0.7, "P1", forces_gf=(10, 5000))
    assert hertz.status.startswith("refused: ") and contact.status.startswith("refused: ")
    assert np.isnan(contact.answers).all() and np.isnan(contact.seconds_thousand) and contact.dofs > 1000
    row = contact.against(measured(0.35))
    assert row.status == contact.status and np.isnan(row.error_sd) and row.seconds_setup > 0


def test_rows_are_frozen():
    row = measured(0.7).against(measured(0.35))
    assert isinstance(row, BenchRow)
    with pytest.raises(AttributeError):
        row.error_sd = 0.0
