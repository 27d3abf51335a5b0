"""What is fitted to presses: surfaces of S_d and of each gauge with their uncertainty, the change of readings with the
place of contact, and the compact form of S_d."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from papilla.calibration.surface import SPLINE_DEGREE, SPLINE_ORDER, Axes, BicubicSurface, Spline, inside
from papilla.core.errors import InputError
from papilla.core.short_repr import short_repr
from papilla.core.status import Named, Status

INTERVAL_PROBABILITY = 0.95
"""Probability of the stated intervals."""
LARGEST_LN_SIGMA = 100.0
"""Bound of the logarithm of a sigma, so that no file of coefficients makes it overflow."""

NORMAL_FACTOR = 1.959963984540054
"""Half width of the central 95 % of a normal distribution, in standard deviations."""
ONE_SIDED_FACTOR = 1.6448536269514722
"""The same for one end: 5 % of a normal distribution lie beyond it."""
INTERVAL_NEWTON_STEPS = 5
"""Newton steps that find the end of an interval between the two to rounding."""

COMPACT_TERMS = ("1", "ln_f", "ln_f2", "spring", "spring_ln_f")

IDENTIFIABLE_SIGMA = 0.5
"""sigma_E / E above which a modulus is called not identifiable."""


class SoftnessStatus(Status):
    """Status of an answer; `sentence` says it in words."""

    OK = "ok"
    NOT_IDENTIFIABLE = "not identifiable: sigma is more than half of the modulus, or S_d fits two"
    SOFTER = "softer than calibrated"
    HARDER = "harder than the sensor can tell"
    FORCE_BELOW = "force below the calibrated domain"
    FORCE_ABOVE = "force above the calibrated domain"
    NO_CONTACT = "no contact"
    BAD_GAUGE = "bad gauge: a reading is missing, saturated or stuck, so there is no S_d"
    BAD_INPUT = "force or S_d is not a positive finite number"
    LEFT_OUT = "ok without some channels"
    MISFIT = "the readings fit no modulus and force: a touch off the apex, or several bad channels"
    OFF_REACH = "the contact lies beside the calibrated positions"


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Uncertainty of a fitted surface, in the units of the surface.

    fit_rms : rms by which a new press misses the surface, fit_factor : half width of its 95 % interval in fit_rms
    (Student's t of the freedom left); fit_max : largest residual of the fit.
    scatter_force_N, scatter : (k,) rms difference of independent meshes from this one, at rising forces; zero where
    none was given. scatter_factor : half width of the 95 % interval in `scatter`.
    meshes : how many meshes the scatter comes from.
    strain : one sigma of the remaining effect of large strain in the finger.
    specimen : (4,) ln of one sigma by large strain in the specimen, over 1, ln F, ln E and (ln E)^2 (N, MPa); None if
        it is left out.
    friction : change of the value without friction, if friction is not known; else None.
    identified : one sigma from the identification of the finger; None if the design is taken as exact.
    form : one sigma from the form of the surface between its presses, in files of papilla before 0.2.

    Raises `InputError` for forces that do not rise, or unless there is one value of scatter per force.
    """

    fit_rms: float
    fit_factor: float
    fit_max: float
    scatter_force_N: np.ndarray
    scatter: np.ndarray
    scatter_factor: float
    meshes: int
    strain: float = 0.0
    specimen: np.ndarray | None = None
    friction: BicubicSurface | None = None
    identified: BicubicSurface | None = None
    form: BicubicSurface | None = None
    __repr__ = short_repr

    def __post_init__(self):
        forces, scatter = self.scatter_force_N, self.scatter
        if forces.ndim != 1 or not len(forces) or (forces <= 0).any() or (np.diff(forces) <= 0).any():
            raise InputError("scatter_force_N must rise and be above 0")
        if scatter.shape != forces.shape:
            raise InputError(f"scatter must have a value for each of {len(forces)} forces, got shape {scatter.shape}")

    def scatter_at(self, force_N: float) -> float:
        """Mesh scatter at one force, linear in ln force between the stated ones, constant beyond."""
        return float(np.interp(math.log(force_N), self._ln_force, self.scatter))

    def sigma_at(self, force_N: float) -> float:
        """One sigma of the value at a force and middle moduli, without friction: fit, mesh, strain, and the rest."""
        surface = self.identified or self.form
        middle = 0.0 if surface is None else 0.5 * sum(map(math.log, surface.modulus_MPa))
        sigmas = self.sigmas(math.log(force_N), middle)
        return math.hypot(*(sigma for name, sigma in sigmas.items() if name != "friction"))

    def friction_at(self, ln_force: float, ln_modulus: float) -> float:
        """Change of the value without friction at a point of the domain (N, MPa); 0 if friction is known."""
        return 0.0 if self.friction is None else self.friction.spline.at(ln_force, ln_modulus).item(0)

    def specimen_at(self, ln_force: float, ln_modulus: float) -> float:
        """One sigma by large strain in the specimen at a point of the domain (N, MPa)."""
        if self.specimen is None:
            return 0.0
        return math.exp(min(float(self.specimen @ (1.0, ln_force, ln_modulus, ln_modulus**2)), LARGEST_LN_SIGMA))

    def sigmas(self, ln_force: float, ln_modulus: float) -> dict[str, float]:
        """Standard deviation of the value at a point of the domain (N, MPa), by its cause.

        The one of the mesh is its scatter, and larger if few meshes were compared. Two sigmas of friction equal the
        distance from the value of the surface to the value without friction.
        """
        surfaces = {"identification": self.identified, "form": self.form}
        more = {
            name: surface.spline.at(ln_force, ln_modulus) for name, surface in surfaces.items() if surface is not None
        }
        return {
            "fit": self.fit_rms,
            "mesh": self.scatter_at(math.exp(ln_force)) * max(self.scatter_factor / NORMAL_FACTOR, 1.0),
            "large strain": self.strain,
            "specimen": self.specimen_at(ln_force, ln_modulus),
            "friction": abs(self.friction_at(ln_force, ln_modulus)) / 2,
            **{name: max(sigma.item(0), 0.0) for name, sigma in more.items()},
        }

    @cached_property
    def _ln_force(self) -> np.ndarray:
        return np.log(self.scatter_force_N)


