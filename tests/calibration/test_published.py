"""Equations (9) and (10) as printed, the exact inverse, the best scale, and the reach beyond two likely truths."""

import numpy as np
import pytest
from scipy.stats import norm
from spring_calibration import calibration

from papilla.calibration.published import compare_with_published, published_sd
from papilla.calibration.readouts import two_ended
from papilla.core.errors import InputError

FORCE_GF = np.array([10.0, 37.0, 60.0, 100.0])


def test_equation_9_at_a_point_worked_by_hand():
    # -0.0314 * 60^2 + 14.5 * 60 + 87.2 * 0.51^2 + 104.5 * 0.51 - 81.9
    assert published_sd(60.0, 0.51) == pytest.approx(-113.04 + 870.0 + 22.68072 + 53.295 - 81.9)


def test_the_scale_is_that_of_least_squares():
    ours, theirs, scale = compare_with_published(calibration().predict, FORCE_GF)
    assert ours.shape == theirs.shape == (4, 3)
    best = np.linalg.lstsq(ours.reshape(-1, 1), theirs.ravel(), rcond=None)[0][0]
    assert scale == pytest.approx(best, rel=1e-12)
    with pytest.raises(InputError, match="does not cover"):
        compare_with_published(calibration().predict, [200.0])


@pytest.mark.parametrize("half, shift", [(0.1, 0.01), (0.1, -0.2), (0.02, 1.0)])
def test_the_reach_beyond_two_truths_misses_either_in_5_percent(half, shift):
    sigma = half / norm.ppf(0.975)
    reach = two_ended(half, shift) / sigma
    assert norm.sf(reach) + norm.sf(reach + abs(shift) / sigma) == pytest.approx(0.05, abs=1e-9)
    assert two_ended(half, 0.0) == half and two_ended(0.0, shift) == 0.0
