"""What `papilla telepresence simulate` simulates by its options, and what it makes of the record, which is made up."""

import csv
import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.telepresence.cli import commands as telepresence
from papilla.telepresence.cli.options import GratingOptions, SoftOptions
from papilla.telepresence.messages import Force, Header, Length, Line, Modulus, Parameters, Ratio, Strain, Trust
from papilla.telepresence.motion import RATE_HZ, Motion

LINE = Line(Length(2.5, 0.01, int(Trust.OK)), Strain(40.0, 1.0, int(Trust.OK)))


def message(**parts) -> Parameters:
    """A message with a line of 2.5 mm."""
    header = Header(*[0] * len(Header.__struct_fields__))
    return Parameters(header, int(Trust.OK), **{"lines": (LINE,)} | parts)


class Made(SimpleNamespace):
    """A record of three samples."""

    def felt(self, name):
        return SimpleNamespace(error=self.number(name) / 100, silent=self.number(name) / 10)

    def number(self, name):
        return {"local": 1.0, "direct": 2.0}[name]

    def lag_ms(self, name):
        return 10 * self.number(name)

    def change_ms(self, name):
        return 100 * self.number(name)

    def stale_ms(self, name):
        return 1000 * self.number(name)

    def statuses(self, name):
        return {"ok": 1 - self.number(name) / 4, "silence": self.number(name) / 4}


def record(**parts) -> Made:
    """The record; each column begins with another number."""
    names = ("time_s", "hand_mm", "truth_mm", "local_um", "direct_um", "wavelength_mm", "direct_mm", "round_trip_ms")
    columns = {name: 10.0 * k + np.arange(3) for k, name in enumerate(names)}
    both = {"local": 500.0, "direct": 3000.0}
    facts = {"bytes_per_s": both, "with_headers": {"local": 900.0}, "lost": {"local": 0.25}, "late_ms": 119.0}
    return Made(**columns | facts | {"messages": [None, message(), message(modulus=Modulus(0.3, 0.1, 0))]} | parts)


@pytest.fixture
def simulated(monkeypatch):
    """The scenes that were simulated."""
    from papilla.telepresence import loop

    asked = []

    def run(scene, model, direct, *, progress):
        asked.append((scene, model, direct))
        return record()

    monkeypatch.setattr(loop, "run", run)
    return asked


def test_a_scene_is_what_its_options_say(papilla, simulated):
    options = ("--wavelength", 2, "--second-wavelength", 3, "--amplitude", 30, "--noise", 1.5, "--seconds", 4)
    options += ("--parameters-rate", 20, "--seed", 9, "--components", 2, "--speed", 100, "--strokes", 0.5)
    options += ("--force", 0.3, "--round-trip-ms", 100, "--round-trip-sd-ms", 0, "--uplink-share", 0.25, "--loss", 0.1)
    answer = papilla("telepresence", "simulate", *options, "--json")
    assert answer.code == 0, answer.err
    ((scene, model, direct),) = simulated
    assert (scene.seconds, scene.noise_microstrain, scene.components, scene.parameters_Hz) == (4.0, 1.5, 2, 20.0)
    assert (scene.seed, scene.start_mm, scene.soft) == (9, 0.0, None)
    assert (scene.motion.peak_mm_s, scene.motion.strokes_Hz, scene.motion.press_N) == (100.0, 0.5, 0.3)
    assert (scene.uplink.one_way_ms, scene.downlink.one_way_ms) == (25.0, 75.0) and scene.uplink.loss == 0.1
    assert (scene.texture.left.wavelength_mm, scene.texture.right.wavelength_mm) == (2.0, 3.0)
    assert scene.texture.right.amplitude == 30.0
    assert scene.texture.border_mm == pytest.approx(0.5 * 100 / (math.pi * 0.5)), "the middle of a stroke"
    assert model.components == 2 and direct.actuator == model.actuator
    found = json.loads(answer.out)
    expected = {
        "lag_ms": {"local": 10.0, "direct": 20.0, "round_trip": 119.0},
        "wavelength_error": {"local": 0.01, "direct": 0.02},
        "bytes_per_s": {"local": 500.0, "direct": 3000.0}, "bytes_per_s_with_headers": {"local": 900.0},
        "silent": {"local": 0.1, "direct": 0.2}, "change_ms": {"local": 100.0, "direct": 200.0},
        "stale_ms": {"local": 1000.0, "direct": 2000.0}, "lost": {"local": 0.25}, "seconds": 4.0, "seed": 9,
        "status": {"local": {"ok": 0.75, "silence": 0.25}, "direct": {"ok": 0.5, "silence": 0.5}},
    }  # fmt: skip
    assert {name: found[name] for name in expected} == expected and "table" not in found
    assert found["told"]["wavelength_mm"] == {"value": 2.5, "sigma": 0.01, "status": "ok", "true": 22.0}
    assert found["told"]["modulus_MPa"] == {"value": 0.3, "sigma": 0.1, "status": "ok", "true": None}


def test_a_hand_at_constant_speed_needs_all_its_path(papilla, simulated):
    answer = papilla(
        "telepresence", "simulate", "--strokes", 0, "--speed", 50, "--seconds", 4, "--second-wavelength", 2
    )
    assert answer.code == 0 and simulated[0][0].texture.border_mm == 100.0
    assert "local, 25.0 % of the time: silence" in answer.err and "ok" not in answer.err


