"""Presses over time: the rows that load the finger, and the work lost in a loop of loading and unloading.

Silicone dissipates energy, so a finger is calibrated on loading alone. In a log with `t_s`, consecutive rows on one
specimen are one touch. A row belongs to loading if its force exceeds that of the row before.
"""

from dataclasses import dataclass

import numpy as np

HELD = 0.005
"""Relative rise of the force between two rows up to which the force is held, not raised: noise of a force sensor."""

RETURNED = 0.2
"""Share of its largest force to which a touch must return for its loop to count as closed."""


@dataclass(frozen=True)
class Loop:
    """A touch with loading and unloading: modulus of the specimen (MPa), largest force (N), and the lost work.

    lost_N_mm : area of the loop of force over indentation. share : this area over the work of loading.
    """

    modulus_MPa: float
    force_N: float
    lost_N_mm: float
    share: float


def touches(modulus_MPa: np.ndarray) -> list[np.ndarray]:
    """Row numbers of each touch: consecutive rows on a specimen of one modulus."""
    starts = np.flatnonzero(np.diff(modulus_MPa) != 0) + 1
    return np.split(np.arange(len(modulus_MPa)), starts)


def loading(force_N: np.ndarray, modulus_MPa: np.ndarray) -> np.ndarray:
    """(n,) bool: rows with a higher force than the row before, and the first row of each touch."""
    found = np.zeros(len(force_N), bool)
    for rows in touches(modulus_MPa):
        force = force_N[rows]
        found[rows] = np.concatenate([[True], force[1:] > (1 + HELD) * force[:-1]])
    return found


def loops(force_N: np.ndarray, modulus_MPa: np.ndarray, indentation_mm: np.ndarray) -> tuple[Loop, ...]:
    """The loops of all touches that return to `RETURNED` of their largest force."""
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
