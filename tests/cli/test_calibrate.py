"""`papilla calibrate`: files and JSON of the main job, the way from a bench log, and what is refused."""

import csv
import json

import numpy as np
import pytest
import spring_calibration
from made_up_sweep import make_sweep

from papilla.core.tables import write_table
from papilla.logs import read_presses
from papilla.mesh import DEFAULT_SIZE_MM
from papilla.model.finger import DEFAULT_FINGER


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
    from papilla.model.file import FORMS

    told = " ".join(papilla("calibrate", "--help").out.split())
    assert f'"shape" of a design names three closed surface files beside it, as papilla/data/{SCANNED} does' in told
    assert f'kind = "surfaces", {FORMS["surfaces"]}' in told and (DEFAULT_FINGER.parent / SCANNED).exists()
    assert f"[default: {DEFAULT_SIZE_MM:g}, that of the meshes that ship]" in " ".join(told.replace("│", " ").split())


SCANNED = "surfaces_finger.toml"


@pytest.mark.slow
def test_an_element_size_reaches_the_meshes(papilla, monkeypatch):
    from papilla.calibration.fitting import job
    from papilla.core.errors import MeshError

    def prepare(finger, *, size_mm, **_):
        raise MeshError(f"asked for {size_mm:g}")

    monkeypatch.setattr(job.fem, "prepare", prepare)
    assert "asked for 1.3" in papilla("calibrate", "--size-mm", 1.3).err
    assert "asked for 0.7" in papilla("calibrate").err


@pytest.fixture
def made_up(monkeypatch):
    """A calibration that is known in closed form in the place of the long job; its presses have a stated factor."""
    from papilla.calibration.fitting import job

    def set_to(factor):
        presses = make_sweep([0.06, 0.2, 0.5], [0.2, 0.5, 0.9], lambda *_: factor)
        recovery = job.Recovery(presses.force_N, presses.modulus_MPa, presses.modulus_MPa)
        done = job.Calibrated(spring_calibration.calibration(), presses, recovery)
        monkeypatch.setattr("papilla.identification.bench.calibrate", lambda *_, **__: done)

    return set_to


def test_a_disk_that_is_full_at_the_last_file_leaves_the_old_set(papilla, made_up, tmp_path, monkeypatch):
    import errno

    from papilla.calibration.fitting import page

    def results():
        return {path.name: path.read_bytes() for path in (tmp_path / "mine").iterdir()}

    made_up(1.0)
    assert papilla("calibrate", "--out", "mine").code == 0
    old = results()

    def full(path, *_, **__):
        path.write_text("half")
        raise OSError(errno.ENOSPC, "No space left on device", str(path))

    made_up(2.0)
    monkeypatch.setattr(page, "write_report", full)
    answer = papilla("calibrate", "--out", "mine")
    assert answer.code == 2 and "cannot write mine/report.html: No space left on device" in answer.err
    assert results() == old and len(old) == 3


def test_columns_of_a_bench_log_that_are_not_used_are_named(papilla, tmp_path, monkeypatch):
    from papilla.core.errors import InputError

    def stop(log, *_, **__):
        raise InputError(f"{len(log)} presses came")

    monkeypatch.setattr("papilla.identification.bench.calibrate_bench", stop)
    write_table(tmp_path / "presses.csv", {**bench_columns(), "operator": ["A"] * 36})
    answer = papilla("calibrate", "--bench", "presses.csv")
    assert answer.err.splitlines()[0] == "presses.csv: ignored columns: operator"
    assert answer.code == 2 and "presses.csv: 36 presses came" in answer.err


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
