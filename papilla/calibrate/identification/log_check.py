"""Checks that a log of presses fits a finger: its gauges and its units."""

import numpy as np

from papilla.calibrate.identification.problem import Problem
from papilla.errors import InputError
from papilla.finger import Finger
from papilla.logs import PressLog

SOFT_MPA, RUBBER_MPA = 5.0, 100.0
"""If all specimens are harder than the first value, or one is harder than the second, the moduli are not in MPa."""

LEAST_MICROSTRAIN = 0.5
"""Readings that are all smaller than this are strains, not microstrain."""

EITHER_WAY = 2.0
"""Factor by which the inner modulus may differ from the design's when a press is checked against the range of the
model."""


def refuse(log: PressLog, finger: Finger) -> None:
    """Raise `InputError` for a log of another finger, or in other units."""
    names = tuple(gauge.name for gauge in finger.gauges)
    if log.stated_sd is not None:
        if len(names) < 2:
            raise InputError(f"the finger {finger.name!r} has one gauge, and S_d is that of several")
    elif len(log.gauge_names) != len(names):
        raise InputError(
            f"the log has {len(log.gauge_names)} gauges ({', '.join(log.gauge_names)}), "
            f"the finger {finger.name!r} has {len(names)}"
        )
    if log.stated_sd is None and log.gauge_names != names:
        raise InputError(
            f"the log has the gauges {', '.join(log.gauge_names)}, the finger {finger.name!r} {', '.join(names)}"
        )
    if not len(log):
        raise InputError("the log has no press: at least one is needed")
    softest, hardest = log.modulus_MPa.min(), log.modulus_MPa.max()
    if softest > SOFT_MPA or hardest > RUBBER_MPA:
        raise InputError(
            f"modulus_MPa goes from {softest:g} to {hardest:g} MPa, which is no softness: is it in kPa? "
            f"Specimens are of {RUBBER_MPA:g} MPa at most, the softest below {SOFT_MPA:g}{_sizes(log)}"
        )
    largest = float(np.abs(log.readings if log.stated_sd is None else log.stated_sd).max())
    if largest < LEAST_MICROSTRAIN:
        what = "all gauges read 0" if largest == 0 else f"no gauge reads more than {largest:.3g}"
        raise InputError(f"{what}: readings are expected in microstrain, are these strains?{_sizes(log)}")


def refuse_beyond(problem: Problem) -> None:
    """Raise `InputError` for a press that no finger like this one could withstand: its force is probably in another
    unit."""
    log, values = problem.log, problem.held
    inside = np.zeros(len(log), bool)
    for factor in (1 / EITHER_WAY, 1.0, EITHER_WAY):
        moduli = factor * values["outer_modulus_MPa"], factor * values["inner_modulus_MPa"]
        for shape in problem.shapes:
            loads = log.force_N[shape.rows], log.modulus_MPa[shape.rows]
            inside[shape.rows] |= shape.responses[0].inside(*loads, *moduli)
    if not inside.all():
        row = int(np.argmin(inside))
        inner = values["inner_modulus_MPa"]
        raise InputError(
            f"press {row + 1}, {log.force_N[row]:g} N on {log.modulus_MPa[row]:g} MPa, is beyond the model of a finger "
            f"of {inner:g} MPa inside: is force_N in N (1 gf is 0.0098 N), modulus_MPa in MPa? Leave it out otherwise"
            f"{_sizes(log)}"
        )


def _sizes(log: PressLog) -> str:
    """The remarks on units, with maps that correct them, as the end of a sentence."""
    return "".join(f"; {remark}" for remark in log.sizes)
