"""The calibration of an identified finger: the uncertainty of its identification, and the zeros of its bench."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from papilla.calibrate.identification.noise import Noise
from papilla.calibrate.identification.parameters import MOVES, OF_THE_BENCH, kind, start_of
from papilla.calibrate.identification.posing import problem_of_record
from papilla.calibrate.identification.problem import Problem, sd_and_shares, unread
from papilla.calibrate.surface_fit import Resolution, SurfaceFit
from papilla.calibration import Calibration, Surface
from papilla.errors import InputError
from papilla.finger import Finger
from papilla.finger_parts import Identified

GRID = 10
"""Number of presses along force and modulus at which the standard deviations are computed."""

CELLS = Resolution(5)
SAME = 1e-6
"""Relative difference above which a design's modulus differs from the identified one."""


def with_identification(
    calibration: Calibration,
    finger: Finger,
    progress: Callable[[str], None] | None = None,
    size_mm: float | None = None,
) -> Calibration:
    """The calibration with the covariance of the finger's identification in its surfaces, and the bench's zeros.

    size_mm : elements at the contact, None for those of `identify`. A finger without an identification leaves the
    calibration unchanged. Raises `InputError` if the `[identified]` table is of other gauges, or the design was changed
    since.
    """
    record = finger.identified
    if record is None:
        return calibration
    problem, covariance = _problem(finger, record, calibration, progress, size_mm)
    vector = problem.start
    modelled = problem.modelled(vector)
    g = len(finger.gauges)
    zeros, by = problem.each("zero_microstrain", problem.values(vector)), modelled.by_free[:, :g]
    sd, shares = sd_and_shares(modelled.values[:, :g] - zeros)
    by_ln_sd = np.einsum("ng,ngf->nf", shares, by) / sd[:, None]
    force, modulus = problem.log.force_N, problem.log.modulus_MPa

    def surface(slopes: np.ndarray) -> Surface:
        sigma = np.sqrt(np.maximum(np.einsum("nf,fe,ne->n", slopes, covariance, slopes), 0.0))
        return SurfaceFit(force, modulus, (CELLS, CELLS)).surface(sigma).surface

    known = calibration.surface
    gauges = tuple(
        replace(one, uncertainty=replace(one.uncertainty, identified=surface(by[:, k] / force[:, None])))
        for k, one in enumerate(calibration.gauges)
    )
    bench: dict[str, Any] = {"zeros_microstrain": list(record.zeros_microstrain), "touch_down_mm": record.touch_down_mm}
    if record.crept:
        silicone = {"shares": record.relaxation_shares, "times_s": record.relaxation_times_s, "crept": record.crept}
        bench["relaxation"] = {name: list(values) for name, values in silicone.items()}
    return replace(
        calibration,
        surface=replace(known, uncertainty=replace(known.uncertainty, identified=surface(by_ln_sd))),
        gauges=gauges,
        finger=calibration.finger | bench | {"identified": record.status},
        notes=(*calibration.notes, *(f"identification: {note}" for note in record.notes)),
    )


def _problem(
    finger: Finger,
    record: Identified,
    calibration: Calibration,
    progress: Callable[[str], None] | None,
    size_mm: float | None,
) -> tuple[Problem, np.ndarray]:
    """The problem of presses over the domain of a calibration, in the parameters that were identified, at their
    recorded values; and their covariance."""
    designed = start_of(finger, finger.bench.thickness)
    values = dict(zip(record.parameters, record.values, strict=True))
    for name, value in values.items():
        changes = name in designed and kind(name) not in ("zero_microstrain", *MOVES)
        if changes and abs(designed[name] - value) > SAME * max(abs(value), SAME):
            raise InputError(
                f"{name} is {designed[name]:g} in the design and {value:g} in its [identified]: the design was changed "
                "since, so remove that table or identify the finger again"
            )
    force, modulus = (np.geomspace(*calibration.domain[key], GRID) for key in ("force_N", "modulus_MPa"))
    force, modulus = (one.ravel() for one in np.meshgrid(force, modulus))
    deep = np.ones(len(force)) if "touch_down_mm" in values else None
    log = unread(finger, force, modulus, indentation_mm=deep)
    kept = [place for place, name in enumerate(record.parameters) if kind(name) not in OF_THE_BENCH]
    free = tuple(record.parameters[place] for place in kept)
    problem = problem_of_record(finger, log, free, Noise(), size_mm, progress)
    return problem, np.array(record.covariance)[np.ix_(kept, kept)]
