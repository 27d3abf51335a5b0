"""The real link: UDP datagrams to and from one configured peer, without blocking."""

import socket
import time
from collections.abc import Callable
from typing import NamedTuple, Self

from papilla.core import outside
from papilla.core.errors import FileAccessError, InputError
from papilla.telepresence.gate import Gate, Received
from papilla.telepresence.messages import MAX_BYTES, Header, Message, encode

MOST_AT_ONCE = 64
"""Largest number of datagrams that one call reads, so that a flood cannot stop a control period."""


class Address(NamedTuple):
    """Numeric or named host, and port."""

    host: str
    port: int

    @classmethod
    def of(cls, text: str, name: str) -> "Address":
        """From `HOST:PORT` (an IPv6 host in brackets); raises `InputError`, which calls it `name`."""
        host, _, port = text.rpartition(":")
        if not host or not port.isascii() or not port.isdigit() or not 0 < int(port) < 65536:
            raise InputError(f"{name} must be HOST:PORT, like 127.0.0.1:47001, got {text!r}")
        return cls(host.strip("[]"), int(port))

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


class Endpoint:
    """One end of the link. Use it as a context manager.

    Parameters
    ----------
    listen, peer : our address, and the only address from which datagrams are accepted. key : see `Gate`; without one
    both addresses must be of this machine. clock : in ns, never decreasing.

    Raises `FileAccessError` if the address cannot be used, `InputError` for an unknown host, or for one of another
    machine without a key.
    """

    def __init__(
        self, listen: Address, peer: Address, key: bytes | None = None, clock: Callable[[], int] = time.monotonic_ns
    ):
        self.gate, self._clock = Gate(key), clock
        try:
            family, _, _, _, peer_address = socket.getaddrinfo(*peer, type=socket.SOCK_DGRAM)[0]
            *_, own_address = socket.getaddrinfo(*listen, family=family, type=socket.SOCK_DGRAM)[0]
        except (OSError, UnicodeError) as error:
            raise InputError(f"cannot find {peer} or {listen}: {getattr(error, 'strerror', None) or error}") from error
        self._peer: tuple = peer_address
        self.leaves_machine = not outside.is_this_machine(peer_address)
        if key is None and self.leaves_machine:
            raise InputError(
                f"the peer {peer} is another machine, which needs a key (--key-file): without one, anybody on the way "
                "can send messages; 127.0.0.1 needs none"
            )
        try:
            self._socket = outside.datagram_socket(family, own_address, keyed=key is not None)
        except OSError as error:
            raise FileAccessError(f"cannot listen at {listen}: {outside.reason(error)}") from error
        self.sent = self.unsent = self.bytes_sent = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self._socket.close()

    def now_ns(self) -> int:
        """Time in ns on the clock of this end."""
        return self._clock()

    def send(self, make: Callable[[Header], Message]) -> None:
        """Send the message that `make` builds with our next header; a message that the system refuses is counted."""
        datagram = self.gate.seal(encode(make(self.gate.header(self._clock()))))
        try:
            self._socket.sendto(datagram, self._peer)
        except OSError:
            # No route, no peer yet, or a full buffer: a datagram may be lost anyway.
            self.unsent += 1
            return
        self.sent += 1
        self.bytes_sent += len(datagram)

    def receive(self) -> list[Received]:
        """The accepted messages that have arrived, oldest first."""
        accepted = []
        for _ in range(MOST_AT_ONCE):
            try:
                datagram, sender = self._socket.recvfrom(MAX_BYTES + 1)
            except BlockingIOError:
                break
            except OSError:
                # The peer's port is closed (ICMP): this concerns what we sent, not what arrives.
                continue
            if sender[:2] != self._peer[:2]:
                self.gate.counts.foreign += 1
                continue
            received = self.gate.admit(datagram, self._clock())
            if received is not None:
                accepted.append(received)
        return accepted
