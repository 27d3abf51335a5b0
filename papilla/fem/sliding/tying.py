"""One press in three dimensions gives the length of a section along y, and the correction of its gauges at rest.

A plane under a line load deforms more than a finger under the same force, and its gauges strain differently. So the
finger is pressed in three dimensions on a rigid flat, by `papilla.fem.press`. At the depth of that press the section
carries the load p per mm. With the force F and the readings r_press of the press,

  length = F / p,    reading(t) = r_section(t) + (r_press - r_section(at rest)) p(t) / p.

So the change of the readings by a texture is that of the section (docs/adr/0034).
"""

from dataclasses import dataclass

import numpy as np

from papilla.core.errors import ContactRangeError
from papilla.core.progress import Progress, silent
from papilla.fem.preparing import prepare
from papilla.fem.pressing.fidelity import press
from papilla.fem.pressing.press import Press
from papilla.fem.sliding.coulomb import Laws, rub
from papilla.fem.sliding.section import ReducedSection
from papilla.model.finger import Finger
from papilla.model.specimen import Friction, HalfSpace

RIGID_FLAT = HalfSpace(1e4)
"""Specimen of the press in three dimensions: rigid compared with silicone, like textures."""


@dataclass(frozen=True, eq=False, repr=False)
class Tie:
    """A section beside a press in three dimensions; g gauges.

    press : of the finger on `RIGID_FLAT`. length_mm : along y, with which the section carries its force at its depth.
    load : of the section at that depth, N/mm. section_reading : (g,) of the section alone there, microstrain.
    """

    press: Press
    length_mm: float
    load: float
    section_reading: np.ndarray

    def __repr__(self) -> str:
        return f"Tie({self.length_mm:.4g} mm, gauges lack {np.round(self.lacking).tolist()} microstrain)"

    @property
    def lacking(self) -> np.ndarray:
        """(g,) readings in three dimensions minus those of the section, at rest, in microstrain."""
        return self.press.reading - self.section_reading

    def rows(self, body: ReducedSection) -> np.ndarray:
        """(g, 2n) readings in microstrain per N/mm on the section's nodes, with this correction."""
        rows = body.reading_rows
        rows[:, len(body.x) :] += self.lacking[:, None] / self.load
        return rows


def tie(
    finger: Finger,
    body: ReducedSection,
    *,
    force: float | None = None,
    indentation: float | None = None,
    friction: Friction | None = None,
    progress: Progress = silent,
) -> Tie:
    """Tie the section of a finger to its press by a force (N) or an indentation (mm).

    friction : of the press, as for `papilla.fem.press`. Raises what that raises, and `ContactRangeError` if the
    section's contact leaves its patch.
    """
    reduced = prepare(finger, progress=progress)
    pressed = press(reduced, RIGID_FLAT, force=force, indentation=indentation, friction=friction)
    n = len(body.x)
    none = np.zeros(2 * n)
    # The section at the depth of the press, without friction: the press's force over the section's load per mm is the
    # length.
    laws = Laws(body.compliance, body.z.max() - body.z, none[:n], 0.0, 0.0, none, depth=pressed.indentation)
    landed = rub(laws, np.zeros(n, dtype=np.int64))
    refuse_end(landed.force[n:], body)
    load = float(landed.force[n:].sum())
    return Tie(pressed, pressed.force / load, load, body.reading_rows @ landed.force)


def refuse_end(pressing: np.ndarray, body: ReducedSection) -> None:
    """Raise `ContactRangeError` for a contact, given by its pressing forces (n,), that reaches the end of its patch."""
    if pressing[0] > 0 or pressing[-1] > 0:
        raise ContactRangeError(
            f"the contact reaches the end of its patch, {body.half_width:.3g} mm from the apex: press less"
        )
