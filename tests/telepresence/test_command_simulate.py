"""`papilla telepresence simulate` on short runs: what its options change, what is written, what is refused."""

import json
import math
import re

import numpy as np
import pytest
from spring_calibration import calibration

from papilla.core.errors import InputError
from papilla.logs import read_time_log
from papilla.telepresence import GratingTexture, HandMotion, LinkModel, Measured, RecordedTexture, Set, SideBySide, run
from papilla.telepresence.cli.options import SoftOptions


def rows_match(path, record):
    """Whether the table of a run has the numbers of its record, a row per ms."""
    columns = {
        "t_s": record.time_s, "position_mm": record.hand_mm, "local_um": record.local_um, "direct_um": record.direct_um,
        "local_wavelength_mm": record.wavelength_mm, "direct_wavelength_mm": record.direct_mm,
        "true_wavelength_mm": record.truth_mm, "round_trip_ms": record.round_trip_ms,
    }  # fmt: skip
    rows = np.genfromtxt(path, delimiter=",", names=True)
    return all(np.allclose(rows[name], values, rtol=1e-9, equal_nan=True) for name, values in columns.items())


def measures(record, name):
    """Measures of a display, as the command names them."""
    felt = record.felt(name)
    found = {key: getattr(record, key)(name) for key in ("lag_ms", "stale_ms", "change_ms")}
    return found | {"wavelength_error": felt.error, "silent": felt.silent}


def test_without_options_it_is_the_touch_of_the_paper_and_the_table_prints_its_measures(papilla, tmp_path):
    answer = papilla("telepresence", "simulate", "--seconds", 2.5, "--out", "shown.csv")
    assert answer.code == 0, answer.err
    # The greatest speed and the rate of section 4.1.1, and all of the delay on the way back
    hand, late = HandMotion(197.0, 1.07, press_N=0.5), LinkModel(120.0, 40.0)
    record = run(Set(GratingTexture(1.2, 50.0), hand, 2.5, LinkModel(), late, 3.5, 1, 50.0, 0))
    assert rows_match(tmp_path / "shown.csv", record)
    printed = {}
    for line in answer.out.splitlines():
        cells = [cell.strip() for cell in line.split("\u2502")]
        if len(cells) == 5:
            printed[cells[1]] = tuple(cells[2:4])
    assert printed.pop("round trip") == (f"{record.late_ms:.1f}", "ms")
    value, truth = printed.pop("wavelength_mm")
    line = record.messages[-1].lines[0].wavelength
    assert value == f"{line.value:.4g} ± {line.sigma:.2g} (ok)" and truth == "true 1.2"
    expected = {}
    for name in ("local", "direct"):
        found, shares = measures(record, name), record.statuses(name)
        expected[f"lag behind the hand, {name}"] = f"{found['lag_ms']:.1f}", "ms"
        expected[f"wavelength error, {name}"] = f"{100 * found['wavelength_error']:.2f}", "%"
        expected[f"silent, {name}"] = f"{100 * found['silent']:.1f}", "%"
        expected[f"sent down, {name}"] = f"{record.bytes_per_s[name]:.0f}", "bytes/s"
        said = {line for line in answer.err.splitlines() if line.startswith(name)}
        of_time = {f"{name}, {100 * share:.1f} % of the time: {what}" for what, share in shares.items() if what != "ok"}
        assert said == of_time
    assert printed == expected, "no crossings, so nothing is said of them"


