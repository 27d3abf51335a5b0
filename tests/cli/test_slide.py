"""`papilla slide`: the log that `papilla estimate` reads, its truth, and what is refused."""

import json

import numpy as np
import pytest

from papilla.logs import read_time_log
from papilla.mesh.section import patch_half_width
from papilla.model.finger import Finger

SCENE = ["slide", "--groove", 0.9, "--ridge", 0.9, "--speed", 40, "--out", "log.csv"]
SLAB = """
name = "small slab"
patch_radius_mm = 6.0
[shape]
kind = "slab"
outer_mm = [24.0, 20.0]
interface_mm = [21.0, 17.0]
bone_mm = [10.0, 6.0]
depth_mm = 6.0
[outer]
modulus_MPa = 0.136
[inner]
modulus_MPa = 0.034
[[gauges]]
name = "left"
angle_deg = -20.0
[[gauges]]
name = "right"
angle_deg = 20.0
"""


@pytest.fixture
def slab(tmp_path):
    (tmp_path / "slab.toml").write_text(SLAB)
    return ["--finger", "slab.toml"]


@pytest.mark.slow
def test_the_log_is_read_and_its_truth_stands_beside_it(papilla, tmp_path):
    answer = papilla(*SCENE, "--seconds", 0.2, "--friction", 0.4, "--force", 0.05, "--json")
    assert answer.code == 0, answer.err
    told = json.loads(answer.out)
    truth = json.loads((tmp_path / "log.truth.json").read_text())
    assert truth == told
    assert truth["schema"] == "papilla.slide/1"
    assert truth["wavelength_mm"] == pytest.approx(1.8)
    assert truth["ridge_pitch_mm"] == 1.2
    assert len(truth["gauges"]) == 5
    assert truth["mean_force_N"] == pytest.approx(0.05)
    log = read_time_log(tmp_path / "log.csv")
    assert log.gauge_names == ("g1", "g2", "g3", "g4", "g5")
    assert len(log) == 200 == truth["samples"]
    assert log.sample_rate_Hz == pytest.approx(1000)
    np.testing.assert_allclose(log.velocity_mm_s, 40, rtol=1e-9)
    np.testing.assert_allclose(log.tangential_N[-20:] / log.force_N[-20:], 0.4, rtol=1e-6)
    assert truth["fully_sliding_from_s"] < 0.1


@pytest.mark.slow
def test_at_rest_it_says_what_press_says(papilla):
    answer = papilla(
        "slide", "--groove", 5, "--ridge", 60, "--speed", 0, "--seconds", 0.05, "--out", "log.csv", "--json"
    )
    rest = json.loads(answer.out)["at_rest"]
    pressed = papilla("press", "--modulus", 1e4, "--specimen", "half-space", "--force", 0.3, "--json")
    told = json.loads(pressed.out)
    for key in ("friction", "large_strain", "physics", "sd_microstrain", "indentation_mm", "reading_microstrain"):
        assert rest[key] == told[key]
    assert rest["added_microstrain"]
    log = read_time_log("log.csv")
    np.testing.assert_allclose(log.readings[-1], told["reading_microstrain"], rtol=1e-6)


@pytest.mark.slow
def test_a_motion_and_a_profile_come_from_files(papilla, slab, tmp_path):
    t = np.linspace(0, 0.2, 21)
    np.savetxt(
        tmp_path / "m.csv", np.column_stack([t, 20 + 30 * t]), delimiter=",", header="t_s,position_mm", comments=""
    )
    x = np.linspace(0, 60, 601)
    rows = np.column_stack([x, 0.1 * np.cos(2 * np.pi * x / 2)])
    np.savetxt(tmp_path / "p.csv", rows, delimiter=",", header="x_mm,height_mm", comments="")
    scene = ["slide", "--profile", "p.csv", "--motion", "m.csv", "--press-depth", 0.2, "--out", "log.csv", *slab]
    scene += ["--friction", 0]  # One table of large strain of the slab instead of two
    answer = papilla(*scene, "--json")
    assert answer.code == 0, answer.err
    truth = json.loads(answer.out)
    assert truth["texture"] == {"kind": "profile", "span_mm": [0.0, 60.0]}
    assert truth["wavelength_mm"] is None
    log = read_time_log(tmp_path / "log.csv")
    np.testing.assert_allclose(log.position_mm, 20 + 30 * log.t_s, atol=1e-9)
    assert np.ptp(log.force_N) > 0, "at a held depth the force follows the profile"


