"""`papilla telepresence`: the documented keys, the tables it writes, and what is refused."""

import json

import numpy as np
import pytest

SHORT = ("--seconds", "3", "--round-trip-ms", "100", "--round-trip-sd-ms", "0")


@pytest.mark.slow
def test_a_recorded_texture_is_felt(papilla, tmp_path):
    time = np.arange(3000) / 1000
    rows = np.column_stack([time, 40 * np.sin(2 * np.pi * 50 * time / 1.5), 50 * time])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="t_s,g1,position_mm", comments="")
    answer = papilla("telepresence", "simulate", *SHORT, "--log", "log.csv", "--json")
    found = json.loads(answer.out)
    assert found["lag_ms"]["direct"] == pytest.approx(100, abs=2) and found["wavelength_error"]["local"] < 0.01
    refused = papilla("telepresence", "simulate", *SHORT, "--log", "log.csv", "--speed", "900")
    assert refused.code == 2 and "lower --speed" in refused.err


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory):
    """Calibration and sweep of the default finger, of few presses without friction."""
    from papilla.calibration import fit, sweep
    from papilla.fem import prepare
    from papilla.model.finger import Finger

    folder = tmp_path_factory.mktemp("calibrated")
    presses = sweep(
        prepare(Finger.default()), np.geomspace(0.05, 2, 10), np.geomspace(0.05, 1, 14), friction=0, large_strain=False
    )
    fit(presses).save(folder / "calibration.json")
    presses.to_csv(folder / "sweep.csv")
    return "--calibration", folder / "calibration.json", "--sweep", folder / "sweep.csv"


@pytest.mark.slow
def test_softness_friction_and_contact_area_ride_along(papilla, tmp_path, calibrated):
    files = calibrated
    options = (*files, "--thickness", "10", "--modulus", "0.2", "--friction", "0.4", "--out", "shown.csv", "--json")
    answer = papilla("telepresence", "simulate", *SHORT, *options)
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    for one in found["told"].values():
        assert abs(one["value"] - one["true"]) < 3 * one["sigma"] and one["status"] in ("ok", "doubted")
    assert list(found["told"]) == ["modulus_MPa", "contact_area_mm2", "mu_kinetic", "mu_static", "wavelength_mm"]
    assert found["told"]["mu_kinetic"]["status"] == "ok" and found["told"]["modulus_MPa"]["sigma"] < 0.2
    assert abs(found["lag_ms"]["local"]) < 1 and found["lag_ms"]["direct"] == pytest.approx(100, abs=3)
    names = (tmp_path / "shown.csv").read_text().split("\n", 1)[0].split(",")
    assert {"modulus_MPa", "modulus_sigma_MPa", "modulus_status", "contact_area_sigma_mm2"} <= set(names)
    refused = papilla("telepresence", "simulate", *files, "--force", "0.9")
    assert refused.code == 2 and "--force must be at most 0.714" in refused.err


@pytest.mark.slow
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
        (("--uplink-share", "-1"), "--uplink-share"),
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
