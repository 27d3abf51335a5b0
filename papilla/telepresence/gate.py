"""Accepts messages that are authentic, well-formed, new, and from the peer's present run; counts and drops all others.

Each run of a process is a session with a random number. The numbers that we send are challenges: a session is accepted
when it echoes one that we sent after that session first appeared here, at most 5 s ago. What was recorded of a session
before it appeared cannot echo such a number, also if the session was known and is forgotten. A session that another one
replaced is not accepted again. So a restarted peer is accepted after one round trip, and clocks need not agree.
"""

import hmac
import math
import secrets
from collections import deque
from dataclasses import dataclass, fields
from typing import NamedTuple

import msgspec

from papilla.core.errors import InputError
from papilla.core.units import NS_PER_S
from papilla.telepresence.messages import MAX_BYTES, MESSAGE_VERSION, Header, Message, decode

MAC_BYTES = SHORTEST_KEY = 16
"""Bytes of a message's authentication code, and least of a key: 128 bits cannot be guessed."""
SESSION_BITS = 62
"""Length of a session's random number: it stays below the largest number of a message."""
FRESH_NS = 5 * NS_PER_S
"""Largest age of an echo that proves that a session is current."""
UNEVEN_NS, CONTRADICTING_TRIPS = 5_000_000, 3
"""A trip contradicts the offset if both differ by this many ns more than half of both trips, far more than clocks drift
meanwhile; and number of consecutive contradictions after which the peer's clock counts as having jumped."""
SHORTEST_TRIPS = 64
"""Number of round trips of which the shortest gives the offset of the clocks."""
MOST_APPLICANTS, MOST_REPLACED = 16, 64
"""Most sessions that wait to be accepted, and most replaced ones, that are remembered: a flood takes no more memory."""


@dataclass(eq=False)
class Counts:
    """Numbers of datagrams: accepted, and dropped for each cause."""

    accepted: int = 0
    foreign: int = 0
    oversize: int = 0
    forged: int = 0
    malformed: int = 0
    other_version: int = 0
    unproven: int = 0
    old: int = 0

    @property
    def dropped(self) -> int:
        """All datagrams that were not accepted."""
        return sum(getattr(self, field.name) for field in fields(self)) - self.accepted


class ClockOffset:
    """Offset of the peer's clock from ours, from the shortest of the last round trips (as in NTP, RFC 5905).

    The error is at most half of that round trip, and zero if both ways take equally long. If three consecutive trips
    contradict the offset, the peer's clock has jumped, and the offset is learnt again.
    """

    def __init__(self) -> None:
        self._trips: deque[tuple[int, int]] = deque(maxlen=SHORTEST_TRIPS)
        self._contradicted = 0

    def learn(self, round_trip_ns: int, offset_ns: int) -> None:
        """Use the round trip of one message."""
        if not 0 <= round_trip_ns <= FRESH_NS:
            return
        if self._trips:
            # The shortest trip waited least in queues, so it knows the offset best. Others may differ by half of both
            # trips.
            shortest, best_offset = min(self._trips)
            apart = abs(offset_ns - best_offset) > (round_trip_ns + shortest) // 2 + UNEVEN_NS
            self._contradicted = self._contradicted + 1 if apart else 0
            if self._contradicted >= CONTRADICTING_TRIPS:
                self._trips.clear()
                self._contradicted = 0
        self._trips.append((round_trip_ns, offset_ns))

    @property
    def round_trip_ns(self) -> float:
        """The shortest of the last round trips; NaN before the first."""
        return min(self._trips)[0] if self._trips else math.nan

    @property
    def offset_ns(self) -> float:
        """Peer's clock minus ours; NaN before the first round trip."""
        return min(self._trips)[1] if self._trips else math.nan


class Received(NamedTuple):
    """A message with its time of arrival on our clock, its time of sending on the peer's clock, and its age (NaN if the
    offset of the clocks is not known yet), all in ns."""

    message: Message
    arrived_ns: int
    sent_ns: int
    age_ns: float


class Applicant(NamedTuple):
    """A session that waits to be accepted. after_ns : our last number when it first appeared. header, at_ns : of its
    last message, and the time of arrival. hears_us : whether it has echoed a number of ours within 5 s."""

    after_ns: int
    header: Header
    at_ns: int
    hears_us: bool


