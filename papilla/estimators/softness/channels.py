"""What the channels of a touch (gauges, or S_d alone, and the force) read at a contact, and which errors they have.

`GaugeSurfaces` and `SdReading` give the readings that the calibration expects at (force, modulus, x), with slopes.
`Doubts` are the errors that are constant in a touch. `Channels` linearises both at a contact: slopes by h, a scale of
ln E on which readings change along straight lines; by theta, all errors in their standard deviations; and by the
sample's own force and place. A linearisation costs 35 microseconds.
"""

import math
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import ClassVar, NamedTuple

import numpy as np

from papilla.calibration import Calibration
from papilla.calibration.surface import ModulusCurve, spline_of
from papilla.core.errors import InputError
from papilla.model.specimen import THICKNESS_MM

THIN_MM, THIN_SIGMAS = 3.0, 1.7
"""Thickness that lies this many standard deviations below the mean if the thickness is unknown."""
SHIFT_PER_FORCE, SHIFT_POWER, THICKNESS_POWER, SHIFT_ERROR = 10.2, 0.72, -1.5, 0.1
"""A bonded block h mm thick instead of h0 presses like one whose ln E is higher by 10.2 f^0.72 (h^-1.5 - h0^-1.5), f in
N: presses of the default finger, 0.05-0.72 MPa, 3 to 20 mm, within 0.1 or a tenth of it."""
BESIDE_SHARE = 0.017
"""All readings fall by this share 1 mm beside the apex across the row of gauges, and with the square of the distance:
0.4 to 3 % by gauge and load in presses of the default finger (the rest is within the gauges' gains)."""
SHAPE_ERROR = 0.4
"""Relative error, per factor of e of the force, of the growth of the effect of the thickness with the force."""
SPREAD_FORCE = 0.5
"""Prior standard deviation of a sample's ln force about that of the one before (for the place it is the reach of the
calibration): so wide that the prior has almost no weight."""
BENT_PLACE = 0.2
"""A step of 1 mm bends the readings as much as a step of ln force by this much."""
SLOT_LEVEL, TANGENT_REACH_LEVELS, SLOT_JITTER = 0.05, 3.0, 6.0
"""Samples of a slot lie within SLOT_LEVEL of the same measure; a tangent is valid for steps TANGENT_REACH_LEVELS times
as long; noise alone moves a sample by up to SLOT_JITTER standard deviations."""
MOST_SLOT_SAMPLES = 64
"""Largest number of samples that are learnt together."""
CACHED_CONTACTS, ERROR_STEPS_PER_UNIT, FINE_MM = 1024, 100, 50
"""What is computed for a contact is kept for this many; errors of the calibration, on steps of 1 / ERROR_STEPS_PER_UNIT
of ln force and ln modulus, and of 1 / FINE_MM mm of the place."""
LEGENDRE_ORDERS = 3
"""The calibration's error is a smooth function of ln force: so many Legendre polynomials."""
LEAST_NOISE = 1e-6
"""Smallest noise relative to the largest reading and force; below it there is only rounding."""
ZERO_WALK, CREEP_WALK = 1e-4, 1e-2
"""Zeros and creep change slowly: after n samples exp(-n WALK / 2) of what was known of them is left."""
EQUAL_SURFACE_DIFFERENCE = 1e-6
"""Relative difference up to which two surfaces count as one: gauges that mirror each other share their errors."""
LEAST_MEASURE_SLOPE = 1e-3
"""Smallest slope of h relative to the steepest dh / d ln E: h is only a scale, and must rise even if readings hardly
change."""


