"""What `papilla verify`, `reproduce`, `figures` and `compare` pass on to the studies, and make of their results."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from papilla.cli.options import PROCESSES
from papilla.model.finger import Finger
from papilla.verify.case import Case
from papilla_papers.claims import runner
from papilla_papers.claims.claim import Answer
from papilla_papers.claims.runner import CLAIMS, EXPERIMENTS, Result


@pytest.fixture(autouse=True)
def three_processes(monkeypatch):
    monkeypatch.setattr("papilla.verify.jobs.fitting_processes", lambda: 3)


@pytest.mark.parametrize("value, code", [(0.5, 0), (2.0, 1)])
def test_a_case_outside_its_bound_ends_with_1(papilla, monkeypatch, value, code):
    asked = []

    def verify(only, *, processes, progress, skipped):
        asked.append((list(only), processes))
        progress("hertz: the area", 1, 2)
        skipped("adhesion: skipped, no package")
        return [Case("hertz: the area", "a sphere", value, 1.0), Case("hertz: depth", "a sphere", 0.1, 1.0)]

    monkeypatch.setattr("papilla.verify.verify", verify)
    answer = papilla("verify", "--only", "hertz", "--only", "cube")
    assert answer.code == code and asked[0] == (["hertz", "cube"], 3)
    assert answer.err.splitlines() == ["hertz", "adhesion: skipped, no package"]
    assert f"2 cases, {code} outside their bounds" in answer.out
    answer = papilla("verify", "--json")
    facts = json.loads(answer.out)
    assert answer.code == code and asked[1] == ([], 3) and facts["passed"] == (code == 0)
    assert [case["error"] for case in facts["cases"]] == [value, 0.1]
    assert facts["skipped"] == ["adhesion: skipped, no package"]


def untested() -> Result:
    """A claim that nobody can test here."""
    answer = Answer.untested(CLAIMS[0], EXPERIMENTS[0].name, "no sensor")
    return Result(EXPERIMENTS[0], (answer,))


@pytest.fixture
def asked():
    return []


@pytest.fixture
def claims(monkeypatch, asked):
    """The results of experiments that nobody runs."""
    found = []
    monkeypatch.setattr(runner, "results", lambda only, **how: asked.append((only, how["processes"])) or found)
    return found


@pytest.mark.parametrize("count", [1, 12, 13])
def test_a_table_of_few_claims_has_notes_and_one_of_many_says_where_they_are(papilla, asked, claims, count):
    claims.extend([untested()] * count)
    facts = json.loads(papilla("reproduce", "--only", "X2", "--json").out)
    assert asked == [("X2", 3)] and len(facts["claims"]) == count and facts["page"] is None
    assert facts["claims"][0]["seeds"] == EXPERIMENTS[0].seeds and facts["claims"][0]["noise"] == EXPERIMENTS[0].noise
    assert facts["counts"]["not testable here"] == sum(facts["counts"].values()) == count
    said = papilla("reproduce").out
    few = count <= 12
    assert asked[1] == ("", 3)
    assert ("no sensor" in said) == few and ("Notes, tolerances and calls: --only KEY" in said) == (not few)
    assert said.count(f"{CLAIMS[0].key} ") >= count and "Wrote" not in said and f"{count} claims: 0 reproduced" in said


def test_the_page_of_claims_is_written_and_named(papilla, monkeypatch, asked, claims):
    from papilla_papers.claims import page

    claims.append(untested())
    written = []
    monkeypatch.setattr(
        page, "write_page", lambda path, found, seconds: written.append((str(path), len(found), seconds))
    )
    answer = papilla("reproduce", "--only", "X2", "--out", "here")
    assert answer.out.endswith("Wrote here/reproduce.html\n")
    facts = json.loads(papilla("reproduce", "--only", "X2", "--out", "here", "--json").out)
    assert facts["page"] == "here/reproduce.html" == written[0][0] == written[1][0] and 0 <= written[0][2] < 600


def test_figures_are_named_with_what_was_found(papilla, refused, monkeypatch, tmp_path):
    from papilla_papers.figures import runner as maker

    asked = []
    figure = SimpleNamespace(name="fig. 3", title="A title", claims=("A1", "A2"))
    made = [
        SimpleNamespace(paper="2007", stem="f3", figure=figure, picture=SimpleNamespace(found="it holds")),
        SimpleNamespace(paper="2007", stem="f4", figure=figure, picture=SimpleNamespace(found="")),
    ]
    paths = {name: Path("here") / name for name in ("f3.svg", "f3.csv", "f4.svg", "f4.csv")} | {"page": Path("p.html")}
    monkeypatch.setattr(maker, "figures", lambda paper, processes, progress: asked.append((paper, processes)) or made)
    monkeypatch.setattr(maker, "write", lambda out, made, seconds: asked.append((out, len(made), seconds)) or paths)
    answer = papilla("figures", "--paper", "2007", "--out", "here")
    assert asked[0] == ("2007", 3) and asked[1][:2] == (Path("here"), 2) and 0 <= asked[1][2] < 600
    first, found, second, last = answer.out.splitlines()
    assert first == second == "2007 fig. 3: A title" and found.strip() == "it holds"
    assert last.startswith("2 figures in ") and last.endswith("s; wrote p.html and an SVG and a CSV file each")
    facts = json.loads(papilla("figures", "--json").out)
    assert asked[2] == ("", 3) and asked[3][0] == Path("figures") and facts["page"] == "p.html"
    assert facts["figures"][0] == {
        "paper": "2007", "name": "fig. 3", "title": "A title", "found": "it holds", "claims": ["A1", "A2"],
        "svg": "here/f3.svg", "csv": "here/f3.csv",
    }  # fmt: skip
    (tmp_path / "file").write_text("")
    assert "cannot write to folder file" in refused("figures", "--paper", "2007", "--out", "file")


def test_designs_are_compared_with_the_options_that_are_stated(papilla, refused, monkeypatch, tmp_path):
    from papilla.identification import comparison

    asked = []
    row = SimpleNamespace(
        name="a", sigma=0.1234, identified=0.756, sd_microstrain=12345.6, slope=0.1234, gauges=5, answer_us=12.6,
        press_ms=3.456, to_json=lambda: {"name": "a"},
    )  # fmt: skip
    other = SimpleNamespace(**vars(row) | {"name": "b", "press_ms": None})
    made = SimpleNamespace(
        rows=[row, other], verdicts=["a is better"], force_N=[0.1, 0.5, 0.9], modulus_MPa=[0.02, 5.0]
    )
    found = SimpleNamespace(finger=Finger.default())
    monkeypatch.setattr(comparison, "candidate", lambda name, **how: asked.append((name, how)) or found)
    monkeypatch.setattr(comparison, "compare", lambda given, say: asked.append(given) or made)
    monkeypatch.setattr(comparison, "write_comparison", lambda path, *given: asked.append((path, given)))
    monkeypatch.setattr(comparison, "write_comparison_table", lambda path, *given: asked.append((path, given)))
    answer = papilla("compare", "default", "published", "--friction", "stick", "--html", "c.html", "--csv", "c.csv")
    assert [name for name, _ in asked[:2]] == ["default", "published"] and asked[2] == [found, found]
    assert (asked[0][1]["friction"], asked[0][1]["processes"]) == ("stick", PROCESSES)
    assert asked[3:] == [(Path("c.html"), (made, [found, found])), (Path("c.csv"), (made,))]
    said = " ".join("".join(" " if sign in "│└─┴┘" else sign for sign in answer.out).split())
    assert "a 12.3% 76% 12,346 0.12 5 13 3.5 b 12.3% 76% 12,346 0.12 5 13 a is better" in said
    assert answer.out.endswith("a is better\nWrote c.html, c.csv\n")
    asked.clear()
    answer = papilla("compare", "default", "published", "--json")
    facts = json.loads(answer.out)
    assert asked[0][1]["friction"] is None and len(asked) == 3 and (facts["html"], facts["csv"]) == (None, None)
    assert facts["domain"] == {"force_N": [0.1, 0.9], "modulus_MPa": [0.02, 5.0]} and facts["rows"][1] == {"name": "a"}
    assert "Wrote" not in papilla("compare", "default", "published").out
    (tmp_path / "file").write_text("")
    assert "cannot write to folder file" in refused("compare", "default", "published", "--csv", "file/c.csv")
