"""`Problem`: measured presses and a family of fingers as weighted residuals of parameters, with their Jacobian.

Readings are linear in gains, levers and zeros, which are solved inside a fit over the other parameters (variable
projection, Golub and Pereyra 2003, doi:10.1088/0266-5611/19/2/201; its Jacobian after Kaufman 1975,
doi:10.1007/BF01932995). An error of the force changes all values of a press together; the weights contain this
correlation.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from papilla.core.units import STRAIN_PER_MICROSTRAIN
from papilla.fem.pressing.off_apex import MOVED_CHANGE_ERROR
from papilla.fem.pressing.response import RATIO_LIMITS
from papilla.identification.noise import PressNoise
from papilla.identification.parameters import LEVER_PER_GAIN_MM, PARAMETERS_BY_NAME, kind, physical, scaled
from papilla.identification.presses import FeltBy, Known, PressedShape, felt_by, places
from papilla.logs import PressLog
from papilla.mesh.body import narrowest_mm
from papilla.model.finger import Finger

MISSING_SIGMA = 1e9
"""Standard deviation for values that a press did not measure, relative to the channel's own."""

RATIO_FAMILY_DISTANCE = 0.01
"""Distance of ln of the moduli's ratio from the family that counts as one standard deviation."""

FIRST_EXPONENT = 0.67
"""Exponent of readings over force until the model gives a better one: Hertz's."""

LEAST_GAIN, MOST_GAIN = 1e-4, 2.0
"""Gains below the first value are those of a foil that does not respond; no gain is above the second."""

LEVERS_PER_GAIN_MM = np.linspace(-2.0, 1.0, 13)
"""Ratios of lever to gain among which the largest possible gain is searched."""

CANCELLING_SHARE = 0.2
"""Share of the largest of these readings below which strain and curvature are not assumed to cancel."""

OUTLYING_RESIDUAL = 4.0
"""Weighted residual above which a reading counts less (Cauchy weights)."""

PRIOR_MEANS = {"common_lever_mm": LEVER_PER_GAIN_MM, "stick_share": 0.5}
"""Means of priors that are not 0 or, for a logarithmic parameter, not the start value."""

MODEL_ERROR_PATTERNS = 3
"""Number of independent errors of the model, which changes sign once or twice along the force and hardly with the
modulus (against the independent code): more presses than this do not average it further."""

LEFT_OF_SINGLE_ERROR = 0.29
"""Share of a single press's error, by which the mesh's contact grows in steps, that is left in a response: the root of
its terms over its presses."""

CURVATURE_RELATIVE_ERROR = 2.0
"""Relative error of the curvature over that of the strain."""

ALIKE_ZEROS, ZERO_TAIL_FREEDOM = 1.5, 4.0
"""Prior of a zero: Student's t of so many degrees of freedom, as wide as so many times the gauges' median zero, because
amplifiers of one bench are balanced alike; a single one may still be far off."""

SOFT_SPECIMEN_ERROR = 0.15
"""Relative error of strain and indentation per F / (E H^2), H being `narrowest_mm` and E the specimen's modulus: what
is left of a block's own large strain (`papilla.fem.pressing.specimen_strain`), the contact's area not being known."""

ASIDE_PER_MM2 = 3e-4
"""Relative standard deviation of an indentation 1 mm beside the apex, which is assumed to equal that at the apex; it
grows with the square of the distance."""


def unread(
    finger: Finger,
    force_N: np.ndarray,
    modulus_MPa: np.ndarray,
    place_mm: np.ndarray | None = None,
    indentation_mm: np.ndarray | None = None,
) -> PressLog:
    """A log of presses (n,) that measured nothing yet, at the apex or at places (n, 2)."""
    names, spots = tuple(gauge.name for gauge in finger.gauges), () if place_mm is None else place_mm.T
    return PressLog(force_N, modulus_MPa, np.zeros((len(force_N), len(names))), names, indentation_mm, *spots)


