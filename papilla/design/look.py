"""`Look`: one design in one scene. Its presses and sigmas are computed when an objective needs them."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from types import SimpleNamespace

import numpy as np

from papilla.calibrate.press_table import DEFAULT_MODULI
from papilla.calibrate.surface_fit import usable_part
from papilla.calibration import GaugeSurface, SdSurface, Uncertainty
from papilla.design.costs import GAUGES, spent_on
from papilla.design.geometry import STANDARD_MM, GeometryMap
from papilla.design.scene import Scene
from papilla.design.touch import sigma_from_depth, sigma_from_gauges, sigma_from_sd
from papilla.errors import InputError
from papilla.fem.finite.strain_tables import FORCES, MODULI
from papilla.fem.pressing.large_strain import CONTINUED_GAUGE, CONTINUED_SD
from papilla.fem.pressing.response import Response
from papilla.finger import Finger
from papilla.mesh.body import narrowest_mm
from papilla.units import to_microstrain

SD_ERROR, GAUGE_ERROR, DEPTH_ERROR = 0.003, 0.004, 0.005
"""Relative one sigma of a future calibration, without friction: mesh scatter, fit and large strain of the default
finger are 0.2 to 0.33 % of S_d and 0.3 to 0.4 % of a gauge, at 0.2 to 0.98 N."""
SOFTEST = MODULI[0]
"""Smallest ratio of a specimen's modulus to that of the inner layer for which large strain is measured; a calibration
begins at the next modulus of its table."""
NEIGHBOUR = 0.005
"""Relative one sigma of S_d and of gauges if large strain comes from another geometry."""


@dataclass(frozen=True, eq=False)
class Look:
    """A design in a scene. geometry : the map of its geometry; borrowed : whether its large strain comes from another
    geometry."""

    finger: Finger
    geometry: GeometryMap
    scene: Scene
    borrowed: bool = False

    @cached_property
    def ends(self) -> tuple[Response, Response]:
        """The responses of its gauges without friction and stuck; raises `InputError` if they do not cover the
        scene."""
        outer, inner = self._moduli
        with spent_on(GAUGES):
            found = self.geometry.of(self.finger)
        force, modulus = self.scene.grid
        softest = self.scene.modulus_MPa[0]
        least = min((one for one in DEFAULT_MODULI if one >= SOFTEST * inner), default=math.inf)
        if found[0].large_strain and softest < least:
            begins = f"begins at {least:.3g} MPa" if least < math.inf else "has no specimen that is hard enough"
            raise InputError(
                f"a specimen of {softest:g} MPa is too soft for an inner layer of {inner:.3g} MPa, because large "
                f"strain is not known there: a calibration {begins}"
            )
        for one in found:
            inside = one.inside(force, modulus, outer, inner)
            if not inside.all():
                k = int(inside.argmin())
                at = f"{force[k]:.3g} N on {modulus[k]:.3g} MPa"
                raise InputError(f"a press leaves what the model covers (contact patch or table): {at}")
        return found

    @cached_property
    def readings(self) -> np.ndarray:
        """(2, n, g) readings in microstrain of the presses of the scene's grid, without friction and stuck."""
        weights = np.array([[g.membrane_gain for g in self.finger.gauges], [g.lever_mm for g in self.finger.gauges]])
        return np.array([to_microstrain((one.values * weights).sum(axis=1)) for one in self._felt])

    @cached_property
    def depths(self) -> np.ndarray:
        """(2, n) indentations in mm of the same presses."""
        return np.array([one.indentation for one in self._felt])

    @cached_property
    def sd(self) -> np.ndarray:
        """(2, n) S_d in microstrain of the same presses."""
        return self.readings.std(axis=2)

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
        values = 1000 * self.depths
        return sigma_from_depth(SimpleNamespace(gauges=[self._channel("depth", values, DEPTH_ERROR)]), self.scene)

    @cached_property
    def surfaces(self) -> SimpleNamespace:
        """Input of the estimators, as from a calibration: `gauges`, and `surface` of S_d if the gauges differ."""
        error = math.hypot(GAUGE_ERROR, CONTINUED_GAUGE * self.continued)
        gauges = [self._channel(one.name, self.readings[:, :, k], error) for k, one in enumerate(self.finger.gauges)]
        if len(gauges) < 2 or not (self.sd > 0).all():
            raise InputError("S_d needs at least two gauges whose readings differ")
        value, change = self._ends(np.log(self.sd))
        fitted = self.scene.solver.surface(value)
        doubt = self._uncertainty(math.hypot(SD_ERROR, CONTINUED_SD * self.continued), change)
        return SimpleNamespace(gauges=gauges, surface=SdSurface(fitted.surface, *usable_part(fitted.surface), doubt))

    @cached_property
    def continued(self) -> float:
        """Root of the share of a calibration's forces that lie beyond those of its tables of large strain: a sweep
        from 0.05 N on is too light for them where the inner layer is hard, and all its presses share the error."""
        if not self.geometry.ends[0].large_strain:
            return 0.0
        size = narrowest_mm(self.finger) / STANDARD_MM
        scaled = np.array(self.scene.swept_N) / (self.finger.inner.modulus * size**2)
        return math.sqrt(float(np.mean((scaled < FORCES[0]) | (scaled > FORCES[-1]))))

    @property
    def _moduli(self) -> tuple[float, float]:
        return self.finger.outer.modulus, self.finger.inner.modulus

    @cached_property
    def _felt(self) -> list:
        force, modulus = self.scene.grid
        return [one.felt(force, modulus, *self._moduli) for one in self.ends]

    def _channel(self, name: str, values: np.ndarray, error: float) -> GaugeSurface:
        """The surface over force and modulus for a channel's values (2, n) without friction and stuck."""
        value, change = self._ends(values / self.scene.grid[0])
        size = float(np.sqrt(np.mean(value**2)))
        fitted = self.scene.solver.surface(value)
        return GaugeSurface(name, fitted.surface, self._uncertainty(error * size, change, size))

    def _ends(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """From values (2, n): those (n,) that a calibration uses, and their change without friction if friction is not
        known."""
        free, stuck = values
        if self.scene.unknown.friction == "unknown":
            return stuck, free - stuck
        return (stuck if self.scene.unknown.friction == "stick" else free), None

    def _uncertainty(self, error: float, change: np.ndarray | None, unit: float = 1.0) -> Uncertainty:
        """The uncertainty of a surface with a constant error; the change without friction is fitted like the value."""
        error = math.hypot(error, NEIGHBOUR * unit) if self.borrowed else error
        none = Uncertainty(0.0, 0.0, 0.0, np.array(self.scene.force_N), np.zeros(2), 0.0, 0, strain=error)
        return none if change is None else replace(none, friction=self.scene.solver.surface(change).surface)
