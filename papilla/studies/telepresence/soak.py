"""Control periods of one side, one after the other without waiting: does what it holds grow with time?"""

import gc
import math
import os
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from papilla import checks
from papilla.studies.telepresence.timing import free_ports
from papilla.telepresence.components import Component
from papilla.telepresence.local_model import LocalModel
from papilla.telepresence.messages import Force, HandReading, Length, Parameters, lines_of, quantity
from papilla.telepresence.motion import HAND_HZ, PARAMETERS_HZ, Motion
from papilla.telepresence.period import Period
from papilla.telepresence.processes import run_display, run_sensor
from papilla.telepresence.sources import TouchSource
from papilla.telepresence.texture import GratingTexture
from papilla.telepresence.touch import Touch
from papilla.telepresence.udp import Address, Endpoint

LOOKS = 50
"""At the memory, evenly over a run."""
WARM_UP, BLOCKS = 0.2, 10
"""Share of a run in which windows and the allocator's pools fill; means of the rest that a line is fitted to."""
STATM = Path("/proc/self/statm")


class SoakRow(NamedTuple):
    """A side: periods run, seconds they took, resident memory at the end in MB; growth in an hour of periods, with its
    standard deviation, of the resident memory in MB and of the objects that Python holds in blocks."""

    side: str
    periods: int
    seconds: float
    memory_MB: float
    growth_MB: float
    growth_sigma_MB: float
    growth_blocks: float
    growth_sigma_blocks: float


class Turned:
    """A clock that only goes on when somebody sleeps; then `between` is called with the ms that have passed."""

    def __init__(self, between: Callable[[int], None]):
        self._now, self._between = 10**12, between

    def __call__(self) -> int:
        """Its time in ns."""
        return self._now

    def sleep(self, seconds: float) -> None:
        """Be later."""
        self._now += max(1, round(1e9 * seconds))
        self._between((self._now - 10**12) // 10**6)


def soak(
    side: str,
    hours: float = 1.0,
    touch: Touch | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> SoakRow:
    """Run the code of `papilla telepresence sensor` or `display` on a clock that does not wait, over real sockets.

    The other end only says what there is to say: the hand 250 times a second, or lines of a texture 50 times. Its
    memory is in what is measured.

    Parameters
    ----------
    side : "sensor" or "display". hours : of its periods. touch : what a sensor samples; a grating by default.

    Raises `InputError` for hours that are not positive.
    """
    seconds = 3600 * checks.within("hours", hours, 1e-4, 1000)
    here, there = (Address("127.0.0.1", port) for port in free_ports())
    looks = np.full((LOOKS + 1, 3), math.nan)
    every, motion = max(1, round(1e3 * seconds / LOOKS)), Motion()

    def between(ms: int) -> None:
        if ms % every == 0:
            gc.collect()
            looks[min(ms // every, LOOKS)] = 1e-3 * ms, resident_MB(), sys.getallocatedblocks()
            progress(round(1e-3 * ms), round(seconds))
        other.receive()
        if side == "sensor" and ms % round(1e3 / HAND_HZ) == 0:
            place, force = (float(of(1e-3 * ms)) for of in (motion.place_mm, motion.force_N))
            other.send(partial(HandReading, position=quantity(Length, place), force=quantity(Force, force)))
        elif side == "display" and ms % round(1e3 / PARAMETERS_HZ) == 0:
            lines = lines_of((Component(1.2 + 0.1 * math.sin(1e-3 * ms), 50.0, 0.01, 1.0),))
            other.send(partial(Parameters, texture=0, lines=lines))

    clock = Turned(between)
    period, begun = Period(1e-3, clock, clock.sleep), time.perf_counter()
    with Endpoint(here, there, clock=clock) as own, Endpoint(there, here, clock=clock) as other:
        if side == "sensor":
            touch = Touch(GratingTexture(1.2)) if touch is None else touch
            run_sensor(own, TouchSource(touch), touch.sensing(), seconds=seconds, period=period)
        else:
            run_display(own, LocalModel(), motion, seconds=seconds, period=period)
    taken = time.perf_counter() - begun
    times, resident, blocks = looks[np.isfinite(looks[:, 0])].T
    grown, held = (growth(times / 3600, values) for values in (resident, blocks))
    return SoakRow(side, period.ticked, taken, float(resident[-1]), *grown, *held)


def growth(times, values) -> tuple[float, float]:
    """Slope (n,) values over (n,) times after the warm-up, and its standard deviation, by means of ten blocks.

    Neighbouring looks are alike; means of blocks are much less so, so their scatter tells the slope's.
    """
    kept = slice(round(WARM_UP * len(times)), None)
    x, y = ([part.mean() for part in np.array_split(np.asarray(own, float)[kept], BLOCKS)] for own in (times, values))
    (slope, _), covariance = np.polyfit(x, y, 1, cov=True)
    return float(slope), math.sqrt(covariance[0, 0])


def resident_MB() -> float:
    """Resident memory of this process; its peak where the system does not tell the present one, NaN on Windows."""
    try:
        return int(STATM.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") * 1e-6
    except OSError:
        pass
    try:
        import resource
    except ImportError:
        return math.nan
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1e-6 if sys.platform == "darwin" else 1e-3)