@pytest.mark.parametrize(
    "options, message",
    [
        (["--seconds", 1, "--force", -1], "force (N) must be greater than 0"),
        (["--seconds", 0], "seconds must be greater than 0"),
        ([], "--speed needs --seconds"),
        (["--seconds", 1, "--friction", -0.5], "friction must lie between 0 and 3"),
        (["--seconds", 1, "--rate", 0], "rate (Hz) must lie between"),
        (["--seconds", 1, "--noise-microstrain", -1], "--noise-microstrain must lie between"),
        (["--seconds", 1, "--force", 0.1, "--press-depth", 0.1], "give one of --force and --press-depth"),
        (["--seconds", 1, "--profile", "p.csv"], "describe a grating: not with --profile"),
        (["--seconds", 1, "--motion", "m.csv"], "give exactly one of --speed (mm/s) and --motion"),
        (["--seconds", 1, "--depth", 0], "grating depth (mm) must be greater than 0"),
        (["--seconds", 1e9], "more than 2,000,000 samples"),
        (["--seconds", 1, "--seed", -1], "--seed must be at least 0"),
        (["--seconds", 1, "--speed", 1e5], "speed (mm/s) must lie between -10000 and 10000"),
    ],
)
def test_bad_scenes_are_one_line(refused, options, message):
    assert message in refused(*SCENE, *options)


@pytest.mark.parametrize(
    "name, text, message",
    [
        ("p", "x_mm,height_mm\n0,0\n", "needs three points at least, got 1"),
        ("p", "x_mm,height_mm\n0,0\n0.1,\n0.2,0\n", "point 2 of the profile is not finite"),
        ("p", "x_mm,height_mm\n0,0\n0.1,0\n0.2,0\n9,0\n", "the profile has a gap from x_mm 0.2 to 9"),
        ("p", "x_mm,height_mm\n0,0\n0.1,0\n0.1,0\n", "x_mm of a profile must rise"),
        ("p", "x_mm,height_mm\n0,0\n100,50\n200,0\n", "are x_mm and height_mm in mm?"),
        ("p", "x_mm,height_mm\n0,0\n1e-4,0\n2e-4,0\n", "a profile of 0.0002 mm is shorter than a contact: are x_mm"),
        ("p", "x,y\n0,0\n", "column x_mm is missing"),
        ("m", "t_s,position_mm\n0,0\n", "needs two points at least"),
        ("m", "t_s,position_mm\n0,0\n1,1\n1,2\n", "times of a motion must rise: point 3"),
        ("m", "t_s,position_mm\n0,0\n0.001,1\n0.002,1\n5,1\n", "the motion has a gap"),
        ("m", "t_s,x\n0,0\n", "column position_mm is missing"),
    ],
)
def test_bad_files_are_one_line_with_the_file(refused, tmp_path, name, text, message):
    (tmp_path / "p.csv").write_text("x_mm,height_mm\n0,0\n1,0\n2,0\n")
    (tmp_path / "m.csv").write_text("t_s,position_mm\n0,0\n1,1\n")
    (tmp_path / f"{name}.csv").write_text(text)
    line = refused("slide", "--profile", "p.csv", "--motion", "m.csv", "--out", "log.csv")
    assert message in line
    assert f"{name}.csv" in line


def test_an_input_is_not_overwritten(refused, tmp_path):
    (tmp_path / "log.csv").write_text("t_s,position_mm\n0,0\n1,1\n")
    assert "would overwrite the input" in refused(
        "slide", "--motion", "log.csv", "--groove", 1, "--ridge", 1, "--out", "log.csv"
    )


