"""Sigma of ln E of the manufactured finger instead of its design: the worst over tolerances."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from papilla.design.geometry import geometry_map
from papilla.design.in_scene import DesignInScene
from papilla.design.objectives.registry import objective
from papilla.design.parameters import made
from papilla.design.places import moved
from papilla.design.scene import rms_or_worst
from papilla.finger import Finger


@objective("worst_over_tolerances", "less", "1", "sigma_gauges, the worst over the scene's tolerances", gauges=2)
def worst_over_tolerances(design: DesignInScene) -> float:
    """The worst of the design and of neighbours in which one tolerance each is at its limit.

    Gauges are shifted and turned with alternating signs, because a common shift equals a touch at another place.
    """
    found = [rms_or_worst(design.scene, one.sigma_gauges) for one in (design, *_neighbours(design))]
    return max(found)


def _neighbours(design: DesignInScene) -> Iterator[DesignInScene]:
    limits, finger = design.scene.tolerances, design.finger
    signs = np.where(np.arange(len(finger.gauges)) % 2, -1.0, 1.0)
    for side in (1.0, -1.0):
        for along, turn in ((limits.gauge_mm, 0.0), (0.0, limits.gauge_deg)):
            if along or (turn and design.geometry.places.turned):
                gauges = [
                    moved(gauge, finger.shape, side * sign * along, side * sign * turn)
                    for gauge, sign in zip(finger.gauges, signs, strict=True)
                ]
                yield replace(design, finger=replace(finger, gauges=tuple(gauges)))
        factor = (1 + limits.moduli) ** side
        if limits.moduli:
            for layer in ("outer", "inner"):
                yield replace(design, finger=_softer(finger, layer, factor))
    if limits.thickness_mm:
        yield from _thicker(design, limits.thickness_mm)


def _softer(finger: Finger, layer: str, factor: float) -> Finger:
    own = getattr(finger, layer)
    return replace(finger, **{layer: replace(own, modulus=factor * own.modulus)})


def _thicker(design: DesignInScene, change: float) -> Iterator[DesignInScene]:
    """Neighbours with a thicker and a thinner skin, which are other geometries."""
    for side in (change, -change):
        thickness = float(design.finger.shape.outer[-1]) - float(design.finger.shape.interface[-1]) + side
        skin = {"shape.skin_mm": thickness}
        other = geometry_map(made(design.geometry.finger, skin), design.geometry.places, design.geometry.finger)
        yield replace(design, finger=made(design.finger, skin), geometry=other)
