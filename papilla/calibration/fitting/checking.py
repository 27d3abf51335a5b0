"""Checks a calibration: against presses at finite strain, stuck and without friction, on a mesh that it did not use,
and against measured presses of known modulus. Its finger is checked against the published depths of presses."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from papilla.calibration import INTERVAL_PROBABILITY, Calibration, SoftnessStatus, Uncertainty
from papilla.calibration.fitting.sweep import CalibrationRanges, cached_press
from papilla.core import cache, checks
from papilla.core.errors import InputError
from papilla.core.progress import Progress, counted
from papilla.core.units import gf_to_newton
from papilla.fem import ReducedFinger, press
from papilla.fem.finite.strain_tables import PressedFinger
from papilla.fem.pressing.specimen_strain import with_specimen_strain
from papilla.logs import PressLog
from papilla.mesh import build
from papilla.model.finger import Finger
from papilla.model.specimen import STICK_WORD, Friction, HalfSpace, friction_coefficient, friction_words

CHECKED_FORCES_N, CHECKED_MODULI_MPA = (0.25, 1.0), (0.07, 0.6)
"""Forces and moduli of these presses; on a finger of another size or hardness times the factors of its
`CalibrationRanges`."""
UNSEEN_VARIANT = 4
"""Number of the mesh of these presses."""

WIDENING_STEP, MOST_WIDENING = 1.05, 20.0
"""Factor by which one sigma of S_d grows until the check holds, and the largest that is tried."""

FAILED_WIDENING = 3.0
"""Widening beyond which a calibration counts as failed."""

STATED_MODULUS_TOLERANCE = 0.02
"""Share of the modulus by which the stated one may lie outside the 95 % interval."""

PUBLISHED_POINTS = ((0.20, gf_to_newton(0.70)), (0.80, gf_to_newton(38.37)), (1.0, 0.6))
"""Depth (mm) and force (N) of presses on gratings (2006; 1 mm of 2011), from where the touch was detected."""

RIGID_SPECIMEN = HalfSpace(1e4)
"""Specimen that stands for the gratings, because the papers state neither their material nor the contact."""


@dataclass(frozen=True, eq=False)
class Recovery:
    """Moduli recovered by a calibration from n presses of known modulus.

    force_N, modulus_MPa, recovered_MPa : (n,); recovered is NaN where the calibration gave no answer.
    """

    force_N: np.ndarray
    modulus_MPa: np.ndarray
    recovered_MPa: np.ndarray

    @property
    def error(self) -> np.ndarray:
        """(n,) relative error of the modulus."""
        return self.recovered_MPa / self.modulus_MPa - 1

    @property
    def max_error(self) -> float:
        """Largest |relative error| of the answers; NaN where there is none."""
        return float(np.max(np.abs(self._answered), initial=0.0)) if self._answered.size else float("nan")

    @property
    def rms_error(self) -> float:
        """Root mean square relative error of the answers; NaN where there is none."""
        return float(np.sqrt(np.mean(self._answered**2))) if self._answered.size else float("nan")

    @property
    def answered(self) -> int:
        """Number of presses for which the surface gave a modulus; the errors are those of these presses."""
        return len(self._answered)

    @property
    def _answered(self) -> np.ndarray:
        return self.error[np.isfinite(self.error)]


@dataclass(frozen=True, eq=False)
class Truth(Recovery):
    """Presses that a calibration was not fitted to, and what it recovers from them.

    friction, sd_microstrain : (n,) of the presses; friction infinite where nothing slips.
    sd_error : (n,) relative, of the calibration's S_d.
    inside : (n,) whether the stated 95 % interval contains the modulus.
    """

    friction: np.ndarray
    sd_microstrain: np.ndarray
    sd_error: np.ndarray
    inside: np.ndarray

    @classmethod
    def of(cls, calibration: Calibration, presses: np.ndarray) -> "Truth":
        """The check of a calibration by `presses` (n, 4): friction, force (N), modulus (MPa) and S_d (microstrain);
        those outside of its domain are left out."""
        force, modulus = presses[:, 1], presses[:, 2]
        predicted = calibration.predict(force, modulus)
        friction, force, modulus, sd, predicted = (column[np.isfinite(predicted)] for column in (*presses.T, predicted))
        answer = calibration.invert(sd, force)
        inside = (answer.lower_MPa <= modulus) & (modulus <= answer.upper_MPa)
        return cls(force, modulus, np.asarray(answer.modulus_MPa), friction, sd, predicted / sd - 1, inside)

    @property
    def as_stated(self) -> bool:
        """Whether the 95 % intervals contain the moduli at least as often as they say."""
        return not len(self.inside) or bool(self.inside.mean() >= INTERVAL_PROBABILITY)

    @property
    def max_sd_error(self) -> float:
        """Largest |relative error| of the calibration's S_d."""
        return float(np.abs(self.sd_error).max())

    @property
    def presses(self) -> np.ndarray:
        """(n, 4) friction, force (N), modulus (MPa) and S_d (microstrain)."""
        return np.column_stack([self.friction, self.force_N, self.modulus_MPa, self.sd_microstrain])

    @property
    def frictions(self) -> list[Friction]:
        """The frictions of the presses, the largest first."""
        return [friction_words(friction) for friction in sorted(set(self.friction.tolist()), reverse=True)]

    def by(self, friction: Friction) -> "Truth":
        """The presses of one friction."""
        rows = self.friction == friction_coefficient(friction)
        return Truth(**{name: column[rows] for name, column in vars(self).items()})

    def to_json(self) -> dict:
        """Presses, largest errors of S_d and of E by friction, and the share inside the interval, as plain values."""
        parts = {
            f"{friction:g}" if friction != STICK_WORD else STICK_WORD: self.by(friction) for friction in self.frictions
        }
        return {
            "presses": len(self.force_N),
            "inside_interval": float(self.inside.mean()),
            "sd_max_error": {name: presses.max_sd_error for name, presses in parts.items()},
            "max_error": {name: presses.max_error for name, presses in parts.items()},
        }


