"""What pictures show of a made-up press: data of the artists, limits and words, against values found by hand."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import pyvista as pv
from made_up_press import AREA, FINGER, SPECIMEN, press, reduced
from matplotlib.text import Text

from papilla import view
from papilla.core.errors import InputError
from papilla.model.specimen import Sphere
from papilla.view import contact_map, receptive_field, render, section, strain_field, turning
from papilla.view.render import Part, View, fitted


def texts(figure) -> list[str]:
    """All texts of a figure."""
    return [item.get_text() for item in figure.findobj(match=Text)]


def words(figure) -> str:
    """All texts of a figure in one line."""
    return " ".join(" ".join(texts(figure)).split())


# ---- The projection


def test_a_view_from_the_front_shows_x_to_the_right_and_z_up():
    one = View(0.0, 0.0, centre=(1.0, 5.0, 2.0))
    assert one.project(np.array([[4.0, 9.0, 6.0]])) == pytest.approx(np.array([[3.0, 4.0]]))
    assert View(0.0, 180.0).project(np.array([1.0, 0.0, 2.0])) == pytest.approx([-1.0, 2.0])
    # From above, y is up; in between, what is behind is higher
    assert View(90.0, 0.0).project(np.array([1.0, 3.0, 2.0])) == pytest.approx([1.0, 3.0])
    assert View(30.0, 0.0).project(np.array([0.0, 2.0, 0.0])) == pytest.approx([0.0, 1.0])


@pytest.mark.parametrize("elevation, turn", [(20.0, 0.0), (62.0, 180.0), (35.0, 40.0)])
def test_a_fitted_view_has_a_margin_around_all_points(elevation, turn):
    points = np.random.default_rng(2).uniform(-10, 25, (40, 3))
    one = fitted(View(elevation, turn), points)
    axes = one.axes()
    assert axes @ axes.T == pytest.approx(np.eye(3)) and np.linalg.det(axes) == pytest.approx(1.0)
    flat = one.project(points)
    left, right, bottom, top = one.extent
    assert flat.min(axis=0) - [left, bottom] == pytest.approx([render.MARGIN_MM] * 2)
    assert [right, top] - flat.max(axis=0) == pytest.approx([render.MARGIN_MM] * 2)


def test_the_camera_sees_what_the_view_projects(monkeypatch):
    """Without rendering: position, direction and scale of the camera, and the light from the viewer's side."""
    one, lights = fitted(View(20.0, 180.0), np.array([[-5.0, -3.0, 0.0], [7.0, 3.0, 12.0]])), []
    camera = SimpleNamespace(enable_parallel_projection=lambda: None)
    plotter = SimpleNamespace(
        camera=camera, add_light=lights.append, renderer=SimpleNamespace(reset_camera_clipping_range=lambda: None)
    )
    render._aim(plotter, one)
    toward = np.array([0.0, math.cos(math.radians(20)), math.sin(math.radians(20))])
    assert camera.parallel_scale == pytest.approx(one.height_mm / 2)
    assert camera.focal_point == pytest.approx(one.centre)
    away = np.array(camera.position) - one.centre
    assert away / np.linalg.norm(away) == pytest.approx(toward) and np.linalg.norm(away) > 100
    assert np.dot(camera.up, toward) == pytest.approx(0.0, abs=1e-12) and camera.up[2] > 0
    render._light(plotter, one)
    assert len(lights) == 2 and lights[0].intensity > lights[1].intensity
    assert all(np.dot(light.position, toward) > 0 for light in lights)
    # The main light is above on the left, the other one on the right; from behind, right is -x
    assert lights[0].position[2] > lights[1].position[2] and lights[0].position[0] > 0 > lights[1].position[0]


def test_a_part_is_added_with_its_colours():
    added, sphere = [], pv.Sphere()
    plotter = SimpleNamespace(add_mesh=lambda surface, **how: added.append(how))
    for part in (Part(sphere, "red"), Part(sphere, scalars="shown", limit=3.0), Part(sphere, "blue", lit=False)):
        render._add(plotter, part)
    plain, shaded, flat = added
    assert plain["color"] == "red" and plain["lighting"] and plain["ambient"] < shaded["ambient"]
    assert shaded["scalars"] == "shown" and tuple(shaded["clim"]) == (-3.0, 3.0)
    assert shaded["ambient"] + shaded["diffuse"] == pytest.approx(1.05)
    assert not flat["lighting"] and "ambient" not in flat


