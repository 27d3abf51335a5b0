"""`papilla compare`: what it prints and writes, and what it refuses."""

import json
from types import SimpleNamespace

import pytest
from spring_calibration import calibration


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
    told = papilla("compare", "a.json", "b.json").out
    assert all(sentence.split(" (")[0] in told for sentence in facts["verdicts"])


def test_bad_input_is_one_line(refused, files):
    assert "at least two" in refused("compare", "a.json")
    assert "would overwrite the input a.json" in refused("compare", "a.json", "b.json", "--csv", "a.json")
    assert "cannot read" in refused("compare", "a.json", "none.json")


@pytest.mark.slow
def test_designs_bring_receptive_fields_and_the_price_of_a_press(papilla, monkeypatch):
    from papilla.identification import comparison

    made = {"human-finger-mimetic sensor": calibration((0.02, 5.0))}
    calibrated = lambda finger, **_: SimpleNamespace(calibration=made.get(finger.name, calibration((0.1, 1.0))))  # noqa: E731
    monkeypatch.setattr(comparison, "calibrate", calibrated)
    facts = json.loads(papilla("compare", "default", "published", "--json").out)
    assert [len(row["reach"]) for row in facts["rows"]] == [5, 5]
    assert all(row["press_ms"] > 0 and row["reach"][2]["x_mm"] == 0 for row in facts["rows"])
    assert facts["domain"]["modulus_MPa"][0] > 0.1 and "a smaller one is finer" in facts["verdicts"][-1]