def held_as_stated(calibration: Calibration, checks: Mapping[str, np.ndarray]) -> tuple[Calibration, float]:
    """The calibration with intervals wide enough for some presses, and the factor by which one sigma of its S_d grew at
    the middle of its domain: 1 if the intervals hold as many of each kind as they say.

    checks : what the presses are, in words -> presses as `Truth.of` takes them.

    What the check finds is an error of the model, so it is added to the part by large strain; of each gauge, too, in
    the same share of its readings. A widened calibration says so in its notes, and all
    answers made with it do (`Calibration.doubt`).
    """
    stated, judged = calibration.surface.uncertainty, {name: Truth.of(calibration, of) for name, of in checks.items()}
    missed = {name: truth for name, truth in judged.items() if not truth.as_stated}
    if not missed:
        return calibration, 1.0
    middle = math.sqrt(math.prod(stated.scatter_force_N[[0, -1]]))
    sigma, factor, wider = stated.sigma_at(middle), 1.0, calibration
    while factor < MOST_WIDENING and not all(Truth.of(wider, of).as_stated for of in checks.values()):
        factor *= WIDENING_STEP
        wider = _with_model_error(calibration, sigma * math.sqrt(factor**2 - 1))
    held = " and ".join(f"{truth.inside.sum()} of {len(truth.inside)} {name}" for name, truth in missed.items())
    note = f"the 95 % interval of E held {held}: one sigma of S_d is {factor:.2g} times as large for it"
    return replace(in_doubt(wider, note), notes=(*calibration.notes, note)), factor


def in_doubt(calibration: Calibration, reason: str) -> Calibration:
    """The calibration with a reason for doubt, in all answers that are made with it."""
    reasons = [*filter(None, [calibration.provenance.get("unconfirmed", "")]), reason]
    return replace(calibration, provenance=calibration.provenance | {"unconfirmed": "; ".join(map(str, reasons))})


