"""Identities on any mesh: reciprocity, energy, complementarity, mirror images, units."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from papilla.fem import FingerModel, ReducedFinger, press
from papilla.fem.discrete.elements import SYMMETRIC
from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.contact_path import ContactProblem
from papilla.fem.pressing.contact_step import contact_step, first_touch
from papilla.fem.reduction.loaded_patch import build_patch
from papilla.fem.reduction.patch import Frame
from papilla.finger import Dome, Gauge, Layer
from papilla.specimen import Block, HalfSpace, Specimen, Sphere
from papilla.studies.case import Case
from papilla.studies.verify.bodies import BALL, BALL_RADIUS, bonded_layer
from papilla.studies.verify.finger import (
    BLOCK,
    COARSE_MM,
    contact_residuals,
    default_adjoints,
    default_model,
    default_reduced,
    pressed_by,
)
from papilla.studies.verify.flat import FlatModel
from papilla.units import gf_to_newton

TIGHT, BALANCE, MIRROR = 1e-10, 1e-9, 1e-9

WORK_BOUND = 1e-3
"""Bound of the work of a press, integrated over `STEPS` by the trapezoidal rule."""

STEPS = 40

SMALL_PATCH = 8.0
"""Patch radius (mm) that contains a press of 20 gf."""

LEANING = ((17.0, 4.0, 30.0), (-33.0, -6.0, 0.0), (5.0, 0.0, 90.0))
"""Angle, y (mm) and direction of the gauges of a design without symmetry."""


def invariance() -> Iterator[Case]:
    """Identities that no mesh and no material may break."""
    yield from _reciprocity()
    yield from _energy()
    yield from _complementarity()
    yield from _mirrors()
    yield from _units()


def _reciprocity() -> Iterator[Case]:
    """Gauge rows by one adjoint solve per gauge, against the solves of all unit pressures."""
    model, reduced = default_model(COARSE_MM), default_reduced(COARSE_MM)
    frame = Frame.at(model.surfaces["skin"], 0.0, 0.0)
    loaded = build_patch(model.space, model.mesh, model.surfaces["skin"], frame, model.finger.patch_radius, True)
    adjoints = default_adjoints(COARSE_MM)
    loads = loaded.loads(SYMMETRIC)
    # A press at the apex is symmetric about both planes: only that part of an adjoint, halved for each plane, does work
    rows = len(adjoints) * adjoints[SYMMETRIC].reshape(loads.shape[0], -1).T @ loads
    worst = float(np.abs(rows - reduced.strain_rows).max() / np.abs(reduced.strain_rows).max())
    yield Case("reciprocity of gauge rows", "adjoint rows, against direct solves (second method)", worst, TIGHT)


def _energy() -> Iterator[Case]:
    model, reduced = default_model(COARSE_MM), default_reduced(COARSE_MM)
    pressed = pressed_by(reduced, 50)
    displacement = model.cell_displacements(pressed.pressure)[SYMMETRIC].ravel()
    stored = reduced.multiplicity * _strain_energy(model, displacement)
    work = reduced.multiplicity * float(pressed.pressure @ reduced.compliance @ pressed.pressure) / 2
    yield Case("strain energy", "integral over the mesh, against half of pressure times displacement",
                abs(stored / work - 1), BALANCE)  # fmt: skip
    depths = np.linspace(0, pressed.indentation, STEPS + 1)[1:]
    forces = [0.0]
    for depth in depths:
        step = contact_press(reduced, BLOCK, (None, float(depth)), 0.0)
        forces.append(step.force)
    own = reduced.compliance + reduced.specimen_compliance(BLOCK)
    stored = reduced.multiplicity * float(step.pressure @ own @ step.pressure) / 2
    work = float(np.trapezoid(forces, np.append(0, depths)))
    yield Case("work of a press", "integral of force over indentation, against stored energy",
                abs(work / stored - 1), WORK_BOUND)  # fmt: skip


def _strain_energy(model: FingerModel, displacement: np.ndarray) -> float:
    """Half of u A u + p C p over the cell, with the pressure that belongs to the displacement, in N mm."""
    lower, size = model.space.matrix(model.layers), 3 * model.space.nodes
    whole = (lower + sp.tril(lower, -1).T).tocsr()
    squeeze = whole[size:, :size] @ displacement
    pressure = sp.linalg.spsolve(-whole[size:, size:].tocsc(), squeeze)
    return float(displacement @ (whole[:size, :size] @ displacement) + squeeze @ pressure) / 2


def _complementarity() -> Iterator[Case]:
    """Every scene of a grid of specimens and forces, recomputed from the compliance alone."""
    reduced = default_reduced(COARSE_MM)
    specimens: dict[str, Specimen] = {
        "block": BLOCK,
        "half-space of 0.089 MPa": HalfSpace(0.089),
        "rigid ball of 30 mm": Sphere(1e6, 30.0),
        "soft thin block": Block(0.05, 3.0, 0.5),
    }
    for name, specimen in specimens.items():
        presses = [pressed_by(reduced, gf, specimen) for gf in (5, 20, 60)]
        residuals = np.max([contact_residuals(reduced, specimen, one) for one in presses], axis=0)
        measures = ("negative pressure over peak", "negative gap over indentation", "pressure times gap")
        for measure, error in zip(measures, residuals, strict=True):
            yield Case(f"complementarity, {name}, {measure}", "largest at 5, 20, 60 gf (exactly 0)", error, BALANCE)
        balance = max(
            abs(reduced.multiplicity * float(reduced.patch.mass @ one.pressure) / one.force - 1) for one in presses
        )
        yield Case(
            f"force balance, {name}", "integral of pressure at 5, 20, 60 gf, against the force", balance, BALANCE
        )


def _mirrors() -> Iterator[Case]:
    """A leaning design and its mirror image, and the quarter cell against the whole mesh."""
    base = default_model(COARSE_MM)
    there = [Gauge(f"a{k}", angle_deg=a, y_mm=y, direction_deg=d) for k, (a, y, d) in enumerate(LEANING)]
    back = [Gauge(f"b{k}", angle_deg=-a, y_mm=y, direction_deg=-d) for k, (a, y, d) in enumerate(LEANING)]
    model = FingerModel(replace(base.finger, gauges=(*there, *back), patch_radius=SMALL_PATCH), base.mesh)
    found = [pressed_by(model.reduce((x, 3.0)), 20) for x in (5.0, -5.0)]
    del model
    strain = [one.reading for one in found]
    count = len(LEANING)
    away = max(np.abs(strain[0][:count] - strain[1][count:]).max(), np.abs(strain[0][count:] - strain[1][:count]).max())
    measure = "readings of a design pressed at (5, 3) mm, against its mirror image pressed at (-5, 3) mm"
    yield Case("mirrored design, readings", measure, float(away / np.abs(strain[0]).max()), MIRROR)
    depth = abs(found[0].indentation / found[1].indentation - 1)
    yield Case("mirrored design, indentation", measure.replace("readings", "indentation"), depth, MIRROR)
    quarter = bonded_layer(Layer(1.0, 0.4999), 0.7, Layer(0.2, 0.4999), gauge_sites=(0.3, -0.8))
    whole = FlatModel(
        replace(quarter.mesh, mirrors=()),
        quarter.finger.outer,
        quarter.finger.inner,
        quarter.finger.patch_radius,
        interface=0.35,
        gauge_sites=(0.3, -0.8),
    )
    ball, depth = BALL, 1 / BALL_RADIUS / 4
    readings = [
        press(model.reduce(), ball, indentation=depth, fidelity="contact").reading for model in (quarter, whole)
    ]
    away = float(np.abs(readings[0] - readings[1]).max() / np.abs(readings[0]).max())
    measure = "readings of a layer of two halves, quarter cell against whole mesh (second method)"
    yield Case("mirror planes, readings", measure, away, MIRROR)


def _units() -> Iterator[Case]:
    """Stress and length in other units: strains do not change, and the contact search takes the same steps."""
    reference, steps = _pressed(default_reduced(COARSE_MM), 1.0, 1.0)
    for unit, scales in (("stress", [(1e-6, 1.0), (1e6, 1.0)]), ("length", [(1.0, 1e-6), (1.0, 1e6)])):
        for stress, length in scales:
            found, taken = _pressed(_rescaled(stress, length), stress, length)
            worst = max(
                float(np.abs(found.strain - reference.strain).max() / np.abs(reference.strain).max()),
                abs(found.indentation / length / reference.indentation - 1),
                abs(found.peak_pressure / stress / reference.peak_pressure - 1),
            )
            name = f"{unit} rescaled by {stress * length:g}"
            yield Case(f"{name}, answer", "strain, indentation, peak pressure, against the usual units", worst, BALANCE)
            measure = f"difference of {taken} from {steps} exchanges of the contact search"
            yield Case(f"{name}, iterations", measure, float(abs(taken - steps)), 0.0)


def _pressed(reduced: ReducedFinger, stress: float, length: float):
    """A press of 50 gf in the given units, and the number of iterations that its contact needs from first touch."""
    block = Block(BLOCK.modulus * stress, BLOCK.thickness * length, BLOCK.nu)
    force = gf_to_newton(50) * stress * length**2
    found = contact_press(reduced, block, (force, None), 0.0)
    compliance = reduced.compliance + reduced.specimen_compliance(block)
    patch = reduced.patch
    problem = ContactProblem(compliance, patch.mass, patch.gap)
    return found, contact_step(problem, first_touch(problem), force=force / reduced.multiplicity).iterations


def _rescaled(stress: float, length: float) -> ReducedFinger:
    """The default finger and its mesh in other units, condensed again."""
    base = default_model(COARSE_MM)
    finger = base.finger
    shape = finger.shape
    assert isinstance(shape, Dome)
    scaled = replace(
        finger,
        shape=Dome(_times(length, shape.outer), _times(length, shape.interface), _times(length, shape.bone)),
        outer=replace(finger.outer, modulus=finger.outer.modulus * stress),
        inner=replace(finger.inner, modulus=finger.inner.modulus * stress),
        gauges=tuple(replace(gauge, **_sizes(gauge, length)) for gauge in finger.gauges),
        patch_radius=finger.patch_radius * length,
    )
    return FingerModel(scaled, base.mesh.scaled(length)).reduce()


def _times(factor: float, axes: tuple[float, float, float]) -> tuple[float, float, float]:
    return axes[0] * factor, axes[1] * factor, axes[2] * factor


def _sizes(gauge: Gauge, factor: float) -> dict[str, Any]:
    backing = (gauge.backing_mm[0] * factor, gauge.backing_mm[1] * factor)
    return {name: getattr(gauge, name) * factor for name in ("y_mm", "length_mm", "width_mm")} | {"backing_mm": backing}
