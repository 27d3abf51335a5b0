"""The comparison: every estimator in every scene with held-out seeds, against the Cramér-Rao bound of its memory."""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache

import numpy as np

from papilla.errors import InputError
from papilla.studies.estimators.competitors import chosen
from papilla.studies.estimators.measures import Cost, cost_of, errors_of, lag_ms, settling_ms
from papilla.studies.estimators.scenes import WAVELENGTHS_MM, Scene, scene

CONDITIONS = (("const", 20.0), ("const", 0.0), ("const", -6.0), ("act1", 20.0), ("act2", 20.0), ("harsh", 20.0))
"""Scene and SNR in dB of the table's columns."""
STEPS_MM = ((1.0, 4.0), (3.0, 0.6))
DELAYS_MS = (1, 2, 5, 10)
STEP_AT_S = 2.0
HELD_OUT = 10_000
"""First seed of the comparison; tuning used seeds below it."""


@dataclass(frozen=True)
class Row:
    """One estimator in one scene, over all wavelengths and seeds; errors are fractions of the wavelength.

    error, median : RMS and median of |relative error|. bound : Cramér-Rao, of the estimator's declared memory, RMS
    over wavelengths (NaN for those that declare none). outliers : share of rows beyond 10 %. false_locks : share of
    runs with more than half of their rows beyond. sigma_ratio : RMS of error over stated sigma. lag_ms : of the
    frequency.
    """

    estimator: str
    scene: str
    snr_dB: float
    error: float
    median: float
    bound: float
    outliers: float
    false_locks: float
    sigma_ratio: float
    lag_ms: float


@dataclass(frozen=True)
class Extras:
    """What needs runs of its own: times to 5 % after wavelength steps (median and worst over seeds, ms), errors with
    the velocity so many ms late in act1, and what a sample costs."""

    estimator: str
    settling_ms: dict[str, tuple[float, float]]
    late: dict[int, float]
    cost: Cost

    def to_json(self) -> dict:
        """As plain values."""
        return {
            "estimator": self.estimator,
            "settling_ms": {name: list(pair) for name, pair in self.settling_ms.items()},
            "error_with_late_velocity": {f"{delay}_ms": value for delay, value in self.late.items()},
            **self.cost._asdict(),
        }


@dataclass(frozen=True)
class Comparison:
    """All rows and extras of one comparison."""

    rows: tuple[Row, ...]
    extras: tuple[Extras, ...]

    def to_json(self) -> dict:
        """As plain values, for `--json`."""
        return {"rows": [asdict(row) for row in self.rows], "extras": [extra.to_json() for extra in self.extras]}


def compare(
    names: Sequence[str] = (),
    *,
    seeds: int = 6,
    seconds: float = 4.0,
    first_seed: int = HELD_OUT,
    conditions: Sequence[tuple[str, float]] = CONDITIONS,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Comparison:
    """Run the comparison; `names` are parts of competitors' names, none for all; `progress` gets runs done and total.

    Raises `InputError` for unknown names, no seeds, or scenes of less than 2 s.
    """
    if seeds < 1:
        raise InputError(f"seeds must be at least 1, got {seeds}")
    if seconds < 2:
        raise InputError(f"seconds must be at least 2 (the first is for settling), got {seconds:g}")
    entrants = chosen(names)
    rows, extras = [], []
    total = len(entrants) * (len(conditions) + 1)
    for number, (name, make) in enumerate(entrants.items()):
        for place, (kind, snr) in enumerate(conditions):
            rows.append(_row(name, make, kind, snr, range(first_seed, first_seed + seeds), seconds))
            progress(number * (len(conditions) + 1) + place + 1, total)
        extras.append(_extras(name, make, range(first_seed, first_seed + seeds)))
        progress((number + 1) * (len(conditions) + 1), total)
    return Comparison(tuple(rows), tuple(extras))


@lru_cache(maxsize=512)
def _scene(kind: str, wavelength: float, snr: float, seed: int, seconds: float) -> Scene:
    return scene(kind, wavelength, snr_dB=snr, seed=seed, seconds=seconds)


def _row(name: str, make: Callable, kind: str, snr: float, seeds: range, seconds: float) -> Row:
    found, lags, bounds = [], [], []
    for wavelength in WAVELENGTHS_MM:
        for seed in seeds:
            made = _scene(kind, wavelength, snr, seed, seconds)
            answer = make().process(made.block())
            found.append(errors_of(made, answer))
            lags.append(lag_ms(made, answer.frequency_Hz))
        memory = getattr(make(), "memory_s", None)
        if memory is not None and kind != "harsh":
            bounds.append(_scene(kind, wavelength, snr, seeds[0], seconds).bound(memory))
    squares, medians, outliers, sigmas = np.array(found).T
    known = sigmas[np.isfinite(sigmas)]
    varying = [lag for lag in lags if lag == lag]
    return Row(
        estimator=name,
        scene=kind,
        snr_dB=snr,
        error=math.sqrt(squares.mean()),
        median=float(np.median(medians)),
        bound=math.sqrt(np.mean(np.square(bounds))) if bounds else math.nan,
        outliers=float(outliers.mean()),
        false_locks=float(np.mean(outliers > 0.5)),
        sigma_ratio=math.sqrt(known.mean()) if known.size else math.nan,
        lag_ms=float(np.median(varying)) if varying else math.nan,
    )


def _extras(name: str, make: Callable, seeds: range) -> Extras:
    settling = {}
    for before, after in STEPS_MM:
        times = []
        for seed in seeds:
            made = scene("const", before, seed=seed, seconds=3.0, step_to_mm=after, step_at_s=STEP_AT_S)
            times.append(settling_ms(made, make().process(made.block()).wavelength_mm, STEP_AT_S))
        settling[f"{before:g} to {after:g} mm"] = float(np.median(times)), max(times)
    late = {}
    for delay in DELAYS_MS:
        squares = [
            errors_of(made, make().process(made.block(delay))).mean_square
            for wavelength in WAVELENGTHS_MM
            for made in [_scene("act1", wavelength, 20.0, seeds[0], 3.0)]
        ]
        late[delay] = math.sqrt(np.mean(squares))
    return Extras(name, settling, late, cost_of(make, _scene("act1", 1.8, 20.0, seeds[0], 3.0)))
