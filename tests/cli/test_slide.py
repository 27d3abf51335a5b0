"""`papilla slide`: the log that `papilla estimate` reads, its truth, and what is refused."""

import dataclasses
import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.fem import Motion, Slide
from papilla.logs import read_time_log
from papilla.mesh.section import patch_half_width
from papilla.model.finger import Finger, Ridges
from papilla.model.specimen import Grating

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
def test_noise_is_added_as_told(papilla, tmp_path):
    logs = []
    for noise in (0, 5):
        assert papilla(*SCENE, "--seconds", 0.2, "--force", 0.05, "--noise-microstrain", noise).code == 0
        logs.append(read_time_log(tmp_path / "log.csv").readings)
    assert (logs[1] - logs[0]).std() == pytest.approx(5, rel=0.2)


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
def test_bad_scenes_are_one_line(refused, options, message, monkeypatch):
    # What is wrong with a scene is said before anything is condensed
    monkeypatch.setattr("papilla.fem.sliding.section.SectionModel.condense", None)
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


@pytest.fixture
def made(monkeypatch):
    """A slide of four samples in place of one that takes seconds; `made` says what was asked for, and gives its parts
    other values."""
    asked, changed = {}, {}

    def slide(design, texture, motion, **how):
        asked.update(design=design, texture=texture, motion=motion, **how)
        motion = Motion(np.arange(4) / 500, 5.0 + 30 * np.arange(4) / 500, 500.0)
        signals = np.array([[1.0, -2.0], [3.0, -2.0], [5.0, 2.0], [7.0, 2.0]])
        state = np.array([[0, 2], [0, 1], [1, 1], [1, 1]])
        fields = dict.fromkeys(field.name for field in dataclasses.fields(Slide))
        fields |= {
            "motion": motion, "gauge_names": ("left", "right"), "readings": 2 * signals, "amplified": signals,
            "force_N": np.array([0.1, 0.2, 0.3, 0.6]), "tangential_N": np.array([0.0, 0.1, 0.1, 0.1]),
            "depth_mm": np.array([0.4, 0.5, 0.6, 0.7]), "state": state, "pressing": np.abs(state) + 0.0,
            "length_mm": 9.5, "friction": 0.5, "dynamics": "modal", "why": "fast", "ridge_pitch_mm": 0.0,
            "loss_factor": 0.125, "loss_from": "stated", "first_mode_Hz": 800.0, "highest_Hz": 90.0, "relaxed": 3,
            "unresolved": 4, "energy_error": math.nan, "in_groove_mm": 0.01, "flank_push": 0.02, "seconds": 1.25,
            "status": "ok",
        }  # fmt: skip
        return Slide(**fields | changed)

    monkeypatch.setattr("papilla.fem.slide", slide)
    return SimpleNamespace(asked=asked, changed=changed)


def test_the_options_of_a_slide_reach_it_and_its_signals_the_log(papilla, made, tmp_path):
    stated = ("--seconds", 0.2, "--rate", 500, "--friction", 0.4, "--dynamics", "modal", "--loss-factor", 0.3)
    answer = papilla(*SCENE, *stated, "--depth", 0.2, "--form", "sine", "--json")
    assert answer.code == 0, answer.err
    asked = made.asked
    assert asked["texture"] == Grating(0.9, 0.9, 0.2, "sine") and asked["design"] == Finger.default()
    assert asked["motion"].position_mm == pytest.approx(40 * np.arange(100) / 500)
    assert (asked["force"], asked["depth"], asked["friction"]) == (0.3, None, 0.4)
    assert (asked["dynamics"], asked["loss_factor"]) == ("modal", 0.3)
    told = json.loads(answer.out)
    assert json.loads((tmp_path / "log.truth.json").read_text()) == told
    expected = {
        "schema": "papilla.slide/1", "wavelength_mm": 1.8, "ridge_pitch_mm": None, "gauges": ["left", "right"],
        "samples": 4, "rate_Hz": 500.0, "mean_force_N": pytest.approx(0.3), "mean_depth_mm": pytest.approx(0.55),
        "effective_length_mm": 9.5, "at_rest": None, "mean_microstrain": [4.0, 0.0],
        "sd_microstrain": pytest.approx([math.sqrt(5), 2.0]), "relaxed_steps": 3, "unresolved_steps": 4,
        "flank_push_of_force": 0.02, "energy_error": None, "in_groove_mm": 0.01, "friction": 0.5, "seed": 0,
        "noise_microstrain": 0.0, "log": "log.csv", "truth": "log.truth.json", "finger": Finger.default().name,
        "finger_sha256": Finger.default().sha256, "loss_factor": 0.125, "loss_from": "stated",
    }  # fmt: skip
    assert {name: told[name] for name in expected} == expected
    assert told["texture"] == {"kind": "grating", "groove": 0.9, "ridge": 0.9, "depth": 0.2, "form": "sine", "flank": 0}
    log = read_time_log(tmp_path / "log.csv")
    assert log.readings.tolist() == [[1, -2], [3, -2], [5, 2], [7, 2]] and log.force_N.tolist() == [0.1, 0.2, 0.3, 0.6]
    assert log.tangential_N.tolist() == [0.0, 0.1, 0.1, 0.1] and log.position_mm == pytest.approx(5 + 30 * log.t_s)
    assert log.velocity_mm_s == pytest.approx([30.0] * 4)