def sd_and_shares(readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """S_d (n,) of readings (n, g), and its derivatives (n, g) by each of them."""
    about = readings - readings.mean(axis=1, keepdims=True)
    sd = np.sqrt((about**2).mean(axis=1))
    return sd, about / np.maximum(readings.shape[1] * sd, np.finfo(float).tiny)[:, None]


@dataclass(frozen=True, eq=False)
class Modelled:
    """Modelled measurements for a parameter vector: n presses, c channels (gauges, or S_d alone, in microstrain, and
    indentation in mm).

    values : (n, c). by_free : (n, c, f) derivatives by the free parameters in the scale of the fit. by_ln_force (n, c).
    by_ln_modulus : (n, c), by the specimen's. unsure : (n, c) standard deviations of the model's error.
    """

    values: np.ndarray
    by_free: np.ndarray
    by_ln_force: np.ndarray
    by_ln_modulus: np.ndarray
    unsure: np.ndarray


@dataclass(frozen=True, eq=False)
class Problem:
    """Presses of a log on a finger of one geometry; n presses, g gauges, f free parameters.

    held : every parameter's value in its unit; for the free ones the start value. free : names, the nonlinear ones
    first. specimens : those whose moduli are parameters, by name. candidates : True if the presses have not been made
    yet and each is judged alone.
    weights : (n, c, c) whiten the values of a press; robust (n, c) are their weights.
    gains : (g,) approximate gains, for the prior of the levers. zero_sigmas : (g,) those of the zeros, in µε.
    """

    log: PressLog
    finger: Finger
    shapes: tuple[PressedShape, ...]
    held: Mapping[str, float]
    free: tuple[str, ...]
    noise: PressNoise
    weights: np.ndarray | None = None
    robust: np.ndarray | None = None
    gains: np.ndarray | None = None
    zero_sigmas: np.ndarray | None = None
    specimens: Mapping[str, Known] = field(default_factory=dict)
    candidates: bool = False

    # ---- parameters

    @cached_property
    def linear(self) -> np.ndarray:
        """(f,) bool: the free parameters in which the readings are linear."""
        return np.array([PARAMETERS_BY_NAME[kind(name)].linear for name in self.free], bool)

    @cached_property
    def start(self) -> np.ndarray:
        """(f,) start values of the free parameters, in the scale of the fit."""
        return np.array([scaled(name, self.held[name]) for name in self.free])

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """(f,) lowest and highest values in the scale of the fit."""
        low, high = (
            np.array([getattr(PARAMETERS_BY_NAME[kind(name)], side) for name in self.free]) for side in ("low", "high")
        )
        return self.start + low, self.start + high

    @cached_property
    def priors(self) -> dict[str, tuple[float, float]]:
        """Mean and standard deviation of each free parameter's prior, in the scale of the fit. The mean of a
        logarithmic parameter is its start value; the prior of a lever is on its ratio to the gain."""
        priors = {}
        for name in self.free:
            parameter = PARAMETERS_BY_NAME[kind(name)]
            middle = scaled(name, self.held[name]) if parameter.logarithmic else PRIOR_MEANS.get(kind(name), 0.0)
            priors[name] = middle, self.specimens[name].sigma if name in self.specimens else parameter.sigma
        return priors

    def moduli(self, values: Mapping[str, float]) -> np.ndarray:
        """(n,) moduli of the specimens in MPa."""
        moduli = self.log.modulus_MPa.astype(float)
        for name, specimen in self.specimens.items():
            moduli[specimen.rows] = values[name]
        return moduli

    def values(self, vector: np.ndarray) -> dict[str, float]:
        """All parameters in their units, the free ones from a vector (f,) in the scale of the fit."""
        pairs = zip(self.free, vector.tolist(), strict=True)
        return {**self.held, **{name: physical(name, value) for name, value in pairs}}

    def of(self, force_N: np.ndarray, modulus_MPa: np.ndarray, place_mm: np.ndarray | None = None) -> "Problem":
        """The problem of other presses (n,) on the first shape of specimen, at the apex or at places (n, 2); nothing is
        measured or weighted yet, and each press is judged alone."""
        deep = None if self.log.indentation_mm is None else np.ones(len(force_N))
        log = unread(self.finger, force_N, modulus_MPa, place_mm, deep)
        shape = replace(self.shapes[0], rows=np.arange(len(log)))
        nobody = {name: replace(specimen, rows=np.zeros(0, int)) for name, specimen in self.specimens.items()}
        return replace(self, log=log, shapes=(shape,), specimens=nobody, candidates=True, weights=None, robust=None)

    # ---- what presses measure

    @cached_property
    def measured(self) -> np.ndarray:
        """(n, c) readings in microstrain, then indentations in mm, if there are any; NaN where a value is missing."""
        read = self.log.readings if self.log.stated_sd is None else self.log.stated_sd[:, None]
        return read if self.log.indentation_mm is None else np.column_stack([read, self.log.indentation_mm])

    @cached_property
    def gauges(self) -> tuple[str, ...]:
        """Names of the gauges."""
        return tuple(gauge.name for gauge in self.finger.gauges)

    @property
    def reading_names(self) -> tuple[str, ...]:
        """The channels that are readings: the gauges, or S_d alone."""
        return self.gauges if self.log.stated_sd is None else ("S_d",)

    @property
    def reading_noise(self) -> float:
        """Standard deviation of one reading, in microstrain."""
        of_a_gauge = self.noise.readings_microstrain
        return of_a_gauge if self.log.stated_sd is None else of_a_gauge / len(self.gauges) ** 0.5

    def modelled(self, vector: np.ndarray) -> Modelled:
        """Modelled measurements for a parameter vector (f,) in the scale of the fit."""
        values = self.values(vector)
        felt, g = self.felt(values), len(self.gauges)
        # (q, g) weights of the gauges' values in readings in microstrain
        gain, lever = self.each("gain", values), self.each("lever_mm", values)
        mix = (
            np.array([gain, lever + gain * values["common_lever_mm"]]) * values["common_gain"] / STRAIN_PER_MICROSTRAIN
        )

        def channels(parts: np.ndarray, deep: np.ndarray) -> np.ndarray:
            return np.column_stack([np.einsum("nqg,qg->ng", parts, mix), deep])

        measurements = channels(felt.values, felt.depth + values["touch_down_mm"])
        measurements[:, :g] += self.each("zero_microstrain", values)
        by = {name: channels(felt.slopes[name], felt.depth_slopes[name]) for name in felt.slopes}
        for name, specimen in self.specimens.items():
            by[name] = by["modulus"] * np.isin(np.arange(len(self.log)), specimen.rows)[:, None]
        # Derivative of every measurement by each free parameter: what the finger feels (moduli, places, friction), the
        # zero of the stage, common factors, or one gauge's own factors.
        columns = np.zeros((*measurements.shape, len(self.free)))
        for place, name in enumerate(self.free):
            which, _, gauge = name.partition(".")
            if name in by:
                columns[:, :, place] = by[name]
            elif which == "touch_down_mm":
                columns[:, g:, place] = 1.0
            elif which in ("common_gain", "common_lever_mm"):
                slope = mix if which == "common_gain" else np.array([0 * mix[0], mix[0]])
                columns[:, :g, place] = np.einsum("nqg,qg->ng", felt.values, slope)
            else:
                k = self.gauges.index(gauge)
                factor = values["common_gain"] / STRAIN_PER_MICROSTRAIN
                gain = felt.values[:, 0, k] + values["common_lever_mm"] * felt.values[:, 1, k]
                parts = {"gain": factor * gain, "lever_mm": factor * felt.values[:, 1, k]}
                columns[:, k, place] = parts.get(which, 1.0)
        errors = self._model_errors(values)
        # The model's error is a share of the usual size of the gauges, not of the single gauge, which may read nearly
        # nothing.
        size = np.sqrt((felt.values**2).mean(axis=2, keepdims=True)) * errors[:, 1:].reshape(felt.values.shape)
        moved = MOVED_CHANGE_ERROR * np.sqrt(
            (felt.changed**2).mean(axis=2, keepdims=True) * self._together[:, None, None]
        )
        size = np.hypot(size, moved)
        aside = (places(self.log) ** 2).sum(axis=1) * ASIDE_PER_MM2
        unsure = np.column_stack([np.sqrt(((size * mix) ** 2).sum(axis=1)), np.hypot(errors[:, 0], aside) * felt.depth])
        return self._measurable(Modelled(measurements, columns, by["force"], by["modulus"], unsure))

    @cached_property
    def _together(self) -> np.ndarray:
        """(n,) number of presses at the same place as each: they share the error of moved contacts, so they count as
        one for it."""
        if self.candidates:
            return np.ones(len(self.log))
        _, which, counts = np.unique(places(self.log), axis=0, return_inverse=True, return_counts=True)
        return counts[which]

    def felt(self, values: Mapping[str, float]) -> FeltBy:
        """Gauge values and indentations of the presses, and their derivatives, for parameter values."""
        return felt_by(self.shapes, self.log, self.moduli(values), values, self.gauges)

    def each(self, name: str, values: Mapping[str, float]) -> np.ndarray:
        """(g,) values of a parameter that each gauge has, such as "gain"."""
        return np.array([values[f"{name}.{gauge}"] for gauge in self.gauges])

    def _measurable(self, every: Modelled) -> Modelled:
        """The channels that the log has: S_d in place of the gauges, or no indentation."""
        g, log = len(self.gauges), self.log
        parts = [every.values, every.by_free, every.by_ln_force, every.by_ln_modulus, every.unsure]
        if log.stated_sd is not None:
            sd, share = sd_and_shares(every.values[:, :g])
            slopes = [np.einsum("ng,ng...->n...", share, channels[:, :g])[:, None] for channels in parts[1:4]]
            read = [sd[:, None], *slopes, np.sqrt(((share * every.unsure[:, :g]) ** 2).sum(axis=1, keepdims=True))]
            parts = [
                np.concatenate([channels, all_channels[:, g:]], axis=1)
                for channels, all_channels in zip(read, parts, strict=True)
            ]
        if log.indentation_mm is None:
            parts = [channels[:, : len(self.reading_names)] for channels in parts]
        return Modelled(*parts)

    # ---- residuals

    def residuals(self, vector: np.ndarray) -> np.ndarray:
        """(m,) weighted: measured minus modelled values for a vector (f,), then the priors."""
        return self.linearised(vector)[0]

    def jacobian(self, vector: np.ndarray) -> np.ndarray:
        """(m, f) derivatives of `residuals`."""
        return self.linearised(vector)[1]

    def linearised(self, vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals and Jacobian together."""
        modelled = self.modelled(vector)
        off = np.nan_to_num(self.measured - modelled.values)  # Zero where nothing was measured
        pulls, slopes = self._prior(vector)
        residuals = np.concatenate([self._weighted(off[:, :, None])[:, 0], pulls])
        return residuals, np.vstack([self._weighted(-modelled.by_free), slopes])

    def solved(self, outside: np.ndarray) -> np.ndarray:
        """The vector (f,) with the best linear parameters, at given values of the others."""
        vector = self.start.copy()
        vector[~self.linear] = outside
        if self.linear.any():
            # Linear in these parameters: one least-squares step from anywhere ends at the best.
            residuals, jacobian = self.linearised(vector)
            vector[self.linear] -= np.linalg.lstsq(jacobian[:, self.linear], residuals)[0]
        return vector

    def projected(self, outside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals (m,) with the best linear parameters, and their Jacobian (m, others) by the others."""
        vector = self.solved(outside)
        residuals, jacobian = self.linearised(vector)
        # Kaufman's Jacobian: the part of each column that the linear parameters cannot follow.
        inner = np.linalg.qr(jacobian[:, self.linear])[0]
        outer = jacobian[:, ~self.linear]
        return residuals, outer - inner @ (inner.T @ outer)

    def _weighted(self, rows: np.ndarray) -> np.ndarray:
        """Rows (n, c, k), whitened, weighted and flattened: (n c, k)."""
        assert self.weights is not None and self.robust is not None, "a problem is weighted before it is solved"
        return ((self.weights @ rows) * self.robust[:, :, None]).reshape(-1, rows.shape[2])

    @cached_property
    def _prior_rows(self) -> tuple[np.ndarray, np.ndarray]:
        """(p, f) and (p,): the priors as rows . vector - target, divided by their standard deviations."""
        rows, target = np.zeros((len(self.free), len(self.free))), np.zeros(len(self.free))
        sizes = np.maximum(np.abs(np.ones(len(self.gauges)) if self.gains is None else self.gains), LEAST_GAIN)
        for place, name in enumerate(self.free):
            which, _, gauge = name.partition(".")
            middle, sigma = self.priors[name]
            if which == "zero_microstrain" and self.zero_sigmas is not None:
                sigma = self.zero_sigmas[self.gauges.index(gauge)]
            if which != "lever_mm":
                rows[place, place], target[place] = 1 / sigma, middle / sigma
                continue
            # The prior is on lever - ratio x gain, relative to the largest possible gain. Relative to the fitted gain,
            # the fit could satisfy it by shrinking gain and lever.
            gain = sizes[self.gauges.index(gauge)]
            rows[place, place] = 1 / (sigma * gain)
            gain_name = f"gain.{gauge}"
            if gain_name in self.free:
                rows[place, self.free.index(gain_name)] = -LEVER_PER_GAIN_MM / (sigma * gain)
            else:
                target[place] = LEVER_PER_GAIN_MM * self.held[gain_name] / (sigma * gain)
        return rows, target

    def _prior(self, vector: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(f + 1,) pulls of the priors, over their standard deviations, and their derivatives (f + 1, f). The last one
        is a penalty on ratios of moduli outside of the family."""
        rows, target = self._prior_rows
        last, beyond = np.zeros(len(self.free)), self.beyond(vector)
        if beyond:
            for name, sign in (("outer_modulus_MPa", 1.0), ("inner_modulus_MPa", -1.0)):
                if name in self.free:
                    last[self.free.index(name)] = sign / RATIO_FAMILY_DISTANCE
        return np.append(rows @ vector - target, beyond / RATIO_FAMILY_DISTANCE), np.vstack([rows, last])

    def beyond(self, vector: np.ndarray) -> float:
        """Distance of ln(outer / inner modulus) from the range of the family."""
        values = self.values(vector)
        ratio = values["outer_modulus_MPa"] / values["inner_modulus_MPa"]
        return float(np.log(ratio / np.clip(ratio, *RATIO_LIMITS)))

    # ---- weights

    def weighted(self, vector: np.ndarray | None = None) -> "Problem":
        """The problem with the weights that follow from a vector (f,); without a vector, from the readings."""
        if vector is None:
            # No model yet: readings grow about as the force to the power of 0.67, and the model's error is a share of
            # them.
            slope = FIRST_EXPONENT * np.nan_to_num(self.measured)
            weights = self._whitener(slope, self.noise.model * np.abs(np.nan_to_num(self.measured)))
            values, robust = dict(self.held), np.ones(self.measured.shape)
            return replace(self, weights=weights, robust=robust, gains=self._most_gain(self.felt(values).values))
        modelled, values = self.modelled(vector), self.values(vector)
        gains = np.maximum(np.abs(self.each("gain", values)), self._most_gain(self.felt(values).values))
        return replace(self, weights=self._whitener(modelled.by_ln_force, modelled.unsure), gains=gains)

    def with_alike_zeros(self, vector: np.ndarray, sigma: np.ndarray) -> "Problem":
        """The problem with priors of the zeros that follow from all zeros of a fit, a vector (f,) and its standard
        deviations (f,)."""
        places = [place for place, name in enumerate(self.free) if kind(name) == "zero_microstrain"]
        if len(places) < len(self.gauges):
            return self
        zeros, widest = vector[places], PARAMETERS_BY_NAME["zero_microstrain"].sigma
        scale = ALIKE_ZEROS * float(np.median(np.hypot(zeros, sigma[places])))
        return replace(self, zero_sigmas=np.minimum(np.hypot(scale, zeros / ZERO_TAIL_FREEDOM**0.5), widest))

    def _most_gain(self, felt: np.ndarray) -> np.ndarray:
        """(g,) largest gains that could give readings of this size, over the levers of the prior."""
        if self.log.stated_sd is not None:
            return np.ones(len(self.gauges))
        # Zeros do not count, so compare changes from press to press. The smallest modelled size over all levers asks
        # for the largest gain.
        moved = self.log.readings - self.log.readings.mean(axis=0)
        parts = (felt - felt.mean(axis=0)) / STRAIN_PER_MICROSTRAIN
        sizes = [np.sqrt(((parts[:, 0] + lever * parts[:, 1]) ** 2).mean(axis=0)) for lever in LEVERS_PER_GAIN_MM]
        least = np.maximum(np.min(sizes, axis=0), CANCELLING_SHARE * np.max(sizes, axis=0))
        size = np.sqrt((moved**2).mean(axis=0))
        return size / np.maximum(least, size / MOST_GAIN + np.finfo(float).tiny)

    def _whitener(self, slope: np.ndarray, unsure: np.ndarray) -> np.ndarray:
        """(n, c, c) matrices that make the errors of each press independent with variance one; slope : (n, c) by ln
        force."""
        noise = self.noise
        spread = np.full(self.measured.shape, self.reading_noise**2)
        spread[:, len(self.reading_names) :] = noise.indentation_mm**2
        spread += unsure**2
        # A missing value gets a standard deviation so large that it has no weight.
        spread[np.isnan(self.measured)] *= MISSING_SIGMA**2
        # An error of the force moves all channels of a press along their slopes: a matrix of rank one.
        covariance = noise.force**2 * slope[:, :, None] * slope[:, None, :]
        covariance += np.eye(len(spread[0])) * spread[:, None, :]
        return np.linalg.inv(np.linalg.cholesky(covariance))

    def strained(self, inner: float) -> np.ndarray:
        """(n,) bool: presses that strain a finger of this inner modulus (MPa) beyond the measured range of large
        strain."""
        beyond = np.zeros(len(self.log), bool)
        for shape in self.shapes:
            forces = self.log.force_N[shape.rows]
            beyond[shape.rows] = np.any([one.beyond_large_strain(forces, inner) for one in shape.responses], axis=0)
        return beyond

    def _model_errors(self, values: Mapping[str, float]) -> np.ndarray:
        """(n, 1 + q g) relative errors of the model for each press: indentation, then the gauges' values."""
        errors = np.zeros((len(self.log), 1 + 2 * len(self.gauges)))
        alike = 1.0 if self.candidates else max(1.0, len(self.log) / MODEL_ERROR_PATTERNS) ** 0.5
        felt = np.repeat(self.noise.model * np.array([1.0, CURVATURE_RELATIVE_ERROR]), len(self.gauges))
        model = alike * np.append(self.noise.depth, felt)
        for shape in self.shapes:
            errors[shape.rows] = np.hypot(model, LEFT_OF_SINGLE_ERROR * shape.responses[0].error)
        softness = self.log.force_N / self.moduli(values) / narrowest_mm(self.finger) ** 2
        beyond = np.where(self.strained(values["inner_modulus_MPa"]), self.noise.beyond, 0.0)
        return np.hypot(errors, np.hypot(SOFT_SPECIMEN_ERROR * softness, beyond)[:, None])

    def downweighted(self, vector: np.ndarray) -> "Problem":
        """The problem in which a weighted reading counts less if it exceeds `OUTLYING_RESIDUAL` (Cauchy's weights)."""
        assert self.weights is not None
        off = np.nan_to_num(self.measured - self.modelled(vector).values)
        whitened = (self.weights @ off[:, :, None])[:, :, 0]
        return replace(self, robust=1 / np.sqrt(1 + (whitened / OUTLYING_RESIDUAL) ** 2))
