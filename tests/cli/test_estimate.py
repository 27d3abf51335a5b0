"""`papilla estimate`: one row of answers per row of the log, a summary of these rows, and honest words where there is
no answer."""

import csv
import json
import os
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_up_sweep import make_sweep

from papilla.calibration import fit
from papilla.core.errors import InputError
from papilla.core.tables import write_table
from papilla_papers.methods.force_depth import DepthErrors, ForceDepth

ANSWERS = (
    *("t_s", "modulus_MPa", "modulus_sigma_MPa", "frequency_Hz", "wavelength_mm", "wavelength_sigma_mm"),
    *("mu_kinetic", "mu_kinetic_sigma", "mu_static", "mu_static_sigma"),
)
COLUMNS = [*ANSWERS, "modulus_status", "wavelength_status", "friction_status", "status"]
QUANTITIES = {"modulus": "modulus_MPa", "wavelength": "wavelength_mm", "friction": "mu_kinetic"}
PATTERN = np.array([-0.4, -0.8, 1.5, -0.8, -0.4])

DATA = Path(os.environ.get("PAPILLA_DATA") or Path(__file__).parents[3] / "shared" / "data")
BOARDS = sorted((DATA / "fabricslide_board").glob("*.csv"))
TRUTH = {"2mm": (3.99, 0.01, (1, 8)), "10mm": (19.88, 0.015, (10, 40))}
"""Wavelength (mm), tolerance and range to look in, by the width of the ridges that a file is named after."""


def readings(force, modulus):
    """(n, 5) readings of a finger that follows a smooth law."""
    return np.multiply.outer(2000 * np.asarray(force) ** 0.7 * modulus**0.15, PATTERN)


def depth(force, modulus):
    """Depth (mm) of a press of this finger."""
    return np.asarray(force) ** 0.6 * (0.5 + 0.2 * modulus**-0.5)


@pytest.fixture
def calibrated(tmp_path):
    """A calibration file of the smooth law, with its sweep beside it."""
    table = make_sweep(np.geomspace(0.05, 1.0, 12), np.geomspace(0.05, 1, 20))
    rows = readings(table.force_N, table.modulus_MPa)
    fit(replace(table, reading=rows, sd_microstrain=rows.std(axis=1))).save(tmp_path / "c.json")
    presses = {"force_N": table.force_N, "modulus_MPa": table.modulus_MPa} | gauges_of(rows)
    write_table(tmp_path / "sweep.csv", presses | {"indentation_mm": depth(table.force_N, table.modulus_MPa)})
    return "c.json"


def gauges_of(rows):
    """Columns g1, g2, ... of readings (n, gauges)."""
    return {f"g{number}": column for number, column in enumerate(rows.T, start=1)}


def touch():
    """Columns of a second of pressing to 0.6 N on 0.3 MPa, with noise, a missing cell and a gap."""
    rng = np.random.default_rng(8)
    t = np.arange(1000) / 1000
    force = np.interp(t, [0, 0.1, 0.4, 1.0], [0, 0, 0.6, 0.6])
    values = readings(force, 0.3) + rng.normal(0, 2, (1000, 5))
    values[700, 2] = np.nan
    t[900:] += 0.05
    return {"t_s": t, **gauges_of(values), "force_N": force + rng.normal(0, 5e-4, 1000)}


