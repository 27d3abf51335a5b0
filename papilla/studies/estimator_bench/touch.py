"""The softness part of the comparison: the default finger's calibration, its estimators' table, costs and targets."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from math import inf

import numpy as np

from papilla.calibrate.job import calibrate_finger
from papilla.estimators.softness import GaugeSoftness, Softness
from papilla.finger import Finger
from papilla.studies.estimator_bench.softness import (
    ANYWHERE,
    BESIDE_MM,
    HELD_OUT,
    NOISES,
    SURFACE,
    SoftnessRow,
    compare_softness,
    force_profile,
    study_fingers,
)
from papilla.studies.estimator_bench.targets import BUDGET, Target, Verdict, judged
from papilla.studies.estimator_bench.timing import Cost, timed

ESTIMATORS: dict[str, Callable] = {
    "S_d alone": Softness,
    "five gauges": GaugeSoftness,
    ANYWHERE: partial(GaugeSoftness, position_sigma_mm=inf),
}
EFFICIENT = "averaging u and inverting once is nearly efficient"
TRIALS, JUDGED_TRIALS = 30, 800
"""Noises of each press of the table, and of the one press that targets are judged on: they know a ratio to 2.5 % and a
bias to 0.035 of the bound, where 30 say 13 % and 0.18."""
TOUCHED_MPA = 0.3


def _near_the_bound(name: str, place: str) -> tuple[Target, ...]:
    return (
        Target(name, place, "error_over_bound", 1.05, EFFICIENT),
        Target(name, place, "bias_over_bound", 0.1, EFFICIENT, low=-0.1),
        Target(name, place, "sigma_ratio", 1.25, "a stated sigma is true", low=0.8),
    )


TARGETS = (
    *(target for name in ESTIMATORS for target in _near_the_bound(name, SURFACE)),
    *(target for x in BESIDE_MM for target in _near_the_bound(ANYWHERE, f"{SURFACE}, x {x:g} mm")),
    *(
        target
        for name in ("S_d alone", "five gauges")
        for target in (
            Target(name, "NumPy", "update_us", 10.0, BUDGET),
            Target(name, "NumPy", "update_p999_us", 50.0, BUDGET),
        )
    ),
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
        return {
            "softness": [row.to_json() for row in self.softness],
            "softness_costs": [asdict(row) for row in self.costs],
            "softness_targets": [asdict(row) for row in self.targets],
        }


def compare_touch(
    progress: Callable[[str], None] = lambda stage: None, steps: Callable[[int, int], None] = lambda done, total: None
) -> Touch:
    """Calibrate the default finger (cached after the first time), compare its softness estimators, and time them."""
    finger = Finger.default()
    calibration = calibrate_finger(finger, progress=progress).calibration
    fingers = study_fingers(finger, progress)
    force, (gauge_sigma, force_sigma) = force_profile("press"), NOISES[0]
    rng = np.random.default_rng(HELD_OUT)
    readings = np.tile(np.column_stack([calibration.predict_readings(force, TOUCHED_MPA), force]), (10, 1))
    block = readings + rng.normal(size=readings.shape) * np.array(
        [gauge_sigma] * (readings.shape[1] - 1) + [force_sigma]
    )
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
    return Touch(rows, costs, _verdicts(judged_rows, costs))


def _verdicts(rows: Sequence[SoftnessRow], costs: Sequence[Cost]) -> tuple[Verdict, ...]:
    found: dict[tuple, object] = {(row.estimator, row.place): row for row in rows}
    found |= {(row.estimator, row.kernel): row for row in costs}
    return tuple(judged(target, getattr(found[target.estimator, target.where], target.measure)) for target in TARGETS)
