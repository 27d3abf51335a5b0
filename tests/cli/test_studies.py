"""`papilla verify`, `reproduce`, `figures`: cases and claims by name, exit codes, files, and what is refused."""

import json

import pytest


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
