"""`papilla telepresence`: the documented keys, the tables it writes, and what is refused."""

import json

import numpy as np
import pytest

SHORT = ("--seconds", "3", "--round-trip-ms", "100", "--round-trip-sd-ms", "0")


@pytest.mark.slow
def test_simulate_tells_lag_bytes_and_wavelength(papilla, tmp_path):
    answer = papilla("telepresence", "simulate", *SHORT, "--out", "shown.csv", "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    assert abs(found["lag_ms"]["local"]) < 1
    assert found["lag_ms"]["direct"] == pytest.approx(100, abs=2) == found["lag_ms"]["round_trip"]
    assert found["wavelength_error"]["local"] < 0.01 < found["wavelength_error"]["direct"]
    assert 0 < found["bytes_per_s"]["local"] < found["bytes_per_s"]["direct"]
    rows = np.genfromtxt(tmp_path / "shown.csv", delimiter=",", names=True)
    assert len(rows) == 3000 and np.nanmax(np.abs(rows["local_um"])) > 5
    again = papilla("telepresence", "simulate", *SHORT)
    assert "lag behind the hand, local" in again.out


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
        (("--log", "same.csv", "--out", "same.csv"), "overwrite"),
    ],
)
def test_bad_options_are_one_line(papilla, options, said):
    answer = papilla("telepresence", "simulate", *options)
    assert answer.code == 2 and said in answer.err and answer.err.count("\n") == 1 and not answer.out


def test_help_explains(papilla):
    words = " ".join(papilla("telepresence", "simulate", "--help").out.replace("│", " ").split())
    assert "The local model is sent the texture's wavelength" in words
    assert "simulate" in papilla("telepresence", "--help").out
