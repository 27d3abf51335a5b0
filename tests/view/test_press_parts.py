"""Each part of the picture, the page and the map of a press stands where the press has it."""

import base64
import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.colors import to_rgb
from scipy.interpolate import LinearNDInterpolator
from shown_figures import flaws, words

from papilla import fem, view
from papilla.fem.reduction.patch import Frame
from papilla.mesh.body import surfaces_of
from papilla.model.specimen import Block, HalfSpace, Sphere
from papilla.view import contact_map, render, strain_field, style, turning
from papilla.view.section import cut, half_skin, specimen_solid, surface_displacement

SIDES = pytest.mark.parametrize("at", [(0.0, 0.0), (2.0, -1.0)])
"""Touched at the apex and shown from -y, or beside it and shown from +y."""


def shown_at(scene, at):
    """The scene as if it were touched at another place, its parts, and the sign of the y that is shown."""
    reduced = replace(scene.reduced, at=at)
    return reduced, strain_field.drawn(strain_field.PressScene(scene.field, scene.press, scene.specimen), reduced,
                                       scene.finger, scale=2.0), -1 if at[1] < 0 else 1  # fmt: skip


def seen(points, side, centre):
    """Places (..., 2) in a picture without VTK: x, mirrored as seen from +y, and z, from the middle."""
    return (np.asarray(points)[..., [0, 2]] - centre) * [side, 1]


@SIDES
@pytest.mark.parametrize("renderer", ["matplotlib"], indirect=True)
def test_lines_shades_and_names_are_where_the_press_has_them(scene, renderer, at):
    reduced, parts, side = shown_at(scene, at)
    given = scene.field, reduced, scene.press, scene.specimen, scene.finger
    figure = view.strain_figure(*given, scale=2.0)
    axes, bar = figure.axes
    everything = np.concatenate([parts.skin.points, parts.solid.points])[:, [0, 2]]
    low, high = everything.min(axis=0) - render.MARGIN_MM, everything.max(axis=0) + render.MARGIN_MM
    centre, (width, height) = (low + high) / 2, high - low
    assert [*axes.get_xlim(), *axes.get_ylim()] == pytest.approx(np.outer([width, height], [-0.5, 0.5]).ravel())
    assert figure.get_size_inches() == pytest.approx([10, 10 * height / width + render.AROUND_IN]) and not axes.axison
    limit = style.nice_limit(max(np.abs(face.values).max() for face in parts.section.faces))
    for shades, face in zip(axes.collections, parts.section.faces, strict=True):
        assert np.asarray(shades.get_array()) == pytest.approx(face.values) and shades.get_clim() == (-limit, limit)
        corners = np.array([path.vertices[:3] for path in shades.get_paths()])
        assert corners == pytest.approx(seen(face.points, side, centre)[face.triangles])
    edges = parts.section.outlines
    touched = [] if side > 0 else [parts.touched[None]]
    expected = [*edges["skin"], *edges["interface"], *parts.outline, *touched, *np.repeat(parts.section.gauges, 2, 0)]
    assert len(axes.lines) == len(expected)
    for line, points in zip(axes.lines, expected, strict=True):
        assert line.get_xydata() == pytest.approx(seen(points, side, centre), nan_ok=True)
    dashed = [line for line in axes.lines if line.get_linestyle() == "--"]
    assert len(dashed) == 1 and np.isfinite(parts.outline[0][:, 1]).any()
    assert all((side * np.nan_to_num(line[:, 1]) >= -1e-3).all() for line in parts.outline)
    if side < 0:
        place = Frame.at(surfaces_of(scene.finger)["skin"], *at).origin
        near = np.linalg.norm(scene.field.mesh.points - place, axis=1).argmin()
        assert parts.touched == pytest.approx(place + 2 * scene.field.displacement[near])
    labels = {text.get_text().split("\n")[0]: text for text in axes.texts}
    for gauge, ends in zip(scene.finger.gauges, seen(parts.section.gauges, side, centre), strict=True):
        away, along = labels[gauge.name].get_position() - ends.mean(axis=0), ends[1] - ends[0]
        assert np.linalg.norm(away) == pytest.approx(strain_field.LABEL_MM) and away[1] < 0
        assert away @ along == pytest.approx(0, abs=1e-9)
    assert labels["0.51 MPa"].get_position() == pytest.approx(seen(parts.solid.center, side, centre))
    (bone,) = parts.section.bone
    assert axes.patches[-1].get_path().vertices[: len(bone)] == pytest.approx(seen(bone, side, centre))
    assert labels["bone"].get_position() == pytest.approx(seen(bone.mean(axis=0), side, centre))
    ticks = [text.get_text() for text in bar.get_xticklabels()]
    assert ticks == [f"{k * limit:+.3g}".replace("-", "−") if k else "0" for k in (-1, -0.5, 0, 0.5, 1)]
    said = words(figure)
    assert "drawn 2 times as large" in said and ("touched (+) at x 2, y -1 mm, seen from +y" in said) == (side < 0)
    assert [text.get_fontsize() for text in figure.texts] == [style.LARGE_PT, style.LARGE_PT * style.DETAIL_SIZE]


