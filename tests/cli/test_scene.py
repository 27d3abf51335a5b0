"""Scene files: options from a TOML file, overridden by those that are given, refused as on the command line."""

import json

import pytest

SLIDE = ("slide", "--out", "log.csv", "--scene", "scene.toml")


@pytest.fixture
def scene(tmp_path):
    """Writes the scene file."""
    return lambda text: (tmp_path / "scene.toml").write_text(text, encoding="utf-8")


@pytest.mark.slow
def test_a_scene_is_what_its_options_say(papilla, scene):
    scene('seconds = 2\nround_trip_ms = 30\nround_trip_sd_ms = 0.0\nactuator = "icpf"\nstroke_um = 40\njson = true\n')
    simulate = ("telepresence", "simulate", "--scene", "scene.toml")
    found = json.loads(papilla(*simulate).out)
    assert (found["seconds"], found["display"]["stroke_um"]) == (2.0, 40.0)
    assert found["lag_ms"]["round_trip"] == pytest.approx(30, abs=1)
    stated = ("--seconds", 2, "--round-trip-ms", 30, "--round-trip-sd-ms", 0, "--actuator", "icpf", "--stroke-um", 40)
    assert json.loads(papilla("telepresence", "simulate", *stated, "--json").out) == found
    assert json.loads(papilla(*simulate, "--round-trip-ms", 60).out)["lag_ms"]["round_trip"] == pytest.approx(60, abs=1)


@pytest.mark.parametrize(
    "text, said",
    [
        ("groove = 1\nrigde = 1\n", "scene.toml: `papilla slide` has no option 'rigde'"),
        ("scene = 'other.toml'\n", "has no option 'scene'"),
        ("groove = 'wide'\n", "Invalid value for '--groove'"),
        ("groove = {width = 1}\n", "Invalid value for '--groove'"),
        ("form = 'square'\n", "Invalid value for '--form'"),
        ("groove = 1\nridge = 1\nspeed = 40\n", "--speed needs --seconds"),
        ("groove = 1\ngroove = 2\n", "scene.toml is not valid TOML"),
    ],
)
def test_a_bad_scene_is_one_line(refused, scene, text, said):
    scene(text)
    assert said in refused(*SLIDE)


def test_what_is_given_overrides_the_scene(refused, scene):
    scene("groove = 1\nridge = -1\nspeed = 40\nseconds = 0.1\n")
    assert "ridge" in refused(*SLIDE)
    assert "grating groove" in refused(*SLIDE, "--ridge", 1, "--groove", -1)


def test_a_scene_is_not_overwritten_and_must_be_there(refused, scene):
    assert "cannot read scene file scene.toml" in refused(*SLIDE)
    scene("groove = 1\nridge = 1\nspeed = 40\nseconds = 0.1\n")
    assert "would overwrite the input" in refused(*SLIDE, "--out", "scene.toml")


def test_options_that_a_scene_states_count_as_given(refused, scene):
    scene("log = 'none.csv'\nwavelength = 2.0\n")
    assert "--wavelength: of the simulated" in refused("telepresence", "simulate", "--scene", "scene.toml")
