"""`papilla compare`: what it prints and writes, and what it refuses."""

import json

import numpy as np
import pytest
from spring_calibration import FORCE, calibration


@pytest.fixture
def files(tmp_path):
    for name, moduli in (("a.json", (0.02, 5.0)), ("b.json", (0.1, 1.0))):
        calibration(moduli).save(tmp_path / name)


def test_two_calibrations_are_compared(papilla, tmp_path, files):
    answer = papilla("compare", "a.json", "b.json", "--html", "c.html", "--csv", "c.csv", "--json")
    assert answer.code == 0, answer.err
    facts = json.loads(answer.out)
    assert [row["name"] for row in facts["rows"]] == ["a.json", "b.json"] and facts["rows"][0]["press_ms"] is None
    assert facts["html"] == "c.html" and (tmp_path / "c.html").stat().st_size > 10_000
    assert any("are alike" in sentence for sentence in facts["verdicts"])
    for ends, covered in ((facts["domain"]["modulus_MPa"], (0.1, 1.0)), (facts["domain"]["force_N"], FORCE)):
        assert covered[0] <= ends[0] < ends[1] <= covered[1] and np.prod(ends) == pytest.approx(np.prod(covered))
    table = (tmp_path / "c.csv").read_text().splitlines()
    assert len(table) == 3 and facts["csv"] == "c.csv" and facts["rows"][0]["name"] in table[1]
    answer = papilla("compare", "a.json", "b.json", "--csv", "d.csv")
    told = answer.out
    assert told.splitlines()[-1] == "Wrote d.csv"
    for row in facts["rows"]:
        line = next(line for line in told.splitlines() if row["name"] in line)
        assert f"{row['sd_microstrain']:,.0f}" in line and f"{row['sigma']:.1%}" in line
    assert all(sentence.split(" (")[0] in told for sentence in facts["verdicts"])


def test_bad_input_is_one_line(refused, files):
    assert "at least two" in refused("compare", "a.json")
    assert "would overwrite the input a.json" in refused("compare", "a.json", "b.json", "--csv", "a.json")
    assert "cannot read" in refused("compare", "a.json", "none.json")
