"""Output: JSON, long lines, and the bar of a terminal."""

import json
import math
import os
import subprocess
import sys

import pytest

from papilla.cli import options, output
from papilla.core import seams
from papilla.core.errors import InputError
from papilla.core.progress import CountedStep


def test_json_has_no_numbers_that_are_none_and_no_control_characters():
    text = output.json_text({"a": [1.5, math.nan, (math.inf, 2)], "b": {"c": -math.inf, "d": "µ\x7f"}, "e": True})
    assert json.loads(text) == {"a": [1.5, None, [None, 2]], "b": {"c": None, "d": "µ\x7f"}, "e": True}
    assert text.isascii() and "\\u007f" in text
    assert '"µ\\u007f"' in output.json_text({"d": "µ\x7f"}, ascii_only=False)


@pytest.mark.parametrize("length", [1999, 2000, 2001, 5000])
def test_the_middle_of_a_long_line_is_left_out(length):
    text = "a" * 1000 + "b" * (length - 1000)
    found = output.plain(text)
    if length <= 2000:
        assert found == text
    else:
        assert found == f"{'a' * 1000} ... ({length - 2000} characters) ... {'b' * 1000}"


def test_a_table_of_rows_has_names_left_and_numbers_right(capsys):
    output.show_rows(["name", "long head"], [["a", "1"], ["bbbbbb", "22"]], "title [x]")
    title, _, heads, _, first, second, _ = capsys.readouterr().out.splitlines()
    assert title.strip() == "title [x]"
    assert heads.replace("┃", "│") == "│ name   │ long head │"
    assert first == "│ a      │         1 │" and second == "│ bbbbbb │        22 │"
    output.show_rows(["name"], [])
    assert "name" in capsys.readouterr().out
    output.print_table([("a", "1", "N"), ("bbb", "22", "µε/gf")])
    assert capsys.readouterr().out.splitlines()[1:3] == ["│ a   │  1 │ N     │", "│ bbb │ 22 │ µε/gf │"]


@pytest.mark.parametrize("text, found", [(None, None), ("stick", "stick"), ("0", 0.0), ("0.5", 0.5)])
def test_friction_of_a_text(text, found):
    assert options.read_friction(text) == found


def test_element_sizes():
    assert options.mesh_size(None) is None and options.mesh_size(1.5) == 1.5
    with pytest.raises(InputError, match="--size-mm must be greater than 0"):
        options.mesh_size(0.0)


def test_a_fault_names_its_file_once(tmp_path):
    for said in ("a fault", f"{tmp_path}: a fault"):
        with pytest.raises(InputError, match=f"^{tmp_path}: a fault$"), options.about(tmp_path):
            raise InputError(said)


def test_notes_of_a_log_are_said_and_units_where_they_are_asked_for(tmp_path, capsys):
    path = tmp_path / "log.csv"
    path.write_text("force_N,modulus_MPa,g1,who\n20,0.5,1,a\n30,0.1,2,b\n")
    quiet, loud = [], []
    for units, said in ((False, quiet), (True, loud)):
        assert options.read_press_log(path, units).force_N.tolist() == [20, 30]
        said += capsys.readouterr().err.splitlines()
    assert quiet == [f"{path}: ignored columns: who"] and loud[0] == quiet[0] and "gf" in loud[1]


def test_away_from_a_terminal_a_stage_is_named_and_again_after_five_seconds(monkeypatch, capsys):
    now = iter([100.0, 104.9, 105.0, 109.9, 110.0, 110.5, 111.0])
    monkeypatch.setattr(seams, "now_ns", lambda: round(1e9 * next(now)))
    with output.progress() as shown:
        for number in range(5):
            shown(f"meshing, {number}")
        shown(CountedStep("mesh 3 of 5, 0 s", 3, 5))
        shown("fitting")
    assert capsys.readouterr().err.splitlines() == [
        "meshing, 0",
        "meshing, 2",
        "meshing, 4",
        "mesh 3 of 5, 0 s",
        "fitting",
    ]


def test_numbers_stay_whole_where_nothing_fits(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "12")
    output.show_rows(["name", "1.5 ± 0.25 mm"], [["a long name", "1.25 ± 0.125 N"]])
    said = capsys.readouterr().out
    assert any("a long name │ 1.25 ± 0.125 N" in line for line in said.splitlines()) and "…" not in said


@pytest.mark.parametrize("encoding", ["cp1252", "ascii", "utf-8"])
def test_what_an_encoding_lacks_is_written_as_an_escape(encoding, tmp_path):
    """A name of the log in what a command prints and says."""
    (tmp_path / "log.csv").write_text("t_s,µε \u4e2d,g1\n0,1,2\n1,2,3\n2,3,4\n", encoding="utf-8")
    command = [sys.executable, "-m", "papilla", "log", "map", "log.csv", "--out", "m.toml"]
    environment = {**os.environ, "PYTHONIOENCODING": encoding}
    for json_too in ([], ["--json"]):
        done = subprocess.run([*command, *json_too], cwd=tmp_path, env=environment, capture_output=True)
        assert done.returncode == 0, done.stderr
        text = done.stdout.decode(encoding)
        assert ("\u4e2d" in text) == (encoding == "utf-8") and ("\\u4e2d" in text) == (encoding != "utf-8")
        if json_too:
            assert [one["name"] for one in json.loads(text)["columns"]][1] == "µε \u4e2d"
