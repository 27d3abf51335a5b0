"""One control period of the sensor's and of the display's side, as processes of this machine: idle and under load."""

import itertools
import json
import os
import socket
import subprocess
import sys
import tracemalloc
from contextlib import ExitStack
from typing import Any, NamedTuple

from papilla.errors import SolverError

BUSY = "while True: pass"
START_S = 1.5
"""By which the sensor outlives the display: it may take longer to start."""


class PeriodRow(NamedTuple):
    """A side under a load (busy processes beside it): periods run and missed, work of one in ms, shortest round trip
    in ms."""

    side: str
    load: int
    periods: int
    missed: int
    p50_ms: float
    p99_9_ms: float
    round_trip_ms: float


def periods(seconds: float = 10.0, load: int | None = None) -> list[PeriodRow]:
    """Run both sides at 1 kHz over loopback UDP, alone and beside `load` busy processes (one a core by default).

    Raises `SolverError` where one of the processes fails.
    """
    loads = (0, os.cpu_count() or 1 if load is None else load)
    return [row for number in loads for row in _run(seconds, number)]


def _run(seconds: float, load: int) -> list[PeriodRow]:
    ports = _free_ports()
    with ExitStack() as stack:
        for _ in range(load):
            busy = subprocess.Popen([sys.executable, "-c", BUSY])
            stack.callback(busy.wait)
            stack.callback(busy.kill)
        both = {}
        for side, (listen, peer), longer in (("sensor", ports, START_S), ("display", ports[::-1], 0.0)):
            command = [
                sys.executable,
                "-m",
                "papilla",
                "telepresence",
                side,
                "--json",
                "--seconds",
                str(seconds + longer),
            ]
            command += ["--listen", f"127.0.0.1:{listen}", "--peer", f"127.0.0.1:{peer}"]
            both[side] = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            stack.callback(both[side].kill)
        rows = []
        for side, process in both.items():
            out, _ = process.communicate()
            if process.returncode:
                raise SolverError(f"papilla telepresence {side} ended with exit code {process.returncode}")
            rows.append(_row(side, load, json.loads(out)))
    return rows


def _row(side: str, load: int, told: dict[str, Any]) -> PeriodRow:
    work = told["work_ms"]
    return PeriodRow(side, load, told["periods"], told["missed"], work["p50"], work["p99.9"], told["round_trip_ms"])


def _free_ports() -> tuple[int, int]:
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(2)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return sockets[0].getsockname()[1], sockets[1].getsockname()[1]


def peaks_bytes(side: str, periods: int, warm_up: int) -> tuple[int, int]:
    """The most memory that Python holds within so many periods, and within as many more after them.

    They run one after the other without waiting; `side` is "sensor" or "display". What is kept for a while (windows,
    spectra) is full after `warm_up`.
    """
    from papilla.estimators import Pipeline
    from papilla.telepresence.components import Component
    from papilla.telepresence.gate import Gate
    from papilla.telepresence.local_model import LocalModel
    from papilla.telepresence.loop import Motion
    from papilla.telepresence.messages import encode
    from papilla.telepresence.sensing import Sensing
    from papilla.telepresence.texture import GratingTexture

    motion, texture, gate, peer = Motion(), GratingTexture(1.2), Gate(), Gate()
    sensing = Sensing(Pipeline(gauges=1, columns=("position_mm",)))
    model, peaks = LocalModel(), []

    def run_period(number: int) -> None:
        now, place = 1e-3 * number, float(motion.place_mm(1e-3 * number))
        if side == "sensor":
            sensing.update((now, texture.reading(place, 0.0), place))
            if number % 20 == 0:
                gate.admit(encode(sensing.parameters(peer.header(number * 10**6))), number * 10**6)
        else:
            model.move(now, place)
            model.learn(now, (Component(1.2, 50.0),))
            model.update(now)

    tracemalloc.start()
    try:
        for begin, end in itertools.pairwise((0, warm_up, warm_up + periods, warm_up + 2 * periods)):
            tracemalloc.reset_peak()
            for number in range(begin, end):
                run_period(number)
            peaks.append(tracemalloc.get_traced_memory()[1])
        return peaks[1], peaks[2]
    finally:
        tracemalloc.stop()
