"""`papilla press`: the documented JSON, the table, and options that must not be ignored."""

import json

import numpy as np
import pytest

from papilla.logs import read_time_log

KEYS = {
    *("force_N", "modulus_MPa", "fidelity", "indentation_mm", "contact_area_mm2", "peak_pressure_MPa"),
    *("gauge_strain", "reading_microstrain", "sd_microstrain", "force_balance", "status", "seconds"),
}


@pytest.mark.slow
def test_the_published_finger_meets_the_published_depths(papilla):
    """0.80 mm at 38.37 gf and 1.0 mm at 0.6 N, less its touch-down, on a hard flat; its bench is what is pressed."""
    for depth, force in ((0.80, 0.37628), (1.0, 0.6)):
        scene = ["press", "--finger", "published", "--specimen", "half-space", "--modulus", 1e4, "--force", force]
        found = json.loads(papilla(*scene, "--json").out)
        assert found["indentation_mm"] + 0.1632 == pytest.approx(depth, rel=0.02)
        assert found["friction"] == "stick" and found["large_strain"]
    scene = ["press", "--finger", "published", "--modulus", 0.51, "--force", 0.6, "--json"]
    assert json.loads(papilla(*scene).out)["specimen"]["thickness_mm"] == 10


@pytest.mark.slow
def test_friction_is_an_option_and_is_named(papilla):
    scene = ["press", "--modulus", 0.51, "--force", 0.4, "--fidelity", "contact", "--json"]
    plain, stuck = (json.loads(papilla(*scene, *more).out) for more in ([], ["--friction", "stick"]))
    assert plain["friction"] == 0 and stuck["friction"] == "stick"
    assert -0.05 < stuck["sd_microstrain"] / plain["sd_microstrain"] - 1 < -0.03
    assert "stuck from the moment of contact" in stuck["status"]


@pytest.mark.slow
def test_the_finite_rung_is_a_choice(papilla):
    answer = papilla("press", "--modulus", 0.51, "--force", 0.01, "--fidelity", "finite", "--json")
    assert answer.code == 0, answer.err
    facts = json.loads(answer.out)
    linear = json.loads(papilla("press", "--modulus", 0.51, "--force", 0.01, "--fidelity", "contact", "--json").out)
    assert facts["fidelity"] == "finite" and facts["friction"] == "stick" and linear["friction"] == 0
    assert facts["sd_microstrain"] == pytest.approx(linear["sd_microstrain"], rel=0.02)
    assert facts["sd_microstrain"] != linear["sd_microstrain"]


def test_a_finger_too_large_for_the_memory_is_refused_before_it_is_factorised(papilla, tmp_path, monkeypatch):
    from papilla.core import seams
    from papilla.model.finger import DEFAULT_FINGER

    text = DEFAULT_FINGER.read_text(encoding="utf-8").replace("modulus_MPa = 0.136", "modulus_MPa = 0.1357")
    (tmp_path / "finger.toml").write_text(text, encoding="utf-8")
    monkeypatch.setattr(seams, "free_bytes", lambda: 2 * 10**8)
    answer = papilla("press", "--modulus", 0.5, "--force", 0.1, "--finger", "finger.toml", "--json")
    assert (answer.code, answer.out) == (2, "")
    line = answer.err.splitlines()[-1]
    assert line.startswith(
        "papilla: factorising a mesh of 8,679 tetrahedra (43,226 unknowns, size_mm 0.7) needs about "
    )
    assert " GiB of memory, 0.19 GiB are free: mesh with size_mm >= " in line and "(--size-mm of press, " in line


@pytest.mark.slow
def test_a_press_as_a_log_over_time_ends_in_the_same_press(papilla, tmp_path):
    answer = papilla("press", "--modulus", 0.1, "--force", 0.4, "--log", "touch.csv", "--json")
    assert answer.code == 0, answer.err
    found, log = json.loads(answer.out), read_time_log(tmp_path / "touch.csv")
    assert found["log"] == "touch.csv" and log.sample_rate_Hz == pytest.approx(1000)
    assert log.readings[-1].tolist() == found["reading_microstrain"] and log.force_N[-1] == 0.4
    assert not log.readings[:200].any() and (log.force_N[:200] == 0).all() and (np.diff(log.force_N) >= 0).all()
    row = 400
    alone = papilla("press", "--modulus", 0.1, "--force", repr(float(log.force_N[row])), "--json")
    np.testing.assert_allclose(log.readings[row], json.loads(alone.out)["reading_microstrain"], rtol=1e-3)


@pytest.mark.slow
def test_the_field_of_a_press_is_written_beside_it(papilla, tmp_path):
    import meshio

    answer = papilla("press", "--modulus", 0.51, "--force", 0.3, "--export", "field.vtu", "--json")
    assert answer.code == 0, answer.err
    field = meshio.vtu.read(str(tmp_path / "field.vtu"))
    assert json.loads(answer.out)["field"] == "field.vtu"
    assert field.point_data["displacement_mm"][:, 2].min() < -0.3 and "stress_MPa" in field.cell_data


COARSE = ("--size-mm", 2.8, "--fidelity", "hertz")
"""A press that takes hundredths of a second."""


