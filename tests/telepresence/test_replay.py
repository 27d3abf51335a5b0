"""Recorded messages are not taken: not after a restart of either side, in no order, however many sessions were
recorded; and they do not keep the running session out."""

import heapq
import itertools
import pickle
import random

import pytest

from papilla.telepresence import Gate
from papilla.telepresence.messages import HandReading, Header, Length, encode, quantity

KEY = b"0123456789abcdef"
MS = 1_000_000
SIDES = ("sensor", "display")


def message(gate, now_ns, serial=0):
    """The next datagram of a gate."""
    return gate.seal(encode(HandReading(gate.header(now_ns), quantity(Length, float(serial)))))


class Lab:
    """Two gates that both send a message a ms, over a network that loses, repeats, delays and overtakes, and an
    attacker who records every datagram at its arrival, also a lost one.

    Messages carry serial numbers; `taken` has those that each side took. recorded : datagrams to each side. sent : the
    last serial number to each side.
    """

    def __init__(self, seed, delay_ms=(5, 5), loss=0.0, twice=0.0, key=KEY, start_ms=1000):
        self.rng, self.key, self.now, self.serials = random.Random(seed), key, start_ms * MS, itertools.count(1)
        self.delay_ms, self.loss, self.twice = delay_ms, loss, twice
        self.gates = {side: Gate(key) for side in SIDES}
        self.taken, self.recorded = ({side: [] for side in SIDES} for _ in range(2))
        self.sent, self.clock_ns = dict.fromkeys(SIDES, 0), dict.fromkeys(SIDES, 0)
        self.on_the_way, self.order = [], itertools.count()

    def restart(self, side):
        self.gates[side] = Gate(self.key)

    def deliver(self, side, datagram):
        """Whether this side takes a datagram now."""
        received = self.gates[side].admit(datagram, self.now + self.clock_ns[side])
        if received is not None:
            self.taken[side].append(int(received.message.position.value))
        return received is not None

    def run(self, ms, replays=0, silent=(), of=None):
        """So many ms, in each of which the attacker sends so many recorded datagrams to each side, out of `of`."""
        hoard = self.recorded if of is None else of
        for _ in range(ms):
            self.now += MS
            for side, other in (SIDES, SIDES[::-1]):
                if side in silent:
                    continue
                gate, serial = self.gates[side], next(self.serials)
                datagram = message(gate, self.now + self.clock_ns[side], serial)
                self.sent[other] = serial
                for _ in range(1 + (self.rng.random() < self.twice)):
                    arrives = self.now + round(self.rng.uniform(*self.delay_ms) * MS)
                    heapq.heappush(self.on_the_way, (arrives, next(self.order), other, datagram))
            while self.on_the_way and self.on_the_way[0][0] <= self.now:
                _, _, side, datagram = heapq.heappop(self.on_the_way)
                before = self.rng.randint(0, replays)
                self.replay(before, hoard)
                if self.rng.random() >= self.loss:
                    self.deliver(side, datagram)
                self.recorded[side].append(datagram)
                self.replay(replays - before, hoard)

    def replay(self, number, hoard):
        """So many recorded datagrams to each side, of this link the last ones as often as all others."""
        for side in SIDES:
            for _ in range(number if hoard[side] else 0):
                late = hoard is self.recorded and self.rng.random() < 0.5
                self.deliver(side, self.rng.choice(hoard[side][-50:] if late else hoard[side]))


@pytest.mark.parametrize("restarted", SIDES)
def test_of_a_recorded_session_nothing_is_taken_and_of_the_new_one_everything(restarted):
    lab = Lab(seed=1)
    lab.run(400)
    listener = SIDES[restarted == SIDES[0]]
    recorded = lab.recorded[listener][-300:]
    lab.restart(restarted)
    # Recorded messages come before the new session is heard, and while it is not accepted yet.
    for datagram in recorded[::10]:
        assert not lab.deliver(listener, datagram)
    lab.run(40, replays=1)
    replayed, new = 0, 0
    for datagram in recorded:
        before = len(lab.taken[listener])
        lab.run(1)
        new += len(lab.taken[listener]) - before
        replayed += lab.deliver(listener, datagram)
    assert (replayed, new) == (0, 300)


@pytest.mark.parametrize("seed", range(12))
def test_in_any_order_serial_numbers_of_what_is_taken_only_rise(seed):
    """Loss, repetition, overtaking, replay and restarts of both sides; and the last sessions find each other."""
    rng = random.Random(1000 + seed)
    slow = rng.choice([2, 10, 30])
    lab = Lab(seed, delay_ms=(1, slow), loss=rng.uniform(0, 0.4), twice=rng.uniform(0, 0.3))
    for _ in range(12):
        for side in SIDES:
            if rng.random() < 0.5:
                lab.restart(side)
        lab.run(rng.randrange(1, 150), replays=rng.randrange(3), silent=rng.choice([(), (), SIDES[:1], SIDES[1:]]))
    lab.run(15 * slow, replays=2)
    lab.loss, lab.delay_ms, taken = 0.0, (slow, slow), {side: len(lab.taken[side]) for side in SIDES}
    lab.run(200, replays=2)
    for side in SIDES:
        serials = lab.taken[side]
        assert all(earlier < later for earlier, later in itertools.pairwise(serials))
        assert len(serials) - taken[side] >= 200 - slow, "every message of the running session"


