"""The `finite` fidelity: one press at finite strain, its load raised in steps that are cut back where Newton fails."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
import scipy.sparse as sp

from papilla.core import checks
from papilla.core.errors import ContactRangeError, InputError, SolverError
from papilla.core.memory import refuse_finite
from papilla.core.progress import Progress, silent
from papilla.core.units import PER_CENT
from papilla.fem.discrete.assembly import SPACE_AXES, lame
from papilla.fem.discrete.elements import SYMMETRIC_PARITY, TaylorHood, fold, interpolation, parity_signs
from papilla.fem.finite.body import Body, Card
from papilla.fem.finite.newton import Balance, Linearisation, State, solve_level
from papilla.fem.finite.touching import STICK_FRICTION, Touching
from papilla.fem.pressing.contact import contact_shape
from papilla.fem.pressing.press import Press, check_scene, refuse_detail, refuse_rim, too_coarse
from papilla.fem.pressing.specimen_strain import with_specimen_strain
from papilla.fem.reduction.finger_model import layers_below
from papilla.fem.reduction.gauges import GAUGE_QUANTITIES, PointFunctional, gauge_functionals, gauge_weights
from papilla.fem.reduction.loaded_patch import build_patch
from papilla.fem.reduction.patch import Frame
from papilla.mesh.body import patch_radius_mm, surfaces_of
from papilla.mesh.layered import BONE_LAYER, LAYER_NUMBERS, LayeredMesh
from papilla.mesh.surfaces import Surface
from papilla.model.finger import Finger
from papilla.model.materials import Material, NeoHookean, checked_material
from papilla.model.specimen import Friction, Specimen, friction_coefficient

LOAD_GROWTH, FIRST_LOAD = 1.7, 0.2
"""Steps of the load with friction: ratio of a load to the one before, and the first one as a share of the last. Against
1.06, S_d of heavy presses that stick is 0.1 to 0.3 % off on the coarse meshes of tables, and half of that with 1.3."""

ON_THE_WAY = 1e-3
"""Relative residual of the steps before the last one."""

SMALLEST_STEP = 1 / 64
"""Smallest step of the load, as a share of the whole; smaller ones are not tried."""


def press_finite(
    finger: Finger,
    mesh: LayeredMesh,
    specimen: Specimen,
    *,
    force: float | None = None,
    indentation: float | None = None,
    materials: Mapping[str, Material] | None = None,
    friction: Friction = 0.0,
    at: tuple[float, float] = (0.0, 0.0),
    progress: Progress = silent,
) -> Press:
    """Press a specimen on the finger at finite strain, by a force (N) or an indentation (mm).

    Parameters
    ----------
    force, indentation : exactly one.
    mesh : of `finger`; its mirror planes through the touch-down point are used, so a press at the apex uses a quarter.
    materials : "outer", "inner", "bone" -> a material (`papilla.model.materials`); a layer that is not named has its
        card in the finger's design or, without one, is neo-Hookean with its modulus. Poisson's ratio is the layer's.
    friction : Coulomb's coefficient, or "stick": nothing slips. The load then rises from zero in small steps, and a
        point that sticks keeps the relative displacement that it had when it came into contact.
    at : (x, y) in mm where the specimen touches down, along the skin's inward normal.
    progress : called with a line for each load step.

    The `Press` has fidelity "finite", pressure per reference area projected on the contact plane, and peak pressure and
    contact area as they are in the deformed state. Raises `InputError` for unusable values, `ContactRangeError` if the
    press leaves the range of the model, `MemoryEstimateError` if the mesh needs more memory than is free, `SolverError`
    if no equilibrium is found.
    """
    began = perf_counter()
    force, indentation = check_scene(specimen, finger.outer.modulus, mesh.size_mm, force, indentation)
    scene = PressProblem.of(
        finger, mesh, specimen, materials or {}, at, min(STICK_FRICTION, friction_coefficient(friction))
    )
    refuse_detail(specimen, scene.touching.patch, mesh.size_mm)
    share = None if force is None else force / len(scene.touching.patch.images)
    equilibrium, steps, balance, _ = press_path(scene, share, indentation, progress)
    press = result(scene, equilibrium, force, _sentence(steps, balance), began)
    return with_specimen_strain(press, scene.skin, specimen.curvature != (0.0, 0.0))


@dataclass(frozen=True, eq=False)
class Readout:
    """Strain and curvature of the g gauges of a finitely deformed finger: true elongation of the chord, curvature as at
    small strain.

    functionals : q * g of them, quantity by quantity, with p points in all. rows : (p, nodes) weights that evaluate the
    displacement in the cell at these points; signs (p, 3) map it to its mirror images.
    """

    functionals: list[PointFunctional]
    rows: sp.csr_matrix
    signs: np.ndarray

    @classmethod
    def of(cls, finger: Finger, interface: Surface, space: TaylorHood, mirrors: tuple[str, ...]) -> "Readout":
        """The readout of a finger; raises `InputError` for a gauge outside the mesh."""
        functionals = gauge_functionals(finger, interface)
        folded, images = fold(np.concatenate([functional.points for functional in functionals]), mirrors)
        return cls(functionals, interpolation(space, folded), parity_signs(SYMMETRIC_PARITY, images))

    def __call__(self, displacement: np.ndarray) -> np.ndarray:
        """Strain and curvature change of the gauges (q, g) at a displacement (nodes of the cell, 3), in the order of
        `gauges.QUANTITIES`."""
        ends = np.cumsum([len(functional.points) for functional in self.functionals])
        moved = np.split(self.signs * (self.rows @ displacement), ends[:-1])
        gauges = len(self.functionals) // len(GAUGE_QUANTITIES)
        feel = [quantity.finite for quantity in GAUGE_QUANTITIES.values() for _ in range(gauges)]
        values = [
            value(gauge_functional, displacements)
            for value, gauge_functional, displacements in zip(feel, self.functionals, moved, strict=True)
        ]
        return np.reshape(values, (len(GAUGE_QUANTITIES), -1))


@dataclass(frozen=True, eq=False)
class PressProblem:
    """A finger and a specimen, ready to be pressed: the body of the cell, its contact, the readout of its
    gauges, and thickness (mm) and modulus (MPa) of the skin where it is touched."""

    finger: Finger
    body: Body
    touching: Touching
    readout: Readout
    skin: tuple[float, float]

    @classmethod
    def of(
        cls,
        finger: Finger,
        mesh: LayeredMesh,
        specimen: Specimen,
        materials: Mapping[str, Material],
        at: tuple[float, float],
        friction: float = 0.0,
    ) -> "PressProblem":
        """The scene for the arguments of `press_finite`, on the part of the mesh that remains after its mirrors through
        `at` are used."""
        cards = _cards(finger, mesh, materials)
        x, y = checks.place("at", at)
        surfaces = surfaces_of(finger)
        frame = Frame.at(surfaces["skin"], x, y)
        mesh = replace(mesh, mirrors=tuple(axis for axis in mesh.mirrors if frame.origin["xyz".index(axis)] == 0))
        space = TaylorHood(mesh.cell())
        loaded = build_patch(space, mesh, surfaces["skin"], frame, patch_radius_mm(finger), bool(mesh.mirrors))
        refuse_finite(len(space.mesh.tets), space.unknowns, len(loaded.patch.xy), mesh.size_mm)
        body = Body(space, cards, space.free(SYMMETRIC_PARITY, mesh.mirrors))
        readout = Readout.of(finger, surfaces["interface"], space, mesh.mirrors)
        thickness, modulus = layers_below(finger, surfaces, frame, mesh)[0].tolist()
        return cls(finger, body, Touching(loaded, specimen, friction), readout, (thickness, modulus))

    def force(self, equilibrium: State) -> float:
        """Force on the patch (N)."""
        return float(self.touching.patch.mass @ equilibrium.contact[: len(equilibrium.active)])

    @property
    def at_rest(self) -> State:
        """The undeformed state."""
        nodes, space = len(self.touching.patch.xy), self.body.space
        contact = np.zeros(SPACE_AXES * nodes if self.touching.friction else nodes)
        rest = np.zeros((space.nodes, SPACE_AXES)), np.zeros(space.pressures)
        return State(*rest, contact, np.zeros(nodes, dtype=bool), 0.0)


def _cards(finger: Finger, mesh: LayeredMesh, materials: Mapping[str, Material]) -> dict[int, Card]:
    """A material card for each layer number of the mesh."""
    layers = {"outer": finger.outer, "inner": finger.inner}
    if finger.bone is not None:
        layers["bone"] = finger.bone
    if (finger.bone is not None) != bool((mesh.layer == BONE_LAYER).any()):
        raise InputError("the mesh does not fit the finger: bone cells and a bone with a modulus go together")
    cards = {name: Card(layer.material or NeoHookean(lame(layer)[0]), layer.nu) for name, layer in layers.items()}
    for name, material in materials.items():
        if name not in layers:
            raise InputError(f"materials are for {', '.join(layers)}, got {name!r}")
        cards[name] = Card(checked_material(f"material of {name}", material), layers[name].nu)
    return {LAYER_NUMBERS[name]: card for name, card in cards.items()}


def press_path(
    scene: PressProblem,
    force: float | None,
    indentation: float | None,
    progress: Progress = silent,
    *,
    start: State | None = None,
    linearisation: Linearisation | None = None,
    tolerance: float | None = None,
    growth: float = LOAD_GROWTH,
) -> tuple[State, list[int], Balance, Linearisation | None]:
    """The state at a force on the patch (N) or an indentation (mm); the number of Newton steps of each load step; the
    residuals; and the last linearisation, for the next load.

    With friction the load grows by factors of `growth`, from the state `start` or from rest, because the effect of
    friction depends on the path. `held` : linearisation of another load or specimen on the same body.
    """
    name, aim = ("force", force) if indentation is None else ("indentation", indentation)
    assert aim is not None
    equilibrium, steps = start or scene.at_rest, []
    reached = scene.force(equilibrium) if name == "force" else equilibrium.indentation
    loads = [aim]
    # From the aim backwards by factors, until the first load is small or the present one is reached.
    while scene.touching.friction and loads[0] > max(growth * reached, FIRST_LOAD * aim):
        loads.insert(0, loads[0] / growth)
    for load in loads:
        # Knots on the way only pass on who sticks where: they need less accuracy.
        rough = tolerance if load == aim else max(ON_THE_WAY, tolerance or 0.0)
        equilibrium, more, balance, linearisation = raise_load(
            scene, name, load, equilibrium, linearisation, rough, progress
        )
        steps += more
    return equilibrium, steps, balance, linearisation


def raise_load(
    scene: PressProblem,
    name: str,
    aim: float,
    equilibrium: State,
    linearisation: Linearisation | None,
    tolerance: float | None = None,
    progress: Progress = silent,
) -> tuple[State, list[int], Balance, Linearisation]:
    """The state at a "force" on the patch (N) or an "indentation" (mm), as `press_path` returns it.

    The first step is the whole load. A step that fails is halved; after one that succeeds, the next is twice as large.
    `state` and `held` are those of another load, or of another specimen, on the same body. Raises `SolverError` if
    `SMALLEST_STEP` fails, `ContactRangeError` if an indentation makes no contact.
    """
    reached, step, steps = 0.0, 1.0, []
    linearisation = linearisation or Linearisation.at(scene.body, scene.touching, scene.at_rest)
    begins = scene.force(equilibrium) if name == "force" else equilibrium.indentation
    while reached < 1:
        target = min(1.0, reached + step)
        loads = {"force": None, "indentation": None, name: begins + target * (aim - begins)}
        try:
            equilibrium, count, balance, linearisation = solve_level(
                scene.body, scene.touching, equilibrium, linearisation, **loads, tolerance=tolerance
            )
        except ContactRangeError:
            if target == 1:
                raise
            # A shortened step may not reach the mesh's first vertex, and then does nothing
            reached = target
            continue
        except SolverError as error:
            step /= 2
            if step < SMALLEST_STEP:
                raise SolverError(
                    f"the finite press stops at {PER_CENT * reached:.3g} % of the load: {error}"
                ) from error
            progress(f"load step cut to {PER_CENT * step:.3g} % of the load: {error}")
            continue
        reached = target
        steps.append(count)
        step *= 2
        progress(f"{PER_CENT * reached:.3g} % of the load in {count} Newton steps")
    return equilibrium, steps, balance, linearisation


def _sentence(steps: list[int], balance: Balance) -> str:
    loads = f"{len(steps)} load step{'s' if len(steps) > 1 else ''}"
    return f"finite: converged in {sum(steps)} Newton steps over {loads}, relative residual {balance.worst:.0e}"


def _stability(scene: PressProblem, equilibrium: State) -> str:
    """Remark on the stability of the material laws over the strains that were reached."""
    least, largest = scene.body.stability(equilibrium.displacement)
    if least > 0:
        return f"; laws stable over the strains reached, stretches up to {largest:.2f}"
    return f"; not to be trusted: a material's law is unstable within the stretches reached, up to {largest:.2f}"


def result(scene: PressProblem, equilibrium: State, force: float | None, sentence: str, began: float) -> Press:
    """The press of a state; raises `ContactRangeError` outside of the model's range. `began` : start of its clock."""
    finger, touching = scene.finger, scene.touching
    patch, specimen, current = touching.patch, touching.specimen, touching.current_patch(equilibrium.displacement)
    refuse_rim(patch, equilibrium.active)
    pressure = equilibrium.contact[: len(equilibrium.active)]
    total = float(len(patch.images) * patch.mass @ pressure)
    shape = contact_shape(current, pressure * patch.mass / current.mass)
    taken = (touching.compliance @ equilibrium.contact)[: len(pressure)] / patch.mass
    specimen.refuse(float(taken.max()), float(np.sqrt(shape.area / np.pi)))
    sentence += _stability(scene, equilibrium)
    if not touching.turns:
        sentence += (
            "; the pressure keeps its direction where the specimen deforms: it has no compliance along its surface"
        )
    coarse = too_coarse(shape.area, current.mean_edge(equilibrium.active), scene.body.space.mesh.size_mm)
    return Press(
        modulus=specimen.modulus,
        weights=gauge_weights(finger),
        seconds=perf_counter() - began,
        force=total if force is None else force,
        fidelity="finite",
        large_strain=True,
        friction=touching.friction if touching.friction < STICK_FRICTION else math.inf,
        indentation=equilibrium.indentation,
        contact_area=shape.area,
        peak_pressure=shape.peak_pressure,
        values=scene.readout(equilibrium.displacement),
        force_balance=0.0 if force is None else abs(total - force) / force,
        status=sentence if coarse is None else f"{sentence}; {coarse}",
        resolved=coarse is None,
        pressure=pressure,
        active=equilibrium.active,
    )
