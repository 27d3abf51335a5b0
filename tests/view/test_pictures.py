"""Pictures of a real press: what they show, with VTK and without it, in two widths, and the files."""

import importlib
import io
import re
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import fields, replace

import matplotlib.image
import numpy as np
import pytest
from PIL import Image, ImageSequence
from shown_figures import flaws, texts, words

from papilla import fem, view
from papilla.core.errors import FileAccessError, InputError, MissingExtraError
from papilla.fem.sliding.section import SectionModel
from papilla.mesh.section import build_section
from papilla.model.finger import Finger
from papilla.model.specimen import Block, Grating
from papilla.view import render, slide_movie, style, turning

TENSION = ((0.6, 1), (0.0, 0.55), (0.0, 0.5))
COMPRESSION = ((0.0, 0.4), (0.1, 0.6), (0.4, 0.9))
GAUGES = ((0.93, 1), (0.73, 0.8), (0, 0.1))
SPECIMEN = ((0.76, 0.84), (0.8, 0.87), (0.85, 0.91))
WIDTHS = (None, style.NARROW_IN)


def colours(content: bytes) -> np.ndarray:
    """(rows, columns, 3) in 0-1 of PNG bytes."""
    return matplotlib.image.imread(io.BytesIO(content), format="png")[:, :, :3]


def share(image: np.ndarray, red: tuple, green: tuple, blue: tuple) -> float:
    """Share of the pixels inside ranges of red, green and blue."""
    limits = np.array([red, green, blue])
    return float(((image >= limits[:, 0]) & (image <= limits[:, 1])).all(axis=2).mean())


@pytest.fixture(scope="module")
def given(scene):
    """What the functions that draw a press take."""
    return scene.finger, scene.reduced, scene.press, scene.specimen


@pytest.fixture(scope="module")
def soft(scene):
    """A press by the same force on a block ten times as soft, and its field."""
    block = Block(0.05, 10)
    press = fem.press(scene.reduced, block, force=0.588, fidelity="contact")
    return view.PressScene(fem.recover(scene.model, scene.reduced, press), press, block)


@pytest.mark.parametrize("width", WIDTHS)
def test_the_picture_of_a_press_shows_what_the_press_is(scene, renderer, width):
    """Tension at the apex, gauges, specimen; the readings at the gauges are those whose S_d the title tells."""
    figure = view.strain_figure(scene.field, scene.reduced, scene.press, scene.specimen, scene.finger, width=width)
    image, said, press = colours(view.png(figure, dpi=80)), words(figure), scene.press
    assert share(image, *TENSION) > 0.004 and share(image, *GAUGES) > 0.0005 and share(image, *SPECIMEN) > 0.03
    assert flaws(figure) == []
    facts = f"{press.sd:,.0f} µε", f"indentation {press.indentation:.3g} mm", f"{press.contact_area:.3g} mm²"
    for fact in (*facts, "0.588 N", "0.51 MPa", "true scale", "bone", "friction", "strain along the layers"):
        assert fact in said
    if width is None:
        shown = {r.replace(",", "").replace("−", "-") for r in re.findall(r"\n([+−][\d,]+) µε", "".join(texts(figure)))}
        assert shown == {f"{reading:+.0f}" for reading in press.reading}
    else:
        assert figure.get_figwidth() == width
        assert all(f"{reading / 1000:+.3g}".replace("-", "−") in said for reading in press.reading)


@pytest.mark.slow
def test_two_presses_share_one_scale(scene, soft):
    figure = view.strain_figure(
        scene.field, scene.reduced, scene.press, scene.specimen, scene.finger, shown="zz", beside=soft
    )
    image = colours(view.png(figure, dpi=60))
    middle = image.shape[1] // 2
    blue = [share(half, *COMPRESSION) for half in (image[:, :middle], image[:, middle:])]
    assert blue[0] > 1.5 * blue[1], "the hard specimen presses harder on a smaller place"
    said = words(figure)
    assert "0.51 MPa and on 0.05 MPa" in said and "stress zz (kPa)" in said and "(+4" not in said
    for press in (scene.press, soft.press):
        assert f"indentation {press.indentation:.3g} mm" in said


