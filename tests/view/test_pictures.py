"""Picture files: written whole, with what they should show, by VTK and without it."""

import importlib
import io
import re
import sys
from dataclasses import replace

import matplotlib.image
import numpy as np
import pytest

from papilla import fem, view
from papilla.core.errors import FileAccessError, InputError, MissingExtraError
from papilla.model.specimen import Block
from papilla.view import pictures, receptive_field, render, strain_field

pytestmark = pytest.mark.slow


def colours(content: bytes) -> np.ndarray:
    """(rows, columns, 3) in 0-1 of PNG bytes."""
    return matplotlib.image.imread(io.BytesIO(content), format="png")[:, :, :3]


def share(image: np.ndarray, red: tuple, green: tuple, blue: tuple) -> float:
    """Share of the pixels inside ranges of red, green and blue."""
    limits = np.array([red, green, blue])
    return float(((image >= limits[:, 0]) & (image <= limits[:, 1])).all(axis=2).mean())


TENSION = ((0.6, 1), (0.0, 0.55), (0.0, 0.5))
GAUGES = ((0.93, 1), (0.73, 0.8), (0, 0.1))


@pytest.mark.slow
@pytest.mark.parametrize("rendered", [True, False], ids=["vtk", "matplotlib"])
def test_the_strain_picture_shows_tension_gauges_and_specimen(scene, rendered, monkeypatch):
    if rendered and not render.use_offscreen_window():
        pytest.skip("VTK cannot render on this machine")
    monkeypatch.setattr(strain_field, "use_offscreen_window", lambda: rendered)
    figure = view.strain_figure(scene.field, scene.reduced, scene.press, scene.specimen, scene.finger)
    image = colours(view.png(figure, dpi=80))
    assert share(image, *TENSION) > 0.01
    assert share(image, *GAUGES) > 0.001
    assert share(image, (0.76, 0.84), (0.8, 0.87), (0.85, 0.91)) > 0.05, "no specimen"
    texts = " ".join(text.get_text() for text in figure.findobj(match=matplotlib.text.Text))
    for word in ("0.588 N", "0.51 MPa", "26,5", "g1", "g5", "true scale", "bone", "+4.81", "friction"):
        assert word in texts
    readings = [float(found.replace(",", "").replace("−", "-")) for found in re.findall(r"\n([+−][\d,]+) µε", texts)]
    title = float(re.search(r"readings ([\d,]+) µε", texts)[1].replace(",", ""))
    assert np.std(readings) == pytest.approx(title, rel=1e-4), "title and labels tell the same quantity"


@pytest.mark.parametrize("rendered", [True, False], ids=["vtk", "matplotlib"])
def test_two_presses_share_one_scale(scene, rendered, monkeypatch):
    if rendered and not render.use_offscreen_window():
        pytest.skip("VTK cannot render on this machine")
    monkeypatch.setattr(strain_field, "use_offscreen_window", lambda: rendered)
    soft = Block(0.05, 10)
    press = fem.press(scene.reduced, soft, force=0.588, fidelity="contact")
    beside = view.Scene(fem.recover(scene.model, scene.reduced, press), press, soft)
    figure = view.strain_figure(
        scene.field, scene.reduced, scene.press, scene.specimen, scene.finger, shown="zz", beside=beside
    )
    image = colours(view.png(figure, dpi=60))
    middle = image.shape[1] // 2
    blue = [share(half, (0.0, 0.4), (0.1, 0.6), (0.4, 0.9)) for half in (image[:, :middle], image[:, middle:])]
    assert blue[0] > 1.5 * blue[1], "the hard specimen presses harder on a smaller place"
    texts = " ".join(text.get_text() for text in figure.findobj(match=matplotlib.text.Text))
    assert "0.51 MPa and on 0.05 MPa" in texts and "stress zz (kPa)" in texts and "(+4" not in texts
    both = view.contact_figure(scene.reduced, scene.press, scene.specimen, (press, soft))
    assert len(both.axes) == 3 and both.axes[0].get_xlim() == both.axes[1].get_xlim()


def test_a_press_beside_the_apex_shows_where_it_touched(scene, tmp_path):
    reduced = fem.prepare(scene.finger, size_mm=2.8, at=(4.0, -5.0))
    press = fem.press(reduced, scene.specimen, force=0.588, fidelity="contact")
    (field,) = view.fields(scene.finger, reduced, [press])
    figure = view.strain_figure(field, reduced, press, scene.specimen, scene.finger)
    texts = " ".join(text.get_text() for text in figure.findobj(match=matplotlib.text.Text))
    assert "touched (+) at x 4, y -5 mm, seen from +y" in " ".join(texts.split())
    assert [line.get_marker() for line in figure.axes[0].lines].count("+") == 1
    axes = view.contact_figure(reduced, press, scene.specimen).axes[0]
    assert np.mean(axes.get_xlim()) == pytest.approx(4) and np.mean(axes.get_ylim()) == pytest.approx(-5)


def test_the_page_holds_the_presses_and_needs_no_connection(scene, tmp_path):
    path = tmp_path / "strain.html"
    lighter = view.shown(scene.reduced, scene.specimen, force=0.2)
    view.strain_page(path, scene.finger, scene.reduced, [lighter, scene.press], scene.specimen)
    page = path.read_text(encoding="utf-8")
    assert len(page) < 9e6 and 'src="http' not in page and "0.588 N" in page and "0.2 N" in page
    for press in (lighter, scene.press):
        assert f"g3: reading {press.reading[2]:+,.0f} " in page.replace("\\u003c", "<")


