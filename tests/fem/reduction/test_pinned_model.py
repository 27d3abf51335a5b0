"""Norms of what the smallest finger is condensed to, pinned: whoever changes one changes a result, and says so in
CHANGELOG.

A mesh of a few cells, an elastic bone, a gauge beside the middle that is turned. What the numbers should be is tested
elsewhere, by reciprocity, symmetry and second assemblies; these pins find what bounds of percents let through.
"""

from dataclasses import replace

import numpy as np
import pytest

from papilla.fem import FingerModel, receptive_fields
from papilla.model.finger import Finger, Gauge, Layer

TURNED = Gauge("turned", angle_deg=25.0, y_mm=6.0, direction_deg=35.0, lever_mm=0.5)


@pytest.fixture(scope="module")
def model(dome):
    plain = Finger.default()
    finger = replace(plain, bone=Layer(3.0, 0.3), gauges=(*plain.gauges[:2], TURNED))
    return FingerModel(finger, dome(finger, divisions=4, outer_layers=1, inner_layers=2))


def norms(*arrays):
    return [float(np.linalg.norm(one)) for one in arrays]


def test_at_the_apex(model):
    found = model.reduce()
    patch = found.patch
    assert norms(found.compliance, *found.rows, found.half_space) == pytest.approx(
        [2223.23388, 3.52240287, 2.17755053, 244.541776], rel=1e-6
    )
    assert (patch.mass.sum(), patch.gap.sum(), found.facets) == pytest.approx((52.7207794, 26.1945111, 0.0), rel=1e-6)
    assert found.layers.ravel() == pytest.approx([3.0, 0.136, 11.0, 0.034, 6.0, 3.0], rel=1e-9)
    assert norms(*model.reduce_tangential()) == pytest.approx([949.224283, 1.75292526], rel=1e-6)


def test_beside_it(model):
    found = model.reduce((2.0, 1.0))
    told = norms(found.compliance, *found.rows)
    assert told == pytest.approx([8176.89962, 3.666378, 2.38384871], rel=1e-6)
    assert found.patch.gap.sum() == pytest.approx(199.737254, rel=1e-6)
    assert found.layers[:, 0] == pytest.approx([2.99945062, 10.9944875, 5.97865112], rel=1e-6)


def test_under_small_forces(model):
    assert norms(receptive_fields(model).strain_per_newton) == pytest.approx([0.19171520], rel=1e-6)
