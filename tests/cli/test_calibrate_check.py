"""`papilla calibrate --check` and `--export-c`: exit codes, what is written, what is refused before the work."""

import json

import numpy as np
import pytest
from made_up_sweep import make_sweep
from spring_calibration import calibration

from papilla.calibration.fitting import job
from papilla.calibration.fitting.fit import with_compact
from papilla.logs import PressLog, read_presses

PATTERN = np.array([-1.0, 1.0, -1.0, 1.0, 0.0]) / np.sqrt(0.8)


@pytest.fixture
def made(monkeypatch, tmp_path):
    """A calibration that is known in closed form in the place of the long job; writes presses with a stated factor."""
    finger = calibration()
    force, modulus = (part.ravel() for part in np.meshgrid([0.2, 0.5, 0.9], [0.06, 0.2, 0.5]))
    readings = finger.predict(force, modulus)[:, None] * PATTERN
    names = tuple(f"g{k}" for k in range(1, 6))
    recovery = job.Recovery(force, modulus, modulus)
    presses = make_sweep([0.06, 0.2, 0.5], [0.2, 0.5, 0.9])
    monkeypatch.setattr(
        "papilla.identification.bench.calibrate", lambda *_, **__: job.Calibrated(finger, presses, recovery)
    )

    def write(name, factor=1.0):
        PressLog(force, modulus * factor, readings, names).to_csv(tmp_path / name)
        return name

    return write


def test_presses_that_are_recovered_pass_and_the_header_is_written(papilla, made, tmp_path):
    done = papilla("calibrate", "--check", made("c.csv"), "--export-c", "f.h", "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["check"]["passed"] and found["check"]["presses"] == found["check"]["answered"] == 9
    assert found["export_c"] == "f.h" and "papilla_modulus_MPa" in (tmp_path / "f.h").read_text()


def test_presses_with_s_d_alone_are_checked(papilla, made, tmp_path):
    log = read_presses(made("c.csv"))
    rows = [f"{f},{e},{sd}" for f, e, sd in zip(log.force_N, log.modulus_MPa, log.sd_microstrain, strict=True)]
    (tmp_path / "sd.csv").write_text("\n".join(["force_N,modulus_MPa,sd_microstrain", *rows]) + "\n")
    done = papilla("calibrate", "--check", "sd.csv", "--json")
    assert done.code == 0, done.err
    assert json.loads(done.out)["check"]["answered"] == 9


def test_presses_that_are_not_recovered_end_with_exit_code_1_and_are_named(papilla, made):
    done = papilla("calibrate", "--check", made("c.csv", 1.5))
    assert done.code == 1 and "MISSED" in done.out and "9 presses, 9 with a modulus" in done.out


def test_a_file_with_brackets_in_its_name_is_named_as_it_is(papilla, made):
    done = papilla("calibrate", "--check", made("[new]c.csv"))
    assert done.code == 0 and "check: [new]c.csv" in done.out, done.err


def test_a_check_of_other_gauges_is_refused_before_the_work(refused, tmp_path):
    (tmp_path / "three.csv").write_text("force_N,modulus_MPa,g1,g2,g3\n0.5,0.1,1,2,3\n0.6,0.1,1,2,4\n")
    assert "3 gauges" in refused("calibrate", "--check", "three.csv")


def test_neither_overwrites_what_is_read(refused, made):
    assert "overwrite" in refused("calibrate", "--bench", made("log.csv"), "--export-c", "log.csv")


def test_a_stored_calibration_is_exported_as_c(papilla, refused, tmp_path):
    with_compact(calibration()).save(tmp_path / "c.json")
    (tmp_path / "c.json").chmod(0o444)
    assert papilla("export-c", "c.json", "--out", "f.h", "--real", "float").code == 0
    text = (tmp_path / "f.h").read_text()
    assert "typedef float papilla_real;" in text and "papilla_softness" in text
    assert "would overwrite the input" in refused("export-c", "c.json", "--out", "c.json")
    assert "cannot read" in refused("export-c", "d.json", "--out", "g.h")
