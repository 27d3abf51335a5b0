"""Logs of a finger: gauge readings over time, and presses on specimens of known modulus.

Readings are in microstrain, with one column per gauge (`g1`, `g2`, ...). Other columns have the unit in their name.
"""

from papilla.logs.presses import PressLog, read_presses
from papilla.logs.statistics import white_noise
from papilla.logs.time_log import TIME_OPTIONAL, LogReport, TimeLog, TimeLogFile, read_time_log

__all__ = [
    "TIME_OPTIONAL", "PressLog", "LogReport", "TimeLog", "TimeLogFile", "read_presses", "read_time_log", "white_noise",
]  # fmt: skip
