"""The share of the scene in which the modulus is identifiable."""

import numpy as np

from papilla.calibration import IDENTIFIABLE
from papilla.design.in_scene import DesignInScene
from papilla.design.objectives.registry import objective


@objective("identifiable_share", "more", "1", "share of the scene where S_d tells E to less than half of it", gauges=2)
def identifiable_share(design: DesignInScene) -> float:
    """Share of the points of the scene whose sigma is below that of `SoftnessStatus.NOT_IDENTIFIABLE`."""
    return float(np.mean(design.sigma_sd < IDENTIFIABLE))