def slide(seed, seconds=2.0, **changes):
    """Columns of sliding to and fro over a grating of 1.5 mm at 1 kHz, two gauges 3 mm apart."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(1000 * seconds)) / 1000
    velocity = 80 * np.sin(2 * np.pi * t)
    position = 80 / (2 * np.pi) * (1 - np.cos(2 * np.pi * t))
    force = 0.5 + 0.1 * np.sin(3 * t)
    phase = 2 * np.pi * (position[:, None] - np.array([0.0, 3.0])) / 1.5
    felt = 10 * (np.sin(phase) + 0.3 * np.sin(2 * phase)) + rng.normal(0, 1, phase.shape)
    columns = {"t_s": t, "g1": felt[:, 0], "g2": felt[:, 1], "force_N": force, "velocity_mm_s": velocity}
    columns |= {"position_mm": position, "tangential_N": 0.4 * force * np.sign(velocity) + 0.02}
    return columns | changes


@pytest.fixture
def estimated(papilla, tmp_path):
    """Writes the columns of a log; the JSON of its estimates, their rows, and what was said on stderr."""

    def call(columns, *options, log="log.csv"):
        write_table(tmp_path / log, columns)
        answer = papilla("estimate", log, "--out", "est.csv", "--json", *options)
        assert answer.code == 0, answer.err
        return json.loads(answer.out), rows_of(tmp_path / "est.csv"), answer.err

    return call


def rows_of(path):
    with open(path, newline="") as stream:
        return list(csv.DictReader(stream))


def check_summary(found, rows):
    """The counts and last answers of a summary are those of the rows that are written."""
    assert list(rows[0]) == COLUMNS and len(rows) == found["rows"]
    for quantity, column in QUANTITIES.items():
        codes = Counter(row[f"{quantity}_status"] for row in rows)
        assert found["statuses"][quantity] == codes and {*codes} == {*found["legend"][quantity]}
        ok = [row for row in rows if row[f"{quantity}_status"].startswith("ok")]
        assert found["ok_rows"][quantity] == len(ok)
        assert found["answered_rows"][column] == sum(row[column] != "" for row in rows)
        last = found["last_answer" if quantity == "modulus" else f"last_{quantity}"]
        answered = [row for row in ok if row[column]]
        assert (last is None) == (not answered)
        if answered:
            assert (last["t_s"], last[column]) == (float(answered[-1]["t_s"]), float(answered[-1][column]))
    assert found["status"] == Counter(row["status"] for row in rows)
    assert all(row["status"] in [row[f"{quantity}_status"] for quantity in QUANTITIES] for row in rows)
    strengths = [line["strength"] for line in found["lines"]]
    assert strengths == sorted(strengths, reverse=True)


def test_a_touch_has_one_row_of_answers_per_row(estimated, papilla, tmp_path, calibrated):
    found, rows, _ = estimated(touch(), "--calibration", calibrated)
    check_summary(found, rows)
    assert json.loads((tmp_path / "est.summary.json").read_text()) == found
    assert rows[0]["status"] == "no contact" and rows[0]["modulus_MPa"] == ""
    assert rows[-1]["modulus_status"] == "ok" and rows[700]["modulus_status"] == "ok, left out"
    assert rows[-1]["wavelength_status"].startswith("frequency alone")
    assert {row["friction_status"] for row in rows} == {"no column tangential_N"}
    assert found["faults"] == {"g3 missing": 1, "samples are missing before this one": 1}
    assert abs(float(rows[-1]["modulus_MPa"]) - 0.3) < 2 * float(rows[-1]["modulus_sigma_MPa"]) < 0.6
    assert (found["nan_rows"], found["nan_cells"], found["gaps"], found["duplicates"]) == (1, 1, 1, 0)
    assert found["gauge_noise_microstrain"] == pytest.approx(2, rel=0.2)
    assert found["force_noise_N"] == pytest.approx(5e-4, rel=0.2)
    assert all(row[name] == "" for row in rows for name in ANSWERS[4:]), "no estimator, no value"
    assert "no friction: no column tangential_N, velocity_mm_s or position_mm" in found["messages"]
    results, rest = papilla("estimate", "log.csv", "--calibration", calibrated, "--out", "est.csv").out.split(
        "1000 rows "
    )
    modulus = next(line for line in results.splitlines() if "modulus" in line)
    value, sigma = (found["last_answer"][name] for name in ("modulus_MPa", "modulus_sigma_MPa"))
    share = f"{found['ok_rows']['modulus'] / 10:.3g} %"
    interval = f"{value - 1.96 * sigma:.4g} to {value + 1.96 * sigma:.4g}"
    assert all(text in modulus for text in (f"{value:.4g} MPa", interval, share, "no contact"))
    assert "at 1000 Hz, noise 2" in rest and "1 gaps" in rest
    assert "modulus, force below: force below the calibrated domain" in rest
    assert rest.splitlines()[-1] == "Wrote est.csv, and this summary in full: est.summary.json"


def test_without_calibration_or_force_the_status_says_so(estimated, calibrated):
    bare = {"t_s": [0.0, 0.1], **{f"g{i}": [1.0, 2.0] for i in range(1, 6)}}
    cases = (((touch(),), "no calibration was given"), ((bare, "--calibration", calibrated), "no column force_N"))
    for arguments, status in cases:
        _, rows, _ = estimated(*arguments)
        assert {(row["modulus_status"], row["modulus_MPa"]) for row in rows} == {(status, "")}


@pytest.mark.parametrize("told, ok", [((), True), (("--finger", "default"), False)])
def test_a_finger_with_ridges_may_feel_a_faint_lone_line_as_a_harmonic(estimated, told, ok):
    t = np.arange(2000) / 1000
    reading = np.sin(2 * np.pi * 126 * t / 1.2) + np.random.default_rng(1).normal(0, 1.2, 2000)
    last = estimated({"t_s": t, "g1": reading, "velocity_mm_s": np.full(2000, 126.0)}, *told)[1][-1]
    assert float(last["wavelength_mm"]) == pytest.approx(1.2, rel=0.01)
    assert last["wavelength_status"].startswith("ok") == ok and (last["wavelength_status"] == "ambiguous") == (not ok)


def test_answers_of_a_changed_calibration_come_with_a_remark(estimated, tmp_path, calibrated):
    document = json.loads((tmp_path / calibrated).read_text())
    document["softness"]["surface"]["coefficients"][2][2] += 0.1
    (tmp_path / "changed.json").write_text(json.dumps(document))
    found, rows, said = estimated(touch(), "--calibration", "changed.json")
    remark = "modulus: the calibration is in doubt: the file was changed after papilla wrote it"
    assert [message for message in found["messages"] if message.startswith(remark)]
    assert remark in said and "UserWarning" not in said
    codes = {row["modulus_status"] for row in rows if row["modulus_status"].startswith("ok")}
    assert codes == {"ok, calibration in doubt", "ok, left out, calibration in doubt"}


@pytest.mark.parametrize("seed", [1, 2])
def test_a_slide_gives_wavelength_frequency_friction_and_its_lines(estimated, papilla, seed):
    """Of a log with a missing cell, a gap and a repeated time."""
    columns = slide(seed)
    columns["g1"][700] = np.nan
    columns["t_s"][1200:] += 0.05
    columns["t_s"][1500] = columns["t_s"][1499]
    found, rows, _ = estimated(columns, "--wavelength-range", 0.5, 5)
    check_summary(found, rows)
    assert (found["nan_rows"], found["nan_cells"], found["gaps"], found["duplicates"]) == (1, 1, 2, 1)
    assert float(rows[-1]["wavelength_mm"]) == pytest.approx(1.5, rel=5e-3)
    assert float(rows[1700]["frequency_Hz"]) == pytest.approx(80 / 1.5 * abs(np.sin(2 * np.pi * 1.7)), rel=0.05)
    assert float(rows[-1]["mu_kinetic"]) == pytest.approx(0.4, rel=0.02)
    line = found["lines"][0]
    assert line["wavelength_mm"] == pytest.approx(1.5, rel=5e-3) and line["harmonic"] == 1 and line["ok_rows"] > 0
    assert 0 < line["wavelength_sigma_mm"] < 0.05 and line["chance"] < 1e-3
    assert line["strength"] == pytest.approx(10, rel=0.1) and line["gauges"] == ["g1", "g2"]
    said = papilla("estimate", "log.csv", "--out", "est.csv")
    for text in ("wavelength", "frequency", "kinetic friction", "static friction", "line of the log"):
        assert sum(text in line for line in said.out.splitlines()) >= 1
    assert len(said.err.splitlines()) <= 6, "three remarks, and how many more there are"


def test_a_force_in_gf_is_told_by_what_the_calibration_covers(papilla, tmp_path, calibrated):
    columns = touch()
    write_table(tmp_path / "gf.csv", columns | {"force_N": 20 * columns["force_N"]})
    answer = papilla("estimate", "gf.csv", "--calibration", calibrated, "--out", "est.csv")
    assert answer.code == 2 and not (tmp_path / "est.csv").exists()
    assert "no row has an answer that is ok; force_N comes to 12: this looks like gf" in answer.err


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


def test_the_summary_speaks_only_of_what_rows_call_ok(estimated, papilla):
    """Hum alone, at a speed that changes: lines of the whole log, and no result of them."""
    t = np.arange(3000) / 1000
    reading = np.sin(2 * np.pi * 50 * t) + np.random.default_rng(3).normal(0, 0.05, 3000)
    one_way = {"force_N": np.ones(3000), "velocity_mm_s": 60 + 20 * np.sin(5 * t), "tangential_N": np.full(3000, 0.3)}
    found, rows, _ = estimated({"t_s": t, "g1": reading, **one_way})
    check_summary(found, rows)
    assert found["ok_rows"] == {"modulus": 0, "frequency": 0, "wavelength": 0, "friction": 0}
    assert all(found[f"last_{name}"] is None for name in ("answer", "frequency", "wavelength", "friction"))
    assert all(line["ok_rows"] == 0 for line in found["lines"])
    for name in ("wavelength", "friction"):
        assert sum(line.startswith(f"{name}: no row is ok, most often because: ") for line in found["messages"]) == 1
    table = papilla("estimate", "log.csv", "--out", "est.csv").out
    assert "line of the log" not in table and " to " not in table.split("3000 rows")[0]
    last = rows[-1]
    assert last["friction_status"] == "one way" and last["status"] == last["wavelength_status"] == "searching"
    assert float(last["mu_kinetic"]) == pytest.approx(0.3, rel=1e-3)
    assert float(last["mu_kinetic_sigma"]) == pytest.approx(0.2, rel=0.05)


@pytest.mark.slow
@pytest.mark.skipif(not BOARDS, reason=f"no real measurements of boards in {DATA}")
@pytest.mark.parametrize("path", BOARDS, ids=lambda path: path.stem)
def test_real_boards_at_the_speed_they_were_slid_at(estimated, path):
    """16 channels at 35.6 Hz, with drift and a 20 mm component far stronger than the 4 mm line of the fine board."""
    ridge, speed = re.match(r"Board(\d+mm)_F\d+_V-(\d+)mmps", path.stem).groups()
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    columns = {"t_s": table[:, 0] / 1e3} | {f"g{k}": values for k, values in enumerate(table[:, 3:].T, start=1)}
    columns["velocity_mm_s"] = np.full(len(table), float(speed))
    wavelength, tolerance, wanted = TRUTH[ridge]
    found, rows, _ = estimated(columns, "--wavelength-range", *wanted)
    assert found["lines"][0]["wavelength_mm"] == pytest.approx(wavelength, rel=tolerance)
    assert float(rows[-1]["wavelength_mm"]) == pytest.approx(wavelength, rel=tolerance)
    lines = estimated(columns)[0]["lines"]
    assert any(abs(line["wavelength_mm"] / wavelength - 1) < tolerance for line in lines)
    assert any(abs(line["wavelength_mm"] / 20 - 1) < 0.03 for line in lines)


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
        (["log.csv", "--wavelength-range", "nan", "2"], "--wavelength-range (low end) must be finite, got nan"),
        (["log.csv", "--wavelength-range", "1"], "Option '--wavelength-range' requires 2 arguments"),
        (["log.csv", "--saturation", "0"], "saturation must be greater than 0, got 0"),
        (["log.csv", "--out", "log.csv/est.csv"], "cannot write to folder log.csv"),
        (["log.csv", "--out", "-", "--json"], "--out - and --json both want standard output"),
        (["log.csv", "--plot", "p.jpg"], "pictures are written as .png"),
        (["log.csv", "--plot", "est.csv"], "is given for two outputs"),
        (["log.csv", "--softness", "printed", "--thickness", "5"], "--thickness"),
        (["log.csv", "--softness", "force-depth", "--calibration", "c.json"], "column indentation_mm is missing"),
        (["deep.csv", "--softness", "force-depth"], "needs --calibration with its sweep.csv"),
        (["unsorted.csv"], "unsorted.csv, line 3, column t_s: time goes back from 1 to 0 s"),
    ],
)
def test_unusable_input(refused, tmp_path, calibrated, options, message):
    text = (tmp_path / calibrated).read_text()
    (tmp_path / "cut.json").write_text(text[: len(text) // 2])
    (tmp_path / "other.json").write_text(text.replace("papilla.calibration/1", "papilla.calibration/9"))
    write_table(tmp_path / "log.csv", touch())
    write_table(tmp_path / "deep.csv", touch() | {"indentation_mm": np.zeros(1000)})
    for name, numbers in (("two", (1, 2)), ("others", range(2, 7))):
        gauges = {f"g{number}": [1.0, 1.0] for number in numbers}
        write_table(tmp_path / f"{name}.csv", {"t_s": [0.0, 1.0], **gauges, "force_N": [1.0, 1.0]})
    write_table(tmp_path / "unsorted.csv", {"t_s": [1.0, 0.0], "g1": [1.0, 1.0]})
    assert message in refused("estimate", "--out", "est.csv", *options)


def test_a_gauge_is_called_by_the_name_that_the_header_gives_it(estimated):
    rng = np.random.default_rng(4)
    gauges = {name: rng.normal(size=400) for name in ("g1", "g2", "g4", "g5")} | {"g4": np.full(400, np.nan)}
    assert estimated({"t_s": np.arange(400) / 1000, **gauges})[0]["faults"] == {"g4 missing": 400}
    dead = estimated(slide(4, g2=np.full(2000, 7.0)))[0]["faults"]
    assert [rows > 1500 for name, rows in dead.items() if name.startswith("g2 ")] == [True]


@pytest.mark.parametrize("value", [1e155, -1e300])
@pytest.mark.parametrize("column", ["g1", "force_N", "velocity_mm_s", "position_mm", "tangential_N"])
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


def test_friction_needs_no_gauges_and_its_memory_is_the_callers(estimated):
    """The friction falls from 0.42 to 0.28: a short memory has forgotten the first sooner."""
    time = np.arange(4000) / 1000
    velocity = np.where(time % 1 < 0.2, 0.0, np.where(time % 2 < 1, 20.0, -20.0))
    tangential = 0.5 * np.interp(time, [2, 4], [0.42, 0.28]) * np.sign(velocity)
    pull = {"t_s": time, "force_N": np.full(4000, 0.5), "velocity_mm_s": velocity, "tangential_N": tangential}
    rows = {memory: estimated(pull, "--friction-memory", memory)[1] for memory in (5, 500)}
    assert {row["wavelength_status"] for row in rows[5]} == {"no gauges"}
    away = {memory: abs(float(found[-1]["mu_kinetic"]) - 0.28) for memory, found in rows.items()}
    assert away[5] < away[500]


def test_a_picture_and_a_page_of_log_and_estimates(estimated, tmp_path):
    estimated(slide(9, seconds=1.0), "--plot", "p.png", "--html", "page.html", log="slide.csv")
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
    page = (tmp_path / "page.html").read_text()
    for text in ("<h1>slide.csv</h1>", "1000 rows at 1000 Hz", "kinetic friction", "What the status codes mean"):
        assert text in page
    assert page.count("<img") == 1 and "http://" not in page.replace("http://www.w3.org", "")


def test_estimates_as_parquet_or_to_standard_output_are_those_of_the_csv(estimated, papilla, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    _, rows, _ = estimated(slide(5, seconds=0.4))
    assert papilla("estimate", "log.csv", "--out", "est.parquet").code == 0
    table = parquet.read_table(tmp_path / "est.parquet")
    assert table.column_names == COLUMNS and table.num_rows == 400
    for name in COLUMNS:
        read = (lambda cell: float(cell) if cell else None) if name in ANSWERS else str
        assert table.column(name).to_pylist() == [read(row[name]) for row in rows]
    assert (tmp_path / "est.parquet.summary.json").exists()
    answer = papilla("estimate", "log.csv", "--out", "-")
    assert answer.out.splitlines() == (tmp_path / "est.csv").read_text().splitlines() and answer.err


@pytest.mark.parametrize("softness", ["gauges", "surface", "sd", "force-depth"])
def test_the_modulus_of_a_touch_comes_from_gauges_from_s_d_or_from_force_and_depth(estimated, calibrated, softness):
    columns = touch()
    noise = np.random.default_rng(4).normal(0, 1e-3, 1000)
    columns["indentation_mm"] = depth(np.maximum(columns["force_N"], 0), 0.3) + noise
    found, rows, _ = estimated(columns, "--calibration", calibrated, "--softness", softness)
    last = found["last_answer"]
    assert abs(last["modulus_MPa"] - 0.3) < 2 * last["modulus_sigma_MPa"] < 0.3
    assert found["ok_rows"]["modulus"] > 450 and "" not in found["legend"]["modulus"]
    assert found["statuses"]["modulus"]["no contact"] >= 40
    assert float(rows[-1]["modulus_MPa"]) == pytest.approx(0.3, rel=0.4) and rows[-1]["modulus_status"] == "ok"


def test_force_depth_says_where_it_has_no_answer():
    forces, moduli = np.geomspace(0.05, 1.0, 12), np.geomspace(0.05, 1.0, 20)
    force, modulus = (grid.ravel() for grid in np.meshgrid(forces, moduli))
    model = ForceDepth(force, modulus, depth(force, modulus))
    force, modulus = np.random.default_rng(1).uniform(0.06, 0.9, (2, 300))
    deep = depth(force, modulus)
    found, _, _ = model.process(force, deep, DepthErrors())
    np.testing.assert_allclose(found, modulus, rtol=2e-3)
    moved, _, _ = model.process(force, 1.0001 * deep, DepthErrors())
    alone = model.process(force, deep, DepthErrors(depth_mm=0.01, force_N=0, contact_mm=0, model=0))[1]
    np.testing.assert_allclose(alone, np.abs(moved - found) / (1e-4 * deep) * 0.01, rtol=0.05)
    cases = {"BAD_INPUT": (0.5, np.nan), "NO_CONTACT": (0.0, 0.0), "FORCE_BELOW": (0.04, 0.2)}
    cases |= {"FORCE_ABOVE": (2.0, 1.0), "HARDER": (0.5, 0.3), "SOFTER": (0.5, 3.0)}
    modulus, sigma, status = model.process(*np.array(list(cases.values())).T, DepthErrors())
    assert [code.name for code in status] == [*cases] and np.isnan(modulus).all() and np.isnan(sigma).all()
    ends = forces[[0, -1]]
    modulus, _, _ = model.process(ends, depth(ends, 0.3), DepthErrors())
    np.testing.assert_allclose(modulus, 0.3, rtol=2e-3, err_msg="the sweep's own least and largest force")
    with pytest.raises(InputError, match="the sweep must hold the depth"):
        ForceDepth(force, force, force)
