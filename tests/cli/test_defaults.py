"""Numbers out of range, exit codes, and defaults that are those of the library."""

import json

import pytest

from papilla.cli import output
from papilla.cli.options import DEFAULT_PROCESSES
from papilla.model.finger import Finger


@pytest.mark.parametrize("name", ["simulate", "sensor"])
@pytest.mark.parametrize(
    "option, value, said",
    [
        ("--seed", -1, "greater than or equal to 0"),
        ("--components", 0, "greater than or equal to 1"),
        ("--components", 9, "less than or equal to 8"),
    ],
)
def test_numbers_out_of_range_are_refused(refused, name, option, value, said):
    assert said in refused("telepresence", name, option, value)


def test_codes_and_processes():
    codes = (
        output.CHECK_FAILED,
        output.EXIT_BAD_INPUT,
        output.EXIT_INTERNAL,
        output.EXIT_INTERRUPTED,
        output.BROKEN_PIPE,
    )
    assert codes == (1, 2, 70, 130, 141) and output.EXIT_TERMINATED == 143 and DEFAULT_PROCESSES in (1, 2)


def test_defaults_are_those_of_the_files_that_are_written(papilla, tmp_path):
    """Without options: a new design is a dome, a press is at the apex and of the fidelity that papilla chooses."""
    assert papilla("new", "mine.toml").code == 0 and type(Finger.load(tmp_path / "mine.toml").shape).__name__ == "Dome"
    scene = ("press", "--modulus", 0.2, "--force", 0.1, "--size-mm", 2.8, "--fidelity", "hertz", "--json")
    plain = json.loads(papilla(*scene).out)
    stated = json.loads(papilla(*scene, "--at", 0, 0, "--specimen", "block", "--finger", "default").out)
    assert plain | {"seconds": 0} == stated | {"seconds": 0}