# ---- The contact


def test_the_contact_map_shows_the_smooth_pressure_and_the_nodes():
    found, one = reduced()
    figure = view.contact_figure(found, one)
    axes, bar = figure.axes
    (image,) = axes.images
    shown = np.asarray(image.get_array())
    middle = shown[len(shown) // 2, len(shown) // 2]
    assert middle == pytest.approx(1000 * one.peak_pressure, rel=1e-3) and shown[0, 0] == pytest.approx(0, abs=0.1)
    # Force: the integral of the shown pressure
    left, right = axes.get_xlim()
    assert shown.mean() * (right - left) ** 2 == pytest.approx(1000 * one.force, rel=0.02)
    (edge,) = axes.lines[-1:]
    assert np.abs(edge.get_xdata()).max() == pytest.approx(2.0, rel=0.02)
    assert np.abs(edge.get_ydata()).max() == pytest.approx(4.0, rel=0.02) and edge.get_linestyle() == "--"
    assert (left, right) == pytest.approx(axes.get_ylim()) and right == pytest.approx(1.3 * 4.0, rel=0.02)
    dots = axes.collections[0]
    assert len(dots.get_offsets()) == 4 * (one.pressure > 0).sum() and dots.get_array().max() == pytest.approx(middle)
    assert bar.get_ylabel() == "contact pressure (kPa)" and image.get_clim() == dots.get_clim()
    said = words(figure)
    for word in ("0.5 N on 0.2 MPa, friction 0", "contact area 25.1 mm²", "indentation 0.75 mm", "a made-up press"):
        assert word in said
    assert "touched" not in said


def test_a_contact_beside_the_apex_is_drawn_around_its_place():
    found, one = reduced(at=(3.0, -5.0))
    axes = view.contact_figure(found, one).axes[0]
    assert np.mean(axes.get_xlim()) == pytest.approx(3.0) and np.mean(axes.get_ylim()) == pytest.approx(-5.0)
    ellipse = axes.lines[-1]
    assert np.mean(ellipse.get_xdata()[:-1]) == pytest.approx(3.0, abs=1e-6)


def test_the_layer_term_follows_the_peak():
    """A pressure that is sharper than Hertz's has a profile with its peak."""
    found, one = reduced(sharpness=0.9)
    profile = contact_map.contact_profile(found, one)
    assert profile.mean == pytest.approx(0.5 / AREA)
    assert profile(np.zeros((1, 2)))[0] == pytest.approx(one.peak_pressure, rel=0.02)
    blunt = contact_map.contact_profile(found, press(pressure=one.pressure))
    assert profile.layer_term > blunt.layer_term


def test_two_contacts_have_one_scale():
    found, one = reduced()
    specimen = SimpleNamespace(modulus=0.2, words="block 10 mm thick")
    other = press(pressure=2 * one.pressure, peak_pressure=2 * one.peak_pressure)
    figure = view.contact_figure(found, one, specimen, (other, SimpleNamespace(modulus=0.9, words="ball")))
    left, right, _ = figure.axes
    assert left.images[0].get_clim() == right.images[0].get_clim()
    assert left.images[0].get_clim()[1] >= 2000 * one.peak_pressure
    assert [axes.get_title(loc="left") for axes in (left, right)] == ["0.2 MPa block 10 mm thick", "0.9 MPa ball"]


# ---- The cut: a cube of tetrahedra


def test_nodal_values_of_a_linear_function_are_near_its_own(cube):
    points, whole = cube.mesh.points, np.ones(len(cube.mesh.tets), bool)
    values = 3.0 + points[cube.mesh.tets].mean(axis=1) @ [1.0, -2.0, 0.5]
    nodal = section._nodal_values(cube.mesh, whole, values)
    # In the middle it is exact; at the surface the penalty on slopes takes a part of them away
    assert nodal[np.abs(points).max(axis=1) == 0] == pytest.approx(3.0, abs=1e-6)
    slopes = np.linalg.lstsq(points, nodal - 3.0)[0]
    assert slopes == pytest.approx([1.0, -2.0, 0.5], rel=0.25)
    assert section._nodal_values(cube.mesh, whole, np.full(len(values), 7.0)) == pytest.approx(7.0)
    upper = section._nodal_values(cube.mesh, cube.mesh.layer == 0, np.full(len(values), 7.0))
    assert (upper[points[:, 2] < 0] == 0).all() and upper[points[:, 2] > 0] == pytest.approx(7.0)


@pytest.mark.parametrize("side", [1, -1])
def test_a_face_is_the_moved_plane_of_its_layer(cube, side):
    values = np.full(len(cube.mesh.tets), 4.0)
    face = section._face(cube.mesh, 0, values, cube.displacement, side)
    x, z = face.points[:, 0], face.points[:, 2]
    rest_z = (z - 0.05 * x) / (1 - 0.005)  # x = X + 0.1 Z, z = Z + 0.05 X
    assert rest_z.min() == pytest.approx(0.0, abs=1e-5) and rest_z.max() == pytest.approx(1.0, abs=1e-5)
    assert np.abs(face.points[:, 1]).max() < 1e-5 and face.values == pytest.approx(4.0)
    corners = face.points[face.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    assert area == pytest.approx(2.0 * 1.0 * (1 - 0.005), rel=1e-4)
    (line,) = section._outline(cube.mesh, "interface", cube.displacement, side)
    assert line[:, 2] == pytest.approx(1 + 0.05 * (line[:, 0] - 0.1), abs=1e-5)
    assert np.ptp(line[:, 0]) == pytest.approx(2.0, abs=1e-5)


def test_the_displacement_of_a_surface_is_interpolated_and_unknown_outside(cube):
    found = section.surface_displacement(cube, "interface", np.array([[0.3, 0.4], [5.0, 0.0]]))
    assert found[0] == pytest.approx([0.1, 0.0, 0.015]) and np.isnan(found[1]).all()


@pytest.mark.parametrize("side", [1, -1])
def test_half_of_a_skin_is_the_half_that_is_shown(cube, side):
    half = section.half_skin(cube, scale=2.0, side=side)
    assert (side * half.points[:, 1]).min() == pytest.approx(0, abs=1e-6) and np.ptp(half.points[:, 1]) == 1.0
    assert half.points[:, 0].max() == pytest.approx(1 + 2 * 0.1, abs=1e-6)


def test_a_drawn_block_follows_a_skin_that_bulges_into_it_and_a_ball_does_not():
    """A skin of z = 1 - r^2 / 20, pressed by 0.2 mm: it stands above the block's face within a radius of 2 mm."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-4, 4, 41), np.linspace(-4, 4, 41)))
    points = np.column_stack([x, y, 1 - (x**2 + y**2) / 20])
    mesh = SimpleNamespace(points=points, boundaries={"skin": pv.PolyData(points).delaunay_2d().regular_faces})
    still = SimpleNamespace(mesh=mesh, displacement=np.zeros_like(points))
    frame = SimpleNamespace(axes=np.eye(3), origin=np.array([0.0, 0.0, 1.0]), local=lambda places: places - [0, 0, 1.0])
    flat = SimpleNamespace(thickness=40.0, gap=lambda xy: np.zeros(len(xy)))
    block = section.specimen_solid(flat, still, frame, press(indentation=0.2), 3.0, 1.0)
    x, y, z = block.points.T
    face = z < 5
    expected = 1 + np.maximum(-0.2, -(x**2 + y**2) / 20)
    assert z[face] == pytest.approx(expected[face], abs=5e-3)
    assert z.max() == pytest.approx(1.0 + section.DRAWN_THICKNESS - 0.2)
    assert np.ptp(x) == pytest.approx(6.0) and np.ptp(y) == pytest.approx(6.0)
    ball = section.specimen_solid(Sphere(0.2, radius=4.0), still, frame, press(indentation=0.2), 3.0, 2.0)
    assert ball.center == pytest.approx((0.0, 0.0, 1.0 + 4.0 - 2 * 0.2), abs=1e-5)
    assert np.linalg.norm(ball.points - np.array(ball.center), axis=1) == pytest.approx(4.0, abs=1e-3)


def test_the_values_of_a_cut_are_strain_in_per_cent_or_stress_in_kpa():
    stress = np.array([[[3.0, 0.5, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, -1.0]]])
    field = SimpleNamespace(stress=stress)
    assert section.cell_values(field, FINGER, "xy") == pytest.approx([500.0])
    mises = math.sqrt(((3 - 1) ** 2 + (1 + 1) ** 2 + (3 + 1) ** 2) / 2 + 3 * 0.25)
    assert section.cell_values(field, FINGER, "mises") == pytest.approx([1000 * mises])
    points = np.array([[0.0, 0, 16], [1, 0, 16], [0, 1, 16], [0, 0, 17]])
    mesh = SimpleNamespace(points=points, tets=np.array([[0, 1, 2, 3]]))
    strain = np.diag([0.02, 0.5, 0.3])[None]
    along = section.cell_values(SimpleNamespace(mesh=mesh, strain=strain), FINGER, "strain")
    assert along == pytest.approx([2.0], rel=0.01), "near the apex the tangent is along x"
    # At 45 degrees of the interface the tangent falls with x: shear counts with its sign
    a, _, c = FINGER.shape.interface
    x, z = a * math.sqrt(0.5), c * math.sqrt(0.5)
    mesh = SimpleNamespace(points=np.array([[x, 0.0, z]]), tets=np.array([[0, 0, 0, 0]]))
    normal = np.array([x / a**2, z / c**2]) / math.hypot(x / a**2, z / c**2)
    strain = np.array([[[0.02, 0, 0.01], [0, 0.5, 0], [0.01, 0, 0.03]]])
    (along,) = section.cell_values(SimpleNamespace(mesh=mesh, strain=strain), FINGER, "strain")
    expected = 0.02 * normal[1] ** 2 + 0.03 * normal[0] ** 2 - 2 * 0.01 * normal[0] * normal[1]
    assert along == pytest.approx(100 * expected)


def test_the_bone_of_a_dome_is_half_an_ellipse():
    low, high = np.array([-24.0, -30.0, 0.0]), np.array([24.0, 30.0, 20.0])
    (ring,) = section._bone_polygons(FINGER, SimpleNamespace(points=np.array([low, high])))
    a, _, c = FINGER.shape.bone
    curved = ring[:, 2] > 0.05
    assert (ring[curved, 0] / a) ** 2 + (ring[curved, 2] / c) ** 2 == pytest.approx(1, abs=0.01)
    assert np.ptp(ring[:, 0]) == pytest.approx(2 * a, rel=0.01) and ring[:, 2].min() >= 0 and (ring[:, 1] == 0).all()


# ---- The strain picture


def test_the_strain_picture_names_values_and_scale(made_up_parts):
    found, one = reduced()
    figure = view.strain_figure(None, found, one, SPECIMEN, FINGER)
    axes, bar = figure.axes
    values = next(item for item in axes.collections if item.get_array() is not None)
    assert list(values.get_array()) == [-1.0, 2.0, 4.6] and values.get_clim() == (-5.0, 5.0)
    said = texts(figure)
    assert "g3\n+1,500 µε\n(+0.15 %)" in said and "g1\n−100 µε\n(−0.01 %)" in said and "bone" in said
    assert "0.2 MPa\nblock 4 mm thick" in said
    assert said[-2:] == [] or any(
        "0.5 N on a 0.2 MPa block 4 mm thick: $S_d$ of the readings 577 µε" in t for t in said
    )
    detail = "indentation 0.75 mm, contact 25.1 mm² (dashed); friction 0; true scale"
    assert detail in said and [tick.get_text() for tick in bar.get_xticklabels()] == ["−5", "−2.5", "0", "+2.5", "+5"]
    bone, block = (next(text for text in axes.texts if word in text.get_text()) for word in ("bone", "block"))
    assert bone.get_position() == pytest.approx((0.0, 2 / 3 - 5.5), abs=0.01)
    assert block.get_position() == pytest.approx((0.0, 12.0 - 5.5), abs=0.01)
    lines = [(line.get_linestyle(), line.get_linewidth()) for line in axes.lines[:3]]
    assert lines == [("-", view.style.THIN), ("-", view.style.THICK), ("--", view.style.THICK)]
    assert axes.lines[1].get_xydata() == pytest.approx(np.array([[x - 1, -0.5] for x in (-6, -3, 0, 3, 6)]), abs=0.01)
    below = next(text for text in axes.texts if text.get_text().startswith("g3"))
    # The picture shows -3 to 14 mm of z, and its middle is the zero of the axes
    assert below.get_position() == pytest.approx((0.0, 5.0 - 5.5 - strain_field.LABEL_MM), abs=0.01)


def test_a_narrow_picture_has_readings_in_thousands(made_up_parts):
    found, one = reduced()
    figure = view.strain_figure(None, found, one, SPECIMEN, FINGER, width=view.style.NARROW_IN, scale=3.0)
    said = texts(figure)
    assert "g3\n+1.5" in said and any("displacements drawn 3 times as large" in " ".join(t.split()) for t in said)
    assert any("readings in 10³ µε" in " ".join(t.split()) for t in said)
    assert figure.get_figwidth() == view.style.NARROW_IN


def test_a_press_off_the_apex_and_one_that_is_too_coarse_say_so(made_up_parts):
    found, one = reduced(at=(2.0, -3.0))
    figure = view.strain_figure(None, found, press(resolved=False, sd=1.0), SPECIMEN, FINGER, shown="xz")
    said = words(figure)
    assert "touched (+) at x 2, y -3 mm, seen from +y" in said and "mesh too coarse for this press" in said
    assert "shear stress xz (kPa)" in said and "(+0.15 %)" not in said
    marks = [line for line in figure.axes[0].lines if line.get_marker() == "+"]
    assert len(marks) == 1
    assert strain_field.shown_words("mises") == "von Mises stress (kPa)"
    assert strain_field.shown_words("zz") == "stress zz (kPa): red is tension, blue compression"


@pytest.mark.parametrize("y, side", [(-0.5, -1), (0.0, 1), (0.5, 1)])
def test_the_half_with_the_touch_is_seen_from_the_other_side(made_up_parts, y, side):
    found, one = reduced(at=(2.0, y))
    assert strain_field.side_of(found) == side
    figure = view.strain_figure(None, found, one, SPECIMEN, FINGER)
    assert ("seen from +y" in words(figure)) == (side < 0)


def test_two_presses_have_their_facts_above_them(made_up_parts):
    found, one = reduced()
    beside = view.Scene(None, press(modulus=0.9, sd=99.0), SimpleNamespace(modulus=0.9, words="ball"))
    figure = view.strain_figure(None, found, one, SPECIMEN, FINGER, beside=beside)
    said = texts(figure)
    assert sum("contact 25.1 mm² (dashed)" in t for t in said) == 2
    assert any("0.5 N on 0.2 MPa and on 0.9 MPa: $S_d$ of the readings 577 and 99 µε" in t for t in said)
    assert len(figure.axes) == 3


def test_drawn_refuses_another_finger_and_an_unknown_quantity():
    found, one = reduced()
    scene = view.Scene(None, one, SPECIMEN)
    with pytest.raises(InputError, match="must be strain or, of the stress"):
        strain_field.drawn(scene, found, FINGER, "up")
    found.finger_sha256 = "other"
    with pytest.raises(InputError, match="not made from this design"):
        strain_field.drawn(scene, found, FINGER)


@pytest.mark.parametrize("bar", [[(0, 0), (2, 0)], [(2, 0), (0, 0)], [(0, 0), (1, 1)]])
def test_a_label_is_below_its_bar(bar):
    normal = strain_field._inward(np.array(bar, float))
    assert normal[1] < 0 and np.linalg.norm(normal) == pytest.approx(1.0)
    assert normal @ (np.array(bar[1]) - bar[0]) == pytest.approx(0.0)


# ---- The page that can be turned


def test_the_turning_page_has_all_presses_and_shows_the_last(made_up_parts, monkeypatch):
    go = pytest.importorskip("plotly.graph_objects")
    kept = []
    monkeypatch.setattr(go.Figure, "to_html", lambda self, **how: kept.append(self) or "<head></head>")
    found, one = reduced()
    scenes = [view.Scene(None, each, SPECIMEN) for each in (press(force=0.25), one)]
    page = turning.strain_html(scenes, found, FINGER)
    (figure,) = kept
    shown = [trace.visible for trace in figure.data]
    half = len(shown) // 2
    assert shown == [False] * half + [True] * half and 'name="viewport"' in page
    steps = figure.layout.sliders[0].steps
    assert [step.label for step in steps] == ["0.25 N", "0.5 N"] and figure.layout.sliders[0].active == 1
    assert list(steps[0].args[0]["visible"]) == [True] * half + [False] * half
    assert "0.5 N on a 0.2 MPa block 4 mm thick" in figure.layout.title.text and "577 µε" in figure.layout.title.text
    assert figure.layout.coloraxis.cmax == -figure.layout.coloraxis.cmin == 5.0
    assert figure.layout.coloraxis.colorbar.title.text == "strain along the layers (%)"
    face = figure.data[0]
    assert list(face.intensity) == pytest.approx([-1.0, 2.0, 4.6]) and list(face.x) == [-10.0, 10.0, 0.0]
    assert (list(face.i), list(face.j), list(face.k)) == ([0], [1], [2])
    grids, names = figure.data[half - 2], figure.data[half - 1]
    assert list(names.text) == ["g1", "g2", "g3", "g4", "g5"]
    assert grids.hovertext[8] == "g3: reading +1,500 µε<br>strain +0.15 %"
    # Gauges and names lie in front of the cut, which is seen from -y
    assert names.y[0] == pytest.approx(-turning.NAMES_MM) and grids.y[0] == pytest.approx(-turning.LIFTED_MM)
    eye = figure.layout.scene.camera.eye
    assert eye.y < 0 and eye.z > 0
    low, high = figure.layout.scene.zaxis.range
    assert low == pytest.approx(-3 - 2 * turning.NAMES_MM, abs=0.01) and high == pytest.approx(14 + 4.0, abs=0.01)


# ---- Receptive fields


def test_a_receptive_field_is_in_microstrain_per_millinewton(bump, monkeypatch):
    monkeypatch.setattr(receptive_field, "use_offscreen_window", lambda: False)
    figure = view.receptive_figure(bump, FINGER, "g3")
    axes, bar = figure.axes
    values = axes.collections[0].get_array()
    assert values.min() == pytest.approx(-250.0) and axes.collections[0].get_clim() == (-300.0, 300.0)
    said = texts(figure)
    assert "Receptive field of gauge g3" in said and bar.get_xlabel().endswith("(µε per mN)")
    assert any(t.startswith("strongest −250 µε/mN at x 0, y 0 mm") for t in said)
    chosen = [text for text in axes.texts if text.get_weight() == "bold"]
    assert [text.get_text() for text in chosen] == ["g3"] and chosen[0].get_position()[0] == pytest.approx(0, abs=1e-9)
    with pytest.raises(InputError, match="no gauge 'g9'"):
        view.receptive_figure(bump, FINGER, "g9")


@pytest.mark.parametrize("small, columns", [(False, 5), (True, 2)])
def test_maps_of_all_gauges_have_one_scale(bump, small, columns):
    figure = view.receptive_fields_figure(bump, FINGER, small=small)
    maps = [axes for axes in figure.axes if axes.get_xlabel() == "x (mm)"]
    assert [axes.get_title(loc="left") for axes in maps][1:3] == ["g2: +250 µε/mN", "g3: −250 µε/mN"]
    assert {axes.collections[0].get_clim() for axes in maps} == {(-300.0, 300.0)}
    assert maps[0].get_gridspec().ncols == columns
    colours = [line.get_color() for line in maps[1].lines[1::2]]
    assert [colour == view.style.GAUGE_COLOR for colour in colours] == [False, True, False, False, False]
    assert np.mean(maps[1].lines[2].get_xdata()) == pytest.approx(-8, abs=2)
