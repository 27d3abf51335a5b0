"""Shipped meshes moved into other fingers, against fresh meshes of these fingers by the mesher (docs/adr/0031).

No mesh is drawn here: `STORED` holds what presses on two fresh meshes gave, the mean of both.
`python benchmarks/moved_meshes.py --stored` draws new ones and prints the table.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from papilla.errors import ContactRangeError
from papilla.fem import FingerModel, press
from papilla.finger import Dome, Finger, Slab
from papilla.mesh import build
from papilla.mesh.layered import LayeredMesh
from papilla.specimen import THICKNESS_MM, Block
from papilla.studies.case import Case
from papilla.studies.verify.bodies import off
from papilla.units import gf_to_newton

MODULUS_MPA, FORCES_GF = 0.15, (10.0, 30.0)
GAUGE_ANGLES = (-55.0, -27.5, 0.0, 27.5, 55.0)
GAUGES_ALONG_MM = (0.0, 2.0, 0.0, 0.0, -2.0)
"""Gauges of the half-size dome: at the rim, and off the row (mm along the finger)."""

BOUNDS = {"S_d": 5e-3, "gauges": 1e-2, "indentation": 5e-3, "contact area": 0.02}
"""Two to four times the difference between new meshes of one finger (docs/results.md, "Meshes moved")."""
SLAB_AREA = 0.05
"""The same for the area on a slab, whose contact has few nodes along its depth: new meshes differ by 2.2 %."""

LIGHTEST_GF = 10.0
"""No area is compared here: a contact on the slab is few elements wide, and its area jumps by 7 % from mesh to mesh."""


def fingers() -> dict[str, Finger]:
    """A dome of revolution, a dome of half size with gauges elsewhere, and a slab."""
    default = Finger.default()
    half = Dome((12.0, 15.0, 10.0), (10.5, 13.5, 8.5), (5.0, 8.0, 3.0))
    places = zip(default.gauges, GAUGE_ANGLES, GAUGES_ALONG_MM, strict=True)
    elsewhere = tuple(replace(gauge, angle_deg=angle, y_mm=y) for gauge, angle, y in places)
    return {
        "dome of revolution": replace(
            default, shape=Dome((22.0, 22.0, 18.0), (19.5, 19.5, 15.5), (9.0, 9.0, 6.0)), ridges=None
        ),
        "half size, gauges elsewhere": replace(default, shape=half, gauges=elsewhere, ridges=None),
        "slab": replace(default, shape=Slab((24.0, 20.0), (22.0, 18.0), (10.0, 6.0), depth=14.0), ridges=None),
    }


STORED: dict[str, tuple[tuple[float, ...], ...]] = {
    "dome of revolution": (
        (9932.05, -1972.45, -6821.3, 19834.2, -6821.3, -1972.45, 0.350604, 27.5966),
        (18860.3, -6036.15, -17787.5, 33371.5, -17787.5, -6036.15, 0.709667, 62.2696),
    ),
    "half size, gauges elsewhere": (
        (16598.4, -3682.23, -9690.7, 33016.8, -13059.7, -3384.03, 0.39236, 22.9863),
        (29371.2, -11161.9, -25322.5, 51108.8, -31192.7, -10373.3, 0.751255, 50.0734),
    ),
    "slab": (
        (6588.09, -836.581, -2871.52, 14458.3, -2871.52, -836.581, 0.273495, 54.2313),
        (11769.5, -2671.56, -8822.07, 22862.1, -8822.07, -2671.56, 0.669817, 106.089),
    ),
}
"""A row for each force: S_d and the five gauges in microstrain, indentation in mm, contact area in mm²."""


def moved() -> Iterator[Case]:
    """Linear presses on 0.15 MPa, without friction, on a moved mesh and on two fresh ones."""
    for name, finger in fingers().items():
        found = pressed(finger, build(finger))
        for row, stored, force_gf in zip(found, np.array(STORED[name]), FORCES_GF, strict=True):
            errors = {
                "S_d": off(row[0], stored[0]),
                "gauges": float(np.abs(row[1:6] - stored[1:6]).max() / np.abs(stored[1:6]).max()),
                "indentation": off(row[6], stored[6]),
                "contact area": off(row[7], stored[7]),
            }
            if force_gf == LIGHTEST_GF:
                del errors["contact area"]
            for quantity, error in errors.items():
                bound = SLAB_AREA if (name, quantity) == ("slab", "contact area") else BOUNDS[quantity]
                measure = f"{quantity} on a moved mesh against the mean of two fresh ones"
                yield Case(f"{name}, {force_gf:g} gf, {quantity}", measure, error, bound)


def pressed(
    finger: Finger, mesh: LayeredMesh, moduli_MPa: Sequence[float] = (MODULUS_MPA,), forces_gf=FORCES_GF
) -> np.ndarray:
    """(presses, 8) a row as in `STORED` for each modulus and force; NaN where the contact would leave its patch."""
    reduced, rows = FingerModel(finger, mesh).reduce(), []
    for modulus, force_gf in product(moduli_MPa, forces_gf):
        block, force = Block(modulus, THICKNESS_MM), gf_to_newton(force_gf)
        try:
            found = press(reduced, block, force=force, fidelity="contact", friction=0.0)
        except ContactRangeError:
            rows.append([np.nan] * (3 + len(reduced.gauge_names)))
        else:
            rows.append([found.sd, *found.reading, found.indentation, found.contact_area])
    return np.array(rows)
