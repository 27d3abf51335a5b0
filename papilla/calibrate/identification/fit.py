"""From measured presses to the parameters of a finger and their covariance: the problem, and its best fit."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import least_squares

from papilla.calibrate.identification.log_check import refuse, refuse_beyond
from papilla.calibrate.identification.noise import Noise
from papilla.calibrate.identification.parameters import (
    MOVES,
    OF_THE_LOG,
    PARAMETERS,
    checked_values,
    expanded,
    kind,
    linear_last,
    names_of,
    physical,
    start_of,
)
from papilla.calibrate.identification.presses import NOT_TOLD, Known, Shape, needs_places, refuse_far
from papilla.calibrate.identification.problem import MIDDLES, Problem
from papilla.calibrate.identification.repeats import noise_told
from papilla.errors import InputError
from papilla.fem.finite.strain_tables import SPANNING, begin_large_strain
from papilla.fem.pressing.large_strain import ends_of
from papilla.fem.pressing.off_apex import MoveLimits, off_apex_change
from papilla.fem.pressing.response import response
from papilla.fem.reduction.family import FingerFamily, family, with_moduli
from papilla.finger import Bench, Finger
from papilla.identified import Identified
from papilla.logs import PressLog
from papilla.short_repr import html_table
from papilla.specimen import THICKNESS_MM, Block, Friction, Specimen, friction_coefficient, friction_words
from papilla.workers import workers

SIZE_MM = 1.0
"""Element size at the contact for identifications: S_d is within 0.6 % of that on meshes half as fine."""

ROUNDS = 10
"""Fits at most, each with the weights that the one before it implies."""

SETTLED = 0.01
"""Change of every parameter between two of them, in standard deviations, at which they end."""

OUTLYING = 4.0
"""Weighted residual from which a reading counts less and less."""

KEPT = 3
"""Best of the first fits that are followed to the end."""

MOST_UNKNOWN = 0.3
"""Relative standard deviation of a specimen's modulus above which it is refused."""

THICKER = 1.2
"""Factor between the thicknesses that the response is made for, where the thickness is free."""

MISFIT = 1.5
"""Chi-square per degree of freedom from which the model does not fit; all sigmas are then widened by its root."""