@dataclass(frozen=True)
class Doubts:
    """Standard deviations of errors that are constant in a touch; all of them are in the modulus' sigma.

    gauge_gain : relative, of each gauge; creep : relative, of all gauges alike. zero_microstrain : of each gauge, half
    of that once it was seen in the air. force_gain : relative. force_offset_N : of the force's zero, half of that too
    once it was seen. beside_mm : distance of the contact from the row of gauges (y), which the row cannot
    measure; x is an unknown of its own. thickness_mm : of the specimen, None where it is not known (then 3 mm are 1.7
    standard deviations from the calibrated thickness); thickness_error : relative, of a stated one. The defaults are
    what a careful lab has; `Doubts.NONE` has none.

    Raises `InputError` for values below 0, or a thickness that is not above 0.
    """

    gauge_gain: float = 0.03
    creep: float = 0.02
    zero_microstrain: float = 200.0
    force_gain: float = 0.02
    force_offset_N: float = 0.006
    beside_mm: float = 1.0
    thickness_mm: float | None = None
    thickness_error: float = 0.05

    NONE: ClassVar["Doubts"]

    def __post_init__(self):
        for name in (field.name for field in fields(self)):
            value = getattr(self, name)
            if value is not None and not 0 <= value < math.inf:
                raise InputError(f"{name} must be at least 0 and finite, got {value}")
        if self.thickness_mm == 0:
            raise InputError("thickness_mm must be greater than 0, or None where it is not known, got 0")

    def thickness_shift(self, calibrated_mm: float) -> tuple[float, float]:
        """Mean and standard deviation of what the thickness adds to the apparent ln E at 1 N."""
        stated = self.thickness_mm
        thickness = min(THIN_MM, calibrated_mm / 2) if stated is None else stated
        shift = SHIFT_PER_FORCE * (thickness**THICKNESS_POWER - calibrated_mm**THICKNESS_POWER)
        if stated is None:
            return 0.0, abs(shift) / THIN_SIGMAS
        along = -THICKNESS_POWER * SHIFT_PER_FORCE * stated**THICKNESS_POWER * self.thickness_error
        return shift, math.hypot(along, SHIFT_ERROR * shift)


Doubts.NONE = Doubts(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, THICKNESS_MM, 0.0)


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
            another = gauge.surface
            if (another.force_N, another.modulus_MPa, another.cells) != (first.force_N, first.modulus_MPa, first.cells):
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
        friction_changes = [change for change in changes if change is not None]
        self.friction_known = len(friction_changes) < self.channels
        if not self.friction_known:
            self._friction = spline_of(friction_changes).at

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


class SdReading:
    """S_d of all gauges as the only reading; raises `InputError` if it does not rise with the modulus."""

    channels, reach, groups = 1, 0.0, (0,)

    def __init__(self, calibration: Calibration):
        surface = calibration.surface
        self._surface, self.friction_known = surface, surface.uncertainty.friction is None
        table = surface.surface
        self.force_N = table.force_N
        self._spline = table.spline.at
        middle = 0.5 * (math.log(table.force_N[0]) + math.log(table.force_N[1]))
        low, high = surface.usable_nodes(middle)
        if low >= high:
            raise InputError("S_d of this calibration does not rise with the modulus: no softness can be estimated")
        self.ln_nodes = np.log(table.modulus_axis.nodes)[low : high + 1]

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
    differences = np.abs(tables[:, None] - tables).max(axis=(2, 3))
    first_alike = (differences <= EQUAL_SURFACE_DIFFERENCE * np.abs(tables).max(axis=(1, 2))).argmax(axis=0)
    return tuple(np.unique(first_alike, return_inverse=True)[1].tolist())


def distance_curve(slopes: np.ndarray, start: float, per_step: float) -> ModulusCurve:
    """A rising curve h(ln E) from dh / d ln E > 0 at its n + 1 nodes: piecewise cubic Hermite, slopes limited so that
    it rises everywhere (Fritsch and Carlson 1980, doi:10.1137/0717021)."""
    slopes = np.maximum(slopes, LEAST_MEASURE_SLOPE * slopes.max())
    steps = 0.5 * (slopes[:-1] + slopes[1:]) / per_step
    values = np.concatenate([[0.0], np.cumsum(steps)])
    ends = slopes / per_step
    begin, end = np.minimum(ends[:-1], 3 * steps), np.minimum(ends[1:], 3 * steps)
    cubics = np.column_stack([values[:-1], begin, 3 * steps - 2 * begin - end, begin + end - 2 * steps])
    return ModulusCurve(tuple(map(tuple, cubics.tolist())), tuple(values.tolist()), start, per_step)


