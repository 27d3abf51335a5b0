"""Compares new presses with a stored identification: is it still the same finger, and if not, what changed?"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from papilla.calibrate.identification.log_check import refuse, refuse_beyond
from papilla.calibrate.identification.noise import Noise
from papilla.calibrate.identification.parameters import MOVES, kind, names_of, scaled
from papilla.calibrate.identification.posing import problem_of_record
from papilla.calibrate.identification.problem import Problem
from papilla.errors import InputError
from papilla.finger import Finger
from papilla.logs import PressLog
from papilla.units import PER_CENT

ALARM = 0.01
"""Probability of chi-square below which a finger counts as another: the share of false alarms."""

CLEAR = 6.6
"""Rise of chi-square (1 % of one degree of freedom) above which a change is named."""


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
class Comparison:
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
        return self.probability >= ALARM

    @property
    def verdict(self) -> str:
        """ "fine" or "recalibrate", and why."""
        about = f"chi-square {self.chi_square:.3g} of {self.freedom} measured values"
        if self.same:
            return f"fine: {about} is what a finger that has not changed shows"
        named = [one for one in self.changes if one.chi_square > CLEAR]
        moved = f"; the single change that explains it best: {named[0].words}" if named else ""
        return f"recalibrate: {about} has a probability of {self.probability:.1g}{moved}"


def compare(
    finger: Finger,
    log: PressLog,
    *,
    noise: Noise | None = None,
    size_mm: float | None = None,
    progress: Callable[[str], None] | None = None,
) -> Comparison:
    """Compare new presses of an identified finger with its identification; its covariance is added to the noise.

    Raises `InputError` for a finger that was not identified, and what `identify` raises for its log.
    """
    record = finger.identified
    if record is None:
        raise InputError(f"the finger {finger.name!r} has no table [identified]: papilla identify makes one")
    refuse(log, finger)
    stated = noise or Noise(readings_microstrain=record.noise_microstrain, force=record.force_error)
    problem = problem_of_record(finger, log, record.parameters, stated, size_mm, progress)
    refuse_beyond(problem)
    return _against(problem, problem.start, record.covariance)


def _against(problem: Problem, vector: np.ndarray, covariance) -> Comparison:
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
        by_name[f"reading of {gauge.name}"] = sum(problem.held[part] * by_name.pop(part) for part in parts)
    changes = []
    for name, column in by_name.items():
        information = float(column @ precision @ column)
        if information > 0:
            found = float(column @ precision @ off) / information
            changes.append(Change(name, found, information**-0.5, found**2 * information))
    changes.sort(key=lambda one: -one.chi_square)
    return Comparison(len(problem.log), total, len(off), float(chdtrc(len(off), total)), tuple(changes))


def _may_move(problem: Problem) -> tuple[str, ...]:
    """Parameters that may have changed."""
    depths = problem.log.indentation_mm is not None
    out = {"thickness_mm", *MOVES, "common_gain", "common_lever_mm", *(() if depths else ("touch_down_mm",))}
    return tuple(name for name in names_of(problem.finger) if kind(name) not in out)
