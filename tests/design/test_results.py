"""Fronts, chosen designs, effects and summaries of results that are made up."""

import math
from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from papilla.design.confirming import Confirmed
from papilla.design.job import front_figure, in_words, sigma_figure
from papilla.design.results import Effect, Outcome, Results, first_words, summary
from papilla.design.running import Tally
from papilla.design.scene import DesignScene
from papilla.design.study import read_study
from papilla.model.finger import Finger

FINGER = Finger.default()


@pytest.fixture
def results_of(study_file):
    """Results of designs with these values of sigma_sd (less is better) and signal_over_noise (more is)."""
    study = read_study(study_file())

    def make(found, free=None, feasible=None, numbers=None, failures=None) -> Results:
        found, count = np.array(found, float), len(found)
        spread = np.linspace(0.1, 0.6, count), np.linspace(20, 50, count)
        free = np.column_stack(spread) if free is None else np.array(free, float)
        feasible = np.ones(count, bool) if feasible is None else np.array(feasible)
        numbers = np.arange(count) if numbers is None else np.array(numbers)
        fingers = [f"{number:064x}" for number in range(count)]
        return Results(study, numbers, free, found, feasible, fingers, failures or {})

    return make


@pytest.mark.parametrize(
    "found, feasible, front",
    [
        ([(0.2, 5), (0.3, 4), (0.4, 6), (0.2, 4)], [True] * 4, [True, False, True, False]),
        ([(0.3, 4), (0.2, 5), (0.2, 6)], [True] * 3, [False, False, True]),
        ([(0.2, 5), (0.2, 5), (0.3, 5)], [True] * 3, [True, True, False]),
        ([(0.2, 5), (0.3, 4), (0.4, 3)], [False, True, True], [False, True, False]),
    ],
)
def test_the_front_holds_what_is_beaten_by_none_that_meets_all_limits(results_of, found, feasible, front):
    assert results_of(found, feasible=feasible).front.tolist() == front


def test_chosen_designs_are_the_best_three_that_differ(results_of):
    """By more than 5 % of the range of a parameter, which is in the logarithm for the modulus, 0.1 to 0.6 MPa."""
    step = 6**0.01
    free = [(0.1, 20.0), (0.1 * step**4.9, 20.0), (0.1 * step**5.1, 20.0), (0.1, 21.4), (0.1, 21.6), (0.6, 50.0)]
    found = [(0.1 + 0.01 * k, 5.0) for k in range(6)]
    assert results_of(found, free).chosen == [0, 2, 4]
    assert results_of(found[::-1], free).chosen == [5, 4, 2]
    assert results_of(found, free, [False, True, True, False, False, True]).chosen == [1, 5]
    assert results_of(found, free, [False] * 6).chosen == []


def test_effects_are_those_of_least_squares_with_the_intervals_of_student(results_of):
    rng = np.random.default_rng(2)
    free = np.column_stack([0.1 * 6 ** rng.random(12), 20 + 30 * rng.random(12)])
    found = np.column_stack([np.exp(rng.normal(0, 0.3, 12)), rng.normal(0, 1, 12)])
    effects = results_of(found, free).effects
    shares = np.column_stack([np.ones(12), np.log(free[:, 0] / 0.1) / math.log(6), (free[:, 1] - 20) / 30])
    half = stats.t.ppf(0.975, 9)
    assert [(one.objective, one.parameter, one.factor) for one in effects] == [
        ("sigma_sd", "outer.modulus_MPa", True), ("sigma_sd", "gauges.spread_deg", True),
        ("signal_over_noise", "outer.modulus_MPa", False), ("signal_over_noise", "gauges.spread_deg", False),
    ]  # fmt: skip
    assert [(one.low, one.high) for one in effects[:2]] == [(0.1, 0.6), (20.0, 50.0)]
    for goal, values in enumerate((np.log(found[:, 0]), found[:, 1])):
        slopes, rest, *_ = np.linalg.lstsq(shares, values)
        sigma = np.sqrt(rest[0] / 9 * np.diag(np.linalg.inv(shares.T @ shares)))
        for k in (1, 2):
            one = effects[2 * goal + k - 1]
            ends = slopes[k] + sigma[k] * half * np.array([0, -1, 1])
            ends = np.exp(ends) if one.factor else ends
            assert (one.change, *one.interval) == pytest.approx(ends)
            assert one.sure == (abs(slopes[k]) > sigma[k] * half)


