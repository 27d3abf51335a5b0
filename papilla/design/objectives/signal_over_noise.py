"""Ratio of the gauges' signal to their noise."""

import numpy as np

from papilla.design.look import Look
from papilla.design.objectives.registry import objective


@objective("signal_over_noise", "more", "1", "least S_d over the scene over the noise of a sample of it", gauges=2)
def signal_over_noise(look: Look) -> float:
    """Smallest ratio over forces, specimens and friction; the noise of S_d is that of a gauge over the root of their
    number."""
    noise = look.scene.gauge_noise_microstrain / np.sqrt(len(look.finger.gauges))
    return float(look.sd.min() / noise)
