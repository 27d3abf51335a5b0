"""`papilla identify`: identifies the finger that made a log of presses."""

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from papilla.cli import options
from papilla.cli.options import argument, option
from papilla.cli.output import CHECK_FAILED, CommandResult, print_table, progress, tell
from papilla.core.errors import InputError
from papilla.core.units import PER_CENT

if TYPE_CHECKING:
    from papilla.identification import Diagnosis, Identification, PressNoise
    from papilla.identification.suggest import Suggestion
    from papilla.logs import PressLog
    from papilla.model.finger import Finger
    from papilla.model.specimen import Specimen

_UNITS = {"_MPa": "MPa", "_modulus": "MPa", "_mm": "mm", "_deg": "deg", "_microstrain": "µε"}
MOST_PRINTED_EXPLANATIONS = 4
"""Largest number of explanations that are printed; the JSON has all."""


@dataclass(frozen=True)
class SuggestOptions:
    """Number and kind of the suggested presses."""

    suggest: int | None = option(None, "Suggest the next N presses; without a log, all of them.", metavar="N")
    moduli: str | None = option(
        None, "Moduli of the specimens at hand, MPa.  [default: those of the log]", metavar="E,E,..."
    )
    places: str | None = option(
        None, "Where presses may be suggested, mm: '0,0 3,0 0,3'.  [default: the apex]", metavar="'X,Y X,Y ...'"
    )
    criterion: Literal["I", "D"] = option("I", "Suggest for the least variance of E (I) or of the parameters (D).")

    def check(self, log: Path | None, **fit: object) -> None:
        """Refuse unusable options and combinations: options `fit` of a fit without a log, and a fit whose result is not
        written; raises `InputError`."""
        self.read_moduli(), self.read_places()
        if log is None and self.suggest is None:
            raise InputError("Missing argument 'LOG.csv': only --suggest, a protocol without a log, needs none")
        if log is None and (asked := [name for name, value in fit.items() if value is not None]):
            raise InputError(f"--{asked[0]} needs a log of presses: a protocol without a log has no fit")
        if self.suggest is not None:
            if self.suggest < 1:
                raise InputError(f"--suggest must be at least 1, got {self.suggest}")
            return
        if fit["out"] is None:
            raise InputError("Missing option '--out': the design file of the identified finger")
        for name in ("moduli", "places"):
            if getattr(self, name) is not None:
                raise InputError(f"--{name} goes with --suggest")

    def read_moduli(self) -> list[float]:
        """The moduli (MPa), empty if not given; raises `InputError`."""
        return [] if self.moduli is None else options.moduli_of(self.moduli)

    def read_places(self) -> list[tuple[float, float]]:
        """The places (x, y in mm), the apex if not given; raises `InputError`."""
        what, places = "--places must be pairs x,y in mm with spaces between", []
        for text in ("0,0" if self.places is None else self.places).split():
            x, comma, y = text.partition(",")
            if not comma:
                raise InputError(f"{what}, got {text!r}")
            places.append((options.number(what, x), options.number(what, y)))
        return places

    def protocol(self, design: "Finger", specimen: "Specimen", noise: "PressNoise") -> dict:
        """The first presses for a finger of which only the design is known, as plain values."""
        moduli = self.read_moduli()
        if not moduli:
            raise InputError("a protocol without a log needs --moduli: those of the available specimens, in MPa")
        with progress() as reporter:
            reporter("what each press would tell")
            return {"finger": design.name, **self._found(design, moduli, specimen=specimen, noise=noise)}

    def after(self, identified: "Identification") -> dict:
        """The most informative presses after those of an identification, on its specimens unless others are given, as
        plain values; empty if none are requested."""
        moduli = self.read_moduli() or sorted({float(modulus) for modulus in identified.problem.log.modulus_MPa})
        return {} if self.suggest is None else self._found(identified, moduli)

    def _found(self, prior: "Finger | Identification", moduli: list[float], **bench: Any) -> dict:
        from papilla.identification.suggest import suggest_presses

        places: Any = self.read_places()
        return suggested(
            suggest_presses(prior, self.suggest or 1, moduli, places=places, criterion=self.criterion, **bench)
        )


