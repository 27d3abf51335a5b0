"""`DesignInScene`: one design in one scene. Its presses and sigmas are computed when an objective needs them."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from types import SimpleNamespace

import numpy as np

from papilla.calibration import GaugeSurface, SdSurface, Uncertainty
from papilla.calibration.fitting.surface_fit import usable_part
from papilla.calibration.fitting.sweep import DEFAULT_MODULI
from papilla.core.errors import InputError
from papilla.core.units import TINY_DIVISOR, UM_PER_MM, to_microstrain
from papilla.design.geometry import STAGE_GAUGES, STANDARD_MM, GeometryMap, gains_of, spent_on
from papilla.design.scene import DesignScene, sigma_from_depth, sigma_from_gauges, sigma_from_sd
from papilla.fem.finite.strain_tables import BLOCK_MODULUS_RATIOS, TABLE_FORCES_MM2
from papilla.fem.pressing.large_strain import CONTINUED_GAUGE, CONTINUED_SD, LARGEST_FORCE_RATIO, TABLE_LOG_MARGIN
from papilla.fem.pressing.response import Response
from papilla.mesh.body import narrowest_mm
from papilla.model.finger import Finger

CALIBRATED_DEPTH_ERROR = 0.005
"""Relative one sigma of a calibrated indentation: mesh scatter, fit and large strain."""
MESH_SCATTER = 0.0025
"""One sigma by the scatter between meshes, relative to the part of a gauge's reading that is membrane strain: 0.1 to
0.17 % at 0.6 N and up to 0.4 % at 0.05 N in calibrations of seven pairs of moduli, times 1.6 for a comparison of three
meshes."""
SWEEP_STEPS = 6, 3
"""A calibration's sweep is thinned to every sixth force and every third modulus."""
SOFTEST_MODULUS_RATIO = BLOCK_MODULUS_RATIOS[0]
"""Smallest ratio of a specimen's modulus to that of the inner layer for which large strain is measured; a calibration
begins at the next modulus of its table."""