def two_ended(half: float, shift: float) -> float:
    """How far a 95 % interval reaches beyond both of two likely truths that lie `shift` apart, each known to `half`.

    Both are equally likely, and each is missed in 5 % of cases. The result is less than `half` if they are far apart,
    and `half` if they coincide. All values between them are inside. In units of sigma the reach u solves Q(u) + Q(u +
    shift) = 5 %, Q the share of a normal distribution above u; Q is convex, so Newton's method from the smallest u
    never oversteps.
    """
    if half == 0 or shift == 0:
        return half
    sigma = half / NORMAL_FACTOR
    u, apart = ONE_SIDED_FACTOR, abs(shift) / sigma
    for _ in range(INTERVAL_NEWTON_STEPS):
        beyond = 0.5 * (math.erfc(u / math.sqrt(2)) + math.erfc((u + apart) / math.sqrt(2)))
        density = (math.exp(-0.5 * u**2) + math.exp(-0.5 * (u + apart) ** 2)) / math.sqrt(2 * math.pi)
        u += (beyond - (1 - INTERVAL_PROBABILITY)) / density
    return u * sigma


@dataclass(frozen=True, eq=False)
class SdSurface:
    """ln S_d (S_d in microstrain) with the part of it that can be inverted.

    usable : (m, 2) int, per force cell the first and last modulus node between which there are data and S_d rises.
    twofold : (m, 2) range of ln S_d that also occurs in a falling part of the force cell; NaN if there is none.
    """

    surface: BicubicSurface
    usable: np.ndarray
    twofold: np.ndarray
    uncertainty: Uncertainty
    __repr__ = short_repr

    @cached_property
    def _limits(self) -> list[list[float]]:
        return np.column_stack([self.usable, self.twofold]).tolist()

    def usable_nodes(self, ln_force: float) -> tuple[int, int]:
        """First and last usable modulus node at a force of the domain; equal if there is none."""
        low, high, *_ = self._limits[self.surface.force_axis.cell(ln_force)]
        return int(low), int(high)

    def ln_modulus(self, ln_force: float, ln_sd: float) -> tuple[float, SoftnessStatus]:
        """ln E at a force of the domain, and OK; or NaN and the side on which ln S_d leaves the usable range."""
        *_, first, last = self._limits[self.surface.force_axis.cell(ln_force)]
        low, high = self.usable_nodes(ln_force)
        if low >= high or first <= ln_sd <= last:
            return math.nan, SoftnessStatus.NOT_IDENTIFIABLE
        curve = self.surface.curve(ln_force)
        bottom, top = curve.values[low], curve.values[high]
        if not inside(ln_sd, bottom, top):
            return math.nan, SoftnessStatus.SOFTER if ln_sd < bottom else SoftnessStatus.HARDER
        return curve.solve(ln_sd, low, high)[0], SoftnessStatus.OK


