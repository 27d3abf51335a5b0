"""A ball on silicone that relaxes, held in depth and by force, against the exact answer of Lee and Radok."""

from collections.abc import Iterator

import numpy as np

from papilla.fem.pressing.creep import creeping_press
from papilla.finger import Layer
from papilla.references import Prony, lee_radok_force, lee_radok_indentation
from papilla.studies.case import Case
from papilla.studies.verify.bodies import BALL, BALL_RADIUS, FEW_CHORDS, half_space, off

MODULUS, NU = 1.0, 0.3

SERIES = Prony((0.2, 0.25), (0.5, 5.0))
TIME = np.concatenate([np.linspace(0.02, 1, 50), np.linspace(1.1, 10, 90)])
"""A ramp of 1 s, and a hold of 9 s."""

DEEPEST = 1.0 / BALL_RADIUS
"""Indentation (mm) of a contact of radius 1 mm; the crept one is less."""

BOUND = 0.01


def creep() -> Iterator[Case]:
    """A ball on a block of 600 contact radii, pushed in and held, and loaded and held."""
    reduced = half_space(Layer(MODULUS, NU), FEW_CHORDS).reduce()
    e_star, ramp = MODULUS / (1 - NU**2), np.minimum(TIME, 1.0)
    late = TIME > 0.5
    depth = DEEPEST * ramp
    found, elastic = (creeping_press(reduced, BALL, one, TIME, indentation=depth) for one in (SERIES, Prony((), ())))
    exact = lee_radok_force(TIME, depth, BALL_RADIUS, e_star, SERIES)
    hertz = 4 / 3 * e_star * np.sqrt(BALL_RADIUS) * depth**1.5
    ratio = (found.force / elastic.force) / (exact / hertz)
    yield Case(
        "held depth", "force over the elastic one against Lee and Radok (exact solution)", _worst(ratio[late]), BOUND
    )
    force = 0.4 * hertz[-1] * ramp
    held = creeping_press(reduced, BALL, SERIES, TIME, force=force)
    told = lee_radok_indentation(TIME, force, BALL_RADIUS, e_star, SERIES)
    measure = "indentation after the hold against Lee and Radok (exact solution)"
    yield Case("held force", measure, off(float(held.indentation[-1]), float(told[-1])), BOUND)


def _worst(ratio: np.ndarray) -> float:
    return float(np.abs(ratio - 1).max())
