"""`papilla estimate`: one row of answers per row of the log, and honest words where there is none."""

import csv
import json
import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_up_sweep import make_sweep

from papilla.calibration import fit
from papilla.core.tables import write_table

COLUMNS = (
    "t_s modulus_MPa modulus_sigma_MPa frequency_Hz wavelength_mm wavelength_sigma_mm mu_kinetic mu_kinetic_sigma "
    "mu_static mu_static_sigma modulus_status wavelength_status friction_status status"
)
PATTERN = np.array([-0.4, -0.8, 1.5, -0.8, -0.4])

DATA = Path(os.environ.get("PAPILLA_DATA") or Path(__file__).parents[3] / "shared" / "data")
BOARDS = sorted((DATA / "fabricslide_board").glob("*.csv"))
TRUTH = {"2mm": (3.99, 0.01, (1, 8)), "10mm": (19.88, 0.015, (10, 40))}
"""Wavelength (mm), tolerance and range to look in, by the width of the ridges that a file is named after."""


def readings(force, modulus):
    """(n, 5) readings of a finger that follows a smooth law."""
    return np.multiply.outer(2000 * np.asarray(force) ** 0.7 * modulus**0.15, PATTERN)


@pytest.fixture
def calibrated(tmp_path):
    """A calibration file of the smooth law."""
    table = make_sweep([0.05, 0.1, 0.2, 0.5, 1.0], np.geomspace(0.05, 1, 20))
    rows = readings(table.force_N, table.modulus_MPa)
    fit(replace(table, reading=rows, sd_microstrain=rows.std(axis=1))).save(tmp_path / "c.json")
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


@pytest.fixture
def sliding(tmp_path):
    """Three seconds of sliding to and fro over a grating of 1.5 mm, with every column."""
    rng = np.random.default_rng(9)
    t = np.arange(3000) / 1000
    velocity = 80 * np.sin(2 * np.pi * t)
    position = 80 / (2 * np.pi) * (1 - np.cos(2 * np.pi * t))
    force = 0.5 + 0.1 * np.sin(3 * t)
    phase = 2 * np.pi * (position[:, None] - np.array([0.0, 3.0])) / 1.5
    readings = 10 * (np.sin(phase) + 0.3 * np.sin(2 * phase)) + rng.normal(0, 1, phase.shape)
    columns = {"t_s": t, "g1": readings[:, 0], "g2": readings[:, 1], "force_N": force, "velocity_mm_s": velocity}
    columns |= {"position_mm": position, "tangential_N": 0.4 * force * np.sign(velocity) + 0.02}
    write_table(tmp_path / "slide.csv", columns)
    return "slide.csv"


