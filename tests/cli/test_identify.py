"""`papilla identify`: a finger that every command takes, what it says of it, and what it refuses."""

import json
import tomllib
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.fem.pressing.response import response
from papilla.identification import posing
from papilla.identification.posing import family_of
from papilla.model.finger import Finger
from papilla.model.specimen import Block

SIZE_MM = 2.8


@pytest.fixture(scope="module")
def smooth():
    return response(family_of(Finger.default(), size_mm=SIZE_MM), Block(1.0, 10.0))


@pytest.fixture
def bench(smooth, tmp_path, monkeypatch):
    """Writes a log of presses; changes: columns by name, or a factor of one."""
    monkeypatch.setattr(posing, "SIZE_MM", SIZE_MM)

    def write(name="log.csv", **changes):
        rng = np.random.default_rng(2)
        force, modulus = (one.ravel() for one in np.meshgrid((0.1, 0.2, 0.4, 0.7, 0.98), (0.089, 0.51)))
        felt = smooth.felt(force * (1 + 0.01 * rng.normal(size=10)), modulus, 0.2, 0.04)
        gain, lever = np.array([0.1, -0.3, 0.2, 0.15, 0.1]), np.array([0.05, 0.1, -0.2, -0.1, 0.0])
        readings = 1e6 * (gain * felt.values[:, 0] + lever * felt.values[:, 1]) + [5, -10, 15, 0, -20]
        columns = {"force_N": force, "modulus_MPa": modulus}
        columns |= {f"g{k + 1}": readings[:, k] + 5 * rng.normal(size=10) for k in range(5)}
        columns["indentation_mm"] = felt.indentation + 0.15
        for key, change in changes.items():
            columns[key] = change(columns[key]) if callable(change) else change
        columns = {key: values for key, values in columns.items() if values is not None}
        path = tmp_path / name
        np.savetxt(path, np.column_stack([*columns.values()]), delimiter=",", header=",".join(columns), comments="")
        return path

    return write


@pytest.mark.slow
def test_a_log_becomes_a_finger_that_other_commands_take(papilla, bench, tmp_path):
    out, report = tmp_path / "f.toml", tmp_path / "r.html"
    answer = papilla("identify", bench(), "--out", out, "--report", report, "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    outer = found["parameters"]["outer_modulus_MPa"]
    assert outer["lower"] < 0.2 < outer["upper"] and outer["lower"] < outer["value"] < outer["upper"]
    assert found["presses"] == 10 and found["friction"] == "not told" and found["finger"] == str(out)
    assert found["physics"] == "block 10 mm thick, friction not stated, large strain included"
    assert any("g2 reads backwards" in doubt for doubt in found["doubts"])
    assert "but 1 of 5 gauges read backwards: identified from 10 presses" in found["status"]
    finger = Finger.load(out)
    assert finger.outer.modulus == outer["value"] and finger.gauges[1].membrane_gain < 0
    assert finger.identified.zeros_microstrain[2] == found["parameters"]["zero_microstrain.g3"]["value"]
    assert finger.bench.touch_down == pytest.approx(0.15, abs=0.03)
    assert finger.sha256 == Finger.load(out).sha256
    page = report.read_text()
    assert "inner_modulus_MPa" in page and page.count("<img") == 2 and "http" not in page.split("<img")[0]
    again = tmp_path / "again.toml"
    finger.save(again)
    assert tomllib.loads(again.read_text()) == tomllib.loads(out.read_text())


@pytest.mark.slow
def test_the_table_names_each_parameter_with_its_interval(papilla, bench, tmp_path):
    answer = papilla("identify", bench(), "--out", "f.toml", "--fix", "lever_mm.g5=0")
    assert answer.code == 0, answer.err
    assert "inner_modulus_MPa" in answer.out and "held" in answer.out and "Status: " in answer.out
    assert Finger.load("f.toml").gauges[4].lever_mm == 0


@pytest.mark.parametrize(
    "changes, options, message",
    [
        ({"force_N": lambda force: 102 * force}, [], "is force_N in N (1 gf is 0.0098 N)"),
        ({"modulus_MPa": lambda modulus: 1000 * modulus}, [], "is it in kPa?"),
        ({f"g{k}": lambda reading: 1e-6 * reading for k in range(1, 6)}, [], "are these strains?"),
        ({"g5": None}, [], "the log has 4 gauges (g1, g2, g3, g4), the finger"),
        ({"g6": np.ones(10)}, [], "the log has 6 gauges"),
        (
            {f"g{k}": None for k in range(1, 6)} | {"sd_microstrain": np.full(10, 500.0)},
            ["--free", "gain"],
            "gain.g1 needs readings, and the log has S_d alone, which determines common_gain",
        ),
        ({"x_mm": 9 * np.ones(10)}, [], "x_mm is 9 in press 1: contacts are known within 5 mm of the apex"),
        ({"g2": np.full(10, np.nan)}, [], "expected a finite number, got nan"),
        ({}, ["--fix", "gain"], "--fix takes NAME=VALUE, got 'gain'"),
        ({}, ["--fix", "gain=many"], "--fix gain must be a number, got 'many'"),
        ({}, ["--free", "thicknes_mm"], "did you mean thickness_mm?"),
        ({}, ["--out", "log.csv"], "would overwrite the input"),
        ({}, ["--specimen", "sphere"], "a sphere needs --radius"),
    ],
)
def test_what_cannot_be_identified_is_one_line(papilla, refused, bench, changes, options, message):
    path = bench(**changes)
    out = [] if "--out" in options else ["--out", "f.toml"]
    papilla("identify", path, *out, *options)  # A cold cache counts its presses before the refusal
    assert message in refused("identify", path, *out, *options)


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes, doubt",
    [
        ({"g4": lambda reading: 0 * reading + 3.0}, "g4 hardly follows the presses"),
        ({"modulus_MPa": lambda modulus: 0 * modulus + 0.51}, "all presses are on one modulus"),
    ],
)
def test_what_presses_leave_open_is_a_doubt(papilla, bench, changes, doubt):
    found = json.loads(papilla("identify", bench(**changes), "--out", "f.toml", "--json").out)
    assert any(doubt in one for one in found["doubts"]) and found["status"].startswith("doubtful")


