"""Presses of one finger over a grid of specimens and forces."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from papilla.errors import ContactRangeError, SolverError
from papilla.fem.pressing.fidelity import press
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.specimen import Friction, Specimen


def press_grid(
    reduced: ReducedFinger,
    specimens: Iterable[Specimen],
    forces: Sequence[float] | np.ndarray,
    friction: Friction | None,
) -> Iterator[tuple[Specimen, Press | ContactRangeError | SolverError]]:
    """Linear presses on specimens by rising forces (N). Yields the specimen and its press, or the error that refused
    it: all forces of a specimen, then the next specimen.

    Presses on one specimen share one contact path. The hardest press is made first, so the path is long enough for all
    others; in rising order it would have to be extended again and again.
    """
    for touched in specimens:
        found: list[Press | ContactRangeError | SolverError] = []
        for force in map(float, reversed(forces)):
            try:
                # Of specimens that are far softer or harder than the finger
                with np.errstate(over="ignore"):
                    found.append(press(reduced, touched, force=force, fidelity="contact", friction=friction))
            except (ContactRangeError, SolverError) as error:
                found.append(error)
        yield from ((touched, one) for one in reversed(found))
