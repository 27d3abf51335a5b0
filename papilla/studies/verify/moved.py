"""Shipped meshes moved into other fingers, against fresh meshes of these fingers by the mesher (docs/adr/0031).

No mesh is drawn here: `parameters.toml` holds what presses on two fresh meshes gave, the mean of both.
`python benchmarks/moved_meshes.py --stored` draws new ones and prints the table.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from papilla.errors import ContactRangeError
from papilla.fem import FingerModel, press
from papilla.finger import Dome, Finger, Shape, Slab
from papilla.mesh import build
from papilla.mesh.layered import LayeredMesh
from papilla.specimen import THICKNESS_MM, Block
from papilla.studies import parameters
from papilla.studies.case import Case
from papilla.studies.verify.bodies import off
from papilla.units import gf_to_newton

GIVEN = parameters.parameters(__name__)


def fingers() -> dict[str, Finger]:
    """A dome of revolution, a dome of half size with gauges elsewhere, and a slab."""
    return {name: _finger(**own) for name, own in GIVEN.fingers.items()}


def _finger(axes_mm, stored, depth_mm: float | None = None, gauges: Any = None) -> Finger:
    """The default finger of another shape, with gauges elsewhere; `stored` is what presses on it gave."""
    default = Finger.default()
    outer, interface, bone = axes_mm
    shape: Shape
    shape = Dome(outer, interface, bone) if depth_mm is None else Slab(outer, interface, bone, depth_mm)
    places = zip(default.gauges, gauges.angle_deg, gauges.y_mm, strict=True) if gauges else ()
    elsewhere = tuple(replace(gauge, angle_deg=angle, y_mm=y) for gauge, angle, y in places)
    return replace(default, shape=shape, gauges=elsewhere or default.gauges, ridges=None)


def moved() -> Iterator[Case]:
    """Linear presses on 0.15 MPa, without friction, on a moved mesh and on two fresh ones."""
    kept = GIVEN.fingers
    for name, finger in fingers().items():
        found = pressed(finger, build(finger))
        for row, stored, force_gf in zip(found, np.array(kept[name].stored), GIVEN.forces_gf, strict=True):
            errors = {
                "S_d": off(row[0], stored[0]),
                "gauges": float(np.abs(row[1:6] - stored[1:6]).max() / np.abs(stored[1:6]).max()),
                "indentation": off(row[6], stored[6]),
                "contact area": off(row[7], stored[7]),
            }
            if force_gf == GIVEN.lightest_gf:
                del errors["contact area"]
            for quantity, error in errors.items():
                slab_area = (name, quantity) == ("slab", "contact area")
                bound = GIVEN.slab_area_bound if slab_area else GIVEN.bounds[quantity]
                measure = f"{quantity} on a moved mesh against the mean of two fresh ones"
                yield Case(f"{name}, {force_gf:g} gf, {quantity}", measure, error, bound)


def pressed(
    finger: Finger, mesh: LayeredMesh, moduli_MPa: Sequence[float] = (GIVEN.modulus_MPa,), forces_gf=GIVEN.forces_gf
) -> np.ndarray:
    """(presses, 8) a row as `stored` for each modulus and force; NaN where the contact would leave its patch."""
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