def _with_model_error(calibration: Calibration, share: float) -> Calibration:
    """The calibration with an error of all readings by a `share` of them."""

    def wider(uncertainty: Uncertainty, size: float) -> Uncertainty:
        return replace(uncertainty, strain=math.hypot(uncertainty.strain, share * size))

    surface = replace(calibration.surface, uncertainty=wider(calibration.surface.uncertainty, 1.0))
    gauges = tuple(
        replace(gauge, uncertainty=wider(gauge.uncertainty, float(np.sqrt(np.mean(gauge.surface.coefficients**2)))))
        for gauge in calibration.gauges
    )
    return replace(calibration, surface=surface, gauges=gauges)


def press_truth(
    finger: Finger, size_mm: float, frictions: Sequence[Friction], progress: Progress
) -> tuple[np.ndarray, str]:
    """Presses at finite strain on a mesh that no calibration uses, and a note on the stability of the layers'
    material laws at the strains that they reach.

    The presses are (n, 4) friction, force (N), modulus (MPa) and S_d (microstrain), fewer if some leave the range of
    the model; the second time they come from the cache.
    """

    def make() -> dict[str, np.ndarray]:
        """The presses, stuck ones first."""
        mesh = build(finger, size_mm, variant=UNSEEN_VARIANT, progress=mesh_number(UNSEEN_VARIANT, progress))
        pressed, ranges = PressedFinger(finger, mesh), CalibrationRanges.of(finger)
        forces, moduli = ranges.forced(CHECKED_FORCES_N), ranges.hardened(CHECKED_MODULI_MPA)
        rows, laws = [], []
        # With friction first: without it, a part of the factorised finger is enough
        for friction in sorted(frictions, key=friction_coefficient, reverse=True):
            words = "stuck" if friction == STICK_WORD else f"friction {friction:g}"
            steps = counted(progress, f"against physics, {words}: press")
            for on_linear_block in pressed.presses(forces, moduli, friction, steps):
                press = with_specimen_strain(on_linear_block, pressed.skin)
                laws += [note for note in press.status.split("; ") if "law" in note]
                rows.append((friction_coefficient(friction), press.force, press.modulus, press.sd))
        return {"presses": np.array(rows).reshape(-1, 4), "laws": np.array(worst_law(laws))}

    arrays = cache.fetch("truth", _key(finger, size_mm, frictions), make)
    return arrays["presses"], str(arrays["laws"])


def worst_law(laws: Sequence[str]) -> str:
    """The note on the layers' material laws that is shown if there are several: the last that says "unstable", or the
    last of all; "" if there are none."""
    return next((note for note in reversed(laws) if "unstable" in note), laws[-1] if laws else "")


def mesh_number(variant: int, progress: Progress) -> Progress:
    """Adds the number of the mesh to each stage."""
    return lambda stage: progress(f"mesh {variant + 1} of {UNSEEN_VARIANT + 1}: {stage}")


def truth_is_known(finger: Finger, size_mm: float, frictions: Sequence[Friction]) -> bool:
    """Whether the cache already contains the result of `press_truth`."""
    return cache.find("truth", _key(finger, size_mm, frictions)) is not None


def _key(finger: Finger, size_mm: float, frictions: Sequence[Friction]) -> str:
    return cache.key(__name__, finger.sha256, size_mm, *map(str, frictions), vars(finger.bench.specimen(1.0)))


@dataclass(frozen=True)
class CheckedPress:
    """One press: what was stated, what was recovered, and whether that is right.

    recovered_MPa, sigma_MPa, lower_MPa, upper_MPa : of `Calibration.invert`; NaN if there is none.
    passed : the stated modulus lies in the interval, widened by the tolerance; an interval without any bound does not
    pass.
    sentence : what happened, in words.
    """

    force_N: float
    modulus_MPa: float
    recovered_MPa: float
    sigma_MPa: float
    lower_MPa: float
    upper_MPa: float
    passed: bool
    sentence: str