class Gate:
    """Makes headers of outgoing messages, and checks incoming ones. It has no sockets; `udp.Endpoint` has them.

    key : shared secret of at least 16 bytes, for HMAC-SHA256 (cut to 16 bytes) before every message; None: none.
    Raises `InputError` for a shorter key.
    """

    def __init__(self, key: bytes | None = None):
        if key is not None and len(key) < SHORTEST_KEY:
            raise InputError(f"the key must have at least {SHORTEST_KEY} bytes, got {len(key)}")
        self._key, self.session = key, secrets.randbits(SESSION_BITS) + 1
        self.counts, self.offset = Counts(), ClockOffset()
        self._sequence = self._newest = 0
        self._sent_ns = -1
        self._peer: tuple[Header, int] | None = None
        self._applicants: dict[int, Applicant] = {}
        self._replaced: deque[int] = deque(maxlen=MOST_REPLACED)

    def header(self, now_ns: int) -> Header:
        """The header of the next message; it echoes the peer or, before one is accepted, the applicants in turn."""
        self._sequence += 1
        # Numbers rise also if the clock does not: the order of numbers is what proves a session.
        self._sent_ns = max(now_ns, self._sent_ns + 1)
        echo = (0, 0, 0)
        if (last := self._peer or self._next_applicant()) is not None:
            received, at_ns = last
            echo = (received.session, received.sent_ns, max(0, self._sent_ns - at_ns))
        return Header(MESSAGE_VERSION, self.session, self._sequence, self._sent_ns, *echo)

    def _next_applicant(self) -> tuple[Header, int] | None:
        """The last message of the applicant whose turn it is, and its time of arrival."""
        waiting = self._applicants
        if not waiting:
            return None
        session = next(iter(waiting))
        applicant = waiting.pop(session)
        # If all places are taken, one that does not hear us gives its place up: recordings do not keep others out.
        if applicant.hears_us or len(waiting) < MOST_APPLICANTS - 1:
            waiting[session] = applicant
        return applicant.header, applicant.at_ns

    def seal(self, data: bytes) -> bytes:
        """The datagram of an encoded message."""
        return data if self._key is None else self._mac(data) + data

    def _mac(self, data: bytes) -> bytes:
        return hmac.digest(self._key or b"", data, "sha256")[:MAC_BYTES]

    def admit(self, datagram: bytes, now_ns: int) -> Received | None:
        """The message of a datagram from the peer's address, or None; then the cause has been counted."""
        counts, data = self.counts, datagram
        # Cheap tests first, so that a flood costs little: size, key, form; the session and the number last.
        if len(datagram) > MAX_BYTES:
            counts.oversize += 1
            return None
        if self._key is not None:
            data = datagram[MAC_BYTES:]
            if not hmac.compare_digest(datagram[:MAC_BYTES], self._mac(data)):
                counts.forged += 1
                return None
        try:
            message = decode(data)
        except (msgspec.MsgspecError, ValueError, RecursionError) as error:
            if str(error).endswith("`$[1][0]`"):
                counts.other_version += 1
            else:
                counts.malformed += 1
            return None
        return self._judge(message, now_ns)

    def _judge(self, message: Message, now_ns: int) -> Received | None:
        """Accept a decoded message or count the reason against it: its session must be proven by an echo, its number
        new."""
        header, counts = message.header, self.counts
        # Our own message, sent back to us.
        if header.session == self.session:
            counts.forged += 1
            return None
        if self._peer is None or header.session != self._peer[0].session:
            if not self._proves(header, now_ns):
                counts.unproven += 1
                return None
            self._replace_peer()
        if header.sequence <= self._newest:
            counts.old += 1
            return None
        self._peer, self._newest = (header, now_ns), header.sequence
        if self._echoes(header, now_ns):
            # Time that the message spent on the wires: without the time for which the peer held our echo.
            trip = now_ns - header.echo_ns - header.held_ns
            self.offset.learn(trip, header.sent_ns - now_ns + trip // 2)
        counts.accepted += 1
        return Received(message, now_ns, header.sent_ns, now_ns + self.offset.offset_ns - header.sent_ns)

    def _echoes(self, header: Header, now_ns: int) -> bool:
        """Whether a message echoes a number that we sent in the last seconds."""
        return header.echo_session == self.session and now_ns - FRESH_NS <= header.echo_ns <= self._sent_ns

    def _proves(self, header: Header, now_ns: int) -> bool:
        """Whether a message of another session than the peer's proves that its sender runs now; else the session is an
        applicant."""
        if header.session in self._replaced:
            return False
        waiting, hears_us = self._applicants, self._echoes(header, now_ns)
        applicant = waiting.get(header.session)
        after_ns = self._sent_ns if applicant is None else applicant.after_ns
        if hears_us and header.echo_ns > after_ns:
            return True
        hears_us = hears_us or applicant is not None and applicant.hears_us
        # With a key, whoever hears us ran in the last seconds, so these are few; recordings only get free places.
        if hears_us or applicant is not None or len(waiting) < MOST_APPLICANTS:
            waiting[header.session] = Applicant(after_ns, header, now_ns, hears_us)
        if len(waiting) > MOST_APPLICANTS:
            del waiting[next(iter(waiting))]
        return False

    def _replace_peer(self) -> None:
        """Begin with a new session."""
        if self._peer is not None:
            self._replaced.append(self._peer[0].session)
        self._applicants.clear()
        self._newest, self.offset = 0, ClockOffset()
