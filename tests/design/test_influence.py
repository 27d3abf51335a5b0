"""Readings of gauges anywhere, and their placement, from made-up touches."""

import math

import numpy as np
import pytest

from papilla.design import placement
from papilla.design.influence import Influence
from papilla.design.placement import KNOWN_SIGMA, UNKNOWN_SCENES, Placed, problem
from papilla.design.scene import PRIOR_SIGMA_LN_MODULUS, DesignScene
from papilla.estimators.softness.touch import TOUCH_RULES
from papilla.fem.pressing.large_strain import CONTINUED_GAUGE
from papilla.model.finger import Finger, Gauge

FINGER = Finger.default()


# ---- Placement


def found_at(sites, gauges=None) -> Influence:
    """Readings of k places in two touches, by random numbers."""
    rng, k = np.random.default_rng(4), len(sites)
    gauges = gauges or tuple(Gauge(f"p{n}", angle_deg=float(n), backing_mm=(5.0, 2.0)) for n in range(k))
    return Influence(gauges, np.array(sites, float), rng.normal(0, 900, (2, k)), rng.normal(0, 500, (5, 2, k)),
                     np.array([0.2, 0.8]))  # fmt: skip


def test_a_problem_has_the_doubts_of_its_scene():
    scene = DesignScene(place_mm=1.5, samples=25)
    doubts = scene.unknown.doubts
    found = found_at([(0, 0, 0), (0, 4.9, 0), (0, 9.9, 0), (0, 14.9, 0)])
    one = problem(found, scene)
    assert one.slopes[1, 2] == pytest.approx([*found.slopes[:, 1, 2], found.reading[1, 2]])
    own = (placement.GAUGE_ERROR**2 + CONTINUED_GAUGE**2 + doubts.gauge_gain**2) * found.reading**2
    own += 25.0 / 25 + (TOUCH_RULES.air_share * doubts.zero_microstrain) ** 2
    assert one.variance == pytest.approx(own)
    # Foils of 5 mm that touch do not overlap
    assert one.overlap[0, 0] and one.overlap[0, 1] and not one.overlap[1, 2]
    for row, force in enumerate((0.2, 0.8)):
        sigma = np.sqrt(1 / np.diag(one.prior[row]))
        offset = (TOUCH_RULES.air_share * doubts.force_offset_N) ** 2 + 0.005**2 / 25
        ln_force = math.sqrt(doubts.force_gain**2 + offset / force**2)
        assert sigma == pytest.approx([PRIOR_SIGMA_LN_MODULUS, ln_force, 0.5, 1.5, 1.5, doubts.creep])
        assert np.count_nonzero(one.prior[row]) == 6
    known = problem(found, scene, friction=False, place=False)
    assert np.sqrt(1 / np.diag(known.prior[0]))[2:5] == pytest.approx([KNOWN_SIGMA] * 3)
    assert known.sigma([0, 2]) <= one.sigma([0, 2])
    direct = np.mean([
        np.linalg.inv(one.prior[p] + sum(np.outer(one.slopes[p, k], one.slopes[p, k]) / one.variance[p, k]
                                         for k in (0, 2)))[0, 0] for p in (0, 1)
    ])  # fmt: skip
    assert one.sigma([0, 2]) == pytest.approx(math.sqrt(direct))


def placed() -> Placed:
    """Two gauges of three places."""
    gauges = (Gauge("p0", angle_deg=10.0), Gauge("p1", angle_deg=-10.0, y_mm=2.0), Gauge("p2", angle_deg=10.0,
              y_mm=-3.0, direction_deg=90.0))  # fmt: skip
    found = found_at([(3.0, 0.0, 1), (-3.0, 2.0, 1), (3.0, -3.0, 1)], gauges)
    sigma = {
        kind: {name: [start / (n + k) for k in range(count)] for n, name in enumerate(UNKNOWN_SCENES, start=1)}
        for kind, start, count in (("anywhere", 0.6, 3), ("in a row", 0.9, 2))
    }
    return Placed(FINGER, found, [[0], [0, 1], [0, 1, 2]], [[0], [0, 1]], sigma, [])


def test_placed_gauges_are_numbered_along_x_and_then_y():
    one = placed()
    finger = one.of([0, 1, 2])
    assert [(gauge.name, gauge.angle_deg, gauge.y_mm) for gauge in finger.gauges] == [
        ("g1", -10.0, 2.0), ("g2", 10.0, -3.0), ("g3", 10.0, 0.0)
    ]  # fmt: skip
    assert one.sentences == [
        "3 gauges anywhere give sigma 0.2 of ln E (rms over the scene), one 0.6",
        "2 gauges anywhere leave 0.3, 2 in a row at y = 0 leave 0.45",
        "the same 3 gauges with place unknown: 0.15",
        "the same 3 gauges with friction unknown: 0.12",
        "the same 3 gauges with neither: 0.1",
    ]
