"""Hard cases: an answer within its stated error, or a clear refusal; never a silent wrong number.

Up to nu = 0.5 exactly (no locking, no loss of digits, and a limit that is reached smoothly), contrasts of moduli, loads
and places up to the finger's limits, and the two factorisations against each other.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from papilla.core import settings
from papilla.core.errors import ContactRangeError
from papilla.core.units import PER_CENT, gf_to_newton, to_microstrain
from papilla.fem import FingerModel, Press, ReducedFinger, press
from papilla.fem.discrete.solver import factorise
from papilla.fem.pressing.contact import OFF_APEX
from papilla.mesh import build
from papilla.model.finger import Finger, Layer
from papilla.model.specimen import HalfSpace, Specimen
from papilla.references import StackLayer, bonded_layer_sphere
from papilla.verify import bodies, finger
from papilla.verify.bodies import BALL_RADIUS, BALL_SPECIMEN, compared, off
from papilla.verify.case import Case
from papilla.verify.finger import SWEEP_BLOCK, contact_residuals, default_model, default_reduced, pressed_by, residual
from papilla.verify.structured import cylinder

HARD_CASES = settings.parameters(__name__)
LIMIT_CASES, ENGINE_CASES = HARD_CASES.incompressible, HARD_CASES.engines


def contrast() -> Iterator[Case]:
    """Sphere on a layer on a layer on a rigid table, the upper from 1000 times softer to 1000 times harder."""
    thickness, depth, nu, usual = (HARD_CASES.thickness_mm, HARD_CASES.depth_mm, HARD_CASES.nu, bodies.BODY_SIZES)
    for ratio in HARD_CASES.contrasts:
        stack = [StackLayer(thickness, 1.0, nu), StackLayer(depth, 1 / ratio, nu)]
        exact = bodies.stack_sphere(1.0, BALL_RADIUS, stack, None)
        growth, chords = (usual.growth, bodies.FEW_CHORDS) if ratio <= 1 else (HARD_CASES.growth_on_hard, usual.chords)
        layers = Layer(1.0, nu), Layer(1 / ratio, nu)
        model = bodies.coated(*layers, thickness, depth, HARD_CASES.width_mm, ratio=growth, chords=chords)
        pressed = press(model.reduce(), BALL_SPECIMEN, indentation=exact.indentation, fidelity="contact")
        name = f"modulus contrast {ratio:g}"
        against = "at given indentation, against integral transforms (second method)"
        yield from compared(name, against, pressed, exact, force=HARD_CASES.force_bound, area=HARD_CASES.area_bound)
        yield residual(name, model)


def loads() -> Iterator[Case]:
    """Specimens from 1 kPa to rigid, from 0.1 gf to the finger's limit: the default mesh compared with another of the
    five."""
    reduced, remeshed = default_reduced(), FingerModel(Finger.default(), build(Finger.default(), variant=1)).reduce()
    lightest, *_, heaviest = HARD_CASES.loads_gf
    for modulus in HARD_CASES.moduli_MPa:
        specimen = HalfSpace(modulus)
        ours, theirs = (
            [_pressed(finger, gf, specimen) for gf in HARD_CASES.loads_gf] for finger in (reduced, remeshed)
        )
        answers = [press_here for press_here in ours if isinstance(press_here, Press)]
        both = ((first, second) for first, second in zip(ours, theirs, strict=True) if isinstance(second, Press))
        resolved = [(first.sd, second.sd) for first, second in both if isinstance(first, Press) and first.resolved]
        name = f"half-space of {modulus:g} MPa, {lightest:g} to {heaviest:g} gf"
        refused = len(ours) - len(answers)
        counts = f"{len(resolved)} resolved, {len(answers) - len(resolved)} warned, {refused} refused"
        measure = f"{counts}: worst resolved S_d, against another mesh (stated: 3 %)"
        away = max((off(*sds) for sds in resolved), default=np.inf)
        yield Case(f"{name}, S_d", measure, away, HARD_CASES.stated)
        broken = max(max(contact_residuals(reduced, specimen, answer)) for answer in answers)
        measure = "worst of pressure, gap, product (exactly 0)"
        yield Case(f"{name}, complementarity", measure, broken, HARD_CASES.complementarity)
    light = press(reduced, SWEEP_BLOCK, force=gf_to_newton(lightest))
    measure = f"against a point force by adjoint rows (second method); stated: {light.status}"
    away = off(light.sd / light.force, _point_load_sd(reduced))
    yield Case(f"{lightest:g} gf, S_d per newton", measure, away, HARD_CASES.light_bound)


def _pressed(reduced: ReducedFinger, force_gf: float, specimen: Specimen = SWEEP_BLOCK) -> Press | ContactRangeError:
    """A press, or why it is refused."""
    try:
        return pressed_by(reduced, force_gf, specimen)
    except ContactRangeError as error:
        return error


def _point_load_sd(reduced: ReducedFinger) -> float:
    """S_d (microstrain) per newton of a point force at the apex, by one adjoint solve per gauge."""
    model = default_model()
    places, top = model.space.displacement.doflocs.T, model.mesh.points[:, 2].max()
    apex = int(np.argmin(np.linalg.norm(places - [0, 0, top], axis=1)))
    downwards = sum(-solution[apex, 2] for solution in finger.default_adjoints().values())
    return float(to_microstrain(reduced.gains * downwards).std())


def places() -> Iterator[Case]:
    """Presses beside the apex up to the rim, each on two meshes; refusals and warnings must say so."""
    default, at_places = Finger.default(), []
    for variant in (0, 1):
        model = FingerModel(replace(default, patch_radius=HARD_CASES.patch_mm), build(default, variant=variant))
        reduced = [model.reduce(at) for at in HARD_CASES.places_mm]
        at_places.append([(finger_there, _pressed(finger_there, HARD_CASES.place_gf)) for finger_there in reduced])
    for at, (reduced_there, pressed), (_, remeshed) in zip(HARD_CASES.places_mm, *at_places, strict=True):
        name = f"{HARD_CASES.place_gf:g} gf at ({at[0]:g}, {at[1]:g}) mm"
        if isinstance(pressed, ContactRangeError) or isinstance(remeshed, ContactRangeError):
            error = pressed if isinstance(pressed, ContactRangeError) else remeshed
            yield Case(name, f"refused: {error}", 0.0, 0.0)
            continue
        broken = max(*contact_residuals(reduced_there, SWEEP_BLOCK, pressed), pressed.force_balance)
        measure = "worst of pressure, gap, product, force (exactly 0)"
        yield Case(f"{name}, balance", measure, broken, HARD_CASES.complementarity)
        away = bodies.apart(remeshed.reading, pressed.reading)
        sentence = f"{'resolved' if pressed.resolved else 'warned'}; the status states {PER_CENT * OFF_APEX:g} %"
        yield Case(f"{name}, readings", f"worst reading on another mesh, over the largest ({sentence})", away, OFF_APEX)


def incompressible() -> Iterator[Case]:
    """A bonded layer against its exact solution, and the default finger against its own limit."""
    yield from _bonded_layer()
    yield from _finger()


def _bonded_layer() -> Iterator[Case]:
    """A layer between ball and table, whose response depends most on nu."""
    modulus = LIMIT_CASES.modulus_MPa
    thickness, indentation = bodies.at_unit_contact(LIMIT_CASES.chi, modulus)
    ratios = []
    for nu in LIMIT_CASES.poissons:
        model = bodies.bonded_layer(Layer(modulus, nu), thickness)
        pressed = press(model.reduce(), BALL_SPECIMEN, indentation=indentation, fidelity="contact")
        exact = bonded_layer_sphere(indentation, BALL_RADIUS, thickness, modulus, nu)
        ratios.append(pressed.force / exact.force)
        name = f"bonded layer, nu {nu:g}"
        against = "at given indentation, against the dual integral equation (exact solution)"
        yield from compared(name, against, pressed, exact, force=HARD_CASES.force_bound)
        yield residual(name, model)
    measure = "rise of force over exact force above that at nu 0.49"
    yield Case("bonded layer, locking", measure, max(ratios) / ratios[0] - 1, LIMIT_CASES.even_bound)


def _finger() -> Iterator[Case]:
    base, readings = default_model(finger.COARSE_MM), []
    outer, inner = base.finger.outer, base.finger.inner
    for nu in LIMIT_CASES.poissons:
        changed = replace(base.finger, outer=replace(outer, nu=nu), inner=replace(inner, nu=nu))
        model = FingerModel(changed, base.mesh)
        pressed = pressed_by(model.reduce(), LIMIT_CASES.firm_gf)
        readings.append((pressed.sd, pressed.indentation))
        yield residual(f"finger, nu {nu:g}", model)
    # From nu = 0.4999 on, where the term in (1 - 2 nu)^2 is gone
    changes = (np.array(readings) / readings[-1] - 1)[2:]
    compressibility = 1 - 2 * np.array(LIMIT_CASES.poissons)[2:, None]
    away = np.abs(changes - changes[0] / compressibility[0] * compressibility).max(axis=0)
    for name, distance, change in zip(("S_d", "indentation"), away, np.abs(changes[0]), strict=True):
        at = f"{name} at {LIMIT_CASES.firm_gf} gf"
        measure = f"{at} from nu 0.4999 on, against its limit plus a term in 1 - 2 nu"
        yield Case(f"finger, {name} smooth in nu", measure, float(distance), LIMIT_CASES.smooth_bound)
        yield Case(f"finger, {name} at nu 0.4999", f"{at}, against nu = 0.5", float(change), LIMIT_CASES.even_bound)


def engines() -> Iterator[Case]:
    """Displacements of a bonded layer of two halves under random loads, rslab against SuperLU."""
    radii, sheets = np.linspace(0, ENGINE_CASES.radius_mm, ENGINE_CASES.rings + 1), ENGINE_CASES.sheets
    mesh = cylinder(radii, np.linspace(0, 1, sheets + 1), sheets // 2, sheets)
    for nu, ratio in ENGINE_CASES.materials:
        model = bodies.FlatModel(mesh, Layer(ratio, nu), Layer(1.0, nu), 1.0, interface=ENGINE_CASES.interface_mm)
        (free, factor), loads = model.factor(), finger.random_loads(model, 3, ENGINE_CASES.seed)
        moved, pressures = (int(mask.sum()) for mask in np.split(free, [3 * model.space.nodes]))
        ours, theirs = (
            factorise(factor.matrix, pressures, engine=name).solve(loads)[:moved] for name in ("rslab", "superlu")
        )
        away = np.linalg.norm(ours - theirs, axis=0) / np.linalg.norm(theirs, axis=0)
        name = f"rslab and SuperLU, nu {nu:g}, contrast {ratio:g}"
        yield Case(
            name, "displacements under random loads, against each other", float(away.max()), ENGINE_CASES.agreement
        )