@pytest.mark.slow
def test_a_press_beside_the_apex_shows_where_it_touched(scene):
    reduced = fem.prepare(scene.finger, size_mm=2.8, at=(4.0, -5.0))
    press = fem.press(reduced, scene.specimen, force=0.588, fidelity="contact")
    (field,) = view.fields(scene.finger, reduced, [press])
    figure = view.strain_figure(field, reduced, press, scene.specimen, scene.finger)
    assert "touched (+) at x 4, y -5 mm, seen from +y" in words(figure)
    assert [line.get_marker() for line in figure.axes[0].lines].count("+") == 1
    axes = view.contact_figure(reduced, press, scene.specimen).axes[0]
    assert np.mean(axes.get_xlim()) == pytest.approx(4) and np.mean(axes.get_ylim()) == pytest.approx(-5)


@pytest.mark.slow
def test_the_page_holds_the_presses_and_needs_no_connection(scene, given, tmp_path):
    pytest.importorskip("plotly")
    path, (finger, reduced, press, specimen) = tmp_path / "strain.html", given
    lighter = view.shown(reduced, specimen, force=0.2)
    view.strain_page(path, finger, reduced, [lighter, press], specimen)
    page = path.read_text(encoding="utf-8")
    assert len(page) < 9e6 and 'src="http' not in page and "0.588 N" in page and "0.2 N" in page
    for one in (lighter, press):
        assert f"g3: reading {one.reading[2]:+,.0f} " in page and f"{one.sd:,.0f} " in page


def test_a_shown_press_has_nodal_pressures_of_the_given_force(scene):
    for force in (0.02, 0.5):
        shown = view.shown(scene.reduced, scene.specimen, force=force)
        assert shown.fidelity != "hertz"
        assert scene.reduced.multiplicity * shown.pressure @ scene.reduced.patch.mass == pytest.approx(force, rel=1e-6)


def test_a_receptive_field_is_strongest_over_its_gauge(scene, renderer):
    fields = fem.receptive_fields(scene.model)
    figure = view.receptive_figure(fields, scene.finger, "g2")
    image = colours(view.png(figure, dpi=60))
    red = (image[:, :, 0] - image[:, :, 2] > 0.4) & (image[:, :, 1] < 0.6)
    red[int(0.85 * len(red)) :] = False
    columns = np.flatnonzero(red.any(axis=0)) / image.shape[1]
    assert 0.2 < np.median(columns) < 0.45, "g2 lies left of the middle"
    largest = np.abs(1e3 * fields.strain_per_newton[1]).max()
    assert f"{largest:.3g} µε/mN" in words(figure).replace("−", "").replace("+", "") and flaws(figure) == []


def test_the_contact_map_shows_pressure_force_and_area(scene):
    """The drawn shade integrates to the force; the dashed line encloses the stated area; dots are the nodes."""
    press, figure = scene.press, view.contact_figure(scene.reduced, scene.press, scene.specimen)
    axes, bar = figure.axes
    (image,) = axes.images
    shown, (left, right) = np.asarray(image.get_array()), axes.get_xlim()
    assert shown.mean() * (right - left) ** 2 == pytest.approx(1000 * press.force, rel=0.02)
    assert shown.max() == pytest.approx(1000 * press.peak_pressure, rel=0.01)
    x, y = (np.asarray(part) for part in axes.lines[-1].get_data())
    assert 0.5 * abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])) == pytest.approx(press.contact_area, rel=1e-3)
    assert axes.lines[-1].get_linestyle() == "--" and left < x.min() < 0 < x.max() < right
    dots = axes.collections[0]
    assert len(dots.get_offsets()) == scene.reduced.multiplicity * (press.pressure > 0).sum()
    assert dots.get_array().max() == pytest.approx(1000 * press.pressure.max()) and image.get_clim() == dots.get_clim()
    assert bar.get_ylabel() == "contact pressure (kPa)" and flaws(figure) == []
    facts = f"{press.contact_area:.3g} mm²", f"{1000 * press.peak_pressure:.3g} kPa", f"{press.indentation:.3g} mm"
    assert all(fact in words(figure) for fact in facts) and "touched" not in words(figure)


def test_two_contacts_have_one_scale_and_their_own_titles(scene, soft):
    figure = view.contact_figure(scene.reduced, scene.press, scene.specimen, (soft.press, soft.specimen))
    hard, softer, _ = figure.axes
    assert hard.get_xlim() == softer.get_xlim() and hard.images[0].get_clim() == softer.images[0].get_clim()
    titles = [axes.get_title(loc="left") for axes in (hard, softer)]
    assert titles == ["0.51 MPa block 10 mm thick", "0.05 MPa block 10 mm thick"] and flaws(figure) == []