@dataclass(frozen=True, eq=False)
class Identification:
    """A finger identified from n presses; f parameters were free.

    problem : presses, model and weights of the last fit. vector : (f,) in the scale of the fit (logarithms, for
    logarithmic parameters), and covariance (f, f) in it. chi_square, freedom : of the presses' weighted residuals.
    rival : cost of the next best minimum above this one, None where all starts came to the same. asked : what was freed
    because the presses asked for it, in a sentence; empty where nothing was.
    """

    problem: Problem
    vector: np.ndarray
    covariance: np.ndarray
    chi_square: float
    freedom: float
    rival: float | None = None
    asked: str = ""

    def __repr__(self) -> str:
        shown = ", ".join(f"{name} {self[name][0]:.4g}" for name in self.names if not PARAMETERS[kind(name)].each_gauge)
        return f"<Identification from {len(self.problem.log)} presses: {shown}>"

    def _repr_html_(self) -> str:
        """Parameters with their standard deviations as a table, for notebooks."""
        rows = [(name, *self[name], PARAMETERS[kind(name)].unit) for name in self.names]
        title = f"Identification from {len(self.problem.log)} presses"
        return html_table(title, rows, ("parameter", "value", "sigma (of a modulus or gain a fraction)", "unit"))

    @property
    def names(self) -> tuple[str, ...]:
        """The free parameters."""
        return self.problem.free

    @cached_property
    def values(self) -> dict[str, float]:
        """All parameters in their units, held ones among them."""
        return self.problem.values(self.vector)

    @cached_property
    def sigma(self) -> np.ndarray:
        """(f,) standard deviations in the scale of the fit: relative, for logarithmic parameters."""
        return np.sqrt(np.diag(self.covariance))

    def __getitem__(self, name: str) -> tuple[float, float]:
        """Value (in its unit) and standard deviation (in the scale of the fit) of a free parameter."""
        place = self.names.index(name)
        return physical(name, float(self.vector[place])), float(self.sigma[place])

    @cached_property
    def finger(self) -> Finger:
        """The design with what was identified: moduli, gains and levers, and where the gauges are."""
        values = self.values
        found = with_moduli(self.problem.finger, values["outer_modulus_MPa"], values["inner_modulus_MPa"])
        gauges = []
        for gauge in found.gauges:
            gain = values["common_gain"] * values[f"gain.{gauge.name}"]
            lever = values["common_gain"] * values[f"lever_mm.{gauge.name}"] + gain * values["common_lever_mm"]
            along, across = moved_by(values, gauge.name)
            moved = gauge.moved_mm[0] + along, gauge.moved_mm[1] + across
            gauges.append(replace(gauge, membrane_gain=gain, lever_mm=lever, moved_mm=moved))
        return replace(found, gauges=tuple(gauges))

    def with_record(self, record: Identified) -> Finger:
        """The identified finger with the record of its identification, and its bench."""
        bench = replace(self.finger.bench, touch_down=record.touch_down_mm, thickness=self.values["thickness_mm"])
        if record.friction != NOT_TOLD:
            bench = replace(bench, friction=record.friction)
        return replace(self.finger, identified=record, bench=bench)

    def at(self, force_N: np.ndarray, modulus_MPa: np.ndarray) -> np.ndarray:
        """(n, c) what other presses by forces (n,) on specimens of moduli (n,) measure, zeros included."""
        return self.other_presses(force_N, modulus_MPa).modelled(self.vector).values

    def other_presses(self, force_N: np.ndarray, modulus_MPa: np.ndarray) -> Problem:
        """The problem of other presses (n,) on the first shape of specimen: what they measure, and its derivatives."""
        problem, n = self.problem, len(force_N)
        deep = None if problem.log.indentation_mm is None else np.ones(n)
        return problem.of(PressLog(force_N, modulus_MPa, np.zeros((n, problem.gauge_count)), problem.gauges, deep))

    @cached_property
    def residuals(self) -> np.ndarray:
        """(n, c) what was measured less what the finger measures: readings in microstrain, then indentation in mm."""
        return self.problem.measured - self.problem.modelled(self.vector).values


def problem_of(
    log: PressLog,
    finger: Finger,
    free: Sequence[str] = (),
    fix: Mapping[str, float] | None = None,
    specimen: Specimen | None = None,
    noise: Noise | None = None,
    friction: Friction | None = None,
    size_mm: float | None = None,
    progress: Callable[[str], None] | None = None,
) -> Problem:
    """The problem that `identify` poses, not yet weighted; arguments as there."""
    refuse(log, finger)
    held = checked_values(fix or {}, finger)
    touched = finger.bench.specimen(1.0) if specimen is None else specimen
    if log.on is not None:
        touched = log.specimens[int(np.bincount(log.on).argmax())]
    if isinstance(touched, Block) and "thickness_mm" in held:
        touched = replace(touched, thickness=held["thickness_mm"])
    specimens = specimens_of(log)
    wanted = linear_last((*free_parameters(log, finger, free, held), *specimens))
    friction = finger.bench.friction if friction is None else friction
    shapes = shapes_of(log, touched, finger, wanted, held, friction, size_mm, progress)
    opened = {"stick_share": MIDDLES["stick_share"]} if any(shape.friction_open for shape in shapes) else {}
    wanted = linear_last((*wanted, *opened))
    start = start_of(finger, touched.thickness if isinstance(touched, Block) else THICKNESS_MM) | held | opened
    start |= {name: float(log.modulus_MPa[known.rows[0]]) for name, known in specimens.items()}
    problem = Problem(log, finger, shapes, start, wanted, noise or Noise(), specimens=specimens)
    refuse_beyond(problem)
    return problem


