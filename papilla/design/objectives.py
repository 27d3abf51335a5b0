"""Objectives of studies: numbers that characterise a design in a scene, in `OBJECTIVES_BY_NAME` by the name that
studies use.

An objective is a function of a `DesignInScene` and a row of the table at the end.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

import numpy as np

from papilla.calibration import IDENTIFIABLE_SIGMA, NORMAL_FACTOR
from papilla.core.errors import InputError
from papilla.design.geometry import geometry_map
from papilla.design.in_scene import DesignInScene
from papilla.design.parameters import made
from papilla.design.places import moved
from papilla.design.scene import rms_or_worst

LESS_IS_BETTER, MORE_IS_BETTER = 1.0, -1.0
"""Whether less or more of an objective is better: a factor that makes smaller values better."""


@dataclass(frozen=True)
class Objective:
    """A number that characterises a design in a scene: sign (`LESS_IS_BETTER` or `MORE_IS_BETTER` is better), unit,
    description, smallest number of gauges, and function."""

    name: str
    sign: float
    unit: str
    words: str
    gauges: int
    of: Callable[[DesignInScene], float]


def force_at_depth(design: DesignInScene) -> float:
    """Interpolated between the forces of the scene's grid; raises `InputError` for a depth outside of their range."""
    force, modulus = design.scene.grid
    hardest = modulus == modulus.max()
    depth = design.depths[1][hardest]
    if not depth[0] <= design.scene.depth_mm <= depth[-1]:
        reached = f"{depth[0]:.3g} to {depth[-1]:.3g} mm"
        raise InputError(
            f"force_at_depth: depth_mm {design.scene.depth_mm:g} is outside what the forces reach, {reached}"
        )
    return float(np.exp(np.interp(np.log(design.scene.depth_mm), np.log(depth), np.log(force[hardest]))))


def identifiable_share(design: DesignInScene) -> float:
    """Share of the points of the scene whose sigma is below that of `SoftnessStatus.NOT_IDENTIFIABLE`."""
    return float(np.mean(design.sigma_sd < IDENTIFIABLE_SIGMA))


def largest_strain(design: DesignInScene) -> float:
    """Largest strain of a gauge at any place of the study, under the largest force on the hardest specimen, stuck or
    without friction."""
    force, modulus = np.array([design.scene.force_N[1]]), np.array([design.scene.modulus_MPa[1]])
    ends = [end.felt(force, modulus, *design.moduli).values for end in design.geometry.ends]
    return max(float(np.abs(felt[:, 0]).max()) for felt in ends)


def signal_over_noise(design: DesignInScene) -> float:
    """Smallest ratio over forces, specimens and friction; the noise of S_d is that of a gauge over the root of their
    number."""
    noise = design.scene.gauge_noise_microstrain / np.sqrt(len(design.finger.gauges))
    return float(design.sd.min() / noise)


def specimens_told_apart(design: DesignInScene) -> float:
    """One plus the range of ln E over the mean width of an interval; sigma is the rms over the forces of the scene."""
    sigma = np.sqrt(np.mean(design.sigma_gauges**2, axis=0))
    return 1.0 + float(np.trapezoid(1 / (2 * NORMAL_FACTOR * sigma), np.log(design.scene.points[1])))


def worst_over_tolerances(design: DesignInScene) -> float:
    """The worst of the design and of neighbours in which one tolerance each is at its limit.

    Gauges are shifted and turned with alternating signs, because a common shift equals a touch at another place.
    """
    return max(rms_or_worst(design.scene, neighbour.sigma_gauges) for neighbour in (design, *_neighbours(design)))


def _neighbours(design: DesignInScene) -> Iterator[DesignInScene]:
    limits, finger, geometry = design.scene.tolerances, design.finger, design.geometry
    signs = np.where(np.arange(len(finger.gauges)) % 2, -1.0, 1.0)
    for side in (1.0, -1.0):
        for along, turn in ((limits.gauge_mm, 0.0), (0.0, limits.gauge_deg)):
            if along or (turn and geometry.places.turned):
                gauges = [
                    moved(gauge, finger.shape, side * sign * along, side * sign * turn)
                    for gauge, sign in zip(finger.gauges, signs, strict=True)
                ]
                yield replace(design, finger=replace(finger, gauges=tuple(gauges)))
        factor = (1 + limits.moduli) ** side
        if limits.moduli:
            for name, layer in (("outer", finger.outer), ("inner", finger.inner)):
                softer: Any = {name: replace(layer, modulus=factor * layer.modulus)}
                yield replace(design, finger=replace(finger, **softer))
    # A thicker and a thinner skin are other geometries
    for change in (limits.thickness_mm, -limits.thickness_mm) if limits.thickness_mm else ():
        skin = {"shape.skin_mm": float(finger.shape.outer[-1]) - float(finger.shape.interface[-1]) + change}
        geometry_of_skin = geometry_map(made(geometry.finger, skin), geometry.places, geometry.finger)
        yield replace(design, finger=made(finger, skin), geometry=geometry_of_skin)


def _over_scene(channel: str) -> Callable[[DesignInScene], float]:
    """The worst or the rms over the scene, as the scene states, of a sigma of `DesignInScene`."""
    sigma = attrgetter(channel)
    return lambda design: rms_or_worst(design.scene, sigma(design))


_SIGMA = "expected sigma of ln E from {} over the scene"
OBJECTIVES_BY_NAME = {
    row[0]: Objective(*row)
    for row in (
        ("force_at_depth", LESS_IS_BETTER, "N", "force on the hardest specimen at the scene's depth_mm, stuck", 1,
         force_at_depth),
        ("identifiable_share", MORE_IS_BETTER, "1", "share of the scene where S_d tells E to less than half of it", 2,
         identifiable_share),
        ("largest_strain", LESS_IS_BETTER, "1", "largest strain of the interface, where gauges may lie, over the scene",
         1, largest_strain),
        ("sigma_force_depth", LESS_IS_BETTER, "1", _SIGMA.format("force and indentation"), 1,
         _over_scene("sigma_depth")),
        ("sigma_gauges", LESS_IS_BETTER, "1", _SIGMA.format("all gauges and force"), 2, _over_scene("sigma_gauges")),
        ("sigma_sd", LESS_IS_BETTER, "1", _SIGMA.format("S_d and force"), 2, _over_scene("sigma_sd")),
        ("signal_over_noise", MORE_IS_BETTER, "1", "least S_d over the scene over the noise of a sample of it", 2,
         signal_over_noise),
        ("specimens_told_apart", MORE_IS_BETTER, "1", "specimens whose 95 % intervals (all gauges) do not overlap", 2,
         specimens_told_apart),
        ("worst_over_tolerances", LESS_IS_BETTER, "1", "sigma_gauges, the worst over the scene's tolerances", 2,
         worst_over_tolerances),
    )
}  # fmt: skip
