"""`papilla verify`, `reproduce`, `figures`: cases and claims by name, exit codes, files, and what is refused."""

import json

import pytest

from papilla.cli.verify import answer_of
from papilla.verify import Case


def test_a_case_outside_its_bound_is_an_exit_code_and_a_word(capsys):
    cases = [Case("small", "a share", 1e-4, 1e-3, 2.0), Case("large", "a length", 0.5, 0.1, 3.0)]
    verdicts = [answer_of(some, ["left out"]) for some in (cases[:1], cases)]
    assert [(verdict.code, verdict.facts["passed"]) for verdict in verdicts] == [(0, True), (1, False)]
    assert verdicts[1].facts["skipped"] == ["left out"]
    assert [[case[key] for key in ("name", "error", "bound", "passed")] for case in verdicts[1].facts["cases"]] == [
        ["small", 1e-4, 1e-3, True], ["large", 0.5, 0.1, False]
    ]  # fmt: skip
    verdicts[1].show()
    said = capsys.readouterr().out.splitlines()
    assert said[-1] == "2 cases, 1 outside their bounds, 5 s"
    for line, words in ((said[-4], "small a share 1.0e-04 1e-03 ok 2.0"), (said[-3], "large a length 5.0e-01 1e-01")):
        assert words in " ".join(line.replace("│", " ").split())
    assert "MISSED" in said[-3] and "MISSED" not in said[-4]


@pytest.mark.slow
def test_cases_of_one_family_have_errors_bounds_and_a_verdict(papilla):
    answer = papilla("verify", "--only", "hertz", "--json")
    facts = json.loads(answer.out)
    assert facts["passed"] == (answer.code == 0) == all(case["error"] <= case["bound"] for case in facts["cases"])
    assert all(case["name"].startswith("hertz: ") and case["seconds"] >= 0 for case in facts["cases"])
    table = papilla("verify", "--only", "hertz").out
    assert table.splitlines()[-1].startswith(f"{len(facts['cases'])} cases, 0 outside their bounds, ")


@pytest.mark.slow
def test_a_claim_has_its_verdict_in_words_json_and_page(papilla, tmp_path):
    answer = papilla("reproduce", "--only", "X2", "--out", "here", "--json")
    assert answer.code == 0, answer.err
    facts = json.loads(answer.out)
    (claim,) = facts["claims"]
    assert claim["key"] == "X2" and facts["counts"][claim["verdict"]] == sum(facts["counts"].values()) == 1
    assert facts["page"] == "here/reproduce.html" and claim["claim"] in (tmp_path / facts["page"]).read_text()
    said = papilla("reproduce", "--only", "X2").out
    assert claim["verdict"] in said and "1 claims: " in said and "Wrote" not in said
