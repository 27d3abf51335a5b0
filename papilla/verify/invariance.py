"""Identities on any mesh: reciprocity, energy, complementarity, mirror images, units."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from papilla.core import settings
from papilla.core.units import gf_to_newton
from papilla.fem import FingerModel, ReducedFinger, press
from papilla.fem.discrete.elements import SYMMETRIC_PARITY
from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.contact_path import ContactProblem
from papilla.fem.pressing.contact_step import contact_step, first_touch
from papilla.fem.reduction.loaded_patch import build_patch
from papilla.fem.reduction.patch import Frame
from papilla.mesh.body import patch_radius_mm
from papilla.model.finger import Gauge, Layer
from papilla.model.specimen import Block, HalfSpace, Specimen, Sphere
from papilla.verify.bodies import BALL_RADIUS, BALL_SPECIMEN, FlatModel, apart, bonded_layer, off
from papilla.verify.case import Case
from papilla.verify.finger import (
    COARSE_MM,
    SWEEP_BLOCK,
    contact_residuals,
    default_adjoints,
    default_model,
    default_reduced,
    pressed_by,
)

LAW_CASES = settings.parameters(__name__)


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
    loaded = build_patch(model.space, model.mesh, model.surfaces["skin"], frame, patch_radius_mm(model.finger), True)
    adjoints = default_adjoints(COARSE_MM)
    loads = loaded.loads(SYMMETRIC_PARITY)
    # A press at the apex is symmetric about both planes: only that part of an adjoint, halved for each plane, does work
    rows = len(adjoints) * adjoints[SYMMETRIC_PARITY].reshape(loads.shape[0], -1).T @ loads
    measure = "adjoint rows, against direct solves (second method)"
    yield Case("reciprocity of gauge rows", measure, apart(rows, reduced.strain_rows), LAW_CASES.tight)


def _energy() -> Iterator[Case]:
    model, reduced = default_model(COARSE_MM), default_reduced(COARSE_MM)
    pressed = pressed_by(reduced, LAW_CASES.firm_gf)
    displacement = model.cell_displacements(pressed.pressure)[SYMMETRIC_PARITY].ravel()
    stored = reduced.multiplicity * _strain_energy(model, displacement)
    work = reduced.multiplicity * float(pressed.pressure @ reduced.compliance @ pressed.pressure) / 2
    measure = "integral over the mesh, against half of pressure times displacement"
    yield Case("strain energy", measure, off(stored, work), LAW_CASES.balance)
    depths = np.linspace(0, pressed.indentation, LAW_CASES.steps + 1)
    steps = [contact_press(reduced, SWEEP_BLOCK, (None, float(depth)), 0.0) for depth in depths[1:]]
    compliance, last = reduced.compliance + reduced.specimen_compliance(SWEEP_BLOCK), steps[-1].pressure
    stored = reduced.multiplicity * float(last @ compliance @ last) / 2
    work = np.trapezoid([0.0, *(step.force for step in steps)], depths)
    measure = "integral of force over indentation, against stored energy"
    yield Case("work of a press", measure, off(work, stored), LAW_CASES.work_bound)


def _strain_energy(model: FingerModel, displacement: np.ndarray) -> float:
    """Half of u A u + p C p over the cell, with the pressure that belongs to the displacement, in N mm."""
    lower, size = model.space.matrix(model.layers), 3 * model.space.nodes
    symmetric = (lower + sp.tril(lower, -1).T).tocsr()
    squeeze = symmetric[size:, :size] @ displacement
    pressure = sp.linalg.spsolve(-symmetric[size:, size:].tocsc(), squeeze)
    return float(displacement @ (symmetric[:size, :size] @ displacement) + squeeze @ pressure) / 2


def _complementarity() -> Iterator[Case]:
    """Every scene of a grid of specimens and forces, recomputed from the compliance alone."""
    reduced = default_reduced(COARSE_MM)
    forces = ", ".join(map(str, LAW_CASES.forces_gf))
    specimens: dict[str, Specimen] = {
        "block": SWEEP_BLOCK,
        "half-space of 0.089 MPa": HalfSpace(0.089),
        "rigid ball of 30 mm": Sphere(1e6, 30.0),
        "soft thin block": Block(0.05, 3.0, 0.5),
    }
    for name, specimen in specimens.items():
        presses = [pressed_by(reduced, gf, specimen) for gf in LAW_CASES.forces_gf]
        residuals = np.max([contact_residuals(reduced, specimen, press) for press in presses], axis=0)
        measures = ("negative pressure over peak", "negative gap over indentation", "pressure times gap")
        for measure, error in zip(measures, residuals, strict=True):
            what = f"complementarity, {name}, {measure}"
            yield Case(what, f"largest at {forces} gf (exactly 0)", error, LAW_CASES.balance)
        balance = max(
            off(reduced.multiplicity * (reduced.patch.mass @ press.pressure), press.force) for press in presses
        )
        measure = f"integral of pressure at {forces} gf, against the force"
        yield Case(f"force balance, {name}", measure, balance, LAW_CASES.balance)


def _mirrors() -> Iterator[Case]:
    """A leaning design and its mirror image, and the quarter cell against the whole mesh."""
    base = default_model(COARSE_MM)
    x, y = LAW_CASES.leaning_at_mm
    leaning = [Gauge(f"a{k}", angle_deg=a, y_mm=b, direction_deg=d) for k, (a, b, d) in enumerate(LAW_CASES.leaning)]
    back = [Gauge(f"b{k}", angle_deg=-a, y_mm=b, direction_deg=-d) for k, (a, b, d) in enumerate(LAW_CASES.leaning)]
    model = FingerModel(
        replace(base.finger, gauges=(*leaning, *back), patch_radius=LAW_CASES.small_patch_mm), base.mesh
    )
    presses = [pressed_by(model.reduce((place, y)), LAW_CASES.small_gf) for place in (x, -x)]
    del model
    right, mirror_press = presses
    against = f"of a design pressed at ({x:g}, {y:g}) mm, against its mirror image pressed at ({-x:g}, {y:g}) mm"
    away = apart(np.roll(mirror_press.reading, len(leaning)), right.reading)
    yield Case("mirrored design, readings", f"readings {against}", away, LAW_CASES.mirror)
    depth = off(right.indentation, mirror_press.indentation)
    yield Case("mirrored design, indentation", f"indentation {against}", depth, LAW_CASES.mirror)
    upper, lower = (Layer(modulus, LAW_CASES.halves_nu) for modulus in LAW_CASES.halves_MPa)
    thickness, sites = LAW_CASES.halves_thickness_mm, LAW_CASES.halves_sites_mm
    quarter = bonded_layer(upper, thickness, lower, sites)
    mesh, radius = replace(quarter.mesh, mirrors=()), patch_radius_mm(quarter.finger)
    flat = FlatModel(mesh, upper, lower, radius, interface=thickness / 2, sites=sites)
    sums, expected = (
        press(
            model.reduce(), BALL_SPECIMEN, indentation=LAW_CASES.halves_indentation / BALL_RADIUS, fidelity="contact"
        ).reading
        for model in (quarter, flat)
    )
    measure = "readings of a layer of two halves, quarter cell against whole mesh (second method)"
    yield Case("mirror planes, readings", measure, apart(expected, sums), LAW_CASES.mirror)


def _units() -> Iterator[Case]:
    """Stress and length in other units: strains do not change, and the contact search takes the same steps."""
    reference, steps = _pressed(default_reduced(COARSE_MM), 1.0, 1.0)
    for unit, scales in LAW_CASES.units.items():
        for stress, length in scales:
            computed, taken = _pressed(_rescaled(stress, length), stress, length)
            worst = max(
                apart(computed.strain, reference.strain),
                off(computed.indentation / length, reference.indentation),
                off(computed.peak_pressure / stress, reference.peak_pressure),
            )
            name = f"{unit} rescaled by {stress * length:g}"
            measure = "strain, indentation, peak pressure, against the usual units"
            yield Case(f"{name}, answer", measure, worst, LAW_CASES.balance)
            measure = f"difference of {taken} from {steps} exchanges of the contact search"
            yield Case(f"{name}, iterations", measure, float(abs(taken - steps)), 0.0)


def _pressed(reduced: ReducedFinger, stress: float, length: float):
    """A press of 50 gf in the given units, and the number of iterations that its contact needs from first touch."""
    block = Block(SWEEP_BLOCK.modulus * stress, SWEEP_BLOCK.thickness * length, SWEEP_BLOCK.nu)
    force = gf_to_newton(LAW_CASES.firm_gf) * stress * length**2
    pressed = contact_press(reduced, block, (force, None), 0.0)
    compliance = reduced.compliance + reduced.specimen_compliance(block)
    patch = reduced.patch
    problem = ContactProblem(compliance, patch.mass, patch.gap)
    return pressed, contact_step(problem, first_touch(problem), force=force / reduced.multiplicity).iterations


def _rescaled(stress: float, length: float) -> ReducedFinger:
    """The default finger and its mesh in other units, condensed again."""
    base = default_model(COARSE_MM)
    finger = base.finger

    def longer(owner: Any, *names: str) -> Any:
        """The owner with these lengths in the other unit."""
        lengths = {name: getattr(owner, name) for name in names}
        return replace(
            owner,
            **{
                name: tuple(x * length for x in size) if isinstance(size, tuple) else size * length
                for name, size in lengths.items()
            },
        )

    gauges = tuple(longer(gauge, "y_mm", "length_mm", "width_mm", "backing_mm") for gauge in finger.gauges)
    outer, inner = (replace(layer, modulus=layer.modulus * stress) for layer in (finger.outer, finger.inner))
    shape = longer(finger.shape, "outer", "interface", "bone")
    scaled = replace(finger, outer=outer, inner=inner, gauges=gauges, shape=shape)
    return FingerModel(longer(scaled, "patch_radius"), base.mesh.scaled(length)).reduce()
