"""Measures what large strain changes: presses at finite strain, and linear ones on the same mesh, over force and area.

`python -m papilla.calibrate.large_strain` measures the default finger's geometry over five ratios of moduli and writes
the file that ships with the package; with `stuck` the presses in which nothing slips.
"""

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from papilla.errors import ContactRangeError, InputError, SolverError
from papilla.fem import FingerModel, Press, ReducedFinger
from papilla.fem.finite.newton import Linearisation
from papilla.fem.finite.pressing import Scene, press_path, result
from papilla.fem.finite.touching import STICK, Touching
from papilla.fem.pressing.fidelity import on_nodes
from papilla.fem.pressing.large_strain import (
    POWERS,
    SHIPPED,
    LargeStrain,
    ends_of,
    keep,
    known,
    shipped_text,
    tables_of,
)
from papilla.fem.reduction.gauges import gauge_weights
from papilla.files import write_text
from papilla.finger import Finger, Layer
from papilla.mesh import LayeredMesh, build
from papilla.specimen import STICK as STUCK
from papilla.specimen import Friction, friction_coefficient

FORCES = tuple(np.geomspace(0.9, 36.0, 6).tolist())
"""F / E_inner in mm2: of the default finger, 0.03 to 1.2 N."""

MODULI = (0.5, 1.5, 4.0, 10.0, 40.0, 1e4)
"""E / E_inner of the blocks that are pressed, of the default finger 0.017 MPa to rigid."""

RATIOS = (4.0, 2.0, 8.0, 1.0, 16.0)
"""E_outer / E_inner of the tables that ship."""

TOLERANCE = 1e-4
"""Relative residual of these presses at finite strain: S_d is then within 1e-5."""

Progress = Callable[[int, int], None]


def measure_large_strain(
    finger: Finger,
    mesh: LayeredMesh,
    *,
    friction: Friction = 0.0,
    forces: Sequence[float] = FORCES,
    moduli: Sequence[float] = MODULI,
    steps: Progress | None = None,
) -> LargeStrain:
    """The table of a finger on its mesh, pressed at the apex; `steps` is called with (presses done, presses in all).

    friction : 0, or "stick" for presses in which nothing slips. Presses that leave what either model covers are left
    out. Raises `InputError` where too few remain, and what reducing and factorising raise.
    """
    reduced, inner = FingerModel(finger, mesh).reduce(), finger.inner.modulus
    coefficient = friction_coefficient(friction)
    rows: list[tuple] = []
    loads = [force * inner for force in forces]
    for finite in finite_presses(finger, mesh, loads, [modulus * inner for modulus in moduli], friction, steps):
        touched = finger.bench.specimen(finite.modulus)
        try:
            # What the nodes lose, presses at finite strain lose too
            linear = on_nodes(reduced, touched, (finite.force, None), coefficient)
        except (ContactRangeError, SolverError):
            continue
        scaled = finite.force / inner, finite.modulus / inner
        rows.append((*scaled, _values(linear, inner), _values(finite, inner)))
    if len(rows) <= len(POWERS):
        raise InputError(f"only {len(rows)} of {len(forces) * len(moduli)} presses at finite strain can be made")
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return LargeStrain(finger.outer.modulus / inner, columns[0], columns[1], columns[2], columns[3], coefficient)


def finite_presses(
    finger: Finger,
    mesh: LayeredMesh,
    forces: Sequence[float],
    moduli: Sequence[float],
    friction: Friction,
    steps: Progress | None = None,
) -> Iterator[Press]:
    """Presses at finite strain by rising forces (N) on the bench's blocks of some moduli (MPa), as far as either model
    goes.

    Each force starts from the one before, and all share what was factorised: cheaper than as many `press_finite`.
    """
    held: Linearisation | None = None
    scene: Scene | None = None
    for count, modulus in enumerate(moduli):
        specimen, state = finger.bench.specimen(modulus), None
        if scene is None:
            scene = Scene.of(finger, mesh, specimen, {}, (0.0, 0.0), min(STICK, friction_coefficient(friction)))
        scene = replace(scene, touching=Touching(scene.touching.loaded, specimen, scene.touching.friction))
        for number, force in enumerate(forces, 1):
            began, share = perf_counter(), force / len(scene.touching.patch.images)
            try:
                state, *_, held = press_path(scene, share, None, start=state, held=held, tolerance=TOLERANCE)
                found = result(scene, state, force, "finite", began)
            except (ContactRangeError, SolverError):
                break
            finally:
                if steps is not None:
                    steps(count * len(forces) + number, len(forces) * len(moduli))
            yield found


def ensure_large_strain(
    finger: Finger, reduced: ReducedFinger, mesh: LayeredMesh, friction: Friction, steps: Progress | None = None
) -> str:
    """Make the tables of a finger for a friction, and keep them in the cache, unless they are known.

    Returns what to note where a finger has to do without, else nothing.
    """
    missing = "large strain is not included"
    if len(reduced.layers) < 2:
        return f"{missing}: the finger has no two layers below the apex"
    for stuck in ends_of(friction_coefficient(friction)):
        if not tables_of(reduced, stuck):
            try:
                made = measure_large_strain(finger, mesh, friction=STUCK if stuck else 0.0, steps=steps)
            except (InputError, SolverError) as error:
                return f"{missing}: {error}"
            keep(reduced.strain_key, [made])
    return ""


def _values(found: Press, inner: float) -> np.ndarray:
    return np.concatenate([[found.indentation, found.contact_area, found.peak_pressure / inner], found.values.ravel()])


def ship(stuck: bool = False) -> None:
    """Measure the default finger's geometry on its reference mesh and write the file that ships with the package.

    stuck : measure the presses in which nothing slips instead, and add them to the file.
    """
    finger = Finger.default()
    family = known(finger.strain_sha256)
    tables = [table for table in (family.tables if family else ()) if (table.friction == 0) == stuck]
    for ratio in RATIOS:
        one = replace(finger, outer=Layer(ratio * finger.inner.modulus, finger.outer.nu))
        began = perf_counter()
        table = measure_large_strain(one, build(one), friction=STUCK if stuck else 0.0)
        error = 100 * table.sd_error(gauge_weights(one))
        took = perf_counter() - began
        print(f"r = {ratio:g}: {len(table.force)} presses, S_d to {error:.2f} %, {took:.0f} s", flush=True)
        tables = sorted([*tables, table], key=lambda one: (one.friction, one.ratio))
        write_text(SHIPPED, shipped_text(finger.strain_sha256, tables))


if __name__ == "__main__":
    ship(stuck="stuck" in sys.argv)
