"""`papilla press`: the documented JSON, the table, and options that must not be ignored."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest

from papilla.logs import read_time_log
from papilla.model.finger import Finger

KEYS = {
    *("force_N", "modulus_MPa", "fidelity", "indentation_mm", "contact_area_mm2", "peak_pressure_MPa"),
    *("gauge_strain", "reading_microstrain", "sd_microstrain", "force_balance", "status", "seconds"),
}


@pytest.mark.slow
def test_json_of_the_published_scene(papilla):
    answer = papilla("press", "--modulus", 0.51, "--force", 0.588, "--json")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)
    assert answer.out.count("\n") == 1, "one object and nothing else"
    assert set(found) >= KEYS
    assert found["force_N"] == 0.588 and found["modulus_MPa"] == 0.51
    assert found["force_balance"] <= 1e-9
    g1, g2, g3, g4, g5 = found["reading_microstrain"]
    assert g1 == pytest.approx(g5, rel=0.02) and g2 == pytest.approx(g4, rel=0.02)
    assert g3 > 0 > g2, "the skin is stretched below the contact and compressed beside it"
    assert found["specimen"] == {"kind": "block", "modulus_MPa": 0.51, "thickness_mm": 10.0, "nu": 0.495}
    assert found["finger"] == "human-finger-mimetic sensor"


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
def test_force_and_indentation_are_two_ways_to_one_scene(papilla):
    scene = ["press", "--modulus", 0.2, "--specimen", "sphere", "--radius", 30, "--fidelity", "contact", "--json"]
    by_force = json.loads(papilla(*scene, "--force", 0.4).out)
    by_depth = json.loads(papilla(*scene, "--indentation", by_force["indentation_mm"]).out)
    assert by_depth["force_N"] == pytest.approx(0.4, rel=1e-6)
    assert by_depth["sd_microstrain"] == pytest.approx(by_force["sd_microstrain"], rel=1e-6)
    assert by_force["specimen"]["radius_mm"] == 30


@pytest.mark.slow
def test_friction_is_an_option_and_is_named(papilla):
    scene = ["press", "--modulus", 0.51, "--force", 0.4, "--fidelity", "contact", "--json"]
    plain, stuck = (json.loads(papilla(*scene, *more).out) for more in ([], ["--friction", "stick"]))
    assert plain["friction"] == 0 and stuck["friction"] == "stick"
    assert -0.05 < stuck["sd_microstrain"] / plain["sd_microstrain"] - 1 < -0.03
    assert "stuck from the moment of contact" in stuck["status"]


@pytest.mark.slow
def test_table_shows_units_and_the_status(papilla):
    answer = papilla("press", "--modulus", 0.51, "--force", 0.588)
    assert answer.code == 0
    for text in ("indentation", "mm²", "MPa", "reading g3", "µε", "S_d (population sd)", "block (modulus_MPa 0.51"):
        assert text in answer.out
    assert answer.out.splitlines()[-1].startswith(("contact: ", "hertz: "))


@pytest.mark.parametrize(
    "options, message",
    [
        ([], "give exactly one of --force and --indentation"),
        (["--force", 1, "--indentation", 1], "give exactly one of --force and --indentation"),
        (["--force", 1, "--friction", "glue"], "friction must be a number of at least 0 or \"stick\", got 'glue'"),
        (["--force", 1, "--friction", -0.2], 'friction must be a number of at least 0 or "stick", got -0.2'),
        (["--force", 1, "--friction", "stick", "--fidelity", "hertz"], "--fidelity hertz has no friction"),
        (["--force", 0], "--force (N) must be greater than 0, got 0"),
        (["--force", "nan"], "--force (N) must be finite, got nan"),
        (["--indentation", -1], "--indentation (mm) must be greater than 0, got -1"),
        (["--force", 1, "--at", 0, "inf"], "--at y (mm) must be finite, got inf"),
        (["--force", 1, "--radius", 9], "--radius is for a sphere, not for a block"),
        (["--force", 1, "--specimen", "sphere"], "a sphere needs --radius"),
        (["--force", 1, "--specimen", "sphere", "--radius", -9], "specimen radius (mm) must be greater than 0, got -9"),
        (
            ["--force", 1, "--specimen", "half-space", "--thickness", 9],
            "--thickness is for a block, not for a half-space",
        ),
        (["--force", 1, "--thickness", 0], "specimen thickness (mm) must be greater than 0, got 0"),
        (["--force", 1, "--specimen", "cube"], "'cube' is not one of 'half-space', 'block', 'sphere'"),
        (["--force", 1, "--fidelity", "best"], "'best' is not one of 'auto', 'hertz', 'contact'"),
        (["--force", 1, "--finger", "nowhere.toml"], "cannot read finger file nowhere.toml: No such file"),
    ],
)
def test_unusable_options(refused, options, message):
    assert message in refused("press", "--modulus", 0.5, *options)


@pytest.mark.parametrize("modulus", [0, -1, "nan", "inf"])
def test_unusable_modulus(refused, modulus):
    assert "specimen modulus (MPa) must be" in refused("press", "--modulus", modulus, "--force", 1)


@pytest.mark.parametrize(
    "text, message",
    [
        ("name = [", "is not valid TOML"),
        ("colour = 'red'", "finger.toml: "),
        ("[shape]\nkind = 'cube'", "finger.toml: key name is missing"),
    ],
)
def test_unusable_finger_file(refused, tmp_path, text, message):
    (tmp_path / "finger.toml").write_text(text)
    assert message in refused("press", "--modulus", 0.5, "--force", 1, "--finger", "finger.toml")


@pytest.mark.slow
def test_a_press_beyond_the_model_is_refused(papilla):
    answer = papilla("press", "--modulus", 0.5, "--indentation", 12, "--json")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.splitlines()[-1].startswith("papilla: ")


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
    from papilla.core import memory
    from papilla.model.finger import DEFAULT_FINGER

    text = DEFAULT_FINGER.read_text(encoding="utf-8").replace("modulus_MPa = 0.136", "modulus_MPa = 0.1357")
    (tmp_path / "finger.toml").write_text(text, encoding="utf-8")
    monkeypatch.setattr(memory, "available_bytes", lambda: 2 * 10**8)
    answer = papilla("press", "--modulus", 0.5, "--force", 0.1, "--finger", "finger.toml", "--json")
    assert (answer.code, answer.out) == (2, "")
    line = answer.err.splitlines()[-1]
    assert line.startswith(
        "papilla: factorising a mesh of 8,679 tetrahedra (43,226 unknowns, size_mm 0.7) needs about "
    )
    assert " GiB of memory, 0.19 GiB are free: mesh with size_mm >= " in line and "(--size-mm of press, " in line


@pytest.mark.parametrize("fidelity", ["contact", "finite"])
def test_an_element_size_reaches_the_mesh_of_each_fidelity(papilla, monkeypatch, fidelity):
    from papilla import mesh
    from papilla.core.errors import MeshError
    from papilla.fem import preparing

    def build(finger, size_mm, **_):
        raise MeshError(f"asked for {size_mm:g}")

    for module in (mesh, preparing):
        monkeypatch.setattr(module, "build", build)
    scene = ("press", "--modulus", 0.5, "--force", 0.1, "--fidelity", fidelity)
    assert papilla(*scene, "--size-mm", 1.3).err.endswith("asked for 1.3\n")
    assert papilla(*scene).err.endswith("asked for 0.7\n")


def test_a_card_that_contradicts_its_layer_is_refused(refused, tmp_path):
    from papilla.model.finger import DEFAULT_FINGER

    card = 'modulus_MPa = 0.136\nmaterial = { model = "Ogden", mu_MPa = 0.1, alpha = 3.0 }'
    text = DEFAULT_FINGER.read_text(encoding="utf-8").replace("modulus_MPa = 0.136", card)
    (tmp_path / "finger.toml").write_text(text, encoding="utf-8")
    message = "outer: modulus 0.136 MPa is not that of its ogden material, 0.3 MPa"
    assert message in refused("press", "--modulus", 0.5, "--force", 1, "--finger", "finger.toml")


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


def test_a_log_of_a_press_on_the_whole_mesh_is_refused(refused):
    scene = ("press", "--modulus", 0.1, "--force", 0.4, "--fidelity", "finite", "--log", "touch.csv")
    assert "--log makes hundreds of presses" in refused(*scene)


@pytest.mark.slow
def test_the_field_of_a_press_is_written_beside_it(papilla, tmp_path):
    import meshio

    answer = papilla("press", "--modulus", 0.51, "--force", 0.3, "--export", "field.vtu", "--json")
    assert answer.code == 0, answer.err
    field = meshio.vtu.read(str(tmp_path / "field.vtu"))
    assert json.loads(answer.out)["field"] == "field.vtu"
    assert field.point_data["displacement_mm"][:, 2].min() < -0.3 and "stress_MPa" in field.cell_data


def test_another_field_file_is_refused(refused):
    assert "fields are written as .vtu files" in refused(
        "press", "--modulus", 0.1, "--force", 0.4, "--export", "field.csv"
    )
    assert "linear press" in refused(
        "press", "--modulus", 0.1, "--force", 0.4, "--fidelity", "finite", "--export", "field.vtu"
    )


@dataclass(frozen=True)
class Made:
    """A press in place of one that takes seconds; its numbers are those of its load."""

    force: float
    friction: float = 0.0
    indentation: float = 0.54321
    contact_area: float = 12.345
    peak_pressure: float = 0.0987
    sd: float = 1234.56
    force_balance: float = 2e-12
    fidelity: str = "contact"
    status: str = "contact: made up"
    large_strain: bool = True
    reading: tuple = (1.04, -2.0, 3.0, 4.0, 5.0)

    def to_json(self) -> dict:
        return {"force_N": self.force}


@pytest.fixture
def made(monkeypatch):
    """Presses are made up; returns what was asked for."""
    asked = []

    def press(reduced, touched, *, force, indentation=None, **how):
        asked.append((reduced, touched, force, indentation, how))
        return Made(1.0 if force is None else force)

    prepared = lambda design, size_mm, at, progress: (design.name, size_mm, at)  # noqa: E731
    monkeypatch.setattr("papilla.fem.preparing.prepare", prepared)
    monkeypatch.setattr("papilla.fem.pressing.fidelity.press", press)
    return asked


def test_the_options_of_a_press_reach_it_and_its_numbers_the_table(papilla, made, tmp_path, monkeypatch):
    saved = []
    monkeypatch.setattr("papilla.view.fields", lambda *given, progress: [given])
    monkeypatch.setattr("papilla.fem.fields.save_field", lambda field, path: saved.append((field, path)))
    scene = ("press", "--modulus", 0.5, "--force", 0.4, "--at", 1, 2, "--size-mm", 1.3, "--friction", 0.25)
    answer = papilla(*scene, "--thickness", 7, "--finger", "published", "--export", "f.vtu")
    assert answer.code == 0, answer.err
    ((reduced, touched, force, indentation, how),) = made
    assert reduced == ("human-finger-mimetic sensor as published", 1.3, (1.0, 2.0))
    assert (touched.modulus, touched.thickness, force, indentation) == (0.5, 7.0, 0.4, None)
    assert how == {"fidelity": "auto", "friction": 0.25}
    (((design, whole, presses), path),) = saved
    assert (design.name, whole, presses, str(path)) == (reduced[0], reduced, [Made(0.4)], "f.vtu")
    said = " ".join(answer.out.replace("│", " ").split())
    for part in (
        "block (modulus_MPa 0.5, thickness_mm 7, nu 0.495) on human-finger-mimetic sensor as published",
        "force 0.4 N", "indentation 0.5432 mm", "contact area 12.35 mm²", "peak pressure 0.0987 MPa",
        "reading g1 1.0 µε", "reading g5 5.0 µε", "S_d (population sd) 1234.6 µε", "force balance 2.0e-12",
        "fidelity contact", "Pressed on: block 7 mm thick, friction 0.0, large strain included",
        "contact: made up Wrote f.vtu",
    ):  # fmt: skip
        assert part in said, (part, said)
    facts = json.loads(papilla("press", "--modulus", 0.5, "--indentation", 0.3, "--fidelity", "hertz", "--json").out)
    assert made[-1][2:] == (None, 0.3, {"fidelity": "hertz", "friction": None}) and made[-1][0][1] == 0.7
    assert (facts["force_N"], facts["at_mm"], facts["friction"]) == (1.0, [0.0, 0.0], 0.0) and "log" not in facts


def test_a_log_of_a_press_is_of_presses_of_the_same_scene(papilla, made, tmp_path):
    scene = ("press", "--modulus", 0.5, "--force", 0.4, "--fidelity", "contact", "--log", "touch.csv")
    answer = papilla(*scene)
    assert answer.code == 0 and answer.out.endswith("Wrote touch.csv\n")
    assert "loading, 0 of 500 presses" in answer.err
    first, *others = made
    assert all((one[0], one[1], one[4]) == (first[0], first[1], first[4]) for one in others) and len(others) > 400
    assert [one[2] for one in others] == sorted((one[2] for one in others), reverse=True)
    force = read_time_log(tmp_path / "touch.csv").force_N
    # In steps of 0.4 N over 500: the first above 0.01 N
    assert force[-1] == 0.4 and force[force > 0].min() == pytest.approx(0.0104)


@pytest.mark.parametrize("stated, bench, friction", [("0.3", None, 0.3), (None, 0.2, 0.2), (None, None, "stick")])
def test_a_press_on_the_whole_mesh_sticks_unless_a_friction_is_stated(papilla, monkeypatch, stated, bench, friction):
    asked = []

    def press_finite(design, mesh, touched, *, friction, progress, **scene):
        asked.append((mesh, touched.modulus, friction, scene))
        return Made(0.1, fidelity="finite")

    design = replace(Finger.default(), bench=replace(Finger.default().bench, friction=bench))
    monkeypatch.setattr(Finger, "load", lambda name: design)
    monkeypatch.setattr("papilla.mesh.build", lambda design, size, progress: size)
    monkeypatch.setattr("papilla.fem.finite.press_finite", press_finite)
    more = [] if stated is None else ["--friction", stated]
    answer = papilla("press", "--modulus", 0.5, "--indentation", 0.1, "--fidelity", "finite", "--at", 0, 1, *more)
    assert answer.code == 0, answer.err
    assert asked == [(0.7, 0.5, friction, {"at": (0.0, 1.0), "force": None, "indentation": 0.1})]
