"""How a touch begins, ends and teaches zeros: each rule on both sides of its limit, on drawn samples."""

import math

import numpy as np
import pytest

from papilla.calibration import SoftnessStatus
from papilla.core.errors import InputError
from papilla.estimators import Doubts, GaugeSoftness, Softness, TouchState

OK, AWAY = int(SoftnessStatus.OK), int(SoftnessStatus.NO_CONTACT)
REST = (5.0,) * 5 + (0.02,)


@pytest.fixture(scope="module")
def made(five):
    """made(**options) -> an estimator of five gauges."""
    found = five(0.01)
    return lambda **options: GaugeSoftness(found, **({"gauge_sigma": 50.0, "force_sigma_N": 0.005} | options))


@pytest.mark.parametrize("force", [0.06, 0.3, 0.95])
@pytest.mark.parametrize("modulus", [0.03, 0.2, 3.0])
@pytest.mark.parametrize("force_known", [True, False])
def test_a_touch_begins_at_the_contact_that_explains_its_first_samples(five_gauges, force, modulus, force_known):
    """Wherever in the domain it is, with a sensor of the force or by the gauges alone."""
    own = GaugeSoftness(five_gauges, gauge_sigma=5.0, force_sigma_N=5e-4, doubts=Doubts.NONE)
    row = [*five_gauges.predict_readings(force, modulus), force if force_known else math.nan]
    found = own.process([row] * 3)
    assert set(found.status.tolist()) <= {OK, int(SoftnessStatus.NOT_IDENTIFIABLE), int(SoftnessStatus.LEFT_OUT)}
    assert found.force_N[-1] == pytest.approx(force, rel=2e-3)
    assert abs(found.modulus_MPa[-1] - modulus) < found.modulus_sigma_MPa[-1]


def test_s_d_is_refused_outside_the_forces_by_more_than_their_noise(calibration):
    own = Softness(calibration, gauge_sigma=50.0, force_sigma_N=0.005)
    loud = np.array([-9e3, 0.0, 9e3, 0.0, 0.0])
    below, above = SoftnessStatus.FORCE_BELOW, SoftnessStatus.FORCE_ABOVE
    for force, refused in ((0.031, None), (0.029, below), (1.019, None), (1.021, above)):
        own.reset()
        assert (own.update((*loud, force)).status == refused) == (refused is not None)
    assert own.update((*loud, math.nan)).status == SoftnessStatus.BAD_INPUT
    assert own.update((math.nan, *loud[1:], 0.3)).status == SoftnessStatus.BAD_GAUGE
    assert own.update((math.nan, *loud[1:], 0.01)).status == SoftnessStatus.NO_CONTACT


@pytest.mark.parametrize(
    "reading, force, away", [(3199.0, 0.01, True), (3201.0, 0.01, False), (3199.0, math.nan, False)]
)
def test_a_light_force_ends_a_touch_once_it_has_lasted(made, reading, force, away):
    """50 samples of what zeros may have moved to, 8 standard deviations of 400 microstrain."""
    own = made(doubts=Doubts(zero_microstrain=400.0), stuck_samples=10_000)
    status = own.process([(*[reading] * 5, force)] * 52).status == AWAY
    assert not status[:50].any() and (status[50:] == away).all()


def test_zeros_are_learnt_from_rests_that_agree(made):
    """Of twenty samples each, the one before last; not while a channel is missing."""
    own = made()
    own.process([(math.nan, *REST[1:])] * 60)
    assert own.state.airborne == 0 and not any(own.state.zeros)
    for count in range(1, 161):
        own.update(REST)
        assert own.state.airborne == min(max(count // 20 - 1, 0) * 20, 100)
    assert own.state.zeros == pytest.approx(REST, rel=0.01)


def test_zeros_known_from_the_air_are_doubted_by_half(five_gauges):
    """After fifty samples in the air; sigma of a touch under a doubt of zeros alone falls by as much."""
    doubts = Doubts(0.0, 0.0, 400.0, 0.0, 0.0, 0.0, 10.0, 0.0)
    force = np.full(60, 0.4)
    rows = np.column_stack([five_gauges.predict_readings(force, 0.2), force])
    sigmas = []
    for airborne in (0, 40, 80):
        own = GaugeSoftness(five_gauges, gauge_sigma=1.0, force_sigma_N=1e-4, doubts=doubts)
        if airborne:
            own.process(np.zeros((airborne, 6)))
        sigmas.append(own.process(rows).modulus_sigma_MPa[-1])
    assert sigmas[1] == pytest.approx(sigmas[0], rel=1e-3) and sigmas[2] == pytest.approx(0.5 * sigmas[0], rel=0.1)


def test_a_state_is_of_this_many_gauges(made):
    with pytest.raises(InputError, match="the state is of 3 gauges, the calibration has 5"):
        made().state = TouchState(None, (0.0,) * 4)
