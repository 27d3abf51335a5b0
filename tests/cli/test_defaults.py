"""Numbers out of range, exit codes, and defaults that are those of the library."""

import json

from papilla.model.finger import Finger


def test_defaults_are_those_of_the_files_that_are_written(papilla, tmp_path):
    """Without options: a new design is a dome, a press is at the apex and of the fidelity that papilla chooses."""
    assert papilla("new", "mine.toml").code == 0 and type(Finger.load(tmp_path / "mine.toml").shape).__name__ == "Dome"
    scene = ("press", "--modulus", 0.2, "--force", 0.1, "--size-mm", 2.8, "--fidelity", "hertz", "--json")
    plain = json.loads(papilla(*scene).out)
    stated = json.loads(papilla(*scene, "--at", 0, 0, "--specimen", "block", "--finger", "default").out)
    assert plain | {"seconds": 0} == stated | {"seconds": 0}
