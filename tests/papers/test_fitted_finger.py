"""The fit of the published finger to printed figures: the better of its minima, and no answer where there is none."""

import numpy as np
import pytest

from papilla.core.errors import SolverError
from papilla.model.finger import Finger
from papilla_papers.claims.experiments.fitted import DEPTH_FORCES_N, PRINTED_N, Relatives

SPECIMENS = [0, 1, 2]
DEPTHS_MM = list(PRINTED_N)
PATTERN = np.array([-0.3, 0.5, 1.0, 0.4, -0.2])
"""Strains of five gauges."""


def relatives(curvature_power: float) -> Relatives:
    """Presses of nine fingers whose gauges see strains that grow with the force to the power of 0.8, and changes of
    curvature that grow with it to another power; the depth is Hertz's."""
    factors = [0.7, 1.0, 1.4], [0.8, 1.0, 1.25]
    skins, stiffer, forces, moduli = np.ix_(*factors, np.geomspace(0.1, 1, 10), [0.089, 0.51, 0.72])
    size = 1e4 * (moduli / (moduli + 0.05 * skins * stiffer)) / stiffer**0.8
    strain, curvature = (size * forces**power for power in (0.8, curvature_power))
    readings = np.stack([(strain + 0.1 * lever * curvature)[..., None] * PATTERN for lever in (-1.0, 0.0)], axis=2)
    depths = (DEPTH_FORCES_N / 0.57 / (stiffer * skins**0.4)[..., 0]) ** (2 / 3)
    return Relatives(Finger.published(), readings, np.broadcast_to(depths, (3, 3, len(DEPTH_FORCES_N))))


def test_a_lever_that_the_readings_do_not_determine_is_refused():
    with pytest.raises(SolverError, match="do not determine the lever"):
        relatives(curvature_power=0.8).fit(SPECIMENS, DEPTHS_MM)
    assert np.isfinite(relatives(curvature_power=0.5).fit(SPECIMENS, DEPTHS_MM)).all()
