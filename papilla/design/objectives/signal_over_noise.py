"""Ratio of the gauges' signal to their noise."""

import numpy as np

from papilla.design.in_scene import DesignInScene
from papilla.design.objectives.registry import objective


@objective("signal_over_noise", "more", "1", "least S_d over the scene over the noise of a sample of it", gauges=2)
def signal_over_noise(design: DesignInScene) -> float:
    """Smallest ratio over forces, specimens and friction; the noise of S_d is that of a gauge over the root of their
    number."""
    noise = design.scene.gauge_noise_microstrain / np.sqrt(len(design.finger.gauges))
    return float(design.sd.min() / noise)
