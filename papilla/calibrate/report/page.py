"""report.html: one self-contained page on a calibration, its accuracy and its doubts.

Text and tables are in `templates/`; `facts` computes the figures, this module draws the pictures.
"""

from collections.abc import Callable
from os import PathLike

import numpy as np
from markupsafe import Markup, escape

from papilla import mesh, view
from papilla.calibrate.job import CHECKED_FORCE_N, CHECKED_MODULUS_MPA, Calibrated
from papilla.calibrate.press_table import cached_press
from papilla.calibrate.published_form import Comparison, covered_comparison, rounding_error
from papilla.calibrate.report import facts
from papilla.calibrate.report.facts import AnswerMap
from papilla.calibration.published import PUBLISHED_FORWARD, PUBLISHED_INVERSE, SPECIMENS_MPA, exact_inverse
from papilla.errors import InputError
from papilla.files import write_text
from papilla.finger import DEFAULT_FINGER, Finger
from papilla.units import gf_to_newton
from papilla.view.page import either, environment, image

SHOWN_FORCE_N, SHOWN_MODULUS_MPA = 0.588, 0.51
"""The press in the picture of the strain field: 60 gf on the middle one of the published specimens."""
CURVE_POINTS = 80
ALT = {
    "sd_against_force": "S_d against force, a curve per modulus",
    "sd_against_modulus": "S_d against modulus, a curve per force",
    "gauge_readings": "gauge readings against force",
    "uncertainty_map": "relative uncertainty of the recovered modulus over force and modulus",
    "recovery_map": "error of recovered moduli",
}
"""What the diagrams are, in words."""


def write_report(
    path: str | PathLike,
    done: Calibrated,
    finger: Finger | None = None,
    *,
    seconds: float | None = None,
    progress: Callable[[str], None] | None = None,
) -> None:
    """Write the report of a calibration as one HTML file: no script, no link, pictures inline.

    Parameters
    ----------
    finger : the design; needed for the strain field and the mesh.
    seconds : how long the calibration took.
    progress : called with a line of text before a long step (the strain field, unless it is in the cache).

    Raises `InputError` for a calibration from a sweep without its finger, `FileAccessError` if the file cannot be
    written, and what the model of the strain field raises.
    """
    if done.reduced is not None and finger is None:
        raise InputError("the report of a calibration from a sweep needs the finger that was swept")
    answers, comparison = AnswerMap.of(done.calibration), covered_comparison(done.calibration)
    templates = environment("papilla.calibrate.report")
    templates.filters["symbols"] = symbols
    text = templates.get_template("report.html").render(
        done=done,
        calibration=done.calibration,
        recovery=done.recovery,
        reduced=done.reduced,
        finger=finger,
        seconds=seconds,
        answers=answers,
        friction_known=facts.share_with_known_friction(done.calibration),
        comparison=comparison,
        depths=done.depths,
        published=PUBLISHED_FORWARD,
        specimens=SPECIMENS_MPA,
        inverses=(done.calibration.inverse, exact_inverse(), PUBLISHED_INVERSE),
        rounding=rounding_error(PUBLISHED_INVERSE),
        quadratic=facts.quadratic_error(done.calibration),
        facts=facts,
        **_of_the_model(done, finger, progress),
        **_plots(done, answers, comparison),
        bench=_bench(done),
    )
    write_text(path, text)


def symbols(text: str) -> Markup:
    """A sentence of the calibration with symbols formatted as on the page."""
    set_as = {"S_d": "S<sub>d</sub>", "f2": "f²", "E2": "E²"}
    said = str(escape(text))
    for written, shown in set_as.items():
        said = said.replace(written, shown)
    return Markup(said)


def _of_the_model(done: Calibrated, finger: Finger | None, progress: Callable[[str], None] | None) -> dict:
    """Content that needs the finger's model: figures of its mesh, and the picture of its strain field."""
    if done.reduced is None or finger is None:
        return {"quality": None, "strain_picture": None, "default_finger": False}
    specimen = finger.bench.specimen(SHOWN_MODULUS_MPA)
    scene = {"force": SHOWN_FORCE_N, "friction": done.presses.friction}
    press = cached_press(view.shown, done.reduced, specimen, **scene)
    alt = "strain field of a press, with gauges and contact"
    return {
        "quality": mesh.quality(mesh.build(finger, size_mm=done.reduced.mesh_size_mm)),
        "strain_picture": either(view.strain_pictures(finger, done.reduced, press, specimen, progress), alt, "png"),
        "default_finger": finger.sha256 == Finger.load(DEFAULT_FINGER).sha256,
    }


def _bench(done: Calibrated) -> dict | None:
    """Content about a finger that was identified from measured presses: their picture and residuals, and the
    diagnosis."""
    if done.bench is None:
        return None
    from papilla.calibrate.report.identification_page import parts

    return parts(done.bench.found, done.bench.diagnosis) | {
        "recovery": done.bench.recovery,
        "inside": int(done.bench.inside.sum()),
    }


def _plots(done: Calibrated, answers: AnswerMap, comparison: Comparison | None) -> dict[str, Markup]:
    """The page's diagrams."""
    calibration, recovery, plots = done.calibration, done.recovery, view.plots
    low, high = calibration.domain["modulus_MPa"]
    modulus = np.geomspace(low, high, CURVE_POINTS)
    force = np.geomspace(*calibration.domain["force_N"], CURVE_POINTS)
    moduli = [low, *(value for value in sorted((0.05, 0.2, *SPECIMENS_MPA)) if low < value < high), high]
    forces = np.linspace(*calibration.domain["force_N"], 6)
    shown = SHOWN_MODULUS_MPA if low <= SHOWN_MODULUS_MPA <= high else (low * high) ** 0.5
    figures = {
        "sd_against_force": plots.sd_against_force(
            force,
            moduli,
            calibration.predict(force[:, None], np.array(moduli)),
            published=None
            if comparison is None
            else (gf_to_newton(comparison.force_gf), SPECIMENS_MPA, comparison.published / comparison.scale),
        ),
        "sd_against_modulus": plots.sd_against_modulus(
            modulus, forces.tolist(), calibration.predict(forces[:, None], modulus)
        ),
        "gauge_readings": plots.gauge_readings(
            force,
            [gauge.name for gauge in calibration.gauges],
            calibration.predict_readings(force, shown),
            f"{shown:.3g} MPa",
        ),
        "uncertainty_map": plots.uncertainty_map(
            answers.force_N,
            answers.modulus_MPa,
            answers.relative_sigma,
            answers.identified,
            (*CHECKED_FORCE_N, *CHECKED_MODULUS_MPA),
        ),
        "recovery_map": plots.recovery_map(recovery.force_N, recovery.modulus_MPa, recovery.error),
    }
    return {name: image(plot, ALT[name]) for name, plot in figures.items()}
