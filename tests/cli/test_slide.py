"""`papilla slide`: the log that `papilla estimate` reads, its truth, and what is refused."""

import json
from dataclasses import replace

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


QUICK = (*SCENE, "--seconds", 0.05, "--rate", 500, "--force", 0.005, "--friction", 0, "--finger", "dome.toml")
"""A light slide of the finger in `dome`."""


@pytest.fixture
def dome(tmp_path):
    """The default finger without ridges and with a narrow patch, whose section is prepared in a moment."""
    finger = replace(Finger.default(), ridges=None, patch_radius=2.0)
    finger.save(tmp_path / "dome.toml")
    return finger


def test_noise_is_white_as_told_and_of_its_seed(papilla, dome, tmp_path):
    logs = {}
    for noise, seed in ((0, 3), (5, 3), (5, 3), (5, 4)):
        assert papilla(*QUICK, "--noise-microstrain", noise, "--seed", seed).code == 0
        found = read_time_log(tmp_path / "log.csv").readings
        if (noise, seed) in logs:
            np.testing.assert_array_equal(found, logs[noise, seed])
        logs[noise, seed] = found
    first, second = (logs[5, seed] - logs[0, 3] for seed in (3, 4))
    assert first.std() == pytest.approx(5, rel=0.2) and abs(np.corrcoef(first.ravel(), second.ravel())[0, 1]) < 0.3
    np.testing.assert_allclose(first, 5 * np.random.default_rng(3).standard_normal(first.shape), atol=1e-3)


def test_the_truth_holds_for_the_log(papilla, dome, tmp_path):
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
    assert told["ridge_pitch_mm"] is None and told["finger_sha256"] == dome.sha256
    np.testing.assert_allclose(log.velocity_mm_s, 40)
    rest = told["at_rest"]
    gap = np.subtract(rest["reading_microstrain"], rest["added_microstrain"])
    assert rest["physics"].startswith("half-space") and np.abs(gap).max() > 0.01 * rest["sd_microstrain"]
    pairs = zip(rest["reading_microstrain"], rest["added_microstrain"], strict=True)
    numbers = [f"{reading:.0f}, {added:.0f}" for reading, added in pairs]
    pairs = zip(told["mean_microstrain"], told["sd_microstrain"], strict=True)
    numbers += [f"{mean:.0f}, {sd:.1f}" for mean, sd in pairs]
    numbers += [f"{told[name]:.4g}" for name in ("mean_force_N", "mean_depth_mm", "effective_length_mm")]
    assert all(f" {number} " in said for number in numbers)
    assert ("loss factor" in said) == (told["dynamics"] == "modal")


def test_a_held_depth_and_a_stated_dynamics(papilla, dome):
    """Without inertia no loss factor is told; the depth is the one that is held, the force what it takes."""
    held = [*QUICK[:11], "--press-depth", 0.02, *QUICK[-4:]]
    told = json.loads(papilla(*held, "--dynamics", "quasi-static", "--json").out)
    assert told["mean_depth_mm"] == pytest.approx(0.02) and told["texture"]["depth"] == 0.5
    assert told["mean_force_N"] > 0 and told["dynamics"] == "quasi-static"
    assert "loss factor" not in papilla(*held, "--dynamics", "quasi-static").out
    modal = json.loads(papilla(*held, "--dynamics", "modal", "--loss-factor", 0.3, "--json").out)
    assert modal["loss_factor"] == 0.3
    assert "loss factor 0.3" in papilla(*held, "--dynamics", "modal", "--loss-factor", 0.3).out


@pytest.mark.slow
def test_ridges_stand_on_the_skin_unless_they_are_left_out(papilla):
    told, bare = (json.loads(papilla(*QUICK[:-2], *more, "--json").out) for more in ([], ["--no-ridges"]))
    assert bare["ridge_pitch_mm"] is None and told["ridge_pitch_mm"] == 1.2


@pytest.mark.parametrize("speed", [20, 0, -20])
def test_a_slide_over_a_profile_begins_half_a_patch_inside_of_it(papilla, dome, tmp_path, speed):
    x = np.linspace(7, 67, 601)
    rows = np.column_stack([x, 0.002 * np.cos(x)])
    np.savetxt(tmp_path / "p.csv", rows, delimiter=",", header="x_mm,height_mm", comments="")
    scene = ("slide", "--profile", "p.csv", "--out", "log.csv", "--speed", speed, "--seconds", 0.05, *QUICK[-6:])
    assert papilla(*scene).code == 0
    log, inside = read_time_log(tmp_path / "log.csv"), patch_half_width(dome) / 2
    assert log.position_mm[0] == pytest.approx(7 + inside if speed >= 0 else 67 - inside)
    assert np.ptp(log.position_mm) == pytest.approx(abs(speed) * 0.05, abs=0.05)
    assert log.sample_rate_Hz == pytest.approx(1000), "unless a rate is given"
