"""`papilla telepresence`: the documented keys, the tables it writes, and what is refused."""

import json

import numpy as np
import pytest
from spring_calibration import FORCE, calibration

SHORT = ("--seconds", "2", "--round-trip-ms", "100", "--round-trip-sd-ms", "0")


def test_softness_friction_and_contact_area_ride_along(papilla, tmp_path):
    calibration((0.02, 5.0)).save(tmp_path / "c.json")
    force, modulus = (grid.ravel() for grid in np.meshgrid(np.geomspace(*FORCE, 5), np.geomspace(0.02, 5, 5)))
    presses = np.column_stack([force, modulus, 60 * force**0.6 * modulus**-0.2])
    np.savetxt(tmp_path / "s.csv", presses, delimiter=",", header="force_N,modulus_MPa,contact_area_mm2", comments="")
    options = ("--calibration", "c.json", "--sweep", "s.csv", "--modulus", "0.2", "--friction", "0.4", "--json")
    answer = papilla("telepresence", "simulate", "--seconds", "2", *options, "--out", "shown.csv")
    assert answer.code == 0, answer.err
    told = json.loads(answer.out)["told"]
    assert list(told) == ["modulus_MPa", "contact_area_mm2", "mu_kinetic", "mu_static", "wavelength_mm"]
    for name in ("mu_kinetic", "mu_static", "wavelength_mm"):
        assert abs(told[name]["value"] - told[name]["true"]) < 4 * told[name]["sigma"]
        assert told[name]["status"] in ("ok", "doubted")
    assert (told["modulus_MPa"]["true"], told["mu_kinetic"]["true"], told["mu_static"]["true"]) == (0.2, 0.4, 0.4)
    # The force swings between 0.3 and 0.7 N
    assert 60 * 0.3**0.6 * 0.2**-0.2 < told["contact_area_mm2"]["true"] < 60 * 0.7**0.6 * 0.2**-0.2
    names = (tmp_path / "shown.csv").read_text().split("\n", 1)[0].split(",")
    assert {"modulus_MPa", "modulus_sigma_MPa", "modulus_status", "contact_area_sigma_mm2"} <= set(names)


def test_actuator_and_rule_are_told(papilla, tmp_path):
    points = {"schema": "papilla.amplitude/1", "source": "made up", "wavelength_mm": [0.8, 1, 1.2, 1.4, 1.6, 2.0]}
    (tmp_path / "mine.json").write_text(json.dumps(points | {"power": [1, 2, 4, 4, 2, 1]}))
    options = ("--rule", "g_A", "--curve", "mine.json", "--actuator", "icpf", "--stroke-um", "40", "--out", "s.csv")
    options += ("--html", "play.html")
    found = json.loads(papilla("telepresence", "simulate", *SHORT, *options, "--json").out)["display"]
    assert '"band_Hz": 200.0' in (tmp_path / "play.html").read_text(encoding="utf-8")
    assert (found["actuator"], found["band_Hz"], found["stroke_um"]) == ("ICPF", 200.0, 40.0)
    assert found["amplitude"]["source"] == "made up" and 0.9 < found["amplitude"]["r_squared"] < 1
    rows = np.genfromtxt(tmp_path / "s.csv", delimiter=",", names=True, dtype=None, encoding=None)
    assert 15 < np.nanmax(np.abs(rows["local_um"])) <= 20


@pytest.mark.parametrize(
    "options, said",
    [
        (("--wavelength", "0"), "wavelength_mm"),
        (("--loss", "2"), "loss"),
        (("--uplink-share", "-0.01"), "--uplink-share"),
        (("--uplink-share", "1.01"), "--uplink-share"),
        (("--round-trip-ms", "10000.5"), "--round-trip-ms"),
        (("--round-trip-sd-ms", "10000.5"), "--round-trip-sd-ms"),
        (("--round-trip-ms", "nan"), "--round-trip-ms"),
        (("--bandwidth", "0"), "--bandwidth"),
        (("--seconds", "0.1"), "seconds"),
        (("--log", "none.csv"), "none.csv"),
        (("--log", "none.csv", "--second-wavelength", "2"), "--second-wavelength"),
        (("--log", "none.csv", "--noise", "2", "--wavelength", "1.2"), "--wavelength, --noise: of the simulated"),
        (("--log", "same.csv", "--out", "same.csv"), "overwrite"),
        (("--curve", "same.json", "--rule", "g_A", "--out", "same.json"), "overwrite"),
        (("--curve", "some.json"), "--rule g_A"),
        (("--curve", "none.json", "--rule", "g_A"), "none.json"),
        (("--actuator", "icpf"), "--stroke-um"),
        (("--stroke-um", "80"), "--actuator icpf"),
        (("--modulus", "0.3", "--sweep", "s.csv"), "--sweep, --modulus needs --calibration"),
        (("--calibration", "none.json"), "none.json"),
        (("--force", "-1"), "press_N"),
    ],
)
def test_bad_options_are_one_line(papilla, options, said):
    answer = papilla("telepresence", "simulate", *options)
    assert answer.code == 2 and said in answer.err and answer.err.count("\n") == 1 and not answer.out


def test_a_sensor_that_plays_a_log_takes_no_specimen(refused):
    assert "--modulus, --friction: of the simulated" in refused(
        "telepresence", "sensor", "--log", "none.csv", "--modulus", "0.3", "--friction", "0.5"
    )
