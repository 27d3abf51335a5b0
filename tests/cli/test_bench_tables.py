"""What `papilla bench` passes on to its studies, and what it prints of their results, which are made up."""

import json
import math
from dataclasses import dataclass
from types import SimpleNamespace

import pytest

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

    def to_json(self) -> dict:
        return {"rows": [row.to_json() for row in self.rows]}

    def sentences(self) -> list[str]:
        return ["a sentence"]


@pytest.fixture
def measured(monkeypatch):
    """The bench of three rows, and what its parts were asked for."""
    from papilla.cli import speed as study
    from papilla.fem.pressing import pricing
    from papilla.view import style

    calls = []
    rows = (Row(pareto=True), Row(element="P1", reference=True, pareto=True), Row(fidelity="hertz"))
    found = Found(
        rows=rows, finger_name="made up", cores=3,
        default=SimpleNamespace(reference_size_mm=0.35, size_mm=2.8),
    )  # fmt: skip
    monkeypatch.setattr(study, "bench", lambda design, plan, progress: calls.append((design.name, plan)) or found)
    monkeypatch.setattr(pricing, "price", lambda design, progress: calls.append("priced"))
    monkeypatch.setattr(
        "papilla.cli.speed.price_figure.price_figure",
        lambda rows, reference: calls.append((rows, reference)) or "figure",
    )
    monkeypatch.setattr(style, "write_png", lambda figure, path: calls.append((figure, path)))
    return calls


@pytest.mark.parametrize("short", [True, False])
def test_the_bench_of_a_finger_is_a_table_a_plot_and_json(papilla, measured, tmp_path, short):
    from papilla.cli import speed as study

    options = ["--short"] if short else []
    answer = papilla("bench", "--finger", "published", *options)
    assert answer.code == 0
    name, plan = measured[0]
    assert name.endswith("as published") and plan is (study.SHORT if short else study.FULL)
    assert ("priced" in measured) == (not short)
    assert ([{"size_mm": 0.7}] * 3, 0.35) in measured
    assert measured[-1] == ("figure", tmp_path / "speed_against_error.png")
    said = words(answer.out)
    for part in (
        "made up: errors in %, worst of 10-100 gf; * on the Pareto front",
        "contact P2 0.7 43,210 2.5 4 6.5 1.23 2.00 - 456 * contact P1",
        "contact P1 0.7 43,210 2.5 4 6.5 1.23 2.00 - 456 reference hertz",
        "hertz P2 0.7 43,210 2.5 4 6.5 1.23 2.00 - 456 a sentence",
    ):
        assert part in said, part
    measured.clear()
    facts = json.loads(papilla("bench", *options, "--out", "here", "--json").out)
    assert "peers" not in facts and len(facts["rows"]) == 3
    assert facts["plot"] == "here/speed_against_error.png" and measured[0][0] == Finger.default().name
