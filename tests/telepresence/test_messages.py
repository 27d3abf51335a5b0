"""Messages: there and back unchanged, and nothing else gets in; sessions, keys, echoes and clocks."""

import math
import random

import msgspec
import pytest

from papilla.core.errors import InputError
from papilla.telepresence import Component, Gate, QuantityTrust
from papilla.telepresence.gate import ClockOffset, Counts
from papilla.telepresence.messages import (
    Area,
    Force,
    HandReading,
    Header,
    Length,
    Modulus,
    Parameters,
    Ratio,
    Samples,
    decode,
    encode,
    lines_of,
    quantity,
)

KEY = b"0123456789abcdef"
HEADER = Header(1, 5, 1, 10, 0, 0, 0)
LINES = (Component(1.2, 40.0, 0.01, 0.3), Component(3.0, 10.0))
FULL = Parameters(
    HEADER,
    int(QuantityTrust.OK),
    lines_of(LINES),
    quantity(Modulus, 0.3, 0.01),
    quantity(Ratio, 0.4),
    quantity(Ratio, math.nan),
    quantity(Area, 80.0, 2.0),
    quantity(Force, 0.5),
)


@pytest.mark.parametrize(
    "message", [FULL, HandReading(HEADER, quantity(Length, 3.0)), Samples(HEADER, 1_000_000, (1.0, -2.5))]
)
def test_a_message_comes_back_as_it_was(message):
    data = encode(message)
    assert decode(data) == message and len(data) < 400


def test_what_is_unknown_is_null_and_components_come_back():
    told = decode(encode(FULL))
    assert told.mu_static.value is None and told.mu_static.status == QuantityTrust.UNKNOWN
    assert told.components[0] == LINES[0] and math.isnan(told.components[1].wavelength_sigma_mm)


@pytest.mark.parametrize(
    "change",
    [
        lambda m: m[1].__setitem__(0, 2),
        lambda m: m[3][0][0].__setitem__(0, "m"),
        lambda m: m[3][0][0].__setitem__(1, math.nan),
        lambda m: m[3][0][0].__setitem__(1, math.inf),
        lambda m: m[3][0][0].__setitem__(2, -1.0),
        lambda m: m[3][0][0].__setitem__(3, 7),
        lambda m: m.__setitem__(3, m[3] * 9),
        lambda m: m[4].__setitem__(0, "kPa"),
        lambda m: m.append(1),
        lambda m: m.__setitem__(0, "X"),
        lambda m: m[1].__setitem__(2, -3),
    ],
)
def test_another_version_unit_size_or_a_number_that_is_none_is_refused(change):
    raw = msgspec.msgpack.decode(encode(FULL))
    change(raw)
    with pytest.raises((msgspec.MsgspecError, ValueError)):
        decode(msgspec.msgpack.encode(raw))


def meet(one, other, start_ns=0, rounds=3):
    """Both ends speak in turn; the last message that each let in."""
    heard = {}
    for number in range(rounds):
        for speaker, listener in ((one, other), (other, one)):
            now = start_ns + number * 1_000_000
            data = speaker.seal(encode(HandReading(speaker.header(now), quantity(Length, 1.0 + number))))
            heard[listener] = listener.admit(data, now)
    return heard


def test_each_refused_datagram_is_counted_once_under_its_cause():
    gate = Gate()
    refused = (b"\0" * 1201, b"\0" * 1200, b"", b"rubbish", reading(gate, 0))
    assert [gate.admit(data, 0) for data in refused] == [None] * 5
    assert (gate.counts.oversize, gate.counts.malformed, gate.counts.forged) == (1, 3, 1), "its own message comes back"


def test_a_number_that_is_not_new_is_old_and_hostile_datagrams_keep_nobody_out():
    rng, gate, peer = random.Random(7), Gate(KEY), Gate(KEY)
    meet(gate, peer)
    valid = peer.seal(reading(peer, 10**7))
    assert gate.admit(valid, 10**7) is not None and gate.admit(valid, 10**7) is None
    assert (gate.counts.accepted, gate.counts.old) == (3, 1)
    for _ in range(2000):
        hostile = bytearray(valid)
        for _ in range(rng.randrange(1, 6)):
            place = rng.randrange(len(hostile))
            hostile[place : place + rng.randrange(3)] = rng.randbytes(rng.randrange(1, 9))
        assert gate.admit(bytes(hostile), 10**7) is None
    assert gate.counts.accepted == 3 and gate.counts.dropped >= 2001
    assert all(meet(gate, peer, start_ns=10**8).values()), "the peer is still heard"


def test_round_trips_of_none_to_five_seconds_tell_the_clock_and_others_nothing():
    offset = ClockOffset()
    for trip in (-1, 5_000_000_001):
        offset.learn(trip, 7)
        assert math.isnan(offset.round_trip_ns)
    offset.learn(5_000_000_000, 7)
    assert offset.offset_ns == 7
    offset.learn(0, 9)
    assert (offset.round_trip_ns, offset.offset_ns) == (0, 9)


