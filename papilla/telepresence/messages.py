"""The messages: a few quantities, each with its unit, standard deviation and status, in at most `MAX_BYTES`.

Messages are msgspec structs in MessagePack. The unit of a quantity is the tag of its type, so a message in other units
cannot be decoded. Numbers are bounded, so they are finite; a missing value is null, never NaN.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Literal, TypeVar

import msgspec
from msgspec import Meta, Struct

from papilla.core.outside import message_decoder
from papilla.core.status import Named


class QuantityTrust(Named):
    """How far a quantity of a message may be used.

    HELD: the value of an earlier message still holds. DOUBTED: there is a value with the right sigma, but its estimator
    adds a note to "ok": not identifiable, some channels left out, slid one way only.
    """

    OK = 0
    HELD = 1
    UNKNOWN = 2
    DOUBTED = 3


MAX_LINES = 8
"""Largest number of lines of a texture, in a message and in a display."""


@dataclass(frozen=True)
class Component:
    """A line of the texture.

    wavelength_mm, amplitude_microstrain : of the line. Their sigma: standard deviations, NaN if not known.
    """

    wavelength_mm: float
    amplitude_microstrain: float
    wavelength_sigma_mm: float = math.nan
    amplitude_sigma_microstrain: float = math.nan

    @property
    def usable(self) -> bool:
        """Whether the component can be displayed."""
        return 0 < self.wavelength_mm < math.inf and 0 <= self.amplitude_microstrain < math.inf


def strongest(components: tuple[Component, ...], number: int) -> tuple[Component, ...]:
    """The `number` strongest usable components in the order of eq. (7) of Okamoto et al. 2011, A_i > A_j for i < j."""
    usable = [component for component in components if component.usable]
    return tuple(sorted(usable, key=lambda component: -component.amplitude_microstrain)[:number])


MESSAGE_VERSION: Literal[1] = 1
MAX_BYTES = 1200
"""Largest datagram, which no usual network path fragments."""
MAX_SAMPLES = 100
"""Most readings of a message, 0.1 s of them: more would exceed `MAX_BYTES`."""

LARGEST_SENT = 1e9
"""Largest number in a message, in any unit: a forged one then cannot overflow what is computed from it."""
_Value = Annotated[float, Meta(ge=-LARGEST_SENT, le=LARGEST_SENT)]
_Sigma = Annotated[float, Meta(ge=0, le=LARGEST_SENT)]
_Count = Annotated[int, Meta(ge=0, le=2**63 - 1)]


class _Sent(Struct, array_like=True, frozen=True, forbid_unknown_fields=True, gc=False):
    """How all parts of a message are encoded: as arrays, in which a field too many is an error."""


class TrustedQuantity(_Sent, frozen=True):
    """value and sigma (null if there is none), status : a `QuantityTrust`."""

    value: _Value | None
    sigma: _Sigma | None
    status: Annotated[int, Meta(ge=0, le=int(QuantityTrust.DOUBTED))]


class Length(TrustedQuantity, frozen=True, tag="mm"):
    """A length in mm."""


class Strain(TrustedQuantity, frozen=True, tag="uE"):
    """A strain in microstrain."""


class Modulus(TrustedQuantity, frozen=True, tag="MPa"):
    """A modulus in MPa."""


class Ratio(TrustedQuantity, frozen=True, tag="1"):
    """A dimensionless number, such as a coefficient of friction."""


class Area(TrustedQuantity, frozen=True, tag="mm2"):
    """An area in mm2."""


class Force(TrustedQuantity, frozen=True, tag="N"):
    """A force in N."""


class Header(_Sent, frozen=True):
    """The sender's run, the number of the message, and the proof that the sender receives ours.

    version : of the messages. session : random, of the sender's run. sequence : counts from 1 in it. sent_ns : on the
    sender's clock. echo_session, echo_ns : session and sent_ns of the last message that the sender had from the
    receiver (0 for none). held_ns : time from its arrival to sent_ns.
    """

    version: Literal[1]
    session: _Count
    sequence: _Count
    sent_ns: _Count
    echo_session: _Count
    echo_ns: _Count
    held_ns: _Count


class TextureLine(_Sent, frozen=True):
    """A component of the texture."""

    wavelength: Length
    amplitude: Strain


class Parameters(_Sent, frozen=True, tag="P"):
    """From the sensor: properties of the touched surface. `texture` is the `QuantityTrust` of the lines, strongest
    first."""

    header: Header
    texture: Annotated[int, Meta(ge=0, le=int(QuantityTrust.UNKNOWN))]
    lines: Annotated[tuple[TextureLine, ...], Meta(max_length=MAX_LINES)]
    modulus: Modulus | None = None
    mu_kinetic: Ratio | None = None
    mu_static: Ratio | None = None
    area: Area | None = None
    force: Force | None = None

    @property
    def components(self) -> tuple[Component, ...]:
        """The lines that have a wavelength and an amplitude."""
        return tuple(
            Component(line.wavelength.value, line.amplitude.value, _known(line.wavelength), _known(line.amplitude))
            for line in self.lines
            if line.wavelength.value is not None and line.amplitude.value is not None
        )


class HandReading(_Sent, frozen=True, tag="H"):
    """From the display: place of the hand and, if it is measured, its force."""

    header: Header
    position: Length
    force: Force | None = None


class Samples(_Sent, frozen=True, tag="S"):
    """From the sensor, for direct feedback: readings of one gauge at equal time steps, the last one at sent_ns."""

    header: Header
    period_ns: _Count
    readings: Annotated[tuple[_Value, ...], Meta(max_length=MAX_SAMPLES)]
    unit: Literal["uE"] = "uE"
    sigma: _Sigma | None = None


Message = Parameters | HandReading | Samples
_Any = TypeVar("_Any", bound=TrustedQuantity)

_encoder = msgspec.msgpack.Encoder()
encode = _encoder.encode
"""The bytes of a message."""
decode: Callable[[bytes], Message] = message_decoder(Message, MAX_BYTES)
"""The message in these bytes; raises `msgspec.MsgspecError`, another ValueError or RecursionError for anything else."""


def quantity(kind: type[_Any], value: float, sigma: float = math.nan, trust: QuantityTrust = QuantityTrust.OK) -> _Any:
    """A quantity from a number that may be NaN, which means unknown."""
    if not math.isfinite(value):
        return kind(None, None, int(QuantityTrust.UNKNOWN))
    return kind(value, sigma if math.isfinite(sigma) else None, int(trust))


def lines_of(components: tuple[Component, ...]) -> tuple[TextureLine, ...]:
    """Components in the form of messages."""
    return tuple(
        TextureLine(
            quantity(Length, component.wavelength_mm, component.wavelength_sigma_mm),
            quantity(Strain, component.amplitude_microstrain, component.amplitude_sigma_microstrain),
        )
        for component in components[:MAX_LINES]
    )


def _known(quantity: TrustedQuantity) -> float:
    return math.nan if quantity.sigma is None else quantity.sigma
