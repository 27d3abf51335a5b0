"""Fitted surfaces of S_d and of each gauge, with what is known of their error."""

import math
from dataclasses import dataclass
from enum import IntEnum
from functools import cached_property

import numpy as np

from papilla.calibration.surface import PointSurface, Surface, inside

LEVEL = 0.95
"""Probability of the stated intervals."""
NORMAL_FACTOR = 1.959963984540054
"""Half width of the central 95 % of a normal distribution, in standard deviations."""


IDENTIFIABLE = 0.5
"""sigma_E / E above which a modulus is called not identifiable (the sensor cannot tell)."""


class SoftnessStatus(IntEnum):
    """What became of an answer; `sentence` says it in words."""

    OK = 0
    NOT_IDENTIFIABLE = 1
    SOFTER = 2
    HARDER = 3
    FORCE_BELOW = 4
    FORCE_ABOVE = 5
    NO_CONTACT = 6
    BAD_GAUGE = 7
    BAD_INPUT = 8
    LEFT_OUT = 9
    MISFIT = 10
    OFF_REACH = 11

    @property
    def sentence(self) -> str:
        """The status in words."""
        return _SENTENCES[self]


_SENTENCES = {
    SoftnessStatus.OK: "ok",
    SoftnessStatus.NOT_IDENTIFIABLE: "not identifiable: sigma is more than half of the modulus, or S_d fits two",
    SoftnessStatus.SOFTER: "softer than calibrated",
    SoftnessStatus.HARDER: "harder than the sensor can tell",
    SoftnessStatus.FORCE_BELOW: "force below the calibrated domain",
    SoftnessStatus.FORCE_ABOVE: "force above the calibrated domain",
    SoftnessStatus.NO_CONTACT: "no contact",
    SoftnessStatus.BAD_GAUGE: "bad gauge: a reading is missing, saturated or stuck, so there is no S_d",
    SoftnessStatus.BAD_INPUT: "force or S_d is not a positive finite number",
    SoftnessStatus.LEFT_OUT: "ok without some channels",
    SoftnessStatus.MISFIT: "the readings fit no modulus and force: a touch off the apex, or several bad channels",
    SoftnessStatus.OFF_REACH: "the contact lies beside the calibrated positions",
}


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """How far a fitted surface may be off, in the units of the surface.

    fit_rms : rms by which a new press misses the surface, fit_factor : half width of its 95 % interval in fit_rms
    (Student's t of the freedom left); fit_max : largest residual of the fit.
    scatter_force_N, scatter : (k,) rms difference of independent meshes from this one, at rising forces; zero where
    none was given. scatter_factor : half width of the 95 % interval in `scatter`.
    meshes : how many meshes the scatter comes from.
    """

    fit_rms: float
    fit_factor: float
    fit_max: float
    scatter_force_N: np.ndarray
    scatter: np.ndarray
    scatter_factor: float
    meshes: int

    def scatter_at(self, force_N: float) -> float:
        """Mesh scatter at one force, linear in ln force between the stated ones, constant beyond."""
        return float(np.interp(math.log(force_N), self._ln_force, self.scatter))

    @cached_property
    def _ln_force(self) -> np.ndarray:
        return np.log(self.scatter_force_N)


@dataclass(frozen=True, eq=False)
class SdSurface:
    """ln S_d (S_d in microstrain) with the part of it that can be inverted.

    usable : (m, 2) int, per force cell the first and last modulus node between which data are and S_d rises.
    twofold : (m, 2) range of ln S_d that a falling part of the force cell takes up too; NaN where there is none.
    """

    surface: Surface
    usable: np.ndarray
    twofold: np.ndarray
    uncertainty: Uncertainty

    @cached_property
    def point(self) -> PointSurface:
        """The surface for one point at a time."""
        return PointSurface(self.surface)

    @cached_property
    def _limits(self) -> tuple[tuple[int, int, float, float], ...]:
        rows = zip(self.usable.tolist(), self.twofold.tolist(), strict=True)
        return tuple((low, high, first, last) for (low, high), (first, last) in rows)

    def usable_nodes(self, ln_force: float) -> tuple[int, int]:
        """First and last usable modulus node at a force of the domain (equal where there is none)."""
        low, high, *_ = self._limits[self.point.force_cell(ln_force)]
        return low, high

    def ln_modulus(self, ln_force: float, ln_sd: float) -> tuple[float, SoftnessStatus]:
        """ln E at a force of the domain, and OK; or NaN and the side on which ln S_d leaves the usable range."""
        low, high, first, last = self._limits[self.point.force_cell(ln_force)]
        if low >= high or first <= ln_sd <= last:
            return math.nan, SoftnessStatus.NOT_IDENTIFIABLE
        bottom, top = self.point.node_value(ln_force, low), self.point.node_value(ln_force, high)
        if not inside(ln_sd, bottom, top):
            return math.nan, SoftnessStatus.SOFTER if ln_sd < bottom else SoftnessStatus.HARDER
        return self.point.solve(ln_force, ln_sd, low, high), SoftnessStatus.OK


@dataclass(frozen=True, eq=False)
class GaugeSurface:
    """Reading / force of one gauge (microstrain / N) over (ln force, ln modulus)."""

    name: str
    surface: Surface
    uncertainty: Uncertainty

    def reading(self, force_N, modulus_MPa):
        """Reading in microstrain at forces and moduli that broadcast; NaN outside the domain."""
        return np.asarray(force_N, float) * self.surface(force_N, modulus_MPa)
