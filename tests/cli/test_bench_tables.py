"""What `papilla bench` passes on to its studies, and what it prints of their results, which are made up."""

import json
import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import pytest

from benchmarks.estimators import comparison
from papilla.cli import bench
from papilla.cli.options import PROCESSES
from papilla.model.finger import Finger


def words(text: str) -> str:
    """The words of a table, without its lines."""
    return " ".join("".join(" " if sign in "│┃━─┏┓┗┛┡┩└┘┬┴┼╇┳┻╋" else sign for sign in text).split())


@dataclass(frozen=True)
class Row:
    """A row of the bench."""

    fidelity: str = "contact"
    element: str = "P2"
    size_mm: float = 0.7
    dofs: int = 43210
    seconds_setup: float = 2.5
    seconds_per_scene: float = 0.004
    seconds_thousand: float = 6.5
    error_sd: float = 0.0123
    error_indentation: float = 0.02
    error_area: float = math.nan
    peak_memory_MiB: float = 456.4
    reference: bool = False
    pareto: bool = False

    def to_json(self) -> dict:
        return {"size_mm": self.size_mm}


class Found(SimpleNamespace):
    """A bench of these rows."""

    def ratio(self, seconds: float) -> float:
        return 6.5 / seconds

    def to_json(self) -> dict:
        return {"rows": [row.to_json() for row in self.rows]}

    def sentences(self) -> list[str]:
        return ["a sentence"]


@pytest.fixture
def measured(monkeypatch):
    """The bench of three rows, and what its parts were asked for."""
    from benchmarks.presses import peers
    from papilla.cli import speed as study
    from papilla.fem.pressing import pricing
    from papilla.view import style
    from papilla_papers import study_plots

    calls = []
    rows = (Row(pareto=True), Row(element="P1", reference=True, pareto=True), Row(fidelity="hertz"))
    found = Found(
        rows=rows, finger_name="made up", cores=3, peer_mesh="mesh",
        default=SimpleNamespace(reference_size_mm=0.35, size_mm=2.8),
    )  # fmt: skip
    peer = SimpleNamespace(name="another", seconds_one_press=50.0, to_json=lambda: {"name": "another",
                           "seconds_one_press": 50.0})  # fmt: skip
    monkeypatch.setattr(study, "bench", lambda design, plan, progress: calls.append((design.name, plan)) or found)
    monkeypatch.setattr(pricing, "price", lambda design, progress: calls.append("priced"))
    monkeypatch.setattr(
        peers, "run_peers", lambda design, mesh, threads, progress: calls.append((mesh, threads)) or (peer,)
    )
    monkeypatch.setattr(peers, "missing_peers", lambda: ["a library is missing"])
    monkeypatch.setattr(
        study_plots, "price_figure", lambda rows, reference: calls.append((rows, reference)) or "figure"
    )
    monkeypatch.setattr(style, "write_png", lambda figure, path: calls.append((figure, path)))
    return calls


@pytest.mark.parametrize("short", [True, False])
def test_the_bench_of_a_finger_is_a_table_a_plot_and_json(papilla, measured, tmp_path, short):
    from papilla.cli import speed as study

    options = ["--short"] if short else []
    answer = papilla("bench", "--finger", "published", *options)
    assert answer.code == 0 and answer.err.splitlines()[-1] == "a library is missing"
    name, plan = measured[0]
    assert name.endswith("as published") and plan is (study.SHORT if short else study.FULL)
    assert ("priced" in measured) == (not short)
    assert ("mesh", 3) in measured and ([{"size_mm": 0.7}] * 3, 0.35) in measured
    assert measured[-1] == ("figure", tmp_path / "speed_against_error.png")
    said = words(answer.out)
    for part in (
        "made up: errors in %, worst of 10-100 gf; * on the Pareto front",
        "contact P2 0.7 43,210 2.5 4 6.5 1.23 2.00 - 456 * contact P1",
        "contact P1 0.7 43,210 2.5 4 6.5 1.23 2.00 - 456 reference hertz",
        "hertz P2 0.7 43,210 2.5 4 6.5 1.23 2.00 - 456 a sentence",
        "another: 50.00 s for one press on 2.8 mm; papilla's set-up and 1000 scenes take 0.13 of it",
    ):
        assert part in said, part
    measured.clear()
    facts = json.loads(papilla("bench", *options, "--out", "here", "--json").out)
    assert facts["peers"] == [{"name": "another", "seconds_one_press": 50.0, "ratio": 0.13}]
    assert facts["peers_missing"] == ["a library is missing"] and len(facts["rows"]) == 3
    assert facts["plot"] == "here/speed_against_error.png" and measured[0][0] == Finger.default().name