@dataclass(frozen=True, eq=False)
class GaugeSurface:
    """Reading / force of one gauge (microstrain / N) over (ln force, ln modulus)."""

    name: str
    surface: BicubicSurface
    uncertainty: Uncertainty
    __repr__ = short_repr

    def reading(self, force_N: ArrayLike, modulus_MPa: ArrayLike) -> np.ndarray:
        """Reading in microstrain at forces and moduli that broadcast; NaN outside the domain."""
        return np.asarray(force_N, float) * self.surface(force_N, modulus_MPa)


@dataclass(frozen=True, eq=False)
class PositionTerms(Axes):
    """Change of the gauges' readings for a contact off the apex; m, n and k uniform cells, g gauges.

    At the apex the gauges' own surfaces hold; a contact x further along the finger adds force * change(force, modulus,
    x), a tricubic spline that is zero at x = 0. It has few cells, because a contact is displaced but hardly deformed.

    Parameters
    ----------
    force_N, modulus_MPa : (low, high) of the domain; reach_mm : |x| up to which it holds, mm.
    coefficients : (g, m + 3, n + 3, k + 3) B-spline coefficients, microstrain / N.
    error : (g, k + 1) standard deviation of the change at the nodes of x, microstrain / N, linear in between.

    Raises `InputError` for shapes that do not fit, or values that are not finite.
    """

    force_N: tuple[float, float]
    modulus_MPa: tuple[float, float]
    reach_mm: float
    coefficients: np.ndarray
    error: np.ndarray
    __repr__ = short_repr

    def __post_init__(self):
        if not 0 < self.reach_mm < math.inf:
            raise InputError(f"the reach of contact positions (mm) must be greater than 0, got {self.reach_mm:g}")
        shape = self.coefficients.shape
        if len(shape) != 4 or min(shape[1:]) < SPLINE_ORDER:
            raise InputError(f"contact positions need at least 4 x 4 x 4 coefficients per gauge, got {shape}")
        if self.error.shape != (shape[0], shape[3] - 2) or not (self.error >= 0).all():
            raise InputError(f"contact positions need {shape[0]} x {shape[3] - 2} errors of at least 0")
        if not (np.isfinite(self.coefficients).all() and np.isfinite(self.error).all()):
            raise InputError("the coefficients and errors of contact positions must be finite")

    @property
    def cells(self) -> tuple[int, int, int]:
        """Number of cells over force, over modulus and over x."""
        _, m, n, k = self.coefficients.shape
        return m - SPLINE_DEGREE, n - SPLINE_DEGREE, k - SPLINE_DEGREE

    @property
    def step_mm(self) -> float:
        """Width of a cell of x."""
        return 2 * self.reach_mm / self.cells[2]

    @cached_property
    def spline(self) -> Spline:
        """Spline of the change of the readings over (ln force, ln modulus, x)."""
        axes = self.force_axis, self.modulus_axis
        starts, steps = [axis.start for axis in axes], [axis.step for axis in axes]
        return Spline(self.coefficients, [*starts, -self.reach_mm], [*steps, self.step_mm])

    def change(self, force_N: ArrayLike, modulus_MPa: ArrayLike, position_mm: ArrayLike) -> np.ndarray:
        """(..., g) change in microstrain / N at forces, moduli and positions that broadcast; NaN outside the domain."""
        inside, *point = self.domain(force_N, modulus_MPa)
        position = np.asarray(position_mm, float)
        reached = np.abs(position) <= self.reach_mm
        value = self.spline(*point, np.where(reached, position, 0.0))
        return np.where((inside & reached)[..., None], value, np.nan)


class CompactStatus(Named):
    """Status of an answer of the compact form; the exported C code has the same numbers."""

    OK = 0
    FORCE_OUTSIDE = 1
    NO_READING = 2
    SOFTER = 3
    HARDER = 4


