"""`papilla reproduce`: verdicts come from tolerances, claims share experiments, and what cannot be tested says why."""

import json
import math
import re
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from scipy.stats import binomtest

from papilla.core.errors import InputError, MissingExtraError, SolverError
from papilla_papers import claims as room
from papilla_papers.claims import ALL_CLAIMS, ALL_EXPERIMENTS, Answer, Claim, Experiment, reproduce
from papilla_papers.claims.claim import EVIDENCE_KINDS, accepted, beside, gathered, published
from papilla_papers.claims.page import write_page
from papilla_papers.claims.runner import by_evidence, head, results, summary
from papilla_papers.claims.scenes import SettingsTable, by_factors, even, scenes

TABLE = {"experiment": "toy", "source": "a paper", "claim": "twice two", "published": 4.0, "unit": "-"}
TABLE |= {"finding": "four", "call": "2 * 2", "note": "{four} it is, {simulated}", "evidence": "simulated"}
TESTS, ROOM = Path(__file__).parents[1], Path(room.__file__).parent
NAMED = {experiment.name: experiment for experiment in ALL_EXPERIMENTS}


def claim(key="T1", **fields) -> Claim:
    return Claim.from_table(key, "paper", {**TABLE, "accepted": {"by": 0.1}, **fields})


def toy(run=lambda tell: {"four": 4.0}, name="toy") -> Experiment:
    return Experiment(name, run, "by hand")


def ask(*claims, only="", run=lambda tell: {"four": 4.0}, **how):
    return reproduce(only, claims=claims or [claim()], experiments=[toy(run)], **how)


@pytest.mark.parametrize(
    "interval, within, outside, words",
    [
        ({"by": 0.1}, 4.1, 4.11, "3.9 to 4.1"), ({"percent": 10.0}, 3.6, 3.59, "3.6 to 4.4"), ({}, 4.0, 4.001, "4"),
        ({"near": 5.0, "by": 0.5}, 4.6, 4.4, "4.5 to 5.5"), ({"most": -5.0}, -5.01, -4.99, "≤ −5"),
        ({"least": 5.0}, 5.0, math.nan, "≥ 5"),
    ],
)  # fmt: skip
def test_the_verdict_is_that_of_the_tolerance(interval, within, outside, words):
    for measured, verdict in ((within, "reproduced"), (outside, "not reproduced")):
        answer = Answer.of(claim(accepted=interval), toy(), {"four": measured})
        assert answer.verdict == verdict and accepted(answer) == words and published(answer) == "4"
    assert published(Answer.of(claim(published=[1.0, 2.5]), toy(), {"four": 4.0})) == "1–2.5"
    for share, verdict in ((1.0, "reproduced"), (0.99, "not reproduced")):
        assert Answer.of(claim(published="a rule", accepted={}), toy(), {"four": share}).verdict == verdict


def test_claims_of_an_experiment_share_one_run_and_a_note_tells_what_was_found():
    runs, lines = [], []

    def run(tell):
        runs.append(1)
        tell("summing")
        return {"four": 4.0, "four_alone": 4.5}

    contradicted = claim("T2", accepted={"least": 5.0}, contradiction=True, evidence="fitted")
    first, second = answers = ask(claim(), contradicted, run=run, progress=lines.append)
    assert (first.measured, first.verdict, first.note) == (4.0, "reproduced", "4.0 it is, by hand")
    assert second.verdict == "not reproduced" and second.to_json()["accepted"] == [5.0, None]
    assert len(runs) == 1 and [(str(line), line.done, line.total) for line in lines] == [
        ("toy", 0, 1), ("toy: summing", 0, 1)
    ]  # fmt: skip
    assert (first.left_out, second.left_out, beside(second)) == (None, 4.5, "left out of the fit: 4.5 -")
    assert by_evidence(answers) == {"predicted": 0, "simulated": 1, "fitted": 0, "implemented": 0}
    words = "2 claims: 1 reproduced (0 predicted, 1 simulated, 0 fitted, 0 implemented), 1 not reproduced"
    assert head(answers).startswith(words) and "in 1 of all rows the print contradicts" in head(answers)


