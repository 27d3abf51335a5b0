"""`papilla.calibration.check`: right presses pass, wrong ones are named, and what tells nothing does not pass."""

from dataclasses import replace

import numpy as np
import pytest
from spring_calibration import calibration

from papilla.calibration import check
from papilla.calibration.fitting.checking import Truth, held_as_stated
from papilla.core.errors import InputError
from papilla.logs import PressLog

PATTERN = np.array([-1.0, 1.0, -1.0, 1.0, 0.0]) / np.sqrt(0.8)


@pytest.fixture(scope="module")
def finger():
    return calibration()


def presses(finger, force, modulus, factor=1.0) -> PressLog:
    """Presses that read what the calibration predicts, of specimens whose stated moduli are off by a factor."""
    force, modulus = (np.asarray(part, float) for part in np.broadcast_arrays(force, modulus))
    sd = finger.predict(force, modulus)
    names = tuple(f"g{k}" for k in range(1, 6))
    return PressLog(force, modulus * factor, sd[:, None] * PATTERN, names)


def test_presses_of_the_finger_itself_pass(finger):
    found = check(finger, presses(finger, [0.2, 0.5, 0.9], [0.06, 0.2, 0.5]))
    assert found.passed and found.missed == 0 and found.answered == 3
    assert all(one.sentence == "ok" for one in found.presses)
    assert found.to_json()["rows"][0]["modulus_MPa"] == 0.06


def test_a_force_beyond_the_domain_says_nothing_and_does_not_pass(finger):
    found = check(finger, PressLog(np.array([3.0]), np.array([0.1]), 2e4 * PATTERN[None], ("g1",) * 5))
    assert not found.passed and "says nothing about the modulus" in found.presses[0].sentence


def test_a_wrong_modulus_is_named(finger):
    found = check(finger, presses(finger, [0.2, 0.5], [0.06, 0.1], factor=1.5))
    assert not found.passed and found.missed == 2
    assert all("outside the interval" in one.sentence for one in found.presses)
    assert check(finger, presses(finger, [0.2, 0.5], [0.06, 0.1], factor=1.5), tolerance=0.5).passed


def test_noise_that_is_stated_widens_the_intervals(finger):
    off = presses(finger, [0.5], [0.1], factor=1.3)
    found = [check(finger, off, **noise).passed for noise in ({}, {"gauge_sigma": 3000.0}, {"force_error": 0.2})]
    assert found == [False, True, True]


def test_presses_with_s_d_alone_are_recovered_like_those_with_readings(finger):
    log = presses(finger, [0.2, 0.5, 0.9], [0.06, 0.2, 0.5])
    alone = replace(log, readings=np.zeros((3, 0)), gauge_names=(), stated_sd=log.sd_microstrain)
    assert check(finger, alone) == check(finger, log)


@pytest.mark.parametrize(
    "changes, options, message",
    [
        ({}, {"tolerance": -1.0}, "tolerance"),
        ({}, {"gauge_sigma": -1.0}, "gauge_sigma"),
        ({}, {"force_error": 2.0}, "force_error"),
        ({"readings": np.zeros((1, 2)), "gauge_names": ("a", "b")}, {}, r"of 2 gauges \(a, b\), the calibration of 5"),
    ],
)
def test_unusable_options_and_presses_of_another_finger_are_refused(finger, changes, options, message):
    with pytest.raises(InputError, match=message):
        check(finger, replace(presses(finger, [0.5], [0.1]), **changes), **options)


@pytest.mark.parametrize("share", [0.0, 0.03, 0.3])
def test_intervals_grow_until_they_hold_the_checked_presses(finger, share):
    """Presses of a finger whose S_d is off by a share, up and down: the calibration says by how much it grew."""
    force, modulus = (axis.ravel() for axis in np.meshgrid([0.2, 0.4, 0.8], [0.06, 0.12, 0.25, 0.4]))
    off = 1 + share * np.where(np.arange(12) % 2, 1, -1)
    presses = np.column_stack([np.zeros(12), force, modulus, finger.predict(force, modulus) * off])
    right = np.column_stack([presses[:, :3], finger.predict(force, modulus)])
    wider, factor = held_as_stated(finger, {"right presses": right, "presses": presses})
    before, after = (Truth.of(one, presses).inside.sum() for one in (finger, wider))
    assert after == 12 and (factor == 1) == (before == 12) == (wider is finger)
    answers = [one.invert(finger.predict(0.4, 0.12), 0.4) for one in (finger, wider)]
    widths = [float(answer.upper_MPa - answer.lower_MPa) for answer in answers]
    assert widths[1] == widths[0] if factor == 1 else widths[1] > widths[0]
    assert not any("right" in note for note in wider.notes), "only what was missed is named"
    assert any("held" in note for note in wider.notes) == bool(wider.doubt) == (factor > 1)
    if share == 0.3:
        gauges = [one.gauges[0].uncertainty.sigma_at(0.4) for one in (finger, wider)]
        assert factor > 3 and gauges[1] > 2 * gauges[0], "gauges alone are no surer than S_d"