def test_without_plotly_the_extra_is_named(scene, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'papilla\[view\]'"):
        view.strain_page(tmp_path / "strain.html", scene.finger, scene.reduced, [scene.press], scene.specimen)
    assert not list(tmp_path.iterdir())


def test_the_maps_of_all_gauges_have_one_scale_and_axes(scene):
    figure = view.receptive_fields_figure(fem.receptive_fields(scene.model), scene.finger)
    maps = [axes for axes in figure.axes if axes.get_xlabel() == "x (mm)"]
    assert len(maps) == 5 and len({axes.collections[0].get_clim() for axes in maps}) == 1
    assert [axes.get_title(loc="left")[:2] for axes in maps] == ["g1", "g2", "g3", "g4", "g5"]


def test_an_unknown_component_is_refused(scene, tmp_path):
    with pytest.raises(InputError, match="must be strain or, of the stress, xx, yy"):
        view.strain(tmp_path / "v.png", scene.finger, scene.reduced, scene.press, scene.specimen, shown="x")


@pytest.mark.slow
@pytest.mark.parametrize("rendered", [True, False], ids=["vtk", "matplotlib"])
def test_a_receptive_field_is_strongest_over_its_gauge(scene, rendered, monkeypatch):
    if rendered and not render.use_offscreen_window():
        pytest.skip("VTK cannot render on this machine")
    monkeypatch.setattr(receptive_field, "use_offscreen_window", lambda: rendered)
    fields = fem.receptive_fields(scene.model)
    image = colours(view.png(view.receptive_figure(fields, scene.finger, "g2"), dpi=60))
    red = (image[:, :, 0] - image[:, :, 2] > 0.4) & (image[:, :, 1] < 0.6)
    red[int(0.85 * len(red)) :] = False
    columns = np.flatnonzero(red.any(axis=0)) / image.shape[1]
    assert 0.2 < np.median(columns) < 0.45, "g2 lies left of the middle"


@pytest.mark.slow
def test_the_cached_picture_needs_no_model(scene, tmp_path, monkeypatch):
    path = tmp_path / "strain.png"
    view.strain(path, scene.finger, scene.reduced, scene.press, scene.specimen)
    assert path.read_bytes().startswith(b"\x89PNG")
    monkeypatch.setattr(pictures, "build", None)
    assert view.strain_picture(scene.finger, scene.reduced, scene.press, scene.specimen) == path.read_bytes()
    assert sorted(item.name for item in tmp_path.iterdir()) == ["strain.png"]


@pytest.mark.slow
def test_other_presses_get_other_pictures(scene, monkeypatch):
    first = view.strain_picture(scene.finger, scene.reduced, scene.press, scene.specimen)
    softer = Block(0.05, 10)
    press = fem.press(scene.reduced, softer, force=0.588)
    assert view.strain_picture(scene.finger, scene.reduced, press, softer) != first


def test_the_contact_map_is_written_with_its_figures(scene, tmp_path):
    view.contact(tmp_path / "contact.png", scene.reduced, scene.press)
    assert share(colours((tmp_path / "contact.png").read_bytes()), (0, 0.2), (0.2, 0.5), (0.4, 0.8)) > 0.02
    texts = " ".join(
        text.get_text() for text in view.contact_figure(scene.reduced, scene.press).findobj(match=matplotlib.text.Text)
    )
    assert f"{scene.press.contact_area:.3g} mm²" in texts and "kPa" in texts


def test_bad_requests_are_refused_in_one_line(scene, tmp_path):
    with pytest.raises(InputError, match="no gauge 'g9'; its gauges are g1, g2"):
        view.receptive(tmp_path / "g9.png", scene.finger, "g9")
    with pytest.raises(FileAccessError, match="cannot write"):
        view.contact(tmp_path / "missing" / "contact.png", scene.reduced, scene.press)
    with pytest.raises(InputError, match="not made from this design"):
        other = replace(scene.finger, name="other")
        view.strain_picture(other, scene.reduced, scene.press, scene.specimen)
    assert not list(tmp_path.iterdir())


def test_a_press_of_another_finger_is_refused(scene):
    short = replace(scene.press, pressure=scene.press.pressure[:-1])
    with pytest.raises(InputError, match="pressure nodes"):
        view.contact_figure(scene.reduced, short)


def test_every_listed_name_exists():
    for name in view.__all__:
        assert getattr(view, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        importlib.import_module("papilla.view").nothing  # noqa: B018


def test_a_kept_picture_is_drawn_again_with_another_style_sheet(scene, monkeypatch):
    asked, found = [], pictures.cache.fetch

    def fetch(kind, key, make):
        if kind != "picture":
            return found(kind, key, make)
        asked.append(key)
        return {str(k): np.zeros(1, np.uint8) for k in range(2)}

    monkeypatch.setattr(pictures.cache, "fetch", fetch)
    given = scene.finger, scene.reduced, scene.press, scene.specimen
    view.strain_pictures(*given)
    view.strain_pictures(*given)
    monkeypatch.setattr(pictures, "SHEET", pictures.SHEET + "font.size: 11\n")
    view.strain_pictures(*given)
    assert asked[0] == asked[1] != asked[2]
