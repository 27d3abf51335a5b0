"""The triangles of the section: where its rows and columns lie, how they grow, and what its ridges look like."""

import math
from dataclasses import replace

import numpy as np
import pytest

from papilla import Dome, Finger, Layer, Slab, Surfaces
from papilla.core.errors import InputError
from papilla.mesh.layered import BONE, INNER, OUTER
from papilla.mesh.section import build_section, patch_half_width, section_finger
from papilla.model.finger import Gauge, Ridges

SKIN, INTERFACE, CORE = (24.0, 20.0), (21.0, 17.0), (10.0, 6.0)
"""Semi-axes of the default finger's section in mm."""


@pytest.fixture
def finger():
    return Finger.default()


def on(points, axes):
    """Mask of the points on an ellipse of these semi-axes."""
    return np.abs(((points / axes) ** 2).sum(axis=1) - 1) < 1e-9


def steps_along(points, axes):
    """Steps of the ellipse parameter between neighbouring points on an ellipse, from left to right."""
    row = points[on(points, axes)]
    return np.diff(np.sort(np.arctan2(row[:, 0] / axes[0], row[:, 1] / axes[1])))


def growth(steps):
    """Largest ratio of two neighbouring steps."""
    return max(max(a / b, b / a) for a, b in zip(steps[:-1], steps[1:], strict=True))


def test_the_patch_has_even_elements_of_the_size_that_was_asked_for(finger):
    section = build_section(replace(finger, ridges=None), size_mm=0.25)
    assert section.half_width == patch_half_width(finger) == 12.0, "half of the skin's half width"
    assert (section.spans[1:, 0] == section.spans[:-1, 1]).all(), "one unbroken line"
    ends = section.points[section.spans]
    assert on(ends.reshape(-1, 2), SKIN).all()
    assert np.diff(ends[:, :, 0], axis=1) == pytest.approx(0.25) and len(section.spans) == 96
    assert (ends[0, 0, 0], ends[-1, 1, 0]) == pytest.approx((-12, 12))
    odd = build_section(replace(finger, patch_radius=1.3, ridges=None), size_mm=0.25)
    assert len(odd.spans) == 12, "a size that does not divide the patch is made smaller"
    narrow = build_section(replace(finger, patch_radius=0.3, ridges=None), size_mm=0.5)
    assert len(narrow.spans) == 8 and narrow.half_width == 0.3, "four elements on either side at least"


