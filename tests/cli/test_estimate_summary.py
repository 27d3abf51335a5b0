"""The summary of `papilla estimate`: its counts, last answers and remarks are those of the rows that are written."""

import csv
import json
from collections import Counter

import numpy as np
import pytest

from papilla.core.tables import write_table

QUANTITIES = {"modulus": "modulus_MPa", "wavelength": "wavelength_mm", "friction": "mu_kinetic"}


def sliding(seed, seconds=2.0, grating_mm=1.5, **changes):
    """Columns of a slide to and fro, 1 kHz, two gauges 3 mm apart."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(1000 * seconds)) / 1000
    velocity = 80 * np.sin(2 * np.pi * t)
    place = 80 / (2 * np.pi) * (1 - np.cos(2 * np.pi * t))
    phase = 2 * np.pi * (place[:, None] - np.array([0.0, 3.0])) / grating_mm
    felt = 10 * np.sin(phase) + rng.normal(0, 1, phase.shape)
    force = 0.5 + 0.1 * np.sin(3 * t)
    columns = {"t_s": t, "g1": felt[:, 0], "g2": felt[:, 1], "force_N": force, "velocity_mm_s": velocity}
    return columns | {"position_mm": place, "tangential_N": 0.4 * force * np.sign(velocity)} | changes


@pytest.fixture(scope="module", params=[1, 2])
def columns(request):
    """A slide with a missing cell, a gap and a repeated time."""
    found = sliding(request.param)
    found["g1"][700] = np.nan
    found["t_s"][1200:] += 0.05
    found["t_s"][1500] = found["t_s"][1499]
    return found


def estimated(papilla, *options):
    answer = papilla("estimate", "log.csv", "--out", "e.csv", "--json", *options)
    assert answer.code == 0, answer.err
    with open("e.csv", newline="") as stream:
        return json.loads(answer.out), list(csv.DictReader(stream)), answer.err


@pytest.mark.slow
def test_counts_and_last_answers_are_those_of_the_rows(papilla, tmp_path, columns):
    write_table(tmp_path / "log.csv", columns)
    found, rows, _ = estimated(papilla)
    assert json.loads((tmp_path / "e.summary.json").read_text()) == found and len(rows) == found["rows"] == 2000
    assert (found["nan_rows"], found["nan_cells"], found["gaps"], found["duplicates"]) == (1, 1, 2, 1)
    for quantity, column in QUANTITIES.items():
        codes = Counter(row[f"{quantity}_status"] for row in rows)
        assert found["statuses"][quantity] == codes and {*codes} <= {*found["legend"][quantity]}
        ok = [row for row in rows if row[f"{quantity}_status"].startswith("ok")]
        assert found["ok_rows"][quantity] == len(ok)
        assert found["answered_rows"][column] == sum(row[column] != "" for row in rows)
        last = found["last_answer" if quantity == "modulus" else f"last_{quantity}"]
        answered = [row for row in ok if row[column]]
        assert (last is None) == (not answered)
        if answered:
            assert (last["t_s"], last[column]) == (float(answered[-1]["t_s"]), float(answered[-1][column]))
    assert found["status"] == Counter(row["status"] for row in rows)
    assert found["last_answer"] is None, "no calibration was given"
    assert [line["ok_rows"] > 0 for line in found["lines"]][:1] == [True]
    assert found["lines"][0]["wavelength_mm"] == pytest.approx(1.5, rel=5e-3)
    said = papilla("estimate", "log.csv", "--out", "e.csv")
    assert "2000 rows at 1000 Hz" in said.out and said.out.splitlines()[-1].startswith("Wrote e.csv, and this summary")
    assert len(said.err.splitlines()) <= 6, "three remarks, and how many more there are"


@pytest.mark.slow
@pytest.mark.parametrize(
    "without, quantity, said",
    [("tangential_N", "friction", "no friction: no column tangential_N"), (None, "modulus", "no calibration")],
)
def test_what_a_log_lacks_is_a_remark_and_no_row_is_ok(papilla, tmp_path, without, quantity, said):
    columns = sliding(3)
    columns.pop(without, None)
    write_table(tmp_path / "log.csv", columns)
    found, _, _ = estimated(papilla)
    assert found["ok_rows"][quantity] == 0 and any(said in message for message in found["messages"])


@pytest.mark.slow
def test_a_dead_gauge_is_named_with_its_rows(papilla, tmp_path):
    write_table(tmp_path / "log.csv", sliding(4, g2=np.full(2000, 7.0)))
    found, _, _ = estimated(papilla)
    (name,) = [fault for fault in found["faults"] if fault.startswith("g2 ")]
    assert found["faults"][name] > 1500


@pytest.mark.slow
def test_estimates_to_standard_output_are_those_of_the_file(papilla, refused, tmp_path):
    write_table(tmp_path / "log.csv", sliding(5, seconds=0.5))
    estimated(papilla)
    answer = papilla("estimate", "log.csv", "--out", "-")
    assert answer.out.splitlines() == (tmp_path / "e.csv").read_text().splitlines() and answer.err
    (tmp_path / "e.csv").unlink()
    (tmp_path / "e.summary.json").unlink()
    assert "--out - and --json both want standard output" in refused("estimate", "log.csv", "--out", "-", "--json")
