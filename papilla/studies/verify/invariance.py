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
from papilla.fem.reduction.finger_model import build_patch
from papilla.fem.reduction.patch import Frame
from papilla.finger import Dome, Gauge, Layer
from papilla.specimen import Block, HalfSpace, Specimen, Sphere
from papilla.studies import parameters
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

GIVEN = parameters.parameters(__name__)


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
    yield Case("reciprocity of gauge rows", "adjoint rows, against direct solves (second method)", worst, GIVEN.tight)


def _energy() -> Iterator[Case]:
    model, reduced = default_model(COARSE_MM), default_reduced(COARSE_MM)
    pressed = pressed_by(reduced, GIVEN.firm_gf)
    displacement = model.cell_displacements(pressed.pressure)[SYMMETRIC].ravel()
    stored = reduced.multiplicity * _strain_energy(model, displacement)
    work = reduced.multiplicity * float(pressed.pressure @ reduced.compliance @ pressed.pressure) / 2
    yield Case("strain energy", "integral over the mesh, against half of pressure times displacement",
                abs(stored / work - 1), GIVEN.balance)  # fmt: skip
    depths = np.linspace(0, pressed.indentation, GIVEN.steps + 1)[1:]
    forces = [0.0]
    for depth in depths:
        step = contact_press(reduced, BLOCK, (None, float(depth)), 0.0)
        forces.append(step.force)
    own = reduced.compliance + reduced.specimen_compliance(BLOCK)
    stored = reduced.multiplicity * float(step.pressure @ own @ step.pressure) / 2
    work = float(np.trapezoid(forces, np.append(0, depths)))
    yield Case("work of a press", "integral of force over indentation, against stored energy",
                abs(work / stored - 1), GIVEN.work_bound)  # fmt: skip


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
    forces = ", ".join(map(str, GIVEN.forces_gf))
    specimens: dict[str, Specimen] = {
        "block": BLOCK,
        "half-space of 0.089 MPa": HalfSpace(0.089),
        "rigid ball of 30 mm": Sphere(1e6, 30.0),
        "soft thin block": Block(0.05, 3.0, 0.5),
    }
    for name, specimen in specimens.items():
        presses = [pressed_by(reduced, gf, specimen) for gf in GIVEN.forces_gf]
        residuals = np.max([contact_residuals(reduced, specimen, one) for one in presses], axis=0)
        measures = ("negative pressure over peak", "negative gap over indentation", "pressure times gap")
        for measure, error in zip(measures, residuals, strict=True):
            yield Case(
                f"complementarity, {name}, {measure}", f"largest at {forces} gf (exactly 0)", error, GIVEN.balance
            )
        balance = max(
            abs(reduced.multiplicity * float(reduced.patch.mass @ one.pressure) / one.force - 1) for one in presses
        )
        yield Case(
            f"force balance, {name}", f"integral of pressure at {forces} gf, against the force", balance, GIVEN.balance
        )


def _mirrors() -> Iterator[Case]:
    """A leaning design and its mirror image, and the quarter cell against the whole mesh."""
    base = default_model(COARSE_MM)
    x, y = GIVEN.leaning_at_mm
    there = [Gauge(f"a{k}", angle_deg=a, y_mm=b, direction_deg=d) for k, (a, b, d) in enumerate(GIVEN.leaning)]
    back = [Gauge(f"b{k}", angle_deg=-a, y_mm=b, direction_deg=-d) for k, (a, b, d) in enumerate(GIVEN.leaning)]
    model = FingerModel(replace(base.finger, gauges=(*there, *back), patch_radius=GIVEN.small_patch_mm), base.mesh)
    found = [pressed_by(model.reduce((place, y)), GIVEN.small_gf) for place in (x, -x)]
    del model
    strain = [one.reading for one in found]
    count = len(GIVEN.leaning)
    away = max(np.abs(strain[0][:count] - strain[1][count:]).max(), np.abs(strain[0][count:] - strain[1][:count]).max())
    measure = (
        f"readings of a design pressed at ({x:g}, {y:g}) mm, against its mirror image pressed at ({-x:g}, {y:g}) mm"
    )
    yield Case("mirrored design, readings", measure, float(away / np.abs(strain[0]).max()), GIVEN.mirror)
    depth = abs(found[0].indentation / found[1].indentation - 1)
    yield Case("mirrored design, indentation", measure.replace("readings", "indentation"), depth, GIVEN.mirror)
    upper, lower = (Layer(modulus, GIVEN.halves_nu) for modulus in GIVEN.halves_MPa)
    thickness, sites = GIVEN.halves_thickness_mm, GIVEN.halves_sites_mm
    quarter = bonded_layer(upper, thickness, lower, gauge_sites=sites)
    whole = FlatModel(
        replace(quarter.mesh, mirrors=()),
        quarter.finger.outer,
        quarter.finger.inner,
        quarter.finger.patch_radius,
        interface=thickness / 2,
        gauge_sites=sites,
    )
    ball, depth = BALL, 1 / BALL_RADIUS / 4
    readings = [
        press(model.reduce(), ball, indentation=depth, fidelity="contact").reading for model in (quarter, whole)
    ]
    away = float(np.abs(readings[0] - readings[1]).max() / np.abs(readings[0]).max())
    measure = "readings of a layer of two halves, quarter cell against whole mesh (second method)"
    yield Case("mirror planes, readings", measure, away, GIVEN.mirror)


def _units() -> Iterator[Case]:
    """Stress and length in other units: strains do not change, and the contact search takes the same steps."""
    reference, steps = _pressed(default_reduced(COARSE_MM), 1.0, 1.0)
    for unit, scales in GIVEN.units.items():
        for stress, length in scales:
            found, taken = _pressed(_rescaled(stress, length), stress, length)
            worst = max(
                float(np.abs(found.strain - reference.strain).max() / np.abs(reference.strain).max()),
                abs(found.indentation / length / reference.indentation - 1),
                abs(found.peak_pressure / stress / reference.peak_pressure - 1),
            )
            name = f"{unit} rescaled by {stress * length:g}"
            yield Case(
                f"{name}, answer", "strain, indentation, peak pressure, against the usual units", worst, GIVEN.balance
            )
            measure = f"difference of {taken} from {steps} exchanges of the contact search"
            yield Case(f"{name}, iterations", measure, float(abs(taken - steps)), 0.0)


def _pressed(reduced: ReducedFinger, stress: float, length: float):
    """A press of 50 gf in the given units, and the number of iterations that its contact needs from first touch."""
    block = Block(BLOCK.modulus * stress, BLOCK.thickness * length, BLOCK.nu)
    force = gf_to_newton(GIVEN.firm_gf) * stress * length**2
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
