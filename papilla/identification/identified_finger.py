"""What follows from the record of an identification: the uncertainty of a calibration of that finger, and the test
whether new presses are still of it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import chdtrc

from papilla.calibration import Calibration
from papilla.calibration.fitting.surface_fit import Resolution, SurfaceFit
from papilla.core.errors import InputError
from papilla.core.progress import Progress, silent
from papilla.core.units import PER_CENT
from papilla.identification.noise import PressNoise
from papilla.identification.parameters import CONTACT_MOVES, OF_THE_BENCH, OF_THE_LOG, kind, names_of, scaled, start_of
from papilla.identification.posing import moved_by, refuse, refuse_beyond, shapes_of
from papilla.identification.problem import Problem, sd_and_shares, unread
from papilla.logs import PressLog
from papilla.model.finger import Finger
from papilla.model.parts import Identified

FALSE_ALARM_PROBABILITY = 0.01
"""Probability of chi-square below which a finger counts as another: the share of false alarms."""

CLEAR_CHI_SQUARE_RISE = 6.6
"""Rise of chi-square (1 % of one degree of freedom) above which a change is named."""

AGREEMENT_GRID_PRESSES = 10
"""Number of presses along force and modulus at which the standard deviations are computed."""

AGREEMENT_RESOLUTION = Resolution(5)
SAME_MODULUS_DIFFERENCE = 1e-6
"""Relative difference above which a design's modulus differs from the identified one."""


def problem_of_record(
    finger: Finger,
    log: PressLog,
    free: tuple[str, ...],
    noise: PressNoise,
    size_mm: float | None = None,
    progress: Progress = silent,
) -> Problem:
    """The problem of presses of an identified finger, with the recorded parameters `free` starting at their recorded
    values. Raises `InputError` if the record has other gauges."""
    record, bench = finger.identified, finger.bench
    assert record is not None
    unknown = [name for name in record.parameters if name not in (*names_of(finger), *OF_THE_LOG)]
    if unknown:
        raise InputError(f"the finger's [identified] has {unknown[0]}, which is no parameter of its gauges and layers")
    values = {name: value for name, value in zip(record.parameters, record.values, strict=True) if name in free}
    design = unmoved(finger, values)
    shapes = shapes_of(log, bench.specimen(1.0), design, (), values, bench.friction, size_mm, progress)
    start = start_of(design, bench.thickness) | {"touch_down_mm": record.touch_down_mm} | values
    return Problem(log, design, shapes, start, free, noise)


def unmoved(finger: Finger, values: Mapping[str, float]) -> Finger:
    """The design with the gauges at their places before the parameter values moved them: displacements count from
    there."""
    gauges = []
    for gauge in finger.gauges:
        # Rounded, so that a gauge that is moved and moved back has its designed place to the last digit.
        along, across = np.round(np.subtract(gauge.moved_mm, moved_by(values, gauge.name)), 9).tolist()
        gauges.append(replace(gauge, moved_mm=(along, across)))
    return replace(finger, gauges=tuple(gauges))


def with_identification(
    calibration: Calibration, finger: Finger, progress: Progress = silent, size_mm: float | None = None
) -> Calibration:
    """The calibration with the covariance of the finger's identification in its surfaces, and the bench's zeros.

    size_mm : elements at the contact, None for those of `identify`. A finger without an identification leaves the
    calibration unchanged. Raises `InputError` if the `[identified]` table is of other gauges, or the design was changed
    since.
    """
    record = finger.identified
    if record is None:
        return calibration
    problem, covariance = _problem(finger, record, calibration, progress, size_mm)
    vector = problem.start
    modelled = problem.modelled(vector)
    g = len(finger.gauges)
    zeros, by = problem.each("zero_microstrain", problem.values(vector)), modelled.by_free[:, :g]
    sd, shares = sd_and_shares(modelled.values[:, :g] - zeros)
    by_ln_sd = np.einsum("ng,ngf->nf", shares, by) / sd[:, None]
    force, modulus = problem.log.force_N, problem.log.modulus_MPa

    def wider(channel, slopes: np.ndarray):
        sigma = np.sqrt(np.maximum(np.einsum("nf,fe,ne->n", slopes, covariance, slopes), 0.0))
        surface = SurfaceFit(force, modulus, (AGREEMENT_RESOLUTION, AGREEMENT_RESOLUTION)).surface(sigma).surface
        return replace(channel, uncertainty=replace(channel.uncertainty, identified=surface))

    bench: dict[str, Any] = {"zeros_microstrain": list(record.zeros_microstrain), "touch_down_mm": record.touch_down_mm}
    if record.crept:
        silicone = {"shares": record.relaxation_shares, "times_s": record.relaxation_times_s, "crept": record.crept}
        bench["relaxation"] = {name: list(values) for name, values in silicone.items()}
    return replace(
        calibration,
        surface=wider(calibration.surface, by_ln_sd),
        gauges=tuple(wider(gauge, by[:, k] / force[:, None]) for k, gauge in enumerate(calibration.gauges)),
        finger=calibration.finger | bench | {"identified": record.status},
        notes=(*calibration.notes, *(f"identification: {note}" for note in record.notes)),
    )


