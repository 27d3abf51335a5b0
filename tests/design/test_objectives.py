"""Objectives, confirmations and figures of studies against values found by hand."""

from dataclasses import replace

import numpy as np
import pytest

from papilla.design import job
from papilla.design.confirming import Confirmed
from papilla.design.results import Effect
from papilla.design.scene import Scene
from papilla.model.finger import Finger

FINGER = Finger.default()


# ---- Confirmations


def test_a_confirmation_says_how_far_off_a_prediction_is():
    ones = np.ones((2, 3))
    one = Confirmed(
        "finger_1.toml", {"S_d": 0.105 * ones, "all gauges": 0.12 * ones},
        {"S_d": 0.1 * ones, "all gauges": 0.1 * ones}, Scene(),
    )  # fmt: skip
    assert one.both("S_d") == (0.105, 0.1)
    assert one.sentence == (
        "finger_1.toml: S_d: predicted 0.105, calibrated 0.1 (within 10 %); "
        "all gauges: predicted 0.12, calibrated 0.1 (off by +20 %)"
    )
    assert replace(one, failed="no mesh").sentence == "finger_1.toml: no calibration: no mesh"


# ---- Words and figures of the page


def test_an_effect_in_words():
    one = Effect("outer.modulus_MPa", "sigma_sd", 0.1, 0.6, 0.5, (0.4, 0.7), True)
    assert job.in_words(one) == "outer.modulus_MPa from 0.100 to 0.600 multiplies sigma_sd by 0.500 (0.400 to 0.700)"
    assert "changes sigma_sd by" in job.in_words(replace(one, factor=False)) and one.sure
    assert not replace(one, interval=(0.9, 1.1)).sure and replace(one, factor=False, interval=(0.9, 1.1)).sure
    assert not replace(one, factor=False, interval=(-0.1, 0.1)).sure


def test_a_panel_a_design_has_its_sigma_in_per_cent():
    forces, moduli = np.geomspace(0.2, 0.8, 4), np.geomspace(0.1, 0.4, 3)
    sigma = 0.01 * np.outer(np.ones(4), [1.0, 3.0, 30.0])
    left, right, bar = job.sigma_figure(forces, moduli, [("one", sigma), ("two", 1e-9 + 0 * sigma)]).axes
    assert (left.get_title(loc="left"), right.get_title(loc="left")) == ("one", "two")
    assert left.get_xscale() == left.get_yscale() == "log" and left.get_xlim() == pytest.approx((0.2, 0.8))
    assert [text.get_text() for text in left.get_xticklabels()] == ["0.2", "0.4", "0.8"]
    assert [text.get_text() for text in bar.get_yticklabels()] == [f"{one} %" for one in job.LEVELS]
    levels = left.collections[0].levels if hasattr(left.collections[0], "levels") else None
    assert levels is None or 10**levels == pytest.approx(job.LEVELS)
