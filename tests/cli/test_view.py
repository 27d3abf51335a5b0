"""`papilla view`: pictures that are written, and options that do not go together."""

import json
from dataclasses import dataclass

import pytest

from papilla.model.finger import Finger
from papilla.view.style import STRAIN

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.mark.slow
@pytest.mark.parametrize("what", ["strain", "contact", "receptive"])
def test_each_picture_is_written_and_reported(papilla, tmp_path, what):
    answer = papilla("view", what, "--screenshot", "shown.png", "--json")
    assert answer.code == 0, answer.err
    facts = json.loads(answer.out)
    assert (facts["picture"], facts["screenshot"]) == (what, "shown.png")
    content = (tmp_path / "shown.png").read_bytes()
    assert content.startswith(PNG) and len(content) > 20_000


@pytest.mark.slow
def test_strain_is_the_default_and_names_its_file(papilla, tmp_path):
    answer = papilla("view", "--modulus", 0.1, "--force", 0.2)
    assert answer.code == 0, answer.err
    assert answer.out.splitlines()[-1] == "Wrote strain.png"
    assert (tmp_path / "strain.png").read_bytes().startswith(PNG)


@pytest.mark.slow
def test_a_page_a_field_and_a_second_specimen_are_written_together(papilla, tmp_path):
    import meshio
    import numpy as np

    answer = papilla("view", "--beside", 5, "--html", "v.html", "--export", "v.vtu", "--screenshot", "v.png", "--json")
    assert answer.code == 0, answer.err
    facts = json.loads(answer.out)
    assert (facts["html"], facts["export"], facts["screenshot"]) == ("v.html", "v.vtu", "v.png")
    assert facts["beside"]["modulus_MPa"] == 5 and facts["beside"]["sd_microstrain"] > facts["sd_microstrain"]
    field = meshio.read(tmp_path / "v.vtu")
    assert -field.point_data["displacement_mm"][:, 2].min() == pytest.approx(0.8, abs=0.05)
    assert {*field.cell_data} == {"strain", "stress_MPa", "layer"} and np.isfinite(
        field.cell_data["stress_MPa"][0]
    ).all()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["v.html", "v.png", "v.vtu"]


def test_an_element_size_reaches_the_mesh(papilla, monkeypatch):
    from papilla.core.errors import MeshError
    from papilla.fem import preparing
    from papilla.view import pictures

    def build(finger, size_mm, **_):
        raise MeshError(f"asked for {size_mm:g}")

    for module in (pictures, preparing):
        monkeypatch.setattr(module, "build", build)
    for what in ("strain", "contact", "receptive"):
        assert papilla("view", what, "--size-mm", 1.3).err.endswith("asked for 1.3\n")


@pytest.mark.parametrize("ending, begin", [("pdf", b"%PDF-"), ("svg", b"<?xml"), ("PNG", PNG)])
def test_the_ending_of_the_name_says_what_is_written(papilla, tmp_path, ending, begin):
    answer = papilla("view", "contact", "--screenshot", f"v.{ending}")
    assert answer.code == 0, answer.err
    assert (tmp_path / f"v.{ending}").read_bytes().startswith(begin)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("contact", "--screenshot", "v.gif"), "v.gif: pictures are written as .png, .pdf, .svg, not as gif"),
        (("contact", "--screenshot", "v"), "v: pictures are written as .png, .pdf, .svg, not as a name without"),
        (("skin",), "'skin' is not one of"),
        (("strain", "--gauge", "g1"), "--gauge goes with a receptive field, not with strain"),
        (("receptive", "--force", "1"), "a receptive field has no press"),
        (("contact", "--html", "v.html"), "--html goes with strain, not with contact"),
        (("receptive", "--component", "zz"), "--component goes with strain, not with receptive"),
        (("strain", "--export", "v.vtk"), "v.vtk: fields are written as .vtu files"),
        (("strain", "--html", "v.html", "--export", "v.html"), "v.html: fields are written as .vtu files"),
        (("receptive", "--gauge", "g9"), "has no gauge 'g9'; its gauges are g1, g2, g3, g4, g5"),
        (("strain", "--modulus", "-1"), "specimen modulus (MPa) must be greater than 0, got -1"),
        (("contact", "--radius", "3"), "--radius is for a sphere, not for a block"),
    ],
)
def test_bad_input_is_one_line(refused, arguments, message):
    assert message in refused("view", *arguments)


@dataclass(frozen=True)
class Pressed:
    """A press by a force on a specimen of a modulus, in place of one that takes seconds."""

    force: float
    modulus: float
    friction: float = 0.0
    large_strain: bool = False

    def to_json(self) -> dict:
        return {"force_N": self.force, "modulus_MPa": self.modulus}


