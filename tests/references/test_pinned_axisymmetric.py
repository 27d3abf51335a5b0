"""Presses of the axisymmetric reference on few cells give the numbers that they gave when slow tests agreed.

On fine cells they are compared with Hertz, Mossakovskii and Spence by slow tests. `python
tests/references/test_pinned_axisymmetric.py` (with tests/support on the path) writes the present numbers, for a change
that moves them on purpose.
"""

import itertools
import math
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pinned
import pytest

from papilla.core.errors import SolverError
from papilla.references.axisymmetric import presses
from papilla.references.axisymmetric.bodies import Bodies, Rubber, Shape
from papilla.references.axisymmetric.contact import Contact, nearest
from papilla.references.axisymmetric.presses import Rings, press_path
from papilla.verify.revolution import FINGER

KEPT = Path(__file__).with_name("pinned_axisymmetric.json")
COARSE = Shape(cells=(12, 2, 2, 3))
GAUGES = FINGER.gauges


def bodies(linear: bool = False, shape: Shape = COARSE) -> Bodies:
    """Two soft layers on a block."""
    layers = [Rubber(modulus, 0.4999, linear) for modulus in (0.136, 0.034)]
    return Bodies(shape, [*layers, Rubber(0.51, 0.495, linear)])


def _path(friction: float, **how):
    """The path, and the contact's points where a press with other steps would begin."""
    return press_path(bodies(), GAUGES, 0.02, friction, growth=1.6, **how)


def _rings(patch):
    rings = Rings(bodies(True, replace(COARSE, cells=(40, 3, 4, 5))), GAUGES)
    return [rings.press(force) for force in (0.1, 0.5)], rings.mass, rings.gap, rings.radius


def _anchors(patch):
    """Where anchors are expected, begun and committed."""
    body = bodies()
    contact, found = Contact(body, 0.2), []
    state = np.zeros(body.unknowns)
    heights = state[: 2 * body.nodes].reshape(-1, 2)
    for depth in (0.05, 0.12):
        heights[body.parameters[1] > 5, 1] = depth
        heights[:, 0] = 0.002 * body.mesh.doflocs[0] * depth
        found += [contact.begin(state), contact.anchor.copy()]
        contact.forces(state)
        contact.commit(state, depth)
        contact.expect(depth + 0.05)
        found += [contact.anchor.copy(), contact.touches.copy(), contact.slides.copy(), contact.shear_moment(state)]
    force, matrix = contact.forces(state)
    return found, force, matrix @ np.cos(np.arange(body.unknowns))


def _nearest(patch):
    places = np.array([[0.0, 0.0], [1.0, 0.1], [0.5, 0.02], [2.0, 0.5], [1.5, 0.25]])
    masters = np.array([[0, 1, 2], [1, 3, 4]])
    points = np.array([[-0.2, 1.0], [0.4, 0.3], [0.99, 0.8], [1.01, -1.0], [1.7, 0.1], [3.0, 0.0]])
    return nearest(points, places, masters)


def _steps(patch):
    """Which indentations are tried where some have no equilibrium: a first one, and some on the way."""
    asked, refused = [], iter([True, False, False, False, False, True, True, False, True, False])

    def equilibrium(bodies, contact, state, ahead, aim):
        asked.append((aim, float(ahead.sum()), contact.friction))
        if next(refused, False):
            raise SolverError("no equilibrium")
        return np.full(4, 0.01 * aim)

    class Made:
        slave, touches, reference = np.array([0, 1, 1]), np.array([True, False]), np.array([[0.5, 0], [0.7, 0]])

        def __init__(self, body, friction):
            self.friction, self.begun = friction, 0

        def expect(self, aim):
            asked.append(("expected", aim))

        def begin(self, found):
            self.begun += 1
            return self.begun < 3

        def commit(self, state, now):
            asked.append(("committed", now))

        def forces(self, state):
            return [state]

        def shear_moment(self, state):
            return float(state[0])

    patch.setattr(presses, "_equilibrium", equilibrium)
    patch.setattr(presses, "Contact", Made)
    patch.setattr(presses, "Readout", lambda body, gauges: lambda moved: moved[:1])
    body = SimpleNamespace(unknowns=4, nodes=2, shape=SimpleNamespace(outer=(24.0, 20.0)), displacement=np.copy)
    found = press_path(body, GAUGES, 0.012, 0.3, first=0.01, growth=1.5)
    refused = itertools.repeat(True)
    with pytest.raises(SolverError):
        press_path(body, GAUGES, 0.02, 0.0, growth=1.5)
    return found, asked


PARTS = {
    "without friction": lambda patch: _path(0.0),
    "slipping": lambda patch: _path(0.1),
    "stuck": lambda patch: _path(math.inf, first=0.02),
    "rings": _rings,
    "anchors": _anchors,
    "nearest": _nearest,
    "steps": _steps,
}


@pytest.mark.parametrize("part", PARTS)
def test_a_press_gives_its_numbers(part, monkeypatch):
    assert pinned.same(PARTS[part](monkeypatch), KEPT, part) == []


if __name__ == "__main__":
    pinned.update(PARTS, KEPT, sys.argv[1:])