def raising(error):
    def run(tell):
        raise error

    return run


@pytest.mark.parametrize(
    "fields, run, why",
    [
        ({"cannot": "needs people"}, raising(AssertionError("must not run")), "needs people"),
        ({}, raising(SolverError("diverged")), "diverged"),
        ({}, raising(MissingExtraError("get it")), "get it"),
        ({}, lambda tell: {"four": "too fine for the mesh"}, "too fine for the mesh"),
        ({"finding": "five"}, lambda tell: {"four": 4.0}, "no five was found"),
    ],
)
def test_what_cannot_be_tested_says_why(fields, run, why):
    (answer,) = ask(claim(**fields), run=run)
    assert answer.verdict == "not testable here" and why in answer.note and answer.measured is None


def test_a_part_that_ends_in_an_error_takes_its_own_rows_alone():
    run = lambda tell: gathered(lambda: raising(SolverError("diverged"))(tell), lambda: {"four": 4.0})  # noqa: E731
    answered, lost = ask(claim(), claim("T2", finding="five", note="{six:.1f}"), run=run)
    assert answered.verdict == "reproduced"
    assert lost.verdict == "not testable here" and "diverged" in lost.note and lost.measured is None


def test_only_takes_keys_and_words_and_refuses_what_no_claim_holds():
    both = claim(), claim("T10", claim="three times two")
    for only, keys in (("TWICE", ["T1"]), ("t1", ["T1"]), ("toy", ["T1", "T10"])):
        assert [answer.claim.key for answer in ask(*both, only=only)] == keys
    with pytest.raises(InputError, match="no claim holds 'four times': .* one of toy"):
        ask(*both, only="four times")


def test_the_registry_is_whole():
    assert {claim.experiment for claim in ALL_CLAIMS} == set(NAMED) == {*scenes()} - {"signals"}
    assert len(NAMED) == len(ALL_EXPERIMENTS) and all(experiment.methods for experiment in ALL_EXPERIMENTS)
    for claim in ALL_CLAIMS:
        assert claim.accepted[0] <= claim.accepted[1] and claim.source and claim.claim, claim.key
        assert claim.cannot or (claim.finding and claim.call), claim.key
        assert claim.evidence in EVIDENCE_KINDS and (claim.evidence == "none") == bool(claim.cannot), claim.key
        assert claim.tolerance or claim.evidence in ("implemented", "none"), claim.key
        assert (claim.evidence == "implemented") == bool(claim.test), claim.key
        for name, values in claim.vary.items():
            assert getattr(NAMED[claim.experiment].assumed, name) not in values, f"{claim.key}: {name} is assumed"
        assert not claim.vary or claim.finding in NAMED[claim.experiment].varied, claim.key


def test_an_implemented_claim_names_a_test_that_exists():
    named = {claim.test for claim in ALL_CLAIMS if claim.test}
    sources = {file: TESTS / file for file, _ in (test.split("::") for test in named)}
    text = {file: path.read_text(encoding="utf-8") if path.exists() else "" for file, path in sources.items()}
    assert [test for test in sorted(named) if f"def {test.split('::')[1]}(" not in text[test.split("::")[0]]] == []


@dataclass(frozen=True)
class Edge:
    """What a toy experiment assumes."""

    edge_mm: float = 1.0


def fours(assumed: Edge) -> dict:
    if assumed.edge_mm > 5:
        raise SolverError("diverged")
    return {"four": 4.0 * assumed.edge_mm, "words": "not kept"}


fours.__module__ = "papilla.verify.case"  # Whose code is part of the key under which its numbers are kept


