"""Presses over time: which rows of a log load the finger, and what a loop of loading and unloading lost.

Silicone gives back less than it took, so a finger is calibrated on loading alone. With `t_s` the rows of one specimen
are taken to be one touch, sampled: a row loads where its force is above that of the row before.
"""

from dataclasses import dataclass

import numpy as np

HELD = 0.005
"""Relative change of force between two rows below which it is held."""

RETURNED = 0.2
"""Share of its largest force to which a touch must come back for its loop to be told."""


@dataclass(frozen=True)
class Loop:
    """A touch that was loaded and unloaded: modulus of its specimen (MPa), largest force (N), and the work it lost.

    lost_N_mm : area of the loop of force over indentation; share : of the work that loading took.
    """

    modulus_MPa: float
    force_N: float
    lost_N_mm: float
    share: float


def touches(modulus_MPa: np.ndarray) -> list[np.ndarray]:
    """Row numbers of each run of rows on one specimen."""
    starts = np.flatnonzero(np.diff(modulus_MPa) != 0) + 1
    return np.split(np.arange(len(modulus_MPa)), starts)


def loading(force_N: np.ndarray, modulus_MPa: np.ndarray) -> np.ndarray:
    """(n,) bool: rows whose force rose from the row before, and the first of each touch."""
    found = np.zeros(len(force_N), bool)
    for rows in touches(modulus_MPa):
        force = force_N[rows]
        found[rows] = np.concatenate([[True], force[1:] > (1 + HELD) * force[:-1]])
    return found


def loops(force_N: np.ndarray, modulus_MPa: np.ndarray, indentation_mm: np.ndarray) -> tuple[Loop, ...]:
    """The loops of all touches that come back to `RETURNED` of their largest force."""
    found = []
    for rows in touches(modulus_MPa):
        force, depth = force_N[rows], indentation_mm[rows]
        top = int(np.argmax(force))
        if len(rows) < 4 or top == 0 or force[-1] > RETURNED * force[top]:
            continue
        taken = float(np.trapezoid(force[: top + 1], depth[: top + 1]))
        given = -float(np.trapezoid(force[top:], depth[top:]))
        if taken > 0:
            found.append(Loop(float(modulus_MPa[rows[0]]), float(force[top]), taken - given, (taken - given) / taken))
    return tuple(found)
