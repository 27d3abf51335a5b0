"""`DesignInScene`: the expected sigma of ln E by a design in a scene. Its presses (`presses`), surfaces (`calibrated`)
and sigmas are computed when an objective needs them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from papilla.design.calibrated import DesignSurfaces, depth_surface, surfaces_of
from papilla.design.presses import DesignPresses
from papilla.design.scene import sigma_from_depth, sigma_from_gauges, sigma_from_sd


@dataclass(frozen=True, eq=False)
class DesignInScene(DesignPresses):
    """A design in a scene: its presses, and what they tell about the modulus."""

    @cached_property
    def surfaces(self) -> DesignSurfaces:
        """Input of the estimators, as from a calibration; raises `InputError` unless gauges differ."""
        return surfaces_of(self)

    @cached_property
    def sigma_sd(self) -> np.ndarray:
        """(f, m) expected sigma of ln E from S_d and force over the scene."""
        return sigma_from_sd(self.surfaces, self.scene)

    @cached_property
    def sigma_gauges(self) -> np.ndarray:
        """(f, m) the same from all gauges and force."""
        return sigma_from_gauges(self.surfaces, self.scene)

    @cached_property
    def sigma_depth(self) -> np.ndarray:
        """(f, m) the same from force and depth."""
        return sigma_from_depth(depth_surface(self), self.scene)
