"""The comparison as the command runs it, small: tables, targets, plots."""

import dataclasses
import json
import math

import pytest

from papilla.cli.bench_estimators import bench_estimators, print_tables
from papilla.errors import InputError
from papilla.studies.estimator_bench import prototypes, targets
from papilla.studies.estimator_bench.competitors import AS_PRINTED, COMPETITORS, FAMILIES
from papilla.studies.estimator_bench.plan import LONG, SHORT
from papilla.studies.estimator_bench.runner import compare
from papilla.view import estimator_plots
from papilla.view.style import png

SMALL = dataclasses.replace(
    SHORT,
    names=("zero crossing", "reciprocal"),
    wavelengths_mm=(1.2,),
    seconds=2.0,
    delays_ms=(0, 2),
    draws=20,
    cost_seconds=0.3,
)


@pytest.fixture(scope="module")
def small():
    calls = []
    found = compare(SMALL, progress=lambda *call: calls.append(call))
    assert calls[-1][1] == calls[-1][2]
    return found


def test_every_table_has_its_rows(small):
    assert len(small.scenes) == 3 * len(SMALL.conditions)
    assert len(small.steps) == 3 * len(SMALL.steps_mm)
    assert len(small.velocity) == 3 * (len(SMALL.delays_ms) + len(SMALL.gains))
    assert [row.scene for row in small.likelihood] == ["const", "act1", "act2"]
    assert all(row.block_us > 0 and row.update_p999_us >= row.update_us > 0 for row in small.costs)
    json.dumps(small.to_json())


def test_the_figures_are_in_their_order(small):
    rows = {(row.estimator, row.scene, row.snr_dB): row for row in small.scenes}
    exact = rows["reciprocal in space", "act1", 20.0]
    counted = rows["zero crossing (2007), as printed", "act1", 20.0]
    assert exact.error < 0.01 < 0.05 < counted.error
    assert abs(exact.lag_ms) < 0.5 < 20 < counted.lag_ms < 60
    assert counted.ratio == counted.error / counted.bound > 10
    assert math.isnan(exact.ratio) and math.isnan(counted.sigma_ratio)
    assert exact.outliers == exact.false_locks == 0 and exact.answered == 1
    errors = [rows["reciprocal in space", "const", snr].error for snr in (20.0, 0.0, -6.0)]
    assert errors == sorted(errors)
    known = {(row.delay_ms, row.gain): row.error for row in small.velocity if row.estimator == "reciprocal in space"}
    assert known[2, 1.0] > 3 * known[0, 1.0]
    assert known[0, 1.03] == pytest.approx(0.03, abs=0.01)


def test_prototypes_are_compared_where_both_are_known(small):
    names = {(row.estimator, row.scene, row.measure) for row in small.prototypes}
    assert ("zero crossing (2007)", "harsh", "error_answered") in names
    assert ("zero crossing (2007)", "act2", "lag_ms") in names
    assert all(row.differs == (abs(row.ratio - 1) > prototypes.TOLERANCE) for row in small.prototypes)
    assert {f"{name}, {AS_PRINTED}" for name in (*prototypes.PERCENT, *prototypes.LAGS_MS)} <= set(COMPETITORS)


def test_targets_name_what_exists_and_are_judged(small):
    scenes = {f"{scene}, {snr:g} dB" for scene, snr in LONG.conditions}
    steps = {f"{before:g} to {after:g} mm" for before, after in LONG.steps_mm}
    assert {target.where for target in targets.TARGETS} <= scenes | steps | {"NumPy", "compiled"}
    assert {row.place for row in small.scenes} <= scenes and {row.place for row in small.steps} == steps
    assert {target.estimator for target in targets.TARGETS} <= set(COMPETITORS)
    verdicts = small.targets
    assert {row.measure for row in verdicts} == {"block_us", "update_us", "update_p999_us"}
    assert all(row.met == (row.low <= row.measured <= row.high) for row in verdicts)


def test_a_missed_and_an_unanswered_target_are_not_met():
    target = targets.Target("x", "const, 20 dB", "lag_ms", 0.5, "", low=-0.5)
    judged = [targets.judged(target, value) for value in (0.4, 0.6, -0.6, math.nan)]
    assert [item.met for item in judged] == [True, False, False, False]
    assert judged[0].where == "const, 20 dB" and judged[0].unit == "ms"


def test_plots_and_tables_of_a_comparison(small, capsys):
    figures = estimator_plots.all_plots(small.to_json())
    assert set(figures) == {"error", "cost", "outliers", "steps", "velocity"}
    assert all(png(figure, dpi=30).startswith(b"\x89PNG") for figure in figures.values())
    print_tables(small)
    shown = capsys.readouterr().out
    for part in ("reciprocal in space", "RMS error in harsh", "Targets: ", "Maximum likelihood", "p99.9"):
        assert part in shown


def test_every_competitor_runs_on_its_gauges():
    assert {item.family for item in COMPETITORS.values()} == set(FAMILIES)
    from papilla.studies.estimator_bench.scenes import scene

    for item in COMPETITORS.values():
        rows = scene("const", 1.8, seconds=0.12, gauge_positions_mm=item.gauges_mm).block()
        options = {"compiled": False} if item.compiles else {}
        found = item.make(**options).process(rows)
        assert len(found.wavelength_mm) == len(found.frequency_Hz) == len(rows)


def test_two_processes_find_what_one_finds(small):
    plan = dataclasses.replace(SMALL, names=("reciprocal",), conditions=(("const", 20.0),), delays_ms=(0,), draws=5)
    one, two = (compare(plan, workers=workers) for workers in (1, 2))
    assert repr((one.scenes, one.steps, one.velocity, one.likelihood)) == repr(
        (two.scenes, two.steps, two.velocity, two.likelihood)
    )


def test_an_unknown_estimator_is_refused():
    with pytest.raises(InputError, match="no estimator is called 'nobody'"):
        compare(dataclasses.replace(SMALL, names=("nobody",)))


@pytest.mark.slow
def test_the_command_in_short(tmp_path, capsys):
    bench_estimators(True, tmp_path, True)
    printed = json.loads(capsys.readouterr().out)
    assert printed["short"] is True and printed["seconds"] > 0
    assert {"scenes", "steps", "velocity", "costs", "likelihood", "prototypes", "targets"} <= set(printed)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(
        f"estimators_{name}.png" for name in ("error", "cost", "outliers", "steps", "velocity")
    )
    assert all(0.8 < row["ratio"] < 1.3 for row in printed["likelihood"])