def specimens_of(log: PressLog) -> dict[str, Known]:
    """The specimens of whose moduli a log says how well they are known, as parameters by name."""
    if log.modulus_sigma_MPa is None:
        return {}
    on = np.zeros(len(log)) if log.on is None else log.on
    each, which = np.unique(np.column_stack([log.modulus_MPa, on]), axis=0, return_inverse=True)
    found: dict[str, Known] = {}
    for number, (modulus, _) in enumerate(each.tolist()):
        alike = int((each[: number + 1, 0] == modulus).sum())
        rows = np.flatnonzero(which == number)
        sigma = log.modulus_sigma_MPa[rows]
        if np.ptp(sigma) > 0:
            raise InputError(
                f"modulus_sigma_MPa of the specimen of {modulus:g} MPa must be one number, got {sigma.min():g} to "
                f"{sigma.max():g}: it is what is not known of the specimen, the same in all presses on it"
            )
        if sigma[0] > MOST_UNKNOWN * modulus:
            raise InputError(
                f"modulus_sigma_MPa {sigma[0]:g} of a specimen of {modulus:g} MPa says that it is not known at all"
            )
        if sigma[0] > 0:
            name = f"specimen_modulus.{modulus:g}{f'#{alike}' if alike > 1 else ''}"
            found[name] = Known(float(sigma[0]) / modulus, rows)
    return found


def moved_by(values: Mapping[str, float], gauge: str) -> tuple[float, float]:
    """How far (mm) parameter values move a gauge from its design's place, along and across the interface."""
    return values.get("row_along_mm", 0.0) + values.get(f"place_mm.{gauge}", 0.0), values.get("row_across_mm", 0.0)


def unmoved(finger: Finger, values: Mapping[str, float]) -> Finger:
    """The design of a finger whose gauges parameter values have moved: from there they count."""
    gauges = []
    for gauge in finger.gauges:
        back = [
            float(np.round(at - by, 9)) for at, by in zip(gauge.moved_mm, moved_by(values, gauge.name), strict=True)
        ]
        gauges.append(replace(gauge, moved_mm=(back[0], back[1])))
    return replace(finger, gauges=tuple(gauges))


def family_of(
    finger: Finger, *, size_mm: float | None = None, variant: int = 0, progress: Callable[[str], None] | None = None
) -> FingerFamily:
    """The family of a finger's geometry, the same whatever its moduli, gains and levers: it is reduced once."""
    gauges = tuple(replace(gauge, membrane_gain=1.0, lever_mm=0.0) for gauge in finger.gauges)
    plain = replace(finger, name="", gauges=gauges, bench=Bench(), ridges=None, identified=None)
    if finger.outer.material is None and finger.inner.material is None:
        plain = with_moduli(plain, 1.0, 1.0)
    return family(plain, size_mm=size_mm or SIZE_MM, variant=variant, progress=progress)


def ensure_physics(
    finger: Finger,
    friction: Friction | None,
    *,
    processes: int = 1,
    progress: Callable[[str], None] | None = None,
) -> None:
    """Make the tables of large strain that presses of a finger need whatever its moduli are; with and without friction,
    if nothing is said of it."""
    ends = (False, True) if friction is None else ends_of(friction_coefficient(friction))
    with workers(processes, progress) as start:
        begin_large_strain(finger, ends, start, ratios=SPANNING, progress=progress)()


def free_parameters(log: PressLog, finger: Finger, free: Sequence[str], held: Mapping[str, float]) -> tuple[str, ...]:
    """The parameters that a fit varies, in the order of the table; raises `InputError` for what no press can tell."""
    usual = ["outer_modulus_MPa", "inner_modulus_MPa"]
    if log.stated_sd is None:
        usual += ["gain", "lever_mm", "zero_microstrain"]
    else:
        usual += ["common_gain", "common_lever_mm"]
    asked = expanded(free, finger)
    for name in asked if log.stated_sd is not None else ():
        if kind(name) in ("gain", "lever_mm", "zero_microstrain", "place_mm"):
            raise InputError(f"{name} needs readings, and the log has S_d alone, which determines common_gain")
    for name in asked if log.stated_sd is None else ():
        if kind(name) in ("common_gain", "common_lever_mm") and not {"gain", "lever_mm"} <= {kind(one) for one in held}:
            raise InputError(f"{name} needs gain and lever_mm to be fixed: otherwise it is part of each of them")
    if log.indentation_mm is not None:
        usual.append("touch_down_mm")
    elif "touch_down_mm" in asked:
        raise InputError("touch_down_mm needs indentations, and the log has no indentation_mm")
    both = [name for name in asked if name in held]
    if both:
        raise InputError(f"{both[0]} cannot be both free and fixed")
    wanted = {*expanded(usual, finger), *asked} - {*held}
    return linear_last(name for name in names_of(finger) if name in wanted)


