"""`papilla view`: pictures that are written, and options that do not go together."""

import json

import pytest

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


def test_a_page_has_five_forces_and_a_field_the_press_of_the_default_scene(papilla, tmp_path):
    pytest.importorskip("plotly")
    meshio = pytest.importorskip("meshio")
    answer = papilla("view", "--size-mm", 2.8, "--html", "v.html", "--export", "v.vtu", "--json")
    facts = json.loads(answer.out)
    assert (facts["force_N"], facts["modulus_MPa"], facts["shown"]) == (0.588, 0.51, "strain")
    assert (facts["html"], facts["export"], facts["screenshot"]) == ("v.html", "v.vtu", None)
    page = (tmp_path / "v.html").read_text(encoding="utf-8")
    assert all(f"{share * 0.588:.3g} N" in page for share in (0.2, 0.4, 0.6, 0.8, 1.0))
    sunk = -meshio.read(tmp_path / "v.vtu").point_data["displacement_mm"][:, 2].min()
    assert sunk == pytest.approx(facts["indentation_mm"], rel=0.2)


@pytest.mark.parametrize("ending, begin", [("pdf", b"%PDF-"), ("svg", b"<?xml"), ("PNG", PNG)])
def test_the_ending_of_the_name_says_what_is_written(papilla, tmp_path, ending, begin):
    answer = papilla("view", "contact", "--size-mm", 2.8, "--screenshot", f"v.{ending}")
    assert answer.code == 0, answer.err
    assert (tmp_path / f"v.{ending}").read_bytes().startswith(begin)


@pytest.mark.slow
def test_the_scene_of_a_picture_is_that_of_its_options(papilla, tmp_path):
    scene = ("--modulus", 0.1, "--force", 0.2, "--size-mm", 2.8, "--finger", "published", "--json")
    answer = papilla("view", "contact", *scene, "--beside", 5)
    assert answer.code == 0, answer.err
    facts = json.loads(answer.out)
    assert (facts["force_N"], facts["modulus_MPa"], facts["shown"]) == (0.2, 0.1, "pressure")
    assert facts["finger"].endswith("as published") and facts["beside"]["specimen"]["modulus_MPa"] == 5
    assert (facts["screenshot"], facts["html"], facts["export"]) == ("contact.png", None, None)
    assert [path.name for path in tmp_path.iterdir()] == ["contact.png"]


@pytest.mark.slow
def test_receptive_fields_are_of_all_gauges(papilla):
    of_all = json.loads(papilla("view", "receptive", "--size-mm", 2.8, "--json").out)
    assert of_all["gauge"] == ["g1", "g2", "g3", "g4", "g5"] and of_all["screenshot"] == "receptive.png"


def test_a_receptive_field_is_of_a_gauge(papilla, tmp_path):
    of_one = papilla("view", "receptive", "--size-mm", 2.8, "--gauge", "g2", "--screenshot", "r.png", "--json")
    assert json.loads(of_one.out)["gauge"] == "g2" and (tmp_path / "r.png").read_bytes().startswith(PNG)
