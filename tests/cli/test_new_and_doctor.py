"""`papilla new` and `papilla doctor`: what they write and say, and that it holds."""

import json
import re
from dataclasses import replace

import pytest

from papilla import Finger
from papilla.core import cache


@pytest.mark.parametrize("shape", ["dome", "slab", "surfaces"])
def test_a_new_design_is_a_finger_of_its_shape_with_comments(papilla, tmp_path, shape):
    answer = papilla("new", "mine.toml", "--shape", shape, "--json")
    assert answer.code == 0, answer.err
    facts = json.loads(answer.out)
    assert sorted(facts["files"]) == sorted(path.name for path in tmp_path.iterdir())
    finger = Finger.load(tmp_path / "mine.toml")
    assert type(finger.shape).__name__.lower() == shape and len(finger.gauges) == 5
    assert shape != "dome" or replace(Finger.default(), name=finger.name, ridges=None) == finger
    text = (tmp_path / "mine.toml").read_text(encoding="utf-8")
    assert text.count("#") > 15 and "--finger mine.toml" in text and "FILE" not in text


@pytest.mark.parametrize("shape", ["dome", "slab"])
def test_keys_that_are_commented_out_are_keys_of_a_design(papilla, tmp_path, shape):
    papilla("new", "mine.toml", "--shape", shape)
    path = tmp_path / "mine.toml"
    lines = path.read_text(encoding="utf-8").splitlines()
    opened = [re.sub(r"^# (?=\[|\w+ = )", "", line) for line in lines]
    path.write_text("\n".join(line for line in opened if "material" not in line), encoding="utf-8")
    finger = Finger.load(path)
    assert finger.bone.modulus == 3000.0 and finger.ridges.pitch == 1.2 and finger.bench.friction == 0.5


def test_surface_files_are_closed_nested_and_smooth_at_the_apex(papilla, tmp_path):
    from papilla.fem.pressing.press import FACET_DISTANCE_SHARE
    from papilla.mesh.surface_files import read_nested

    papilla("new", "mine.toml", "--shape", "surfaces")
    shape = Finger.load(tmp_path / "mine.toml").shape
    skin, *_ = read_nested((shape.outer, shape.interface, shape.bone))
    apex = skin.project([[0.0, 0.0, 20.0]])[0]
    assert apex[2] == pytest.approx(20.0, abs=0.01)
    indentation_mm = 0.5
    assert skin.facet_deviation(apex, 3.75) < FACET_DISTANCE_SHARE * indentation_mm


def test_doctor_tests_itself_and_counts_the_cache(papilla, tmp_path, monkeypatch):
    import numpy as np

    monkeypatch.setenv(cache.CACHE_VARIABLE, str(tmp_path / "cache"))
    cache.keep("thing", "one", {"a": np.arange(1000.0)})
    size = sum(cache.entries().values())
    answer = papilla("doctor", "--json")
    assert answer.code == 0, answer.err
    facts = json.loads(answer.out)
    assert facts["cache"]["entries"] == 1 and facts["cache"]["bytes"] == size > 100 and facts["cache"]["usable"]
    assert facts["cache"]["bytes_by_kind"] == {"thing": size} and "PAPILLA_CACHE" in facts["cache"]["chosen_by"]
    assert facts["self_test"]["passed"] and len(facts["self_test"]["cases"]) == 10
    assert facts["packages"]["numpy"] == np.__version__ and facts["extras"]["texture"]["packages"]["scikit-learn"]
    assert cache.find("thing", "one") is not None, "a look removes nothing"


def test_a_new_design_says_what_was_written_and_how_to_try_it(papilla, refused, tmp_path):
    answer = papilla("new", "mine.toml")
    assert answer.out == ("Wrote mine.toml\nTry it: papilla press --finger mine.toml --modulus 0.51 --force 0.588\n")
    (tmp_path / "link.toml").symlink_to("nowhere.toml")
    assert "link.toml is already there and is not overwritten" in refused("new", "link.toml")


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["dome", "slab"])
def test_the_press_that_a_new_design_names_is_made(papilla, shape):
    papilla("new", "mine.toml", "--shape", shape)
    answer = papilla("press", "--finger", "mine.toml", "--modulus", 0.51, "--force", 0.588, "--json")
    assert answer.code == 0, answer.err
    assert json.loads(answer.out)["large_strain"]


@pytest.mark.slow
def test_clean_empties_the_cache_and_nothing_else_and_words_are_those_of_the_json(papilla, tmp_path, monkeypatch):
    import numpy as np

    monkeypatch.setenv(cache.CACHE_VARIABLE, str(tmp_path / "cache"))
    for kind, name in (("thing", "one"), ("thing", "two"), ("other", "one")):
        cache.keep(kind, name, {"a": np.arange(1000.0)})
    (tmp_path / "cache" / "thing" / "notes.txt").write_text("mine")
    size = sum(cache.entries().values())
    said = papilla("doctor")
    assert said.code == 0 and f" {tmp_path / 'cache'} (" in said.out and "10 of 10 checks passed" in said.out
    answer = papilla("doctor", "--clean", "--json")
    facts = json.loads(answer.out)["cache"]
    assert facts["entries"] == 0 and facts["removed_bytes"] >= size and "MB from" in answer.err
    assert [path.name for path in (tmp_path / "cache" / "thing").iterdir()] == ["notes.txt"]


def test_a_map_of_a_log_has_a_row_for_each_column(papilla, tmp_path):
    (tmp_path / "log.csv").write_text("ms;ch1 [V];who\n0;1,5;a\n1;2,5;b\n2;1,5;c\n")
    (tmp_path / "log.csv").chmod(0o444)
    answer = papilla("log", "map", "log.csv", "--out", "m.toml")
    assert answer.code == 0 and (tmp_path / "m.toml").read_text().count("[columns]") == 1
    rows = [" ".join(line.replace("│", " ").split()) for line in answer.out.splitlines()]
    assert any(row.startswith("ch1 [V] g1 V ") for row in rows) and rows[-1].startswith("Wrote m.toml: check it")
    facts = json.loads(papilla("log", "map", "log.csv", "--out", "m.toml", "--json").out)
    assert (facts["map"], facts["delimiter"], facts["decimal"], facts["header_line"]) == ("m.toml", ";", ",", 1)
    assert [one["name"] for one in facts["columns"]] == ["ms", "ch1 [V]", "who"]
    assert answer.err.splitlines() == facts["open_questions"]
