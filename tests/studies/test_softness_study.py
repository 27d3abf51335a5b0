"""The softness study: readings of the surfaces against bounds, profiles, and rows as plain values."""

import json
import math
from dataclasses import asdict, replace

import numpy as np
import pytest

from papilla.calibration import Calibration, GaugeSurface, PositionTerms, SdSurface, Surface, Uncertainty
from papilla.calibration.quadratic import Quadratic
from papilla.errors import InputError
from papilla.studies.estimator_bench import softness

FORCE, MODULUS = (0.05, 1.0), (0.02, 5.0)


@pytest.fixture(scope="module")
def calibration():
    """Five gauges of a made-up finger, and S_d of their readings."""
    known = Uncertainty(0.0, 1.96, 0.0, np.array(FORCE), np.full(2, 0.002), 2.0, 4)
    x, y = np.linspace(-3.2, 0.2, 13)[:, None], np.linspace(-4.1, 1.8, 23)[None, :]
    soft = 1 / (1 + np.exp(y - math.log(0.1)))
    tables = [
        -17500 + 0 * (x + y),
        (-29000 + 9500 * x) * (1 - 0.25 * soft),
        54000 * np.exp(-0.47 * x) * (1 - 0.3 * soft),
    ]
    sd = SdSurface(
        Surface(FORCE, MODULUS, 10.4 + 0.6 * x - 0.3 * soft), np.tile([0, 20], (10, 1)), np.full((10, 2), np.nan), known
    )
    own = replace(known, scatter=np.full(2, 100.0))
    gauges = tuple(
        GaugeSurface(f"g{number + 1}", Surface(FORCE, MODULUS, tables[table]), own)
        for number, table in enumerate((0, 1, 2, 1, 0))
    )
    forward = Quadratic(np.array([-3.0, 500, -9000, 12000, 900]), np.ones(5), np.eye(5), 1.0, 2.0, (0.089, 0.72), 9.0)
    return Calibration({"name": "", "sha256": ""}, {}, forward, forward.inverse, sd, gauges, {})


def test_rows_hold_errors_over_bounds(calibration):
    options = {"trials": 12, "moduli": (0.1,), "noises": ((50.0, 0.02),), "profiles": ("press",)}
    steps = []
    rows = softness.compare_softness(
        calibration, {}, **options, progress=lambda done, total: steps.append((done, total))
    )
    assert [row.estimator for row in rows] == list(softness.ENTRANTS) and steps[-1] == (4, 4)
    five, alone = (next(row for row in rows if row.estimator == name) for name in ("five gauges", "S_d alone"))
    assert five.bound < 0.5 * alone.bound
    assert 0.5 < five.error_over_bound < 1.6 and 0.5 < five.sigma_ratio < 1.6 and five.answered == 1
    assert json.loads(json.dumps(asdict(five)))["mesh"] == softness.SURFACE
    assert {row.place for row in rows} == {softness.SURFACE}


def test_bounds_hold_the_errors_of_the_calibration(calibration):
    force, sure = softness.force_profile("press"), softness.taken_as_exact(calibration)
    for bound in (softness.gauge_bound, softness.sd_bound):
        assert bound(calibration, 0.1, force, 20.0, 0.002) > 2 * bound(sure, 0.1, force, 20.0, 0.002)
    fewer = softness.gauge_bound(sure, 0.1, force, 20.0, 0.002, used=[0, 1, 3, 4])
    assert fewer > softness.gauge_bound(sure, 0.1, force, 20.0, 0.002)


@pytest.fixture(scope="module")
def with_positions(calibration):
    """The same finger, whose readings go with x: the left half up and the right half down, the middle bends."""
    k = np.arange(11) - 5.0
    over_x = np.array([900 * k, 2500 * k, -1800 * k**2, -2500 * k, -900 * k])
    over_x[2] -= (over_x[2, 4] + 4 * over_x[2, 5] + over_x[2, 6]) / 6
    coefficients = np.broadcast_to(over_x[:, None, None, :], (5, 4, 4, 11)).copy()
    error = np.tile(40.0 * np.abs(np.arange(9) - 4.0), (5, 1))
    return replace(calibration, position=PositionTerms(FORCE, MODULUS, 4.0, coefficients, error))


def test_touches_beside_the_apex_get_rows_of_their_own(with_positions):
    options = {"trials": 8, "moduli": (0.1,), "noises": ((50.0, 0.005),), "profiles": ("press",)}
    rows = softness.compare_softness(with_positions, {}, **options, places_mm=(0.0, 1.0))
    found = {(row.estimator, row.place): row for row in rows}
    assert len(rows) == len(softness.ENTRANTS) + 1 + len(softness.BESIDE)
    beside, blind = (found[name, "surface, x 1 mm"] for name in (softness.ANYWHERE, "five gauges"))
    assert beside.answered == 1 and 0.4 < beside.error_over_bound < 1.7 and 0.4 < beside.sigma_ratio < 1.7
    assert not (blind.answered == 1 and blind.error < 2 * beside.error)
    assert found[softness.ANYWHERE, "surface"].position_mm == 0 and beside.position_mm == 1
    only = softness.compare_softness(with_positions, {}, **options, places_mm=(1.0,), entrants=(softness.ANYWHERE,))
    assert only == (beside,)


def test_an_unknown_position_raises_the_bound_and_its_error_more(with_positions):
    force, sure = softness.force_profile("press"), softness.taken_as_exact(with_positions)
    known, free = (softness.gauge_bound(sure, 0.1, force, 20.0, 0.002, position_mm=x) for x in (None, 1.0))
    assert free > known
    assert softness.gauge_bound(with_positions, 0.1, force, 20.0, 0.002, position_mm=1.0) > free


def test_profiles_go_to_and_fro():
    force = softness.force_profile("press")
    assert force.shape == (softness.SAMPLES,) and np.ptp(force) == pytest.approx(0.75)
    assert (np.diff(force[:100]) >= 0).all() and (np.diff(force[101:]) <= 0).all()


def test_what_it_refuses(calibration):
    with pytest.raises(InputError, match="trials must be at least 2, got 1"):
        softness.compare_softness(calibration, {}, trials=1)
    with pytest.raises(InputError, match="profile must be one of press, light, firm, got 'slap'"):
        softness.force_profile("slap")