SCENE = comparison.Row(
    scene="grating", method="the product", kind="product", answered=0.5, asked=0.25, claimed=1.0, false=0.125,
    false_steady=0.01, false_settled=0.02, median=0.03, over_5=0.04, rms=0.05, covered=0.95, over_sigma=1.25,
    over_bound=1.5, first_right_s=0.3, us=math.nan, runs=1, faults=("too late", "too wide"),
)  # fmt: skip


def test_scenes_are_a_table_of_the_product_and_all_methods_side_by_side(capsys):
    other = replace(SCENE, method="a paper's", kind="published", median=math.nan, answered=1.0, faults=())
    bench.print_scenes([SCENE, other])
    said = words(capsys.readouterr().out)
    assert "grating 25 50 12.5 1 2 95 1.25 3 4 5 1.5 0.3 missed" in said, "the nan of the last column is empty"
    assert "missed, the product, grating: too late; too wide Median error" in said, "of the product alone"
    assert "Median error of the wavelength, % scene the product a paper's grating 3 Answered" in said
    assert "Answered, and false among these, % scene the product a paper's grating 50 12.5 100 12.5" in said


@pytest.mark.parametrize("short", [True, False])
def test_the_bench_of_estimators_needs_a_calibration_unless_it_is_short(papilla, monkeypatch, tmp_path, short):
    from benchmarks.estimators import cost, touches
    from papilla.calibration.fitting import job
    from papilla.view import style
    from papilla_papers import study_plots

    asked = {}
    touch = touches.TouchRow("creep", "gauges", 0.5, 0.1, 0.2, 0.9, 0.05, 1.5, 2.5, 8)
    price = cost.Cost(*[{"output": "modulus"}.get(name, 2.0) for name in cost.Cost.__dataclass_fields__])
    done = SimpleNamespace(calibration="calibration")
    monkeypatch.setattr(job, "calibrate_finger", lambda finger, progress: asked.update(made=finger.name) or done)
    monkeypatch.setattr(cost, "costs", lambda made, seconds: asked.update(costs=(made, seconds)) or (price,))
    monkeypatch.setattr(
        comparison, "compare", lambda plan, workers, progress: asked.update(plan=plan, workers=workers) or [SCENE]
    )
    monkeypatch.setattr(touches, "feel", lambda *given, progress: asked.update(felt=given) or (touch,))
    monkeypatch.setattr(study_plots, "honesty_figure", lambda rows: asked.update(drawn=rows[0]["scene"]) or "figure")
    monkeypatch.setattr(style, "write_png", lambda figure, path: asked.update(written=(figure, path.name)))
    options = ["--short"] if short else []
    answer = papilla("bench", "--estimators", *options)
    assert answer.code == 0, answer.err
    said = words(answer.out)
    assert asked["plan"] is (comparison.SHORT if short else comparison.LONG) and asked["workers"] == PROCESSES
    assert asked["costs"] == ((None, 1.0) if short else ("calibration", 4.0)) and "drawn" not in asked
    assert ("felt" in asked) == ("made" in asked) == ("creep gauges 50 5 90 1.5 10 20 2.5" in said) == (not short)
    assert ("one run per scene is not enough for a verdict" in said) == short and "modulus 2 2 2 2" in said
    assert short or (asked["felt"][0], asked["felt"][1].name) == ("calibration", asked["made"])
    answer = papilla("bench", "--estimators", *options, "--out", "here")
    assert asked["drawn"] == "grating" and asked["written"] == ("figure", "estimators.png")
    assert answer.out.splitlines()[-1] == "plot: here/estimators.png"
    facts = json.loads(papilla("bench", "--estimators", *options, "--out", "here", "--json").out)
    assert facts["plots"] == ["here/estimators.png"] and facts["short"] == short
    assert facts["scenes"][0]["first_right_s"] == 0.3 and len(facts["softness"]) == (not short)
    assert json.loads(papilla("bench", "--estimators", *options, "--json").out)["plots"] == []
