"""Number of specimens in the scene's range that can be distinguished."""

import numpy as np

from papilla.calibration import NORMAL_FACTOR
from papilla.design.in_scene import DesignInScene
from papilla.design.objectives.registry import objective


@objective("specimens_told_apart", "more", "1", "specimens whose 95 % intervals (all gauges) do not overlap", gauges=2)
def specimens_told_apart(design: DesignInScene) -> float:
    """One plus the range of ln E over the mean width of an interval; sigma is the rms over the forces of the scene."""
    sigma = np.sqrt(np.mean(design.sigma_gauges**2, axis=0))
    return 1.0 + float(np.trapezoid(1 / (2 * NORMAL_FACTOR * sigma), np.log(design.scene.points[1])))
