"""`papilla design` on a made-up geometry: what it says, what it refuses, what it writes."""

import json
from types import SimpleNamespace

import pytest

from papilla.cli import main
from papilla.design import running
from papilla.design.running import price
from papilla.design.study import read_study
from papilla.finger import Gauge

pytestmark = pytest.mark.usefixtures("made_up")


@pytest.fixture
def papilla(capsys, monkeypatch):
    """Runs the command in this process, the study too: exit code, stdout, stderr."""
    true = running.run
    monkeypatch.setattr("papilla.design.job.run", lambda *given, **how: true(*given, **how | {"workers": 0}))

    def run(*arguments):
        with pytest.raises(SystemExit) as left:
            main.run(["design", *map(str, arguments)])
        out, said = capsys.readouterr()
        return left.value.code, out, said

    return run


def test_a_study_as_json_and_as_text(papilla, study_file, tmp_path):
    code, out, _ = papilla(study_file(), "--out", tmp_path / "a", "--json")
    found = json.loads(out)
    assert code == 0 and found["designs"] == 12 and found["objectives"] == ["sigma_sd", "signal_over_noise"]
    assert set(found["best"][0]) == {"design", "finger", "free", "objectives"}
    code, out, said = papilla(study_file(), "--out", tmp_path / "b")
    assert code == 0 and "finger_1.toml" in out and "12 of 12" in said


@pytest.mark.parametrize(
    "options, said",
    [
        (["--workers", "0"], "--workers must be from 1"),
        (["--workers", "1", "--scheduler", "tcp://host:1"], "not both"),
        (["--place", "9"], "--place must be from 1 to 8"),
    ],
)
def test_bad_options_are_one_line(papilla, study_file, options, said):
    code, out, line = papilla(study_file(), *options)
    assert code == 2 and out == "" and said in line and line.count("\n") == 1


def test_a_bad_study_is_one_line(papilla, study_file):
    code, _, line = papilla(study_file(("spread_deg", "spread")))
    assert code == 2 and "did you mean 'gauges.spread_deg'" in line and line.count("\n") == 1


def test_explain_says_what_a_study_costs_and_runs_nothing(papilla, study_file, tmp_path):
    code, out, _ = papilla(study_file(), "--explain", "--out", tmp_path / "out")
    assert code == 0 and "12 designs of 1 geometries, gauges at 17 places" in out
    assert not (tmp_path / "out").exists()
    found = price(read_study(study_file()), lambda line: None)
    assert found.seconds(2) == pytest.approx(found.seconds(1) / 2) and found.per_design > 0


def test_placed_gauges_are_listed_and_given_as_json(papilla, study_file, monkeypatch, tmp_path):
    asked = []

    def placed(study, count, out, say):
        asked.append((len(study.free), count, out))
        gauges = (Gauge("g1", angle_deg=-7.5), Gauge("g2", angle_deg=20.0, y_mm=3.0, direction_deg=90.0))
        return SimpleNamespace(
            sets=[[3], [3, 8]], of=lambda chosen: SimpleNamespace(gauges=gauges[: len(chosen)]),
            sentences=["two gauges leave 0.2"], sigma={"anywhere": {}}, written=["placed_2.toml"],
        )  # fmt: skip

    monkeypatch.setattr("papilla.design.placement.place_gauges", placed)
    code, out, _ = papilla(study_file(), "--place", "2", "--out", tmp_path, "--json")
    found = json.loads(out)
    assert code == 0 and found["written"] == ["placed_2.toml"] and asked[0][1:] == (2, tmp_path)
    assert found["gauges"][1] == {"name": "g2", "angle_deg": 20.0, "y_mm": 3.0, "direction_deg": 90.0}
    code, out, _ = papilla(study_file(), "--place", "2", "--out", tmp_path)
    assert code == 0 and "two gauges leave 0.2" in out and "written: placed_2.toml" in out and "-7.5" in out