@pytest.mark.parametrize("renderer", ["matplotlib"], indirect=True)
def test_two_presses_have_their_own_panel_and_one_scale(scene, renderer):
    firm = replace(scene.press, indentation=1.5, values=2 * scene.press.values)
    other = strain_field.PressScene(replace(scene.field, stress=3 * scene.field.stress), firm, HalfSpace(0.3))
    given = scene.field, scene.reduced, scene.press, scene.specimen, scene.finger
    figure = view.strain_figure(*given, shown="xz", beside=other)
    one, two, bar = figure.axes
    assert figure.get_figwidth() == 17 and one.get_xlim() == two.get_xlim() and one.get_ylim() == two.get_ylim()
    tops = [max(np.abs(part.get_array()).max() for part in axes.collections) for axes in (one, two)]
    assert tops[1] == pytest.approx(3 * tops[0]) and one.collections[0].get_clim()[1] == style.nice_limit(tops[1])
    assert "indentation 0.875 mm" in one.get_title() and "indentation 1.5 mm" in two.get_title()
    assert "0.3 MPa" in two.texts[0].get_text() or any("0.3 MPa" in text.get_text() for text in two.texts)
    assert bar.get_xlabel() == "shear stress xz (kPa)" and one.get_position().x1 < two.get_position().x0 + 0.5
    assert f"{scene.press.sd:,.0f} and {firm.sd:,.0f} µε" in words(figure)
    for quantity, told in (("zz", "stress zz (kPa): red is tension, blue compression"),
                           ("mises", "von Mises stress (kPa)"), ("yz", "shear stress yz (kPa)")):  # fmt: skip
        assert strain_field.shown_words(quantity) == told


def test_a_rendered_picture_shows_colours_of_the_cut_where_it_is(scene):
    """Below the apex and in the bulk: the colour of the value in the map, whatever the light."""
    if not render.use_offscreen_window():
        pytest.skip("VTK cannot render on this machine")
    given = scene.field, scene.reduced, scene.press, scene.specimen, scene.finger
    (image,) = (axes := view.strain_figure(*given).axes[0]).images
    parts = strain_field.drawn(strain_field.PressScene(*given[:1], *given[2:4]), *given[1::3])
    one = render.fitted(render.View(20.0, 0.0), strain_field.points_of([parts]))
    assert tuple(image.get_extent()) == pytest.approx(one.extent)
    assert [*axes.get_xlim(), *axes.get_ylim()] == pytest.approx(one.extent)
    pixels = np.asarray(image.get_array()) / 255
    assert pixels.shape[:2] == pytest.approx((36 * one.height_mm, 36 * one.width_mm), abs=1)
    limit, off = strain_field.common_limit([parts]), []
    for face in parts.section.faces:
        middles, values = face.points[face.triangles].mean(axis=1), face.values[face.triangles]
        inner = (np.ptp(values, axis=1) < 0.5) & (np.abs(middles[:, 0]) > 3) & (np.abs(middles[:, 0]) < 8)
        x, y = one.project(middles[inner]).T
        column = ((x + one.width_mm / 2) / one.width_mm * pixels.shape[1]).astype(int)
        row = ((one.height_mm / 2 - y) / one.height_mm * pixels.shape[0]).astype(int)
        expected = colormaps[style.DIVERGING_COLORS](0.5 + values[inner].mean(axis=1) / (2 * limit))[:, :3]
        off += np.abs(pixels[row, column] - expected).max(axis=1).tolist()
    assert len(off) > 30 and np.median(off) < 0.03


