"""Largest strain of the interface."""

import numpy as np

from papilla.design.in_scene import DesignInScene
from papilla.design.objectives.registry import objective


@objective("largest_strain", "less", "1", "largest strain of the interface, where gauges may lie, over the scene")
def largest_strain(design: DesignInScene) -> float:
    """Largest strain of a gauge at any place of the study, under the largest force on the hardest specimen, stuck or
    without friction."""
    force, modulus = np.array([design.scene.force_N[1]]), np.array([design.scene.modulus_MPa[1]])
    moduli = design.finger.outer.modulus, design.finger.inner.modulus
    return max(float(np.abs(end.felt(force, modulus, *moduli).values[:, 0]).max()) for end in design.geometry.ends)
