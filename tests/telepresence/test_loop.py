"""The whole loop: who is late, by how much, and what it costs; measures against signals whose answer is known."""

import math
from dataclasses import replace

import numpy as np
import pytest

from papilla.core.errors import InputError
from papilla.logs.time_log import LogReport, TimeLog
from papilla.telepresence import (
    GratingTexture,
    HandMotion,
    LinkModel,
    LoopRecord,
    RecordedTexture,
    Set,
    SideBySide,
    run,
)
from papilla.telepresence.link import Link
from papilla.telepresence.loop import SimulatedWire
from papilla.telepresence.messages import HandReading, Length, quantity
from papilla.telepresence.record import felt_wavelength, lag_s

TIME = np.arange(6000) / 1000
HAND = HandMotion().place_mm(TIME)


MODULATED = 100 * (TIME - 0.3 / (16 * np.pi) * np.cos(16 * np.pi * TIME))
"""Place of a hand at 100 mm/s, 30 % faster and slower eight times a second."""


def delayed_sine(late_s, wavelength=1.3):
    return np.sin(2 * np.pi * HandMotion().place_mm(TIME - late_s) / wavelength)


@pytest.mark.parametrize("late_ms", [-48.0, 0.0, 37.25, 37.5, 37.75, 240.0, 499.5])
def test_a_lag_is_found_between_samples_and_down_to_50_ms_early(late_ms):
    assert 1e3 * lag_s(delayed_sine(late_ms / 1e3), HAND / 1.3, HAND, 1000.0, 0.6) == pytest.approx(late_ms, abs=0.045)
    assert lag_s(delayed_sine(-0.053), HAND / 1.3, HAND, 1000.0, 0.5) != pytest.approx(-0.053, abs=2e-3)


def test_of_a_lag_that_grows_the_median_of_the_windows_is_told():
    assert lag_s(delayed_sine(0.1 + 0.1 * TIME / 6), HAND / 1.3, HAND, 1000.0, 0.5) == pytest.approx(0.15, abs=6e-3)


def sine(turns):
    return np.sin(2 * np.pi * turns)


@pytest.mark.parametrize("size, heard", [(0.34, False), (0.36, True)])
def test_a_lag_needs_a_signal_of_which_the_texture_explains_35_per_cent(size, heard):
    shown = size * sine(MODULATED / 1.3) + math.sqrt(1 - size**2) * sine(MODULATED / 0.47)
    assert math.isfinite(lag_s(shown, MODULATED / 1.3, MODULATED, 1000.0, 0.3)) == heard


@pytest.mark.parametrize("turns, swing, heard", [(1.95, 0.3, 0), (2.1, 0.3, 1), (19.0, 0.105, 0), (19.0, 0.1173, 1)])
def test_a_lag_needs_two_periods_in_a_window_and_a_speed_that_changes_by_a_fifth(turns, swing, heard):
    """25 mm are a window. The speed changes by 2 swing / (1 + swing) of its greatest: by 0.19 and 0.21."""
    place = 100 * (TIME - swing / (16 * np.pi) * np.cos(16 * np.pi * TIME))
    passed = place * turns / 25
    assert math.isfinite(lag_s(sine(passed), passed, place, 1000.0, 0.3)) == heard


@pytest.mark.parametrize("size, late_ms", [(0.048, 100), (0.054, 140)])
def test_windows_of_a_twentieth_of_the_loudest_tell_no_lag(size, late_ms):
    """The signal is loud and 100 ms late for a second and a half, and faint and 140 ms late from then on."""
    loud = TIME < 1.5
    shown = np.where(loud, 1.0, size) * delayed_sine(np.where(loud, 0.1, 0.14))
    assert 1e3 * lag_s(shown, HAND / 1.3, HAND, 1000.0, 0.3) == pytest.approx(late_ms, abs=0.5)


@pytest.mark.parametrize("trip_ms, most_ms, count", [(100, 450, 6000), (math.nan, 300, 6000), (900, 1200, 3000)])
def test_a_lag_is_looked_for_up_to_one_and_a_half_trips_and_300_ms_or_0_4_of_the_record(trip_ms, most_ms, count):
    record = LoopRecord(**dict.fromkeys(LoopRecord._fields))._replace(
        time_s=TIME[:count], hand_mm=HAND[:count], truth_mm=np.full(count, 1.3), round_trip_ms=np.full(count, trip_ms)
    )
    for late_ms in (most_ms - 15, most_ms + 15):
        found = record._replace(direct_um=delayed_sine(late_ms / 1000)[:count]).lag_ms("direct")
        assert (found == pytest.approx(late_ms, abs=0.5)) == (late_ms < most_ms)