def test_without_the_key_nothing_is_heard():
    one, thief = Gate(KEY), Gate(b"another key of 16")
    assert all(heard is None for heard in meet(one, thief).values())
    assert one.counts.forged == 3 and one.counts.accepted == 0
    assert meet(one, Gate(None))[one] is None
    with pytest.raises(InputError, match="16 bytes"):
        Gate(b"short")


def reading(gate, now_ns):
    return encode(HandReading(gate.header(now_ns), quantity(Length, 1.0)))


@pytest.mark.parametrize(
    "after_ns, proves", [(-10_000, False), (-1, False), (0, True), (5_000_000_000, True), (5_000_000_001, False)]
)
def test_a_number_sent_after_a_session_appeared_proves_it_for_five_seconds(after_ns, proves):
    """The other session appears at 10 s; it echoes what was sent before that, after that, or what was never sent."""
    one, other, appeared = Gate(), Gate(), 10**10
    before = reading(one, appeared - 1000)
    assert one.admit(reading(other, appeared), appeared) is None
    number = appeared + 1000
    other.admit(before if after_ns == -1 else reading(one, number), appeared)
    header = other.header(appeared)
    if after_ns == -10_000:
        header = msgspec.structs.replace(header, echo_ns=number + 1)
    answer = encode(HandReading(header, quantity(Length, 1.0)))
    assert (one.admit(answer, number + max(after_ns, 0)) is not None) == proves
    assert one.counts.unproven == 2 - proves


def test_a_header_says_how_long_the_echoed_message_was_held():
    one, other = Gate(), Gate()
    assert one.admit(reading(other, 0), 500) is None
    first = one.header(1_000)
    assert (first.sequence, first.sent_ns, first.echo_session, first.echo_ns, first.held_ns) == (
        1, 1_000, other.session, 0, 500,
    )  # fmt: skip
    other.admit(encode(HandReading(first, quantity(Length, 1.0))), 4_000)
    answer = other.header(9_000)
    assert (answer.echo_session, answer.echo_ns, answer.held_ns) == (one.session, 1_000, 5_000)
    # 15 us there and back, of which 5 us held: 5 us each way, if both take as long
    heard = one.admit(encode(HandReading(answer, quantity(Length, 1.0))), 16_000)
    assert one.offset.round_trip_ns == 16_000 - 1_000 - 5_000
    assert one.offset.offset_ns == 9_000 - 16_000 + 5_000 and heard.age_ns == 5_000
    lonely = Gate().header(7)
    assert (lonely.sent_ns, lonely.echo_session, lonely.echo_ns, lonely.held_ns) == (7, 0, 0, 0)


def test_dropped_is_the_sum_of_all_causes():
    counts = Counts(accepted=1, foreign=2, oversize=3, forged=4, malformed=5, other_version=6, unproven=7, old=8)
    assert counts.dropped == 35


def test_another_version_is_counted_apart_from_what_is_malformed():
    raw, gate = msgspec.msgpack.decode(encode(FULL)), Gate()
    raw[1][0] = 2
    assert gate.admit(msgspec.msgpack.encode(raw), 0) is None
    raw[1][0], raw[1][1] = 1, -1
    assert gate.admit(msgspec.msgpack.encode(raw), 0) is None
    assert (gate.counts.other_version, gate.counts.malformed) == (1, 1)


def test_the_offset_of_clocks_is_right_to_half_the_shortest_round_trip_and_follows_a_jump():
    rng, offset = random.Random(1), ClockOffset()
    for truth in (3_000_000_000, -7_000_000_000):
        for _ in range(100):
            there, back = (rng.randrange(1_000_000, 30_000_000) for _ in range(2))
            offset.learn(there + back, truth + (there - back) // 2)
        assert abs(offset.offset_ns - truth) <= offset.round_trip_ns / 2
    assert math.isnan(ClockOffset().offset_ns)
    offset.learn(-5, 0)
    assert abs(offset.offset_ns + 7_000_000_000) < 30_000_000


@pytest.mark.parametrize("truth", [3_000_000_000, -3_000_000_000])
def test_the_shortest_round_trip_counts_until_64_others_have_come(truth):
    offset = ClockOffset()
    offset.learn(2_000_000, truth)
    for _ in range(63):
        # 20 ms there and 10 ms back: off by 5 ms, which a round trip of 30 ms explains
        offset.learn(30_000_000, truth + 5_000_000)
    assert (offset.round_trip_ns, offset.offset_ns) == (2_000_000, truth)
    offset.learn(30_000_000, truth + 5_000_000)
    assert (offset.round_trip_ns, offset.offset_ns) == (30_000_000, truth + 5_000_000)