def test_columns_grow_towards_the_base_by_less_than_a_third_and_stay_short(finger):
    section = build_section(replace(finger, ridges=None), size_mm=0.25)
    steps = steps_along(section.points, SKIN)
    outside = steps[: (len(steps) - 96) // 2]
    assert steps == pytest.approx(steps[::-1]) and steps.sum() == pytest.approx(math.pi)
    # The last elements of the patch are the first of the series
    assert growth([*outside, steps[len(outside)]]) < 1.31 and 0.8 < outside[-1] / steps[len(outside)] < 1.31
    assert 0.08 < outside[0] < 0.1 + 1e-9 and (np.diff(outside) < 1e-12).all()
    for axes in (INTERFACE, CORE):
        assert steps_along(section.points, axes) == pytest.approx(steps), "columns keep their parameter"


@pytest.mark.parametrize("size", [0.1, 0.3])
def test_rows_grow_inwards_by_less_than_a_third(finger, size):
    section = build_section(replace(finger, ridges=None), size_mm=size)
    middle = np.sort(section.points[np.abs(section.points[:, 0]) < 1e-9, 1])[::-1]
    assert middle[0] == 20.0 and middle[-1] == 6.0 and np.isclose(middle, 17.0).sum() == 1
    steps = -np.diff(middle)
    skin, soft = steps[: int(np.flatnonzero(np.isclose(middle, 17.0))[0])], steps[len(steps[middle[1:] > 17 - 1e-9]) :]
    assert skin.sum() == pytest.approx(3) and soft.sum() == pytest.approx(11)
    assert 0.7 * size < skin[0] <= size * 1.0001 and growth(skin) < 1.3001 and growth(soft) < 1.3001
    assert skin.max() <= 0.75 and 0.7 * skin[-1] < soft[0] <= skin[-1] * 1.0001 and 1 < soft.max() <= 1.5


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
    assert ((section.layer == INNER) == inside).all() and set(section.layer.tolist()) == {OUTER, INNER}
    clamped = np.zeros(len(section.points), dtype=bool)
    clamped[section.base] = True
    assert (clamped == ((section.points[:, 1] == 0) | on(section.points, CORE))).all()
    boned = build_section(replace(finger, bone=Layer(3000.0, 0.35), ridges=None), size_mm=0.4)
    inside = ((boned.points[boned.triangles].mean(axis=1) / CORE) ** 2).sum(axis=1) < 1
    assert ((boned.layer == BONE) == inside).all()
    assert (boned.points[boned.base, 1] == 0).all() and (boned.points[:, 1] == 0).sum() == len(boned.base)
    assert (np.hypot(*boned.points.T) < 1e-9).sum() == 1, "one point in the middle, where all columns meet"


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
    # Columns between two ridges, and rows of a ridge, are as short
    skin = section.points[on(section.points, SKIN)][:, 0]
    assert np.diff(np.sort(skin[np.abs(skin) <= 10.6 + 1e-9])).max() <= 0.15 + 1e-9
    standing = section.points[np.abs(section.points[:, 0]) < 1e-9, 1]
    assert np.sort(standing[standing > 20]) == pytest.approx([20.125, 20.25, 20.375, 20.5])
    assert (section.layer[section.points[section.triangles][:, :, 1].max(axis=1) > 20] == OUTER).all()
    corners = section.points[section.triangles]
    area = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 2
    assert area[section.layer == OUTER].sum() == pytest.approx(np.pi / 2 * (24 * 20 - 21 * 17) + 11 * 0.6, rel=4e-3)
    assert ((section.points[section.base, 1] == 0) | on(section.points[section.base], CORE)).all()
    coarse = build_section(ridged, size_mm=2.0)
    skin = coarse.points[on(coarse.points, SKIN)][:, 0]
    assert np.sort(skin[(skin > 0.5) & (skin < 1.5)]) == pytest.approx([0.6, 1.0, 1.4]), "two elements between ridges"
    assert len(coarse.spans) == 11 * 4, "four elements across a ridge at least"
    assert np.sum((np.abs(coarse.points[:, 0]) < 1e-9) & (coarse.points[:, 1] > 20)) == 2, "and two up"


def test_ridges_need_room_for_three(finger):
    three = build_section(replace(finger, ridges=Ridges(11.0, 1.0, 0.3)), size_mm=0.5)
    assert len(np.unique(three.spans)) == 3 * 5
    with pytest.raises(InputError, match="ridge pitch 11.6 mm leaves fewer than three ridges"):
        build_section(replace(finger, ridges=Ridges(11.6, 1.0, 0.3)), size_mm=0.5)


def test_a_dome_is_cut_at_y_0_and_a_surface_file_is_refused(finger):
    assert isinstance(finger.shape, Dome)
    cut = section_finger(finger)
    assert cut.shape == Slab(SKIN, INTERFACE, CORE) and replace(cut, shape=finger.shape) == finger
    assert section_finger(cut) == cut
    own = Finger("own", Surfaces("a.stl", "b.stl", "c.stl"), finger.outer, finger.inner, (Gauge("g", x_mm=0.0),))
    with pytest.raises(InputError, match="surface files have no exact section"):
        section_finger(own)


def test_five_hundred_nodes_of_contact_are_enough_and_more_are_too_many(finger):
    smooth = replace(finger, ridges=None)
    assert len(np.unique(build_section(smooth, size_mm=12 / 249).spans)) == 499
    with pytest.raises(InputError, match="501 nodes in the contact patch, 500 at most"):
        build_section(smooth, size_mm=12 / 250)
