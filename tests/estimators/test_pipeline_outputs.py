"""The parts of a pipeline around estimators that answer as they are told: which answer counts, and how it is said."""

import math

import numpy as np
import pytest

from papilla.calibration import SoftnessStatus
from papilla.estimators import Pipeline
from papilla.estimators.health import Fault, pack
from papilla.estimators.pipeline.clock import Tick
from papilla.estimators.pipeline.outputs import FrequencyOutput, ModulusOutput, Row, WavelengthOutput
from papilla.estimators.softness.gauges import GaugeEstimate
from papilla.estimators.wavelength import TrackingStatus
from papilla.estimators.wavelength.chirp import ChirpEstimate
from papilla.estimators.wavelength.memory import Finding
from papilla.estimators.wavelength.trackers import FusedEstimate

ROW = Row((1.0, 2.0), (), 0.3, math.nan, Tick(0, 0, 1.0, 50.0, 50.0, 3.0))
NAMES = ("left", "right")


class Told:
    """An estimator of softness that answers this."""

    def __init__(self, answer, dominant=""):
        self.answer, self.dominant, self.state = answer, dominant, None

    def feel(self, readings, force, found):
        assert (readings, force, found) == ((1.0, 2.0), 0.3, ())
        return self.answer


def modulus(calibration, by_sd, every=None, code=0):
    every = None if every is None else Told(GaugeEstimate(*every, int(code), 3))
    return ModulusOutput(calibration, NAMES, Told(by_sd), every)


def gauges(status, value=0.2, sigma=0.01):
    return (
        (value, sigma, 0.3, int(SoftnessStatus[status]))
        if value
        else (math.nan, math.nan, math.nan, int(SoftnessStatus[status]))
    )


OK, NO_CONTACT, MISFIT = (int(SoftnessStatus[name]) for name in ("OK", "NO_CONTACT", "MISFIT"))


@pytest.mark.parametrize(
    "by_sd, every, told, words",
    [
        ((0.3, 0.02, OK), None, (0.3, 0.02), "ok"),
        ((0.3, 0.02, OK), gauges("OK"), (0.2, 0.01), "ok"),
        ((math.nan, math.nan, NO_CONTACT), gauges("OK"), (0.2, 0.01), "ok"),
        ((math.nan, math.nan, NO_CONTACT), gauges("MISFIT", None), (math.nan, math.nan),
         SoftnessStatus.NO_CONTACT.sentence),
        ((0.3, 0.02, OK), gauges("MISFIT", None), (0.3, 0.02), "from S_d, because the gauges contradict each other"),
        ((math.nan, math.nan, int(SoftnessStatus.BAD_GAUGE)), gauges("MISFIT", None), (math.nan, math.nan),
         f"from S_d, because the gauges contradict each other: {SoftnessStatus.BAD_GAUGE.sentence}"),
        ((0.3, 0.02, OK), gauges("FORCE_ABOVE", None), (math.nan, math.nan), SoftnessStatus.FORCE_ABOVE.sentence),
    ],
)  # fmt: skip
def test_every_gauge_answers_and_s_d_where_they_contradict_each_other(calibration, by_sd, every, told, words):
    part = modulus(calibration, by_sd, every)
    value, sigma, status = part.take(ROW)
    np.testing.assert_equal((value, sigma), told)
    assert part.sentence(status) == words
    assert part.code(status).startswith("ok") == words.startswith("ok") and len(part.code(status)) < 32


@pytest.mark.parametrize("faults", [(Fault.STUCK, 0, 0), (0, Fault.SWAPPED, Fault.MISSING)])
def test_what_is_left_out_is_said_by_name(calibration, faults):
    status = int(SoftnessStatus.LEFT_OUT)
    part = modulus(calibration, (0.3, 0.02, OK), (0.2, 0.01, 0.3, status), pack(tuple(map(int, faults))))
    named = [
        f"{name} left out: {Fault(fault).sentence}"
        for name, fault in zip((*NAMES, "force"), faults, strict=True)
        if fault
    ]
    code = part.take(ROW)[2]
    assert part.sentence(code) == f"{SoftnessStatus.LEFT_OUT.sentence}, {', '.join(named)}"