def test_all_options_reach_the_scene_and_all_measures_the_answer(papilla, tmp_path):
    link = {"jitter_ms": 1.0, "loss": 0.04, "reordering": 0.05, "duplication": 0.06, "bandwidth_bytes_s": 120_000.0}
    options = [("round-trip-ms", 90), ("round-trip-sd-ms", 12), ("uplink-share", 0.36), ("bandwidth", 120_000)]
    options += [(name.replace("_", "-"), link[name]) for name in ("jitter_ms", "loss", "reordering", "duplication")]
    options += [("wavelength", 1.5), ("second-wavelength", 2.2), ("amplitude", 60), ("noise", 2), ("components", 2)]
    options += [("speed", 130), ("strokes", 0.8), ("force", 0.4), ("parameters-rate", 40), ("seed", 7), ("seconds", 2)]
    stated = [part for name, value in options for part in (f"--{name}", value)]
    answer = papilla("telepresence", "simulate", *stated, "--out", "shown.csv", "--html", "play.html", "--json")
    assert answer.code == 0, answer.err
    # Variances of both ways add up to that of the round trip
    up, down = (LinkModel(share * 90, math.sqrt(share) * 12, **link) for share in (0.36, 0.64))
    hand = HandMotion(130.0, 0.8, press_N=0.4)
    texture = SideBySide(GratingTexture(1.5, 60.0), GratingTexture(2.2, 60.0), 0.5 * hand.length_mm)
    record = run(Set(texture, hand, 2.0, up, down, 2.0, 2, 40.0, 7))
    assert rows_match(tmp_path / "shown.csv", record)
    found = json.loads(answer.out)
    assert record.lost["local"] > 0 and found["lost"] == record.lost and found["bytes_per_s"] == record.bytes_per_s
    assert found["bytes_per_s_with_headers"] == record.with_headers and found["lag_ms"]["round_trip"] == record.late_ms
    for name in ("local", "direct"):
        assert found["status"][name] == pytest.approx(record.statuses(name))
        for key, number in measures(record, name).items():
            assert found[key][name] == (None if math.isnan(number) else pytest.approx(number)), (key, name)
    line = record.messages[-1].lines[0].wavelength
    wavelength = {"value": line.value, "sigma": line.sigma, "status": "ok", "true": record.truth_mm[-1]}
    assert found["told"]["wavelength_mm"] == wavelength
    page = json.loads(re.search(r"SETTINGS = (\{.*\});", (tmp_path / "play.html").read_text(encoding="utf-8"))[1])
    strongest = next(one.components for one in reversed(record.messages) if one is not None and one.lines)[0]
    expected = {"wavelength_mm": 1.5, "round_trip_ms": 90.0, "loss": 0.04, "strokes_Hz": 0.8}
    expected |= {"length_mm": hand.length_mm, "amplitude_um": Measured()(1.0, strongest.amplitude_microstrain)}
    expected |= {f"bytes_{name}": record.bytes_per_s[name] / rate for name, rate in (("local", 40), ("direct", 1000))}
    assert {name: page[name] for name in expected} == pytest.approx(expected)


def test_a_hand_strokes_the_middle_of_a_recorded_texture_that_must_be_long_enough(papilla, refused, tmp_path):
    time = np.arange(2000) / 1000
    rows = np.column_stack([time, 40 * np.sin(2 * np.pi * 30 * time / 1.5), 5 + 30 * time])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t_s,g1,position_mm", comments="")
    said = refused("telepresence", "simulate", "--log", "log.csv", "--strokes", 0, "--speed", 10, "--seconds", 7)
    assert "the hand needs 70 mm of texture, log.csv has 60 mm: lower --speed or" in said
    low, high = RecordedTexture.of_log(read_time_log(tmp_path / "log.csv")).reach_mm
    for strokes, path in ((0, 40.0), (2, 20.0 / (2 * math.pi))):
        options = ("--log", "log.csv", "--speed", 20, "--strokes", strokes, "--seconds", 2, "--out", "shown.csv")
        assert papilla("telepresence", "simulate", *options).code == 0
        place = np.genfromtxt(tmp_path / "shown.csv", delimiter=",", names=True)["position_mm"]
        assert place[0] == pytest.approx(0.5 * (low + high - path)) and np.ptp(place) == pytest.approx(path, rel=1e-2)


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
