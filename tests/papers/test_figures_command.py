"""`papilla figures`: its files, its JSON, and what it refuses."""

import json
from pathlib import Path

import pytest


def test_a_name_that_no_paper_has_is_refused(refused):
    assert refused("figures", "--paper", "2o07").endswith("did you mean 2007?")


@pytest.mark.slow
def test_a_paper_is_written(papilla, tmp_path):
    done = papilla("figures", "--paper", "2007", "--json", "--out", "here")
    assert done.code == 0, done.err
    answer = json.loads(done.out)
    assert [one["name"] for one in answer["figures"]] == ["fig. 3", "fig. 5"]
    assert {Path(one[kind]).name for one in answer["figures"] for kind in ("svg", "csv")} | {"figures.html"} == {
        path.name for path in (tmp_path / "here").iterdir()
    }
    text = Path(answer["page"]).read_text()
    assert all(one["title"] in text and one["found"] in text for one in answer["figures"])
    again = papilla("figures", "--paper", "2007", "--out", "here")
    assert again.code == 0 and "2 figures" in again.out
