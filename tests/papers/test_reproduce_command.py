"""`papilla reproduce`: its JSON, its page, and what it refuses."""

import json

import pytest


@pytest.mark.slow
def test_json_has_the_documented_keys(papilla, tmp_path):
    done = papilla("reproduce", "--only", "C22", "--json", "--out", "pages")
    assert done.code == 0, done.err
    (claim,) = json.loads(done.out)["claims"]
    assert {"source", "claim", "published", "measured", "unit", "verdict", "note"} <= set(claim)
    assert {"evidence", "contradiction", "tolerance", "test", "noise", "seeds"} <= set(claim)
    assert claim["verdict"] == "reproduced" and abs(claim["measured"] - 31.25) < 0.01
    assert (tmp_path / "pages" / "reproduce.html").read_text().count('id="C22"') == 1


@pytest.mark.slow
def test_the_table_has_notes_where_there_are_few_rows(papilla):
    done = papilla("reproduce", "--only", "X2")
    assert done.code == 0 and "accepted" in done.out and "not reproduced" in done.out


def test_text_that_no_claim_holds_is_refused(refused):
    assert "perpetual motion" in refused("reproduce", "--only", "perpetual motion")