def test_light_comes_from_the_upper_left_and_plain_colours_are_exact():
    """A ball is brightest at its upper left; without light it is of one colour; what is half opaque lets white in."""
    import pyvista as pv

    if not render.use_offscreen_window():
        pytest.skip("VTK cannot render on this machine")
    ball = pv.Sphere(radius=4.0, theta_resolution=60, phi_resolution=60)
    one = render.fitted(render.View(35.0, 40.0), ball.points)
    shades = render.render([render.PaintedSurface(ball, "#808080")], one).mean(axis=2)
    size = len(shades)
    place = np.linspace(-one.width_mm / 2, one.width_mm / 2, size)
    inside = np.add.outer(place**2, place**2) < 3.6**2
    dark = np.where(inside, shades, np.nan)
    rows, columns = np.nonzero(dark > np.nanpercentile(dark, 97))
    assert rows.mean() < 0.42 * size and columns.mean() < 0.5 * size and np.nanmin(dark) < 0.75 * np.nanmax(dark)
    assert np.nanmean(dark[:, : size // 2]) > np.nanmean(dark[:, size // 2 :]), "the left half"
    assert np.nanmin(dark[: size // 2]) > np.nanmin(dark[size // 2 :])
    for opacity, shown in ((1.0, 1.0), (0.5, 0.75)):  # two walls of the ball
        flat = render.render([render.PaintedSurface(ball, "#c02040", lit=False, opacity=opacity)], one)[size // 2] / 255
        assert flat[size // 2] == pytest.approx(1 - shown * (1 - np.array(to_rgb("#c02040"))), abs=0.01)
        assert (flat[0] == 1).all()


def arrays(trace, keys="xyz"):
    """Columns of a trace of a page."""
    columns = [base64.b64decode(trace[key]["bdata"]) for key in keys]
    return np.column_stack([np.frombuffer(one, trace[key]["dtype"]) for one, key in zip(columns, keys, strict=True)])


@SIDES
def test_a_page_to_turn_has_each_press_and_shows_the_last(scene, at):
    pytest.importorskip("plotly")
    lighter = replace(scene.press, force=0.2, values=0.5 * scene.press.values, indentation=0.3)
    presses, (reduced, _, side) = (lighter, scene.press), shown_at(scene, at)
    scenes = [strain_field.PressScene(scene.field, press, scene.specimen) for press in presses]
    page = turning.strain_html(scenes, reduced, scene.finger)
    assert page.count('<head><meta name="viewport"') == 1 and page.index("<head>") < 100 and 'src="http' not in page
    start = page.rindex("Plotly.newPlot")
    data, end = json.JSONDecoder().raw_decode(page, page.index("[", start))
    layout, end = json.JSONDecoder().raw_decode(page, page.index("{", end))
    assert '{"responsive": true}' in page[end:] and layout["showlegend"] is False
    traces = len(data) // 2
    (slider,) = layout["sliders"]
    assert [step["label"] for step in slider["steps"]] == ["0.2 N", "0.588 N"] and slider["active"] == 1
    for number, step in enumerate(slider["steps"]):
        visible, title = step["args"]
        assert visible["visible"] == [k // traces == number for k in range(2 * traces)]
        assert f"{presses[number].sd:,.0f} µε, indentation {presses[number].indentation:.3g} mm" in title["title.text"]
    assert [trace["visible"] for trace in data] == slider["steps"][1]["args"][0]["visible"]
    assert layout["title"]["text"] == slider["steps"][1]["args"][1]["title.text"]
    for press, one in zip(presses, (0, 1), strict=True):
        drawn = strain_field.drawn(scenes[one], reduced, scene.finger)
        group = data[one * traces : (one + 1) * traces]
        faces, (skin, solid, bone, lines, contact, grids, names) = group[: traces - 7], group[traces - 7 :]
        for trace, face in zip(faces, drawn.section.faces, strict=True):
            assert arrays(trace) == pytest.approx(face.points, abs=1e-4)
            assert (arrays(trace, "ijk") == face.triangles).all()
            assert arrays(trace, ["intensity"])[:, 0] == pytest.approx(face.values, rel=1e-5, abs=1e-5)
            assert trace["lighting"] == {"ambient": 1, "diffuse": 0, "specular": 0}, "shades of the bar"
        for trace, surface, flat in ((skin, drawn.skin, False), (solid, drawn.solid, True)):
            assert arrays(trace) == pytest.approx(surface.triangulate().points, abs=1e-4)
            assert (arrays(trace, "ijk") == surface.triangulate().regular_faces).all() and trace["flatshading"] is flat
            assert 0.8 < trace["lighting"]["ambient"] + trace["lighting"]["diffuse"] < 1.16
        corners = arrays(bone)[arrays(bone, "ijk")][:, :, [0, 2]]
        fans = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 2
        x, z = drawn.section.bone[0][:, [0, 2]].T
        assert fans.sum() == pytest.approx(np.sum(x * np.roll(z, -1) - np.roll(x, -1) * z) / 2, rel=1e-3)
        assert len(fans) == len(x) and (np.abs(fans.sum()) == pytest.approx(np.abs(fans).sum(), rel=0.01))
        lift = np.array([0, -side * turning.LIFTED_MM, 0])
        outlines = [line for name in ("skin", "interface") for line in drawn.section.outlines[name]]
        for trace, expected in ((lines, outlines), (contact, drawn.outline)):
            gaps = np.concatenate([np.vstack([line, np.full((1, 3), np.nan)]) for line in expected])
            assert arrays(trace) == pytest.approx(gaps + lift, abs=1e-4, nan_ok=True)
        ends = arrays(grids).reshape(-1, 4, 3)
        assert ends[:, [0, 2]] == pytest.approx(drawn.section.gauges + lift, abs=1e-4) and np.isnan(ends[:, 3]).all()
        assert ends[:, 1] == pytest.approx(ends[:, [0, 2]].mean(axis=1), abs=1e-4)
        before = drawn.section.gauges.mean(axis=1) - [0, side * turning.NAMES_MM, 0]
        assert arrays(names) == pytest.approx(before, abs=1e-4)
        for gauge, strain, reading, texts in zip(
            scene.finger.gauges, press.strain, press.reading, np.reshape(grids["hovertext"], (-1, 4)), strict=True
        ):
            told = f"{gauge.name}: reading {reading:+,.0f} µε<br>strain {100 * strain:+.2f} %".replace("-", "−")
            assert texts.tolist() == [told, told, told, ""]
        assert grids["line"]["width"] == 4 * lines["line"]["width"] and contact["line"]["dash"] == "dash"
    limit = style.nice_limit(max(np.abs(face.values).max() for face in drawn.section.faces))
    assert (layout["coloraxis"]["cmin"], layout["coloraxis"]["cmax"]) == (-limit, limit)
    space = layout["scene"]
    ranges = np.array([space[f"{axis}axis"]["range"] for axis in "xyz"])
    points = strain_field.points_of([strain_field.drawn(one, reduced, scene.finger) for one in scenes])
    assert points.min(axis=0) - ranges[:, 0] == pytest.approx([4] * 3)
    assert ranges[:, 1] - points.max(axis=0) == pytest.approx([4] * 3)
    ratio = np.array([space["aspectratio"][axis] for axis in "xyz"]) / np.ptp(ranges, axis=1)
    assert ratio == pytest.approx(ratio[0]) and max(space["aspectratio"].values()) == turning.ZOOM_FACTOR
    assert np.sign(space["camera"]["eye"]["y"]) == -side and not space["xaxis"]["visible"]


@pytest.mark.parametrize("side", [1, -1])
def test_the_cut_moves_with_the_displacement_of_its_places(scene, side):
    """What is drawn twice as far minus what is drawn at rest is twice the field there."""
    rest, moved = (cut(scene.field, scene.finger, scale=scale, side=side) for scale in (0.0, 2.0))
    skins = [half_skin(scene.field, scale=scale, side=side) for scale in (0.0, 2.0)]
    pairs = [
        (name, one, two)
        for name in rest.outlines
        for one, two in zip(rest.outlines[name], moved.outlines[name], strict=True)
    ]
    for name, one, two in [*pairs, ("skin", skins[0].points, skins[1].points)]:
        known = surface_displacement(scene.field, name, one[:, :2])
        inside = np.isfinite(known[:, 0])
        assert inside.mean() > 0.6 and (two - one)[inside] == pytest.approx(2 * known[inside], abs=0.02)
    assert all((np.abs(line[:, 1]) < 1e-5).all() for lines in rest.outlines.values() for line in lines)
    lengths = np.linalg.norm(rest.gauges[:, 1] - rest.gauges[:, 0], axis=1)
    assert lengths == pytest.approx([gauge.length_mm for gauge in scene.finger.gauges], rel=1e-3)
    assert (rest.gauges[..., 0] / 21) ** 2 + (rest.gauges[..., 2] / 17) ** 2 == pytest.approx(np.ones((5, 2)))
    assert np.abs(rest.gauges[..., 1]).max() < 1e-9, "the middle line of each grid"
    (bone,) = rest.bone
    (a, _, c), (x, y, z) = scene.finger.shape.bone, bone.T
    assert (y == 0).all() and np.abs(np.where(z > 0.2, (x / a) ** 2 + (z / c) ** 2 - 1, 0)).max() < 0.01
    area = np.abs(np.sum(x * np.roll(z, -1) - np.roll(x, -1) * z)) / 2
    assert area == pytest.approx(np.pi / 2 * a * c, rel=0.01)


def test_values_at_vertices_are_those_of_a_constant_and_near_those_of_a_linear_field(scene):
    mesh = scene.field.mesh
    for slope in (np.zeros(3), np.array([0.3, -0.2, 0.5])):
        stress = np.zeros((len(mesh.tets), 3, 3))
        stress[:, 0, 1] = 2.0 + mesh.points[mesh.tets].mean(axis=1) @ slope
        still = replace(scene.field, stress=stress, displacement=0 * scene.field.displacement)
        for face in cut(still, scene.finger, quantity="xy").faces:
            off = face.values / 1000 - 2.0 - face.points @ slope
            assert np.abs(off).max() < 1e-9 + 0.6 * slope.any() and np.abs(off).mean() < 1e-9 + 0.055 * slope.any()


@pytest.mark.parametrize(
    "specimen, thick", [(Block(0.51, 5.0), 5.0), (Block(0.51, 30.0), 10.0), (HalfSpace(1.0), 10.0)]
)
def test_a_drawn_specimen_is_as_thick_as_it_is_up_to_a_centimetre(scene, specimen, thick):
    frame = Frame.at(surfaces_of(scene.finger)["skin"], 0.0, 0.0)
    x, y, z = specimen_solid(specimen, scene.field, frame, scene.press, 12.0, 2.0).points.T
    top = 20 - 2 * scene.press.indentation + thick
    assert z.max() == pytest.approx(top) and np.isin(z, z.max()).sum() > 1000
    assert [x.min(), x.max(), y.min(), y.max()] == pytest.approx([-12, 12, -12, 12])
    raised = replace(scene.field, displacement=scene.field.displacement * 0 + [0.0, 0.0, 1.0])
    x, y, z = specimen_solid(specimen, raised, frame, scene.press, 12.0, 1.0).points.T
    lower = z < 20.9 - scene.press.indentation + thick - 1
    skin = scene.field.mesh.points[np.unique(scene.field.mesh.boundaries["skin"])] + [0, 0, 1]
    above = LinearNDInterpolator(skin[:, :2], skin[:, 2])(x, y)
    face = np.fmax(above, 20 - scene.press.indentation)
    assert lower.sum() > 1000 and np.abs(z - face)[lower].max() < 0.05, "it follows the skin that bulges into it"


def test_the_map_of_a_contact_lies_around_the_touch(scene):
    """Beside the apex all is shifted by the place of the touch; the map reaches 1.3 times as far as the contact."""
    at, press = np.array([4.0, -5.0]), scene.press
    reduced = replace(scene.reduced, at=tuple(at))
    wide = replace(press, contact_area=1.44 * press.contact_area, peak_pressure=0.7 * press.peak_pressure)
    figure = contact_map.contact_figure(reduced, press, scene.specimen, (wide, Sphere(0.3, 20.0)))
    one, two, bar = figure.axes
    edges = [contact_map.contact_edge(reduced, item)[0] for item in (press, wide)]
    reach = 1.3 * max(np.abs(edge).max() for edge in edges)
    limit = style.nice_limit(1000 * max(press.peak_pressure, press.pressure.max()))
    assert figure.get_size_inches() == pytest.approx([1.4 + 2 * 4.4, 5.6])
    assert bar.get_ylim() == pytest.approx((0, limit)) and bar.get_position().x0 > two.get_position().x0
    assert one.get_ylabel() == "y along the finger (mm)" and two.get_ylabel() == ""
    xy, triangles, pressure = contact_map.whole_patch(reduced, press)
    assert len(triangles) == len(reduced.patch.triangles) * reduced.multiplicity and triangles.max() == len(xy) - 1
    for axes, edge in ((one, edges[0]), (two, edges[1])):
        extent = [at[0] - reach, at[0] + reach, at[1] - reach, at[1] + reach]
        assert [*axes.get_xlim(), *axes.get_ylim()] == pytest.approx(extent) and axes.get_aspect() == 1
        assert axes.images[0].get_extent() == pytest.approx(extent) and axes.images[0].origin == "lower"
        assert axes.images[0].get_clim() == (0, limit) and axes.get_xlabel() == "x across the finger (mm)"
        assert axes.lines[-1].get_xydata() == pytest.approx(edge + at)
        assert np.asarray(axes.collections[0].get_offsets()) == pytest.approx(xy[pressure > 0] + at)
        mesh = axes.lines[0].get_xydata()
        assert np.nanmin(mesh, 0) == pytest.approx(xy.min(0) + at) and np.nanmax(mesh, 0) == pytest.approx(
            xy.max(0) + at
        )
        assert not any(line.get_visible() for line in axes.get_xgridlines()) and axes.lines[0].get_linewidth() < 0.8
    assert "touched at x 4, y -5 mm" in words(figure) and "and on" in words(figure)


@pytest.fixture(scope="module")
def responses(scene):
    return fem.receptive_fields(scene.model)


@pytest.mark.parametrize("renderer", ["matplotlib"], indirect=True)
def test_a_receptive_field_is_that_of_its_gauge_in_micro_strain_per_millinewton(scene, renderer, responses):
    figure = view.receptive_figure(responses, scene.finger, "g4")
    axes, bar = figure.axes
    values, skin = 1e3 * responses.strain_per_newton[3], responses.mesh.points[responses.vertices]
    (shades,) = axes.collections
    assert np.sort(np.asarray(shades.get_array())) == pytest.approx(np.sort(values)) and figure.get_figwidth() == 8
    limit = style.nice_limit(np.abs(values).max())
    assert shades.get_clim() == bar.get_xlim() == (-limit, limit)
    x, y, _ = skin[np.abs(values).argmax()]
    assert f"{values[np.abs(values).argmax()]:+.3g} µε/mN at x {x:.3g}, y {y:.3g} mm".replace("-", "−") in words(figure)
    names = {text.get_text(): text for text in axes.texts}
    for gauge, line in zip(scene.finger.gauges, axes.lines[1::2], strict=True):
        ends = line.get_xydata()
        middle = ends.mean(axis=0)
        assert np.ptp(ends[:, 1]) < 1e-6 and 0.7 < np.ptp(ends[:, 0]) / gauge.length_mm < 1.4
        assert names[gauge.name].get_position() == pytest.approx([middle[0], middle[1] - 1])
        assert (names[gauge.name].get_weight() == "bold") == (gauge.name == "g4")
        assert (line.get_color() == style.GAUGE_COLOR) == (gauge.name == "g4")


@pytest.mark.parametrize("small, columns, inches", [(False, 5, 2.9), (True, 2, 2.3)])
def test_maps_of_all_gauges_are_beside_each_other(scene, responses, small, columns, inches):
    figure = view.receptive_fields_figure(responses, scene.finger, small=small)
    *maps, bar = figure.axes
    rows = -(-5 // columns)
    width, height = np.ptp(responses.mesh.points[responses.vertices], axis=0)[:2] + 3
    assert len(maps) == rows * columns and [axes.get_visible() for axes in maps] == [k < 5 for k in range(len(maps))]
    if not small:
        assert figure.get_size_inches() == pytest.approx([5 * inches, inches * height / width + render.AROUND_IN])
    assert [axes.get_ylabel() for axes in maps] == ["y (mm)" if k % columns == 0 else "" for k in range(len(maps))]
    limit = style.nice_limit(1e3 * np.abs(responses.strain_per_newton).max())
    for number, axes in enumerate(maps[:5]):
        values = 1e3 * responses.strain_per_newton[number]
        (shades,) = axes.collections
        assert shades.get_clim() == (-limit, limit) and np.sort(np.asarray(shades.get_array())) == pytest.approx(
            np.sort(values)
        )
        assert shades.get_rasterized() and axes.get_aspect() == 1 and axes.get_xlim() == maps[0].get_xlim()
        strongest = f"{values[np.abs(values).argmax()]:+.3g} µε/mN".replace("-", "−")
        assert axes.get_title(loc="left") == f"g{number + 1}: {strongest}"
        chosen = [line.get_color() == style.GAUGE_COLOR for line in axes.lines]
        assert chosen == [k == 2 * number + 1 for k in range(10)]
    assert figure.texts[0].get_fontsize() == (style.TITLE_PT if small else style.LARGE_PT) and flaws(figure) == []
