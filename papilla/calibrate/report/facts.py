"""Figures for the report's tables and sentences, computed from the calibration's own data."""

import math
from collections import Counter
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from papilla.calibrate.job import Calibrated
from papilla.calibrate.press_table import Sweep
from papilla.calibration import Calibration, SoftnessStatus
from papilla.calibration.published import SPECIMENS_MPA
from papilla.units import KPA_PER_MPA, MICROSTRAIN, gf_to_newton, newton_to_gf

FORCE_ERROR = 0.01
"""Relative error of the force whose effect on E is stated."""
FORCE_N = 0.5
"""Force (N) at which this effect is stated, if it is inside the domain."""
SLOPE_FORCE_N = gf_to_newton(50.0)
SLOPE_MODULI = (0.05, 0.089, 0.2, 0.51, 0.72, 2.0, 5.0)
CONTACT_FORCES = (0.05, 0.1, 0.2, 0.5, 1.0)
MAP_POINTS = 48


@dataclass(frozen=True, eq=False)
class AnswerMap:
    """Answers of the calibration to its own S_d over the domain; f forces, m moduli.

    force_N (f,), modulus_MPa (m,), relative_sigma (f, m), status (f, m) as `SoftnessStatus` numbers.
    """

    force_N: np.ndarray
    modulus_MPa: np.ndarray
    relative_sigma: np.ndarray
    status: np.ndarray

    @classmethod
    def of(cls, calibration: Calibration) -> "AnswerMap":
        """Over a logarithmic grid of the whole domain."""
        force = np.geomspace(*calibration.domain["force_N"], MAP_POINTS)
        modulus = np.geomspace(*calibration.domain["modulus_MPa"], MAP_POINTS)
        sd = calibration.predict(force[:, None], modulus[None, :])
        answer = calibration.invert(sd, force[:, None], interval=False)
        relative = np.asarray(answer.sigma_MPa) / np.asarray(answer.modulus_MPa)
        return cls(force, modulus, relative, np.asarray(answer.status))

    @property
    def identified(self) -> np.ndarray:
        """(f, m) whether the modulus can be determined."""
        return self.status == SoftnessStatus.OK

    @property
    def share(self) -> float:
        """Share of the (logarithmic) domain in which the modulus can be determined."""
        return float(self.identified.mean())

    def hardest(self) -> tuple[float, float | None, float]:
        """A force (N) in the middle of the domain, the hardest modulus (MPa) that can be determined there, and its
        relative sigma."""
        row = len(self.force_N) // 2
        answered = np.flatnonzero(self.identified[row])
        if not len(answered):
            return float(self.force_N[row]), None, np.nan
        hardest = answered[-1]
        return float(self.force_N[row]), float(self.modulus_MPa[hardest]), float(self.relative_sigma[row, hardest])


def share_with_known_friction(calibration: Calibration) -> float | None:
    """`AnswerMap.share` if the friction were known; None if it is known."""
    surface = calibration.surface
    if surface.uncertainty.friction is None:
        return None
    known = replace(surface, uncertainty=replace(surface.uncertainty, friction=None))
    return AnswerMap.of(replace(calibration, surface=known)).share


def force_cost(calibration: Calibration) -> tuple[float, list[tuple[float, float]]]:
    """A force (N); the published moduli; and the sigma_E / E that an error of `FORCE_ERROR` in the force causes."""
    force = float(np.clip(FORCE_N, *calibration.domain["force_N"]))
    rows = []
    for modulus in SPECIMENS_MPA:
        sd = float(calibration.predict(force, modulus))
        if np.isfinite(sd):
            sigma = calibration.invert(sd, force, force_sigma=FORCE_ERROR * force).sigma_MPa
            rows.append((modulus, float(sigma) / modulus))
    return force, rows


