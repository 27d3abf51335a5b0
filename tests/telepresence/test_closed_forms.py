"""Filters, extrapolations, limits and defaults of telepresence against independent numbers; both edges of ranges."""

import math

import numpy as np
import pytest
from scipy.signal import butter, lfilter

from papilla.core.errors import InputError
from papilla.telepresence import (
    Actuator,
    Component,
    ContactArea,
    Gate,
    GratingTexture,
    Hand,
    HandMotion,
    LinkModel,
    LocalModel,
    RecordedTexture,
    RemoteHand,
    Safety,
    SideBySide,
    Soft,
    TouchLog,
)
from papilla.telepresence.direct import DirectFeedback, HighPass
from papilla.telepresence.gate import ClockOffset, Counts
from papilla.telepresence.local_model import DisplayStatus
from papilla.telepresence.messages import Header, Parameters, QuantityTrust, decode, encode, lines_of
from papilla.telepresence.motion import WANDER_HZ
from papilla.telepresence.page import settings
from papilla.telepresence.record import LoopRecord, felt_wavelength
from papilla.telepresence.touch import GRATING_HARMONICS, PASS_BAND_HZ, SKIN_MM
from tests.support.spring_calibration import calibration

HEADER = Header(1, 5, 1, 10, 0, 0, 0)


def test_the_coupling_is_a_second_order_butterworth_high_pass_of_10_hz():
    readings = np.random.default_rng(0).standard_normal(300)
    filtered = HighPass(1000.0)
    found = [filtered(value) for value in readings.tolist()]
    expected = lfilter(*butter(2, 10.0, "highpass", fs=1000.0), readings - readings[0])
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_defaults_are_those_of_the_paper_and_of_the_documents():
    motion = HandMotion()
    assert (motion.peak_mm_s, motion.strokes_Hz, motion.wander, motion.press_N) == (197.0, 1.07, 0.1, 0.5)
    assert pytest.approx(3.2, rel=0.02) == 1 / WANDER_HZ, "the period with which the rate of strokes varies"
    safety = Safety()
    assert (safety.hold_s, safety.decay_s, safety.attack_s) == (0.5, 0.3, 0.1)
    assert (safety.force_limit_N, safety.force_release_N) == (2.0, 1.9)
    link = LinkModel()
    assert (link.one_way_ms, link.jitter_ms, link.loss, link.reordering, link.duplication) == (0, 0, 0, 0, 0)
    assert (link.redraw_Hz, link.queue_s, link.bandwidth_bytes_s) == (5.0, 1.0, math.inf)


def test_the_pressing_force_swings_by_40_per_cent_in_1_7_seconds():
    motion, period = HandMotion(press_N=0.5), 1 / 0.6
    found = motion.force_N(np.array([0.0, 0.25, 0.5, 0.75, 1.0]) * period)
    assert found == pytest.approx([0.5, 0.7, 0.5, 0.3, 0.5])


def test_a_hand_goes_on_with_its_last_speed_for_twelve_milliseconds_and_forgets_its_error_in_two():
    hand = Hand()
    for time, place in ((0.0, 0.0), (0.004, 0.4), (0.008, 1.0)):
        hand.read(time, place)
    # The last two steps are 100 and 150 mm/s: 150 half a step ago, 175 now
    before = 0.4 + 100 * 0.004 + (0.0 - 0.4) * math.exp(-2)  # where the hand was expected at the third reading
    for since in (0.0, 0.002, 0.0119):
        place = 1.0 + 175 * since + (before - 1.0) * math.exp(-since / 0.002)
        assert hand.at(0.008 + since) == pytest.approx((place, 175.0))
    for since in (0.0121, 0.5):
        place = 1.0 + 175 * 0.012 + (before - 1.0) * math.exp(-since / 0.002)
        assert hand.at(0.008 + since) == pytest.approx((place, 0.0))
    assert hand.age_s(0.5) == pytest.approx(0.492)
    assert math.isnan(Hand().at(1.0)[0]) and Hand().at(1.0)[1] == 0.0


