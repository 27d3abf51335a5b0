"""One physics: every command and Python take specimen, friction and large strain from the design's bench, say in the
same words what they took, and give the same S_d of the same scene."""

import json
from dataclasses import replace

import numpy as np
import pytest

import papilla as library
from papilla.calibration import DEFAULT_FORCES, DEFAULT_MODULI, fit, sweep
from papilla.model.finger import Bench, Finger
from papilla.model.specimen import physics_words

pytestmark = pytest.mark.slow

MODULUS, FORCE = DEFAULT_MODULI[20], DEFAULT_FORCES[40]
SAID = {
    "silent": "block 10 mm thick, friction stick, large strain included",
    "told": "block 8 mm thick, friction 0.2, large strain included",
}


@pytest.fixture(params=[*SAID])
def scene(request, tmp_path):
    """A design whose bench says nothing, or something, its file, and what every command has to say of a press."""
    design = Finger.default()
    if request.param == "told":
        design = replace(design, bench=Bench(thickness=8.0, friction=0.2))
    design.save(tmp_path / "design.toml")
    return design, ["--finger", "design.toml"], SAID[request.param]


def test_one_scene_has_one_sd(papilla, scene):
    design, option, words = scene
    where = ["--modulus", MODULUS, "--force", FORCE, *option, "--json"]
    told = [json.loads(papilla(*command, *where).out) for command in (["press"], ["view", "contact"])]
    reduced = library.fem.prepare(design)
    pressed = library.fem.press(reduced, design.bench.specimen(MODULUS), force=FORCE)
    table = sweep(reduced, [MODULUS, 1.1 * MODULUS], [FORCE])
    assert {one["physics"] for one in told} == {words} == {table.physics}
    assert physics_words(design.bench.specimen(MODULUS), pressed.friction, pressed.large_strain) == words
    found = [*(one["sd_microstrain"] for one in told), table.sd_microstrain[0]]
    np.testing.assert_allclose(found, pressed.sd, rtol=1e-6)


def test_a_slide_at_rest_is_a_press_on_what_is_rigid(papilla, scene):
    _, option, words = scene
    flat = ["--groove", 5, "--ridge", 60, "--speed", 0, "--seconds", 0.05, "--out", "log.csv"]
    rest = json.loads(papilla("slide", *flat, "--force", FORCE, *option, "--json").out)["at_rest"]
    rigid = ["--modulus", 1e4, "--specimen", "half-space", "--force", FORCE]
    told = json.loads(papilla("press", *rigid, *option, "--json").out)
    assert rest["physics"] == told["physics"] == words.replace(words.split(",")[0], "half-space")
    assert rest["sd_microstrain"] == pytest.approx(told["sd_microstrain"], rel=1e-9)


def test_a_fit_says_what_its_intervals_lack(scene):
    design, _, _ = scene
    reduced = library.fem.prepare(design)
    grid = DEFAULT_MODULI[::6], DEFAULT_FORCES[::6]
    presses = sweep(reduced, *grid)
    alone = fit(presses)
    silent = design.bench.friction is None
    lacks = ["mesh scatter", "friction"] if silent else ["mesh scatter"]
    assert alone.provenance["lacks"] == lacks
    assert repr(alone).endswith(f"intervals lack {' and '.join(lacks)}>")
    assert sum("intervals do not" in note for note in alone.notes) == len(lacks)
    free = sweep(reduced, *grid, friction=0)
    whole = fit(presses, [free], frictionless=free)
    assert whole.provenance["lacks"] == [] and "lack" not in repr(whole)
    sigma = [one.invert(alone.predict(FORCE, 0.2), FORCE).sigma_MPa for one in (alone, whole)]
    assert sigma[1] > (3 if silent else 0.99) * sigma[0], "friction that nobody told is most of what is not known"
    assert alone.surface.uncertainty.strain > 0, "what is not known of large strain is in both"
