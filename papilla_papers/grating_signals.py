"""Signals of the gauges over gratings: signal against wavelength, gauge by gauge, with and without ridges."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from papilla.core.progress import CountedStep, Progress, silent
from papilla.fem import Motion, prepare_section, slide
from papilla.model.finger import Finger, Ridges
from papilla.model.specimen import Grating

LAST_PERIODS, SETTLE_MM, SETTLE_S = 10, 3.0, 0.2
"""Number of periods of the grating that are evaluated, so that most beats with the ridges are complete; path and time
before them (the oscillation of the first mode at the start fades within 50 ms)."""

SAMPLES_A_PERIOD = 40
"""Number of samples per period of the grating."""


@dataclass(frozen=True, eq=False)
class GratingSignal:
    """One scene; g gauges. pitch_mm : of the ridges, 0 for smooth skin. fundamental, rms : (g,) in microstrain, the
    amplitude at the grating's wavelength and the standard deviation of the whole signal. status : of the slide."""

    wavelength_mm: float
    pitch_mm: float
    speed_mm_s: float
    depth_mm: float
    fundamental: np.ndarray
    rms: np.ndarray
    dynamics: str
    status: str


def signals_over_gratings(
    finger: Finger,
    wavelengths_mm: Sequence[float],
    *,
    pitches_mm: Sequence[float] = (0.0,),
    speed_mm_s: float = 10.0,
    force: float | None = 0.3,
    depth: float | None = None,
    friction: float = 0.3,
    groove_depth_mm: float = 0.5,
    dynamics: str = "auto",
    length_mm: float | None = None,
    progress: Progress = silent,
) -> list[GratingSignal]:
    """Slide over gratings with groove = ridge, for each pitch of the finger's ridges (groove = ridge too, 0 for none).

    `length_mm` as for `papilla.fem.slide`. Raises what that raises.
    """
    signals = []
    for pitch in pitches_mm:
        height = finger.ridges.height if finger.ridges else 0.3
        ridged = replace(finger, ridges=Ridges(pitch, pitch / 2, height) if pitch else None)
        section = prepare_section(ridged)
        for wavelength in wavelengths_mm:
            texture = Grating(wavelength / 2, wavelength / 2, groove_depth_mm)
            rate = SAMPLES_A_PERIOD * speed_mm_s / wavelength
            motion = Motion.steady(speed_mm_s, (LAST_PERIODS * wavelength + SETTLE_MM) / speed_mm_s + SETTLE_S, rate)
            result = slide(
                ridged, texture, motion, force=force, depth=depth, friction=friction, dynamics=dynamics,
                section=section, length_mm=length_mm,
            )  # fmt: skip
            rows = slice(-LAST_PERIODS * SAMPLES_A_PERIOD, None)
            readings = result.readings[rows] - result.readings[rows].mean(axis=0)
            turns = np.exp(-2j * np.pi * motion.position_mm[rows] / wavelength)
            signals.append(
                GratingSignal(
                    wavelength, pitch, speed_mm_s, float(result.depth_mm.mean()),
                    2 * np.abs((readings * turns[:, None]).mean(axis=0)), readings.std(axis=0), result.dynamics,
                    result.status,
                )
            )  # fmt: skip
            progress(CountedStep("slides over gratings", len(signals), len(pitches_mm) * len(wavelengths_mm)))
    return signals
