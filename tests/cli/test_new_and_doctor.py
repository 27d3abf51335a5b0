"""`papilla new` and `papilla doctor`: what they write and say, and that it holds."""

import json
import re

import pytest

from papilla import Finger
from papilla.cli import doctor
from papilla.core import cache


@pytest.mark.parametrize("shape", ["dome", "slab", "surfaces"])
def test_a_new_design_is_a_finger_of_its_shape_with_comments(papilla, tmp_path, shape):
    answer = papilla("new", "mine.toml", "--shape", shape, "--json")
    assert answer.code == 0, answer.err
    facts = json.loads(answer.out)
    assert sorted(facts["files"]) == sorted(path.name for path in tmp_path.iterdir())
    finger = Finger.load(tmp_path / "mine.toml")
    assert type(finger.shape).__name__.lower() == shape and len(finger.gauges) == 5
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


def test_the_default_finger_is_what_a_new_dome_begins_with(papilla, tmp_path):
    papilla("new", "mine.toml")
    mine, default = Finger.load(tmp_path / "mine.toml"), Finger.default()
    assert (mine.shape, mine.outer, mine.inner, mine.gauges) == (
        default.shape,
        default.outer,
        default.inner,
        default.gauges,
    )


def test_new_overwrites_nothing(papilla, refused, tmp_path):
    (tmp_path / "bone.stl").write_text("mine")
    assert "bone.stl is already there" in refused("new", "mine.toml", "--shape", "surfaces")
    (tmp_path / "mine.toml").symlink_to("nowhere")
    assert "mine.toml is already there" in refused("new", "mine.toml")


def test_surface_files_are_closed_nested_and_smooth_at_the_apex(papilla, tmp_path):
    from papilla.fem.pressing.press import FACETS
    from papilla.mesh.surface_files import read_nested

    papilla("new", "mine.toml", "--shape", "surfaces")
    shape = Finger.load(tmp_path / "mine.toml").shape
    skin, *_ = read_nested((shape.outer, shape.interface, shape.bone))
    apex = skin.project([[0.0, 0.0, 20.0]])[0]
    assert apex[2] == pytest.approx(20.0, abs=0.01)
    indentation_mm = 0.5
    assert skin.facet_deviation(apex, 3.75) < FACETS * indentation_mm


def test_doctor_tests_itself_and_counts_the_cache(papilla, tmp_path, monkeypatch):
    import numpy as np

    monkeypatch.setenv(cache.ENVIRONMENT, str(tmp_path / "cache"))
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


def test_clean_empties_the_cache_and_nothing_else(papilla, tmp_path, monkeypatch):
    import numpy as np

    monkeypatch.setenv(cache.ENVIRONMENT, str(tmp_path / "cache"))
    monkeypatch.setattr("papilla.verify.self_test.self_test", list)
    cache.keep("thing", "one", {"a": np.arange(3.0)})
    (tmp_path / "cache" / "thing" / "notes.txt").write_text("mine")
    answer = papilla("doctor", "--clean", "--json")
    facts = json.loads(answer.out)
    assert facts["cache"]["entries"] == 0 and facts["cache"]["removed_bytes"] > 0
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == ["notes.txt"]


def test_a_check_that_fails_is_exit_1_and_is_named(papilla, monkeypatch):
    from papilla.verify.case import Case

    monkeypatch.setattr("papilla.verify.self_test.self_test", lambda: [Case("press, force", "sum", 0.5, 1e-9)])
    answer = papilla("doctor")
    assert answer.code == 1 and "0 of 1 checks passed" in answer.out and "FAILED: press, force" in answer.out


def test_a_cache_that_others_can_write_to_is_not_usable(tmp_path, monkeypatch):
    monkeypatch.setenv(cache.ENVIRONMENT, str(tmp_path))
    tmp_path.chmod(0o777)
    assert doctor._cache()["usable"] is False


@pytest.mark.slow
@pytest.mark.mesher
def test_a_new_finger_from_surface_files_runs_at_once(papilla):
    papilla("new", "mine.toml", "--shape", "surfaces")
    scene = ("--modulus", 0.51, "--force", 0.588, "--size-mm", 2.5, "--fidelity", "contact", "--json")
    own, dome = (json.loads(papilla("press", *finger, *scene).out) for finger in (["--finger", "mine.toml"], []))
    assert own["indentation_mm"] == pytest.approx(dome["indentation_mm"], rel=0.02)
    assert "facets" not in own["status"]


FACTS = {
    "papilla": "1.2", "python": "3.11", "platform": "here", "packages": {"numpy": "2.0", "rslab": None},
    "rendering": "EGL", "threads": {"cores": 4, "processes": 2},
    "cache": {"folder": "/c", "chosen_by": "me", "usable": True, "bytes": 2_345_678, "entries": 3},
    "extras": {"view": {"packages": {"plotly": "5"}}, "more": {"packages": {"a": None, "b": "1", "c": None}}},
    "self_test": {"cases": [1, 2, 3], "seconds": 1.26},
}  # fmt: skip


@pytest.mark.parametrize("usable, failed", [(True, []), (False, ["a", "b"])])
def test_the_state_of_an_installation_in_words(capsys, usable, failed):
    facts = FACTS | {"cache": FACTS["cache"] | {"usable": usable}}
    doctor._print(facts, failed)
    passed = "3 of 3 checks passed, 1.3 s" if usable else "1 of 3 checks passed, 1.3 s; FAILED: a; FAILED: b"
    assert capsys.readouterr().out.splitlines() == [
        "papilla     1.2", "Python      3.11, here", "numpy       2.0", "rslab       MISSING", "rendering   EGL",
        "threads     4 cores, 2 processes in long jobs, each of 1 thread",
        f"cache       /c (me){'' if usable else '; NOT USABLE'}", "cache size  2.3 MB in 3 entries",
        "extra view  there", "extra more  lacks a, c", f"self-test   {passed}",
    ]  # fmt: skip