@pytest.mark.parametrize("missed", [True, False])
def test_a_row_that_is_not_reproduced_is_computed_with_other_values(missed):
    row = claim(accepted={"near": 8.0 if missed else 4.0, "by": 0.1}, vary={"edge_mm": [2.0, 3.0, 9.0]}, unit="mm")
    (answer,) = reproduce(claims=[row], experiments=[replace(toy(), assumed=Edge(), varied={"four": fours})])
    if not missed:
        assert answer.sensitivity == () and beside(answer) == ""
        return
    ends = [(2.0, 8.0, "reproduced"), (3.0, 12.0, "not reproduced"), (9.0, None, "not testable here")]
    assert [(part.value, part.measured, part.verdict) for part in answer.sensitivity] == ends
    assert beside(answer) == "with other values: edge 2 mm: 8, reproduced; edge 3 mm: 12; edge 9 mm: –"
    assert answer.to_json()["sensitivity"][0]["parameter"] == "edge_mm"
    assert "none reproduces it" in beside(replace(answer, sensitivity=answer.sensitivity[1:]))
    assert beside(replace(answer, sensitivity=(), claim=replace(row, fixed="no value decides"))) == "no value decides"


def test_nine_of_ten_answers_are_significant_and_eight_are_not():
    assert binomtest(9, 10).pvalue < 0.05 < binomtest(8, 10).pvalue


def test_the_page_is_self_contained_and_has_every_row(tmp_path):
    experiments = [toy(), toy(name="other")]
    found = results(experiments=experiments, claims=[claim(), replace(claim(), experiment="other")])
    write_page(tmp_path / "reproduce.html", found, 1.0)
    text = (tmp_path / "reproduce.html").read_text()
    assert text.count('id="T1"') == 2 and "http" not in text.replace("http-equiv", "") and "<script" not in text
    assert summary([answer for result in found for answer in result.answers])["reproduced"] == 2


def test_every_value_of_a_scene_is_read():
    """Tables whose keys are names, which the code need not know, are left out."""
    named = {"yarns_per_inch", "receptors_Hz", "more_grids", "snr_dB", "about", "weaves_mm"}
    words = {
        word for path in ROOM.parent.rglob("*.py") for word in re.findall(r"\w+", path.read_text(encoding="utf-8"))
    }

    def keys(table: SettingsTable):
        for name, value in table.items():
            yield name
            if isinstance(value, SettingsTable) and name not in named:
                yield from keys(value)

    assert {key for table in scenes().values() for key in keys(table)} <= words


def test_spaced_values_include_both_ends():
    ends = SettingsTable({"from": 1.0, "to": 4.0, "count": 3})
    assert even(ends).tolist() == [1.0, 2.5, 4.0] and by_factors(ends) == pytest.approx([1.0, 2.0, 4.0])


# ---- The command


@pytest.mark.slow
def test_the_command_writes_its_rows(papilla, tmp_path):
    done = papilla("reproduce", "--only", "C22", "--json", "--out", "pages")
    (row,) = json.loads(done.out)["claims"]
    assert row["verdict"] == "reproduced" and abs(row["measured"] - 31.25) < 0.01
    assert (tmp_path / "pages" / "reproduce.html").read_text().count('id="C22"') == 1
    assert "not reproduced" in papilla("reproduce", "--only", "X2").out


def test_yarns_an_inch_agree_with_the_printed_weights():
    """Mass of an area: yarns over their count (Ne, 590.5 tex over it); three of four within a tenth if per inch."""
    printed = {(95, 64, 16, 16): 244, (65, 100, 40, 32): 208, (175, 108, 40, 40): 175, (78, 59, 12, 8): 341}
    ratios = [(a / m + b / n) * 590.5 / 25.4 / grams for (a, b, m, n), grams in printed.items()]
    assert sum(abs(ratio - 1) < 0.1 for ratio in ratios) == 3
    assert all(0.254 * ratio < 0.3 for ratio in ratios), "and none per 10 cm"
