"""What is wrong with a channel (a gauge, or the force), as small integers and in words."""

from collections.abc import Sequence

from papilla.status import Status

BASE = 8
"""Faults of all channels make one integer, a digit of this base for each, the first gauge the lowest."""


class Fault(Status):
    """Why a channel is left out; `sentence` says it in words."""

    NONE = 0, "in use"
    MISSING = 1, "no reading"
    SATURATED = 2, "saturated"
    STUCK = 3, "stuck"
    OFF_SURFACE = 4, "contradicts the others"
    SIGN_FLIPPED = 5, "sign flipped"
    SWAPPED = 6, "swapped with another"


def pack(faults) -> int:
    """The faults of all channels as one integer."""
    code = 0
    for fault in reversed(faults):
        code = code * BASE + fault
    return code


def unpack(code: int, channels: int) -> list[Fault]:
    """The faults of all channels behind such an integer, the first gauge's first."""
    return [Fault(code // BASE**channel % BASE) for channel in range(channels)]


def numbered(gauges: int) -> tuple[str, ...]:
    """The names g1, g2 ... of so many gauges that have no names of their own."""
    return tuple(f"g{number}" for number in range(1, gauges + 1))


def in_words(code: int, gauges: Sequence[str]) -> str:
    """Such as "g3 left out: stuck, force left out: no reading", with the names of the gauges; the force is last."""
    faults = zip((*gauges, "force"), unpack(code, len(gauges) + 1), strict=True)
    return ", ".join(f"{name} left out: {fault.sentence}" for name, fault in faults if fault)
