"""Measures errors and costs of each fidelity of a finger at a few forces, and keeps them for `fidelity="auto"`.

`python benchmarks/shipped_tables.py prices` measures the default finger and writes the file that ships.
"""

from contextlib import suppress
from time import perf_counter

import numpy as np

from papilla.core.errors import ContactRangeError
from papilla.core.progress import Progress, silent
from papilla.core.units import gf_to_newton
from papilla.fem import FingerModel, Press, ReducedFinger, prepare, press, press_finite
from papilla.fem.pressing.prices import PRICED_QUANTITIES, Cost, Loss, Prices, keep
from papilla.mesh import build, default_size_mm
from papilla.mesh.scale import FingerScale
from papilla.model.finger import Finger
from papilla.model.specimen import THICKNESS_MM, Block

PRICED_FORCES_N = tuple(float(gf_to_newton(force)) for force in (5, 20, 50, 100))
"""Forces (N) at which the error of small strain of the default finger is reported."""

PRICED_SPECIMEN = Block(0.51, THICKNESS_MM)  # The middle one of the published specimens, as thick as the default
TIMED_PRESSES = 40  # Presses that the seconds of a scene are the median of


def measure_prices(finger: Finger, *, size_mm: float | None = None, progress: Progress = silent) -> Prices:
    """Errors of each fidelity at the apex of a finger, in its `priced_presses`, with elements of `size_mm`.

    Hertz is measured against contact, contact against itself on a mesh of half the size, and contact against
    finite. Takes a minute and more: a mesh of half the size, and four presses at finite strain. `progress` is called
    with a line for each stage. Raises what meshing, reducing and pressing raise.
    """

    size_mm = default_size_mm(finger) if size_mm is None else size_mm
    mesh = build(finger, size_mm, progress=progress)
    progress("pricing: assembling and reducing")
    began = perf_counter()
    reduced = FingerModel(finger, mesh).reduce()
    setup = perf_counter() - began
    progress("pricing: the mesh of half the size")
    finest = prepare(finger, size_mm=size_mm / 2, progress=progress)
    forces, specimen = priced_presses(finger)
    contact, finer = (
        [press(body, specimen, force=force, fidelity="contact") for force in forces] for body in (reduced, finest)
    )
    hertz: list[Press] = []
    with suppress(ContactRangeError):  # The mesh is too coarse, or the skin too hard, for one of them
        hertz = [press(reduced, specimen, force=force, fidelity="hertz") for force in forces]
    finite = []
    for number, force in enumerate(forces, 1):
        progress(f"pricing: finite strain, press {number} of {len(forces)}")
        finite.append(press_finite(finger, mesh, specimen, force=force))
    return Prices(
        finger_name=finger.name,
        finger_sha256=finger.sha256,
        mesh_sha256=mesh.sha256,
        mesh_size_mm=mesh.size_mm,
        finest_size_mm=finest.mesh_size_mm,
        specimen=f"a {specimen.thickness:.3g} mm block of {specimen.modulus:.3g} MPa",
        hertz=loss(hertz, contact) if hertz else None,
        mesh=loss(contact, finer),
        small_strain=loss(contact, finite),
        costs={
            **{name: _cost(reduced, setup, name, forces, specimen) for name in ("hertz", "contact")[not hertz :]},
            "finite": Cost(0.0, float(np.mean([timed.seconds for timed in finite]))),
        },
    )


def price(finger: Finger, *, size_mm: float | None = None, progress: Progress = silent) -> Prices:
    """Measure the prices of a finger with `measure_prices`, and keep them in the cache for `fidelity="auto"`."""
    prices = measure_prices(finger, size_mm=size_mm, progress=progress)
    keep(prices)
    return prices


def loss(cheaper: list[Press], better: list[Press]) -> Loss:
    """Errors of presses against better ones at the same rising forces."""
    errors = {
        name: tuple(getattr(a, name) / getattr(b, name) - 1 for a, b in zip(cheaper, better, strict=True))
        for name in PRICED_QUANTITIES
    }
    return Loss(tuple(press.force for press in better), **errors)


def priced_presses(finger: Finger) -> tuple[tuple[float, ...], Block]:
    """Forces (N) and specimen that strain a finger as `PRICED_FORCES_N` on `PRICED_SPECIMEN` do the default one."""
    scale = FingerScale.of(finger)
    specimen = Block(scale.modulus * PRICED_SPECIMEN.modulus, scale.length * PRICED_SPECIMEN.thickness)
    return tuple(scale.force * force for force in PRICED_FORCES_N), specimen


def _cost(reduced: ReducedFinger, setup: float, fidelity: str, forces: tuple[float, ...], specimen: Block) -> Cost:
    """The cost of a linear fidelity; setup : seconds before the first press."""
    rising = np.geomspace(forces[0], forces[-1], TIMED_PRESSES)
    presses = [press(reduced, specimen, force=force, fidelity=fidelity) for force in rising]
    return Cost(setup, float(np.median([timed.seconds for timed in presses])))