def _problem(
    finger: Finger, record: Identified, calibration: Calibration, progress: Progress, size_mm: float | None
) -> tuple[Problem, np.ndarray]:
    """The problem of presses over the domain of a calibration, in the parameters that were identified, at their
    recorded values; and their covariance."""
    designed = start_of(finger, finger.bench.thickness)
    values = dict(zip(record.parameters, record.values, strict=True))
    for name, value in values.items():
        changes = name in designed and kind(name) not in ("zero_microstrain", *CONTACT_MOVES)
        if changes and abs(designed[name] - value) > SAME_MODULUS_DIFFERENCE * max(abs(value), SAME_MODULUS_DIFFERENCE):
            raise InputError(
                f"{name} is {designed[name]:g} in the design and {value:g} in its [identified]: the design was changed "
                "since, so remove that table or identify the finger again"
            )
    force, modulus = (
        np.geomspace(*calibration.domain[key], AGREEMENT_GRID_PRESSES) for key in ("force_N", "modulus_MPa")
    )
    force, modulus = (axis.ravel() for axis in np.meshgrid(force, modulus))
    deep = np.ones(len(force)) if "touch_down_mm" in values else None
    log = unread(finger, force, modulus, indentation_mm=deep)
    places = [place for place, name in enumerate(record.parameters) if kind(name) not in OF_THE_BENCH]
    free = tuple(record.parameters[place] for place in places)
    problem = problem_of_record(finger, log, free, PressNoise(), size_mm, progress)
    return problem, np.array(record.covariance)[np.ix_(places, places)]


@dataclass(frozen=True)
class Change:
    """One possible change: its size (in the scale of the fit: relative for moduli), its standard deviation, and the
    part of chi-square that it explains."""

    name: str
    change: float
    sigma: float
    chi_square: float

    @property
    def words(self) -> str:
        """The change as text, such as "inner_modulus_MPa -22 +- 3 %"."""
        if self.name.endswith("_modulus_MPa") or self.name.startswith("reading"):
            return f"{self.name} {PER_CENT * self.change:+.3g} +- {PER_CENT * self.sigma:.2g} %"
        unit = "µε" if "microstrain" in self.name else "mm"
        return f"{self.name} {self.change:+.3g} +- {self.sigma:.2g} {unit}"


@dataclass(frozen=True)
class PressAgreement:
    """New presses against a stored identification: chi-square of all measured values, its degrees of freedom and
    probability.

    changes : single changes that may explain the presses, the best explanation first; changes of readings are relative
    to the earlier readings.
    """

    presses: int
    chi_square: float
    freedom: int
    probability: float
    changes: tuple[Change, ...]

    @property
    def same(self) -> bool:
        """Whether it is still the same finger."""
        return self.probability >= FALSE_ALARM_PROBABILITY

    @property
    def verdict(self) -> str:
        """ "fine" or "recalibrate", and why."""
        about = f"chi-square {self.chi_square:.3g} of {self.freedom} measured values"
        if self.same:
            return f"fine: {about} is what a finger that has not changed shows"
        named = [change for change in self.changes if change.chi_square > CLEAR_CHI_SQUARE_RISE]
        moved = f"; the single change that explains it best: {named[0].words}" if named else ""
        return f"recalibrate: {about} has a probability of {self.probability:.1g}{moved}"


def compare(
    finger: Finger,
    log: PressLog,
    *,
    noise: PressNoise | None = None,
    size_mm: float | None = None,
    progress: Progress = silent,
) -> PressAgreement:
    """Compare new presses of an identified finger with its identification; its covariance is added to the noise.

    Raises `InputError` for a finger that was not identified, and what `identify` raises for its log.
    """
    record = finger.identified
    if record is None:
        raise InputError(f"the finger {finger.name!r} has no table [identified]: papilla identify makes one")
    refuse(log, finger)
    stated = noise or PressNoise(readings_microstrain=record.noise_microstrain, force=record.force_error)
    problem = problem_of_record(finger, log, record.parameters, stated, size_mm, progress)
    refuse_beyond(problem)
    return _against(problem, problem.start, record.covariance)


def _against(problem: Problem, vector: np.ndarray, covariance) -> PressAgreement:
    """Chi-square of the measurements at the recorded vector (f,), and by how much each possible change lowers it."""
    weights = problem.weighted(vector).weights
    assert weights is not None
    modelled = problem.modelled(vector)
    off = (weights @ (problem.measured - modelled.values)[:, :, None]).ravel()
    slopes = (weights @ modelled.by_free).reshape(len(off), -1)
    precision = np.linalg.inv(np.eye(len(off)) + slopes @ np.array(covariance) @ slopes.T)
    total = float(off @ precision @ off)
    moving = replace(problem, free=_may_move(problem))
    at = np.array([scaled(name, problem.held[name]) for name in moving.free])
    columns = (weights @ moving.modelled(at).by_free).reshape(len(off), -1)
    by_name = dict(zip(moving.free, columns.T, strict=True))
    for gauge in problem.finger.gauges:
        # A gauge that comes loose responds less to every load
        parts = [f"{key}.{gauge.name}" for key in ("gain", "lever_mm")]
        by_name[f"reading of {gauge.name}"] = sum(problem.held[name] * by_name.pop(name) for name in parts)
    changes = []
    for name, column in by_name.items():
        information = float(column @ precision @ column)
        if information > 0:
            size = float(column @ precision @ off) / information
            changes.append(Change(name, size, information**-0.5, size**2 * information))
    changes.sort(key=lambda change: -change.chi_square)
    return PressAgreement(len(problem.log), total, len(off), float(chdtrc(len(off), total)), tuple(changes))


def _may_move(problem: Problem) -> tuple[str, ...]:
    """Parameters that may have changed."""
    depths = problem.log.indentation_mm is not None
    out = {"thickness_mm", *CONTACT_MOVES, "common_gain", "common_lever_mm", *(() if depths else ("touch_down_mm",))}
    return tuple(name for name in names_of(problem.finger) if kind(name) not in out)
