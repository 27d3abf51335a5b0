"""One control period of the sensor's and of the display's side, as processes of this machine: idle and under load."""

import json
import os
import socket
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

from papilla.errors import SolverError

BUSY = "while True: pass"
START_S = 1.5
"""By which the sensor outlives the display: it may take longer to start."""


class PeriodRow(NamedTuple):
    """A side under a load (busy processes beside it): periods run and missed; work of one in ms, and what of that it
    had the processor (the rest other processes had it); shortest round trip in ms."""

    side: str
    load: int
    periods: int
    missed: int
    p50_ms: float
    p99_9_ms: float
    busy_p50_ms: float
    busy_p99_9_ms: float
    round_trip_ms: float


def periods(seconds: float = 10.0, load: int | None = None, calibration: Path | None = None) -> list[PeriodRow]:
    """Run both sides at 1 kHz over loopback UDP, alone and beside `load` busy processes (one a core by default).

    calibration : of the sensor's finger, which then estimates softness and friction too. Raises `SolverError` where one
    of the processes fails.
    """
    loads = (0, os.cpu_count() or 1 if load is None else load)
    return [row for number in loads for row in _run(seconds, number, calibration)]


def _run(seconds: float, load: int, calibration: Path | None) -> list[PeriodRow]:
    ports = free_ports()
    with ExitStack() as stack:
        for _ in range(load):
            busy = subprocess.Popen([sys.executable, "-c", BUSY])
            stack.callback(busy.wait)
            stack.callback(busy.kill)
        both = {}
        for side, (listen, peer), longer in (("sensor", ports, START_S), ("display", ports[::-1], 0.0)):
            command = [sys.executable, "-m", "papilla", "telepresence", side, "--json"]
            command += ["--seconds", str(seconds + longer)]
            command += ["--listen", f"127.0.0.1:{listen}", "--peer", f"127.0.0.1:{peer}"]
            if side == "sensor" and calibration is not None:
                command += ["--calibration", str(calibration)]
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
    work, busy = told["work_ms"], told["busy_ms"]
    times = (work["p50"], work["p99.9"], busy["p50"], busy["p99.9"])
    return PeriodRow(side, load, told["periods"], told["missed"], *times, told["round_trip_ms"])


def free_ports() -> tuple[int, int]:
    """Two UDP ports of this machine that nobody listens at."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(2)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return sockets[0].getsockname()[1], sockets[1].getsockname()[1]