def test_pictures_are_valid_files_written_whole(scene, tmp_path):
    for end in ("png", "svg", "pdf"):
        view.contact(tmp_path / f"contact.{end}", scene.reduced, scene.press, scene.specimen)
    assert {path.suffix for path in tmp_path.iterdir()} == {".png", ".svg", ".pdf"}
    assert (tmp_path / "contact.pdf").read_bytes().startswith(b"%PDF")
    root = ElementTree.fromstring((tmp_path / "contact.svg").read_bytes())
    width, height = (float(root.attrib[side].removesuffix("pt")) for side in ("width", "height"))
    with Image.open(tmp_path / "contact.png") as image:
        image.verify()
        assert image.width / image.height == pytest.approx(width / height, rel=0.01)


def test_without_plotly_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    with pytest.raises(MissingExtraError, match=r"plotly is not installed; pip install 'papilla\[view\]'"):
        turning.need_plotly()


class OwnBlock(Block):
    """A specimen of a user's own, whose code is not part of the key under which pictures are kept."""


@pytest.mark.slow
def test_a_picture_is_kept_for_its_press_alone(scene, given, soft, tmp_path, monkeypatch):
    monkeypatch.setenv("PAPILLA_CACHE", str(tmp_path))
    drawn: list[str] = []
    first = view.strain_picture(*given, progress=drawn.append)
    assert drawn and view.strain_picture(*given, progress=drawn.append) == first and len(drawn) == 1
    finger, reduced, *_ = given
    other = view.strain_picture(finger, reduced, soft.press, soft.specimen, progress=drawn.append)
    assert other != first and len(drawn) == 2
    narrow = view.strain_pictures(*given, drawn.append)
    assert narrow[0] == first and sheet_of(narrow[1]) < sheet_of(first)
    own, before = OwnBlock(0.51, 10), len(drawn)
    for _ in range(2):
        assert view.strain_picture(finger, reduced, scene.press, own, progress=drawn.append) == first
    assert len(drawn) == before + 2


def sheet_of(content: bytes) -> int:
    with Image.open(io.BytesIO(content)) as image:
        return image.width


