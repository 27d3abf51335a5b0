"""`DesignPresses`: what a design reads in the presses of a scene."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from papilla.core.errors import InputError
from papilla.core.units import to_microstrain
from papilla.design.geometry import STAGE_GAUGES, GeometryMap, gains_of, spent_on
from papilla.design.scene import DesignScene
from papilla.fem.pressing.large_strain import softest_ratio
from papilla.fem.pressing.response import Response
from papilla.model.finger import Finger


@dataclass(frozen=True, eq=False)
class DesignPresses:
    """The presses of a scene by a design. geometry : the map of its geometry."""

    finger: Finger
    geometry: GeometryMap
    scene: DesignScene

    @cached_property
    def ends(self) -> tuple[Response, Response]:
        """The responses of its gauges without friction and stuck; raises `InputError` if they do not cover the
        scene."""
        outer, inner = self.moduli
        with spent_on(STAGE_GAUGES):
            responses = self.geometry.of(self.finger)
        force, modulus = self.scene.grid
        softest = self.scene.modulus_MPa[0]
        least = min((one for one in self.scene.swept(self.finger)[1] if one >= self.softest_MPa), default=math.inf)
        if responses[0].large_strain and softest < least:
            begins = f"begins at {least:.3g} MPa" if least < math.inf else "has no specimen that is hard enough"
            raise InputError(
                f"a specimen of {softest:g} MPa is too soft for an inner layer of {inner:.3g} MPa, because large "
                f"strain is not known there: a calibration {begins}"
            )
        for response in responses:
            inside = response.inside(force, modulus, outer, inner)
            if not inside.all():
                k = int(inside.argmin())
                at = f"{force[k]:.3g} N on {modulus[k]:.3g} MPa"
                raise InputError(f"a press leaves what the model covers (contact patch or table): {at}")
        return responses

    @cached_property
    def softest_MPa(self) -> float:
        """Modulus of the softest specimen for which large strain of this geometry is known; a calibration begins at the
        next modulus of its sweep."""
        return softest_ratio(self.geometry.finger.strain_sha256) * self.finger.inner.modulus

    @cached_property
    def readings(self) -> np.ndarray:
        """(2, n, g) readings in microstrain of the presses of the scene's grid, without friction and stuck."""
        gains = gains_of(self.finger)
        return np.array([to_microstrain((felt.values * gains).sum(axis=1)) for felt in self._felt])

    @cached_property
    def depths(self) -> np.ndarray:
        """(2, n) indentations in mm of the same presses."""
        return np.array([felt.indentation for felt in self._felt])

    @cached_property
    def sd(self) -> np.ndarray:
        """(2, n) S_d in microstrain of the same presses."""
        return self.readings.std(axis=2)

    @property
    def moduli(self) -> tuple[float, float]:
        """Moduli of the outer and the inner layer."""
        return self.finger.outer.modulus, self.finger.inner.modulus

    @cached_property
    def _felt(self) -> list:
        return [end.felt(*self.scene.grid, *self.moduli) for end in self.ends]
