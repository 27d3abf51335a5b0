"""A press as a log over time, in the format of `papilla estimate`: in the air, loading at a constant rate, hold."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from papilla.fem import Press

RATE_HZ = 1000
AIR_S, LOADING_S, HELD_S = 0.2, 0.5, 0.5
"""Durations: the air gives the estimators the zero of the gauges; a hand loads a finger in about half a second."""
LIGHTEST_N = 0.01
"""Smallest force of a press: half of the force from which the estimators see contact."""


def write_touch_log(path: Path, whole: "Press", press: Callable[[float], "Press"], said: Callable[[str], None]) -> None:
    """Write the log that ends with the press `whole`; `press` makes the press of another force (N), `said` reports
    progress.

    Each row of the loading is a separate press, without creep and noise. Raises `FileAccessError`.
    """
    import numpy as np

    from papilla.tables import write_table

    count, loading = round((AIR_S + LOADING_S + HELD_S) * RATE_HZ), round(LOADING_S * RATE_HZ)
    time = np.arange(count) / RATE_HZ
    force = whole.force * np.clip((time - AIR_S) / LOADING_S, 0.0, 1.0)
    force[force < LIGHTEST_N] = 0.0
    rows = np.zeros((count, 1 + len(whole.reading)))
    rows[force == whole.force] = whole.indentation, *whole.reading
    partly = np.flatnonzero((force > 0) & (force < whole.force))[::-1]
    for done, row in enumerate(partly):
        said(f"loading, {done} of {loading} presses")
        # From the largest force on, because all presses share one contact path
        found = press(float(force[row]))
        rows[row] = found.indentation, *found.reading
    gauges = {f"g{number}": column for number, column in enumerate(rows.T[1:], start=1)}
    write_table(path, {"t_s": time, **gauges, "force_N": force, "indentation_mm": rows[:, 0]})
