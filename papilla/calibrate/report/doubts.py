"""What a reader of a calibration has to doubt, each sentence with the figure behind it, taken from the data."""

from collections import Counter

import numpy as np

from papilla.calibrate.job import Calibrated
from papilla.calibrate.press_table import Sweep
from papilla.calibrate.published import SPECIMENS_MPA, Comparison
from papilla.calibrate.report.figures import AnswerMap
from papilla.calibrate.report.html import Markup, join, number, plain, table, tag
from papilla.calibration import Calibration, SoftnessStatus
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.finger import DEFAULT_FINGER, Finger

PERCENT = 100.0
FORCE_ERROR = 0.01
"""Relative error of force whose cost is stated."""


def doubts(done: Calibrated, finger: Finger | None, comparison: Comparison | None, answers: AnswerMap) -> Markup:
    """The list, most consequential first."""
    items = [
        *_readings(done.reduced, comparison),
        *_assumptions(finger, done),
        *_harder(answers),
        *_measurement(done.calibration),
        *_scatter(done.calibration),
        *_form(done.calibration),
        *_scenes(done),
    ]
    return tag("ul", *(tag("li", tag("b", head), " ", text) for head, text in items))


def _readings(reduced: ReducedFinger | None, comparison: Comparison | None) -> list[tuple[str, object]]:
    if reduced is None:
        return []
    times = (
        f" The published S_d is {number(1 / comparison.scale, 2)} times smaller, if it is in µε." if comparison else ""
    )
    if (reduced.gains == 1).all() and (reduced.levers == 0).all():
        text = (
            "Every gauge is taken to read the silicone's strain (gain 1, lever 0). A foil in soft rubber reads gain × "
            "strain + "
            "lever × curvature change, and both are unknown until this finger is identified from real presses." + times
        )
        return [("The readings are strains, not a foil's output.", text)]
    gains, levers = (", ".join(plain(value) for value in values) for values in (reduced.gains, reduced.levers))
    text = f"Gauge gains {gains} and levers {levers} mm were given with the design; S_d scales with them.{times}"
    return [("Gauge gains and levers are inputs.", text)]


def _assumptions(finger: Finger | None, done: Calibrated) -> list[tuple[str, object]]:
    if finger is None:
        return []
    outer, inner = plain(finger.outer.modulus), plain(finger.inner.modulus)
    listed = ""
    if finger.sha256 == Finger.load(DEFAULT_FINGER).sha256:
        listed = " The papers give no moduli and no gauge positions: the design file marks every assumption."
    if done.reduced is None:
        return []
    text = f"Outer layer {outer} MPa, inner layer {inner} MPa, small strains, frictionless contact.{listed}"
    return [("The layers' moduli are inputs, and set the scale of everything.", text)]


def _harder(answers: AnswerMap) -> list[tuple[str, object]]:
    row = len(answers.force_N) // 2
    told = answers.modulus_MPa[answers.identified[row]]
    lost = 1 - float(answers.identified.mean())
    if not len(told):
        return [("No modulus can be told.", f"At {number(float(answers.force_N[row]), 2)} N every answer is refused.")]
    sigma = float(answers.relative_sigma[row, np.flatnonzero(answers.identified[row])[-1]])
    text = (
        f"At {number(float(answers.force_N[row]), 2)} N the hardest modulus that can be told is "
        f"{number(float(told.max()), 2)} MPa, "
        f"to {number(PERCENT * sigma, 2)} % (one standard deviation). Of the (logarithmic) domain "
        f"{number(PERCENT * lost, 2)} % is not identifiable even from an exact S_d."
    )
    return [("Objects harder than the sensor look alike.", text)]