@pytest.fixture
def drawn(monkeypatch):
    """What each picture is made of, by the function that would make it."""
    from papilla.fem import fields

    calls = {}

    def note(name):
        return lambda *given, **how: calls.update({name: (given, how)}) or ["field"]

    monkeypatch.setattr("papilla.fem.prepare", lambda design, size_mm, at, progress: (design.name, size_mm, at))
    monkeypatch.setattr("papilla.view.shown", lambda reduced, touched, force: Pressed(force, touched.modulus))
    for name in ("strain", "strain_page", "contact", "receptive", "fields"):
        monkeypatch.setattr(f"papilla.view.{name}", note(name))
    monkeypatch.setattr(fields, "save_field", note("save_field"))
    return calls


def test_a_press_is_drawn_as_a_picture_a_page_and_a_field(papilla, drawn):
    answer = papilla("view", "--html", "v.html", "--export", "v.vtu", "--screenshot", "v.png", "--beside", 5)
    assert answer.code == 0, answer.err
    assert "Pressed on: block 10 mm thick" in answer.out and answer.out.endswith("Wrote v.png, v.html, v.vtu\n")
    # The default scene: 60 gf on the middle one of the published specimens
    first = Pressed(0.588, 0.51)
    reduced = (Finger.default().name, 0.7, (0.0, 0.0))
    (path, design, whole, press, touched), how = drawn["strain"]
    assert (str(path), design, whole, press, touched.modulus) == ("v.png", Finger.default(), reduced, first, 0.51)
    assert how["shown"] == STRAIN and how["beside"][0] == Pressed(0.588, 5.0) and how["beside"][1].modulus == 5.0
    (path, _, whole, presses, _), how = drawn["strain_page"]
    assert str(path) == "v.html" and whole == reduced and how["shown"] == STRAIN
    assert [one.force for one in presses] == pytest.approx([0.588 * share for share in (0.2, 0.4, 0.6, 0.8, 1.0)])
    assert drawn["fields"][0][1:] == (reduced, [first])
    assert (drawn["save_field"][0][0], str(drawn["save_field"][0][1])) == ("field", "v.vtu") and "contact" not in drawn


def test_the_scene_of_a_picture_is_that_of_its_options(papilla, drawn, tmp_path):
    scene = ("--modulus", 0.1, "--force", 0.2, "--at", 1, 2, "--size-mm", 1.4, "--finger", "published", "--json")
    facts = json.loads(papilla("view", *scene, "--component", "zz").out)
    (path, design, whole, press, _), how = drawn.pop("strain")
    assert (str(path), press, how["beside"], how["shown"]) == ("strain.png", Pressed(0.2, 0.1), None, "zz")
    assert whole == (design.name, 1.4, (1.0, 2.0)) and facts["finger"] == design.name != Finger.default().name
    assert (facts["force_N"], facts["modulus_MPa"], facts["shown"]) == (0.2, 0.1, "zz") and "beside" not in facts
    assert (facts["screenshot"], facts["html"], facts["export"]) == ("strain.png", None, None) and not drawn
    facts = json.loads(papilla("view", "contact", *scene, "--beside", 5).out)
    (path, whole, press, touched, other), _ = drawn.pop("contact")
    assert (str(path), press, touched.modulus, other[0]) == ("contact.png", Pressed(0.2, 0.1), 0.1, Pressed(0.2, 5.0))
    assert facts["shown"] == "pressure" and facts["beside"]["modulus_MPa"] == 5.0 and not drawn
    assert facts["beside"]["specimen"]["modulus_MPa"] == 5.0 and facts["specimen"]["modulus_MPa"] == 0.1
    papilla("view", *scene[:-1], "--export", "f.VTU")
    assert list(drawn) == ["fields", "save_field"], "a page or a field alone needs no picture"


def test_receptive_fields_are_of_a_gauge_or_of_all(papilla, drawn):
    facts = json.loads(papilla("view", "receptive", "--size-mm", 1.4, "--json").out)
    (path, design, gauge), how = drawn["receptive"]
    assert (str(path), design, gauge, how["size_mm"]) == ("receptive.png", Finger.default(), None, 1.4)
    assert facts["gauge"] == ["g1", "g2", "g3", "g4", "g5"] and facts["picture"] == "receptive"
    answer = papilla("view", "receptive", "--gauge", "g2", "--screenshot", "r.png", "--json")
    assert json.loads(answer.out)["gauge"] == drawn["receptive"][0][2] == "g2"
    assert papilla("view", "receptive").out == "Wrote receptive.png\n"


@pytest.mark.parametrize("option", ["--modulus", "--beside", "--force", "--thickness", "--radius"])
def test_no_option_of_a_press_is_ignored(refused, option):
    said = refused("view", "receptive", option, 1)
    assert said.endswith("has no press: leave out --modulus, --beside, --force, --thickness, --radius")
