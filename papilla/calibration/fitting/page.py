"""report.html: one self-contained page on a calibration, its accuracy and its doubts.

Text and tables are in `templates/`; this module computes their figures from the calibration's own data, and draws the
pictures.
"""

import math
from dataclasses import dataclass, replace
from os import PathLike

import numpy as np
from markupsafe import Markup, escape

from papilla import view
from papilla.calibration import Calibration, SoftnessStatus
from papilla.calibration.fitting.fit import COMPACT_GRID
from papilla.calibration.fitting.job import Calibrated
from papilla.calibration.fitting.sweep import DEFAULT_MODULI, CalibrationRanges, Sweep, cached_press
from papilla.calibration.published import (
    PUBLISHED_FORWARD,
    PUBLISHED_INVERSE,
    SPECIMENS_MPA,
    PublishedAgreement,
    covered_comparison,
    exact_inverse,
    rounding_error,
)
from papilla.core import cache
from papilla.core.errors import InputError
from papilla.core.files import write_text
from papilla.core.progress import Progress, silent
from papilla.core.units import STRAIN_PER_MICROSTRAIN, gf_to_newton, newton_to_gf
from papilla.logs.presses import USUAL_FORCE_ERROR
from papilla.model.finger import DEFAULT_FINGER, Finger
from papilla.view.page import both_widths, either, environment
from papilla.view.style import STYLE_SHEET

STATED_EFFECT_FORCE_N = 0.5
"""Force (N) at which this effect is stated, if it is inside the domain."""
SLOPE_FORCE_N = gf_to_newton(50.0)
SHOWN_MODULI = tuple(sorted((0.05, 0.2, *SPECIMENS_MPA)))
"""Moduli (MPa) of the curves of S_d, the published ones among them; its slope is stated for two harder ones, too."""
SLOPE_MODULI = (*SHOWN_MODULI, 2.0, DEFAULT_MODULI[-1])
MAP_POINTS = 48
CALIBRATION_CURVE_POINTS = 80
DIAGRAM_ALT_TEXTS = {
    "sd_against_force": "S_d against force, a curve per modulus",
    "sd_against_modulus": "S_d against modulus, a curve per force",
    "gauge_readings": "gauge readings against force",
    "uncertainty_map": "relative uncertainty of the recovered modulus over force and modulus",
    "recovery_map": "error of recovered moduli",
}
"""What the diagrams are, in words."""


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
        middle = len(self.force_N) // 2
        answered = np.flatnonzero(self.identified[middle])
        if not len(answered):
            return float(self.force_N[middle]), None, np.nan
        hardest = answered[-1]
        sigma = float(self.relative_sigma[middle, hardest])
        return float(self.force_N[middle]), float(self.modulus_MPa[hardest]), sigma


def write_report(
    path: str | PathLike,
    done: Calibrated,
    finger: Finger | None = None,
    *,
    seconds: float | None = None,
    progress: Progress = silent,
) -> None:
    """Write the report of a calibration as one HTML file: no script, no link, pictures inline.

    Parameters
    ----------
    finger : the design; needed for the strain field.
    seconds : how long the calibration took.
    progress : called with a line of text before a long step (the strain field, unless it is in the cache).

    Raises `InputError` for a calibration from a sweep without its finger, `FileAccessError` if the file cannot be
    written, and what the model of the strain field raises.
    """
    if done.reduced is not None and finger is None:
        raise InputError("the report of a calibration from a sweep needs the finger that was swept")
    answers, comparison = AnswerMap.of(done.calibration), covered_comparison(done.calibration.predict)
    templates = environment("papilla.calibration.fitting")
    templates.filters["symbols"] = symbols
    text = templates.get_template("report.html").render(
        **{name: getattr(done, name) for name in ("calibration", "recovery", "reduced", "depths")},
        done=done,
        finger=finger,
        ranges=CalibrationRanges.recorded(done.calibration.finger),
        seconds=seconds,
        answers=answers,
        friction_known=share_with_known_friction(done.calibration),
        comparison=comparison,
        published=PUBLISHED_FORWARD,
        specimens=SPECIMENS_MPA,
        inverses=(done.calibration.inverse, exact_inverse(), PUBLISHED_INVERSE),
        rounding=rounding_error(PUBLISHED_INVERSE),
        quadratic=quadratic_error(done.calibration),
        facts=PAGE_FACTS,
        **_of_the_model(done, finger, progress),
        **_plots(done, answers, comparison),
        bench=done.bench,
    )
    write_text(path, text)


