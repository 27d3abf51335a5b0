"""Readings of a finger's channels at a contact (force, modulus, x), with slopes, from the calibration."""

import math
from typing import NamedTuple

import numpy as np

from papilla.calibration import Calibration
from papilla.calibration.surface import Curve, spline_of
from papilla.errors import InputError

SAME = 1e-6
"""Relative difference up to which two surfaces count as one: gauges that mirror each other share their errors."""
LEAST_SLOPE = 1e-3
"""Smallest slope of h relative to the steepest dh / d ln E: h is only a scale, and must rise even if readings hardly
change."""


class Expected(NamedTuple):
    """(c,) expected readings in microstrain of c channels at a contact, and their slopes by ln E, force (N) and x
    (mm)."""

    reading: np.ndarray
    along_modulus: np.ndarray
    along_force: np.ndarray
    along_x: np.ndarray


class GaugeSurfaces:
    """Expected readings of every gauge; with `anywhere`, also beside the apex.

    groups : number of each gauge's group; gauges that mirror each other are in one group. friction_known : whether
    presses have the friction of the calibration. Raises `InputError` if the gauges' surfaces have different cells, or
    if the calibration has no contacts beside the apex.
    """

    def __init__(self, calibration: Calibration, anywhere: bool):
        surfaces = [gauge.surface for gauge in calibration.gauges]
        first = surfaces[0]
        for gauge in calibration.gauges[1:]:
            other = gauge.surface
            if (other.force_N, other.modulus_MPa, other.cells) != (first.force_N, first.modulus_MPa, first.cells):
                raise InputError(
                    f"the surface of {gauge.name} has another domain or other cells than the first gauge's"
                )
        self.channels = len(surfaces)
        self.force_N = first.force_N
        self._calibration = calibration
        table = np.array([surface.coefficients for surface in surfaces])
        self._apex = spline_of(surfaces).at
        self.ln_nodes = np.log(first.modulus_axis.nodes)
        self._moved, self.reach, self._nothing = None, 0.0, np.zeros(self.channels)
        if anywhere:
            terms, domain = calibration.position_terms, calibration.domain
            if (terms.force_N, terms.modulus_MPa) != (domain["force_N"], domain["modulus_MPa"]):
                raise InputError("softness.position of the calibration has another domain than its surfaces")
            self._moved, self.reach = terms.spline.at, terms.reach_mm
            self._place_nodes = np.linspace(-terms.reach_mm, terms.reach_mm, terms.error.shape[1])
            self._place_errors = terms.error
        self.groups = _groups(table)
        changes = [gauge.uncertainty.friction for gauge in calibration.gauges]
        known = [change for change in changes if change is not None]
        self.friction_known = len(known) < self.channels
        if not self.friction_known:
            self._friction = spline_of(known).at

    def at(self, ln_force: float, ln_modulus: float, x: float) -> Expected:
        """Expected readings at a contact within the domain."""
        force = math.exp(ln_force)
        per_force, along_x = self._apex(ln_force, ln_modulus), self._nothing
        if self._moved is not None:
            moved = self._moved(ln_force, ln_modulus, x)
            per_force, along_x = per_force + moved[:, :, 0], force * moved[0, 0, 1]
        reading, along_modulus = force * per_force[0]
        return Expected(reading, along_modulus, per_force[0, 0] + per_force[1, 0], along_x)

    def error(self, ln_force: float) -> np.ndarray:
        """(c,) one sigma of the calibration without the part of friction, microstrain / N."""
        force = math.exp(ln_force)
        return np.array([gauge.uncertainty.sigma_at(force) for gauge in self._calibration.gauges])

    def without_friction(self, ln_force: float, ln_modulus: float) -> np.ndarray:
        """(c,) change of the readings without friction, if friction is not known, microstrain / N."""
        return self._nothing if self.friction_known else self._friction(ln_force, ln_modulus)[0, 0]

    def place_error(self, x: float) -> np.ndarray:
        """(c,) one sigma of each gauge's change at a place, microstrain / N, if `anywhere`."""
        return np.array([np.interp(x, self._place_nodes, errors) for errors in self._place_errors])


class SdSurface:
    """S_d of all gauges as the only reading; raises `InputError` if it does not rise with the modulus."""

    channels, reach, groups = 1, 0.0, (0,)

    def __init__(self, calibration: Calibration):
        surface = calibration.surface
        self._surface, self.friction_known = surface, surface.uncertainty.friction is None
        own = surface.surface
        self.force_N = own.force_N
        self._spline = own.spline.at
        middle = 0.5 * (math.log(own.force_N[0]) + math.log(own.force_N[1]))
        low, high = surface.usable_nodes(middle)
        if low >= high:
            raise InputError("S_d of this calibration does not rise with the modulus: no softness can be estimated")
        self.ln_nodes = np.log(own.modulus_axis.nodes)[low : high + 1]

    def usable(self, ln_force: float) -> tuple[float, float]:
        """First and last ln E between which S_d rises at a force; (inf, -inf) if it does not rise."""
        low, high = self._surface.usable_nodes(ln_force)
        axis = self._surface.surface.modulus_axis
        return (axis.start + axis.step * low, axis.start + axis.step * high) if low < high else (math.inf, -math.inf)

    def at(self, ln_force: float, ln_modulus: float, x: float) -> Expected:
        """Expected readings at a contact within the domain."""
        (value, a), (slope, _) = self._spline(ln_force, ln_modulus)
        sd = np.exp(value)
        return Expected(sd, sd * a, sd * slope * math.exp(-ln_force), np.zeros(1))

    def error(self, ln_force: float) -> np.ndarray:
        """(1,) one sigma of the calibration without the part of friction, microstrain / N."""
        force, middle = math.exp(ln_force), float(self.ln_nodes[len(self.ln_nodes) // 2])
        return self._surface.uncertainty.sigma_at(force) * self.at(ln_force, middle, 0.0).reading / force

    def without_friction(self, ln_force: float, ln_modulus: float) -> np.ndarray:
        """(1,) change of S_d without friction, if friction is not known, microstrain / N."""
        share = self._surface.uncertainty.friction_at(ln_force, ln_modulus)
        return self.at(ln_force, ln_modulus, 0.0).reading * (share * math.exp(-ln_force))


def _groups(tables: np.ndarray) -> tuple[int, ...]:
    """Number of each gauge's group; gauges with the same surface are in one group."""
    groups: list[int] = []
    for number, table in enumerate(tables):
        like = (groups[k] for k in range(number) if np.abs(tables[k] - table).max() <= SAME * np.abs(table).max())
        groups.append(next(like, max(groups, default=-1) + 1))
    return tuple(groups)


def distance_curve(slopes: np.ndarray, start: float, per_step: float) -> Curve:
    """A rising curve h(ln E) from dh / d ln E > 0 at its n + 1 nodes: piecewise cubic Hermite, slopes limited so that
    it rises everywhere (Fritsch and Carlson 1980, doi:10.1137/0717021)."""
    slopes = np.maximum(slopes, LEAST_SLOPE * slopes.max())
    steps = 0.5 * (slopes[:-1] + slopes[1:]) / per_step
    values = np.concatenate([[0.0], np.cumsum(steps)])
    ends = slopes / per_step
    left, right = np.minimum(ends[:-1], 3 * steps), np.minimum(ends[1:], 3 * steps)
    cubics = np.column_stack([values[:-1], left, 3 * steps - 2 * left - right, left + right - 2 * steps])
    return Curve(tuple(map(tuple, cubics.tolist())), tuple(values.tolist()), start, per_step)