def identify(
    specimen: options.SpecimenOptions,
    further: SuggestOptions,
    log: Path | None = argument(None, "Log of presses (CSV): force_N, modulus_MPa, g1, ...", metavar="LOG.csv"),
    out: Path | None = option(None, "Design file of the identified finger to write (TOML)."),
    finger: options.FingerOption = None,
    free: list[str] | None = option(None, "A further parameter to fit, such as thickness_mm."),
    fix: list[str] | None = option(None, "Hold a parameter, such as lever_mm=0 or gain.g1=1.", metavar="NAME=VALUE"),
    friction: options.FrictionOption = None,
    noise: float = option(5.0, "Noise of a reading, microstrain."),
    force_error: float = option(0.01, "Relative error of a force."),
    report: Path | None = option(None, "Page to write on the fit (HTML)."),
    relaxation: Literal["1", "2"] | None = option(
        None, "Fit so many relaxation times to the log's longest touch (t_s)."
    ),
    compare: Path | None = option(
        None,
        "Test whether it is still the finger of this identified design; exit code 1 if not; nothing is written.",
        metavar="OLD.toml",
    ),
    log_map: options.MapOption = None,
) -> CommandResult:
    """Identify a real finger from presses: moduli, gains, levers, zeros, with intervals and doubts.

    Every command accepts the design file that is written; calibrate includes its uncertainty. --suggest proposes the
    next presses; --compare tests whether it is still the same finger.
    """
    of_fit = {"out": out, "report": report, "free": free, "fix": fix, "friction": friction, "relaxation": relaxation}
    if compare is not None:
        return _compared(compare, log, log_map, finger=finger, suggest=further.suggest, **of_fit)
    rubbing, fixed = options.read_friction(friction), _held(fix or [])
    further.check(log, **of_fit)
    from papilla.core.files import check_writable, replacing_set
    from papilla.identification import PressNoise, diagnose, record
    from papilla.identification import identify as fit
    from papilla.identification.page import write_identification

    outputs = [path for path in (out, report) if path is not None]
    design = options.design_of(finger)
    options.keep_inputs([log, finger, *options.surface_files(design), log_map], outputs)
    touched = specimen.of(1.0, design)
    stated = PressNoise(readings_microstrain=noise, force=force_error)
    if log is None:
        protocol = further.protocol(design, touched, stated)
        return CommandResult(protocol, partial(_print_suggestion, protocol))
    presses = options.read_press_log(log, False, mixed=touched, log_map=log_map)
    if relaxation is not None and presses.t_s is None:
        raise InputError(f"{log}: --relaxation needs a column t_s: when each row was taken")
    for path in outputs:
        check_writable(path.parent)
    with progress() as reporter:
        with options.about(log):
            bench: Any = {"specimen": touched, "noise": stated, "friction": rubbing, "progress": reporter}
            fitted = fit(presses, design, free=free or (), fix=fixed, **bench, processes=options.DEFAULT_PROCESSES)
        reporter("what to doubt")
        diagnosis = diagnose(fitted)
        silicone, relaxation_facts = _relaxation_of(log, fitted, relaxation, log_map)
        pressed = [shape.specimen for shape in fitted.problem.shapes]
        of_what = " and ".join(touched.words for touched in pressed)
        identified = fitted.with_record(replace(record(fitted, diagnosis, of_what), **relaxation_facts))
        besides = _loops_of(presses) | silicone | further.after(fitted)
        with replacing_set(outputs) as files:
            if out is not None:
                identified.save(files[0])
            if report is not None:
                write_identification(files[-1], fitted, diagnosis)
    written = {name: str(path) for name, path in (("finger", out), ("report", report)) if path is not None}
    summary = summary_of(fitted, diagnosis) | {"specimen": options.describe(pressed[0])} | written | besides
    return CommandResult(summary, partial(_print, summary))


def _held(fix: list[str]) -> dict[str, float]:
    fixed = {}
    for text in fix:
        name, sign, value = text.partition("=")
        if not sign:
            raise InputError(f"--fix takes NAME=VALUE, got {text!r}")
        fixed[name.strip()] = options.number(f"--fix {name.strip()} must be a number", value)
    return fixed


def summary_of(identified: "Identification", diagnosis: "Diagnosis") -> dict:
    """Parameters with intervals, and doubts, as plain values."""
    parameters = {}
    for name, value in identified.values.items():
        parameters[name] = {"value": value, "free": name in identified.names}
        if name in identified.names:
            low, high = diagnosis.intervals[name]
            parameters[name] |= {"sigma": identified[name][1], "lower": low, "upper": high}
    return {
        "presses": len(identified.problem.log),
        "status": diagnosis.status,
        "parameters": parameters,
        "chi_square": identified.chi_square,
        "freedom": identified.freedom,
        "condition": diagnosis.condition,
        "noise": vars(identified.problem.noise) | {"words": identified.problem.noise.words},
        "friction": identified.problem.shapes[0].friction,
        "physics": " and ".join(shape.physics for shape in identified.problem.shapes),
        "profiles": [vars(interval) for interval in diagnosis.profiles],
        "influence": diagnosis.influence.tolist(),
        "doubts": list(diagnosis.notes),
    }


def _print(summary: dict) -> None:
    from papilla.identification.parameters import kind, plain_value

    rows, still = [], []
    for name, parameter in summary["parameters"].items():
        if not parameter["free"] and plain_value(name, parameter["value"]):
            still.append(kind(name))
            continue
        unit = next((unit for key, unit in _UNITS.items() if name.split(".")[0].endswith(key)), "")
        value = f"{parameter['value']:.4g}"
        rows.append(
            (
                name,
                value,
                f"{unit}  {parameter['lower']:.4g} to {parameter['upper']:.4g}"
                if parameter["free"]
                else f"{unit}  held",
            )
        )
    tell(f"{summary['presses']} presses on: {summary['physics']}")
    tell("Values and 95 % intervals:")
    print_table(rows)
    if still:
        tell(f"Held where they start: {', '.join(dict.fromkeys(still))}.")
    tell(f"Noise: {summary['noise']['words']}.")
    tell(f"Status: {summary['status']}.")
    for doubt in summary["doubts"]:
        tell(f"Doubt: {doubt}.")
    if written := [summary[key] for key in ("finger", "report") if key in summary]:
        tell(f"Wrote {', '.join(written)}")
    _print_relaxation(summary)
    _print_suggestion(summary)


