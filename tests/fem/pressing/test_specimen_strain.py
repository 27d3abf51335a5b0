"""What a specimen's own large strain changes in a press, against bodies of revolution whose block is neo-Hookean."""

import math

import numpy as np
import pytest

from papilla.fem.pressing.specimen_strain import specimen_change
from papilla.model.finger import Finger
from papilla.references.axisymmetric.bodies import Bodies, Rubber, Shape
from papilla.references.axisymmetric.presses import press_path


@pytest.mark.parametrize("seed", range(8))
def test_it_depends_on_ratios_alone_and_is_small_on_a_hard_specimen(seed):
    rng = np.random.default_rng(seed)
    strain = float(rng.uniform(1e-4, 0.2))
    radius, thickness, outer, length, stiffness = np.exp(rng.uniform(-2, 2, 5)).tolist()
    for friction in (0.0, 0.3, math.inf):
        change, error = specimen_change(strain, 1.0, radius, (thickness, outer), friction)
        skin = length * thickness, stiffness * outer
        scaled = specimen_change(strain, stiffness, length * radius, skin, friction)
        assert scaled == pytest.approx((change, error), rel=1e-12) and error > 0
        assert bool(change) == math.isinf(friction)
    harder, less = specimen_change(strain, 100.0, radius, (thickness, outer), math.inf)
    assert abs(harder) < abs(change) / 5 and less < error / 5


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.0, math.inf])
def test_a_neo_hookean_block_changes_presses_by_as_much_as_is_said(friction):
    """A dome that the numbers were not fitted to: within three sigmas, and with stick nearer than without the term."""
    rng = np.random.default_rng(41)
    breadth, height, skin, outer, inner = 10.0, float(rng.uniform(8, 12)), float(rng.uniform(1, 2)), 0.2, 0.04
    within = breadth - skin, height - skin
    shape = Shape((breadth, height), within, (0.4 * within[0], 0.4 * within[1]), 8.0, 30.0)
    block, top = 2.0 * inner, 0.03 * inner * min(breadth, height) ** 2
    gauges = Finger.default().gauges
    full, linear = (
        press_path(
            Bodies(shape, [Rubber(outer), Rubber(inner), Rubber(block, 0.495, linear=one)]), gauges, top, friction
        )
        for one in (False, True)
    )
    left, raw = [], []
    for force in np.geomspace(0.15, 0.98, 4) * top:
        true = math.log(full.at(force)[1][0].std() / linear.at(force)[1][0].std())
        radius = float(np.interp(force, full.force, full.radius))
        strain = force / (math.pi * radius**2 * block)
        change, error = specimen_change(strain, block, radius, (skin, outer), friction)
        assert abs(true - change) < 3 * error
        left.append(true - change)
        raw.append(true)
    assert not friction or np.linalg.norm(left) < 0.6 * np.linalg.norm(raw)
