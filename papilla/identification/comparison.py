"""Compares fingers and calibrations: size of S_d, uncertainty of the modulus, receptive field of each gauge, and cost;
with a verdict in words, and a page.

All are compared over the forces and moduli that all of them cover, with the same noise of gauges and force.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np
from markupsafe import Markup

from papilla import fem, view
from papilla.calibration import IDENTIFIABLE_SIGMA, Calibration
from papilla.calibration.fitting.sweep import SHOWN_PRESS
from papilla.core.errors import InputError
from papilla.core.files import write_text
from papilla.core.progress import Progress, silent
from papilla.core.tables import write_table
from papilla.core.units import MS_PER_S, N_PER_MN, PER_CENT, US_PER_S, to_microstrain
from papilla.identification.bench import calibrate
from papilla.identification.noise import PressNoise
from papilla.model.finger import Finger
from papilla.view.page import either, environment, image
from papilla.view.pictures import receptive_of

COMPARED_NOISE, FORCE_ERROR = PressNoise.readings_microstrain, PressNoise.force
"""Standard deviation of a reading (microstrain) and relative one of the force: what `papilla identify` finds for a
typical bench."""

MODULUS_MAP_POINTS = 40
"""Forces and moduli of the map over which the uncertainty of E is compared."""

SLOPE_MODULUS_RATIO = 1.01
"""Ratio of the moduli between which the slope of S_d is a difference quotient."""

ALIKE_VALUE_DIFFERENCE = 0.03
"""Relative difference up to which two values are called alike: S_d differs by up to half of it between meshes."""

BETTER_WORDS, LARGER_WORDS = ("is better", "is best"), ("has the larger one", "has the largest one")
"""Said of the first of two, and of more. A larger S_d is no better by itself: a gain makes it larger, too."""

TIMED_COMPARISON_PRESSES = 50
"""Numbers of presses and answers whose median time is reported."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """What is compared: a calibration, and the finger that it was computed for, if that is known."""

    name: str
    calibration: Calibration
    finger: Finger | None = None


@dataclass(frozen=True)
class GaugeReach:
    """Response of a gauge to a small load: the largest response (microstrain per mN), its place (x, y in mm), and the
    area of the skin (mm2) where the response is at least half of it."""

    gauge: str
    strongest: float
    x_mm: float
    y_mm: float
    area_mm2: float


@dataclass(frozen=True, eq=False)
class CandidateFigures:
    """The figures of a candidate.

    sd_microstrain : in `Comparison.scene`. slope : median of d ln S_d / d ln E. sigma : median of
    sigma_E / E. identified : share of the domain with sigma_E / E of at most half. relative_sigma : (forces, moduli),
    infinite if there is no modulus. answer_us : time to invert one S_d. press_ms : of one press; None without a finger.
    reach : a gauge each; empty without a finger.
    """

    name: str
    gauges: int
    sd_microstrain: float
    slope: float
    sigma: float
    identified: float
    answer_us: float
    press_ms: float | None
    reach: tuple[GaugeReach, ...]
    relative_sigma: np.ndarray

    def to_json(self) -> dict:
        """Plain values, the map left out."""
        plain = {key: value for key, value in vars(self).items() if key not in ("relative_sigma", "reach")}
        return plain | {"reach": [vars(reach) for reach in self.reach]}


@dataclass(frozen=True, eq=False)
class Comparison:
    """Rows, the common domain (force_N and modulus_MPa of the maps), and verdicts in words."""

    rows: tuple[CandidateFigures, ...]
    force_N: np.ndarray
    modulus_MPa: np.ndarray
    verdicts: tuple[str, ...]

    @property
    def scene(self) -> tuple[float, float]:
        """Force (N) and modulus (MPa) of the press that is compared."""
        return _compared_press(self.force_N, self.modulus_MPa)


def _compared_press(force: np.ndarray, modulus: np.ndarray) -> tuple[float, float]:
    """`SHOWN_PRESS`, or the middle of a common domain that does not cover it."""
    covered = all(axis[0] <= value <= axis[-1] for axis, value in zip((force, modulus), SHOWN_PRESS, strict=True))
    return SHOWN_PRESS if covered else (float(force[len(force) // 2]), float(modulus[len(modulus) // 2]))


def candidate(path: str | Path, **how) -> Candidate:
    """The candidate that a file or the name of a shipped finger gives: a calibration (.json), or a design, which
    `calibrate` calibrates with the arguments `how`. Raises what loading and calibrating raise."""
    if Path(path).suffix.lower() == ".json":
        return Candidate(str(path), Calibration.load(path))
    finger = Finger.load(path)
    return Candidate(str(path), calibrate(finger, **how).calibration, finger)


def compare(candidates: Sequence[Candidate], progress: Progress = silent) -> Comparison:
    """Compare the candidates. Raises `InputError` for fewer than two, or if their calibrations share no domain."""
    if len(candidates) < 2:
        raise InputError("a comparison needs at least two designs or calibrations")
    names = [entry.name for entry in candidates]
    if len({*names}) < len(names):
        raise InputError(f"{next(name for name in names if names.count(name) > 1)} is given twice")
    force, modulus = (_shared(candidates, key) for key in ("force_N", "modulus_MPa"))
    rows = [_row(entry, force, modulus, progress) for entry in candidates]
    return Comparison(tuple(rows), force, modulus, tuple(_verdicts(rows, _compared_press(force, modulus))))


def _shared(candidates: Sequence[Candidate], key: str) -> np.ndarray:
    """Points, evenly spaced in the logarithm, over the range that all calibrations cover."""
    lows, highs = zip(*(entry.calibration.domain[key] for entry in candidates), strict=True)
    if max(lows) >= min(highs):
        ranges = ", ".join(f"{low:g}-{high:g}" for low, high in zip(lows, highs, strict=True))
        raise InputError(f"the calibrations share no {key}: they cover {ranges}")
    inside = np.geomspace(max(lows), min(highs), 2 * MODULUS_MAP_POINTS + 1)
    return inside[1::2]


def _row(entry: Candidate, force: np.ndarray, modulus: np.ndarray, progress: Progress) -> CandidateFigures:
    progress(f"comparing {entry.name}")
    calibration = entry.calibration
    forces, moduli = np.meshgrid(force, modulus, indexing="ij")
    sd = calibration.predict(forces, moduli)
    slope = np.log(calibration.predict(forces, moduli / SLOPE_MODULUS_RATIO) / sd) / -np.log(SLOPE_MODULUS_RATIO)
    noise = {"sd_sigma": COMPARED_NOISE / np.sqrt(len(calibration.gauges)), "force_sigma": FORCE_ERROR * forces}
    answer = calibration.invert(sd, forces, interval=False, **noise)
    with np.errstate(invalid="ignore"):
        relative = np.nan_to_num(np.asarray(answer.sigma_MPa) / np.asarray(answer.modulus_MPa), nan=np.inf)
    middle, scene = MODULUS_MAP_POINTS // 2, _compared_press(force, modulus)
    answers = _timed(lambda: calibration.invert(float(sd[middle, middle]), float(force[middle])))
    return CandidateFigures(
        name=entry.name,
        gauges=len(calibration.gauges),
        sd_microstrain=float(calibration.predict(*scene)),
        slope=float(np.nanmedian(slope)),
        sigma=float(np.median(relative)),
        identified=float((relative <= IDENTIFIABLE_SIGMA).mean()),
        answer_us=US_PER_S * answers,
        press_ms=None if entry.finger is None else MS_PER_S * _press_time(entry.finger, scene),
        reach=() if entry.finger is None else _reach(entry.finger, progress),
        relative_sigma=relative,
    )


def _timed(call: Callable[[], object]) -> float:
    """Median seconds of a call."""
    seconds = []
    for _ in range(TIMED_COMPARISON_PRESSES):
        began = perf_counter()
        call()
        seconds.append(perf_counter() - began)
    return median(seconds)


def _press_time(finger: Finger, scene: tuple[float, float]) -> float:
    reduced, (force, modulus) = fem.prepare(finger), scene
    specimen = finger.bench.specimen(modulus)
    return _timed(lambda: fem.press(reduced, specimen, force=force))


def _reach(finger: Finger, progress: Progress) -> tuple[GaugeReach, ...]:
    fields = receptive_of(finger, progress=progress)
    points, triangles = fields.mesh.points, fields.mesh.boundaries["skin"]
    corners = points[triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    reaches = []
    for gauge, felt in zip(finger.gauges, fields.strain_per_newton, strict=True):
        response = np.zeros(len(points))
        response[fields.vertices] = felt
        strongest = int(np.abs(response).argmax())
        share = np.abs(response[triangles]).mean(axis=1) >= abs(response[strongest]) / 2
        x, y, _ = points[strongest].tolist()
        per_mN = N_PER_MN * float(to_microstrain(response[strongest]))
        reaches.append(GaugeReach(gauge.name, per_mN, x, y, float(areas[share].sum())))
    return tuple(reaches)


def _verdicts(rows: Sequence[CandidateFigures], scene: tuple[float, float]) -> list[str]:
    """Verdicts: which candidate is better in which quantity, a sentence each."""
    compared: list[tuple[str, str, Callable[[float], str], bool, tuple[str, str]]] = [
        ("Standard deviation of E, median over the domain", "sigma", _percent, True, BETTER_WORDS),
        ("Share of the domain where E is identified", "identified", _percent, False, BETTER_WORDS),
        ("S_d at {:.3g} N on {:.3g} MPa".format(*scene), "sd_microstrain", "{:,.0f} µε".format, False, LARGER_WORDS),
        ("Change of S_d with the modulus, d ln S_d / d ln E", "slope", "{:.2g}".format, False, BETTER_WORDS),
        ("Gauges that it needs", "gauges", "{:g}".format, True, BETTER_WORDS),
    ]
    verdicts = [_best(rows, *quantity) for quantity in compared]
    for a, b in combinations(rows, 2):
        better = float((a.relative_sigma < b.relative_sigma).mean())
        verdicts.append(f"{a.name} determines the modulus better than {b.name} in {_percent(better)} of the domain.")
    wide = [(figures, median(reach.area_mm2 for reach in figures.reach)) for figures in rows if figures.reach]
    if len(wide) > 1:
        listed = ", ".join(f"{figures.name} {area:.0f} mm²" for figures, area in wide)
        verdicts.append(
            f"Median area in which a gauge has at least half of its largest response: {listed}; a smaller one is finer."
        )
    return verdicts


def _percent(share: float) -> str:
    return f"{PER_CENT * share:.0f} %"


def _best(
    rows: Sequence[CandidateFigures],
    what: str,
    key: str,
    words: Callable[[float], str],
    low: bool,
    win: tuple[str, str],
) -> str:
    """Sentence comparing one quantity, of which less (`low`) or more is better; win : the words for the best of two,
    and of more."""
    values = {figures.name: getattr(figures, key) for figures in rows if np.isfinite(getattr(figures, key))}
    listed = ", ".join(
        f"{figures.name} {words(values[figures.name]) if figures.name in values else 'none'}" for figures in rows
    )
    ordered = sorted(values, key=lambda name: values[name], reverse=not low)
    if not ordered:
        return f"{what}: none of them has one."
    best = values[ordered[0]]
    near = [name for name in ordered if abs(values[name] - best) <= ALIKE_VALUE_DIFFERENCE * abs(best)]
    if len(near) > 1:
        return f"{what}: {' and '.join(near)} are alike ({listed})."
    return f"{what}: {near[0]} {win[len(rows) > 2]} ({listed})."


def write_comparison(path: str | Path, found: Comparison, candidates: Sequence[Candidate]) -> None:
    """Write the page of a comparison as one HTML file: no script, no link; raises `FileAccessError`."""
    axes = found.force_N, found.modulus_MPa
    sigmas = [figures.relative_sigma for figures in found.rows]
    maps = [view.plots.uncertainty_map(*axes, sigma, sigma <= IDENTIFIABLE_SIGMA) for sigma in sigmas]
    names = [figures.name for figures in found.rows]
    text = environment("papilla.identification").get_template("comparison.html").render(
        rows=found.rows, verdicts=found.verdicts, scene=found.scene, noise=COMPARED_NOISE, force_error=FORCE_ERROR,
        force_N=found.force_N, modulus_MPa=found.modulus_MPa,
        maps=[image(drawn, f"Uncertainty of E of {name}") for drawn, name in zip(maps, names, strict=True)],
        fields=[entry.finger and _fields(entry.finger, entry.name) for entry in candidates],
    )  # fmt: skip
    write_text(path, text)


def _fields(finger: Finger, name: str) -> Markup:
    """Receptive fields of a finger's gauges."""
    fields = receptive_of(finger)
    pictures = (view.png(view.receptive_fields_figure(fields, finger, small=small), 120) for small in (False, True))
    return either(pictures, f"Receptive fields of {name}", "png")


def write_comparison_table(path: str | Path, found: Comparison) -> None:
    """Write the figures of each candidate as CSV, a row each; raises `FileAccessError`."""
    rows = [figures.to_json() for figures in found.rows]
    columns = {key: [figures[key] for figures in rows] for key in rows[0] if key != "reach"}
    columns["press_ms"] = [np.nan if value is None else value for value in columns["press_ms"]]
    areas = [[reach.area_mm2 for reach in figures.reach] for figures in found.rows]
    columns["median_field_mm2"] = [float(np.median(of)) if of else np.nan for of in areas]
    write_table(path, columns)