def coarse(papilla, *options):
    answer = papilla("press", *options, *COARSE, "--json")
    assert answer.code == 0, answer.err
    assert answer.out.count("\n") == 1, "one object and nothing else"
    return json.loads(answer.out)


def test_each_option_of_a_press_changes_what_it_names(papilla):
    scene = {"--modulus": 0.5, "--force": 0.4}
    plain = coarse(papilla, *(part for pair in scene.items() for part in pair))

    def other(**changed):
        options = scene | {f"--{name}": value for name, value in changed.items()}
        return coarse(papilla, *(part for pair in options.items() for part in pair))

    assert set(plain) >= KEYS and plain["force_balance"] <= 1e-9
    assert plain["specimen"] == {"kind": "block", "modulus_MPa": 0.5, "thickness_mm": 10.0, "nu": 0.495}
    assert plain["reading_microstrain"][2] > 0 > plain["reading_microstrain"][1], "stretched below the contact alone"
    assert (plain["force_N"], plain["modulus_MPa"], plain["at_mm"]) == (0.4, 0.5, [0.0, 0.0])
    assert plain["fidelity"] == "hertz" and plain["finger"] == "human-finger-mimetic sensor"
    assert other(modulus=1)["sd_microstrain"] > plain["sd_microstrain"], "a hard specimen strains the skin more"
    assert other(force=0.6)["indentation_mm"] > plain["indentation_mm"]
    assert other(thickness=3)["indentation_mm"] < plain["indentation_mm"], "a thin block on a plate is stiffer"
    finger = other(finger="published")
    assert finger["finger"] == "human-finger-mimetic sensor as published"
    finer = papilla("press", "--modulus", 0.5, "--force", 0.4, "--size-mm", 2.0, "--fidelity", "hertz", "--json")
    assert json.loads(finer.out)["sd_microstrain"] != plain["sd_microstrain"]


def test_a_touch_log_rests_rises_evenly_and_is_held(papilla, tmp_path):
    """0.2 s in the air, which give the zero, half a second of loading, half a second held; a field beside it."""
    meshio = pytest.importorskip("meshio")
    force = 0.4
    facts = coarse(papilla, "--modulus", 0.5, "--force", force, "--log", "touch.csv", "--export", "field.vtu")
    log = read_time_log(tmp_path / "touch.csv")
    ramp = force * np.clip((log.t_s - 0.2) / 0.5, 0, 1)
    assert len(log) == 1200 and log.sample_rate_Hz == pytest.approx(1000)
    touched = log.force_N > 0
    np.testing.assert_allclose(log.force_N, np.where(ramp < 0.01, 0, ramp), atol=1e-9)
    assert log.force_N[touched].min() == pytest.approx(0.0104, abs=1e-6), "half of what estimators see as contact"
    assert not log.readings[~touched].any() and (log.readings[701:] == facts["reading_microstrain"]).all()
    deep = np.loadtxt(tmp_path / "touch.csv", delimiter=",", skiprows=1)[:, -1]
    assert deep[-1] == pytest.approx(facts["indentation_mm"]) and (np.diff(deep[touched][:480]) > 0).all()
    assert (np.diff(log.readings.std(axis=1)[touched][:480]) > 0).all()
    field = meshio.vtu.read(str(tmp_path / "field.vtu"))
    assert field.point_data["displacement_mm"][:, 2].min() == pytest.approx(-facts["indentation_mm"], rel=0.2)
    assert (facts["log"], facts["field"]) == ("touch.csv", "field.vtu")
    assert "Wrote field.vtu" in papilla("press", "--modulus", 0.5, "--force", 0.4, *COARSE, "--export", "field.vtu").out


@pytest.mark.parametrize("seed", range(3))
def test_force_and_indentation_lead_to_each_other(papilla, seed):
    modulus, force = np.exp(np.random.default_rng(seed).uniform(np.log([0.05, 0.05]), np.log([2, 0.8])))
    pressed = coarse(papilla, "--modulus", modulus, "--force", force)
    back = coarse(papilla, "--modulus", modulus, "--indentation", pressed["indentation_mm"])
    assert back["force_N"] == pytest.approx(force, rel=1e-6)
    np.testing.assert_allclose(back["reading_microstrain"], pressed["reading_microstrain"], rtol=1e-6)
    assert pressed["sd_microstrain"] == pytest.approx(np.std(pressed["reading_microstrain"]))


def test_the_table_has_the_numbers_of_the_json(papilla):
    scene = ("press", "--modulus", 0.5, "--force", 0.4, *COARSE)
    found = json.loads(papilla(*scene, "--json").out)
    said = " ".join(papilla(*scene).out.replace("│", " ").split())
    for part in (
        f"indentation {found['indentation_mm']:.4g} mm", f"contact area {found['contact_area_mm2']:.4g} mm²",
        f"reading g1 {found['reading_microstrain'][0]:.1f} µε", f"S_d (population sd) {found['sd_microstrain']:.1f} µε",
        "force 0.4 N", "fidelity hertz", f"Pressed on: {found['physics']}", found["status"],
    ):  # fmt: skip
        assert part in said, (part, said)
