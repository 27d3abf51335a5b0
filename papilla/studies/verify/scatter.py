"""Mesh scatter: the same presses on five meshes of the default finger, each with its own triangulated surfaces."""

from collections.abc import Iterator

import numpy as np

from papilla.fem import FingerModel
from papilla.finger import Finger
from papilla.mesh import build
from papilla.mesh.references import VARIANTS
from papilla.studies.case import Case
from papilla.studies.verify.finger import FORCES_GF, pressed_by

SD_BOUNDS = {5: 0.005, 10: 0.005, 30: 0.003, 60: 0.003, 100: 0.003}
"""Target for S_d of the default mesh at each force (gf)."""

OTHER_BOUNDS = {"indentation": 0.002, "contact_area": 0.01, "peak_pressure": 0.01}
"""Targets for other results of a press, at 50 gf."""


def scatter() -> Iterator[Case]:
    """Standard deviation over the meshes, relative to the mean; the calibration's intervals contain the same
    scatter."""
    finger = Finger.default()
    reduced = [FingerModel(finger, build(finger, variant=variant)).reduce() for variant in range(VARIANTS)]
    for force_gf in FORCES_GF:
        values = [pressed_by(one, force_gf).sd for one in reduced]
        yield Case(f"S_d at {force_gf} gf", _measure("S_d"), _spread(values), SD_BOUNDS[force_gf])
    presses = [pressed_by(one, 50) for one in reduced]
    for key, bound in OTHER_BOUNDS.items():
        name = key.replace("_", " ")
        yield Case(f"{name} at 50 gf", _measure(name), _spread([getattr(one, key) for one in presses]), bound)
    highest = float(np.mean([one.sd for one in presses]))
    worst = max(_spread([one.reading[k] for one in presses], highest) for k in range(len(finger.gauges)))
    yield Case("readings at 50 gf", "standard deviation of the worst gauge's reading over S_d, 5 meshes", worst, 0.003)


def _measure(name: str) -> str:
    return f"standard deviation of {name} over its mean, {VARIANTS} meshes"


def _spread(values, scale: float | None = None) -> float:
    return float(np.std(values, ddof=1) / abs(np.mean(values) if scale is None else scale))