def suggested(suggestion: "Suggestion") -> dict:
    """A suggestion as plain values."""
    presses = zip(suggestion.force_N, suggestion.modulus_MPa, suggestion.place_mm, strict=True)
    return {
        "suggested": [{"force_N": f, "modulus_MPa": e, "x_mm": x, "y_mm": y} for f, e, (x, y) in presses],
        "criterion": suggestion.criterion,
        "over": suggestion.domain,
        "expected_sigma_ln_E": {"before": suggestion.sigma_before, "after": suggestion.sigma_after},
    }


def _print_suggestion(summary: dict) -> None:
    """Print the suggestion of a summary, the most informative press first."""
    if "suggested" not in summary:
        return
    at_apex = not any(press["x_mm"] or press["y_mm"] for press in summary["suggested"])
    tell(f"Press next{', at the apex' if at_apex else ''}:")
    print_table(
        [
            (
                f"press {place}",
                f"{press['force_N']:.3g} N on {press['modulus_MPa']:g}",
                "MPa" if at_apex else f"MPa at {press['x_mm']:g}, {press['y_mm']:g} mm",
            )
            for place, press in enumerate(summary["suggested"], start=1)
        ]
    )
    sigma = summary["expected_sigma_ln_E"]
    tell(
        f"The uncertainty of the finger then makes E uncertain by {_factor(sigma['after'])} over "
        f"{summary['over']}, now {_factor(sigma['before'])}."
    )


def _factor(sigma: float) -> str:
    return f"{PER_CENT * sigma:.2g} %" if sigma < 1 else "more than a factor of two"


def _loops_of(log: "PressLog") -> dict:
    """The loops of a log as plain values; an empty dict if there are none."""
    return {"loops": [vars(loop) for loop in log.loops]} if log.loops else {}


def _relaxation_of(
    path: Path, identified: "Identification", terms: str | None, log_map: Path | None
) -> tuple[dict, dict]:
    """Relaxation fitted to the longest touch of a log: its Prony terms as plain values for `--json`, and what the table
    `[identified]` of the design keeps of them. Both are empty without `--relaxation`."""
    from papilla.identification.one_touch import fit_touch
    from papilla.logs import read_presses

    if terms is None:
        return {}, {}
    if identified.problem.log.stated_sd is not None or len(identified.problem.log.specimens) > 1:
        raise InputError(f"{path}: --relaxation needs readings, of presses on one specimen")
    log = read_presses(path, whole=True, mixed=identified.problem.shapes[0].specimen, log_map=log_map)
    touch = fit_touch(identified, log, int(terms))
    return {"relaxation": touch.to_json()}, touch.recorded


def _print_relaxation(summary: dict) -> None:
    """Show the relaxation of a summary."""
    if "relaxation" not in summary:
        return
    fitted = summary["relaxation"]
    tell(f"Relaxation of the silicone, one factor for both layers, by {fitted['by']} on {fitted['modulus_MPa']:g} MPa:")
    print_table(
        [
            (f"term {place}", f"{term['share']:.3g} ± {term['share_sigma']:.2g} at {term['time_s']:.3g}", "s")
            for place, term in enumerate(fitted["terms"], start=1)
        ]
    )
    for doubt in fitted["doubts"]:
        tell(f"Doubt: {doubt}.")


def _compared(old: Path, log: Path | None, log_map: Path | None, **of_fit: object) -> CommandResult:
    """Compare the presses of a log with a stored identification; exit code 1 means "recalibrate"."""
    if log is None:
        raise InputError("--compare needs the log of the new presses")
    if asked := [name for name, value in of_fit.items() if value]:
        raise InputError(f"--{asked[0].replace('_', '-')} does not go with --compare: the identified design says all")
    from papilla.identification import compare
    from papilla.logs import read_presses
    from papilla.model.finger import Finger

    finger, presses = Finger.load(old), read_presses(log, log_map=log_map)
    with progress() as reporter, options.about(log):
        comparison = compare(finger, presses, progress=reporter)
    shares = ("presses", "chi_square", "freedom", "probability", "same", "verdict")
    facts = {name: getattr(comparison, name) for name in shares}
    facts["changes"] = [vars(change) | {"words": change.words} for change in comparison.changes]

    def show() -> None:
        tell(f"{comparison.verdict}.")
        for change in comparison.changes[:MOST_PRINTED_EXPLANATIONS] if not comparison.same else ():
            tell(f"{change.words} would explain {change.chi_square:.3g} of it.")

    return CommandResult(facts, show, 0 if comparison.same else CHECK_FAILED)