@pytest.mark.parametrize("count, effects", [(5, 0), (6, 4), (7, 4)])
def test_effects_need_three_degrees_of_freedom(results_of, count, effects):
    rng = np.random.default_rng(2)
    free = np.column_stack([0.1 * 6 ** rng.random(count), 20 + 30 * rng.random(count)])
    assert len(results_of(rng.random((count, 2)), free).effects) == effects
    free[:, 0] = 0.3
    held = results_of(rng.random((count, 2)), free).effects
    assert [one.parameter for one in held] == ["gauges.spread_deg"] * 2
    free[:, 1] = 30.0
    assert results_of(rng.random((count, 2)), free).effects == []


def test_a_study_as_plain_values(results_of):
    results = results_of([(0.3, 4.0), (0.2, 5.0)], numbers=[3, 7], failures={4: "broken", 5: "torn", 6: "broken"})
    spent = defaultdict(float, geometry=1.0, ratio=2.0, gauges=4.0, scenes=8.0)
    tally = Tally(designs=5, reused=1, seconds=9.5, spent=spent, memory_MB=300.0, workers=2, notes=["a note"])
    sigma = np.full((3, 5), 0.2)
    confirmed = [
        Confirmed("finger_1.toml", {"S_d": sigma}, {"S_d": 1.25 * sigma}, DesignScene()),
        Confirmed("own", {}, {}, DesignScene(), "no mesh"),
    ]
    written = {"tables": ["d.csv"], "fingers": ["f1.toml", "f2.toml"], "page": ["p.html"]}
    outcome = Outcome(results.study, results, tally, {"sigma_sd": 0.4, "signal_over_noise": 3.0}, confirmed, written)
    plain = summary(outcome)
    best = {"design": 7, "finger": "f1.toml", "finger_sha256": f"{1:064x}"}
    best["free"] = {"outer.modulus_MPa": 0.6, "gauges.spread_deg": 50.0}
    assert plain["best"][0] == best | {"objectives": {"sigma_sd": 0.2, "signal_over_noise": 5.0}}
    assert [(one["design"], one["finger"]) for one in plain["best"]] == [(7, "f1.toml"), (3, "f2.toml")]
    counts = [plain[name] for name in ("designs", "failed", "reused", "feasible", "front")]
    assert counts == [5, 3, 1, 2, 1] and plain["effects"] == [] and plain["notes"] == ["a note"]
    assert plain["confirmed"][0]["S_d"] == pytest.approx({"predicted": 0.2, "calibrated": 0.25})
    assert plain["confirmed"][1] == {"finger": "own", "failed": "no mesh"}
    cost = [plain["cost"][name] for name in ("seconds", "seconds_geometry", "seconds_designs", "worker_memory_MB")]
    assert cost == [9.5, 3.0, 12.0, 300.0]
    first, sd, signal = first_words(outcome)
    assert outcome.failed_share == 0.6 and first == "3 of 5 designs failed (60 %), most often: broken"
    assert sd.endswith(f"over the scene: best 0.2, {FINGER.name} 0.4")
    assert signal.endswith(f": best 5, {FINGER.name} 3")


@pytest.mark.parametrize("failed, said", [(1, 2), (2, 3)])
def test_failures_are_said_first_above_a_tenth(results_of, failed, said):
    results = results_of([(0.3, 4.0)] * 9, failures={k: "broken" for k in range(20, 20 + failed)})
    outcome = Outcome(results.study, results, Tally(), {"sigma_sd": 1.0, "signal_over_noise": 1.0}, [], {})
    assert len(first_words(outcome)) == said
    none = replace(results, feasible=np.zeros(9, bool))
    outcome = Outcome(none.study, none, Tally(), {}, [], {})
    assert first_words(outcome)[-1] == f"no design of {9 + failed} keeps all constraints"