@pytest.mark.parametrize(
    "time_s, place_mm, jumps, ignored",
    [
        (1.5, 1000.0, 0, 0), (1.5, 1001.0, 1, 0), (2.0, 0.0, 0, 0), (2.001, 0.0, 1, 0), (0.001, 0.0, 0, 1),
        (0.0, 0.0, 1, 0), (1.0, 0.0, 0, 1),
    ],
)  # fmt: skip
def test_a_reading_is_a_new_place_beyond_2_m_per_s_or_a_second(time_s, place_mm, jumps, ignored):
    hand = Hand()
    hand.read(1.0, 0.0)
    hand.read(time_s, place_mm)
    assert (hand.jumps, hand.ignored) == (jumps, ignored)


def test_a_remote_hand_catches_up_by_25_per_cent_then_within_a_twentieth_of_a_second():
    remote, delay, speeds, behind = RemoteHand(), 0.1, [], []
    for row in range(1, 1600):
        now = row / 1000
        delay = 0.1 if now < 1.0 else 0.05
        remote.read(now, now - delay, 100 * (now - delay))
        speeds.append(remote.at(now)[1])
        behind.append(now - delay - remote.playing_s)
    speeds, behind = np.array(speeds), np.array(behind)
    assert speeds[500:990] == pytest.approx(100.0, rel=1e-6) and speeds[1010:1140] == pytest.approx(125.0, rel=1e-6)
    # 50 ms late, less a quarter of the time until 12.5 ms are left; from then on an exponential of 50 ms
    assert behind[1099] == pytest.approx(0.05 - 0.25 * 0.1, abs=5e-4)
    assert behind[1199] == pytest.approx(0.0125 * math.exp(-1), abs=2e-4)


def test_a_delay_that_changes_by_more_than_a_second_is_not_caught_up():
    for change, first in ((0.9, 100 * 1.125), (1.1, 100.0)):
        remote = RemoteHand()
        for row in range(1, 200):
            remote.read(3 + row / 1000, row / 1000, 0.1 * row)
            remote.at(3 + row / 1000)
        remote.read(3.2, 0.2 + change, 20.0 + 100 * change)
        before = remote.playing_s
        remote.at(3.2)
        assert (remote.playing_s - before > 0.5) == (first == 100.0)


def test_windows_of_a_quarter_second_follow_each_other_by_a_quarter_of_it():
    place = 60.0 * np.arange(1500) / 1000
    shown = np.sin(2 * np.pi * place / 1.5)
    shown[600:700] = 0.0
    felt = felt_wavelength(shown, place, np.full(1500, 1.5), 1000.0)
    assert felt.time_s == pytest.approx(0.25 + 0.062 * np.arange(21))
    # A window is silent if one of its quarters, 62 samples, lies in the silence
    quarters = (felt.time_s[:, None] - 0.25) + 0.062 * np.arange(4)
    silent = ((quarters >= 0.6) & (quarters + 0.062 <= 0.7)).any(axis=1)
    np.testing.assert_array_equal(np.isnan(felt.wavelength_mm), silent)
    assert felt.silent == pytest.approx(silent.mean()) and 0 < felt.silent < 1
    half = np.where(np.arange(1500) < 700, 1.5, 2.0)
    kept = felt_wavelength(shown, place, half, 1000.0)
    assert not ((kept.time_s > 0.701) & (kept.time_s < 0.949)).any(), "no window has both textures"
    assert set(kept.truth_mm) == {1.5, 2.0}


def test_windows_below_30_per_cent_of_the_largest_speed_are_left_out():
    for slow, number in ((31.0, 9), (29.0, 2)):
        place = np.cumsum(np.where(np.arange(1000) < 500, 100.0, slow)) / 1000
        felt = felt_wavelength(np.sin(place), place, np.ones(1000), 1000.0)
        assert (felt.time_s.size >= 12) == (number == 9) and felt.time_s.size >= 4


