"""All that the five-gauge estimator remembers."""

import math
from dataclasses import dataclass

from papilla.estimators.softness.suspects import Search


@dataclass(frozen=True)
class GaugeState:
    """A value that can be kept and set again; g gauges.

    level : weighted mean of h, the distance along the readings' curve; information : sum of the weights; squares : the
    variance of `level` from noise times information^2; systematic : what one sigma of each group's calibration error
    moves `level` by, times information; samples : how many were learnt; linearised : ln E where samples are linearised,
    NaN before the first.
    last, repeats : readings of the last sample, and how often each gauge has repeated itself while another moved.
    faults, returning : per channel (g gauges and the force) the standing `Fault`, and good samples in a row since.
    search : how far the search for bad channels has come.
    near : force (N) and position (mm) of the last sample, where positions are unknowns.
    """

    level: float = 0.0
    information: float = 0.0
    squares: float = 0.0
    systematic: tuple[float, ...] = ()
    samples: float = 0.0
    linearised: float = math.nan
    last: tuple[float, ...] = ()
    repeats: tuple[int, ...] = ()
    faults: tuple[int, ...] = ()
    returning: tuple[int, ...] = ()
    search: Search = Search()
    near: tuple[float, ...] = ()
