"""The softness part of the comparison: the default finger's calibration, its estimators' table, costs and targets."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial

import numpy as np

from papilla.calibrate.job import calibrate_finger
from papilla.finger import Finger
from papilla.studies.estimator_bench.softness import (
    ANYWHERE,
    BESIDE_MM,
    ESTIMATORS,
    HELD_OUT,
    NOISES,
    SURFACE,
    SoftnessRow,
    compare_softness,
    force_profile,
    noisy,
    study_fingers,
)
from papilla.studies.estimator_bench.targets import BUDGET, SURE, Target, Verdict, verdicts
from papilla.studies.estimator_bench.timing import Cost, timed

EFFICIENT = "averaging u and inverting once is nearly efficient"
TRIALS, JUDGED_TRIALS = 30, 800
"""Noises of each press of the table, and of the one press that targets are judged on: they know a ratio to 2.5 % and a
bias to 0.035 of the bound, where 30 say 13 % and 0.18."""
TOUCHED_MPA = 0.3

SCENES = (*((name, SURFACE) for name in ESTIMATORS), *((ANYWHERE, f"{SURFACE}, x {x:g} mm") for x in BESIDE_MM))
TARGETS = (
    *(Target(*scene, "error_over_bound", 1.05, EFFICIENT) for scene in SCENES),
    *(Target(*scene, "bias_over_bound", 0.1, EFFICIENT, low=-0.1) for scene in SCENES),
    *(Target(*scene, "sigma_ratio", 1.25, SURE, low=0.8) for scene in SCENES),
    *(Target(name, "NumPy", "update_us", 10.0, BUDGET) for name in ("S_d alone", "five gauges")),
    *(Target(name, "NumPy", "update_p999_us", 50.0, BUDGET) for name in ("S_d alone", "five gauges")),
)
"""The first are of readings from the calibration's surfaces: noise is the only error there."""


@dataclass(frozen=True)
class Touch:
    """What the softness part found."""

    softness: tuple[SoftnessRow, ...]
    costs: tuple[Cost, ...]
    targets: tuple[Verdict, ...]

    def to_json(self) -> dict:
        """As plain values."""
        tables: dict[str, tuple] = {"": self.softness, "_costs": self.costs, "_targets": self.targets}
        return {f"softness{name}": [asdict(row) for row in rows] for name, rows in tables.items()}


def compare_touch(
    progress: Callable[[str], None] = lambda stage: None, steps: Callable[[int, int], None] = lambda done, total: None
) -> Touch:
    """Calibrate the default finger (cached after the first time), compare its softness estimators, and time them."""
    finger = Finger.default()
    calibration = calibrate_finger(finger, progress=progress).calibration
    fingers = study_fingers(finger, progress)
    force, (gauge_sigma, force_sigma) = force_profile("press"), NOISES[0]
    readings = calibration.predict_readings(force, TOUCHED_MPA)
    block = noisy(np.tile(readings, (10, 1)), np.tile(force, 10), gauge_sigma, force_sigma, HELD_OUT)
    options = {"gauge_sigma": gauge_sigma, "force_sigma_N": force_sigma}
    costs = tuple(
        timed(name, "NumPy", partial(kind, calibration, **options), block) for name, kind in ESTIMATORS.items()
    )
    scene: dict = {"trials": JUDGED_TRIALS, "moduli": (TOUCHED_MPA,), "noises": NOISES[:1], "profiles": ("press",)}
    judged_rows = (
        *compare_softness(calibration, {}, **scene, places_mm=(0.0,), entrants=tuple(ESTIMATORS)),
        *compare_softness(calibration, {}, **scene, places_mm=BESIDE_MM, entrants=(ANYWHERE,)),
    )
    rows = compare_softness(calibration, fingers, trials=TRIALS, progress=steps)
    return Touch(rows, costs, verdicts(TARGETS, judged_rows, costs))