@pytest.mark.parametrize("place", [250.1, 250.4, 250.6, 250.9])
def test_a_felt_wavelength_is_found_between_wavenumbers(place):
    """They begin at 1 over 8 mm, and a tenth of the resolution of 25 mm lies between two."""
    wavelength, path = 1 / (1 / 8 + 0.1 / 25 * place), 100 * TIME[:1500]
    felt = felt_wavelength(np.sin(2 * np.pi * path / wavelength), path, np.ones(1500), 1000.0)
    assert felt.wavelength_mm == pytest.approx(wavelength, rel=1.8e-4)


@pytest.mark.parametrize("wavelength", [0.6, 1.2, 3.0])
def test_the_felt_wavelength_is_that_of_the_signal(wavelength):
    truth = np.full(6000, 1.2)
    felt = felt_wavelength(np.sin(2 * np.pi * HAND / wavelength), HAND, truth, 1000.0)
    assert felt.wavelength_mm == pytest.approx(wavelength, rel=5e-4 if wavelength < 1 else 0.01)
    assert felt.error == pytest.approx(abs(wavelength / 1.2 - 1), abs=0.02)


def test_a_wire_hands_over_what_arrives_in_time_and_leaves_out_what_was_overtaken():
    out, into = Link(LinkModel(one_way_ms=40), 0), Link(LinkModel(one_way_ms=40), 1)
    near, far = SimulatedWire(out, into, 0), SimulatedWire(into, out, 1)
    for row in range(100):
        near.time_s = far.time_s = row / 1000
        near.send(lambda header: HandReading(header, quantity(Length, 7.0)))
        heard = far.receive()
        if row >= 41:
            assert [one.message.header.sequence for one in heard] == [row - 39]
            assert heard[0].sent_ns == round(1e6 * (row - 40)) and heard[0].arrived_ns == pytest.approx(
                1e6 * row, abs=1e4
            )
    late = Link(LinkModel(), 0)
    wire = SimulatedWire(into, late, 1)
    for sent in (2.0, 1.0, 2.0, 3.0):
        late.send(sent, sent)
    wire.time_s = 4.0
    assert [one.sent_ns for one in wire.receive()] == [2_000_000_000, 3_000_000_000]


@pytest.mark.parametrize("up_ms, down_ms", [(40, 60), (0, 0), (0, 300)])
def test_a_run_is_late_by_the_round_trip_where_feedback_is_direct(up_ms, down_ms):
    up, down = LinkModel(one_way_ms=up_ms), LinkModel(one_way_ms=down_ms)
    record, trip_ms = run(Set(GratingTexture(1.2), seconds=2.5, uplink=up, downlink=down)), up_ms + down_ms
    assert trip_ms == 0 or record.felt("direct").error > 0.3
    assert abs(record.lag_ms("local")) < 1 and record.felt("local").error < 0.01
    assert record.lag_ms("direct") == pytest.approx(trip_ms, abs=2) and record.late_ms == pytest.approx(trip_ms, abs=2)
    assert record.lost == {"local": 0.0, "direct": 0.0}
    # 250 readings of the hand a second go up; 50 messages and 1000 samples a second come down
    assert 2000 < record.bytes_per_s["local"] < 10_000 < record.bytes_per_s["direct"]
    # IPv4 and UDP add 28 bytes to each
    for name, number in (("local", 50), ("direct", 1000)):
        headers = record.with_headers[name] - record.bytes_per_s[name]
        assert headers == pytest.approx(28 * number, rel=0.06)
    assert np.isnan(record.wavelength_mm[0]) and record.wavelength_mm[-1] == pytest.approx(1.2, rel=0.01)


def test_two_gratings_reach_the_direct_display_first():
    texture = SideBySide(GratingTexture(1.0), GratingTexture(3.1), 146.0)
    record = run(Set(texture, HandMotion(97.0, 0.0), 3.0, downlink=LinkModel(one_way_ms=80)))
    assert record.change_ms("direct") == pytest.approx(80, abs=3)
    assert 80 < record.change_ms("local") < 1000
    assert math.isnan(record.lag_ms("local"))