def _measurement(calibration: Calibration) -> list[tuple[str, object]]:
    """What an error of force costs, at the published moduli."""
    low, high = calibration.domain["force_N"]
    force = float(np.clip(0.5, low, high))
    rows = []
    for modulus in SPECIMENS_MPA:
        sd = float(calibration.predict(force, modulus))
        if not np.isfinite(sd):
            continue
        exact, blurred = (calibration.invert(sd, force, force_sigma=share * force) for share in (0.0, FORCE_ERROR))
        rows.append(f"{number(PERCENT * float(blurred.sigma_MPa) / modulus, 2)} % at {modulus:g} MPa")
    if not rows:
        return []
    cost = ", ".join(rows)
    error = f"At {number(force, 2)} N an error of {PERCENT * FORCE_ERROR:g} % in force"
    text = f"{error} makes E uncertain by {cost}. Measure force well first."
    return [("Force errors weigh more than gauge noise.", text)]


def _scatter(calibration: Calibration) -> list[tuple[str, object]]:
    known = calibration.surface.uncertainty
    if not known.meshes:
        text = "Its intervals hold the fit's residual alone, and say nothing of how far the model is from the finger."
        return [("No independent mesh went into this calibration.", text)]
    share = [number(PERCENT * value, 2) for value in (known.scatter.min(), known.scatter.max())]
    text = (
        f"{known.meshes} independent meshes move S_d by {share[0]} to {share[1]} % (rms). It is in every sigma and "
        f"interval "
        f"(95 %: {number(known.scatter_factor)} times the scatter)."
    )
    return [("The mesh moves the answer.", text)]


def _form(calibration: Calibration) -> list[tuple[str, object]]:
    inverse = calibration.inverse
    items: list[tuple[str, object]] = []
    if inverse.branch < 0:
        top = "nowhere" if inverse.modulus_MPa is None else f"up to {number(inverse.modulus_MPa[1])} MPa only"
        text = (
            f"S_d saturates with E, so the quadratic bends down: it rises {top}. There its inverse takes the minus "
            f"sign, not the "
            "plus sign of (10), and beyond it one S_d has two moduli. The surface, which the estimator uses, has no "
            "such limit."
        )
        items.append(("The E² coefficient is negative.", text))
    if calibration.notes:
        said = "; ".join(calibration.notes).replace("f2", "f²").replace("E2", "E²")
        items.append(("The fit itself says:", f"{said}."))
    return items


def _scenes(done: Calibrated) -> list[tuple[str, object]]:
    presses = done.presses
    if not isinstance(presses, Sweep):
        text = "Specimens of another shape or thickness, or another touch-down point, need presses of their own."
        return [("It holds for the specimens that were measured.", text)]
    largest = PERCENT * 1e-6 * float(np.nanmax(np.abs(presses.reading)))
    return [
        (
            "It holds for one shape of specimen.",
            f"Every press was on a {presses.specimen} at the touch-down point of the reduction. A thinner specimen "
            f"feels harder.",
        ),
        (
            "The model is linear.",
            f"Gauge readings reach {number(largest, 2)} % in this sweep; silicone stiffens, softens on first loading "
            f"and creeps.",
        ),
    ]


def status_table(done: Calibrated, answers: AnswerMap) -> Markup:
    """How often each status occurs: of the presses of a sweep, and of answers over the domain."""
    parts = []
    if isinstance(done.presses, Sweep):
        kinds = Counter(_kind(sentence) for sentence in done.presses.status)
        parts.append(table(["status of the sweep's presses", "presses"], kinds.most_common(), text_columns=(0,)))
    answered = Counter(SoftnessStatus(int(code)).sentence for code in answers.status.ravel())
    head = ["status of the answers over the domain", "of the map"]
    rows = [(kind, f"{number(PERCENT * count / answers.status.size, 3)} %") for kind, count in answered.most_common()]
    return join([*parts, table(head, rows, text_columns=(0,))])


def _kind(sentence: str) -> str:
    """A status without its figures: what comes before the first colon or comma, and "converged" for what did."""
    head = sentence.split(":")[0]
    return "converged on the contact rung" if head == "contact" else head.split(",")[0]
