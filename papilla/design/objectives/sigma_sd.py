"""Expected sigma of ln E from S_d."""

from papilla.design.in_scene import DesignInScene
from papilla.design.objectives.registry import objective
from papilla.design.scene import rms_or_worst


@objective("sigma_sd", "less", "1", "expected sigma of ln E from S_d and force over the scene", gauges=2)
def sigma_sd(design: DesignInScene) -> float:
    """Worst or rms over the scene, as the scene states."""
    return rms_or_worst(design.scene, design.sigma_sd)