def test_errors_of_a_felt_wavelength_are_cut_and_silence_is_left_out():
    felt = felt_wavelength(np.zeros(500), np.arange(500.0), np.ones(500), 1000.0)
    assert felt.silent == 1 and math.isnan(felt.error)
    made = felt._replace(wavelength_mm=np.array([1.5, math.nan, 9.0]), truth_mm=np.ones(3), time_s=np.ones(3))
    assert made.error == pytest.approx(math.sqrt((0.5**2 + 3.0**2) / 2)) and made.silent == pytest.approx(1 / 3)


def test_the_shares_of_statuses_and_the_first_second_of_a_record():
    record = LoopRecord(**{name: None for name in LoopRecord._fields})._replace(
        time_s=np.arange(2000) / 1000,
        local_status=np.repeat([0, 1], [1500, 500]),
        direct_status=np.full(2000, 8),
        round_trip_ms=np.where(np.arange(2000) < 1000, 999.0, np.where(np.arange(2000) < 1600, 40.0, math.nan)),
    )
    assert record.judged == slice(1000, None) and record.late_ms == 40.0
    assert record.statuses("local") == {"ok": 0.75, DisplayStatus.NO_MESSAGE.sentence: 0.25}
    assert record.statuses("direct") == {DisplayStatus.CLIPPED.sentence: 1.0}


def test_codes_and_counts_are_those_of_files_and_messages():
    assert [int(status) for status in DisplayStatus] == list(range(10))
    assert [int(trust) for trust in QuantityTrust] == list(range(4)) and QuantityTrust.DOUBTED == 3
    assert set(vars(Counts()).values()) == {0} and Counts().dropped == 0


@pytest.mark.parametrize("beyond_ns, known", [(0, True), (1, False)])
@pytest.mark.parametrize("truth", [7_000_000, -7_000_000])
def test_an_offset_is_contradicted_by_more_than_half_both_trips_and_5_ms_three_times(truth, beyond_ns, known):
    offset = ClockOffset()
    offset.learn(2_000, truth)
    seen = truth + (2_000 + 4_000) // 2 + 5_000_000 + beyond_ns
    for _ in range(2):
        offset.learn(4_000, seen)
        assert offset.offset_ns == truth
    offset.learn(4_000, seen)
    assert (offset.offset_ns == truth) == known


def test_a_session_is_never_zero_which_means_none_and_another_each_time():
    sessions = [Gate().session for _ in range(200)]
    assert all(0 < one < 2**63 for one in sessions) and len({*sessions}) == 200
    assert Gate(b"k" * 16).seal(b"x")[16:] == b"x"
    with pytest.raises(InputError, match="at least 16 bytes, got 15"):
        Gate(b"k" * 15)


def test_a_message_has_8_lines_at_most_and_numbers_within_their_bounds():
    lines = lines_of(tuple(Component(1.0 + k, 1.0) for k in range(9)))
    assert len(lines) == 8 and len(decode(encode(Parameters(HEADER, 0, lines))).lines) == 8
    for message in (Parameters(HEADER, 0, (*lines, lines[0])), Parameters(HEADER, 3, lines)):
        with pytest.raises(ValueError, match="Expected"):
            decode(encode(message))
    assert decode(encode(Parameters(HEADER, 2, lines))).texture == 2


def test_the_local_model_has_the_limits_that_it_states():
    assert LocalModel(Actuator("flat", 10.0, 1000.0)).top_Hz == 400.0, "0.4 of the output's rate"
    for good in ({"components": 8}, {"rate_Hz": 1e6}, {"rate_Hz": 1000.0}, {"force_exponent": 3.0}):
        LocalModel(**good)
    for bad in ({"components": 9}, {"rate_Hz": 1.001e6}, {"rate_Hz": 999.0}, {"force_exponent": 3.01}):
        with pytest.raises(InputError, match=next(iter(bad))):
            LocalModel(**bad)


@pytest.mark.parametrize(
    "late_s, status",
    [(0.0, DisplayStatus.OK), (0.499, DisplayStatus.OK), (0.501, DisplayStatus.STALLED), (-0.1, DisplayStatus.STALLED)],
)
def test_a_message_holds_for_half_a_second(late_s, status):
    model = LocalModel()
    model.learn(1.0, (Component(1.3, 30.0),))
    model.move(1.0 + late_s, 0.0)
    assert model.update(1.0 + late_s).status == status


