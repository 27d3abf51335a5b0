"""The edge that is drawn around a contact: its area, its axes and their direction."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from papilla.fem import Press, ReducedFinger
from papilla.fem.reduction.patch import Patch
from papilla.view.contact_map import Profile, contact_edge, contact_profile

LONG, SHORT = 4.0, 1.6
"""Semi-axes in mm."""


def contact(shade, images: int, area: float, fidelity: str = "hertz", step: float = 0.1):
    """A patch of 12 x 12 mm with a pressure `shade(x, y)` in MPa, whole or of two mirrored halves, and its press."""
    x, y = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-6, 6, round(12 / step) + 1)] * 2))
    if images == 2:
        x, y = x[x >= 0], y[x >= 0]
    mass = np.full(len(x), step**2) * np.where((x == 0) & (images == 2), 0.5, 1.0)
    xy, pressure, none = np.column_stack([x, y]), shade(x, y), np.zeros((len(x), len(x)), np.float16)
    mirror = np.array([[1.0, 1.0], [-1.0, 1.0]])[:images]
    patch = Patch(xy, Delaunay(xy).simplices, mass, np.zeros(len(x)), np.zeros(len(x), bool), mirror)
    rows = np.zeros((2, 1, len(x)))
    reduced = ReducedFinger(
        finger_name="made up", finger_sha256="", mesh_sha256="", mesh_size_mm=step, at=(0.0, 0.0), gauge_names=("g",),
        outer_modulus=1.0, patch=patch, compliance=none, half_space=none, rows=rows, weights=np.ones((2, 1)),
        layers=np.array([[1e6, 1.0]]),
    )  # fmt: skip
    press = Press(
        force=images * float(mass @ pressure), modulus=1.0, fidelity=fidelity, indentation=1.0, contact_area=area,
        peak_pressure=float(pressure.max()), values=np.zeros((2, 1)), weights=np.ones((2, 1)), force_balance=0.0,
        status="", resolved=True, pressure=pressure, active=pressure > 0,
    )  # fmt: skip
    return reduced, press


@pytest.mark.parametrize("images, turn", [(1, 0.5), (1, -1.2), (2, 0.0)])
@pytest.mark.parametrize("sharpness", [0.5, 0.8])
def test_an_elliptic_contact_is_drawn_with_its_own_axes(images, turn, sharpness):
    """Hertz's pressure over an ellipse (Johnson 1985, 4.25), or a sharper one: the drawn line is its edge, and the
    shade has its force and its peak."""

    def across(x, y):
        return (x * np.cos(turn) + y * np.sin(turn)) / LONG, (y * np.cos(turn) - x * np.sin(turn)) / SHORT

    def shade(x, y):
        return np.maximum(1 - np.square(across(x, y)).sum(axis=0), 0) ** sharpness

    reduced, press = contact(shade, images, np.pi * LONG * SHORT)
    (line,) = contact_edge(reduced, press)
    assert np.abs(across(*line.T)).max(axis=1) == pytest.approx([1, 1], rel=0.01)
    assert np.square(across(*line.T)).sum(axis=0) == pytest.approx(1, abs=0.03)
    profile, patch = contact_profile(reduced, press), reduced.patch
    assert profile(np.zeros((1, 2)))[0] == pytest.approx(press.peak_pressure, rel=0.02)
    assert images * patch.mass @ profile(patch.xy) == pytest.approx(press.force, rel=0.02)
    assert np.abs(profile(patch.xy) - press.pressure).mean() < 0.01


def test_a_contact_that_is_no_ellipse_has_the_contour_of_its_pressure():
    """A cross of two bars, 1 mm and 5 mm: no ellipse, so the line is where 2 % of the peak are."""

    def cross(x, y):
        return np.maximum(np.maximum(1 - x**2, 0) * (np.abs(y) < 5), np.maximum(1 - y**2, 0) * (np.abs(x) < 5))

    reduced, press = contact(cross, 1, 36.0, "contact", step=0.2)
    assert contact_profile(reduced, press) is None
    line = np.concatenate(contact_edge(reduced, press))
    assert np.abs(line).max() == pytest.approx(5, abs=0.3)
    inner = line[np.abs(line).max(axis=1) < 4]
    assert np.abs(inner).min(axis=1) == pytest.approx(0.99, abs=0.2)


def test_an_ellipse_beyond_the_patch_is_not_drawn():
    reduced, press = contact(lambda x, y: np.sqrt(np.maximum(1 - (x**2 + y**2) / 9, 0)), 1, 9 * 9 * np.pi, step=0.2)
    assert contact_profile(reduced, press) is None


def test_the_edge_of_an_ellipse_begins_at_its_first_axis():
    profile = Profile(np.array([1.0, 2.0]), np.array([[3.0, 0.0], [0.0, 5.0]]), 1.0, 0.0)
    edge = profile.edge()
    assert edge[[0, -1]] == pytest.approx(np.array([[4.0, 2.0]] * 2)) and edge[75] == pytest.approx([1.0, 7.0])
    # Hertz's pressure: sqrt(1 - r^2) of its peak
    peak, part, outside = profile(np.array([[1.0, 2.0], [1.0 + 3 * 0.6, 2.0], [1.0, 7.1]]))
    assert part == pytest.approx(0.8 * peak) and outside == 0
