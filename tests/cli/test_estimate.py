"""`papilla estimate`: one row of answers per row of the log, and honest words where there is none."""

import csv
import json

import numpy as np
import pytest

from papilla.calibrate import fit_bench
from papilla.logs import BenchLog, white_noise, write_table

COLUMNS = "t_s modulus_MPa modulus_sigma_MPa frequency_Hz wavelength_mm wavelength_sigma_mm mu_kinetic mu_static status"
PATTERN = np.array([-0.4, -0.8, 1.5, -0.8, -0.4])


def readings(force, modulus):
    """(n, 5) readings of a finger that follows a smooth law."""
    return np.multiply.outer(2000 * np.asarray(force) ** 0.7 * modulus**0.15, PATTERN)


@pytest.fixture
def calibrated(tmp_path):
    """A calibration file of the smooth law."""
    force = np.tile(np.geomspace(0.05, 1, 20), 5)
    modulus = np.repeat([0.05, 0.1, 0.2, 0.5, 1.0], 20)
    rows = np.vstack([readings(f, m) for f, m in zip(force, modulus, strict=True)])
    fit_bench(BenchLog(force, modulus, rows, ("g1", "g2", "g3", "g4", "g5"))).save(tmp_path / "c.json")
    return "c.json"


@pytest.fixture
def log(tmp_path):
    """A second of pressing to 0.6 N on 0.3 MPa, with noise, a missing cell and a gap."""
    rng = np.random.default_rng(8)
    t = np.arange(1000) / 1000
    force = np.interp(t, [0, 0.1, 0.4, 1.0], [0, 0, 0.6, 0.6])
    values = readings(force, 0.3) + rng.normal(0, 2, (1000, 5))
    values[700, 2] = np.nan
    t[900:] += 0.05
    gauges = {f"g{number}": column for number, column in enumerate(values.T, start=1)}
    write_table(tmp_path / "log.csv", {"t_s": t, **gauges, "force_N": force + rng.normal(0, 5e-4, 1000)})
    return "log.csv"


def rows_of(path):
    with open(path, newline="") as stream:
        return list(csv.DictReader(stream))


def test_one_row_of_answers_per_row(papilla, tmp_path, log, calibrated):
    answer = papilla("estimate", log, "--calibration", calibrated, "--out", "est.csv", "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    rows = rows_of(tmp_path / "est.csv")
    assert list(rows[0]) == COLUMNS.split()
    assert len(rows) == found["rows"] == 1000
    assert rows[0]["status"] == "no contact" and rows[0]["modulus_MPa"] == ""
    assert rows[700]["status"].startswith("bad gauge") and rows[700]["modulus_MPa"] == ""
    assert rows[-1]["status"] == "ok"
    modulus, sigma = float(rows[-1]["modulus_MPa"]), float(rows[-1]["modulus_sigma_MPa"])
    assert abs(modulus - 0.3) < 4 * sigma < 0.1
    assert found["last_answer"] == {"t_s": pytest.approx(1.049), "modulus_MPa": modulus, "modulus_sigma_MPa": sigma}
    assert sum(found["status"].values()) == 1000
    assert (found["nan_rows"], found["nan_cells"], found["gaps"], found["duplicates"]) == (1, 1, 1, 0)
    assert found["gauge_noise_microstrain"] == pytest.approx(2, rel=0.2)
    assert found["force_noise_N"] == pytest.approx(5e-4, rel=0.2)
    assert all(row[name] == "" for row in rows for name in COLUMNS.split()[3:8]), "no estimator, no value"
    assert "frequency_Hz" in answer.err


def test_table_for_people(papilla, log, calibrated):
    answer = papilla("estimate", log, "--calibration", calibrated, "--out", "est.csv")
    assert answer.code == 0
    for text in ("no contact", "gaps", "noise of a gauge", "modulus at 1.049 s", "Wrote est.csv"):
        assert text in answer.out


def test_without_calibration_or_force_the_status_says_so(papilla, tmp_path, log, calibrated):
    assert papilla("estimate", log, "--out", "est.csv").code == 0
    assert {row["status"] for row in rows_of(tmp_path / "est.csv")} == {"no modulus: no calibration was given"}
    write_table(tmp_path / "bare.csv", {"t_s": [0.0, 0.1], **{f"g{i}": [1.0, 2.0] for i in range(1, 6)}})
    assert papilla("estimate", "bare.csv", "--calibration", calibrated, "--out", "est.csv").code == 0
    rows = rows_of(tmp_path / "est.csv")
    assert [row["status"] for row in rows] == ["no modulus: the log has no column force_N"] * 2
    assert [row["modulus_MPa"] for row in rows] == ["", ""]


@pytest.mark.parametrize(
    "options, message",
    [
        (["nowhere.csv"], "cannot read nowhere.csv"),
        (["log.csv", "--calibration", "nowhere.json"], "cannot read calibration nowhere.json"),
        (["log.csv", "--calibration", "cut.json"], "cut.json is not a calibration, or was cut short"),
        (["log.csv", "--calibration", "other.json"], "other.json: the schema is 'papilla.calibration/9'"),
        (["two.csv", "--calibration", "c.json"], "two.csv has 2 gauges, the calibration c.json was made for 5"),
        (["unsorted.csv"], "unsorted.csv, line 3, column t_s: time goes back from 1 to 0 s"),
    ],
)
def test_unusable_input(refused, tmp_path, log, calibrated, options, message):
    text = (tmp_path / calibrated).read_text()
    (tmp_path / "cut.json").write_text(text[: len(text) // 2])
    (tmp_path / "other.json").write_text(text.replace("papilla.calibration/1", "papilla.calibration/9"))
    write_table(tmp_path / "two.csv", {"t_s": [0.0, 1.0], "g1": [1.0, 1.0], "g2": [1.0, 1.0], "force_N": [1.0, 1.0]})
    write_table(tmp_path / "unsorted.csv", {"t_s": [1.0, 0.0], "g1": [1.0, 1.0]})
    assert message in refused("estimate", *options, "--out", "est.csv")


def test_unwritable_output(refused, log):
    assert "cannot write to folder log.csv" in refused("estimate", log, "--out", "log.csv/est.csv")


def test_noise_is_told_from_a_ramp():
    rng = np.random.default_rng(2)
    assert white_noise(np.linspace(0, 1e4, 5000) + rng.normal(0, 3, 5000)) == pytest.approx(3, rel=0.05)
    assert white_noise(np.arange(10.0)) == pytest.approx(0, abs=1e-12)
    assert np.isnan(white_noise([1.0, 2.0]))