@pytest.mark.parametrize("unlike", [0, 1, 2])
def test_a_touch_that_creeps_unlike_the_bench_s_is_said_beside_all_else(calibration, unlike):
    status = int(SoftnessStatus.LEFT_OUT)
    part = modulus(calibration, (0.3, 0.02, OK), (0.2, 0.01, 0.3, status), pack((0, int(Fault.STUCK), 0)))
    plain = part.sentence(part.take(ROW)[2])

    class Creep:
        state = None

        def feel(self, time_s, force_N):
            assert (time_s, force_N) == (1.0, 0.3)
            return unlike

    part._creep = Creep()
    code = part.take(ROW)[2]
    text = part.sentence(code)
    assert part.code(code) == "ok, left out" + ", crept" * (unlike > 0)
    assert NAMES[0] not in part.sentence((*code[:-1], ""))
    assert text.startswith(plain) and ((", but loaded" in text) == (unlike > 0))
    assert ("faster" in text) == (unlike == 1) and ("more slowly" in text) == (unlike == 2)
    part._every = Told(GaugeEstimate(*gauges("FORCE_ABOVE", None), 0, 3))
    assert "loaded" not in part.sentence(part.take(ROW)[2]), "nothing is said of no answer"


def test_what_dominates_is_that_of_the_gauges_or_of_s_d(calibration):
    for own, sd, told in (("creep", "noise", "creep"), ("", "noise", "noise"), ("", "", "")):
        part = ModulusOutput(calibration, NAMES, Told(None, sd), Told(None, own))
        assert part.doubted == (f"modulus: most of its standard deviation is {told}" if told else "")
    assert ModulusOutput(calibration, NAMES, Told(None, "noise")).doubted.endswith("is noise")


@pytest.mark.parametrize(
    "late_ms, told", [(12.0, "12.0 ms"), (-3.0, "-3.0 ms"), (1.6, "1.6 ms"), (1.4, ""), (-1.4, "")]
)
def test_a_lateness_that_was_found_is_told_in_milliseconds(late_ms, told):
    for stated in (None, 0.0):
        part = WavelengthOutput(1, latency_s=stated)
        memory = part.tracker._follower.memory
        memory.late_s = late_ms / 1e3
        assert not part.doubted, "at a constant speed nothing tells it"
        memory.late_variance = (abs(memory.late_s) / 3.1) ** 2
        expected = f"found to be {told} behind the readings" if told and stated is None else ""
        assert expected in part.doubted and bool(part.doubted) == bool(expected)


@pytest.mark.parametrize(
    "off, contradicted", [(2.9, False), (3.1, True), (-2.9, False), (-3.1, True), (math.nan, False)]
)
def test_phases_three_sigmas_off_contradict_the_path(off, contradicted):
    part = WavelengthOutput(2)
    sigma = math.hypot(0.01, 0.02)
    found = FusedEstimate(1.7, 0.01, 30.0, int(TrackingStatus.CONSTANT_SPEED), 1.7 + off * sigma, 0.02, 2)
    part.tracker.follow = lambda *given: found if given == (1.0, 3.0, 50.0, (1.0, 2.0)) else None
    frequency, wavelength, spread, status = part.take(ROW)
    assert (frequency, wavelength, spread) == (30.0, 1.7, 0.01)
    text = part.sentence(status)
    assert (
        text.startswith(TrackingStatus.CONSTANT_SPEED.sentence)
        and ("phases between the gauges" in text) == contradicted
    )


