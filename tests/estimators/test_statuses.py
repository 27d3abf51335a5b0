"""Statuses: numbers that logs and blocks hold, without a hole or a repetition, each with a sentence of its own."""

import numpy as np
import pytest

from papilla.calibration import SoftnessStatus
from papilla.estimators import (
    FrictionEstimate,
    FusedEstimate,
    Pipeline,
    RoughnessEstimate,
    SoftnessEstimate,
    WavelengthEstimate,
)
from papilla.estimators.friction import FrictionStatus
from papilla.estimators.health import BASE, Fault, pack, unpack, words
from papilla.estimators.pipeline.clock import Clock, ClockStatus
from papilla.estimators.published.roughness import RoughnessStatus
from papilla.estimators.published.wavelet import RidgeEstimate, RidgeStatus
from papilla.estimators.tracking import TrackingStatus
from papilla.estimators.tracking.chirp import ChirpEstimate, ChirpStatus

ALL = [SoftnessStatus, FrictionStatus, Fault, ClockStatus, RoughnessStatus, RidgeStatus, TrackingStatus, ChirpStatus]


@pytest.mark.parametrize("statuses", ALL, ids=lambda own: own.__name__)
def test_statuses_count_from_zero_and_say_what_is_what(statuses):
    assert sorted(map(int, statuses)) == list(range(len(statuses)))
    assert all(one.code.startswith("ok") == one.good and len(one.code) < 24 for one in statuses)
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


@pytest.mark.parametrize(
    "estimate, statuses",
    [
        (FrictionEstimate, FrictionStatus), (RoughnessEstimate, RoughnessStatus), (WavelengthEstimate, TrackingStatus),
        (FusedEstimate, TrackingStatus), (ChirpEstimate, ChirpStatus), (RidgeEstimate, RidgeStatus),
        (SoftnessEstimate, SoftnessStatus),
    ],
)  # fmt: skip
def test_an_estimate_says_its_status_in_words(estimate, statuses):
    """Of one sample, and of a block."""
    numbers = list(range(len(statuses)))
    empty = dict.fromkeys(estimate._fields, 0.0)
    assert [estimate(**(empty | {"status": number})).sentence for number in numbers] == [
        statuses(number).sentence for number in numbers
    ]
    block = estimate(**(empty | {"status": np.array(numbers)}))
    assert list(block.sentence) == [statuses(number).sentence for number in numbers]
    assert statuses(0).sentence == "ok" and not any(own.sentence == "ok" for own in list(statuses)[1:])


def test_a_clock_and_the_gauges_faults_are_said_in_words():
    clock = Clock(100.0)
    found = [clock.tick(time, 1.0, float("nan")).status for time in (0.0, 0.01, 0.05, 0.05, 9.0)]
    assert found == [ClockStatus[name] for name in ("OK", "OK", "GAP", "REPEATED", "BEGUN_ANEW")] == [0, 0, 1, 2, 3]
    assert words(tuple(map(int, Fault)), [f"g{n}" for n in range(7)]) == [
        f"g{int(fault)} {fault.sentence}" for fault in Fault if fault
    ]
    assert (
        Pipeline(None, gauges=1, columns=("velocity_mm_s",)).update((0.0, 1.0, 1.0)).status.startswith("wavelength: ")
    )
