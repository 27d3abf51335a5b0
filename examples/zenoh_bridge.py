"""Carry the telepresence link over zenoh instead of one UDP path, and show other programs what is touched.

    pip install eclipse-zenoh                  # no dependency of papilla
    papilla telepresence sensor                # machine A
    python examples/zenoh_bridge.py sensor     # machine A, beside it: stands for the display there
    python examples/zenoh_bridge.py display    # machine B: stands for the sensor
    papilla telepresence display               # machine B

Datagrams pass as they are, so sessions, echoes and the shared key (--key-file of both ends) work from end to end. Use a
key: zenoh as it comes lets anybody on the network join. The bridge itself listens on this machine alone.
What the sensor says is also published at KEY/parameters as JSON, in units and words, for a robot's other programs;
keyed datagrams are passed on without that, as the bridge does not have the key.
"""

import argparse
import contextlib
import json
import socket
import sys
from typing import Any

import msgspec

from papilla.core.errors import InputError
from papilla.core.outside import datagram_socket
from papilla.telepresence import Address, QuantityTrust
from papilla.telepresence.messages import MAX_BYTES, Parameters, TrustedQuantity, decode

PORTS = {"sensor": ("127.0.0.1:47002", "127.0.0.1:47001"), "display": ("127.0.0.1:47001", "127.0.0.1:47002")}
"""Where the bridge listens and whom it stands beside: the defaults of `papilla telepresence`."""


def plain(datagram: bytes) -> dict[str, Any] | None:
    """What a datagram of the sensor tells, as plain values; None for every other datagram."""
    try:
        message = decode(datagram)
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return None
    if not isinstance(message, Parameters):
        return None
    told: dict[str, Any] = {
        "sequence": message.header.sequence,
        "texture": QuantityTrust(message.texture).name.lower(),
        "lines": [
            {"wavelength_mm": _plain(line.wavelength), "amplitude_microstrain": _plain(line.amplitude)}
            for line in message.lines
        ],
    }
    names = {"modulus": "modulus_MPa", "area": "contact_area_mm2", "force": "force_N"}
    for name in ("modulus", "mu_kinetic", "mu_static", "area", "force"):
        if (one := getattr(message, name)) is not None:
            told[names.get(name, name)] = _plain(one)
    return told


def _plain(one: TrustedQuantity) -> dict[str, Any]:
    return {"value": one.value, "sigma": one.sigma, "status": QuantityTrust(one.status).name.lower()}


def carry(zenoh: Any, side: str, listen: Address, peer: Address, key: str) -> None:
    """Pass datagrams both ways until Ctrl-C: from the peer's UDP to KEY/from_SIDE, from KEY/from_OTHER to its UDP."""
    other = "display" if side == "sensor" else "sensor"
    own = socket.gethostbyname(listen.host), listen.port
    with zenoh.open(zenoh.Config()) as session, datagram_socket(socket.AF_INET, own, keyed=False) as udp:
        udp.setblocking(True)
        # No batching: a datagram that waits for others to fill a packet is late.
        soon = {
            "express": True,
            "priority": zenoh.Priority.REAL_TIME,
            "congestion_control": zenoh.CongestionControl.DROP,
        }
        away = session.declare_publisher(f"{key}/from_{side}", **soon)
        shown = session.declare_publisher(f"{key}/parameters") if side == "sensor" else None
        home = session.declare_subscriber(
            f"{key}/from_{other}", lambda sample: udp.sendto(sample.payload.to_bytes()[:MAX_BYTES], peer)
        )
        print(f"{side} at {peer} <-> {key}", file=sys.stderr)
        try:
            while True:
                try:
                    datagram, sender = udp.recvfrom(MAX_BYTES + 1)
                except ConnectionError:
                    continue  # ICMP: the peer is not there yet
                if sender[:2] != tuple(peer) or len(datagram) > MAX_BYTES:
                    continue
                away.put(datagram)
                if shown is not None and (told := plain(datagram)) is not None:
                    shown.put(json.dumps(told))
        finally:
            home.undeclare()


def main(arguments: list[str] | None = None) -> int:
    """The command; 2 where an option or the library is missing."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("side", choices=sorted(PORTS), help="the end of the link that runs on this machine")
    parser.add_argument("--listen", help="HOST:PORT that this end has as its --peer")
    parser.add_argument("--peer", help="HOST:PORT at which this end listens")
    parser.add_argument("--key", default="papilla/touch", help="zenoh key under which both bridges meet")
    options = parser.parse_args(arguments)
    try:
        import zenoh
    except ImportError:
        print("zenoh_bridge: the package eclipse-zenoh is missing: pip install eclipse-zenoh", file=sys.stderr)
        return 2
    listen, peer = PORTS[options.side]
    try:
        own, there = Address.of(options.listen or listen, "--listen"), Address.of(options.peer or peer, "--peer")
        with contextlib.suppress(KeyboardInterrupt):
            carry(zenoh, options.side, own, there, options.key)
    except (InputError, OSError, zenoh.ZError) as error:
        print(f"zenoh_bridge: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
