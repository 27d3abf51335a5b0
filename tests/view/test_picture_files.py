"""What the functions that write pictures pass on: scenes, meshes, sizes and files, without a model."""

from types import SimpleNamespace

import numpy as np
import pytest
from made_up_press import FINGER, SPECIMEN, press, reduced
from matplotlib.figure import Figure

from papilla import fem
from papilla.core import cache
from papilla.core.errors import InputError
from papilla.fem.reduction import finger_model
from papilla.model.specimen import Block, Sphere
from papilla.view import contact_map, page, pictures, receptive_field, strain_field, turning

MESH = SimpleNamespace(sha256="mesh")


@pytest.fixture
def asked(monkeypatch, tmp_path_factory):
    """What is asked of the mesher, the model and the figures, each of which gives a name or an empty figure."""
    calls: list = []
    # An empty cache, so that nothing is known yet
    monkeypatch.setenv(cache.ENVIRONMENT, str(tmp_path_factory.mktemp("cache")))

    def noted(name, answer):
        def call(*given, **how):
            calls.append((name, given, how))
            return answer(*given) if callable(answer) else answer

        return call

    found = fem.ReceptiveFields(MESH, np.array([0, 2]), np.array([[1.0, 2.0]]))
    monkeypatch.setattr(pictures, "build", noted("build", MESH))
    monkeypatch.setattr(finger_model, "model_of", noted("model", "model"))
    monkeypatch.setattr(fem, "recover", noted("recover", lambda model, reduced, press: ("field", press.force)))
    monkeypatch.setattr(fem, "receptive_fields", noted("receptive", found))
    for module, name in (
        (strain_field, "strain_figure"), (contact_map, "contact_figure"), (receptive_field, "receptive_figure"),
        (receptive_field, "receptive_fields_figure"),
    ):  # fmt: skip
        monkeypatch.setattr(module, name, noted(name, lambda *_: Figure(figsize=(1, 1))))
    monkeypatch.setattr(turning, "strain_html", noted("html", "<page>"))
    monkeypatch.setattr(pictures, "content", lambda figure, kind, dpi: f"{kind} at {dpi}".encode())
    return calls


def names(asked) -> list[str]:
    """The names of the calls in order."""
    return [name for name, _, _ in asked]


@pytest.fixture
def made():
    """A reduced finger and a press of it."""
    found, one = reduced()
    found.mesh_size_mm = 1.4
    found.to_arrays = lambda: {"a": np.arange(3.0)}
    return found, one


@pytest.mark.parametrize("two", [False, True])
def test_strain_pictures_are_of_the_fields_of_their_presses_and_kept(asked, made, two, tmp_path):
    found, one = made
    other, told = press(force=0.9, pressure=np.arange(4.0)), []
    block, ball = Block(0.5, 4.0), Sphere(0.2, radius=5.0)
    how = {"variant": 3, "progress": told.append, "shown": "zz", "beside": (other, ball) if two else None}
    pictures.strain(tmp_path / "a.svg", FINGER, found, one, block, **how)
    assert (tmp_path / "a.svg").read_bytes() == b"svg at 120"
    assert told == ["recovering the strain field"]
    assert asked[0] == ("build", (FINGER,), {"size_mm": 1.4, "variant": 3, "progress": told.append})
    assert asked[1] == ("model", (FINGER, MESH), {})
    assert [given for name, given, _ in asked if name == "recover"] == [
        ("model", found, each) for each in ([one, other] if two else [one])
    ]
    name, given, kept = asked[-1]
    assert (name, given) == ("strain_figure", (("field", one.force), found, one, block, FINGER))
    assert (kept["shown"], kept["width"]) == ("zz", None)
    beside = kept["beside"] and (kept["beside"].field, kept["beside"].press, kept["beside"].specimen)
    assert beside == ((("field", 0.9), other, ball) if two else None)
    before = len(asked)
    assert pictures.strain_picture(FINGER, found, one, block, **how | {"kind": "svg"}) == b"svg at 120"
    assert len(asked) == before, "the second picture is that of the cache"
    both = pictures.strain_pictures(FINGER, found, one, block, **how)
    assert both == [b"png at 120"] * 2
    assert [how["width"] for name, _, how in asked[before:] if name == "strain_figure"] == [None, pictures.NARROW_IN]


def test_a_picture_of_a_user_s_own_specimen_is_not_kept(asked, made, monkeypatch):
    monkeypatch.setattr(cache, "fetch", None)
    found, one = made
    assert pictures.strain_picture(FINGER, found, one, SPECIMEN) == b"png at 120"
    assert pictures.strain_pictures(FINGER, found, one, Block(0.5, 4.0), beside=(one, SPECIMEN)) == [b"png at 120"] * 2
    found.finger_sha256 = "other"
    with pytest.raises(InputError, match="not made from this design"):
        pictures.strain_picture(FINGER, found, one, SPECIMEN)


