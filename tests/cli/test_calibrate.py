"""`papilla calibrate`: files and JSON of the main job, the way from a bench log, and what is refused."""

import csv
import errno
import json
import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from spring_calibration import calibration

from papilla.calibration import Calibration
from papilla.calibration.fitting import job
from papilla.calibration.fitting.fit import with_compact
from papilla.core import seams
from papilla.core.tables import write_table
from papilla.logs import read_presses
from papilla.mesh import DEFAULT_SIZE_MM
from papilla.model.finger import DEFAULT_FINGER, Finger


def bench_columns(seed=5):
    """Presses on three specimens whose readings follow a smooth law, with a little noise."""
    rng = np.random.default_rng(seed)
    force, modulus = (grid.ravel() for grid in np.meshgrid(np.geomspace(0.1, 1, 12), [0.089, 0.51, 0.72]))
    size = 2000 * force**0.7 * modulus**0.15
    readings = size[:, None] * np.array([-0.4, -0.8, 1.5, -0.8, -0.4]) * (1 + 1e-3 * rng.normal(size=(36, 5)))
    gauges = {f"g{number}": column for number, column in enumerate(readings.T, start=1)}
    return {"force_N": force, "modulus_MPa": modulus, **gauges}


@pytest.mark.slow
def test_main_job_writes_what_its_json_names(papilla, tmp_path):
    answer = papilla("calibrate", "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    assert answer.out.count("\n") == 1, "one object and nothing else"
    assert found["max_error"] <= 0.02 and found["rms_error"] <= found["max_error"]
    assert found["checked_presses"] == 100 and found["unanswered"] == 0
    assert found["physics"] == "block 10 mm thick, friction stick, large strain included"
    assert found["dominant"] == "friction" and found["truth"]["inside_interval"] == 1.0
    assert found["truth"]["presses"] == 8 and found["truth"]["sd_max_error"]["stick"] < 0.006
    document = json.loads((tmp_path / found["calibration"]).read_text())
    assert document["schema"] == "papilla.calibration/1"
    for part in ("forward", "inverse"):
        assert found["softness"][part]["coefficients"] == document["softness"][part]["coefficients"]
    with open(tmp_path / found["sweep"], newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == found["presses"] == len({(row["force_N"], row["modulus_MPa"]) for row in rows})
    presses = read_presses(tmp_path / found["sweep"])
    assert np.unique(presses.modulus_MPa).size >= 12 and np.unique(presses.force_N).size >= 20
    assert not list((tmp_path / "calibration").glob("*.tmp"))

    again = papilla("calibrate", "--out", "again")
    assert again.code == 0
    assert (tmp_path / "again" / "sweep.csv").read_bytes() == (tmp_path / "calibration" / "sweep.csv").read_bytes()
    for text in (
        "error of E, max",
        "µε/gf²",
        "Inverse: E = ",
        "dominant: friction (one sigma of S_d: ",
        "Wrote again/calibration.json",
    ):
        assert text in again.out


def test_help_shows_how_a_finger_from_surface_files_is_written(papilla):
    from papilla.model.file import SHAPE_FORMS

    told = " ".join(papilla("calibrate", "--help").out.split())
    assert f'"shape" of a design names three closed surface files beside it, as papilla/data/{SCANNED} does' in told
    assert f'kind = "surfaces", {SHAPE_FORMS["surfaces"]}' in told and (DEFAULT_FINGER.parent / SCANNED).exists()
    assert f"[default: {DEFAULT_SIZE_MM:g}, that of the meshes that ship]" in " ".join(told.replace("│", " ").split())


SCANNED = "surfaces_finger.toml"


QUICK = (
    "--quick",
    "--moduli",
    "0.05,1",
    "--force-range",
    0.05,
    0.6,
    "--size-mm",
    2.8,
    "--friction",
    0,
    "--thickness",
    8,
)


@pytest.fixture(scope="module")
def quick(tmp_path_factory):
    """A folder with what a quick calibration on a coarse mesh writes, and its JSON."""
    folder = tmp_path_factory.mktemp("quick")
    command = [sys.executable, "-m", "papilla", "calibrate", *map(str, QUICK), "--export-c", "f.h", "--json"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return folder, json.loads(done.stdout)


def presses_of(folder):
    """The presses of a sweep that the model answered; a coarse mesh has none for the largest contacts."""
    lines = (folder / "calibration" / "sweep.csv").read_text().splitlines()
    (folder / "answered.csv").write_text(
        "\n".join(line for line in lines if ",nan" not in line and ",," not in line) + "\n"
    )
    return read_presses(folder / "answered.csv")


@pytest.mark.slow
def test_the_options_of_a_calibration_reach_its_presses_and_files(quick):
    folder, found = quick
    assert {path.name for path in (folder / "calibration").iterdir()} == {
        "calibration.json",
        "sweep.csv",
        "report.html",
    }
    sweep = presses_of(folder)
    assert found["physics"] == "block 8 mm thick, friction 0.0, large strain included"
    assert (sweep.modulus_MPa.min(), sweep.modulus_MPa.max()) == pytest.approx((0.05, 1.0))
    assert sweep.force_N.min() == pytest.approx(0.05) and sweep.force_N.max() == pytest.approx(0.6)
    steps = [np.diff(np.log(np.unique(column))) for column in (sweep.force_N, sweep.modulus_MPa)]
    assert all(np.ptp(one) < 1e-6 for one in steps), "even in the logarithm"
    assert (found["bench"], found["truth"], found["check"]) == (None, None, None) and job.QUICK_NOTE in found["notes"]
    assert found["rms_error"] <= found["max_error"] < 0.1 and found["export_c"] == "f.h"
    assert "papilla_modulus_MPa" in (folder / "f.h").read_text()
    made = Calibration.load(folder / found["calibration"])
    assert made.domain["modulus_MPa"] == pytest.approx((0.05, 1.0)) and made.provenance["physics"] == found["physics"]
    assert found["softness"]["forward"]["coefficients"] == pytest.approx(list(made.forward.coefficients))
    # The gauges of the sweep lead back to its moduli
    inner = (sweep.modulus_MPa > 0.1) & (sweep.modulus_MPa < 0.6) & (sweep.force_N > 0.1)
    back = made.invert(sweep.readings.std(axis=1)[inner], sweep.force_N[inner]).modulus_MPa
    answered = np.isfinite(back)
    assert answered.mean() > 0.5
    assert np.median(np.abs(back / sweep.modulus_MPa[inner] - 1)[answered]) < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("factor, least, most", [(1.0, 0.0, 0.25), (5.0, 0.6, 1.0)])
def test_a_check_passes_what_it_recovers_and_names_what_it_misses(papilla, quick, tmp_path, factor, least, most):
    sweep = presses_of(quick[0])
    some = np.flatnonzero((sweep.modulus_MPa > 0.1) & (sweep.modulus_MPa < 0.6) & (sweep.force_N > 0.2))[::9]
    gauges = {f"g{k + 1}": column[some] for k, column in enumerate(sweep.readings.T)}
    write_table(
        tmp_path / "[c].csv",
        {"force_N": sweep.force_N[some], "modulus_MPa": factor * sweep.modulus_MPa[some], **gauges},
    )
    answer = papilla("calibrate", *QUICK, "--check", "[c].csv")
    missed = answer.out.count("MISSED")
    assert answer.code == (missed > 0) and "check: [c].csv" in answer.out
    assert least <= missed / len(some) <= most
    found = json.loads(papilla("calibrate", *QUICK, "--check", "[c].csv", "--json").out)["check"]
    assert (found["presses"], found["passed"]) == (len(some), not missed)


@pytest.mark.slow
@pytest.mark.parametrize("steps", [0, 1, 2])
def test_a_disk_that_fails_at_a_file_leaves_no_mixture(papilla, quick, tmp_path, monkeypatch, steps):
    assert papilla("calibrate", *QUICK, "--out", "mine").code == 0
    moved, replace_file = [], seams.replace

    def full(source, target):
        if "mine" in str(target):
            if len(moved) == steps:
                raise OSError(errno.ENOSPC, "No space left on device", str(source))
            moved.append(target)
        replace_file(source, target)

    before = {path.name: path.read_bytes() for path in (tmp_path / "mine").iterdir()}
    monkeypatch.setattr(seams, "replace", full)
    answer = papilla("calibrate", *QUICK, "--moduli", "0.06,1", "--out", "mine")
    assert answer.code == 2 and "No space left on device" in answer.err.splitlines()[-1]
    after = {path.name: path.read_bytes() for path in (tmp_path / "mine").iterdir()}
    same = [name for name, content in after.items() if content == before[name]]
    assert len(same) in (0, len(after)) and not any("tmp" in name for name in after), "old and new are never mixed"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--moduli", "0.1"), "--moduli needs the two ends of a range, or three or more moduli"),
        (("--moduli", "a,b"), "--moduli must be numbers in MPa with commas, got 'a'"),
        (("--moduli", "0.1,0"), "--moduli (MPa) must be greater than 0, got 0"),
        (("--moduli", "0.1,0.1"), "--moduli (MPa) must rise, got 0.1 and 0.1"),
        (("--force-range", 1, 0.5), "--force-range (N) must rise, got 1 and 0.5"),
        (("--force-range", 0, 0.5), "--force-range (N) must be greater than 0"),
        (("--specimen", "half-space", "--thickness", 5), "--thickness is for a block, not for a half-space"),
        (("--specimen", "sphere"), "'sphere' is not one of"),
        (("--thickness", 0), "--thickness (mm) must be greater than 0, got 0"),
        (("--bench", "p.csv", "--specimen", "half-space"), "leave out --specimen half-space"),
    ],
)
def test_what_does_not_go_together_is_refused(refused, arguments, message):
    assert message in refused("calibrate", *arguments)


def test_a_check_of_other_gauges_is_refused_before_the_work(refused, tmp_path):
    (tmp_path / "three.csv").write_text("force_N,modulus_MPa,g1,g2,g3\n0.5,0.1,1,2,3\n0.6,0.1,1,2,4\n")
    assert "3 gauges" in refused("calibrate", "--check", "three.csv")
    assert "overwrite" in refused("calibrate", "--bench", "three.csv", "--export-c", "three.csv")


def test_a_stored_calibration_is_exported_as_c(papilla, refused, tmp_path):
    with_compact(calibration()).save(tmp_path / "c.json")
    (tmp_path / "c.json").chmod(0o444)
    assert papilla("export-c", "c.json", "--out", "f.h", "--real", "float").code == 0
    text = (tmp_path / "f.h").read_text()
    assert "typedef float papilla_real;" in text and "papilla_softness" in text
    assert "would overwrite the input" in refused("export-c", "c.json", "--out", "c.json")
    assert "cannot read" in refused("export-c", "d.json", "--out", "g.h")


def test_a_bench_of_half_spaces_is_written_and_read(tmp_path):
    finger = Finger.default()
    flat = replace(finger, bench=replace(finger.bench, thickness=math.inf))
    flat.save(tmp_path / "f.toml")
    assert "thickness_mm = inf" in (tmp_path / "f.toml").read_text(encoding="utf-8")
    assert Finger.load(tmp_path / "f.toml") == flat


@pytest.mark.parametrize(
    "options, message",
    [
        (["--finger", "nowhere.toml"], "cannot read finger file nowhere.toml"),
        (["--bench", "nowhere.csv"], "cannot read nowhere.csv"),
        (["--size-mm", "0"], "--size-mm must be greater than 0, got 0"),
        (["--size-mm", "nan"], "--size-mm must be finite, got nan"),
        (["--friction", "-1"], 'friction must be a number of at least 0 or "stick", got -1'),
        (["--bench", "nan.csv"], "nan.csv, line 5, column g2: expected a finite number, got nan"),
        (["--bench", "one.csv"], "one.csv has one row"),
        (["--bench", "beside.csv"], "beside.csv: press 2 is beside the apex, where S_d differs: papilla identify"),
        (["--bench", "few.csv"], "few.csv: the log has 4 gauges (g1, g2, g3, g4), the finger"),
        (["--out", "file.txt"], "cannot write to folder file.txt: File exists"),
        (["--out", "file.txt/below"], "cannot write to folder file.txt/below: Not a directory"),
    ],
)
def test_unusable_input(refused, tmp_path, options, message):
    columns = bench_columns()
    columns["g2"][3] = np.nan
    write_table(tmp_path / "nan.csv", columns)
    write_table(tmp_path / "one.csv", {name: values[:1] for name, values in columns.items()})
    columns = bench_columns()
    write_table(tmp_path / "beside.csv", columns | {"x_mm": np.arange(36.0), "y_mm": np.zeros(36)})
    write_table(tmp_path / "few.csv", {name: values for name, values in columns.items() if name != "g5"})
    (tmp_path / "file.txt").write_text("")
    assert message in refused("calibrate", *options)
