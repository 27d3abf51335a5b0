"""Values and names at the edge of sense, through whole commands: one clear line and exit 2, or a right answer."""

import os
import subprocess
import sys

import pytest

from papilla.model.finger import DEFAULT_FINGER

SCENE = ["--modulus", "0.5", "--force", "0.3"]


def scene(**changed: str) -> list[str]:
    """The arguments of a press with some options changed."""
    options = {"modulus": "0.5", "force": "0.3"} | changed
    return ["press", *(part for name, value in options.items() for part in (f"--{name}", value))]


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        scene(thickness="0.001"),
        scene(force="1e-30"),
        scene(force="1e155"),
        scene(force="1e300"),
        scene(modulus="1e-300"),
        scene(modulus="1e300"),
        scene(specimen="sphere", radius="1e-300"),
        scene(specimen="sphere", radius="0.2", force="0.1"),
        ["press", "--modulus", "0.5", "--indentation", "1e-300"],
        ["press", "--modulus", "0.5", "--indentation", "1e9"],
        ["press", *SCENE, "--at", "1e300", "0"],
    ],
    ids=" ".join,
)
def test_numbers_beyond_sense_are_refused_in_one_line(papilla, arguments):
    answer = papilla(*arguments)
    assert answer.code == 2 and answer.out == "", answer
    *progress, line = answer.err.splitlines()
    assert line.startswith("papilla: ") and not any("Warning" in told or "Traceback" in told for told in progress)


@pytest.mark.parametrize("old, new", [("24.0", "1e300"), ("24.0", "1e-300"), ("24.0", "nan"), ("24.0", "-24.0")])
def test_a_finger_beyond_sense_is_refused_in_one_line(refused, tmp_path, old, new):
    design = DEFAULT_FINGER.read_text(encoding="utf-8")
    assert old in design
    (tmp_path / "f.toml").write_text(design.replace(old, new), encoding="utf-8")
    refused("press", *SCENE, "--finger", "f.toml")


@pytest.mark.slow
@pytest.mark.parametrize("picture", ["strain", "receptive", "contact"])
def test_names_that_mean_something_to_others_are_drawn_as_they_are(tmp_path, picture):
    """Mathematics for matplotlib, markup for rich, a format for Python, in a narrow cp1252 terminal."""
    design = DEFAULT_FINGER.read_text(encoding="utf-8")
    names = [r"$\\frac{x}$", "[/]", "[red]", "µε %s {0}", "g5"]
    for number, name in enumerate(names, 1):
        assert f'"g{number}"' in design
        design = design.replace(f'"g{number}"', f'"{name}"')
    (tmp_path / "f.toml").write_text(design, encoding="utf-8")
    environment = os.environ | {"PYTHONIOENCODING": "cp1252", "COLUMNS": "20"}
    view = ["view", picture, "--screenshot", "p.png", *(["--gauge", names[1]] if picture == "receptive" else SCENE)]
    for arguments in (["press", *SCENE], view):
        command = [sys.executable, "-m", "papilla", *arguments, "--finger", "f.toml", "--size-mm", "2.8"]
        ended = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, timeout=600)
        assert ended.returncode == 0, ended.stderr
        assert b"Traceback" not in ended.stderr and b"\x1b" not in ended.stdout + ended.stderr
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")
