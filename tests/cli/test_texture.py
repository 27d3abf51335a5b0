"""`papilla texture`: train on logs, classify another one, and what is refused."""

import json

import numpy as np
import pytest

pytest.importorskip("sklearn", reason="scikit-learn (extra `texture`) is not installed")


def write(path, wavelength, speed, seed):
    rng = np.random.default_rng(seed)
    time = np.arange(4000) / 1000
    place = speed * time[:, None] - np.array([0.0, 2.0, 5.0])
    readings = 50 * np.sin(2 * np.pi * place / wavelength) + rng.normal(0, 5, place.shape)
    rows = np.column_stack([time, readings, np.full(4000, speed)])
    np.savetxt(path, rows, delimiter=",", header="t_s,g1,g2,g3,velocity_mm_s", comments="")


def test_trained_on_two_speeds_it_knows_a_third(papilla, tmp_path):
    named = []
    for name, wavelength in (("fine", 1.5), ("coarse", 4.0)):
        for speed in (30.0, 60.0):
            write(tmp_path / f"{name}{speed:g}.csv", wavelength, speed, int(speed))
            named.append(f"{name}={name}{speed:g}.csv")
    options = ("--window", "20", "--wavelengths", "1", "10", "--bands", "5")
    trained = papilla("texture", "train", *named, "--out", "model.json", *options, "--json")
    assert trained.code == 0, trained.err
    found = json.loads(trained.out)
    assert found["left_out"] == "a speed" and found["accuracy"]["linear discriminant"] > 0.9
    write(tmp_path / "other.csv", 4.0, 90.0, 1)
    answer = papilla("texture", "classify", "other.csv", "--model", "model.json", "--json")
    told = json.loads(answer.out)
    assert answer.code == 0 and told["label"] == "coarse" and told["share"] > 0.8
    assert "coarse" in papilla("texture", "classify", "other.csv", "--model", "model.json").out
