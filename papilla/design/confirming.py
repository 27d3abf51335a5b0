"""Confirmation of a study: the chosen designs are calibrated in full, and their sigma is computed again from that."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from papilla.calibrate.job import calibrate_finger
from papilla.calibration import Calibration
from papilla.design.look import Look
from papilla.design.scene import Scene, rms_or_worst
from papilla.design.touch import sigma_from_gauges, sigma_from_sd
from papilla.errors import PapillaError
from papilla.finger import Finger

WITHIN = 0.10
"""Relative difference of predicted and calibrated sigma that a confirmation allows."""


@dataclass(frozen=True, eq=False)
class Confirmed:
    """Predicted and calibrated sigma (f, m) of ln E over the scene, by what it is told from ("S_d", "all gauges")."""

    name: str
    predicted: dict[str, np.ndarray]
    calibrated: dict[str, np.ndarray]
    scene: Scene
    failed: str = ""

    def both(self, channel: str) -> tuple[float, float]:
        """The one number of the scene, predicted and calibrated."""
        return rms_or_worst(self.scene, self.predicted[channel]), rms_or_worst(self.scene, self.calibrated[channel])

    def off(self, channel: str) -> float:
        """By how much the prediction is off, relative."""
        predicted, calibrated = self.both(channel)
        return predicted / calibrated - 1

    @property
    def sentence(self) -> str:
        """What the confirmation says."""
        if self.failed:
            return f"{self.name}: no calibration: {self.failed}"
        said = []
        for channel in self.predicted:
            predicted, calibrated = self.both(channel)
            verdict = "within 10 %" if abs(self.off(channel)) <= WITHIN else f"off by {100 * self.off(channel):+.0f} %"
            said.append(f"{channel}: predicted {predicted:.3g}, calibrated {calibrated:.3g} ({verdict})")
        return f"{self.name}: " + "; ".join(said)


def confirm(name: str, look: Look, processes: int, say: Callable[[str], None]) -> Confirmed:
    """Calibrate a design and compare; what fails is said in `failed`."""
    friction = look.scene.unknown.friction
    try:
        told = None if friction == "unknown" else friction
        done = calibrate_finger(free_of_bench(look.finger), friction=told, progress=say, processes=processes)
        calibrated = sigmas_of(done.calibration, look.scene)
    except PapillaError as error:
        return Confirmed(name, {}, {}, look.scene, str(error))
    return Confirmed(name, {"S_d": look.sigma_sd, "all gauges": look.sigma_gauges}, calibrated, look.scene)


def free_of_bench(finger: Finger) -> Finger:
    """The finger whose bench says no friction: the study says what is known of it."""
    return replace(finger, bench=replace(finger.bench, friction=None))


def sigmas_of(calibration: Calibration, scene: Scene) -> dict[str, np.ndarray]:
    """Sigma (f, m) of ln E over a scene by a calibration, from S_d and from all gauges."""
    return {"S_d": sigma_from_sd(calibration, scene), "all gauges": sigma_from_gauges(calibration, scene)}