def test_the_page_of_presses_has_a_scene_for_each(asked, made, tmp_path):
    pytest.importorskip("plotly")
    found, one = made
    pictures.strain_page(tmp_path / "a.html", FINGER, found, [one, press(force=0.9)], SPECIMEN, shown="xx")
    assert (tmp_path / "a.html").read_text(encoding="utf-8") == "<page>"
    name, (scenes, *given), how = asked[-1]
    assert (name, given, how) == ("html", [found, FINGER], {"shown": "xx"})
    assert [(scene.field, scene.press.force, scene.specimen) for scene in scenes] == [
        (("field", 0.5), 0.5, SPECIMEN), (("field", 0.9), 0.9, SPECIMEN)
    ]  # fmt: skip
    assert asked[0] == ("build", (FINGER,), {"size_mm": 1.4, "variant": 0, "progress": None})


def test_receptive_fields_are_kept_and_drawn_for_one_gauge_or_all(asked, tmp_path):
    told = []
    pictures.receptive(tmp_path / "a.pdf", FINGER, "g2", size_mm=3.3, progress=told.append)
    assert (tmp_path / "a.pdf").read_bytes() == b"pdf at 120" and told == ["solving for the receptive fields"]
    assert names(asked) == ["build", "model", "receptive", "receptive_figure"]
    assert asked[0] == ("build", (FINGER,), {"size_mm": 3.3, "progress": told.append})
    (found, *given) = asked[-1][1]
    assert given == [FINGER, "g2"] and found.mesh is MESH
    assert (found.vertices.tolist(), found.strain_per_newton.tolist()) == ([0, 2], [[1.0, 2.0]])
    pictures.receptive(tmp_path / "b.png", FINGER, size_mm=3.3)
    assert names(asked)[4:] == ["build", "receptive_fields_figure"] and asked[-1][1][1:] == (FINGER,)
    with pytest.raises(InputError, match="no gauge 'g9'; its gauges are g1, g2"):
        pictures.receptive(tmp_path / "c.png", FINGER, "g9")


def test_a_contact_map_is_written(asked, made, tmp_path):
    found, one = made
    pictures.contact(tmp_path / "a.png", found, one, SPECIMEN, (one, SPECIMEN))
    assert asked == [("contact_figure", (found, one, SPECIMEN, (one, SPECIMEN)), {})]
    assert (tmp_path / "a.png").read_bytes() == b"png at 120"


@pytest.mark.parametrize("first, asked", [("hertz", ["", "contact"]), ("finite", [""])])
def test_a_shown_press_has_nodal_pressures(first, asked, monkeypatch):
    given = []

    def scene(reduced, specimen, *, force, fidelity=""):
        given.append(fidelity)
        return SimpleNamespace(fidelity=fidelity or first)

    monkeypatch.setattr(pictures, "press_scene", scene)
    found = pictures.shown(None, None, force=0.5)
    assert given == asked and found.fidelity == (asked[-1] or first)


def test_a_contact_that_is_no_ellipse_has_the_contour_of_its_pressure(monkeypatch):
    """A round pressure 1 - r^2 / 9 that is said to be no ellipse: 2 % of the peak are at r = 3 sqrt(0.98)."""
    found, one = reduced()
    x, y = found.patch.xy.T
    one.pressure, one.fidelity = np.maximum(1 - (x**2 + y**2) / 9, 0), "contact"
    one.contact_area = 9 * np.pi
    monkeypatch.setattr(contact_map, "contact_shape", lambda patch, pressure: SimpleNamespace(elliptic=False))
    assert contact_map.contact_profile(found, one) is None
    line = np.concatenate(contact_map.contact_edge(found, one))
    assert np.hypot(*line.T) == pytest.approx(3 * np.sqrt(0.98), abs=0.04)
    assert np.hypot(*line.T).mean() == pytest.approx(3 * np.sqrt(0.98), abs=0.015)
    monkeypatch.setattr(contact_map, "contact_shape", lambda patch, pressure: SimpleNamespace(elliptic=True))
    assert contact_map.contact_profile(found, one) is not None
    one.contact_area *= 9  # An ellipse that would go beyond what was meshed
    assert contact_map.contact_profile(found, one) is None
    with pytest.raises(InputError, match="3720 pressure nodes, the reduced finger 3721"):
        contact_map.whole_patch(found, SimpleNamespace(pressure=one.pressure[1:]))


def test_the_edge_of_an_ellipse_begins_at_its_first_axis():
    profile = contact_map.Profile(np.array([1.0, 2.0]), np.array([[3.0, 0.0], [0.0, 5.0]]), 1.0, 0.0)
    edge = profile.edge()
    assert edge[[0, -1]] == pytest.approx(np.array([[4.0, 2.0]] * 2)) and edge[75] == pytest.approx([1.0, 7.0])
    # Twice the relative pressure of Hertz's at a place, as sqrt(1 - r^2), is its own at the middle
    square = np.array([[1.0, 2.0], [1.0 + 3 * 0.6, 2.0], [1.0, 7.1]])
    peak, part, outside = profile(square)
    assert part == pytest.approx(0.8 * peak) and outside == 0


def test_a_block_of_a_template_leaves_no_empty_line():
    text = "{% if x %}\n  {% set y = 1 %}\nyes\n{% endif %}\n"
    assert page.environment("papilla.view").from_string(text).render(x=True) == "yes\n"
    assert page.number(1.5) == "1.50" and page.percent(0.25) == "25\u00a0%"