def test_without_a_velocity_the_gauge_that_changes_most_is_followed():
    part, asked = FrequencyOutput(3, 1000.0), []
    part._tracker.update = lambda sample: asked.append(sample[0]) or ChirpEstimate(40.0, 1.0, math.nan, math.nan, 0)
    waves = np.outer(np.sin(np.arange(1000.0)), [1.0, 3.0, 1.4]) + [0.0, 50.0, 0.0]
    waves[200:, 2] *= 8
    waves[300:, 2] = math.nan
    found = [part.take(ROW._replace(readings=tuple(row), tick=Tick(1))) for row in waves.tolist()]
    assert found[-1] == (40.0, (0, ""))
    assert asked[50:200] == waves[50:200, 1].tolist(), "another one must change four times more, in power"
    assert asked[290:300] == waves[290:300, 2].tolist(), "at once, as long as it changes more"
    assert asked[-5:] == waves[-5:, 1].tolist(), "until its change has faded where it is lost"
    part.take(ROW._replace(readings=(0.0, 0.0, 0.0), tick=Tick(1, 2)))
    assert np.isnan(asked[1000:1002]).all() and len(asked) == 1003, "two samples are missing before this one"
    other = FrequencyOutput(3, 1000.0)
    other.state = part.state
    assert other._followed == part._followed and part.lag_s == pytest.approx(0.014)


@pytest.mark.parametrize("rate, told", [(1000.0, True), (400.0, True), (399.0, False)])
def test_a_static_coefficient_needs_a_rate_that_shows_a_breakaway(rate, told):
    pipeline = Pipeline(None, gauges=1, columns=("force_N", "velocity_mm_s", "tangential_N"), sample_rate_Hz=rate)
    said = [line for line in pipeline.messages if line.startswith("friction: no static coefficient at 399 Hz")]
    assert bool(said) != told


@pytest.mark.parametrize("rate, slow", [(199.0, True), (200.0, False)])
def test_messages_name_what_is_not_known(rate, slow):
    plain = {"gauges": 1, "columns": ("velocity_mm_s",), "sample_rate_Hz": rate}
    text = "\n".join(Pipeline(None, **plain).messages)
    assert ("may look longer" in text) == slow and "ridge_pitch_mm" in text and "1.5% for the scale" in text
    text = "\n".join(Pipeline(None, **plain, ridge_pitch_mm=0.0, scale_sigma=0.0).messages)
    assert "ridge_pitch_mm" not in text and "scale of the path" not in text


def test_a_saturated_reading_is_used_by_nobody_and_said_to_be_so():
    pipeline = Pipeline(None, gauges=("a", "b"), columns=("velocity_mm_s",), saturation=10.0)
    seen = []
    tracker = pipeline._outputs["wavelength"].tracker
    follow = tracker.follow
    tracker.follow = lambda *given: seen.append(given[-1]) or follow(*given)
    for readings in ((9.9, -9.9), (10.0, 1.0), (1.0, -10.0)):
        found = pipeline.update((0.001 * (1 + len(seen)), *readings, 50.0))
    assert seen[0] == (9.9, -9.9) and math.isnan(seen[1][0]) and seen[1][1] == 1.0 and math.isnan(seen[2][1])
    assert "b saturated" in found.status and pipeline.lines == () and pipeline.friction is None


def test_an_ambiguous_wavelength_names_both():
    part = WavelengthOutput(1)
    found = FusedEstimate(2.355, 0.01, 30.0, int(TrackingStatus.AMBIGUOUS), math.nan, math.nan, 1)
    part.tracker.follow = lambda *given: found
    part.tracker._follower.memory.finding = Finding(other=1 / 4.71)
    assert part.sentence(part.take(ROW)[-1]) == TrackingStatus.AMBIGUOUS.sentence + " (2.355 or 4.71 mm)"
    part.tracker._follower.memory.finding = Finding()
    assert part.sentence(part.take(ROW)[-1]) == TrackingStatus.AMBIGUOUS.sentence