def test_packages_are_required_or_of_an_extra(monkeypatch):
    from importlib import metadata

    lines = ["numpy>=2", "rich", "absent ; extra == 'view'", 'plotly>5; python_version > "3" and extra == "view"']
    known = {"numpy": "2.1", "rich": "13", "plotly": "5.9"}

    def version(name):
        if name not in known:
            raise metadata.PackageNotFoundError(name)
        return known[name]

    monkeypatch.setattr(metadata, "requires", lambda name: [*lines, "rich; extra == 'pretty'"])
    monkeypatch.setattr(metadata, "version", version)
    required, extras = doctor._packages()
    assert required == {"numpy": "2.1", "rich": "13"}
    assert extras == {
        "view": {"complete": False, "packages": {"absent": None, "plotly": "5.9"}},
        "pretty": {"complete": True, "packages": {"rich": "13"}},
    }

    def requires(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "requires", requires)
    assert doctor._packages() == ({}, {})
    monkeypatch.setattr(metadata, "requires", lambda name: None)
    assert doctor._packages() == ({}, {})


@pytest.mark.parametrize("window, named, said", [
    (True, None, "VTK's own window"), (True, "OSMesa", "OSMesa"), (False, "OSMesa", "matplotlib alone"),
])  # fmt: skip
def test_the_renderer_is_named(monkeypatch, window, named, said):
    from papilla.view import render

    monkeypatch.setattr(render, "use_offscreen_window", lambda: window)
    monkeypatch.delenv(render.ENVIRONMENT, raising=False)
    if named:
        monkeypatch.setenv(render.ENVIRONMENT, named)
    assert doctor._rendering() == said


def test_the_cache_says_who_chose_it_and_what_was_removed(papilla, tmp_path, monkeypatch):
    import numpy as np

    monkeypatch.setattr("papilla.verify.self_test.self_test", list)
    monkeypatch.setenv(cache.ENVIRONMENT, str(tmp_path / "cache"))
    for kind, name in (("thing", "one"), ("thing", "two"), ("other", "one")):
        cache.keep(kind, name, {"a": np.arange(1000.0)})
    sizes = cache.entries()
    found = doctor._cache()
    assert found["bytes"] == sum(sizes.values()) == sum(found["bytes_by_kind"].values()) and found["entries"] == 3
    assert found["bytes_by_kind"]["thing"] == sum(size for path, size in sizes.items() if path.parent.name == "thing")
    facts = json.loads(papilla("doctor", "--json").out)
    assert facts["cache"]["removed_bytes"] == 0 and facts["cache"]["entries"] == 3
    answer = papilla("doctor", "--clean", "--json")
    facts = json.loads(answer.out)
    assert facts["cache"]["removed_bytes"] == found["bytes"] and facts["cache"]["entries"] == 0
    assert answer.err == f"removed {found['bytes'] / 1e6:.1f} MB from {tmp_path / 'cache'}\n"
    assert answer.code == 0 and facts["self_test"]["passed"] and facts["self_test"]["cases"] == []
    monkeypatch.delenv(cache.ENVIRONMENT)
    monkeypatch.setattr(cache, "entries", dict)
    assert doctor._cache()["chosen_by"] == "the user's cache folder"


def test_a_new_design_says_what_was_written_and_how_to_try_it(papilla, refused, tmp_path):
    answer = papilla("new", "mine.toml")
    assert answer.out == ("Wrote mine.toml\nTry it: papilla press --finger mine.toml --modulus 0.51 --force 0.588\n")
    (tmp_path / "link.toml").symlink_to("nowhere.toml")
    assert "link.toml is already there and is not overwritten" in refused("new", "link.toml")


def test_a_map_of_a_log_has_a_row_for_each_column(papilla, tmp_path, monkeypatch):
    from types import SimpleNamespace

    guesses = [
        SimpleNamespace(name="ch1", meant="g1", unit="V", reason="it swings"),
        SimpleNamespace(name="who", meant="", unit="", reason="text"),
    ]
    found = SimpleNamespace(
        guesses=guesses,
        open_questions=("which unit?",),
        delimiter=";",
        decimal=",",
        header_line=2,
        to_toml=lambda: "a map",
    )
    asked = []
    monkeypatch.setattr("papilla.logs.proposal.propose", lambda path: asked.append(str(path)) or found)
    (tmp_path / "log.csv").write_text("x")
    (tmp_path / "log.csv").chmod(0o444)
    answer = papilla("log", "map", "log.csv", "--out", "m.toml")
    assert asked == ["log.csv"] and (tmp_path / "m.toml").read_text() == "a map" and answer.err == "which unit?\n"
    rows = [" ".join(line.replace("│", " ").split()) for line in answer.out.splitlines()]
    assert "ch1 g1 V it swings" in rows and "who - text" in rows
    assert rows[-1].startswith("Wrote m.toml: check it, then give it by --map")
    facts = json.loads(papilla("log", "map", "log.csv", "--out", "m.toml", "--json").out)
    assert (facts["map"], facts["delimiter"], facts["decimal"], facts["header_line"]) == ("m.toml", ";", ",", 2)
    assert facts["columns"] == [vars(one) for one in guesses] and facts["open_questions"] == ["which unit?"]
