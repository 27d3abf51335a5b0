"""Statuses: numbers that logs and blocks hold, without a hole or a repetition, each with a sentence of its own."""

import pytest

from papilla.calibration import SoftnessStatus
from papilla.estimators.friction import FrictionStatus
from papilla.estimators.health import BASE, Fault, pack, unpack
from papilla.estimators.pipeline.clock import ClockStatus
from papilla.estimators.published.roughness import RoughnessStatus
from papilla.estimators.published.wavelet import RidgeStatus
from papilla.estimators.tracking import TrackingStatus
from papilla.estimators.tracking.chirp import ChirpStatus

ALL = [SoftnessStatus, FrictionStatus, Fault, ClockStatus, RoughnessStatus, RidgeStatus, TrackingStatus, ChirpStatus]


@pytest.mark.parametrize("statuses", ALL, ids=lambda own: own.__name__)
def test_statuses_count_from_zero_and_say_what_is_what(statuses):
    assert sorted(map(int, statuses)) == list(range(len(statuses)))
    sentences = [one.sentence for one in statuses]
    assert len(set(sentences)) == len(sentences) and all(sentences)


def test_the_numbers_that_old_logs_hold_mean_what_they_did():
    assert (FrictionStatus(5).name, RoughnessStatus(8).name, TrackingStatus(8).name) == (
        "CHANGED", "ALIASED", "CONSTANT_SPEED"
    )  # fmt: skip
    assert (Fault(3).name, ClockStatus(3).name, ChirpStatus(2).name, RidgeStatus(5).name) == (
        "STUCK", "BEGUN_ANEW", "QUIET", "COMMON"
    )  # fmt: skip


def test_faults_of_all_channels_are_digits_of_one_number():
    faults = [Fault.SWAPPED, Fault.NONE, Fault.STUCK, Fault.MISSING]
    code = pack(list(map(int, faults)))
    assert code == 6 + 0 * 8 + 3 * 64 + 1 * 512 and unpack(code, 4) == faults and max(Fault) < BASE
