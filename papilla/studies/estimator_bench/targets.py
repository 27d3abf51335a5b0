"""What the estimators were meant to reach before any was written, and whether a comparison says that they do.

Targets are data: they are not moved to where an estimator is.
"""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from papilla.studies.estimator_bench.competitors import PUBLISHED
from papilla.studies.estimator_bench.scenes import SCENES

TRACKER, CHIRP = "space tracker", "chirp tracker"
GUIDED = "guided space-domain filter: from a prototype's figures and the Cramér-Rao bound of its memory"
BUDGET = "a control loop at 1 kHz: 5 % of its period for a tracker, 1 % for a published estimator, 15 % at the 99.9 %"
TWICE = "twice the bound of 500 ms"
SURE = "a stated sigma is true"
EKF = "extended Kalman filter of the frequency"


@dataclass(frozen=True)
class Target:
    """One target: `measure` of `estimator` in `where` must lie between `low` and `high`.

    where : the `place` of a row: scene and SNR, step of the wavelength, kernel of a cost.
    origin : where the figure comes from. stretch : beyond what any prototype reached.
    """

    estimator: str
    where: str
    measure: str
    high: float
    origin: str
    low: float = -math.inf
    stretch: bool = False


@dataclass(frozen=True, kw_only=True)
class Verdict(Target):
    """A target with what was measured. unit : of measured, low and high; empty for fractions and ratios."""

    unit: str
    measured: float
    met: bool


TARGETS = (
    Target(TRACKER, "const, 40 dB", "ratio", 1.2, GUIDED),
    Target(TRACKER, "const, 20 dB", "ratio", 1.2, GUIDED),
    Target(TRACKER, "const, 0 dB", "ratio", 1.3, GUIDED),
    Target(TRACKER, "const, -6 dB", "outliers", 0.0, GUIDED),
    *(Target(TRACKER, f"{scene}, 20 dB", "sigma_ratio", 1.25, SURE, low=0.8) for scene in SCENES),
    Target(TRACKER, "1 to 4 mm", "median_ms", 65.0, "bank of 30 ms: 60 ms"),
    Target(TRACKER, "3 to 0.6 mm", "median_ms", 50.0, "bank of 30 ms: 48 ms"),
    Target(TRACKER, "act1, 20 dB", "error", 1.0e-3, GUIDED),
    Target(TRACKER, "act2, 20 dB", "error", 0.7e-3, GUIDED),
    Target(TRACKER, "act1, 20 dB", "error", 3.0e-4, TWICE, stretch=True),
    Target(TRACKER, "act2, 20 dB", "error", 1.5e-4, TWICE, stretch=True),
    Target(TRACKER, "act1, 20 dB", "lag_ms", 0.5, GUIDED, low=-0.5),
    Target(TRACKER, "act2, 20 dB", "lag_ms", 0.5, GUIDED, low=-0.5),
    Target(TRACKER, "harsh, 20 dB", "error", 1.0e-2, GUIDED),
    Target(TRACKER, "harsh, 20 dB", "median", 1.0e-3, GUIDED),
    Target(TRACKER, "harsh, 20 dB", "error", 3.0e-3, "with the skin's shear as a state", stretch=True),
    Target(TRACKER, "NumPy", "update_us", 50.0, BUDGET),
    Target(TRACKER, "NumPy", "update_p999_us", 150.0, BUDGET),
    Target(CHIRP, "act1, 20 dB", "aligned", 0.03, "not reached by any prototype: 8 % in act1"),
    Target(CHIRP, "act1, 20 dB", "lag_ms", 15.0, f"{EKF}: 16 ms", low=-15.0),
    Target(CHIRP, "act2, 20 dB", "aligned", 0.03, "not reached by any prototype: 8 % in act1"),
    Target(CHIRP, "act2, 20 dB", "lag_ms", 15.0, f"{EKF}: 16 ms", low=-15.0),
    Target(CHIRP, "compiled", "block_us", 0.3, f"{EKF}: 0.29 us"),
    *(Target(name, "NumPy", "block_us", 1.0, "counters in plain Python: 0.5-0.9 us") for name in PUBLISHED),
    *(Target(name, "NumPy", "update_us", 10.0, BUDGET) for name in PUBLISHED),
    *(Target(name, "NumPy", "update_p999_us", 50.0, BUDGET) for name in PUBLISHED),
)


def verdicts(targets: Sequence[Target], *tables: Sequence[Any]) -> tuple[Verdict, ...]:
    """Every target whose estimator was run where it stands, by the rows (`estimator`, `place`, measures) of tables."""
    rows = {(row.estimator, row.place): row for table in tables for row in table}
    return tuple(
        judged(target, getattr(rows[target.estimator, target.where], target.measure))
        for target in targets
        if (target.estimator, target.where) in rows
    )


def judged(target: Target, measured: float) -> Verdict:
    """The target with what was measured; what is no number does not meet it."""
    unit = {"ms": "ms", "us": "us"}.get(target.measure.rpartition("_")[2], "")
    return Verdict(**asdict(target), unit=unit, measured=measured, met=target.low <= measured <= target.high)