@pytest.mark.parametrize("ahead_s, status", [(0.95, DisplayStatus.OK), (1.05, DisplayStatus.NO_HAND)])
def test_a_reading_of_the_hand_is_a_second_ahead_of_the_display_at_most(ahead_s, status):
    model = LocalModel()
    model.learn(1.0, (Component(1.3, 30.0),))
    model.move(1.0 + ahead_s, 0.0)
    assert model.update(1.0).status == status


@pytest.mark.parametrize("ratio, replaced", [(0.79, False), (0.81, True), (1.0, True), (1.24, True), (1.26, False)])
@pytest.mark.parametrize("components", [1, 2])
def test_a_wavelength_within_a_quarter_of_the_old_one_goes_on_with_its_phase(ratio, replaced, components):
    """The hand rests where the first line is at its peak; what replaces it stays there, what begins anew is at zero."""
    model, shown = LocalModel(components=components), []
    for row in range(400):
        now = row / 1000
        model.move(now, min(0.25, 0.05 * row))
        if row % 20 == 0:
            model.learn(now, (Component(1.0 if row < 300 else ratio, 100.0),))
        shown.append(model.update(now).displacement_um)
    assert shown[290] == pytest.approx(23.8, rel=1e-3)
    assert shown[-1] == pytest.approx(23.8 if replaced or components == 1 else 0.0, rel=1e-3, abs=1e-6)


def test_a_grating_has_harmonics_up_to_the_pass_band_of_400_hz():
    texture = GratingTexture(1.5, 40.0)
    assert texture.reading(0.0, 119.0) == texture.reading(0.0, 10.0) != texture.reading(0.0, 121.0)
    assert texture.reading(0.0, -199.0) == pytest.approx(40.0 * (1 - 0.165224), abs=1e-3)
    assert texture.reading(0.0, 201.0) == pytest.approx(40.0) and texture.reading(0.0, 601.0) == 0.0
    beside = SideBySide(texture, GratingTexture(3.0, 7.0), 2.0)
    assert [beside.wavelength(place) for place in (1.999, 2.0)] == [1.5, 3.0]
    assert beside.reading(2.0, 9.0) == GratingTexture(3.0, 7.0).reading(2.0, 9.0)


@pytest.mark.parametrize("length, enough", [(10.0, True), (9.99, False)])
def test_a_recorded_texture_is_10_mm_long_at_least(length, enough):
    place = np.linspace(0, length, 400)
    if enough:
        assert RecordedTexture(place, np.sin(7 * place)).reach_mm == (0, length)
    else:
        with pytest.raises(InputError, match="is 9.99 mm, 10 mm are needed"):
            RecordedTexture(place, np.sin(7 * place))


def test_friction_of_a_finger_turns_over_within_a_millimetre_per_second():
    touch = TouchLog(GratingTexture(1.3), 0.0, Soft(calibration(), 0.3, friction=0.4))
    pulls = [touch.row(0.0, speed, 0.5, [0.0] * 7)[-1] for speed in (-1.0, 0.0, 1.0, 100.0)]
    assert pulls == pytest.approx([-0.2 * math.tanh(1), 0.0, 0.2 * math.tanh(1), 0.2])


def test_the_page_opens_with_strokes_an_uncut_link_and_the_limits_of_the_local_model():
    given = {"wavelength_mm": 1.2, "round_trip_ms": 100.0, "loss": 0.1, "bytes_local": 100.0, "bytes_direct": 68.0}
    found = settings(HandMotion(100.0, 0.0), amplitude_um=99.0, **given)
    limits = found.pop("limits")
    assert found == given | {
        "amplitude_um": 27.5, "strokes_Hz": 1.0, "wander": 0.1, "wander_Hz": 0.31,
        "length_mm": 100.0 / math.pi, "stroke": True, "cut": False, "slow": 1,
    }  # fmt: skip
    assert limits == {
        "band_Hz": 300.0, "amplitude_um": 27.5, "fade": 0.05, "ramp_s": 0.02, "fastest_mm_s": 2000.0,
        "hold_s": 0.5, "decay_s": 0.3, "attack_s": 0.1,
    }  # fmt: skip
    assert settings(HandMotion(100.0, 2.0), amplitude_um=9.0, **given)["length_mm"] == pytest.approx(
        100.0 / (2 * math.pi)
    )


