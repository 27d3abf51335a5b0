"""Checks a calibration for a finger: recovers the modulus of presses on known specimens and judges each press."""

import math
from dataclasses import dataclass

import numpy as np

from papilla import checks
from papilla.calibration import Calibration, SoftnessStatus
from papilla.errors import InputError
from papilla.logs import PressLog

TOLERANCE = 0.02
"""Share of the modulus by which the stated one may lie outside the 95 % interval."""


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
        return sum(math.isfinite(one.recovered_MPa) for one in self.presses)

    @property
    def missed(self) -> int:
        """Presses that did not pass."""
        return sum(not one.passed for one in self.presses)

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
    tolerance: float = TOLERANCE,
    gauge_sigma: float = 0.0,
    force_error: float = 0.0,
) -> Check:
    """Recover the modulus of each press by the calibration's surface, and compare it with the stated one.

    >>> assert papilla.calibrate.check(calibration, papilla.read_presses("presses.csv")).passed

    Parameters
    ----------
    presses : on specimens of known modulus, of the same gauges in the same order.
    tolerance : share of the modulus by which the stated one may lie outside the stated 95 % interval.
    gauge_sigma : noise of a gauge (microstrain); force_error : relative error of the force; both widen the intervals.

    A press passes where its interval holds the stated modulus. A specimen that is too hard for the sensor has an
    interval with one end; the press passes if that end is right. A press fails if its force lies outside the
    calibrated domain, or if no modulus has its S_d.

    Raises `InputError` for another number of gauges, or values below 0.
    """
    wanted = len(calibration.gauges)
    if len(presses.gauge_names) != wanted:
        own = ", ".join(presses.gauge_names)
        raise InputError(f"the presses are of {len(presses.gauge_names)} gauges ({own}), the calibration of {wanted}")
    slack = 1 + checks.within("tolerance", tolerance, 0, 1e6)
    noise = checks.within("gauge_sigma (microstrain)", gauge_sigma, 0, math.inf) / math.sqrt(wanted)
    off = checks.within("force_error", force_error, 0, 1)
    rows = []
    for force, modulus, sd in zip(presses.force_N, presses.modulus_MPa, presses.sd_microstrain, strict=True):
        found = calibration.invert(float(sd), float(force), sd_sigma=noise, force_sigma=off * float(force))
        assert isinstance(found.status, SoftnessStatus)
        low, high = float(found.lower_MPa), float(found.upper_MPa)
        known = np.isfinite(low + high) or (low > 0) != (high < math.inf)
        passed = bool(known and low / slack <= modulus <= high * slack)
        sentence = found.status.sentence if passed or not known else f"{found.status.sentence}; outside the interval"
        if not known:
            sentence = f"{sentence}: it says nothing about the modulus"
        rows.append(
            CheckedPress(
                float(force),
                float(modulus),
                float(found.modulus_MPa),
                float(found.sigma_MPa),
                low,
                high,
                passed,
                sentence,
            )
        )
    return Check(tuple(rows), tolerance)
