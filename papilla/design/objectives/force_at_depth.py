"""Force at a depth: the stiffness of the finger."""

import numpy as np

from papilla.design.in_scene import DesignInScene
from papilla.design.objectives.registry import objective
from papilla.errors import InputError


@objective("force_at_depth", "less", "N", "force on the hardest specimen at the scene's depth_mm, stuck")
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
