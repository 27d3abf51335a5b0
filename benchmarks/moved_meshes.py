"""Shipped meshes moved into other fingers, against fresh ones of the mesher: presses, mesh scatter and price.

`python benchmarks/moved_meshes.py [--shapes NAME ...] [--drawn N] [--variants N] [--stored]`

Presses of 10 to 100 gf on blocks of 0.05 to 0.5 MPa, linear and without friction. Columns: root mean square over the
presses of the relative difference between the moved meshes' mean and the drawn meshes' mean, for S_d, gauges (over the
largest reading of a press), indentation and contact area; in brackets how far single moved and single drawn meshes
scatter about their own mean. Last: worst mean ratio, processor seconds of a moved and of a drawn mesh. --stored prints
what `papilla verify --only moved` compares with instead.
"""

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from papilla import Finger
from papilla.mesh import DEFAULT_SIZE_MM, build, quality
from papilla.mesh.drawing import drawn
from papilla.model.finger import Dome, Shape, Slab
from papilla.verify import meshes as verified

FORCES_GF, MODULI_MPA = (10.0, 30.0, 60.0, 100.0), (0.05, 0.15, 0.5)
SHAPES: dict[str, Shape] = {
    "shipped": Dome((24.0, 30.0, 20.0), (21.0, 27.0, 17.0), (10.0, 16.0, 6.0)),
    "half size": Dome((12.0, 15.0, 10.0), (10.5, 13.5, 8.5), (5.0, 8.0, 3.0)),
    "double size": Dome((48.0, 60.0, 40.0), (42.0, 54.0, 34.0), (20.0, 32.0, 12.0)),
    "skin 1.5 mm": Dome((24.0, 30.0, 20.0), (22.5, 28.5, 18.5), (10.0, 16.0, 6.0)),
    "skin 5 mm": Dome((24.0, 30.0, 20.0), (19.0, 25.0, 15.0), (10.0, 16.0, 6.0)),
    "bone flat": Dome((24.0, 30.0, 20.0), (21.0, 27.0, 17.0), (10.0, 16.0, 3.0)),
    "bone 3 mm below": Dome((24.0, 30.0, 20.0), (21.0, 27.0, 17.0), (10.0, 16.0, 14.0)),
    "flat": Dome((24.0, 30.0, 15.0), (21.0, 27.0, 12.0), (10.0, 16.0, 4.0)),
    "narrow": Dome((18.0, 30.0, 20.0), (15.0, 27.0, 17.0), (8.0, 16.0, 6.0)),
    "of revolution": Dome((24.0, 24.0, 20.0), (21.0, 21.0, 17.0), (10.0, 10.0, 6.0)),
    "slab": Slab((24.0, 20.0), (22.0, 18.0), (10.0, 6.0), depth=14.0),
}


def fingers() -> dict[str, Finger]:
    """The fingers that are compared; the last two have gauges elsewhere."""
    default = Finger.default()
    found = {name: replace(default, shape=shape) for name, shape in SHAPES.items()}
    wide = tuple(replace(gauge, angle_deg=1.375 * (gauge.angle_deg or 0.0)) for gauge in default.gauges)
    beside = tuple(replace(gauge, y_mm=6.0) for gauge in default.gauges)
    return found | {"gauges to 55 deg": replace(default, gauges=wide), "gauges off": replace(default, gauges=beside)}


def compared(finger: Finger, drawings: int, variants: int, size_mm: float, forces_gf: Sequence[float]) -> str:
    """The line of a finger."""
    kinds, seconds, worst = [], [], 1.0
    for make, count in ((build, variants), (drawn, drawings)):
        before, meshes = time.process_time() + _children(), []
        for variant in range(count):
            meshes.append(make(finger, size_mm, variant=variant))
        seconds.append((time.process_time() + _children() - before) / count)
        kinds.append(np.array([verified.pressed(finger, mesh, MODULI_MPA, forces_gf) for mesh in meshes]))
        if make is build:
            worst = min(quality(mesh)["mean_ratio_min"] for mesh in meshes)
    middle = kinds[1].mean(axis=0)
    scale = np.abs(middle)
    scale[:, 1:6] = scale[:, 1:6].max(axis=1, keepdims=True)
    apart = (kinds[0].mean(axis=0) - middle) / scale
    own = [(kind - kind.mean(axis=0)) / scale * np.sqrt(len(kind) / max(len(kind) - 1, 1)) for kind in kinds]
    parts = []
    for columns in (slice(0, 1), slice(1, 6), slice(6, 7), slice(7, 8)):
        difference, *scatter = (100 * np.sqrt(np.nanmean(part[..., columns] ** 2)) for part in (apart, *own))
        parts.append(f"{difference:5.2f} ({scatter[0]:.2f} {scatter[1]:.2f})")
    return " ".join(parts) + f"  {worst:.2f}  {seconds[0]:.2f} {seconds[1]:.1f}"


def _children() -> float:
    import resource

    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Press on moved and on fresh meshes, and print a row a shape."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shapes", nargs="*", default=list(fingers()), choices=list(fingers()))
    parser.add_argument("--drawn", type=int, default=2, help="fresh meshes a finger")
    parser.add_argument("--variants", type=int, default=2, help="shipped meshes a finger")
    parser.add_argument("--size-mm", type=float, default=DEFAULT_SIZE_MM)
    parser.add_argument("--forces-gf", nargs="*", type=float, default=FORCES_GF)
    parser.add_argument("--stored", action="store_true", help="print presses on fresh meshes, as `verify` stores them")
    given = parser.parse_args()
    for name, finger in verified.fingers().items() if given.stored else ():
        fresh = [
            verified.pressed(finger, drawn(finger, given.size_mm, variant=number)) for number in range(given.drawn)
        ]
        print(name, np.array2string(np.mean(fresh, axis=0), precision=6, separator=", "), flush=True)
    if given.stored:
        return
    print(
        f"{'finger':18s} {'S_d %':>17s} {'gauges %':>17s} {'indentation %':>17s} {'area %':>17s}  worst  s moved drawn"
    )
    for name in given.shapes:
        print(
            f"{name:18s} {compared(fingers()[name], given.drawn, given.variants, given.size_mm, given.forces_gf)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