def shapes_of(
    log: PressLog,
    touched: Specimen,
    finger: Finger,
    free: tuple[str, ...],
    held: Mapping[str, float],
    friction: Friction | None,
    size_mm: float | None,
    progress: Callable[[str], None] | None,
) -> tuple[Shape, ...]:
    """The specimens' shapes of a log with the responses to them of a finger's family; with and without friction where
    nothing is said of it and large strain is known with both.

    touched : what was pressed where the log does not say.
    """
    if "thickness_mm" in free and not isinstance(touched, Block):
        raise InputError(f"thickness_mm is that of a block, and the presses are on a {touched.words}")
    if "thickness_mm" in free and len(log.specimens) > 1:
        raise InputError(f"thickness_mm is that of one block, and the presses are on {len(log.specimens)} specimens")
    relatives = family_of(finger, size_mm=size_mm, progress=progress)
    if any(one.curvature == (0.0, 0.0) for one in log.specimens or (touched,)):
        ensure_physics(finger, friction, progress=progress)
    moving = needs_places(log, free, held)
    if moving:
        refuse_far(log, MoveLimits.of(relatives), free)
    shapes = []
    for number, kept in enumerate(log.specimens or (touched,)):
        made: tuple[Specimen, ...] = (kept,)
        thicknesses: tuple[float, ...] = ()
        if isinstance(kept, Block) and "thickness_mm" in free:
            thicknesses = tuple(touched.thickness * THICKER**k for k in (-1, 0, 1))  # type: ignore[attr-defined]
            made = tuple(replace(kept, thickness=one) for one in thicknesses)
        if any(kind(name).startswith("tilt") for name in free) and kept.curvature != (0.0, 0.0):
            raise InputError(
                f"a tilt moves the contact with a {kept.words} by what it turns about: only flat ones tell it"
            )
        responses = tuple(response(relatives, one, friction=friction, progress=progress) for one in made)
        if friction is None and responses[0].friction:
            responses += tuple(response(relatives, one, friction=0.0, progress=progress) for one in made)
        rows = np.arange(len(log)) if log.on is None else np.flatnonzero(log.on == number)
        shapes.append(Shape(rows, kept, responses, thicknesses))
    found = tuple(sorted(shapes, key=lambda one: -len(one.rows)))
    return with_moves(found, relatives, progress) if moving else found


def with_moves(
    shapes: tuple[Shape, ...], relatives: FingerFamily, progress: Callable[[str], None] | None = None
) -> tuple[Shape, ...]:
    """The shapes with what contacts off the apex and moved gauges change in the presses on each of them."""
    return tuple(
        replace(
            shape,
            off_apex=shape.off_apex
            or off_apex_change(
                relatives, shape.specimen, friction_words(shape.responses[0].friction), progress=progress
            ),
        )
        for shape in shapes
    )


def solve(problem: Problem, progress: Callable[[str], None] | None = None) -> Identification:
    """Fit a problem from several starts, each with the weights that the fit before it implies."""
    if progress is not None:
        progress("identifying")
    first = problem.weighted()
    found = sorted((descend(first, start) for start in starts_of(first)), key=lambda one: one[0])
    first = replace(first, noise=noise_told(first, found[0][1]))
    ends = [_followed(first, vector) for _, vector in _distinct(found)[:KEPT]]
    ends.sort(key=lambda one: one[0])
    cost, last, vector = ends[0]
    others = [one[0] - cost for one in ends[1:] if np.abs(one[2] - vector)[~problem.linear].max(initial=0.0) > 0.05]
    return _judged(last, vector, min(others, default=None))


