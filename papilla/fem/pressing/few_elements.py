"""A contact a few elements wide: what its nodes lose is read off the ellipse of least energy, which needs no nodes.

On meshes of the default size against an axisymmetric reference (docs/adr/0018) the error of `contact` falls with the
elements across the contact's radius, and that of `hertz` grows with the contact; at five elements they are the same.
"""

from time import perf_counter

import numpy as np

from papilla.fem.pressing.contact import contact_press, hertzian
from papilla.fem.pressing.press import Press, with_values
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.specimen import Specimen

EQUAL_ELEMENTS, STEEPNESS = 5, 10
"""Elements across the radius where ellipse and nodes count the same, and the power with which that changes."""

NEGLIGIBLE = 0.01
"""Weight of the ellipse below which it is not asked."""

SAME_CONTACT = {"contact_area": 0.1, "indentation": 0.03}
"""Differences of ellipse and nodes up to which both are the same contact: nodes lose up to 4 and 0.6 %."""


def sharpened(reduced: ReducedFinger, specimen: Specimen, found: Press) -> Press:
    """A press of `contact` by force with what its nodes lose; itself where it is wide, or no ellipse.

    What friction changes is left as the nodes have it: the ellipse knows none.
    """
    elements = float(np.sqrt(found.contact_area / np.pi)) / reduced.patch.mean_edge(found.active)
    weight = 1 / (1 + (elements / EQUAL_ELEMENTS) ** STEEPNESS)
    if weight < NEGLIGIBLE:
        return found
    scene = hertzian(reduced, specimen, found.force, None)
    if scene is None:
        return found
    nodes = found
    if found.friction:
        nodes = contact_press(reduced, specimen, found.force, None, found.active, perf_counter())
    shape = {
        "contact_area": float(np.pi * np.prod(scene.semi_axes)),
        "indentation": scene.indentation,
        "peak_pressure": scene.peak_pressure,
    }
    ratios = {name: value / getattr(nodes, name) for name, value in shape.items()}
    if any(abs(ratios[name] - 1) > limit for name, limit in SAME_CONTACT.items()):
        return found
    measures = {name: getattr(found, name) * ratio**weight for name, ratio in ratios.items()}
    return with_values(found, reduced.weights, found.values + weight * (scene.values - nodes.values), **measures)
