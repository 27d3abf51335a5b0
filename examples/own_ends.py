"""Ends of your own: an encoder and an actuator at one, a finger at the other, in loops of 1 kHz.

    python examples/own_ends.py sensor      # in one terminal
    python examples/own_ends.py display     # in another

Put your hardware into `encoder_mm`, `drive` and `samples`; what stands there now are a hand that strokes, an actuator
that is not there, and a grating of 1.2 mm. Each end also talks to `papilla telepresence sensor` and `display`.
"""

import math
import sys
from collections.abc import Callable, Iterable

from papilla.estimators import Pipeline
from papilla.telepresence import Address, Endpoint, LocalModel, QuantityTrust, RemoteHand, Sensing
from papilla.telepresence.messages import HandReading, Length, Parameters, quantity
from papilla.telepresence.processes import TickGrid

SENSOR, DISPLAY = Address("127.0.0.1", 47001), Address("127.0.0.1", 47002)


def encoder_mm(now_s: float) -> float:
    """Where the hand is."""
    return 29.0 * (1 - math.cos(2 * math.pi * 1.07 * now_s))


def drive(volts: float) -> None:
    """What the actuator is given."""


def samples(now_s: float, place_mm: float) -> Iterable[tuple[float, float, float]]:
    """What the board has sampled since the last call: (t_s, gauge in microstrain, position_mm of the arm)."""
    yield now_s, 50 * math.cos(2 * math.pi * place_mm / 1.2), place_mm


def display(seconds: float, listen: Address, peer: Address, drive: Callable[[float], None] = drive) -> None:
    """Send the hand's place 250 times a second, and drive the actuator 1000 times."""
    model = LocalModel()
    with Endpoint(listen, peer) as link:
        for number, now in enumerate(TickGrid().ticks(seconds)):
            if number % 4 == 0:
                place = quantity(Length, encoder_mm(now))
                model.move(now, encoder_mm(now))
                link.send(lambda header, place=place: HandReading(header, place))
            for heard in link.receive():
                if isinstance(heard.message, Parameters):
                    model.learn(now, heard.message.components, QuantityTrust(heard.message.texture))
            drive(model.update(now).drive_V)


def sensor(seconds: float, listen: Address, peer: Address) -> None:
    """Follow the hand, estimate from every sample, and send what is found 50 times a second."""
    sensing, remote = Sensing(Pipeline(gauges=1, columns=("position_mm",))), RemoteHand()
    with Endpoint(listen, peer) as link:
        for number, now in enumerate(TickGrid().ticks(seconds)):
            for heard in link.receive():
                if isinstance(heard.message, HandReading) and heard.message.position.value is not None:
                    remote.read(1e-9 * heard.arrived_ns, 1e-9 * heard.sent_ns, heard.message.position.value)
            place, _ = remote.at(1e-9 * link.now_ns())
            if math.isfinite(place):
                for sample in samples(now, place):
                    sensing.update(sample)
            if number % 20 == 0:
                link.send(sensing.parameters)


if __name__ == "__main__":
    if sys.argv[1:] == ["sensor"]:
        sensor(math.inf, SENSOR, DISPLAY)
    elif sys.argv[1:] == ["display"]:
        display(math.inf, DISPLAY, SENSOR)
    else:
        sys.exit(__doc__)