def solved_from(problem: Problem, vector: np.ndarray) -> Identification:
    """The fit of a problem that starts at a vector (f,), followed to its end."""
    _, last, found = _followed(problem, vector)
    return _judged(last, found, None)


def starts_of(problem: Problem) -> list[np.ndarray]:
    """Where the nonlinear parameters start, and each a standard deviation of its prior to either side."""
    outside = ~problem.linear
    middle = problem.start[outside]
    names = [name for name, linear in zip(problem.free, problem.linear, strict=True) if not linear]
    # What is known well, or moves little, starts where it is
    widths = np.diag([PARAMETERS[kind(name)].sigma for name in names])
    widths = widths[[kind(name) not in (*MOVES, *OF_THE_LOG, "common_gain") for name in names]]
    return [middle, *(middle + widths), *(middle - widths)]


def descend(problem: Problem, start: np.ndarray) -> tuple[float, np.ndarray]:
    """Cost and vector (f,) of the best fit from a start (others,) of the nonlinear parameters."""
    if not len(start):
        vector = problem.solved(start)
        return float((problem.residuals(vector) ** 2).sum()), vector
    low, high = (side[~problem.linear] for side in problem.bounds)
    known: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}

    def at(outside: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if outside.tobytes() not in known:
            known.clear()
            known[outside.tobytes()] = problem.projected(outside)
        return known[outside.tobytes()]

    margin = 1e-6 * (high - low)
    done = least_squares(
        lambda outside: at(outside)[0],
        np.clip(start, low + margin, high - margin),
        lambda outside: at(outside)[1],
        (low, high),
        x_scale=(high - low) / 4,
        xtol=1e-9,
        ftol=1e-9,
        gtol=1e-9,
        max_nfev=60,
    )
    return 2 * float(done.cost), problem.solved(done.x)


def _distinct(found: list[tuple[float, np.ndarray]]) -> list[tuple[float, np.ndarray]]:
    """Fits of rising cost without those that came to one that is there."""
    kept: list[tuple[float, np.ndarray]] = []
    for cost, vector in found:
        if all(abs(cost - other) > 1e-3 * (1 + other) for other, _ in kept):
            kept.append((cost, vector))
    return kept


def _followed(problem: Problem, vector: np.ndarray) -> tuple[float, Problem, np.ndarray]:
    """Fit again with the weights that each fit implies, until they no longer matter."""
    for _ in range(ROUNDS):
        problem = problem.weighted(vector).downweighted(vector, OUTLYING)
        before = vector
        cost, vector = descend(problem, vector[~problem.linear])
        sigma = np.sqrt(np.diag(_covariance(problem, vector)))
        if np.abs((vector - before) / sigma).max() < SETTLED:
            break
    return cost, problem, vector


def _covariance(problem: Problem, vector: np.ndarray) -> np.ndarray:
    """Inverse of the information of presses and priors; columns are scaled first, for they have many units.

    That the ratio of the moduli keeps to the family, the last residual, is no information.
    """
    jacobian = problem.jacobian(vector)[:-1]
    size = np.linalg.norm(jacobian, axis=0)
    return np.linalg.inv((jacobian / size).T @ (jacobian / size)) / np.outer(size, size)


def _judged(problem: Problem, vector: np.ndarray, rival: float | None) -> Identification:
    priors = len(problem.free) + 1
    residuals, jacobian = problem.residuals(vector), problem.jacobian(vector)
    of_presses = residuals[:-priors]
    covariance = _covariance(problem, vector)
    used = float(np.trace(covariance @ (jacobian[:-priors].T @ jacobian[:-priors])))
    freedom = float(np.isfinite(problem.measured).sum()) - used
    chi_square = float((of_presses**2).sum())
    if freedom > 0 and chi_square / freedom > MISFIT:
        covariance = covariance * (chi_square / freedom)
    return Identification(problem, vector, covariance, chi_square, freedom, rival)