@dataclass(frozen=True, eq=False)
class DesignInScene:
    """A design in a scene. geometry : the map of its geometry."""

    finger: Finger
    geometry: GeometryMap
    scene: DesignScene

    @cached_property
    def ends(self) -> tuple[Response, Response]:
        """The responses of its gauges without friction and stuck; raises `InputError` if they do not cover the
        scene."""
        outer, inner = self.moduli
        with spent_on(STAGE_GAUGES):
            found = self.geometry.of(self.finger)
        force, modulus = self.scene.grid
        softest = self.scene.modulus_MPa[0]
        least = min((one for one in DEFAULT_MODULI if one >= SOFTEST_MODULUS_RATIO * inner), default=math.inf)
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
        return np.array([to_microstrain((one.values * gains_of(self.finger)).sum(axis=1)) for one in self._felt])

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
        values = UM_PER_MM * self.depths
        error = CALIBRATED_DEPTH_ERROR * float(_rms(self._ends(values / self.scene.grid[0])[0]))
        return sigma_from_depth(SimpleNamespace(gauges=[self._channel("depth", values, error)]), self.scene)

    @cached_property
    def surfaces(self) -> SimpleNamespace:
        """Input of the estimators, as from a calibration: `gauges`, and `surface` of S_d if the gauges differ."""
        sd_error, errors = self.errors
        gauges = [
            self._channel(one.name, self.readings[:, :, k], errors[k]) for k, one in enumerate(self.finger.gauges)
        ]
        if len(gauges) < 2 or not (self.sd > 0).all():
            raise InputError("S_d needs at least two gauges whose readings differ")
        value, change = self._ends(np.log(self.sd))
        fitted = self.scene.solver.surface(value)
        doubt = self._uncertainty(sd_error, change)
        return SimpleNamespace(gauges=gauges, surface=SdSurface(fitted.surface, *usable_part(fitted.surface), doubt))

    @cached_property
    def errors(self) -> tuple[float, np.ndarray]:
        """One sigma of the design's calibration, without friction: of S_d (relative), and of each gauge (g,) in
        microstrain / N.

        Large strain is treated as in `papilla.calibration.fit`: the error of the tables and of presses beyond their
        forces, relative to the rms of a gauge over the calibration's own sweep. Meshes: `MESH_SCATTER`.
        """
        stuck = self.scene.unknown.friction != 0
        end, (outer, inner) = self.ends[stuck], self.moduli
        swept = np.array(self.scene.swept_N)
        if end.large_strain:
            swept = swept[self._between_forces(swept, math.log(LARGEST_FORCE_RATIO))]
        # Errors are relative to means over a sweep; a thinner one has the same means.
        force, modulus = (
            part.ravel() for part in np.meshgrid(swept[:: SWEEP_STEPS[0]], DEFAULT_MODULI[:: SWEEP_STEPS[1]])
        )
        valid = (modulus >= SOFTEST_MODULUS_RATIO * inner) & end.inside(force, modulus, outer, inner)
        if not valid.any():
            raise InputError("no press of a calibration of this finger lies within the range of the model")
        force, modulus = force[valid], modulus[valid]
        felt = end.felt(force, modulus, outer, inner).values
        parts = to_microstrain(felt * gains_of(self.finger)) / force[:, None, None]
        reading, membrane = parts.sum(axis=1), parts[:, 0]
        continued = math.sqrt(np.mean(~self._between_forces(swept, TABLE_LOG_MARGIN))) if end.large_strain else 0.0
        table = self.geometry.strain_error(self.finger, stuck)
        deviation = reading - reading.mean(axis=1, keepdims=True)
        # S_d is the root of the mean square deviation: its relative change by a change of each gauge.
        moved = np.linalg.norm(deviation * membrane, axis=1) / np.maximum((deviation**2).sum(axis=1), TINY_DIVISOR)
        of_sd = math.hypot(table, CONTINUED_SD * continued, MESH_SCATTER * _rms(moved))
        strain = math.hypot(table, CONTINUED_GAUGE * continued)
        return of_sd, np.hypot(strain * _rms(reading), MESH_SCATTER * _rms(membrane))

    def _between_forces(self, force: np.ndarray, beyond: float) -> np.ndarray:
        """Whether forces (N) lie within those of the tables of large strain, or at most `beyond` outside in the
        logarithm."""
        scaled = np.log(force / (self.finger.inner.modulus * (narrowest_mm(self.finger) / STANDARD_MM) ** 2))
        return (scaled >= math.log(TABLE_FORCES_MM2[0]) - beyond) & (scaled <= math.log(TABLE_FORCES_MM2[-1]) + beyond)

    @property
    def moduli(self) -> tuple[float, float]:
        """Moduli of the outer and the inner layer."""
        return self.finger.outer.modulus, self.finger.inner.modulus

    @cached_property
    def _felt(self) -> list:
        force, modulus = self.scene.grid
        return [one.felt(force, modulus, *self.moduli) for one in self.ends]

    def _channel(self, name: str, values: np.ndarray, error: float) -> GaugeSurface:
        """The surface over force and modulus for a channel's values (2, n) without friction and stuck.

        error : one sigma of its value / force."""
        value, change = self._ends(values / self.scene.grid[0])
        fitted = self.scene.solver.surface(value)
        return GaugeSurface(name, fitted.surface, self._uncertainty(error, change))

    def _ends(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
        """From values (2, n): those (n,) that a calibration uses, and their change without friction if friction is not
        known."""
        free, stuck = values
        if self.scene.unknown.friction == "unknown":
            return stuck, free - stuck
        return (stuck if self.scene.unknown.friction == "stick" else free), None

    def _uncertainty(self, error: float, change: np.ndarray | None) -> Uncertainty:
        """The uncertainty of a surface with a constant error; the change without friction is fitted like the value."""
        none = Uncertainty(0.0, 0.0, 0.0, np.array(self.scene.force_N), np.zeros(2), 0.0, 0, strain=error)
        return none if change is None else replace(none, friction=self.scene.solver.surface(change).surface)


def _rms(values: np.ndarray) -> np.ndarray:
    """Root mean square over the first axis."""
    return np.sqrt((values**2).mean(axis=0))
