"""Calibration of an identified finger, and of the finger that made measured presses."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from papilla.calibration.fitting.checking import Recovery
from papilla.calibration.fitting.job import Calibrated, calibrate_finger
from papilla.core.errors import InputError
from papilla.core.progress import Progress, silent
from papilla.identification.diagnosis import Diagnosis, diagnose, record
from papilla.identification.fit import Identification, identify
from papilla.identification.identified_finger import with_identification
from papilla.identification.presses import places
from papilla.logs import PressLog
from papilla.model.finger import Finger
from papilla.model.specimen import Friction


@dataclass(frozen=True, eq=False)
class BenchPresses:
    """The finger that was identified from measured presses, and their moduli recovered by its calibration.

    inside : (n,) whether the stated 95 % interval of a press contains its modulus.
    """

    finger: Finger
    found: Identification
    diagnosis: Diagnosis
    recovery: Recovery
    inside: np.ndarray

    def section(self) -> str:
        """The section of the page of a calibration on the identification, as HTML."""
        from papilla.identification.page import section

        return section(self.found, self.diagnosis)


def calibrate(finger: Finger, **how: Any) -> Calibrated:
    """`calibrate_finger`, with the uncertainty of its identification for an identified finger."""
    return calibrate_finger(finger, identified=with_identification, **how)


def calibrate_bench(
    log: PressLog,
    finger: Finger,
    *,
    friction: Friction | None = None,
    size_mm: float | None = None,
    progress: Progress = silent,
    processes: int = 1,
    **table: Any,
) -> Calibrated:
    """Identify the finger that made the presses, calibrate it, and recover the moduli of these presses from the
    calibration.

    Arguments as of `identify` and `calibrate`, which receives `table` (forces, moduli, quick); raises what these
    raise, and `InputError` for presses beside the apex, whose moduli a calibration at the apex cannot recover.
    """
    if (off_apex := places(log).any(axis=1)).any():
        raise InputError(
            f"press {int(off_apex.argmax()) + 1} is beside the apex, where S_d differs: papilla identify takes it, "
            "and papilla calibrate --finger the finger that it writes"
        )
    fit = identify(log, finger, friction=friction, size_mm=size_mm, processes=processes, progress=progress)
    progress("what to doubt")
    diagnosis = diagnose(fit)
    identified = fit.with_record(record(fit, diagnosis, fit.problem.shapes[0].responses[0].specimen))
    calibrated = calibrate(
        identified, friction=friction, size_mm=size_mm, progress=progress, processes=processes, **table
    )
    noise = fit.problem.noise
    noise_sd = noise.readings_microstrain / np.sqrt(len(fit.problem.gauges))
    answer = calibrated.calibration.invert(
        fit.measured_sd, log.force_N, sd_sigma=noise_sd, force_sigma=noise.force * log.force_N
    )
    inside = (answer.lower_MPa <= log.modulus_MPa) & (log.modulus_MPa <= answer.upper_MPa)
    recovery = Recovery(log.force_N, log.modulus_MPa, np.asarray(answer.modulus_MPa))
    return replace(calibrated, bench=BenchPresses(identified, fit, diagnosis, recovery, inside))
