"""report.html: one self-contained page that says what a calibration is, how good it is, and what to doubt."""

from collections.abc import Callable

from papilla import fem, view
from papilla.calibrate.job import Calibrated
from papilla.calibrate.press_table import Sweep, default_specimen
from papilla.calibrate.published import Comparison, compare
from papilla.calibrate.report.doubts import doubts, status_table
from papilla.calibrate.report.figures import AnswerMap, error_figures, gauge_figure, sd_figures
from papilla.calibrate.report.html import Markup, cards, join, number, page, picture, plain, tag
from papilla.calibrate.report.sections import (
    contact_section,
    forward_section,
    inverse_section,
    mesh_section,
    provenance_section,
    slopes_table,
)
from papilla.errors import InputError
from papilla.files import write_text
from papilla.finger import Finger

SHOWN_FORCE_N, SHOWN_MODULUS_MPA = 0.588, 0.51
"""The press of the strain-field picture: 60 gf on the middle one of the published specimens."""
PERCENT = 100.0


def write_report(
    path,
    done: Calibrated,
    finger: Finger | None = None,
    *,
    seconds: float | None = None,
    progress: Callable[[str], None] | None = None,
) -> None:
    """Write the report of a calibration as one HTML file: no script, no link, pictures inline.

    Parameters
    ----------
    finger : the design; needed for the strain field and the mesh, which a bench calibration does not have.
    seconds : how long the calibration took.
    progress : called with a line of text before something takes long (the strain field, unless it is in the cache).

    Raises `InputError` for a calibration from a sweep without its finger, `FileAccessError` where the file cannot be
    written, and what the strain field's model raises.
    """
    if done.reduced is not None and finger is None:
        raise InputError("the report of a calibration from a sweep needs the finger that was swept")
    comparison = _comparison(done)
    answers = AnswerMap.of(done.calibration)
    parts: list[Markup] = [_headline(done, answers, seconds)]
    if done.reduced is not None and finger is not None:
        parts.append(_section("The finger under load", _strain_picture(done, finger, progress)))
    parts += [
        _section("Coefficients", forward_section(done, comparison)),
        _section("Exact inverse of the quadratic", inverse_section(done)),
        _section("What the gauges do", sd_figures(done, comparison), gauge_figure(done, _shown_modulus(done))),
        _section(
            "How well the modulus comes back", _recovery_text(done), error_figures(done, answers), slopes_table(done)
        ),
        _section("What to doubt", doubts(done, finger, comparison, answers), status_table(done, answers)),
    ]
    if (contact := contact_section(done)) is not None:
        parts.append(_section("Contact", contact))
    if done.reduced is not None and finger is not None:
        parts.append(_section("Mesh", mesh_section(done, finger)))
    parts.append(_section("Provenance", provenance_section(done)))
    write_text(path, page(f"Calibration of {_name(done)}", parts))


def _section(title: str, *content: object) -> Markup:
    return tag("section", tag("h2", title), *content)


def _name(done: Calibrated) -> str:
    return done.calibration.finger.get("name") or "a measured finger"


def _headline(done: Calibrated, answers: AnswerMap, seconds: float | None) -> Markup:
    recovery, presses = done.recovery, done.presses
    where = "same mesh, no noise" if isinstance(presses, Sweep) else "of these presses"
    where += f"; {recovery.answered} of {len(recovery.error)} answered"
    kind = "computed" if isinstance(presses, Sweep) else "measured"
    items = [
        (f"{number(PERCENT * recovery.max_error, 2)} %", f"largest error of recovered E, {where}"),
        (f"{number(PERCENT * recovery.rms_error, 2)} %", f"rms error of recovered E, {where}"),
        (plain(len(presses)), f"{kind} presses"),
        (f"{number(PERCENT * float(answers.identified.mean()), 3)} %", "of the domain is identifiable"),
    ]
    if seconds is not None:
        items.append((f"{number(seconds, 2)} s", "for the calibration"))
    domain = done.calibration.domain
    force, modulus = (" to ".join(plain(value) for value in domain[key]) for key in ("force_N", "modulus_MPa"))
    lead = f"Softness from strain gauges: calibrated over {force} N and {modulus} MPa."
    return join([tag("h1", f"Calibration of {_name(done)}"), tag("p", lead, class_="lead"), cards(items)])


def _recovery_text(done: Calibrated) -> Markup:
    recovery = done.recovery
    if not len(recovery.error):
        return tag("p", "No press lies within 20-100 gf and 0.05-0.72 MPa, where recovery is checked.")
    what = (
        "presses between the sweep's points"
        if isinstance(done.presses, Sweep)
        else "of the measured presses themselves"
    )
    unanswered = len(recovery.error) - recovery.answered
    text = (
        f"The surface over ln force and ln modulus was asked for the modulus of {len(recovery.error)} {what}, within "
        f"20 to 100 gf "
        f"and 0.05 to 0.72 MPa. It is off by {number(PERCENT * recovery.max_error, 2)} % at most and "
        f"{number(PERCENT * recovery.rms_error, 2)} % rms; {unanswered} were left unanswered."
    )
    return tag("p", text)


def _strain_picture(done: Calibrated, finger: Finger, progress: Callable[[str], None] | None) -> Markup:
    assert done.reduced is not None
    specimen = default_specimen(SHOWN_MODULUS_MPA)
    press = fem.press(done.reduced, specimen, force=SHOWN_FORCE_N, fidelity="contact")
    content = view.strain_picture(finger, done.reduced, press, specimen, progress=progress)
    caption = (
        "The finger cut open in the plane of its gauges (yellow). Pressing bends the hard outer layer into the soft "
        "inner one: "
        "below the contact the boundary between them is stretched, beside it shortened, and the gauges' readings "
        "spread."
    )
    return picture(content, "png", "strain field of a press, with gauges and contact", caption, wide=True)


def _shown_modulus(done: Calibrated) -> float:
    """The picture's modulus, or the middle of a domain that does not hold it."""
    low, high = done.calibration.domain["modulus_MPa"]
    return SHOWN_MODULUS_MPA if low <= SHOWN_MODULUS_MPA <= high else (low * high) ** 0.5


def _comparison(done: Calibrated) -> Comparison | None:
    """Against (9), where the calibration covers its forces and moduli."""
    try:
        return compare(done.calibration)
    except InputError:
        return None
