"""What `papilla calibrate` asks of the job, and what it prints of a made-up calibration."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from made_up_sweep import make_sweep
from spring_calibration import calibration

from papilla.calibration import DEFAULT_FORCES, DEFAULT_MODULI
from papilla.calibration.fitting import job
from papilla.calibration.fitting.checking import Check, CheckedPress
from papilla.calibration.fitting.job import QUICK_FORCES, QUICK_MODULI
from papilla.cli import calibrate
from papilla.cli.calibrate import SweepOptions
from papilla.cli.options import PROCESSES
from papilla.core.errors import InputError
from papilla.identification.bench import BenchPresses
from papilla.model.finger import Finger

LOG = "force_N,modulus_MPa,g1,g2,g3,g4,g5\n0.2,0.5,1,2,3,4,5\n0.3,0.1,2,3,4,5,6\n"


@pytest.fixture
def asked(monkeypatch, tmp_path):
    """The jobs that were started; their calibration is made up, and so is the page."""
    calls = []
    force, modulus = np.array([0.2, 0.5, 0.9]), np.array([0.1, 0.2, 0.4])
    recovery = job.Recovery(force, modulus, np.array([0.11, 0.2, math.nan]))
    made = calibration()

    def done(**more):
        return job.Calibrated(made, make_sweep([0.06, 0.2], [0.2, 0.5, 0.9]), recovery, **more)

    def of_log(log, design, **how):
        calls.append((log, design, how))
        found = SimpleNamespace(
            values={"outer_modulus_MPa": 0.2, "inner_modulus_MPa": 0.05}, names=("outer_modulus_MPa",), chi_square=1.0,
            freedom=2.0,
        )  # fmt: skip
        shape = SimpleNamespace(friction="not told", physics="blocks")
        noise = SimpleNamespace(words="5")
        found.problem = SimpleNamespace(log=log, noise=noise, shapes=[shape])

        class Found(SimpleNamespace):
            def __getitem__(self, name):
                return 0.2, 0.05

        diagnosis = SimpleNamespace(intervals={"outer_modulus_MPa": (0.1, 0.3)}, status="fine", condition=3.0,
                                    influence=np.array([0.5]), profiles=[], doubts=())  # fmt: skip
        inside = np.array([True, False, True])
        bench = BenchPresses(Finger.load("published"), Found(**vars(found)), diagnosis, recovery, inside)
        return done(bench=bench)

    monkeypatch.setattr(
        "papilla.identification.bench.calibrate", lambda design, **how: calls.append((design, how)) or done()
    )
    monkeypatch.setattr("papilla.identification.bench.calibrate_bench", of_log)
    write = lambda path, done, finger, seconds, progress: path.write_text(f"{finger.name} {seconds > 0}")  # noqa: E731
    monkeypatch.setattr("papilla.calibration.fitting.page.write_report", write)
    (tmp_path / "log.csv").write_text(LOG)
    (tmp_path / "log.csv").chmod(0o444)
    return calls


def test_the_options_of_a_calibration_reach_its_job_and_its_numbers_the_json(papilla, asked, tmp_path, monkeypatch):
    compared = SimpleNamespace(scale=1.1, relative_rms=0.2, heavy_rms=0.3, press_rms=0.4, heavy_press_rms=0.5)
    monkeypatch.setattr("papilla.calibration.published.covered_comparison", lambda predict: compared)
    options = ("--friction", 0.25, "--size-mm", 1.3, "--quick", "--finger", "published", "--out", "here")
    answer = papilla("calibrate", *options, "--json")
    assert answer.code == 0, answer.err
    ((design, how),) = asked
    assert design == Finger.load("published") and (how["friction"], how["size_mm"], how["processes"]) == (
        0.25, 1.3, PROCESSES,
    )  # fmt: skip
    assert how["quick"] and (len(how["forces"]), len(how["moduli"])) == (QUICK_FORCES, QUICK_MODULI)
    found = json.loads(answer.out)
    for name, file in (("calibration", "calibration.json"), ("sweep", "sweep.csv"), ("report", "report.html")):
        assert found[name] == f"here/{file}" and (tmp_path / "here" / file).exists()
    assert (found["presses"], found["checked_presses"], found["unanswered"]) == (6, 3, 1)
    assert found["max_error"] == pytest.approx(0.1) and found["rms_error"] == pytest.approx(0.1 / math.sqrt(2))
    assert (found["bench"], found["truth"], found["export_c"], found["check"]) == (None, None, None, None)
    assert found["published"] == {"scale": 1.1, "rms": 0.2, "rms_30_100_gf": 0.3, "press_rms": 0.4,
                                  "press_rms_30_100_gf": 0.5, "depths": []}  # fmt: skip
    assert set(found["softness"]) == {"forward", "inverse", "compact"} and 0 < found["seconds"] < 600
    assert (tmp_path / "here" / "report.html").read_text() == f"{design.name} True" and "finger" not in found


def test_a_bench_is_a_finger_that_is_identified_calibrated_and_written(papilla, asked, tmp_path, monkeypatch):
    monkeypatch.setattr("papilla.calibration.published.covered_comparison", lambda predict: None)
    answer = papilla("calibrate", "--bench", "log.csv", "--json")
    assert answer.code == 0, answer.err
    ((log, design, how),) = asked
    assert log.force_N.tolist() == [0.2, 0.3] and design == Finger.default() and how["quick"] is False
    found = json.loads(answer.out)
    assert found["finger"] == "calibration/finger.toml" and found["published"] is None
    published = Finger.load("published")
    assert Finger.load(tmp_path / found["finger"]).gauges == published.gauges
    assert (tmp_path / "calibration" / "report.html").read_text() == f"{published.name} True"
    bench = found["bench"]
    assert (bench["presses"], bench["unanswered"], bench["inside_interval"]) == (2, 1, 2)
    assert bench["max_error"] == pytest.approx(0.1) and bench["status"] == "fine"
    said = " ".join(papilla("calibrate", "--bench", "log.csv").out.split())
    assert "The finger: fine; moduli 0.2 (0.1 to 0.3), 0.05 (held) MPa." in said
    assert "10 % at most, 7.07 % rms, 1 of 2 answered; the 95 % interval holds it for 2." in said
    assert "Wrote calibration/calibration.json, calibration/sweep.csv, calibration/report.html, calibration/" in said


def test_a_bench_log_may_have_s_d_alone(papilla, asked, tmp_path):
    (tmp_path / "sd.csv").write_text("force_N,modulus_MPa,sd_microstrain\n0.2,0.1,900\n0.3,0.1,1200\n")
    assert papilla("calibrate", "--bench", "sd.csv").code == 0
    assert asked[0][0].stated_sd.tolist() == [900.0, 1200.0]


def options(**parts) -> SweepOptions:
    plain = {"specimen": "block", "thickness": None, "force_range": None, "moduli": None, "quick": False}
    return SweepOptions(**plain | parts)


def test_ranges_of_a_sweep_are_even_in_the_logarithm():
    table = options(force_range=(0.1, 0.4), moduli="1,0.25").table()
    assert table["forces"] == pytest.approx(np.geomspace(0.1, 0.4, len(DEFAULT_FORCES)))
    assert table["moduli"] == pytest.approx(np.geomspace(0.25, 1, len(DEFAULT_MODULI))) and table["quick"] is False
    quick = options(quick=True, moduli="0.5,0.1,0.2").table()
    assert quick["moduli"] == (0.1, 0.2, 0.5) and quick["quick"] is True
    ends = DEFAULT_FORCES[0], DEFAULT_FORCES[-1]
    assert quick["forces"] == pytest.approx(np.geomspace(*ends, QUICK_FORCES))
    assert options(moduli="0.1,0.2,0.5").table() == {"quick": False, "moduli": (0.1, 0.2, 0.5)}


@pytest.mark.parametrize("parts, said", [
    ({"force_range": (0.5, 0.5)}, r"--force-range \(N\) must rise, got 0.5 and 0.5"),
    ({"force_range": (0.0, 0.5)}, r"--force-range \(N\) must be greater than 0"),
    ({"moduli": "0.1,0"}, r"--moduli \(MPa\) must be greater than 0, got 0"),
    ({"moduli": "0.1,0.1"}, r"--moduli \(MPa\) must rise, got 0.1 and 0.1"),
])  # fmt: skip
def test_ranges_that_do_not_rise_are_refused(parts, said):
    with pytest.raises(InputError, match=said):
        options(**parts).table()


def test_specimens_of_a_sweep_are_those_of_its_options():
    design = Finger.default()
    assert options().bench_of(design) is design
    assert options(thickness=5.0).bench_of(design).bench.thickness == 5.0
    assert options(specimen="half-space").bench_of(design).bench.thickness == math.inf
    with pytest.raises(InputError, match="--thickness is for a block, not for a half-space"):
        options(specimen="half-space", thickness=5.0).bench_of(design)


def test_a_check_shows_what_was_missed_first_and_twenty_presses(capsys):
    nan = math.nan
    good = [CheckedPress(0.1 * k, 0.5, 0.51, 0.02, 0.47, 0.55, True, "right") for k in range(1, 24)]
    bad = CheckedPress(0.98765, 0.12345, 0.34567, 0.0123, 0.3, 0.4, False, "too hard")
    none = CheckedPress(0.01, 0.5, nan, nan, nan, nan, False, "lifted")
    check = Check((*good[:12], bad, *good[12:], none), 0.05)
    calibrate._print_check(check, "c.csv")
    out = capsys.readouterr().out
    rows = [" ".join(line.replace("│", " ").split()) for line in out.splitlines() if line.startswith("│")]
    assert rows[0] == "0.9877 0.1235 0.3457 ± 0.012 0.3 to 0.4 MISSED: too hard"
    assert rows[1] == "0.01 0.5 - nan to nan MISSED: lifted" and rows[2] == "0.1 0.5 0.51 ± 0.02 0.47 to 0.55 right"
    assert len(rows) == 20 and "check: c.csv" in out
    last = "25 presses, 24 with a modulus, 2 missed (stated modulus outside the 95 % interval by more than 5 %)"
    assert out.splitlines()[-1] == last