def test_a_table_of_areas_needs_two_values_of_each_that_rise_from_above_zero():
    two = np.array([0.1, 1.0])
    assert ContactArea(two, two, np.array([[1.0, 10.0], [1.0, 10.0]]))(0.3, 0.2)[0] == pytest.approx(3.0)
    bad = [np.array(axis) for axis in ((1.0,), (0.0, 1.0), (-1.0, 1.0), (0.1, 0.1), (0.2, 0.1))]
    for axis in bad:
        for force, modulus, name in ((axis, two, "force_N"), (two, axis, "modulus_MPa")):
            with pytest.raises(InputError, match=f"{name} must be two or more positive numbers that rise"):
                ContactArea(force, modulus, np.ones((modulus.size, force.size)))


STEP_S = 1e-3


def test_the_display_fades_in_holds_the_last_reading_and_falls_silent_when_readings_stop():
    feedback = DirectFeedback(um_per_microstrain=0.1, safety=Safety(hold_s=0.05, decay_s=0.02, attack_s=0.01))
    assert feedback.update(0.0).status == DisplayStatus.NO_MESSAGE
    feedback.take_reading(0.0, 100.0)
    feedback.take_reading(0.0, math.nan)
    rows = [feedback.update(number * STEP_S) for number in range(1, 100)]
    # Full after 10 ms, kept until 50 ms after the reading, then down to zero within 20 ms
    assert [row.displacement_um for row in rows[:12]] == pytest.approx([min(10.0, k) for k in range(1, 13)])
    assert all(row.status == DisplayStatus.OK for row in rows[:50]) and rows[49].displacement_um == 10.0
    assert [row.displacement_um for row in rows[50:72]] == pytest.approx([max(0, 10 - 0.5 * k) for k in range(1, 23)])
    assert rows[60].status == DisplayStatus.STALLED


def test_a_clock_that_jumps_moves_the_gain_by_five_milliseconds_at_most_and_the_stroke_cuts():
    feedback = DirectFeedback(um_per_microstrain=1.0, safety=Safety(attack_s=0.1))
    feedback.take_reading(0.0, 1e4)
    feedback.update(0.0)
    jumped = feedback.update(0.4)
    assert jumped.gain == pytest.approx(0.05)
    assert jumped.displacement_um == feedback.actuator.amplitude_um and jumped.status == DisplayStatus.CLIPPED


@pytest.mark.parametrize("wavelength", [0.6, 1.5])
def test_harmonics_of_a_grating_are_a_square_waves_smoothed_by_the_skin(wavelength):
    texture = GratingTexture(wavelength, 40.0)
    for place in (0.0, 0.2, 0.31):
        expected = 0.0
        for n, sign in zip(GRATING_HARMONICS, (1, -1, 1), strict=True):
            # A Gaussian of width SKIN_MM multiplies wavenumber k by exp(-(k s)^2 / 2), relative to the fundamental
            wide = [math.exp(-0.5 * (2 * math.pi * m * SKIN_MM / wavelength) ** 2) for m in (n, 1)]
            expected += sign / n * wide[0] / wide[1] * math.cos(2 * math.pi * n * place / wavelength)
        assert texture.reading(place, 10.0) == pytest.approx(40.0 * expected)
    fast = 0.9 * PASS_BAND_HZ * wavelength
    assert texture.reading(0.1, fast) == pytest.approx(40.0 * math.cos(2 * math.pi * 0.1 / wavelength))


def test_the_former_name_of_take_reading_warns_and_does_the_same():
    feedback = DirectFeedback()
    with pytest.warns(DeprecationWarning, match="take_reading"):
        feedback.hear(0.0, 100.0)
    feedback.update(0.0)
    assert feedback.update(0.01).displacement_um > 0
