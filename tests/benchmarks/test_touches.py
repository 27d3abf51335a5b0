"""Touches of a made-up finger: the bound of the noise, what disturbances do, and rows of trials that are known."""

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.estimators import touches
from papilla.calibration import BicubicSurface, Calibration, GaugeSurface, Quadratic, SdSurface, Uncertainty
from papilla.core.errors import InputError
from papilla.model.finger import Finger

FORCE, MODULUS = (0.05, 1.0), (0.02, 5.0)


@pytest.fixture(scope="module")
def made_up():
    """Five gauges of a made-up finger, and an S_d that is not that of their readings."""
    known = Uncertainty(0.0, 1.96, 0.0, np.array(FORCE), np.full(2, 0.002), 2.0, 4)
    x, y = np.linspace(-3.2, 0.2, 13)[:, None], np.linspace(-4.1, 1.8, 23)[None, :]
    soft = 1 / (1 + np.exp(y - math.log(0.1)))
    beside, middle = (-29000 + 9500 * x) * (1 - 0.25 * soft), 54000 * np.exp(-0.47 * x) * (1 - 0.3 * soft)
    tables, own = (-17500 + 0 * (x + y), beside, middle), replace(known, scatter=np.full(2, 100.0))
    gauges = [
        GaugeSurface(f"g{n}", BicubicSurface(FORCE, MODULUS, tables[k]), own) for n, k in enumerate((0, 1, 2, 1, 0), 1)
    ]
    table = BicubicSurface(FORCE, MODULUS, 10.4 + 0.6 * x - 0.3 * soft)
    sd = SdSurface(table, np.tile([0, 20], (10, 1)), np.full((10, 2), np.nan), known)
    forward = Quadratic(np.array([-3.0, 500, -9000, 12000, 900]), np.ones(5), np.eye(5), 1.0, 2.0, (0.089, 0.72), 9.0)
    return Calibration({"name": "", "sha256": ""}, {}, forward, forward.inverse, sd, tuple(gauges), {})


@pytest.mark.slow
def test_noise_alone_is_measured_against_its_bound(made_up):
    steps = []
    known = {"touches": ("noise alone",), "methods": ("all gauges", "S_d alone"), "seeds": range(100, 124)}
    five, alone = touches.feel(made_up, Finger.default(), **known, progress=steps.append)
    assert (five.method, alone.method) == known["methods"] and steps == ["softness"]
    assert five.answered == 1 and five.trials == 24 and 0.6 < five.over_bound < 1.5 and 0.6 < five.over_sigma < 1.5
    assert alone.over_bound > 10, "the S_d of this made-up finger is not that of its gauges"
    force = touches.forces()[touches.AIR :]
    by_sd, by_gauges = (touches.bound(made_up, 0.1, force, by_sd) for by_sd in (True, False))
    assert by_gauges < 0.5 * by_sd
    assert touches.bound(made_up, 0.1, np.tile(force, 4), False) == pytest.approx(by_gauges / 2)


def test_rows_of_known_trials(made_up):
    moduli, bounds = np.full(4, 0.5), np.full(4, 0.01)
    errors, ok = np.array([0.01, 0.3, 0.03, 0.5]), [1.0, 1.0, 1.0, 0.0]
    found = np.column_stack([0.5 * np.exp(errors), 0.02 * 0.5 * np.exp(errors), ok])
    row = touches.row_of("nothing", "x", found, moduli, bounds)
    assert row.answered == 0.75 and row.covered == pytest.approx(2 / 3) and row.false_confident == 0.25
    assert row.median == pytest.approx(0.03) and row.over_bound == pytest.approx(100 * row.rms)
    assert row.over_sigma == pytest.approx(row.rms / 0.02)
    near = np.column_stack([0.5 * np.exp(errors / 10), 0.001 * np.ones(4), ok])
    assert touches.row_of("nothing", "x", near, moduli, bounds).false_confident == 0, "off by less than 5 %"
    with pytest.raises(InputError, match="trials must be at least 2, got 1"):
        touches.feel(made_up, Finger.default(), seeds=(100,))
    nothing = touches.row_of("nothing", "x", np.full((4, 3), np.nan), moduli, bounds)
    assert nothing.answered == nothing.false_confident == 0 and math.isnan(nothing.rms + nothing.covered)


@pytest.mark.parametrize(
    "disturb, size, gauges, force",
    [
        (touches.creep, 0.03, 0.03, 0), (touches.gauge_gain, 0.03, 0.03, 0), (touches.zero_drift, 200.0, 0.2, 0),
        (touches.force_gain, 0.02, 0, 0.02),
    ],
)  # fmt: skip
def test_disturbances_have_their_size(disturb, size, gauges, force):
    """RMS over 400 seeds of the relative change at the end, of readings of 1000 microstrain."""
    changes = []
    for seed in range(400):
        readings, felt = disturb(np.random.default_rng(seed), np.full((400, 5), 1000.0), touches.forces(), size)
        changes.append((readings[-1, 0] / 1000 - 1, felt[-1] / touches.forces()[-1] - 1))
    assert np.sqrt(np.mean(np.square(changes), axis=0)) == pytest.approx([gauges, force], rel=0.15)
