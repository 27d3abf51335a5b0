"""What the estimators were meant to reach before any was written, and whether a comparison says that they do.

Targets are data: they are not moved to where an estimator is.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

from papilla.studies.estimator_bench.competitors import PUBLISHED
from papilla.studies.estimator_bench.rows import SceneRow, StepRow
from papilla.studies.estimator_bench.timing import Cost

TRACKER, CHIRP = "space tracker", "chirp tracker"
GUIDED = "guided space-domain filter: from a prototype's figures and the Cramér-Rao bound of its memory"
BUDGET = "a control loop at 1 kHz: 5 % of its period for a tracker, 1 % for a published estimator, 15 % at the 99.9 %"


@dataclass(frozen=True)
class Target:
    """One target: `measure` of `estimator` in `where` must lie between `low` and `high`.

    where : (scene, SNR in dB) for a measure of a scene, (from, to) in mm for one of a step, a kernel for a cost.
    origin : where the figure comes from. stretch : beyond what any prototype reached.
    """

    estimator: str
    where: tuple[str, float] | tuple[float, float] | str
    measure: str
    high: float
    origin: str
    low: float = -math.inf
    stretch: bool = False


@dataclass(frozen=True)
class Verdict:
    """A target with what was measured. unit : of measured, low and high; empty for fractions and ratios."""

    estimator: str
    where: str
    measure: str
    unit: str
    low: float
    high: float
    measured: float
    met: bool
    stretch: bool
    origin: str


def _of_memory(name: str) -> list[Target]:
    quiet = [Target(name, ("const", snr), "ratio", 1.2, GUIDED) for snr in (40.0, 20.0)]
    sure = [
        Target(name, (kind, 20.0), "sigma_ratio", 1.25, "a stated sigma is true", low=0.8)
        for kind in ("const", "act1", "act2", "harsh")
    ]
    return [
        *quiet,
        Target(name, ("const", 0.0), "ratio", 1.3, GUIDED),
        Target(name, ("const", -6.0), "outliers", 0.0, GUIDED),
        *sure,
        Target(name, (1.0, 4.0), "median_ms", 65.0, "bank of 30 ms: 60 ms"),
        Target(name, (3.0, 0.6), "median_ms", 50.0, "bank of 30 ms: 48 ms"),
    ]


def _active(name: str) -> list[Target]:
    return [
        Target(name, ("act1", 20.0), "error", 1.0e-3, GUIDED),
        Target(name, ("act2", 20.0), "error", 0.7e-3, GUIDED),
        Target(name, ("act1", 20.0), "error", 3.0e-4, "twice the bound of 500 ms", stretch=True),
        Target(name, ("act2", 20.0), "error", 1.5e-4, "twice the bound of 500 ms", stretch=True),
        Target(name, ("act1", 20.0), "lag_ms", 0.5, GUIDED, low=-0.5),
        Target(name, ("act2", 20.0), "lag_ms", 0.5, GUIDED, low=-0.5),
        Target(name, ("harsh", 20.0), "error", 1.0e-2, GUIDED),
        Target(name, ("harsh", 20.0), "median", 1.0e-3, GUIDED),
        Target(name, ("harsh", 20.0), "error", 3.0e-3, "with the skin's shear as a state", stretch=True),
        Target(name, "NumPy", "update_us", 50.0, BUDGET),
        Target(name, "NumPy", "update_p999_us", 150.0, BUDGET),
    ]


def _blind() -> list[Target]:
    of_motion = [
        target
        for kind in ("act1", "act2")
        for target in (
            Target(CHIRP, (kind, 20.0), "aligned", 0.03, "not reached by any prototype: 8 % in act1"),
            Target(CHIRP, (kind, 20.0), "lag_ms", 15.0, "extended Kalman filter of the frequency: 16 ms", low=-15.0),
        )
    ]
    return [*of_motion, Target(CHIRP, "compiled", "block_us", 0.3, "extended Kalman filter of the frequency: 0.29 us")]


def _published() -> list[Target]:
    return [
        target
        for name in PUBLISHED
        for target in (
            Target(name, "NumPy", "block_us", 1.0, "counters in plain Python: 0.5-0.9 us"),
            Target(name, "NumPy", "update_us", 10.0, BUDGET),
            Target(name, "NumPy", "update_p999_us", 50.0, BUDGET),
        )
    ]


TARGETS: tuple[Target, ...] = (
    *_of_memory(TRACKER),
    *_active(TRACKER),
    *_blind(),
    *_published(),
)


def verdicts(scenes: Sequence[SceneRow], steps: Sequence[StepRow], costs: Sequence[Cost]) -> tuple[Verdict, ...]:
    """Every target whose estimator, scene or kernel was run, with what was measured."""
    rows: dict[tuple, object] = {(row.estimator, (row.scene, row.snr_dB)): row for row in scenes}
    rows |= {(row.estimator, (row.from_mm, row.to_mm)): row for row in steps}
    rows |= {(row.estimator, row.kernel): row for row in costs}
    return tuple(
        judged(target, getattr(rows[target.estimator, target.where], target.measure))
        for target in TARGETS
        if (target.estimator, target.where) in rows
    )


def judged(target: Target, measured: float) -> Verdict:
    """The target with what was measured; what is no number does not meet it."""
    where: str
    if isinstance(target.where, str):
        where = target.where
    elif isinstance(target.where[0], str):
        where = f"{target.where[0]}, {target.where[1]:g} dB"
    else:
        where = f"{target.where[0]:g} to {target.where[1]:g} mm"
    unit = next((unit for ending, unit in (("_ms", "ms"), ("_us", "us")) if target.measure.endswith(ending)), "")
    met = target.low <= measured <= target.high
    return Verdict(**asdict(target) | {"where": where, "unit": unit, "measured": measured, "met": met})
