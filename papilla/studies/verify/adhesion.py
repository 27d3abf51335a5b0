"""Contact with adhesion against the exact answer of Johnson, Kendall and Roberts."""

from collections.abc import Iterator

import numpy as np

from papilla.fem.pressing.adhesion import adhesive_press
from papilla.fem.pressing.fidelity import press
from papilla.finger import Layer
from papilla.studies.case import Case
from papilla.studies.verify.bodies import BALL, BALL_RADIUS, half_space, off

MODULUS, NU = 1.0, 0.3

PULLS = (0.1, 1.0)
"""Pull-off force of the ball, in forces that press it."""

BOUND = 0.03


def adhesion() -> Iterator[Case]:
    """A ball on a block of 600 contact radii, weakly and strongly adhesive."""
    reduced = half_space(Layer(MODULUS, NU)).reduce()
    e_star = MODULUS / (1 - NU**2)
    force = 4 / 3 * e_star * 0.5**3 / BALL_RADIUS
    for pull in PULLS:
        work = pull * force / (1.5 * np.pi * BALL_RADIUS)
        energy = 3 * np.pi * work * BALL_RADIUS
        held = force + energy + np.sqrt(2 * energy * force + energy**2)
        radius = (3 * held * BALL_RADIUS / (4 * e_star)) ** (1 / 3)
        depth = radius**2 / BALL_RADIUS - np.sqrt(2 * np.pi * work * radius / e_star)
        found = adhesive_press(reduced, BALL, 1e3 * work, force_N=force)
        name, against = f"ball with a pull-off force of {pull:g} of the load", "against JKR (exact solution)"
        plain = press(reduced, BALL, force=force, fidelity="contact")
        area = found.contact_area / plain.contact_area, (held / force) ** (2 / 3)
        yield Case(f"{name}, area", f"contact area over Hertz's {against}", off(*area), BOUND)
        hertz = (3 * force * BALL_RADIUS / (4 * e_star)) ** (2 / 3) / BALL_RADIUS
        lift = found.indentation / plain.indentation, depth / hertz
        yield Case(f"{name}, depth", f"indentation over Hertz's {against}", off(*lift), BOUND)