@pytest.mark.parametrize("first_contact", [False, True])
def test_many_recorded_sessions_do_not_keep_the_running_one_out(first_contact):
    """Three hundred recorded sessions of both sides, more than are remembered, forty datagrams for each true one."""
    hoard = {side: [] for side in SIDES}
    for seed in range(300):
        earlier = Lab(seed)
        earlier.run(20)
        for side in SIDES:
            hoard[side] += earlier.recorded[side]
    lab = Lab(seed=7)
    if not first_contact:
        lab.run(100)
        lab.restart("display")
    lab.run(2000, replays=40, of=hoard)
    for side in SIDES:
        assert lab.sent[side] - lab.taken[side][-1] <= 2 * 6, "the last message that can have arrived"
        assert len(lab.taken[side]) > 1000
        assert all(earlier < later for earlier, later in itertools.pairwise(lab.taken[side]))


def test_a_replaced_session_is_not_taken_again_even_while_it_runs():
    lab = Lab(seed=4)
    lab.run(40)
    old = lab.gates["display"]
    lab.restart("display")
    lab.run(40)
    for _ in range(20):
        lab.now += MS
        old.admit(message(lab.gates["sensor"], lab.now), lab.now)
        assert not lab.deliver("sensor", message(old, lab.now))
    before = len(lab.taken["sensor"])
    lab.run(40)
    assert len(lab.taken["sensor"]) == before + 40


def test_a_session_that_was_held_back_whole_is_not_taken_after_it_ended():
    """It echoes numbers of the last seconds, but from before it appeared here."""
    lab = Lab(seed=5)
    lab.run(40)
    lab.restart("display")
    held = lab.recorded["sensor"]
    held.clear()
    for _ in range(300):
        lab.now += MS
        speaker, hidden = lab.gates["sensor"], lab.gates["display"]
        hidden.admit(message(speaker, lab.now), lab.now)
        held.append(message(hidden, lab.now))
    assert not any(lab.deliver("sensor", datagram) for datagram in held)


def test_a_session_that_ended_before_it_was_accepted_is_not_taken_after_the_next_one():
    """Its answer to a number of ours was late, and its successor answered first."""
    lab = Lab(seed=9)
    lab.run(40)
    sensor, late = lab.gates["sensor"], Gate(KEY)
    assert not lab.deliver("sensor", message(late, lab.now))
    lab.now += MS
    late.admit(message(sensor, lab.now), lab.now)
    answer = message(late, lab.now)
    lab.restart("display")
    lab.run(40)
    assert lab.taken["sensor"][-1] > lab.sent["sensor"] - 20 and not lab.deliver("sensor", answer)


@pytest.mark.parametrize("jump_ms", [-20_000, -300, 300, 20_000])
def test_a_clock_that_jumps_lets_no_recording_in_and_keeps_no_session_out(jump_ms):
    lab = Lab(seed=6, start_ms=60_000)
    lab.run(100)
    lab.clock_ns["sensor"] = jump_ms * MS
    lab.run(100, replays=1)
    # Also after the new session appeared, and before it is accepted.
    lab.restart("display")
    lab.run(8, replays=1)
    lab.clock_ns["sensor"] = 0
    lab.run(100, replays=1)
    for side in SIDES:
        assert all(earlier < later for earlier, later in itertools.pairwise(lab.taken[side]))
        assert lab.sent[side] - lab.taken[side][-1] <= 2 * 6


@pytest.mark.parametrize("one_way_ms", [2, 20, 60])
def test_a_restarted_peer_is_accepted_a_round_trip_after_its_first_message(one_way_ms):
    lab = Lab(seed=8, delay_ms=(one_way_ms, one_way_ms))
    lab.run(10 * one_way_ms)
    lab.restart("display")
    began, serial = lab.now, lab.sent["sensor"]
    while not (lab.taken["sensor"] and lab.taken["sensor"][-1] > serial):
        lab.run(1)
    # One way until it appears, and the way of a number to it and back; both sides send every ms.
    assert (lab.now - began) / MS <= 3 * one_way_ms + 3
    serial = lab.sent["display"]
    while not lab.taken["display"][-1] > serial:
        lab.run(1)
    assert (lab.now - began) / MS <= 5 * one_way_ms + 6


def test_without_a_key_a_flood_of_sessions_takes_no_more_memory():
    gate, held = Gate(), []
    gate.header(10)
    for session in range(1, 20_001):
        header = Header(1, session, 1, 10, gate.session, 0, 0)
        gate.admit(encode(HandReading(header, quantity(Length, 0.0))), 10)
        if session in (1000, 20_000):
            held.append(len(pickle.dumps(vars(gate))))
    assert held[1] < 1.2 * held[0] and gate.counts.unproven == 20_000
