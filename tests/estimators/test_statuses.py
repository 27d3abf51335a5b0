"""Statuses: numbers that logs and blocks hold, without a hole or a repetition, each with a sentence of its own."""

import pytest

from papilla.calibration import SoftnessStatus
from papilla.estimators.friction import FrictionStatus
from papilla.estimators.health import FAULT_CODE_BASE, Fault, pack, unpack
from papilla.estimators.pipeline.clock import ClockStatus
from papilla.estimators.wavelength import TrackingStatus
from papilla.estimators.wavelength.chirp import ChirpStatus
from papilla_papers.methods.roughness import RoughnessStatus
from papilla_papers.methods.wavelet import RidgeStatus

IN_LOGS = {
    SoftnessStatus: "OK NOT_IDENTIFIABLE SOFTER HARDER FORCE_BELOW FORCE_ABOVE NO_CONTACT BAD_GAUGE BAD_INPUT LEFT_OUT "
    "MISFIT OFF_REACH",
    FrictionStatus: "OK STATIC_NOT_SEEN ONE_WAY UNSURE OUTLIER CHANGED NO_PULL NEGATIVE NO_CONTACT NOT_SLIDING "
    "BAD_INPUT",
    Fault: "NONE MISSING SATURATED STUCK OFF_SURFACE SIGN_FLIPPED SWAPPED",
    ClockStatus: "OK GAP REPEATED BEGUN_ANEW OTHER_RATE",
    RoughnessStatus: "OK WARMING_UP SILENT STANDSTILL NO_VELOCITY GAP MISSING SATURATED ALIASED DUPLICATE",
    RidgeStatus: "OK WARMING_UP NOT_SIGNIFICANT GAP SILENT COMMON",
    TrackingStatus: "OK SEARCHING STANDSTILL MISSING NO_VELOCITY ALIASED NO_TEXTURE TIME_LOCKED CONSTANT_SPEED "
    "OUT_OF_RANGE INCOHERENT VAGUE AMBIGUOUS LONE",
    ChirpStatus: "OK SEARCHING QUIET MISSING AMBIGUOUS",
}


@pytest.mark.parametrize("statuses, names", IN_LOGS.items(), ids=lambda own: getattr(own, "__name__", ""))
def test_statuses_count_from_zero_mean_what_old_logs_hold_and_say_what_is_what(statuses, names):
    assert sorted(map(int, statuses)) == list(range(len(statuses)))
    assert [one.name for one in sorted(statuses)] == names.split()
    assert all(one.code.startswith("ok") == one.good and len(one.code) < 24 for one in statuses)
    sentences = [one.sentence for one in statuses]
    assert len(set(sentences)) == len(sentences) and all(sentences)


def test_faults_of_all_channels_are_digits_of_one_number():
    faults = [Fault.SWAPPED, Fault.NONE, Fault.STUCK, Fault.MISSING]
    code = pack(list(map(int, faults)))
    assert code == 6 + 0 * 8 + 3 * 64 + 1 * 512 and unpack(code, 4) == faults and max(Fault) < FAULT_CODE_BASE