def test_bad_requests_are_refused_in_one_line_and_write_nothing(scene, given, tmp_path):
    finger, reduced, press, specimen = given
    other = replace(finger, name="other")
    short = replace(press, pressure=press.pressure[:-1])
    folder = tmp_path / "missing" / "contact.png"
    for error, message, call in (
        (InputError, "no gauge 'g9'; its gauges are g1, g2", lambda: view.receptive(tmp_path / "g.png", finger, "g9")),
        (FileAccessError, "cannot write", lambda: view.contact(folder, reduced, press)),
        (InputError, "not made from this design", lambda: view.strain_picture(other, reduced, press, specimen)),
        (InputError, "pressure nodes", lambda: view.contact_figure(reduced, short)),
        (InputError, "written as .png, .pdf, .svg, not as gif", lambda: view.strain(tmp_path / "v.gif", *given)),
        (InputError, "must be strain or, of the stress, xx, yy",
         lambda: view.strain_figure(scene.field, reduced, press, specimen, finger, shown="x")),
    ):  # fmt: skip
        with pytest.raises(error, match=message) as caught:
            call()
        assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_every_listed_name_exists():
    for name in view.__all__:
        assert getattr(view, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        importlib.import_module("papilla.view").nothing  # noqa: B018


@pytest.mark.parametrize("elevation, turn", [(0.0, 0.0), (20.0, 0.0), (62.0, 180.0), (90.0, 35.0), (35.0, 40.0)])
def test_a_fitted_view_has_a_margin_around_all_points(elevation, turn):
    points = np.random.default_rng(2).uniform(-10, 25, (40, 3))
    one = render.fitted(render.View(elevation, turn), points)
    axes = one.axes()
    assert axes @ axes.T == pytest.approx(np.eye(3)) and np.linalg.det(axes) == pytest.approx(1.0)
    flat, (left, right, bottom, top) = one.project(points), one.extent
    assert flat.min(axis=0) - [left, bottom] == pytest.approx([render.MARGIN_MM] * 2)
    assert [right, top] - flat.max(axis=0) == pytest.approx([render.MARGIN_MM] * 2)


@pytest.mark.parametrize(
    "elevation, turn, point, shown",
    [
        (0, 0, (3, 4, 4), (3, 4)), (0, 180, (1, 0, 2), (-1, 2)), (90, 0, (1, 3, 2), (1, 3)), (30, 0, (0, 2, 0), (0, 1)),
    ],
)  # fmt: skip
def test_a_view_shows_x_to_the_right_and_what_is_high_or_behind_above(elevation, turn, point, shown):
    assert render.View(elevation, turn).project(np.array(point, float)) == pytest.approx(shown)


@pytest.mark.parametrize("elevation, turn", [(20.0, 0.0), (62.0, 180.0)])
def test_a_rendered_point_is_where_the_view_projects_it(elevation, turn):
    """A small red ball beside the middle of a large white one that frames the picture."""
    import pyvista as pv

    if not render.use_offscreen_window():
        pytest.skip("VTK cannot render on this machine")
    frame, place = pv.Sphere(radius=6.0), np.array([3.0, -4.0, 2.0])
    one = render.fitted(render.View(elevation, turn), frame.points)
    ball = render.PaintedSurface(pv.Sphere(radius=0.4, center=place), "#ff0000", lit=False)
    image = render.render([ball], one).astype(int)
    rows, columns = np.nonzero((image[:, :, 0] > 200) & (image[:, :, 1] < 60))
    left, right, bottom, top = one.extent
    seen = (
        left + (columns.mean() + 0.5) / image.shape[1] * (right - left),
        top - (rows.mean() + 0.5) / image.shape[0] * (top - bottom),
    )
    assert seen == pytest.approx(tuple(one.project(place)), abs=0.1)


def test_the_movie_of_a_slide_shows_evenly_spaced_samples_with_their_forces(tmp_path):
    """A hand-made slide with no force at first, and then one that presses: readings and pictures go with it."""
    finger, texture, motion = Finger.default(), Grating(2.0, 2.0, 0.3), fem.Motion.steady(40.0, 0.1)
    model = SectionModel(finger, build_section(finger))
    x, rows = model.section.points[model.patch_vertices, 0], len(motion.t_s)
    grows = np.linspace(0, 1, rows)
    pressing = np.outer(grows, 0.05 * (np.abs(x) < 3))
    readings = np.outer(grows, [100.0, 50.0, 0.0, -50.0, -100.0])
    made = dict(dynamics="quasistatic", why="", ridge_pitch_mm=finger.ridge_pitch_mm, status="ok")
    arrays = dict(
        x_mm=x, readings=readings, amplified=readings, force_N=0.3 * grows, tangential_N=0 * grows, depth_mm=grows,
        pressing=pressing, rubbing=0 * pressing, state=np.zeros(pressing.shape, int), carried_mm=0 * grows,
    )  # fmt: skip
    numbers = dict.fromkeys([one.name for one in fields(fem.Slide)], 0.0) | {"tied": None}
    names = tuple(gauge.name for gauge in finger.gauges)
    found = fem.Slide(**(numbers | made | arrays | {"motion": motion, "gauge_names": names}))
    path = tmp_path / "slide.gif"
    slide_movie.write_slide_movie(path, finger, texture, found, frames=3)
    with Image.open(path) as movie:
        assert movie.n_frames == 3 and movie.size == (648, 540) and movie.info["duration"] == 80
        frames = [np.asarray(one.convert("RGB"), float) / 255 for one in ImageSequence.Iterator(movie)]
    grey = tuple((value - 0.02, value + 0.02) for value in matplotlib.colors.to_rgb(style.RIGID_COLOR))
    covered = [share(frame, *grey) for frame in frames]
    assert np.diff(covered) == pytest.approx([0.01, 0.01], abs=0.003), "the texture comes down by half a millimetre"
    strained = [share(frame, *TENSION) for frame in frames]
    assert strained[0] < 0.0005 and strained[1] > 0.001 and strained[2] > 1.5 * strained[1], "the strain with the force"
    with pytest.raises(InputError, match="the one that slid every"):
        slide_movie.write_slide_movie(path, replace(finger, ridges=None), texture, found)
    with pytest.raises(InputError, match="written as .gif"):
        slide_movie.write_slide_movie(tmp_path / "slide.mp4", finger, texture, found)
    assert [item.name for item in tmp_path.iterdir()] == ["slide.gif"]
