"""The edge that is drawn around a contact: its area, its axes and their direction."""

from types import SimpleNamespace

import numpy as np
import pytest

from papilla.view.contact_map import contact_edge, contact_profile

LONG, SHORT, TURN = 4.0, 1.6, 0.5
"""Semi-axes in mm, and the angle of the long one from x in rad."""


@pytest.mark.parametrize("images", [1, 2])
def test_an_elliptic_contact_is_drawn_with_its_own_axes(images):
    """Hertz's pressure over an ellipse (Johnson 1985, 4.25): the drawn line is its edge."""
    x, y = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-6, 6, 121)] * 2))
    if images == 2:
        x, y = x[x >= 0], y[x >= 0]
    turn = TURN if images == 1 else 0.0
    along, across = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    pressure = np.sqrt(np.maximum(1 - (along / LONG) ** 2 - (across / SHORT) ** 2, 0))
    mass = np.full(len(x), 0.01) * np.where((x == 0) & (images == 2), 0.5, 1.0)
    mirror = np.array([[1.0, 1.0], [-1.0, 1.0]])[:images]
    patch = SimpleNamespace(xy=np.column_stack([x, y]), triangles=np.zeros((0, 3), int), mass=mass, images=mirror)
    reduced = SimpleNamespace(patch=patch, multiplicity=images)
    area, force = np.pi * LONG * SHORT, 2 / 3 * np.pi * LONG * SHORT
    press = SimpleNamespace(pressure=pressure, contact_area=area, force=force, peak_pressure=1.0, fidelity="hertz")
    (line,) = contact_edge(reduced, press)
    along = line[:, 0] * np.cos(turn) + line[:, 1] * np.sin(turn)
    across = line[:, 1] * np.cos(turn) - line[:, 0] * np.sin(turn)
    assert np.abs(along).max() == pytest.approx(LONG, rel=0.01)
    assert np.abs(across).max() == pytest.approx(SHORT, rel=0.01)
    assert (along / LONG) ** 2 + (across / SHORT) ** 2 == pytest.approx(1, abs=0.03)
    shade = contact_profile(reduced, press)(patch.xy)
    assert np.abs(shade - pressure).max() < 0.15 and np.abs(shade - pressure).mean() < 5e-3
    assert images * mass @ shade == pytest.approx(force, rel=1e-2)