@pytest.mark.slow
def test_compare_says_fine_or_recalibrate_by_its_exit_code(papilla, bench):
    assert papilla("identify", bench(), "--out", "f.toml").code == 0
    same = papilla("identify", "log.csv", "--compare", "f.toml", "--json")
    assert same.code == 0 and json.loads(same.out)["verdict"].startswith("fine")
    moved = bench("later.csv", g1=lambda reading: reading + 500)
    other = papilla("identify", moved, "--compare", "f.toml")
    assert other.code == 1 and "recalibrate" in other.out and "zero_microstrain.g1" in other.out


def test_compare_takes_no_other_option(refused, bench):
    assert "--fix does not go with --compare" in refused("identify", bench(), "--compare", "f.toml", "--fix", "gain=1")


@pytest.mark.slow
def test_s_d_alone_and_a_specimen_in_each_row(papilla, bench, tmp_path):
    """The page and the finger of a log whose gauges were not kept, as of one on a bench that is not the design's."""
    log = bench()
    table = np.loadtxt(log, delimiter=",", skiprows=1)
    sd = (table[:, 2:7] - [5, -10, 15, 0, -20]).std(axis=1)
    lines = ["force_N,modulus_MPa,sd_microstrain,indentation_mm,specimen,thickness_mm,modulus_sigma_MPa"]
    lines += [f"{row[0]},{row[1]},{one},{row[7]},block,10,0.002" for row, one in zip(table, sd, strict=True)]
    log.write_text("\n".join(lines) + "\n")
    out, report = tmp_path / "f.toml", tmp_path / "r.html"
    answer = papilla("identify", log, "--out", out, "--report", report)
    assert answer.code == 0, answer.err
    assert "common_gain" in answer.out and "specimen_modulus.0.089" in answer.out and "Held where they" in answer.out
    finger = Finger.load(out)
    assert finger.gauges[0].membrane_gain == finger.identified.values[finger.identified.parameters.index("gain.g1")]
    assert "S_d" in report.read_text()


@pytest.mark.parametrize(
    "arguments, said",
    [
        (["--places", "0,0"], "--places goes with --suggest"),
        (["--suggest", "2", "--places", "3"], "--places must be pairs x,y in mm with spaces between, got '3'"),
    ],
)
def test_places_that_cannot_be_pressed_are_refused(papilla, bench, arguments, said):
    answer = papilla("identify", bench(), "--out", "f.toml", *arguments)
    assert answer.code == 2 and said in answer.err


@pytest.mark.parametrize("same", [True, False])
def test_a_comparison_ends_with_1_and_names_four_changes_at_most_if_the_finger_is_another(
    papilla, tmp_path, monkeypatch, same
):
    changes = [SimpleNamespace(words=f"change {k}", chi_square=10.0 + k) for k in range(6)]
    found = SimpleNamespace(presses=2, chi_square=3.0, freedom=4, probability=0.5, same=same, verdict="the verdict")
    found.changes = changes
    asked = []
    monkeypatch.setattr("papilla.identification.compare", lambda *given, progress: asked.append(given) or found)
    Finger.default().save(tmp_path / "f.toml")
    (tmp_path / "two.csv").write_text("force_N,modulus_MPa,g1,g2\n0.2,0.5,1,2\n0.3,0.5,2,3\n")
    plain = papilla("identify", "two.csv", "--compare", "f.toml")
    (finger, presses), *_ = asked
    assert finger.sha256 == Finger.default().sha256 and presses.force_N.tolist() == [0.2, 0.3]
    assert plain.code == (0 if same else 1) and "the verdict." in plain.out
    assert plain.out.count("would explain") == (0 if same else 4)
    answer = papilla("identify", "two.csv", "--compare", "f.toml", "--json")
    told = json.loads(answer.out)
    assert answer.code == plain.code and told["same"] == same and told["presses"] == 2
    assert [one["words"] for one in told["changes"]] == [one.words for one in changes]