@pytest.mark.parametrize(
    "options, said",
    [
        (["--groove", 1], "give --groove and --ridge (mm), or --profile with a file"),
        (["--ridge", 1], "give --groove and --ridge (mm), or --profile with a file"),
        (["--profile", "p.csv", "--ridge", 1], "not with --profile"),
        (["--profile", "p.csv", "--depth", 1], "not with --profile"),
        (["--profile", "p.csv", "--form", "sine"], "not with --profile"),
        (["--profile", "p.csv", "--flank", 1], "not with --profile"),
        (["--groove", 1, "--ridge", 1, "--movie", "m.mp4"], "--movie m.mp4: a moving picture is written as .gif"),
        (["--groove", 1, "--ridge", 1, "--seconds", 1], "give exactly one of --speed (mm/s) and --motion"),
    ],
)
def test_what_describes_no_slide_is_refused(refused, options, said):
    assert said in refused("slide", "--out", "log.csv", *options)


QUICK = (*SCENE, "--seconds", 0.05, "--rate", 500, "--force", 0.05, "--friction", 0)


@pytest.mark.slow
def test_noise_is_white_as_told_and_of_its_seed(papilla, tmp_path):
    logs = {}
    for noise, seed in ((0, 3), (5, 3), (5, 3), (5, 4)):
        assert papilla(*QUICK, "--noise-microstrain", noise, "--seed", seed).code == 0
        found = read_time_log(tmp_path / "log.csv").readings
        if (noise, seed) in logs:
            np.testing.assert_array_equal(found, logs[noise, seed])
        logs[noise, seed] = found
    one, other = (logs[5, seed] - logs[0, 3] for seed in (3, 4))
    assert one.std() == pytest.approx(5, rel=0.2) and abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 0.3


@pytest.mark.slow
def test_the_truth_holds_for_the_log(papilla, tmp_path):
    told = json.loads(papilla(*QUICK, "--depth", 0.2, "--form", "sine", "--json").out)
    assert json.loads((tmp_path / "log.truth.json").read_text()) == told
    log = read_time_log(tmp_path / "log.csv")
    assert told["samples"] == len(log) and told["mean_force_N"] == pytest.approx(log.force_N.mean())
    np.testing.assert_allclose(told["mean_microstrain"], log.readings.mean(axis=0), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(told["sd_microstrain"], log.readings.std(axis=0), rtol=1e-5)
    assert told["texture"] == {"kind": "grating", "groove": 0.9, "ridge": 0.9, "depth": 0.2, "form": "sine", "flank": 0}
    assert told["wavelength_mm"] == pytest.approx(1.8) and np.ptp(log.position_mm) == pytest.approx(40 * 24 / 500)
    said = " ".join(papilla(*QUICK, "--depth", 0.2, "--form", "sine").out.split())
    assert "1.8" in said and "25 samples at 500 Hz in log.csv; truth in log.truth.json" in said
    bare = json.loads(papilla(*QUICK, "--no-ridges", "--json").out)
    assert bare["ridge_pitch_mm"] is None and told["ridge_pitch_mm"] == 1.2


@pytest.mark.slow
@pytest.mark.parametrize("speed", [20, 0, -20])
def test_a_slide_over_a_profile_begins_half_a_patch_inside_of_it(papilla, tmp_path, speed):
    x = np.linspace(0, 60, 601)
    rows = np.column_stack([x, 0.1 * np.cos(x)])
    np.savetxt(tmp_path / "p.csv", rows, delimiter=",", header="x_mm,height_mm", comments="")
    scene = ("slide", "--profile", "p.csv", "--out", "log.csv", "--speed", speed, "--seconds", 0.05, *QUICK[-4:])
    assert papilla(*scene).code == 0
    position, inside = read_time_log(tmp_path / "log.csv").position_mm, patch_half_width(Finger.default()) / 2
    assert position[0] == pytest.approx(inside if speed >= 0 else 60 - inside)
    assert np.ptp(position) == pytest.approx(abs(speed) * 0.05, abs=0.05)