def drawn_points(axes):
    """Label -> (n, 2) points of the lines of a picture."""
    return {line.get_label(): np.column_stack(line.get_data()) for line in axes.lines}


@pytest.mark.parametrize("widest, scale", [(4.9, "linear"), (5.1, "log")])
def test_a_picture_of_the_front_shows_every_design_where_it_is(results_of, widest, scale):
    found = np.array([(0.2, 5.0), (0.3, 4.0), (0.2 * widest, 6.0), (0.25, 4.5), (0.21, 9.0)])
    results = results_of(found, feasible=[True] * 4 + [False])
    (axes,) = front_figure(results, {"sigma_sd": 0.4, "signal_over_noise": 3.0}).axes
    points = drawn_points(axes)
    at = found[:, ::-1].tolist()
    assert points["designs"].tolist() == at[:4] and points["breaks a constraint"].tolist() == at[4:]
    assert points["Pareto front"].tolist() == [at[0], at[2]] and points[FINGER.name].tolist() == [[3.0, 0.4]]
    assert points["chosen"].tolist() == [at[k] for k in results.chosen] and results.chosen[0] == 0
    assert (axes.get_yscale(), axes.get_xscale()) == (scale, "linear")
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("signal_over_noise", "sigma_sd")
    only = replace(results, study=replace(results.study, objectives=results.study.objectives[:1]))
    (axes,) = front_figure(only, {"sigma_sd": 0.4}).axes
    points = drawn_points(axes)
    assert points["designs"].tolist() == np.column_stack([results.free[:4, 0], found[:4, 0]]).tolist()
    assert set(points[FINGER.name][:, 1]) == {0.4} and "Pareto front" not in points
    assert axes.get_xlabel() == "outer.modulus_MPa" and axes.get_xscale() == "log"


def test_a_map_of_sigma_has_a_panel_for_each_design_and_levels_in_per_cent():
    forces, moduli = np.geomspace(0.2, 0.8, 4), np.geomspace(0.05, 0.5, 5)
    sigma = np.geomspace(0.002, 3.0, 20).reshape(4, 5)
    *panels, bar = sigma_figure(forces, moduli, [("one", sigma), ("a name of two lines", 0.03 * sigma)]).axes
    assert [axes.get_title(loc="left") for axes in panels] == ["one", "a name of two\nlines"] and bar.get_ylabel()
    for axes in panels:
        assert (axes.get_xscale(), axes.get_yscale(), axes.get_xlabel()) == ("log", "log", "force (N)")
        assert axes.get_xticks() == pytest.approx([0.2, 0.4, 0.8]) and axes.dataLim.y0 == pytest.approx(0.05)
        assert [text.get_text() for text in axes.get_xticklabels()] == ["0.2", "0.4", "0.8"]
    assert [text.get_text() for text in bar.get_yticklabels()] == ["1 %", "2 %", "5 %", "10 %", "20 %", "50 %", "100 %"]
    shades = panels[0].collections[0]
    assert shades.levels == pytest.approx(np.log10([1, 2, 5, 10, 20, 50, 100]))
    assert (shades.zmin, shades.zmax) == pytest.approx((0, 2))
    ends = [path.get_extents() for path in shades.get_paths() if len(path.vertices)]
    assert max(box.x1 for box in ends) == pytest.approx(0.8) and max(box.y1 for box in ends) == pytest.approx(0.5)


def test_an_effect_in_words():
    effect = Effect("a", "sigma_sd", 0.1, 0.6, 2.0, (1.5, 2.5), True)
    assert in_words(effect) == "a from 0.100 to 0.600 multiplies sigma_sd by 2.00 (1.50 to 2.50)" and effect.sure
    other = replace(effect, change=-2.0, interval=(-2.5, 0.5), factor=False)
    assert in_words(other).startswith("a from 0.100 to 0.600 changes sigma_sd by ") and not other.sure
    assert replace(effect, interval=(1.0, 2.5)).sure is False and replace(other, interval=(0.1, 0.5)).sure