def test_the_table_of_a_run_has_its_columns(papilla, simulated, tmp_path):
    answer = papilla("telepresence", "simulate", "--out", "shown.csv")
    assert answer.code == 0 and answer.out.endswith("Wrote shown.csv\n")
    with (tmp_path / "shown.csv").open() as file:
        rows = list(csv.DictReader(file))
    named = {
        "t_s": "time_s", "position_mm": "hand_mm", "local_um": "local_um", "direct_um": "direct_um",
        "local_wavelength_mm": "wavelength_mm", "direct_wavelength_mm": "direct_mm", "true_wavelength_mm": "truth_mm",
        "round_trip_ms": "round_trip_ms",
    }  # fmt: skip
    for column, name in named.items():
        assert [float(row[column]) for row in rows] == getattr(record(), name).tolist(), column
    assert [row["modulus_MPa"] for row in rows] == ["", "", "0.3"]


def test_a_page_starts_from_the_run(papilla, simulated, monkeypatch):
    from papilla.telepresence import page

    asked = []
    monkeypatch.setattr(page, "settings", lambda motion, **how: asked.append((motion, how)) or "settings")
    monkeypatch.setattr(page, "write_page", lambda path, begin: asked.append((str(path), begin)))
    scene = ("--html", "play.html", "--wavelength", 2, "--parameters-rate", 25, "--round-trip-ms", 80, "--loss", 0.1)
    answer = papilla("telepresence", "simulate", *scene, "--json")
    assert answer.code == 0, answer.err
    assert json.loads(answer.out)["page"] == "play.html" and asked[1] == ("play.html", "settings")
    motion, how = asked[0]
    model = simulated[0][1]
    assert motion == simulated[0][0].motion and how.pop("actuator") == model.actuator
    assert how == {
        "wavelength_mm": 2.0, "round_trip_ms": 80.0, "loss": 0.1, "amplitude_um": model.rule(2.5, 40.0),
        "bytes_local": 500.0 / 25, "bytes_direct": 3000.0 / RATE_HZ,
    }  # fmt: skip


@pytest.mark.parametrize("texture, messages, said", [
    (math.nan, [message()], "no significant line"), (2.0, [None, message(lines=())], "no line was displayed"),
])  # fmt: skip
def test_without_a_line_there_is_no_page(texture, messages, said):
    scene = SimpleNamespace(texture=SimpleNamespace(wavelength=lambda place: texture), start_mm=0.0)
    with pytest.raises(InputError, match=said):
        telepresence._write_page("p.html", scene, record(messages=messages), None, 100.0)


def test_the_last_message_stands_beside_the_truth():
    sent = message(mu_kinetic=Ratio(0.4, 0.1, 0), force=Force(0.6, 0.01, 0), modulus=Modulus(0.3, 0.1, 2))
    area = lambda force, modulus: (100 * force * modulus, 1.0)  # noqa: E731
    soft = SimpleNamespace(modulus_MPa=0.25, friction=0.45, area=area)
    told = telepresence._last_message(record(messages=[None, sent]), SimpleNamespace(soft=soft))
    assert list(told) == ["modulus_MPa", "mu_kinetic", "wavelength_mm"]
    assert [one["true"] for one in told.values()] == [0.25, 0.45, 22.0]
    assert telepresence._last_message(record(messages=[sent, None]), SimpleNamespace(soft=soft)) == {}


def test_a_hand_must_not_press_beyond_the_calibration():
    soft = SimpleNamespace(calibration=SimpleNamespace(domain={"force_N": (0.05, 1.4)}))
    # The force swings by 40 %
    telepresence._check_force(soft, 1.0)
    telepresence._check_force(None, 50.0)
    with pytest.raises(InputError, match="--force must be at most 1, as it swings within the calibration, got 1.01"):
        telepresence._check_force(soft, 1.01)


def test_a_recorded_texture_must_be_long_enough_and_is_touched_in_its_middle(monkeypatch):
    from papilla import logs
    from papilla.telepresence.touch import RecordedTexture

    recorded = SimpleNamespace(reach_mm=(5.0, 65.0))
    monkeypatch.setattr(logs, "read_time_log", lambda path: path)
    monkeypatch.setattr(RecordedTexture, "of_log", lambda log: recorded)
    grating = GratingOptions(1.2, 50.0, 3.5)
    for motion, seconds, start in ((Motion(10.0, 0.0), 4.0, 15.0), (Motion(10 * math.pi), 9.0, 35 - 5 / 1.07)):
        found = telepresence._texture(grating, None, Path("log.csv"), motion, seconds)
        assert found == (recorded, pytest.approx(start))
    assert telepresence._texture(grating, None, Path("log.csv"), Motion(10.0, 0.0), 6.0)[1] == 5.0
    with pytest.raises(InputError, match=r"the hand needs 70 mm of texture, log.csv has 60 mm: lower --speed or"):
        telepresence._texture(grating, None, Path("log.csv"), Motion(10.0, 0.0), 7.0)


def test_wavelengths_that_nobody_looks_for_are_said(capsys):
    for wavelengths in ((0.3, None), (1.2, 7.0), (0.4, 6.0)):
        telepresence._texture(GratingOptions(wavelengths[0], 50.0, 0.0), wavelengths[1], None, Motion(), 8.0)
    said = [line.split(" is not")[0] for line in capsys.readouterr().err.splitlines()]
    assert said == ["a wavelength of 0.3 mm", "a wavelength of 7 mm"]


def test_a_soft_specimen_has_its_defaults(tmp_path):
    from spring_calibration import calibration

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
