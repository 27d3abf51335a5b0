"""The triangles of the section: their layers, their base, their mirror image, and its ridges."""

from dataclasses import replace

import numpy as np
import pytest

from papilla import Dome, Finger, Layer, Slab, Surfaces
from papilla.core.errors import InputError
from papilla.mesh.layered import BONE_LAYER, INNER_LAYER, OUTER_LAYER
from papilla.mesh.section import build_section, section_finger
from papilla.model.finger import Gauge, Ridges

SKIN, INTERFACE, CORE = (24.0, 20.0), (21.0, 17.0), (10.0, 6.0)


@pytest.fixture
def finger():
    return Finger.default()


def on(points, axes):
    """Mask of the points on an ellipse of these semi-axes."""
    return np.abs(((points / axes) ** 2).sum(axis=1) - 1) < 1e-9


def test_triangles_turn_to_the_left_and_mirror_themselves(finger):
    section = build_section(finger, size_mm=0.5)
    corners = section.points[section.triangles]
    assert np.linalg.det(corners[:, 1:] - corners[:, :1]).min() > 0
    # A diagonal that is not mirrored makes the answer to a force from the right another one than from the left
    cells = {tuple(sorted(map(tuple, cell.round(9).tolist()))) for cell in corners}
    mirrored = {tuple(sorted((-x + 0.0, z) for x, z in cell)) for cell in cells}
    assert {tuple((x + 0.0, z) for x, z in cell) for cell in cells} == mirrored
    assert len(np.unique(section.triangles)) == len(section.points), "each point is used"
    edges = np.sort(section.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    assert set(counts.tolist()) == {1, 2}


def test_layers_lie_between_their_ellipses_and_the_base_is_what_is_clamped(finger):
    section = build_section(replace(finger, ridges=None), size_mm=0.4)
    inside = ((section.points[section.triangles].mean(axis=1) / INTERFACE) ** 2).sum(axis=1) < 1
    assert (section.layer == np.where(inside, INNER_LAYER, OUTER_LAYER)).all()
    clamped = np.isin(np.arange(len(section.points)), section.base)
    assert (clamped == ((section.points[:, 1] == 0) | on(section.points, CORE))).all()
    boned = build_section(replace(finger, bone=Layer(3000.0, 0.35), ridges=None), size_mm=0.4)
    inside = ((boned.points[boned.triangles].mean(axis=1) / CORE) ** 2).sum(axis=1) < 1
    assert ((boned.layer == BONE_LAYER) == inside).all()
    assert (boned.points[boned.base, 1] == 0).all() and (boned.points[:, 1] == 0).sum() == len(boned.base)
    assert (np.hypot(*boned.points.T) < 1e-9).sum() == 1, "one point in the middle, where all columns meet"


def test_rows_and_columns_grow_away_from_the_patch(finger):
    """Rows from `size_mm` at the skin, by 1.3, up to 0.75 mm in the outer and 1.5 mm in the inner layer; columns
    evenly spaced in x in the patch, then growing to 0.1 rad."""
    smooth = replace(finger, ridges=None, patch_radius=9.0)
    section = build_section(smooth, size_mm=0.2)
    assert section.half_width == 9.0 and len(section.spans) == 90
    assert np.diff(section.points[section.spans][:, :, 0], axis=1) == pytest.approx(0.2)
    assert build_section(replace(smooth, patch_radius=15.0), size_mm=0.2).half_width == 12.0
    assert build_section(smooth).points[build_section(smooth).spans[:, 1], 0].size == 180
    assert len(build_section(smooth, size_mm=50.0).spans) == 8
    depth = 20 - np.sort(section.points[np.abs(section.points[:, 0]) < 1e-9, 1])[::-1]
    outer, inner = depth[depth <= 3 + 1e-9], depth[depth >= 3 - 1e-9]
    for places, first, most in ((outer, 0.2, 0.75), (inner, outer[-1] - outer[-2], 1.5)):
        steps = np.diff(places)
        scale = steps[0] / first
        grown = np.minimum(first * 1.3 ** np.arange(len(steps)), most)
        assert steps == pytest.approx(scale * grown) and 1 - most / (places[-1] - places[0]) <= scale <= 1
    skin = section.points[on(section.points, SKIN)]
    angle = np.sort(np.arcsin(np.clip(skin[:, 0] / 24, -1, 1)))
    assert angle == pytest.approx(-angle[::-1]) and angle[-1] == pytest.approx(np.pi / 2)
    beyond = angle[angle > np.arcsin(9 / 24) - 1e-9]
    steps = np.diff(beyond)
    grown = np.minimum(steps[0] * 1.3 ** np.arange(len(steps)), steps.max())
    assert steps == pytest.approx(grown) and 0.08 < steps.max() <= 0.1


def test_ridges_stand_at_their_pitch_with_flat_tops_of_their_width(finger):
    ridged = replace(finger, ridges=Ridges(2.0, 1.2, 0.5))
    section = build_section(ridged, size_mm=0.15)
    left, right = (section.points[section.spans[:, side]] for side in (0, 1))
    breaks = np.flatnonzero(section.spans[1:, 0] != section.spans[:-1, 1]) + 1
    tops = np.split(np.arange(len(left)), breaks)
    # The last of the ridges at 0, +-2, +-4 ... mm that lies whole within 12 mm has its middle at 10 mm
    assert len(tops) == 11 and section.half_width == pytest.approx(10.6)
    for number, rows in enumerate(tops):
        middle = 2.0 * (number - 5)
        assert (left[rows[0], 0], right[rows[-1], 0]) == pytest.approx((middle - 0.6, middle + 0.6))
        assert right[rows, 0] - left[rows, 0] == pytest.approx(0.15) and len(rows) == 8
        foot = 20 * np.sqrt(1 - (left[rows, 0] / 24) ** 2)
        assert left[rows, 1] == pytest.approx(foot + 0.5)
    skin = section.points[on(section.points, SKIN)][:, 0]
    assert np.diff(np.sort(skin[np.abs(skin) <= 10.6 + 1e-9])).max() <= 0.15 + 1e-9
    standing = section.points[np.abs(section.points[:, 0]) < 1e-9, 1]
    assert np.sort(standing[standing > 20]) == pytest.approx([20.125, 20.25, 20.375, 20.5])
    assert (section.layer[section.points[section.triangles][:, :, 1].max(axis=1) > 20] == OUTER_LAYER).all()
    corners = section.points[section.triangles]
    area = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 2
    expected = np.pi / 2 * (24 * 20 - 21 * 17) + 11 * 0.6
    assert area[section.layer == OUTER_LAYER].sum() == pytest.approx(expected, rel=4e-3)
    coarse = build_section(ridged, size_mm=2.0)
    skin = coarse.points[on(coarse.points, SKIN)][:, 0]
    assert np.sort(skin[(skin > 0.5) & (skin < 1.5)]) == pytest.approx([0.6, 1.0, 1.4]), "two elements between ridges"
    assert len(coarse.spans) == 11 * 4, "four elements across a ridge at least"
    assert np.sum((np.abs(coarse.points[:, 0]) < 1e-9) & (coarse.points[:, 1] > 20)) == 2, "and two up"


def test_a_dome_is_cut_at_y_0_and_a_surface_file_is_refused(finger):
    assert isinstance(finger.shape, Dome)
    cut = section_finger(finger)
    assert cut.shape == Slab(SKIN, INTERFACE, CORE) and replace(cut, shape=finger.shape) == finger
    assert section_finger(cut) == cut
    beside = replace(finger.gauges[0], y_mm=3.0)
    with pytest.raises(InputError, match="gauge g1 sits at y_mm 3: a sliding scene knows only the section"):
        build_section(replace(finger, gauges=(beside,)))
    with pytest.raises(InputError, match="500 at most: take a larger size_mm"):
        build_section(replace(finger, ridges=None), size_mm=0.01)
    own = Finger("own", Surfaces("a.stl", "b.stl", "c.stl"), finger.outer, finger.inner, (Gauge("g", x_mm=0.0),))
    with pytest.raises(InputError, match="surface files have no exact section"):
        section_finger(own)