def rows_of(path):
    with open(path, newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.slow
def test_one_row_of_answers_per_row(papilla, tmp_path, log, calibrated):
    answer = papilla("estimate", log, "--calibration", calibrated, "--out", "est.csv", "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    rows = rows_of(tmp_path / "est.csv")
    assert list(rows[0]) == COLUMNS.split()
    assert len(rows) == found["rows"] == 1000
    assert rows[0]["modulus_status"] == rows[0]["status"] == "no contact" and rows[0]["modulus_MPa"] == ""
    assert rows[-1]["modulus_status"] == "ok" and rows[700]["modulus_status"] == "ok, left out"
    assert rows[-1]["wavelength_status"].startswith("frequency alone")
    assert {row["friction_status"] for row in rows} == {"no column tangential_N"}
    assert found["faults"] == {"g3 missing": 1, "samples are missing before this one": 1}
    assert all(row["status"] in [row[name] for name in COLUMNS.split()[10:13]] for row in rows)
    assert json.loads((tmp_path / "est.summary.json").read_text()) == found
    for quantity in ("modulus", "wavelength", "friction"):
        codes = {row[f"{quantity}_status"] for row in rows}
        assert codes == {*found["legend"][quantity]} == {*found["statuses"][quantity]}
    modulus, sigma = float(rows[-1]["modulus_MPa"]), float(rows[-1]["modulus_sigma_MPa"])
    assert abs(modulus - 0.3) < 2 * sigma < 0.6
    assert found["last_answer"] == {"t_s": pytest.approx(1.049), "modulus_MPa": modulus, "modulus_sigma_MPa": sigma}
    assert sum(found["status"].values()) == 1000
    assert (found["nan_rows"], found["nan_cells"], found["gaps"], found["duplicates"]) == (1, 1, 1, 0)
    assert found["gauge_noise_microstrain"] == pytest.approx(2, rel=0.2)
    assert found["force_noise_N"] == pytest.approx(5e-4, rel=0.2)
    assert all(row[name] == "" for row in rows for name in COLUMNS.split()[4:10]), "no estimator, no value"
    assert "no friction: no column tangential_N, velocity_mm_s or position_mm" in found["messages"]
    assert found["lines"] == [] and found["last_wavelength"] is None and found["last_friction"] is None
    assert found["answered_rows"]["modulus_MPa"] == sum(row["modulus_MPa"] != "" for row in rows)


@pytest.mark.slow
def test_table_for_people(papilla, log, calibrated):
    answer = papilla("estimate", log, "--calibration", calibrated, "--out", "est.csv")
    assert answer.code == 0
    results, rest = answer.out.split("1000 rows at 1000 Hz, noise 2")
    modulus = next(line for line in results.splitlines() if "modulus" in line)
    assert "MPa" in modulus and " to " in modulus and "%" in modulus and "no contact" in modulus
    assert "1 gaps" in rest and "modulus, force below: force below the calibrated domain" in rest
    assert rest.splitlines()[-1] == "Wrote est.csv, and this summary in full: est.summary.json"


@pytest.mark.slow
def test_without_calibration_or_force_the_status_says_so(papilla, tmp_path, log, calibrated):
    assert papilla("estimate", log, "--out", "est.csv").code == 0
    assert all(row["modulus_status"] == "no calibration was given" for row in rows_of(tmp_path / "est.csv"))
    write_table(tmp_path / "bare.csv", {"t_s": [0.0, 0.1], **{f"g{i}": [1.0, 2.0] for i in range(1, 6)}})
    assert papilla("estimate", "bare.csv", "--calibration", calibrated, "--out", "est.csv").code == 0
    rows = rows_of(tmp_path / "est.csv")
    assert all(row["modulus_status"] == "no column force_N" for row in rows)
    assert [row["modulus_MPa"] for row in rows] == ["", ""]


@pytest.mark.slow
@pytest.mark.parametrize("told, ok", [((), True), (("--finger", "default"), False)])
def test_a_finger_with_ridges_may_feel_a_faint_lone_line_as_a_harmonic(papilla, tmp_path, told, ok):
    t = np.arange(2000) / 1000
    reading = np.sin(2 * np.pi * 126 * t / 1.2) + np.random.default_rng(1).normal(0, 1.2, 2000)
    write_table(tmp_path / "lone.csv", {"t_s": t, "g1": reading, "velocity_mm_s": np.full(2000, 126.0)})
    assert papilla("estimate", "lone.csv", "--out", "est.csv", *told).code == 0
    last = rows_of(tmp_path / "est.csv")[-1]
    assert float(last["wavelength_mm"]) == pytest.approx(1.2, rel=0.01)
    assert last["wavelength_status"].startswith("ok") == ok and (last["wavelength_status"] == "ambiguous") == (not ok)


@pytest.mark.slow
def test_answers_of_a_changed_calibration_come_with_a_remark(papilla, tmp_path, log, calibrated):
    document = json.loads((tmp_path / calibrated).read_text())
    document["softness"]["surface"]["coefficients"][2][2] += 0.1
    (tmp_path / "changed.json").write_text(json.dumps(document))
    answer = papilla("estimate", log, "--calibration", "changed.json", "--out", "est.csv", "--json")
    assert answer.code == 0
    remark = "modulus: the calibration is in doubt: the file was changed after papilla wrote it"
    assert [message for message in json.loads(answer.out)["messages"] if message.startswith(remark)]
    assert remark in answer.err and "UserWarning" not in answer.err
    codes = {row["modulus_status"] for row in rows_of(tmp_path / "est.csv") if row["modulus_status"].startswith("ok")}
    assert codes == {"ok, calibration in doubt", "ok, left out, calibration in doubt"}


@pytest.mark.slow
def test_a_slide_gives_wavelength_frequency_friction_and_its_lines(papilla, tmp_path, sliding):
    answer = papilla("estimate", sliding, "--out", "est.csv", "--wavelength-range", 0.5, 5, "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    last = rows_of(tmp_path / "est.csv")[-1]
    assert float(last["wavelength_mm"]) == pytest.approx(1.5, rel=5e-3)
    middle = rows_of(tmp_path / "est.csv")[2750]
    assert float(middle["frequency_Hz"]) == pytest.approx(80 / 1.5, rel=5e-3)
    assert float(last["mu_kinetic"]) == pytest.approx(0.4, rel=0.02)
    assert found["last_wavelength"]["wavelength_mm"] == float(last["wavelength_mm"])
    line = found["lines"][0]
    assert line["wavelength_mm"] == pytest.approx(1.5, rel=5e-3) and line["harmonic"] == 1
    assert 0 < line["wavelength_sigma_mm"] < 0.05 and line["chance"] < 1e-3
    assert line["strength"] == pytest.approx(10, rel=0.1) and line["gauges"] == ["g1", "g2"]
    strengths = [line["strength"] for line in found["lines"]]
    assert strengths == sorted(strengths, reverse=True)
    table = papilla("estimate", sliding, "--out", "est.csv").out
    for text in ("wavelength", "frequency", "kinetic friction", "static friction", "line of the log"):
        assert sum(text in line for line in table.splitlines()) >= 1


@pytest.mark.slow
def test_a_force_in_gf_is_told_by_what_the_calibration_covers(papilla, log, calibrated, tmp_path):
    columns = {
        name: [float(row[name] or "nan") for row in rows_of(tmp_path / log)] for name in rows_of(tmp_path / log)[0]
    }
    columns["force_N"] = (20 * np.array(columns["force_N"])).tolist()
    write_table(tmp_path / "gf.csv", columns)
    told = papilla("estimate", "gf.csv", "--calibration", calibrated, "--out", "est.csv")
    assert "force_N comes to 12: this looks like gf" in told.err


@pytest.mark.slow
@pytest.mark.parametrize(
    "column, factor, doubt, code",
    [
        ("t_s", 1000, "is outside the 0.4 to 6 mm of the rows: give --wavelength-range, or, if it cannot be, look", 0),
        ("velocity_mm_s", 1e-3, "no row has an answer that is ok; velocity_mm_s stays below 0.05: this looks like", 2),
    ],
)
def test_units_off_by_a_thousand_are_asked_about(papilla, tmp_path, column, factor, doubt, code):
    t = np.arange(2000) / 1000
    columns = {"t_s": t, "g1": np.sin(2 * np.pi * 50 * t / 1.5), "velocity_mm_s": np.full(2000, 50.0)}
    columns["g1"] += np.random.default_rng(3).normal(0, 0.1, 2000)
    write_table(tmp_path / "right.csv", columns)
    write_table(tmp_path / "wrong.csv", columns | {column: factor * columns[column]})
    told = {name: papilla("estimate", f"{name}.csv", "--out", f"{name}.out") for name in ("right", "wrong")}
    assert doubt in told["wrong"].err and doubt not in told["right"].err
    assert told["right"].code == 0 and told["wrong"].code == code
    assert (tmp_path / "wrong.out").exists() == (code == 0)


@pytest.mark.slow
def test_the_summary_speaks_only_of_what_rows_call_ok(papilla, tmp_path):
    """Hum alone, at a speed that changes: lines of the whole log, and no result of them."""
    t = np.arange(3000) / 1000
    reading = np.sin(2 * np.pi * 50 * t) + np.random.default_rng(3).normal(0, 0.05, 3000)
    one_way = {"force_N": np.ones(3000), "velocity_mm_s": 60 + 20 * np.sin(5 * t), "tangential_N": np.full(3000, 0.3)}
    write_table(tmp_path / "hum.csv", {"t_s": t, "g1": reading, **one_way})
    answer = papilla("estimate", "hum.csv", "--out", "est.csv", "--json")
    found = json.loads(answer.out)
    assert found["ok_rows"] == {"modulus": 0, "frequency": 0, "wavelength": 0, "friction": 0}
    assert all(found[f"last_{name}"] is None for name in ("answer", "frequency", "wavelength", "friction"))
    assert all(line["ok_rows"] == 0 for line in found["lines"])
    for name in ("wavelength", "friction"):
        assert sum(line.startswith(f"{name}: no row is ok, most often because: ") for line in found["messages"]) == 1
    table = papilla("estimate", "hum.csv", "--out", "est.csv").out
    assert "line of the log" not in table and " to " not in table.split("3000 rows")[0]
    last = rows_of(tmp_path / "est.csv")[-1]
    assert (
        last["friction_status"] == "one way"
        and last["status"] == last["wavelength_status"] == "searching"
        and float(last["mu_kinetic"]) == pytest.approx(0.3, rel=1e-3)
    )
    assert float(last["mu_kinetic_sigma"]) == pytest.approx(0.2, rel=0.05)


def test_a_log_without_movement_has_no_lines_and_says_so(papilla, tmp_path):
    rng = np.random.default_rng(1)
    still = {"t_s": np.arange(100) / 1000, "g1": rng.normal(size=100), "velocity_mm_s": np.zeros(100)}
    write_table(tmp_path / "still.csv", still)
    answer = papilla("estimate", "still.csv", "--out", "est.csv", "--json")
    assert json.loads(answer.out)["lines"] == []
    assert "no lines: the position never changes" in answer.err


@pytest.mark.slow
@pytest.mark.skipif(not BOARDS, reason=f"no real measurements of boards in {DATA}")
@pytest.mark.parametrize("path", BOARDS, ids=lambda path: path.stem)
def test_real_boards_at_the_speed_they_were_slid_at(papilla, tmp_path, path):
    """16 channels at 35.6 Hz, with drift and a 20 mm component far stronger than the 4 mm line of the fine board."""
    ridge, speed = re.match(r"Board(\d+mm)_F\d+_V-(\d+)mmps", path.stem).groups()
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    columns = {"t_s": table[:, 0] / 1e3} | {f"g{k}": values for k, values in enumerate(table[:, 3:].T, start=1)}
    write_table(tmp_path / "log.csv", columns | {"velocity_mm_s": np.full(len(table), float(speed))})
    wavelength, tolerance, wanted = TRUTH[ridge]
    answer = papilla("estimate", "log.csv", "--out", "est.csv", "--wavelength-range", *wanted, "--json")
    assert answer.code == 0, answer.err
    assert json.loads(answer.out)["lines"][0]["wavelength_mm"] == pytest.approx(wavelength, rel=tolerance)
    assert float(rows_of(tmp_path / "est.csv")[-1]["wavelength_mm"]) == pytest.approx(wavelength, rel=tolerance)
    found = json.loads(papilla("estimate", "log.csv", "--out", "est.csv", "--json").out)["lines"]
    sizes = [line["strength"] for line in found]
    assert sizes == sorted(sizes, reverse=True)
    assert any(abs(line["wavelength_mm"] / wavelength - 1) < tolerance for line in found)
    assert any(abs(line["wavelength_mm"] / 20 - 1) < 0.03 for line in found)


@pytest.mark.parametrize(
    "options, message",
    [
        (["nowhere.csv"], "cannot read nowhere.csv"),
        (["log.csv", "--calibration", "nowhere.json"], "cannot read calibration nowhere.json"),
        (["log.csv", "--calibration", "cut.json"], "cut.json is not a calibration, or was cut short"),
        (["log.csv", "--calibration", "other.json"], "other.json: the schema is 'papilla.calibration/9'"),
        (["two.csv", "--calibration", "c.json"], "two.csv has 2 gauges, the calibration c.json was made for 5"),
        (["others.csv", "--calibration", "c.json"], "others.csv is of g2, g3, g4, g5, g6, the calibration c.json was"),
        (["log.csv", "--wavelength-range", "8", "1"], "--wavelength-range must rise, got 8 and 1"),
        (["log.csv", "--wavelength-range", "2", "2"], "--wavelength-range must rise, got 2 and 2"),
        (["log.csv", "--wavelength-range", "-1", "2"], "--wavelength-range (low end) must be greater than 0, got -1"),
        (["log.csv", "--wavelength-range", "nan", "2"], "--wavelength-range (low end) must be finite, got nan"),
        (["log.csv", "--wavelength-range", "1"], "Invalid value for '--wavelength-range'"),
        (["log.csv", "--saturation", "0"], "saturation must be greater than 0, got 0"),
        (["unsorted.csv"], "unsorted.csv, line 3, column t_s: time goes back from 1 to 0 s"),
    ],
)
def test_unusable_input(refused, tmp_path, log, calibrated, options, message):
    text = (tmp_path / calibrated).read_text()
    (tmp_path / "cut.json").write_text(text[: len(text) // 2])
    (tmp_path / "other.json").write_text(text.replace("papilla.calibration/1", "papilla.calibration/9"))
    write_table(tmp_path / "two.csv", {"t_s": [0.0, 1.0], "g1": [1.0, 1.0], "g2": [1.0, 1.0], "force_N": [1.0, 1.0]})
    others = {f"g{number}": [1.0, 1.0] for number in range(2, 7)}
    write_table(tmp_path / "others.csv", {"t_s": [0.0, 1.0], **others, "force_N": [1.0, 1.0]})
    write_table(tmp_path / "unsorted.csv", {"t_s": [1.0, 0.0], "g1": [1.0, 1.0]})
    assert message in refused("estimate", *options, "--out", "est.csv")


def test_unwritable_output(refused, log):
    assert "cannot write to folder log.csv" in refused("estimate", log, "--out", "log.csv/est.csv")


def test_a_gauge_is_called_by_the_name_that_the_header_gives_it(papilla, tmp_path, calibrated):
    rng = np.random.default_rng(4)
    gauges = {name: rng.normal(size=400) for name in ("g1", "g2", "g4", "g5")} | {"g4": np.full(400, np.nan)}
    write_table(tmp_path / "four.csv", {"t_s": np.arange(400) / 1000, **gauges})
    assert papilla("estimate", "four.csv", "--out", "est.csv").code == 0
    assert json.loads((tmp_path / "est.summary.json").read_text())["faults"] == {"g4 missing": 400}


@pytest.mark.slow
@pytest.mark.parametrize("column", ["g1", "force_N", "velocity_mm_s", "position_mm", "tangential_N"])
@pytest.mark.parametrize("value", [1e155, -1e300])
def test_absurd_numbers_in_a_log_count_as_missing(papilla, tmp_path, calibrated, column, value):
    rng = np.random.default_rng(6)
    t = np.arange(300) / 1000
    columns = {"t_s": t, **{f"g{k}": rng.normal(100, 10, 300) for k in range(1, 6)}, "force_N": np.full(300, 0.5)}
    columns |= {"velocity_mm_s": np.full(300, 50.0), "position_mm": 50 * t, "tangential_N": np.full(300, 0.2)}
    columns[column] = np.where(np.arange(300) % 3 == 1, value, columns[column])
    write_table(tmp_path / "log.csv", columns)
    write_table(tmp_path / "gaps.csv", columns | {column: np.where(columns[column] == value, np.nan, columns[column])})
    options = ("--calibration", calibrated, "--out")
    answers = [papilla("estimate", f"{log}.csv", *options, f"{log}.out") for log in ("log", "gaps")]
    assert [answer.code for answer in answers] == [0, 0], answers[0].err
    assert "100 cells hold numbers beyond 1e+12: they count as missing" in answers[0].err
    assert (tmp_path / "log.out").read_bytes() == (tmp_path / "gaps.out").read_bytes()


@pytest.mark.slow
def test_friction_needs_no_gauges_and_its_memory_is_the_callers(papilla, tmp_path):
    """The friction falls from 0.42 to 0.28: a short memory has forgotten the first sooner."""
    time = np.arange(4000) / 1000
    velocity = np.where(time % 1 < 0.2, 0.0, np.where(time % 2 < 1, 20.0, -20.0))
    mu = np.interp(time, [2, 4], [0.42, 0.28])
    rows = np.column_stack([time, np.full(4000, 0.5), velocity, 0.5 * mu * np.sign(velocity)])
    log, found = tmp_path / "pull.csv", {}
    np.savetxt(log, rows, delimiter=",", header="t_s,force_N,velocity_mm_s,tangential_N", comments="")
    for memory in ("5", "500"):
        out = tmp_path / f"{memory}.csv"
        answer = papilla("estimate", str(log), "--friction-memory", memory, "--out", str(out))
        assert answer.code == 0 and {row["wavelength_status"] for row in rows_of(out)} == {"no gauges"}
        found[memory] = float(rows_of(out)[-1]["mu_kinetic"])
    assert abs(found["5"] - 0.28) < abs(found["500"] - 0.28)


@pytest.mark.slow
def test_a_picture_and_a_page_of_log_and_estimates(papilla, refused, tmp_path, sliding):
    answer = papilla("estimate", sliding, "--out", "est.csv", "--plot", "p.png", "--html", "page.html", "--json")
    assert answer.code == 0 and (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    page = (tmp_path / "page.html").read_text()
    for text in ("<h1>slide.csv</h1>", "3000 rows at 1000 Hz", "kinetic friction", "What the status codes mean"):
        assert text in page
    assert page.count("<img") == 1 and "http://" not in page.replace("http://www.w3.org", "")
    (tmp_path / "est.csv").unlink()
    assert "pictures are written as .png" in refused("estimate", sliding, "--out", "x.csv", "--plot", "p.jpg")
    assert "is given for two outputs" in refused("estimate", sliding, "--out", "x.csv", "--plot", "x.csv")


@pytest.mark.parametrize("status", ["modulus_status", "status"])
def test_estimates_as_parquet_are_those_of_the_csv(papilla, tmp_path, status):
    parquet = pytest.importorskip("pyarrow.parquet")
    rng = np.random.default_rng(3)
    write_table(tmp_path / "log.csv", {"t_s": np.arange(400) / 1000, "g1": rng.normal(size=400)})
    for name in ("est.csv", "est.parquet"):
        assert papilla("estimate", "log.csv", "--out", name).code == 0
    table, rows = parquet.read_table(tmp_path / "est.parquet"), rows_of(tmp_path / "est.csv")
    assert table.column_names == COLUMNS.split() and table.num_rows == 400
    assert table.column(status).to_pylist() == [row[status] for row in rows]
    for name in COLUMNS.split()[:10]:
        assert table.column(name).to_pylist() == [float(row[name]) if row[name] else None for row in rows]
    assert (tmp_path / "est.parquet.summary.json").exists()
