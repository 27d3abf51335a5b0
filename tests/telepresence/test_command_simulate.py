"""`papilla telepresence simulate` on short runs: what its options change, what is written, what is refused."""

import json

import numpy as np
import pytest
from spring_calibration import calibration

from papilla.core.errors import InputError
from papilla.telepresence.cli.options import SoftOptions

SHORT = ("telepresence", "simulate", "--seconds", 2, "--round-trip-sd-ms", 0)


@pytest.mark.slow
@pytest.mark.parametrize("trip_ms", [40, 160])
def test_local_feedback_has_no_lag_and_direct_feedback_that_of_the_link(papilla, tmp_path, trip_ms):
    options = ("--round-trip-ms", trip_ms, "--wavelength", 2, "--seed", 9, "--out", "shown.csv", "--html", "play.html")
    answer = papilla(*SHORT, *options, "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    assert abs(found["lag_ms"]["local"]) < 1 and found["lag_ms"]["direct"] == pytest.approx(trip_ms, abs=3)
    assert found["bytes_per_s"]["local"] < 0.5 * found["bytes_per_s"]["direct"]
    assert found["bytes_per_s_with_headers"]["local"] > found["bytes_per_s"]["local"]
    assert (found["seconds"], found["seed"], found["page"]) == (2.0, 9, "play.html")
    line = found["told"]["wavelength_mm"]
    assert line["true"] == 2.0 and abs(line["value"] - 2.0) < 4 * line["sigma"] + 0.02
    for status in found["status"].values():
        assert sum(status.values()) == pytest.approx(1)
    rows = np.genfromtxt(tmp_path / "shown.csv", delimiter=",", names=True)
    assert len(rows) == 2000 and (rows["true_wavelength_mm"] == 2.0).all()
    np.testing.assert_allclose(rows["round_trip_ms"][500:][np.isfinite(rows["round_trip_ms"][500:])], trip_ms, atol=2)
    assert str(trip_ms) in (tmp_path / "play.html").read_text(encoding="utf-8")
    again = json.loads(papilla(*SHORT, *options, "--json").out)
    assert again == found, "of its seed"


def test_wavelengths_that_nobody_looks_for_are_said(papilla):
    for wavelength, said in ((0.3, True), (7.0, True), (0.4, False), (6.0, False)):
        answer = papilla("telepresence", "simulate", "--wavelength", wavelength, "--seconds", 0.6)
        assert (f"a wavelength of {wavelength:g} mm" in answer.err) == said, answer.err


def test_a_soft_specimen_has_its_defaults_and_lies_within_the_calibration(tmp_path):
    calibration((0.02, 5.0)).save(tmp_path / "c.json")
    soft = SoftOptions(tmp_path / "c.json", None, None, None, None).soft()
    assert (soft.modulus_MPa, soft.friction, soft.thickness_mm, soft.area) == (0.3, 0.5, None, None)
    soft = SoftOptions(tmp_path / "c.json", None, 0.2, 0.0, 7.0).soft()
    assert (soft.modulus_MPa, soft.friction, soft.thickness_mm) == (0.2, 0.0, 7.0)
    with pytest.raises(InputError, match=r"c\.json: modulus_MPa must lie between"):
        SoftOptions(tmp_path / "c.json", None, 50.0, None, None).soft()
    assert SoftOptions(None, None, None, None, None).soft() is None
    with pytest.raises(InputError, match="^--friction needs --calibration"):
        SoftOptions(None, None, None, 0.0, None).soft()


def test_a_hand_must_not_press_beyond_the_calibration(refused, tmp_path):
    made = calibration((0.02, 5.0))
    made.save(tmp_path / "c.json")
    most = made.domain["force_N"][1] / 1.4  # The force swings by 40 %
    said = refused("telepresence", "simulate", "--calibration", "c.json", "--force", 1.01 * most, "--seconds", 0.6)
    assert f"--force must be at most {most:.3g}" in said


def test_a_recorded_texture_must_be_long_enough(refused, tmp_path):
    time = np.arange(2000) / 1000
    rows = np.column_stack([time, 40 * np.sin(2 * np.pi * 30 * time / 1.5), 30 * time])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t_s,g1,position_mm", comments="")
    said = refused("telepresence", "simulate", "--log", "log.csv", "--strokes", 0, "--speed", 10, "--seconds", 7)
    assert "the hand needs 70 mm of texture, log.csv has 60 mm: lower --speed or" in said