def test_a_recorded_texture_takes_its_path_from_a_velocity_if_there_is_no_position():
    time = np.arange(1000) / 1000
    readings = np.sin(2 * np.pi * 20 * time / 1.7)[:, None]
    known = dict.fromkeys(("force_N", "velocity_mm_s", "position_mm", "tangential_N"))
    log = TimeLog(time, readings, ("g1",), **known, sample_rate_Hz=1000.0, report=LogReport(1000, 0, 0, 0, 0, 0, ()))
    moving = replace(log, velocity_mm_s=np.full(1000, 20.0))
    found, other = (RecordedTexture.of_log(one) for one in (moving, replace(log, position_mm=20 * time)))
    assert found.wavelength_mm == pytest.approx(1.7, rel=1e-3) == other.wavelength_mm
    assert found.reading(7.0, 20.0) == pytest.approx(other.reading(7.0, 20.0))
    with pytest.raises(InputError, match="needs a column position_mm or velocity_mm_s"):
        RecordedTexture.of_log(log)


@pytest.mark.parametrize("turn", [1, -1])
def test_a_recorded_texture_begins_with_the_first_place_of_the_stroke_and_ends_with_the_last(turn):
    place = turn * np.concatenate([np.linspace(0, 20, 801), np.linspace(20, 12, 300)[1:], np.full(5, 12.0)])
    texture = RecordedTexture(place, np.where(np.arange(place.size) % 2, 1.0, -1.0) + place)
    assert texture.reach_mm == ((0, 20) if turn == 1 else (-20, 0)) and texture.place.size == 801
    assert texture.value.mean() == pytest.approx(0, abs=1e-9) and (np.diff(texture.place) > 0).all()
    assert math.isnan(texture.reading(turn * 21.0, 0.0)) and abs(texture.reading(turn * 20.0, 0.0)) > 9
    smooth = RecordedTexture(place, 3 + np.sin(2 * np.pi * place / 1.7))
    assert smooth.wavelength_mm == pytest.approx(1.7, rel=0.01)
    assert smooth.reading(turn * 10.0, 0.0) == pytest.approx(math.sin(2 * math.pi * turn * 10 / 1.7), abs=0.05)
    for places in ([3.0], [math.nan] * 10, np.linspace(0, 3, 100)):
        with pytest.raises(InputError, match="longest stroke"):
            RecordedTexture(places, np.zeros(len(places)))


def test_noise_silence_and_a_hand_that_hardly_moves_tell_no_lag():
    rng = np.random.default_rng(0)
    assert math.isnan(lag_s(np.zeros(6000), HAND, HAND, 1000.0, 0.5))
    assert math.isnan(lag_s(rng.standard_normal(6000), HAND / 1.3, HAND, 1000.0, 0.5))
    slow = HAND / 100
    assert math.isnan(lag_s(np.sin(2 * np.pi * slow / 1.3), slow / 1.3, slow, 1000.0, 0.5))


def test_a_link_that_loses_everything_leaves_both_displays_silent():
    record = run(Set(GratingTexture(1.2), seconds=2, uplink=LinkModel(loss=1.0)))
    assert (record.local_um == 0).all() and (record.direct_um == 0).all()
    assert math.isnan(record.lag_ms("local")) and math.isnan(record.lag_ms("direct")) and math.isnan(record.late_ms)
    assert math.isnan(record.felt("local").error) and record.felt("local").silent == 1


def test_crossings_of_a_border_tell_how_long_the_old_texture_stays():
    truth = np.repeat([1.0, 2.0, 1.0], 100)
    shown = np.repeat([1.0, math.nan, 2.0, math.nan], [130, 20, 60, 90])
    blank = {name: None for name in LoopRecord._fields}
    record = LoopRecord(**(blank | {"truth_mm": truth, "wavelength_mm": shown, "direct_mm": truth}))
    np.testing.assert_array_equal(record.crossings("local"), [[30, 50], [10, math.nan]])
    assert record.stale_ms("local") == 30 and math.isnan(record.change_ms("local"))
    assert record.stale_ms("direct") == record.change_ms("direct") == 0
    # Within 10 % it is the new texture, and the old one until then
    near = record._replace(
        truth_mm=truth[:200], wavelength_mm=np.repeat([1.0, 1.095, 1.105, 1.7, 1.79, 1.81], [100, 7, 8, 9, 10, 66])
    )
    np.testing.assert_array_equal(near.crossings("local"), [[7, 34]])
    alone = record._replace(truth_mm=np.ones(300))
    assert math.isnan(alone.change_ms("local")) and math.isnan(alone.stale_ms("local"))