def symbols(text: str) -> Markup:
    """A sentence of the calibration with symbols formatted as on the page."""
    escaped = str(escape(text))
    return Markup(escaped.replace("S_d", "S<sub>d</sub>").replace("f2", "f²").replace("E2", "E²"))


def _of_the_model(job: Calibrated, finger: Finger | None, progress: Progress) -> dict:
    """Content that needs the finger's model: the picture of its strain field, and whether it is the default finger."""
    if job.reduced is None or finger is None:
        return {"strain_picture": None, "default_finger": False}
    force, modulus = CalibrationRanges.recorded(job.calibration.finger).shown
    specimen = finger.bench.specimen(modulus)
    scene = {"force": force, "friction": job.presses.friction}
    press = cached_press(view.shown, job.reduced, specimen, **scene)
    alt = "strain field of a press, with gauges and contact"
    return {
        "strain_picture": either(view.strain_pictures(finger, job.reduced, press, specimen, progress), alt, "png"),
        "default_finger": finger.sha256 == Finger.load(DEFAULT_FINGER).sha256,
    }


def _plots(job: Calibrated, answers: AnswerMap, comparison: PublishedAgreement | None) -> dict[str, Markup]:
    """The page's diagrams, kept in the cache: to draw them takes longer than the rest of a second calibration."""
    calibration, recovery, plots = job.calibration, job.recovery, view.plots
    low, high = calibration.domain["modulus_MPa"]
    ranges = CalibrationRanges.recorded(calibration.finger)
    modulus = np.geomspace(low, high, CALIBRATION_CURVE_POINTS)
    force = np.geomspace(*calibration.domain["force_N"], CALIBRATION_CURVE_POINTS)
    moduli = [low, *(value for value in ranges.hardened(SHOWN_MODULI) if low < value < high), high]
    forces = np.linspace(*calibration.domain["force_N"], 6)
    published = None
    if comparison is not None:
        scaled = comparison.published / comparison.scale
        published = gf_to_newton(comparison.force_gf), SPECIMENS_MPA, scaled
    modulus_at = ranges.shown[1] if low <= ranges.shown[1] <= high else (low * high) ** 0.5
    names, readings = [gauge.name for gauge in calibration.gauges], calibration.predict_readings(force, modulus_at)
    by_force = calibration.predict(force[:, None], np.array(moduli))
    by_modulus = calibration.predict(forces[:, None], modulus)
    sigma_map = answers.force_N, answers.modulus_MPa, answers.relative_sigma, answers.identified
    inputs: dict[str, tuple] = {
        "sd_against_force": (force, moduli, by_force, published),
        "sd_against_modulus": (modulus, forces.tolist(), by_modulus),
        "gauge_readings": (force, names, readings, f"{modulus_at:.3g} MPa"),
        "uncertainty_map": (*sigma_map, sum(ranges.checked, ())),
        "recovery_map": (recovery.force_N, recovery.modulus_MPa, recovery.error),
    }

    def draw() -> dict[str, np.ndarray]:
        both = {name: both_widths(getattr(plots, name)(*values)) for name, values in inputs.items()}
        return {
            f"{name} {k}": np.frombuffer(picture, np.uint8)
            for name, two in both.items()
            for k, picture in enumerate(two)
        }

    pictures = cache.fetch("picture", cache.key(__name__, inputs, STYLE_SHEET), draw)
    return {
        name: either([pictures[f"{name} {k}"].tobytes() for k in (0, 1)], alt, "svg+xml")
        for name, alt in DIAGRAM_ALT_TEXTS.items()
    }


