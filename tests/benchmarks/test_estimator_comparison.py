"""What the comparison of estimators prints of its results, which are made up."""

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from benchmarks import estimator_comparison as command
from benchmarks.estimators import comparison, cost, touches
from papilla.cli.options import PROCESSES
from papilla.cli.output import json_text


def words(text: str) -> str:
    """The words of a table, without its lines."""
    return " ".join("".join(" " if sign in "│┃━─┏┓┗┛┡┩└┘┬┴┼╇┳┻╋" else sign for sign in text).split())


SCENE = comparison.Row(
    scene="grating", method="the product", kind="product", answered=0.5, asked=0.25, claimed=1.0, false=0.125,
    false_steady=0.01, false_settled=0.02, median=0.03, over_5=0.04, rms=0.05, covered=0.95, over_sigma=1.25,
    over_bound=1.5, first_right_s=0.3, us=math.nan, runs=1, faults=("too late", "too wide"),
)  # fmt: skip


def test_scenes_are_a_table_of_the_product_and_all_methods_side_by_side(capsys):
    other = replace(SCENE, method="a paper's", kind="published", median=math.nan, answered=1.0, faults=())
    command.print_scenes([SCENE, other])
    said = words(capsys.readouterr().out)
    assert "grating 25 50 12.5 1 2 95 1.25 3 4 5 1.5 0.3 missed" in said, "the nan of the last column is empty"
    assert "missed, the product, grating: too late; too wide Median error" in said, "of the product alone"
    assert "Median error of the wavelength, % scene the product a paper's grating 3 Answered" in said
    assert "Answered, and false among these, % scene the product a paper's grating 50 12.5 100 12.5" in said


@pytest.mark.parametrize("short", [True, False])
def test_the_bench_of_estimators_needs_a_calibration_unless_it_is_short(capsys, monkeypatch, tmp_path, short):
    monkeypatch.chdir(tmp_path)
    asked = {}
    touch = touches.TouchRow("creep", "gauges", 0.5, 0.1, 0.2, 0.9, 0.05, 1.5, 2.5, 8)
    price = cost.Cost(*[{"output": "modulus"}.get(name, 2.0) for name in cost.Cost.__dataclass_fields__])
    done = SimpleNamespace(calibration="calibration")
    monkeypatch.setattr(command, "calibrate", lambda finger, progress: asked.update(made=finger.name) or done)
    monkeypatch.setattr(command, "costs", lambda made, seconds: asked.update(costs=(made, seconds)) or (price,))
    monkeypatch.setattr(
        command, "compare", lambda plan, workers, progress: asked.update(plan=plan, workers=workers) or [SCENE]
    )
    monkeypatch.setattr(command, "feel", lambda *given, progress: asked.update(felt=given) or (touch,))
    monkeypatch.setattr(command, "honesty_figure", lambda rows: asked.update(drawn=rows[0]["scene"]) or "figure")
    monkeypatch.setattr(command, "write_png", lambda figure, path: asked.update(written=(figure, path.name)))
    answer = command.estimators(short, None)
    answer.show()
    said = words(capsys.readouterr().out)
    assert asked["plan"] is (comparison.SHORT if short else comparison.LONG) and asked["workers"] == PROCESSES
    assert asked["costs"] == ((None, 1.0) if short else ("calibration", 4.0)) and "drawn" not in asked
    assert ("felt" in asked) == ("made" in asked) == ("creep gauges 50 5 90 1.5 10 20 2.5" in said) == (not short)
    assert ("one run per scene is not enough for a verdict" in said) == short and "modulus 2 2 2 2" in said
    assert short or (asked["felt"][0], asked["felt"][1].name) == ("calibration", asked["made"])
    assert answer.facts["plots"] == []
    answer = command.estimators(short, Path("here"))
    assert asked["drawn"] == "grating" and asked["written"] == ("figure", "estimators.png")
    answer.show()
    assert capsys.readouterr().out.splitlines()[-1] == "plot: here/estimators.png"
    facts = json.loads(json_text(answer.facts))
    assert facts["plots"] == ["here/estimators.png"] and facts["short"] == short
    assert facts["scenes"][0]["first_right_s"] == 0.3 and len(facts["softness"]) == (not short)


def test_numbers_in_words():
    assert [command._shown("ok %", value) for value in (0.125, math.nan, "name")] == ["12.5", "", "name"]
    assert command._shown("us", 0.125) == "0.125"
