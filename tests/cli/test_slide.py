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
