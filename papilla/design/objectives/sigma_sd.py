"""Expected sigma of ln E from S_d."""

from papilla.design.look import Look
from papilla.design.objectives.registry import objective
from papilla.design.scene import rms_or_worst


@objective("sigma_sd", "less", "1", "expected sigma of ln E from S_d and force over the scene", gauges=2)
def sigma_sd(look: Look) -> float:
    """Worst or rms over the scene, as the scene states."""
    return rms_or_worst(look.scene, look.sigma_sd)