@dataclass(frozen=True)
class Check:
    """The presses of a check. passed : True if each of them passed and at least one has a modulus."""

    presses: tuple[CheckedPress, ...]
    tolerance: float

    @property
    def answered(self) -> int:
        """Presses for which a modulus was found."""
        return sum(math.isfinite(press.recovered_MPa) for press in self.presses)

    @property
    def missed(self) -> int:
        """Presses that did not pass."""
        return sum(not press.passed for press in self.presses)

    @property
    def passed(self) -> bool:
        """Whether the calibration is right for these presses."""
        return self.missed == 0 and self.answered > 0

    def to_json(self) -> dict:
        """Everything as plain values."""
        numbers = {"presses": len(self.presses), "answered": self.answered, "missed": self.missed}
        return {"passed": self.passed, **numbers, "tolerance": self.tolerance, "rows": [vars(p) for p in self.presses]}


def check(
    calibration: Calibration,
    presses: PressLog,
    *,
    tolerance: float = STATED_MODULUS_TOLERANCE,
    gauge_sigma: float = 0.0,
    force_error: float = 0.0,
) -> Check:
    """Recover the modulus of each press by the calibration's surface, and compare it with the stated one.

    >>> assert papilla.calibration.check(calibration, papilla.read_presses("presses.csv")).passed

    Parameters
    ----------
    presses : on specimens of known modulus, of the same gauges in the same order, or with S_d alone.
    tolerance : share of the modulus by which the stated one may lie outside the stated 95 % interval.
    gauge_sigma : noise of a gauge (microstrain); force_error : relative error of the force; both widen the intervals.

    A press passes where its interval holds the stated modulus. A specimen that is too hard for the sensor has an
    interval with one end; the press passes if that end is right. A press fails if its force lies outside the
    calibrated domain, or if no modulus has its S_d.

    Raises `InputError` for another number of gauges, or values below 0.
    """
    wanted = len(calibration.gauges)
    if presses.stated_sd is None and len(presses.gauge_names) != wanted:
        names = ", ".join(presses.gauge_names)
        raise InputError(f"the presses are of {len(presses.gauge_names)} gauges ({names}), the calibration of {wanted}")
    slack = 1 + checks.within("tolerance", tolerance, 0, 1e6)
    noise = checks.within("gauge_sigma (microstrain)", gauge_sigma, 0, math.inf) / math.sqrt(wanted)
    off = checks.within("force_error", force_error, 0, 1)
    rows = []
    for force, modulus, sd in zip(presses.force_N, presses.modulus_MPa, presses.sd_microstrain, strict=True):
        answer = calibration.invert(float(sd), float(force), sd_sigma=noise, force_sigma=off * float(force))
        assert isinstance(answer.status, SoftnessStatus)
        low, high = float(answer.lower_MPa), float(answer.upper_MPa)
        bounded = np.isfinite(low + high) or (low > 0) != (high < math.inf)
        passed = bool(bounded and low / slack <= modulus <= high * slack)
        sentence = answer.status.sentence
        if not bounded:
            sentence += ": it says nothing about the modulus"
        elif not passed:
            sentence += "; outside the interval"
        numbers = float(force), float(modulus), float(answer.modulus_MPa), float(answer.sigma_MPa)
        rows.append(CheckedPress(*numbers, low, high, passed, sentence))
    return Check(tuple(rows), tolerance)


@dataclass(frozen=True)
class Depth:
    """A published depth (mm) at a force (N), and that of a finger: its indentation plus the touch-down offset of its
    bench."""

    published_mm: float
    force_N: float
    depth_mm: float

    @property
    def error(self) -> float:
        """Relative error of the finger's depth."""
        return self.depth_mm / self.published_mm - 1


def published_depths(finger: Finger, reduced: ReducedFinger) -> list[Depth]:
    """The published depths and those of a finger on a rigid flat, which stands for the gratings of the papers."""
    return [
        Depth(
            depth,
            force,
            cached_press(press, reduced, RIGID_SPECIMEN, force=force).indentation + finger.bench.touch_down,
        )
        for depth, force in PUBLISHED_POINTS
    ]