class CompactAnswer(NamedTuple):
    """A modulus in MPa with its standard deviation and 95 % interval; NaN if the status is not OK."""

    status: CompactStatus
    modulus_MPa: float = math.nan
    sigma_MPa: float = math.nan
    lower_MPa: float = math.nan
    upper_MPa: float = math.nan


@dataclass(frozen=True, eq=False)
class Compact:
    """Five coefficients with an inverse in closed form, for a microcontroller: finger and specimen as two springs.

    ln S_d = a + b x + c x^2 - ln(1 + exp(d + e x) / E), x = ln f: S_d is that on a rigid specimen, reduced by the
    deformation of the specimen. The form has as many coefficients as the published quadratic, but it saturates with E.

    Parameters
    ----------
    coefficients : (5,) a ... e, with f in N, E in MPa and S_d in microstrain.
    force_N, modulus_MPa : fitted ranges; outside of them there is no answer.
    rms, max : relative errors of the modulus, over the presses that were fitted.
    sd_rms : relative rms error of S_d there.
    doubt : relative standard deviation of S_d from mesh, large strain and friction.

    Raises `InputError` for other than five finite coefficients.
    """

    coefficients: np.ndarray
    force_N: tuple[float, float]
    modulus_MPa: tuple[float, float]
    rms: float
    max: float
    sd_rms: float
    doubt: float = 0.0
    __repr__ = short_repr

    def __post_init__(self):
        if np.shape(self.coefficients) != (len(COMPACT_TERMS),) or not np.isfinite(self.coefficients).all():
            raise InputError("the compact form has five finite coefficients")

    def predict(self, force_N: ArrayLike, modulus_MPa: ArrayLike) -> np.ndarray:
        """S_d in microstrain at forces (N) and moduli (MPa) that broadcast, inside the ranges or not."""
        return np.exp(ln_sd(self.coefficients, np.log(force_N), np.log(modulus_MPa)))

    def invert(
        self, sd_microstrain: float, force_N: float, sd_sigma: float = 0.0, force_sigma: float = 0.0
    ) -> tuple[float, float]:
        """The modulus in MPa and its standard deviation; (NaN, NaN) if the status of `answer` is not ok."""
        answer = self.answer(sd_microstrain, force_N, sd_sigma, force_sigma)
        return answer.modulus_MPa, answer.sigma_MPa

    def answer(
        self, sd_microstrain: float, force_N: float, sd_sigma: float = 0.0, force_sigma: float = 0.0
    ) -> CompactAnswer:
        """The modulus with sigma, 95 % interval and status; sd_sigma, force_sigma : of the two inputs.

        E = exp(d + e x) / (exp(a + b x + c x^2) / S_d - 1); sigma_lnE^2 = rms^2 + (sigma_lnS / s)^2 with s = dlnS/dlnE.
        """
        if not self.force_N[0] <= force_N <= self.force_N[1]:
            return CompactAnswer(CompactStatus.FORCE_OUTSIDE)
        if not 0 < sd_microstrain < math.inf:
            return CompactAnswer(CompactStatus.NO_READING)
        a, b, c, d, e = map(float, self.coefficients)
        x = math.log(force_N)
        room = math.exp(a + (b + c * x) * x) / sd_microstrain - 1
        spring = math.exp(d + e * x)
        if room <= 0 or spring / room > self.modulus_MPa[1]:
            return CompactAnswer(CompactStatus.HARDER)
        if spring / room < self.modulus_MPa[0]:
            return CompactAnswer(CompactStatus.SOFTER)
        modulus = spring / room
        along_modulus = room / (1 + room)
        along_force = b + 2 * c * x - e * along_modulus
        noise = math.sqrt(self.doubt**2 + (sd_sigma / sd_microstrain) ** 2 + (along_force * force_sigma / force_N) ** 2)
        relative = math.sqrt(self.rms**2 + (noise / along_modulus) ** 2)
        ends = (modulus * math.exp(sign * NORMAL_FACTOR * relative) for sign in (-1, 1))
        return CompactAnswer(CompactStatus.OK, modulus, modulus * relative, *ends)


def ln_sd(coefficients: np.ndarray, ln_force: np.ndarray, ln_modulus: np.ndarray) -> np.ndarray:
    """The form, at arrays that broadcast."""
    a, b, c, d, e = coefficients
    x = np.asarray(ln_force, float)
    return a + (b + c * x) * x - np.log1p(np.exp(d + e * x - ln_modulus))
