"""The fit of the published finger to printed figures: the better of its minima, and no answer where there is none."""

import numpy as np
import pytest

from papilla.calibration.published import SPECIMENS_MPA, published_sd
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


@pytest.mark.parametrize("specimens, depths", [(SPECIMENS, DEPTHS_MM), ([0, 2], DEPTHS_MM), (SPECIMENS, DEPTHS_MM[1:])])
def test_the_fit_is_where_the_weighted_misfits_are_least(specimens, depths):
    """Equation (9) but for a factor within 3 %, as five numbers; depths within 1 %; moduli of tissue within half an
    octave: summed here once more, no step along any unknown makes the sum smaller."""
    family, gf = relatives(curvature_power=0.5), np.arange(10.0, 101.0, 10.0)
    printed = published_sd(gf[:, None], np.array(SPECIMENS_MPA))

    def total(unknowns):
        sd, depth = family.press(unknowns)
        ours, theirs = sd[:, specimens], printed[:, specimens]
        misfit = np.vdot(ours, theirs) / np.vdot(ours, ours) * ours - theirs
        of_9 = 5 / 30 * np.sum(misfit**2) / np.mean(printed**2) / 0.03**2
        reached = [np.interp(np.log(PRINTED_N[mm]), np.log(DEPTH_FORCES_N), depth) / mm - 1 for mm in depths]
        outer = family.finger.outer.modulus * np.exp(unknowns[0] + unknowns[1])
        inner = family.finger.inner.modulus * np.exp(unknowns[1])
        octaves = np.log2([outer / 0.136, inner / 0.034]) / 0.5
        return of_9 + np.sum(np.square(reached)) / 0.01**2 + np.sum(octaves**2)

    best = family.fit(specimens, depths)
    ends = np.array([*np.log([[0.7, 1.4], [0.8, 1.25]]), (-2, 1), (0.05, 0.3)])
    assert np.all((ends[:, 0] <= best) & (best <= ends[:, 1]))
    for step in np.diag([2e-3, 2e-3, 2e-3, 2e-4]):
        for moved in (best + step, best - step):
            assert total(moved) >= total(best) * (1 - 1e-6) or np.any((moved < ends[:, 0]) | (moved > ends[:, 1]))
