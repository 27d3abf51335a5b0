"""Confirmation of a study: the chosen designs are calibrated, and their sigma is computed again from the calibrations.

The calibration is that of `papilla calibrate` on the default mesh: sweeps, tables of large strain for this design, the
scatter of three other meshes, and the fit. The checks and contacts beside the apex, which `papilla calibrate` adds, do
not change sigma at the apex and are left out; the sweeps stay in the cache for it.
"""

from dataclasses import dataclass, replace

import numpy as np

from papilla import fem
from papilla.calibration import Calibration
from papilla.calibration.fitting.fit import fit
from papilla.calibration.fitting.job import SCATTER_STEP, SCATTER_VARIANTS, cached_sweep
from papilla.calibration.fitting.sweep import NOT_INCLUDED, CalibrationRanges
from papilla.core.errors import PapillaError
from papilla.core.progress import Progress
from papilla.core.units import PER_CENT
from papilla.core.workers import workers
from papilla.design.in_scene import DesignInScene
from papilla.design.scene import DesignScene, rms_or_worst, sigma_from_gauges, sigma_from_sd
from papilla.fem.finite.strain_tables import begin_large_strain
from papilla.fem.pressing.large_strain import ends_of, large_strain_error
from papilla.mesh import default_size_mm
from papilla.model.finger import Finger
from papilla.model.specimen import STICK_WORD, friction_coefficient

CONFIRMED_DIFFERENCE = 0.10
"""Largest relative difference between predicted and calibrated sigma in a confirmation."""


@dataclass(frozen=True, eq=False)
class Confirmed:
    """Predicted and calibrated sigma (f, m) of ln E over the scene, for each source ("S_d", "all gauges")."""

    name: str
    predicted: dict[str, np.ndarray]
    calibrated: dict[str, np.ndarray]
    scene: DesignScene
    failed: str = ""

    def both(self, channel: str) -> tuple[float, float]:
        """The single number for the scene, predicted and calibrated."""
        return rms_or_worst(self.scene, self.predicted[channel]), rms_or_worst(self.scene, self.calibrated[channel])

    @property
    def sentence(self) -> str:
        """The result of the confirmation, as a sentence."""
        if self.failed:
            return f"{self.name}: no calibration: {self.failed}"
        comparisons = []
        for channel in self.predicted:
            predicted, calibrated = self.both(channel)
            off = predicted / calibrated - 1
            verdict = "within 10 %" if abs(off) <= CONFIRMED_DIFFERENCE else f"off by {PER_CENT * off:+.0f} %"
            comparisons.append(f"{channel}: predicted {predicted:.3g}, calibrated {calibrated:.3g} ({verdict})")
        return f"{self.name}: " + "; ".join(comparisons)


def confirm(name: str, design: DesignInScene, processes: int, progress: Progress) -> Confirmed:
    """Calibrate a design and compare; an error is reported in `failed`."""
    try:
        predicted = {"S_d": design.sigma_sd, "all gauges": design.sigma_gauges}
        calibrated = sigmas_of(calibrated_finger(design.finger, design.scene, processes, progress), design.scene)
    except PapillaError as error:
        return Confirmed(name, {}, {}, design.scene, str(error))
    return Confirmed(name, predicted, calibrated, design.scene)


def calibrated_finger(finger: Finger, scene: DesignScene, processes: int, progress: Progress) -> Calibration:
    """The calibration of a finger with the friction that a scene states."""
    stated = None if scene.unknown.friction == "unknown" else scene.unknown.friction
    friction = STICK_WORD if stated is None else stated
    finger = replace(finger, bench=replace(finger.bench, friction=None))
    ends = (False, True) if stated is None else ends_of(friction_coefficient(friction))
    with workers(processes, progress) as start:
        doubt = begin_large_strain(finger, ends, start, progress=progress)()
    block, (forces, moduli) = finger.bench.specimen, scene.swept(finger)
    size = default_size_mm(finger)
    reduced = fem.prepare(finger, size_mm=size, progress=progress)
    progress("sweeping over force and modulus")
    presses = cached_sweep(reduced, moduli, forces, block, friction)
    free = cached_sweep(reduced, moduli, forces, block, 0.0) if stated is None else None
    others = []
    for number, variant in enumerate(SCATTER_VARIANTS, start=1):
        progress(f"mesh scatter, {number} of {len(SCATTER_VARIANTS)} meshes")
        variant_finger = fem.prepare(finger, size_mm=size, variant=variant, progress=progress)
        others.append(cached_sweep(variant_finger, moduli[::SCATTER_STEP], forces[::SCATTER_STEP], block, 0.0))
    error = NOT_INCLUDED if doubt else large_strain_error(reduced, friction_coefficient(friction))
    return fit(
        presses,
        others,
        frictionless=free,
        friction_known=stated is not None,
        strain=error,
        ranges=CalibrationRanges.of(finger),
    )


def sigmas_of(calibration: Calibration, scene: DesignScene) -> dict[str, np.ndarray]:
    """Sigma (f, m) of ln E over a scene by a calibration, from S_d and from all gauges."""
    return {"S_d": sigma_from_sd(calibration, scene), "all gauges": sigma_from_gauges(calibration, scene)}