class Linear(NamedTuple):
    """Whitened channels near a contact at (ln force, place in mm, h, thickness in its standard deviations): expected
    (c + 1,), slopes H (c + 1, m) in h and theta, B (2, c + 1) in the sample's own ln force and place, each in units of
    its spread (a place that is known has none)."""

    at: tuple[float, float, float, float]
    expected: np.ndarray
    H: np.ndarray
    B: np.ndarray


class Tangent(NamedTuple):
    """Linear model of samples near a contact, in the k channels `rows`.

    `split` (2 + k, k) times the channels of a sample, less `origin` (2 + k,), gives two steps and a residual. The steps
    lead from the contact to the sample's own ln force and place. The residual (k,), whitened, is what no contact
    explains.

    reach : (lowest, highest) of each step for which the model holds; slack : largest difference of each step within a
    slot.
    """

    linear: Linear
    rows: np.ndarray
    split: np.ndarray
    origin: np.ndarray
    reach: tuple[tuple[float, float], ...]
    slack: tuple[float, ...]

    def steps(self, y: np.ndarray, reach, usual: float) -> tuple[float, float] | None:
        """Steps to a sample (c + 1,). None if the tangent does not hold for it: steps beyond `reach`, or a squared
        residual above the usual."""
        force, place, *rest = (self.split @ y[self.rows] - self.origin).tolist()
        (low, high), (least, most) = reach
        within = low <= force <= high and least <= place <= most
        return (force, place) if within and sum([residual * residual for residual in rest]) <= usual else None

    def about(self, steps: tuple[float, float]) -> tuple[tuple[float, float], ...]:
        """The part of `reach` for samples that share a slot with a first sample, given by its steps."""
        ranges = zip(steps, self.slack, self.reach, strict=True)
        return tuple([(max(low, step - slack), min(high, step + slack)) for step, slack, (low, high) in ranges])