@pytest.mark.parametrize(
    "state, since, share", [([[0, 0]] * 4, None, 0), ([[0, 2], [2, 1], [1, 1], [1, 1]], 0.004, 0.5)]
)
def test_sliding_begins_when_nothing_sticks_any_more(papilla, made, state, since, share):
    made.changed["state"] = np.array(state)
    answer = papilla(*SCENE, "--seconds", 0.2, "--json")
    told = json.loads(answer.out)
    assert told["share_fully_sliding"] == share
    assert told["fully_sliding_from_s"] == (None if since is None else pytest.approx(since))


def test_noise_of_a_slide_is_white_and_of_its_seed(papilla, made, tmp_path):
    made.changed["amplified"] = np.zeros((4, 2))
    logs = []
    for seed in (3, 3, 4):
        assert papilla(*SCENE, "--seconds", 0.2, "--noise-microstrain", 2, "--seed", seed).code == 0
        logs.append(read_time_log(tmp_path / "log.csv").readings)
    assert (logs[0] == logs[1]).all() and (logs[0] != logs[2]).all()
    assert logs[0] == pytest.approx(2 * np.random.default_rng(3).standard_normal((4, 2)))


def test_a_slide_has_its_default_depths_and_ridges(papilla, made, tmp_path, monkeypatch):
    films = []
    film = lambda path, design, texture, found: films.append((path.name, texture))  # noqa: E731
    monkeypatch.setattr("papilla.view.slide_movie.write_slide_movie", film)
    scene = (*SCENE, "--seconds", 0.2)
    assert papilla(*scene, "--press-depth", 0.4, "--no-ridges", "--movie", "m.GIF").code == 0
    assert (made.asked["force"], made.asked["depth"], made.asked["texture"].depth) == (None, 0.4, 0.5)
    assert made.asked["design"].ridges is None and films == [("m.GIF", made.asked["texture"])]
    ridged = replace(Finger.default(), ridges=Ridges(1.5, 0.5, 0.2))
    ridged.save(tmp_path / "f.toml")
    assert papilla(*scene, "--finger", "f.toml").code == 0 and made.asked["design"].ridges == ridged.ridges
    assert papilla(*scene, "--finger", "f.toml", "--no-ridges").code == 0 and made.asked["design"].ridges is None
    assert (made.asked["friction"], made.asked["loss_factor"], made.asked["dynamics"]) == (None, None, "auto")


@pytest.mark.parametrize("speed, begin", [(20, 7.5), (0, 7.5), (-20, 52.5)])
def test_a_slide_over_a_profile_begins_inside_of_it(papilla, made, tmp_path, speed, begin):
    """Half the half width of the patch, 15 mm on the default finger, inside the end."""
    x = np.linspace(0, 60, 601)
    rows = np.column_stack([x, 0.1 * np.cos(x)])
    np.savetxt(tmp_path / "p.csv", rows, delimiter=",", header="x_mm,height_mm", comments="")
    scene = ("slide", "--profile", "p.csv", "--out", "log.csv", "--speed", speed, "--seconds", 0.1)
    told = json.loads(papilla(*scene, "--json").out)
    assert told["texture"] == {"kind": "profile", "span_mm": [0.0, 60.0]} and told["wavelength_mm"] is None
    inside = patch_half_width(Finger.default()) / 2
    assert made.asked["motion"].position_mm[0] == pytest.approx(inside if speed >= 0 else 60 - inside)
    assert made.asked["motion"].position_mm[-1] == pytest.approx(made.asked["motion"].position_mm[0] + speed * 0.099)
    assert "wavelength" in papilla(*scene).out


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
def test_what_describes_no_slide_is_refused(refused, made, options, said):
    assert said in refused("slide", "--out", "log.csv", *options)
