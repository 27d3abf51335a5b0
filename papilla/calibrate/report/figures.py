"""The report's figures, from a calibration and the presses behind it."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from papilla import view
from papilla.calibrate.job import CHECKED_FORCE_N, CHECKED_MODULUS_MPA, Calibrated
from papilla.calibrate.press_table import Sweep
from papilla.calibrate.published import SPECIMENS_MPA, Comparison
from papilla.calibrate.report.html import Markup, join, picture
from papilla.calibration import Calibration, SoftnessStatus
from papilla.units import gf_to_newton

MAP_POINTS = 48
CURVE_POINTS = 80


@dataclass(frozen=True, eq=False)
class AnswerMap:
    """What the calibration answers to its own S_d over the domain; f forces, m moduli.

    force_N (f,), modulus_MPa (m,), relative_sigma (f, m), status (f, m) as `SoftnessStatus` numbers.
    """

    force_N: np.ndarray
    modulus_MPa: np.ndarray
    relative_sigma: np.ndarray
    status: np.ndarray

    @classmethod
    def of(cls, calibration: Calibration) -> "AnswerMap":
        """Over a logarithmic grid of the whole domain."""
        force = _inside(calibration.domain["force_N"], MAP_POINTS)
        modulus = _inside(calibration.domain["modulus_MPa"], MAP_POINTS)
        sd = calibration.predict(force[:, None], modulus[None, :])
        answer = calibration.invert(sd, np.broadcast_to(force[:, None], sd.shape))
        relative = np.asarray(answer.sigma_MPa) / np.asarray(answer.modulus_MPa)
        return cls(force, modulus, relative, np.asarray(answer.status))

    @property
    def identified(self) -> np.ndarray:
        """(f, m) whether the modulus can be told."""
        return self.status == SoftnessStatus.OK


def _inside(limits: tuple[float, float], count: int) -> np.ndarray:
    """Logarithmic places from end to end; the ends are exact, so they do not leave the domain by rounding."""
    places = np.geomspace(*limits, count)
    places[0], places[-1] = limits
    return places


def sd_figures(done: Calibrated, comparison: Comparison | None) -> Markup:
    """S_d against force and against modulus."""
    calibration = done.calibration
    low, high = calibration.domain["modulus_MPa"]
    moduli = [
        low,
        *(value for value in (0.05, *SPECIMENS_MPA[:1], 0.2, *SPECIMENS_MPA[1:]) if low < value < high),
        high,
    ]
    force = _inside(calibration.domain["force_N"], CURVE_POINTS)
    sd = calibration.predict(force[:, None], np.array(moduli)[None, :])
    dashed: dict[str, Any] = {}
    if comparison is not None:
        dashed = {
            "published_force_N": gf_to_newton(comparison.force_gf),
            "published_sd": comparison.published / comparison.scale,
            "published_moduli": SPECIMENS_MPA,
        }
    measured = None
    if not isinstance(done.presses, Sweep):
        measured = (done.presses.force_N, done.presses.modulus_MPa, done.presses.sd_microstrain)
    against_force = view.plots.sd_against_force(force, moduli, sd, **dashed, measured=measured)
    modulus = _inside(calibration.domain["modulus_MPa"], CURVE_POINTS)
    forces = np.linspace(*calibration.domain["force_N"], 6)
    against_modulus = view.plots.sd_against_modulus(
        modulus, forces.tolist(), calibration.predict(forces[:, None], modulus[None, :])
    )
    return join(
        [
            picture(
                view.svg(against_force), "svg+xml", "S_d against force, a curve per modulus",
                "S_d against force. Dashed: the published regression (9) in the colours of its three specimens, "
                "brought to "
                "this calibration's unit by one factor." if comparison is not None else "S_d against force.",
            ),
            picture(
                view.svg(against_modulus), "svg+xml", "S_d against modulus, a curve per force",
                "S_d against the specimen's modulus. Where a curve is flat, the sensor cannot tell moduli apart.",
            ),
        ]
    )  # fmt: skip


def gauge_figure(done: Calibrated, modulus: float) -> Markup:
    """Each gauge's reading against force on one modulus (MPa)."""
    calibration = done.calibration
    force = _inside(calibration.domain["force_N"], CURVE_POINTS)
    names = [gauge.name for gauge in calibration.gauges]
    plot = view.plots.gauge_readings(force, names, calibration.predict_readings(force, modulus), f"{modulus:.3g} MPa")
    caption = "What each gauge reads; gauges that mirror each other lie on one another. S_d is their spread."
    return picture(view.svg(plot), "svg+xml", "gauge readings against force", caption)


def error_figures(done: Calibrated, answers: AnswerMap) -> Markup:
    """The error of recovered moduli where they were checked, and the stated uncertainty over the whole domain."""
    box = None
    if isinstance(done.presses, Sweep):
        box = (*CHECKED_FORCE_N, *CHECKED_MODULUS_MPA)
    sigma = view.plots.uncertainty_map(
        answers.force_N, answers.modulus_MPa, answers.relative_sigma, answers.identified, box
    )
    parts = [
        picture(
            view.svg(sigma), "svg+xml", "relative uncertainty of the recovered modulus over force and modulus",
            "Stated uncertainty of E from an exact S_d and force: the fit's residual and the mesh scatter over d ln "
            "S_d / d ln E. "
            "Noise of a real measurement comes on top.",
        )
    ]  # fmt: skip
    recovery = done.recovery
    if not len(recovery.error):
        return join(parts)
    dots = view.plots.recovery_map(recovery.force_N, recovery.modulus_MPa, recovery.error)
    of_sweep = isinstance(done.presses, Sweep)
    what = "presses between the points of the sweep, noise-free" if of_sweep else "the measured presses"
    return join(
        [picture(view.svg(dots), "svg+xml", "error of recovered moduli", f"Error of E recovered from {what}."), *parts]
    )
