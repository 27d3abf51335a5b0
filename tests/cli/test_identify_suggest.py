"""`papilla identify --suggest`: a protocol from nothing, and what does not go with it."""

import json

import pytest

from papilla.identification import posing
from papilla.identification.suggest import FORCES_N


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    monkeypatch.setattr(posing, "SIZE_MM", 2.8)


@pytest.mark.slow
def test_a_protocol_from_nothing(papilla):
    answer = papilla("identify", "--suggest", 3, "--moduli", "0.089,0.72", "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    assert len(found["suggested"]) == 3 and found["criterion"] == "I"
    assert {one["modulus_MPa"] for one in found["suggested"]} <= {0.089, 0.72}
    assert {one["force_N"] for one in found["suggested"]} <= set(FORCES_N)
    assert found["expected_sigma_ln_E"]["after"] < found["expected_sigma_ln_E"]["before"]
    told = papilla("identify", "--suggest", 3, "--moduli", "0.089,0.72").out
    assert "Press next, at the apex:" in told and "20-100 gf" in told


@pytest.mark.slow
def test_what_to_press_after_a_log(papilla, tmp_path):
    log = tmp_path / "log.csv"
    rows = ["force_N,modulus_MPa,g1,g2,g3,g4,g5"]
    rows += [
        f"{f},{E},{-900 * f},{-4000 * f},{9000 * f**0.9},{-4100 * f},{-950 * f}" for f in (0.2, 0.5) for E in (0.1, 0.5)
    ]
    log.write_text("\n".join(rows) + "\n")
    answer = papilla("identify", log, "--suggest", 2, "--criterion", "D", "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    assert {one["modulus_MPa"] for one in found["suggested"]} <= {0.1, 0.5} and found["criterion"] == "D"
    assert "finger" not in found and sorted(tmp_path.iterdir()) == [log]


@pytest.mark.parametrize(
    "arguments, said",
    [
        ([], "Missing argument 'LOG.csv'"),
        (["--suggest", 3], "needs --moduli"),
        (["--suggest", 0, "--moduli", "0.1"], "must be at least 1, got 0"),
        (["--suggest", 3, "--moduli", "0.1,soft"], "--moduli must be numbers in MPa with commas, got 'soft'"),
        (["--suggest", 3, "--moduli", "0.1,-2"], "--moduli (MPa) must be greater than 0"),
        (["--suggest", 3, "--moduli", "0.1", "--out", "f.toml"], "--out needs a log of presses"),
        (["log.csv", "--out", "f.toml", "--moduli", "0.1"], "--moduli goes with --suggest"),
        (["log.csv"], "Missing option '--out'"),
    ],
)
def test_what_is_refused(refused, arguments, said):
    assert said in refused("identify", *arguments)