def share_with_known_friction(calibration: Calibration) -> float | None:
    """`AnswerMap.share` if the friction were known; None if it is known."""
    surface = calibration.surface
    if surface.uncertainty.friction is None:
        return None
    certain = replace(surface, uncertainty=replace(surface.uncertainty, friction=None))
    return AnswerMap.of(replace(calibration, surface=certain)).share


def force_cost(calibration: Calibration) -> tuple[float, list[tuple[float, float]]]:
    """A force (N); the published moduli; and the sigma_E / E that `USUAL_FORCE_ERROR` causes."""
    force = float(np.clip(STATED_EFFECT_FORCE_N, *calibration.domain["force_N"]))
    rows = []
    for modulus in SPECIMENS_MPA:
        sd = float(calibration.predict(force, modulus))
        if np.isfinite(sd):
            without, with_it = (
                float(calibration.invert(sd, force, force_sigma=error * force).sigma_MPa)
                for error in (0.0, USUAL_FORCE_ERROR)
            )
            rows.append((modulus, math.sqrt(with_it**2 - without**2) / modulus))
    return force, rows


def slopes(calibration: Calibration) -> tuple[float, list[tuple[float, float, float, float | None]]]:
    """A force (N), 50 gf or the middle of the domain; and per modulus: d ln S_d / d ln E, mesh scatter, scatter of
    E."""
    low, high = calibration.domain["force_N"]
    ranges = CalibrationRanges.recorded(calibration.finger)
    middle = ranges.force_factor * SLOPE_FORCE_N
    force = middle if low <= middle <= high else (low * high) ** 0.5
    scatter = calibration.surface.uncertainty.scatter_at(force)
    by_modulus = [
        (modulus, float(calibration.surface.surface.slopes(force, modulus)[1]))
        for modulus in ranges.hardened(SLOPE_MODULI)
    ]
    return force, [
        (modulus, slope, scatter, scatter / slope if slope > 0 else None)
        for modulus, slope in by_modulus
        if np.isfinite(slope)
    ]


def large_strain(sweep: Sweep) -> bool:
    """Whether the presses of a sweep include large strain."""
    return any("large strain included" in status for status in sweep.status)


def largest_reading(sweep: Sweep) -> float:
    """Largest |reading| of a sweep, as a strain."""
    return STRAIN_PER_MICROSTRAIN * float(np.nanmax(np.abs(sweep.reading)))


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


def quadratic_error(calibration: Calibration) -> dict[str, float]:
    """Errors of the refitted quadratic's modulus relative to the surface's: "rms" (relative) where it has an answer,
    and the share "answered" of the domain with an answer. The domain is that of the compact form, so that both forms of
    five coefficients are compared on the same presses."""
    form = calibration.compact
    if form is None:
        return {"rms": math.nan, "answered": 0.0}
    force = np.geomspace(*form.force_N, COMPACT_GRID)[:, None]
    modulus = np.geomspace(*form.modulus_MPa, COMPACT_GRID)[None, :]
    errors = calibration.inverse(calibration.predict(force, modulus), newton_to_gf(force)) / modulus - 1
    finite = errors[np.isfinite(errors)]
    return {
        "rms": float(np.sqrt(np.mean(finite**2))) if finite.size else math.nan,
        "answered": finite.size / errors.size,
    }


_IN_TABLES = (slopes, force_cost, large_strain, largest_reading, provenance)
PAGE_FACTS = {figure.__name__: figure for figure in _IN_TABLES} | {"FORCE_ERROR": USUAL_FORCE_ERROR}
"""What the page's tables and sentences compute, by the names in the template."""
