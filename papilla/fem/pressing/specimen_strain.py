"""What a flat specimen's own large strain changes in a press: in all of papilla's presses the specimen stays linear.

Under a mean pressure p a specimen of modulus E moves sideways by an amount of second order, (p/E)^2, which a linear one
does not. A skin that sticks to it hinders that movement; the stiffness of skin and specimen in series is
E_outer E / (E_outer + E), so the shears change, in units of the pressure, by

    s = p/E * E_outer / (E_outer + E).

What the gauges below the skin feel of it falls with the contact's radius over the thickness of the skin. So the change
of ln S_d is s times a straight line in that ratio, and all gauges change alike. Without friction nothing hinders the
movement, and hardly anything changes.

Both coefficients and all errors come from the axisymmetric reference, whose block is neo-Hookean or linear:
`python benchmarks/specimen_strain.py`.
"""

import math
from dataclasses import replace

from papilla.core.units import PER_CENT
from papilla.fem.pressing.press import Press

STUCK_CHANGE, STUCK_CHANGE_PER_RADIUS = 0.241, -0.162
"""Change of ln S_d of a press that sticks, over s: for a small contact, and for each thickness of the skin in the
contact's radius."""

SPECIMEN_ERROR_STUCK, SPECIMEN_ERROR_FREE = 0.09, 0.02
"""One sigma of ln S_d: with stick over s, without friction over p/E. On nine domes that the term was not fitted to
(`--draws 10 --seed 13`, p/E up to 0.11) the change with stick is 0.53 % rms and 2.5 % at worst; 0.21 and 0.9 % remain,
0.087 over s."""

SPECIMEN_ERROR_CURVED = 0.14
"""The same over p/E for a curved specimen, which has the compliance of a half-space also where its flanks are steep:
rms of four presses (`papilla verify --only revolution`). On a ball of 0.1 MPa and 10 mm radius, where p/E is 0.14, S_d
is 1.9 % too large without friction and 3.1 % stuck; on one of 0.5 MPa and 20 mm 0.1 % off."""

STATED_SPECIMEN_ERROR = 0.0015
"""This sigma, above which the status of a press states it."""


def specimen_change(
    strain: float, modulus: float, radius: float, skin: tuple[float, float], friction: float
) -> tuple[float, float]:
    """Change of ln S_d by the large strain of a flat specimen, and one sigma of it.

    strain : p/E. modulus : E, MPa. radius : of the contact, mm. skin : thickness (mm) and modulus (MPa) of the outer
    layer where the specimen touches. A press that partly slips is not changed, because nobody knows how much of the
    movement is hindered: its error holds all that stick would change.
    """
    thickness, outer = skin
    hindered = strain * outer / (outer + modulus)
    if not friction:
        return 0.0, SPECIMEN_ERROR_FREE * strain
    change, error = STUCK_CHANGE + STUCK_CHANGE_PER_RADIUS * radius / thickness, SPECIMEN_ERROR_STUCK
    if math.isinf(friction):
        return change * hindered, error * hindered
    return 0.0, math.hypot(error, change) * hindered


def with_specimen_strain(press: Press, skin: tuple[float, float], curved: bool = False) -> Press:
    """The press with the change by its specimen's own large strain, and the error that remains; `skin` as for
    `specimen_change`. A press of a curved specimen is not changed."""
    strain = press.force / (press.modulus * press.contact_area)
    radius = math.sqrt(press.contact_area / math.pi)
    change, error = specimen_change(strain, press.modulus, radius, skin, press.friction)
    if curved:
        change, error = 0.0, SPECIMEN_ERROR_CURVED * strain
    status = press.status
    if error > STATED_SPECIMEN_ERROR:
        status += f"; large strain of the specimen itself: S_d within {2 * PER_CENT * error:.1f} %"
    return replace(press, values=press.values * math.exp(change), specimen_error=error, status=status)
