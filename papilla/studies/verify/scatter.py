"""Mesh scatter: the same presses on five meshes of the default finger, each with its own triangulated surfaces."""

from collections.abc import Iterator

import numpy as np

from papilla.fem import FingerModel
from papilla.finger import Finger
from papilla.mesh import build
from papilla.mesh.builder import VARIANTS
from papilla.studies import parameters
from papilla.studies.case import Case
from papilla.studies.verify.finger import FORCES_GF, pressed_by

GIVEN = parameters.parameters(__name__)


def scatter() -> Iterator[Case]:
    """Standard deviation over the meshes, relative to the mean; the calibration's intervals contain the same
    scatter."""
    finger = Finger.default()
    reduced = [FingerModel(finger, build(finger, variant=variant)).reduce() for variant in range(VARIANTS)]
    for force_gf, bound in zip(FORCES_GF, GIVEN.sd_bounds, strict=True):
        values = [pressed_by(one, force_gf).sd for one in reduced]
        yield Case(f"S_d at {force_gf} gf", _measure("S_d"), _spread(values), bound)
    presses = [pressed_by(one, GIVEN.other_gf) for one in reduced]
    for key, bound in GIVEN.other_bounds.items():
        name = key.replace("_", " ")
        yield Case(
            f"{name} at {GIVEN.other_gf} gf", _measure(name), _spread([getattr(one, key) for one in presses]), bound
        )
    highest = float(np.mean([one.sd for one in presses]))
    worst = max(_spread([one.reading[k] for one in presses], highest) for k in range(len(finger.gauges)))
    yield Case(
        f"readings at {GIVEN.other_gf} gf",
        "standard deviation of the worst gauge's reading over S_d, 5 meshes",
        worst,
        GIVEN.gauge_bound,
    )


def _measure(name: str) -> str:
    return f"standard deviation of {name} over its mean, {VARIANTS} meshes"


def _spread(values, scale: float | None = None) -> float:
    return float(np.std(values, ddof=1) / abs(np.mean(values) if scale is None else scale))
