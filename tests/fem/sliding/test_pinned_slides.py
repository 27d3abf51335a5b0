"""Numbers of the coarse section and of short scenes on it, pinned: whoever changes one changes a result, and says so in
CHANGELOG.

What the numbers should be is tested elsewhere, against closed forms and second methods; these pins find what bounds of
percents let through.
"""

import numpy as np
import pytest

from papilla import Grating
from papilla.fem import Motion, slide
from papilla.model.textures import MeasuredProfile

GRATING = Grating(0.9, 0.9, 0.3)
BUMPS = MeasuredProfile(np.linspace(-20, 20, 401), 0.05 * np.sin(np.linspace(-20, 20, 401)))
SCENES = {
    "at rest": (GRATING, (40.0, 0.05), {"force": 0.1, "friction": 0.5, "dynamics": "quasi-static"}),
    "modal": (GRATING, (80.0, 0.04), {"depth": 0.4, "friction": 0.3, "dynamics": "modal"}),
    "auto": (BUMPS, (-100.0, 0.03, 500.0), {"force": 0.2, "friction": 0.0}),
}
# Readings and readings of the amplifier (microstrain); force, tangential force (N), depth, carried, depth in grooves
# (mm), push of flanks, highest frequency (Hz)
PINNED = {
    "at rest": (
        (-10689.551, -12956.1724, 40062.8572, 1365.92316, 3661.92515),
        (-10674.575, -13068.4796, 40295.6405, 1333.40951, 3652.12291),
        (0.1, 0.05, 0.449208817, -0.397048608, 0.0858101609, 0.0476723116, 33.3333333),
    ),
    "modal": (
        (-8141.93411, -9075.51447, 32514.8014, -293.774849, 1744.3001),
        (-8226.23877, -9175.60609, 33044.0968, -550.500874, 2788.98808),
        (0.101171932, 0.0303515797, 0.4, -0.263317446, 0.0890668231, 0.0494815684, 66.6666667),
    ),
    "auto": (
        (-7355.29836, -9933.41733, 57985.9271, -8561.28831, -7636.34323),
        (-7418.20968, -9716.13255, 56344.8527, -8609.40583, -7620.72138),
        (0.2, 0.0, 0.753885547, 0.00207791181, 0.0999317788, 0.0130560211, 250.0),
    ),
}
STATES = {"at rest": (0, 4262, 417, 71), "modal": (0, 3417, 371, 12), "auto": (0, 921, 504)}
"""Numbers of samples of nodes that slip to the left, are open, slip to the right and stick."""


@pytest.mark.parametrize("name", SCENES)
def test_scenes(finger, coarse, name):
    texture, motion, options = SCENES[name]
    found = slide(finger, texture, Motion.steady(*motion), section=coarse, length_mm=5.0, **options)
    readings, amplified, others = PINNED[name]
    assert found.readings[-1] == pytest.approx(readings, rel=1e-6)
    assert found.amplified[-2] == pytest.approx(amplified, rel=1e-6)
    last = (getattr(found, key)[-1] for key in ("force_N", "tangential_N", "depth_mm", "carried_mm"))
    told = (*last, found.in_groove_mm, found.flank_push, found.highest_Hz)
    assert told == pytest.approx(others, rel=1e-6, abs=1e-12)
    assert tuple(np.bincount(found.state.ravel() + 1)) == STATES[name]
    assert (found.relaxed, found.unresolved, found.status) == (0, 0, "ok")


def test_energies_close_as_before(finger, coarse):
    texture, motion, options = SCENES["modal"]
    found = slide(finger, texture, Motion.steady(*motion), section=coarse, length_mm=5.0, **options)
    assert (found.energy_error, found.loss_factor) == pytest.approx((0.00169067318, 0.1), rel=1e-4)


def test_the_section(coarse):
    """Norms of its matrices, the first and last of its modes, and its surface."""
    modes = coarse.modes
    norms = (np.linalg.norm(one) for one in (coarse.compliance, *coarse.rows, modes.patch, modes.gauges[0]))
    assert tuple(norms) == pytest.approx((2831.16434, 21.8354297, 12.6409702, 75955.2236, 3072.15746), rel=1e-6)
    assert (modes.omega[0], modes.omega[-1]) == pytest.approx((418.013863, 3381.1738), rel=1e-6)
    assert (len(modes.omega), len(coarse.x)) == (40, 95)
    surface = (coarse.z.sum(), coarse.hats.sum(), coarse.half_width, coarse.bone_top, coarse.ridge_pitch)
    assert surface == pytest.approx((1854.56352, 22.8, 11.1, 6.0, 1.2), rel=1e-8)