class Channels:
    """Linearises samples (c readings, force).

    surfaces : what channels read. reading_sigma (microstrain), force_sigma (N, inf for no sensor) : noise. doubts :
    standard deviations of errors. position_sigma : of the place, mm about the apex; inf where the place is unknown,
    None at the apex.
    """

    def __init__(
        self, surfaces, reading_sigma: float, force_sigma: float, doubts: Doubts, position_sigma: float | None
    ):
        self.surfaces, self.doubts = surfaces, doubts
        c = self.channels = surfaces.channels
        loudest = [surfaces.at(math.log(force), surfaces.ln_nodes[-1], 0.0).reading for force in surfaces.force_N]
        self.noise = np.array([max(reading_sigma, LEAST_NOISE * np.abs(loudest).max())] * c + [force_sigma])
        self.noise[-1] = max(force_sigma, LEAST_NOISE * surfaces.force_N[1])
        self.whiten = 1.0 / self.noise
        self.anywhere, self.position_sigma = position_sigma is not None, position_sigma or 0.0
        self.spread = np.array([SPREAD_FORCE, surfaces.reach])
        self.low, self.high = map(math.log, surfaces.force_N)
        self._softest, self._hardest = float(surfaces.ln_nodes[0]), float(surfaces.ln_nodes[-1])
        cached = lru_cache(maxsize=CACHED_CONTACTS)
        self.ln_modulus = cached(self._ln_modulus)
        self._errors = cached(self._errors_near)
        self._error_at = cached(surfaces.error)
        self._place_error = cached(lambda place: surfaces.place_error(place))
        self._faded_by = cached(lambda samples: self._faded ** (0.5 * samples))
        self._middle, self._half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        self._shift, self._shift_sigma = doubts.thickness_shift(THICKNESS_MM)
        self.columns = self._columns()
        # dh / d ln E at the calibrated nodes, at the middle force: root of the information of one sample about ln E.
        # What the change by the sample's own force explains is taken out of the slope: only the rest tells E.
        nodes, slopes = surfaces.ln_nodes, []
        for node in nodes.tolist():
            _, H, (b, _) = self._channels(self._middle, 0.0, node, 1.0, 0.0)
            a = H[:, 0]
            slopes.append(math.sqrt(max(a @ a - (a @ b) ** 2 / (b @ b + 1.0), 0.0)))
        self.curve = distance_curve(np.array(slopes), float(nodes[0]), 1 / float(nodes[1] - nodes[0]))
        self.top = self.curve.values[-1]

    def _columns(self) -> dict[str, slice]:
        """Columns of H by the name of their error; the first three columns are those that act like a change of ln E."""
        c, groups, doubts = self.channels, max(self.surfaces.groups) + 1, self.doubts
        sizes = {
            "the thickness of the specimen": 2,
            "the zero of the gauges": c,
            "the gain of the gauges": c,
            "the calibration": LEGENDRE_ORDERS * groups,
            "the calibration beside the apex": c if self.anywhere else 0,
            "friction": 0 if self.surfaces.friction_known else 1,
            "creep": 1,
            "the place across the row of gauges (y)": 1,
            "the gain of the force": 1,
            "the offset of the force": 1,
        }
        parts, end = {}, 1
        for name, size in sizes.items():
            parts[name] = slice(end, end + size)
            end += size
        self.size, numbers = end, np.arange(c)
        _, zero, gain, error, off_apex, friction, creep, across, self._force_gain, offset = parts.values()
        self._template, self._of_reading = np.zeros((c + 1, end)), np.zeros((c, end))
        self._template[numbers, zero.start + numbers] = doubts.zero_microstrain * self.whiten[:-1]
        self._template[-1, offset] = doubts.force_offset_N * self.whiten[-1]
        self._of_reading[numbers, gain.start + numbers] = doubts.gauge_gain
        self._of_reading[:, creep], self._of_reading[:, across] = doubts.creep, -BESIDE_SHARE * doubts.beside_mm**2
        self._faded = np.ones(end)
        self._faded[zero], self._faded[creep] = 1 - ZERO_WALK, 1 - CREEP_WALK
        self._shaped = slice(gain.start, off_apex.stop)
        orders = LEGENDRE_ORDERS * np.array(self.surfaces.groups)[:, None] + np.arange(LEGENDRE_ORDERS)
        self._error = numbers[:, None], error.start + orders
        self._beside, self._friction = (numbers, off_apex.start + numbers), friction
        return parts

    def _ln_modulus(self, h: float) -> tuple[float, float]:
        """ln E at h, and dh / d ln E there; beyond the calibrated moduli, the values at their end."""
        values = self.curve.values
        return self.curve.solve(min(max(h, values[0]), values[-1]), 0, len(values) - 1)

    def _errors_near(self, force: int, modulus: int, place: int) -> np.ndarray:
        """(c, m) part of H for errors of calibration and friction, per newton, near a contact in steps of
        `ERROR_STEPS_PER_UNIT`."""
        H, w, surfaces = np.zeros((self.channels, self.size)), self.whiten[:-1], self.surfaces
        ln_force = min(max(force / ERROR_STEPS_PER_UNIT, self.low), self.high)
        ln_modulus = min(max(modulus / ERROR_STEPS_PER_UNIT, self._softest), self._hardest)
        z = (ln_force - self._middle) / self._half
        # The calibration's error is a smooth function of ln force: Legendre polynomials of degree 0, 1 and 2, the
        # latter two half as large. Gauges that mirror each other share it (`_error`).
        H[self._error] = (self._error_at(ln_force) * w)[:, None] * (1.0, 0.5 * z, 0.75 * z * z - 0.25)
        if self.anywhere:
            H[self._beside] = self._place_error(place / FINE_MM) * w
        if not surfaces.friction_known:
            # Two standard deviations reach from the calibration's friction to none
            H[:, self._friction] = (surfaces.without_friction(ln_force, ln_modulus) * (0.5 * w))[:, None]
        return H

    def linear(self, ln_force: float, place: float, h: float, thickness: float = 0.0) -> Linear:
        """The channels at the nearest calibrated contact; thickness: its error in standard deviations."""
        ln_modulus, slope = self.ln_modulus(h)
        ln_force, place = self.inside(ln_force, place)
        return Linear((ln_force, place, h, thickness), *self._channels(ln_force, place, ln_modulus, slope, thickness))

    def _channels(self, ln_force: float, place: float, ln_modulus: float, slope: float, thickness: float):
        """expected, H and B of a `Linear`; slope : dh / d ln E."""
        # A block of another thickness presses like one of another modulus: the surfaces are read at this apparent ln E.
        force = math.exp(ln_force)
        thin = force**SHIFT_POWER
        effect, moved = self._shift_sigma * thin, (self._shift + self._shift_sigma * thickness) * thin
        apparent = min(max(ln_modulus + moved, self._softest), self._hardest)
        r, a, b, d = self.surfaces.at(ln_force, apparent, place)
        expected, w = np.empty(self.channels + 1), self.whiten[:-1]
        expected[:-1], expected[-1] = r, force
        expected *= self.whiten
        H = self._template.copy()
        contact = ERROR_STEPS_PER_UNIT * ln_force, ERROR_STEPS_PER_UNIT * apparent, FINE_MM * place
        H[:-1] += expected[:-1, None] * self._of_reading + force * self._errors(*map(round, contact))
        H[:-1, :3] = (a * w)[:, None] * (1 / slope, effect, effect * SHAPE_ERROR * 2 * (ln_force - self._middle))
        H[-1, self._force_gain] = self.doubts.force_gain * expected[-1]
        B = np.zeros((2, self.channels + 1))
        # Readings change with the sample's force directly, and because the effect of the thickness grows with the
        # force.
        B[0, :-1], B[0, -1] = (b * force + a * (SHIFT_POWER * moved)) * (SPREAD_FORCE * w), SPREAD_FORCE * expected[-1]
        B[1, :-1] = d * (self.surfaces.reach * w)
        return expected, H, B

    def bend(self, linear: Linear, ln_force: float, place: float, h: float, thickness: float) -> float:
        """Distance of a contact from a linearisation, as the squared step of ln force with the same nonlinearity."""
        at, x0, h0, thickness0 = linear.at
        along = (h - h0 + (thickness - thickness0) * self._shift_sigma * math.exp(SHIFT_POWER * at)) / self.top
        return (ln_force - at) ** 2 + (BENT_PLACE * (place - x0)) ** 2 + along * along

    def moved(self, linear: Linear, steps) -> tuple[float, float]:
        """ln force and place after steps from a linearisation; steps are in units of their spread."""
        at, x0, *_ = linear.at
        return at + SPREAD_FORCE * steps[0], x0 + self.surfaces.reach * steps[1]

    def least_reading(self) -> np.ndarray:
        """(c,) smallest |reading| in microstrain at the lowest force, over all moduli."""
        nodes = self.surfaces.ln_nodes.tolist()
        return np.abs([self.surfaces.at(self.low, node, 0.0).reading for node in nodes]).min(axis=0)

    def inside(self, ln_force: float, place: float) -> tuple[float, float]:
        """The nearest calibrated contact, at which to linearise."""
        reach = self.surfaces.reach
        return min(max(ln_force, self.low), self.high), min(max(place, -reach), reach)

    def tangent(self, linear: Linear, rows: np.ndarray) -> Tangent:
        """The tangent at a linearisation, for some channels."""
        B, expected = linear.B[:, rows], linear.expected[rows]
        # Projections of a whitened sample onto its force and place, and onto what neither explains: linear, so both are
        # one matrix, computed once.
        covariance = np.linalg.inv(B @ B.T + np.eye(2) / MOST_SLOT_SAMPLES)
        gain, jitter = covariance @ B, self.spread * np.sqrt(covariance.diagonal())
        split = np.concatenate([self.spread[:, None] * gain, np.eye(len(rows)) - B.T @ gain])
        # Samples may share a slot as long as the curvature between them stays below `SLOT_LEVEL`, plus what noise alone
        # moves.
        bent = math.sqrt(SLOT_LEVEL / max(float(np.abs(expected).max()), 1.0))
        slack = bent + SLOT_JITTER * float(jitter[0]), bent / BENT_PLACE + SLOT_JITTER * float(jitter[1])
        (at, x0, *_), end = linear.at, self.surfaces.reach
        wide = [TANGENT_REACH_LEVELS * step for step in slack]
        ends = zip(wide, ((self.low - at, self.high - at), (-end - x0, end - x0)), strict=True)
        reach = tuple([(max(-far, low), min(far, high)) for far, (low, high) in ends])
        return Tangent(linear, rows, split * self.whiten[rows], split @ expected, reach, slack)