def slopes(calibration: Calibration) -> tuple[float, list[tuple[float, float, float, float | None]]]:
    """A force (N), 50 gf or the middle of the domain; and per modulus: d ln S_d / d ln E, mesh scatter, scatter of
    E."""
    low, high = calibration.domain["force_N"]
    force = SLOPE_FORCE_N if low <= SLOPE_FORCE_N <= high else (low * high) ** 0.5
    scatter = calibration.surface.uncertainty.scatter_at(force)
    found = [(modulus, float(calibration.surface.surface.slopes(force, modulus)[1])) for modulus in SLOPE_MODULI]
    return force, [
        (modulus, slope, scatter, scatter / slope if slope > 0 else None)
        for modulus, slope in found
        if np.isfinite(slope)
    ]


def contacts(sweep: Sweep) -> list[tuple[float, ...]]:
    """By published modulus and a few forces: E, force, in gf, indentation, area, peak pressure (kPa), S_d."""
    rows = []
    for modulus in SPECIMENS_MPA:
        nearest = sweep.modulus_MPa[np.abs(sweep.modulus_MPa - modulus).argmin()]
        near = np.flatnonzero(sweep.modulus_MPa == nearest)
        for force in CONTACT_FORCES:
            row = near[np.abs(np.log(sweep.force_N[near] / force)).argmin()]
            columns = (sweep.indentation_mm, sweep.contact_area_mm2, KPA_PER_MPA * sweep.peak_pressure_MPa)
            measured = (float(column[row]) for column in (*columns, sweep.sd_microstrain))
            rows.append((nearest, float(sweep.force_N[row]), newton_to_gf(float(sweep.force_N[row])), *measured))
    return rows


def large_strain(sweep: Sweep) -> bool:
    """Whether the presses of a sweep include large strain."""
    return any("large strain included" in status for status in sweep.status)


def largest_reading(sweep: Sweep) -> float:
    """Largest |reading| of a sweep, as a strain."""
    return MICROSTRAIN * float(np.nanmax(np.abs(sweep.reading)))


def statuses(done: Calibrated, answers: AnswerMap) -> tuple[list[tuple[str, int]], list[tuple[str, float]]]:
    """Number of presses of the sweep with each status, and shares of the domain with each status of the answer."""
    kinds = Counter(map(_kind, done.presses.status))
    answered = Counter(SoftnessStatus(int(code)).sentence for code in answers.status.ravel())
    return kinds.most_common(), [(kind, count / answers.status.size) for kind, count in answered.most_common()]


def _kind(sentence: str) -> str:
    """A status without its figures: the text before the first colon or comma; "converged" for a converged press."""
    head, _, said = sentence.partition(": ")
    return "converged" if said.startswith("converged") else head.split(",")[0]


def provenance(calibration: Calibration) -> list[tuple[str, object]]:
    """Finger, mesh, versions and date, a row each."""
    facts = {f"finger: {key}": value for key, value in calibration.finger.items() if value}
    facts |= {f"mesh: {key}": value for key, value in calibration.mesh.items()} | calibration.provenance
    rows = []
    for key, value in facts.items():
        if isinstance(value, dict):
            value = ", ".join(f"{name} {item}" for name, item in value.items())
        elif isinstance(value, list | tuple):
            value = ", ".join(map(str, value))
        rows.append((key.replace("_", " "), value))
    return rows


class QuadraticError(NamedTuple):
    """Errors of the refitted quadratic's modulus relative to the surface's: relative rms where it has an answer, and
    the share of the domain with an answer."""

    rms: float
    answered: float


def quadratic_error(calibration: Calibration) -> QuadraticError:
    """`QuadraticError` over the domain of the compact form, so that both forms of five coefficients are compared on the
    same presses."""
    form = calibration.compact
    if form is None:
        return QuadraticError(math.nan, 0.0)
    force = np.geomspace(*form.force_N, 24)[:, None]
    modulus = np.geomspace(*form.modulus_MPa, 24)[None, :]
    errors = calibration.inverse(calibration.predict(force, modulus), newton_to_gf(force)) / modulus - 1
    known = errors[np.isfinite(errors)]
    return QuadraticError(float(np.sqrt(np.mean(known**2))) if known.size else math.nan, known.size / errors.size)
