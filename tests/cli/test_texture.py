"""`papilla texture`: train on logs, classify another one, and what is refused."""

import json
from types import SimpleNamespace

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


@pytest.mark.slow
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


def test_what_is_refused_is_one_line(refused, tmp_path):
    write(tmp_path / "a.csv", 1.5, 30.0, 0)
    (tmp_path / "still.csv").write_text("t_s,g1\n0,1\n1,2\n2,3\n")
    assert "LABEL=LOG.csv" in refused("texture", "train", "a.csv", "--out", "m.json")
    assert "two labels at least" in refused("texture", "train", "fine=a.csv", "--out", "m.json")
    assert "position_mm or velocity_mm_s" in refused("texture", "train", "fine=still.csv", "--out", "m.json")
    assert "would overwrite the input" in refused("texture", "train", "fine=a.csv", "--out", "a.csv")
    assert "cannot read texture model none.json" in refused("texture", "classify", "a.csv", "--model", "none.json")


def test_a_window_has_the_label_that_most_windows_have(papilla, tmp_path, monkeypatch):
    from papilla.estimators import texture

    told = ["b", "a", "b", "unknown"]
    distances = np.array([[3.0, 1.0], [2.0, 4.0], [5.0, 0.5], [90.0, 80.0]])
    model = SimpleNamespace(classify=lambda place, readings: (told, distances), limit=25.0)
    monkeypatch.setattr(texture.TextureModel, "load", lambda path: model)
    write(tmp_path / "a.csv", 1.5, 30.0, 0)
    answer = papilla("texture", "classify", "a.csv", "--model", "m.json", "--json")
    found = json.loads(answer.out)
    found.pop("seconds")
    assert found == {
        "label": "b", "share": 0.5, "windows": told, "squared_distance": [1.0, 2.0, 0.5, 80.0], "limit": 25.0,
    }  # fmt: skip
    said = " ".join(papilla("texture", "classify", "a.csv", "--model", "m.json").out.replace("│", " ").split())
    assert "texture b share of windows 0.50 of 4" in said


def test_runs_are_trained_with_the_features_that_are_stated(papilla, tmp_path, monkeypatch):
    from papilla.estimators import texture

    asked, saved = [], []
    model = SimpleNamespace(labels=("coarse", "fine"), accuracy={"nearest": 0.875}, save=saved.append)
    monkeypatch.setattr(texture, "train", lambda runs, features: asked.append((runs, features)) or model)
    for name, speed in (("a", 30.0), ("b", 60.0)):
        write(tmp_path / f"{name}.csv", 1.5, speed, 0)
        (tmp_path / f"{name}.csv").chmod(0o444)
    logs = ("fine=a.csv", "fine=b.csv", "coarse=b.csv", "coarse=a.csv")
    options = ("--window", 40, "--wavelengths", 2, 10, "--bands", 5, "--out", "m.json")
    answer = papilla("texture", "train", *logs, *options, "--json")
    assert answer.code == 0, answer.err
    runs, features = asked[0]
    assert (
        features == texture.Features(40.0, 2.0, 10.0, 5) and [run[0] for run in runs] == ["fine"] * 2 + ["coarse"] * 2
    )
    assert runs[0][1] == runs[3][1] != runs[1][1] == runs[2][1]
    assert runs[1][2] == pytest.approx(60 * np.arange(4000) / 1000, abs=0.1) and runs[1][3].shape == (4000, 3)
    found = json.loads(answer.out)
    assert found["accuracy"] == {"nearest": 0.875} and found["labels"] == ["coarse", "fine"]
    assert (found["left_out"], found["model"], [str(path) for path in saved]) == ("a speed", "m.json", ["m.json"])
    said = " ".join(papilla("texture", "train", *logs, "--out", "m.json").out.replace("│", " ").split())
    assert "nearest, a speed left out 0.875 right" in said and said.endswith("Wrote m.json")
    assert asked[1][1] == texture.Features()


@pytest.mark.parametrize("columns, said", [
    ("t_s,g1\n0,1\n1,2\n2,3\n", "position_mm or velocity_mm_s"),
    ("t_s,position_mm,force_N,tangential_N\n0,1,1,1\n1,2,1,1\n2,3,1,1\n", "textures need gauges"),
    ("t_s,g1,position_mm\n0,1,5\n1,2,5\n2,3,5\n", "the finger does not move"),
])  # fmt: skip
def test_runs_that_have_no_texture_are_refused(papilla, tmp_path, columns, said):
    (tmp_path / "a.csv").write_text(columns)
    answer = papilla("texture", "train", "fine=a.csv", "--out", "m.json")
    assert answer.code == 2 and said in answer.err
    for name in ("=a.csv", "fine="):
        assert "logs must be LABEL=LOG.csv" in papilla("texture", "train", name, "--out", "m.json").err
