"""Expected sigma of ln E without gauges."""

from papilla.design.in_scene import DesignInScene
from papilla.design.objectives.registry import objective
from papilla.design.scene import rms_or_worst


@objective("sigma_force_depth", "less", "1", "expected sigma of ln E from force and indentation over the scene")
def sigma_force_depth(design: DesignInScene) -> float:
    """Worst or rms over the scene, as the scene states."""
    return rms_or_worst(design.scene, design.sigma_depth)
