"""`papilla reproduce`: verdicts come from tolerances, claims share experiments, and what cannot be tested says why."""

import math
from dataclasses import replace

import pytest

from papilla.errors import InputError, MissingExtraError, SolverError
from papilla.studies.reproduce import CLAIMS, EXPERIMENTS, Answer, Claim, Experiment, Found, Series, Verdict, reproduce
from papilla.studies.reproduce.claim import above, below, near
from papilla.studies.reproduce.page import write_page
from papilla.studies.reproduce.runner import results, summary

CLAIM = Claim("T1", "a paper", "twice two", 4.0, near(4.0, by=0.1), "-", "four", "2 * 2", "{four} it is")


def toy(*claims: Claim, run=lambda tell: Found({"four": 4.0})) -> Experiment:
    return Experiment("toy", "a sum", claims or (CLAIM,), run)


@pytest.mark.parametrize(
    "accepted, measured, verdict",
    [
        (near(4.0, by=0.1), 4.1, Verdict.REPRODUCED),
        (near(4.0, by=0.1), 4.11, Verdict.NOT_REPRODUCED),
        (near(4.0, percent=10), 3.6, Verdict.REPRODUCED),
        (near(4.0, percent=10), 3.59, Verdict.NOT_REPRODUCED),
        (above(5.0), 4.99, Verdict.NOT_REPRODUCED),
        (below(5.0), 4.99, Verdict.REPRODUCED),
        (above(0.0), math.nan, Verdict.NOT_REPRODUCED),
    ],
)
def test_the_verdict_is_that_of_the_tolerance(accepted, measured, verdict):
    answer = Answer.of(replace(CLAIM, accepted=accepted), "toy", {"four": measured})
    assert answer.verdict == verdict


def test_the_note_tells_what_was_found():
    (answer,) = reproduce(experiments=[toy()])
    assert (answer.measured, answer.verdict, answer.note) == (4.0, Verdict.REPRODUCED, "4.0 it is")
    assert {"source", "claim", "published", "measured", "unit", "verdict", "note"} <= set(answer.to_json())


def test_claims_of_an_experiment_share_one_run():
    runs = []

    def run(tell):
        runs.append(1)
        tell("summing")
        return Found({"four": 4.0})

    told = []
    other = replace(CLAIM, key="T2", accepted=above(5))
    found = reproduce(experiments=[toy(CLAIM, other, run=run)], progress=lambda *line: told.append(line))
    assert [answer.verdict for answer in found] == [Verdict.REPRODUCED, Verdict.NOT_REPRODUCED]
    assert len(runs) == 1 and told == [("toy", 0, 1), ("toy: summing", 0, 1)]


def test_a_claim_waits_for_a_module_and_turns_when_it_is_there():
    waiting = replace(CLAIM, needs="papilla.of_the_future.module")
    (answer,) = reproduce(experiments=[toy(waiting)])
    assert (answer.verdict, answer.measured) == (Verdict.NOT_TESTABLE, None)
    assert "waits for papilla.of_the_future.module" in answer.note
    (answer,) = reproduce(experiments=[toy(replace(waiting, needs="papilla.units"))])
    assert answer.verdict == Verdict.REPRODUCED


def test_what_cannot_be_tested_says_why_and_runs_nothing():
    def run(tell):
        raise AssertionError("must not run")

    people = replace(CLAIM, cannot="needs people")
    (answer,) = reproduce(experiments=[toy(people, run=run)])
    assert answer.verdict == Verdict.NOT_TESTABLE and "needs people" in answer.note


@pytest.mark.parametrize("error", [SolverError("diverged"), MissingExtraError("get it")])
def test_an_experiment_that_ends_in_an_error_says_so(error):
    def run(tell):
        raise error

    (answer,) = reproduce(experiments=[toy(run=run)])
    assert answer.verdict == Verdict.NOT_TESTABLE and str(error) in answer.note and answer.measured is None


def test_a_finding_that_is_a_sentence_says_why_there_is_no_number():
    (answer,) = reproduce(experiments=[toy(run=lambda tell: Found({"four": "too fine for the mesh"}))])
    assert answer.verdict == Verdict.NOT_TESTABLE and "too fine for the mesh" in answer.note


def test_only_takes_keys_and_words_and_refuses_what_no_claim_holds():
    claims = toy(CLAIM, replace(CLAIM, key="T10", claim="three times two"))
    assert [a.claim.key for a in reproduce("TWICE", experiments=[claims])] == ["T1"]
    assert [a.claim.key for a in reproduce("t1", experiments=[claims])] == ["T1"]
    assert len(reproduce("toy", experiments=[claims])) == 2
    with pytest.raises(InputError, match="no claim holds 'four times': .* one of toy"):
        reproduce("four times", experiments=[claims])


def test_the_registry_is_whole():
    keys = [claim.key for claim in CLAIMS]
    assert len(set(keys)) == len(keys)
    assert len({experiment.name for experiment in EXPERIMENTS}) == len(EXPERIMENTS)
    for claim in CLAIMS:
        low, high = claim.accepted
        assert low <= high, claim.key
        assert claim.source and claim.claim, claim.key
        assert claim.cannot or (claim.value and claim.call), claim.key
        if isinstance(claim.published, float) and not claim.cannot and claim.unit == "":
            assert math.isfinite(claim.published), claim.key


def test_the_page_is_self_contained_and_has_every_row(tmp_path):
    curve = Found({"four": 4.0}, "a line", "x", "y", (Series("one", [1, 2], [1, 4]), Series("two", [1, 2], [2, 1])))
    bars = Found({"four": 4.0}, "bars", "", "y", (Series("one", ["a", "b"], [1, 4], "bars"),))
    found = results(experiments=[toy(run=lambda tell: curve), replace(toy(run=lambda tell: bars), name="other")])
    write_page(tmp_path / "reproduce.html", found, 1.0)
    text = (tmp_path / "reproduce.html").read_text()
    assert text.count('id="T1"') == 2 and text.count("data:image/svg+xml;base64,") == 2
    assert "http" not in text.replace("http-equiv", "") and "<script" not in text
    assert summary([answer for result in found for answer in result.answers])["reproduced"] == 2


@pytest.mark.slow
@pytest.mark.parametrize("name", ["impulses", "counts", "spectra"])
def test_a_quick_experiment_answers_all_its_claims_the_same_every_time(name):
    first, second = reproduce(name), reproduce(name)
    assert len(first) > 3 and [a.to_json() for a in first] == [a.to_json() for a in second]
    assert all("{" not in answer.note for answer in first)
    by_key = {answer.claim.key: answer for answer in first}
    if name == "impulses":
        assert by_key["X2"].verdict == Verdict.NOT_REPRODUCED and 1.8 < by_key["X2"].measured < 2.2
        assert by_key["A16"].measured == pytest.approx(0.05, abs=1e-3)
    if name == "spectra":
        assert by_key["C19"].measured == 32
