"""Hard cases: an answer within its stated error, or a clear refusal; never a silent wrong number."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from papilla.errors import ContactRangeError, MeshError
from papilla.fem import FingerModel, Press, ReducedFinger, press
from papilla.fem.pressing.contact import OFF_APEX
from papilla.finger import Dome, Finger, Layer
from papilla.mesh import build
from papilla.mesh.cells import mean_ratio, paired_faces, volumes
from papilla.mesh.finishing import refuse_unusable
from papilla.mesh.layered import LayeredMesh, mirrored
from papilla.references import StackLayer
from papilla.specimen import HalfSpace, Specimen
from papilla.studies import parameters
from papilla.studies.case import Case
from papilla.studies.verify.bodies import BALL, BALL_RADIUS, CHORDS, FEW_CHORDS, coated, compared, off
from papilla.studies.verify.finger import (
    BLOCK,
    contact_residuals,
    default_adjoints,
    default_model,
    default_reduced,
    pressed_by,
)
from papilla.studies.verify.incompressible import residual
from papilla.studies.verify.spectral import stack_sphere
from papilla.units import PER_CENT, gf_to_newton, to_microstrain

GIVEN = parameters.parameters(__name__)


def contrast() -> Iterator[Case]:
    """Sphere on a layer on a layer on a rigid table, the upper from 1000 times softer to 1000 times harder."""
    thickness, depth, nu = GIVEN.thickness_mm, GIVEN.depth_mm, GIVEN.nu
    for ratio in GIVEN.contrasts:
        lower = 1 / ratio
        stack = [StackLayer(thickness, 1.0, nu), StackLayer(depth, lower, nu)]
        exact = stack_sphere(1.0, BALL_RADIUS, stack, None)
        growth, chords = (GIVEN.growth_on_soft, FEW_CHORDS) if ratio <= 1 else (GIVEN.growth_on_hard, CHORDS)
        layers = Layer(1.0, nu), Layer(lower, nu)
        model = coated(*layers, thickness, depth=depth, width=GIVEN.width_mm, ratio=growth, chords=chords)
        found = press(model.reduce(), BALL, indentation=exact.indentation, fidelity="contact")
        name = f"modulus contrast {ratio:g}"
        against = "at given indentation, against integral transforms (second method)"
        yield from compared(name, against, found, exact, force=GIVEN.force_bound, area=GIVEN.area_bound)
        yield residual(name, model)


def loads() -> Iterator[Case]:
    """Specimens from 1 kPa to rigid, from 0.1 gf to the finger's limit: the default mesh compared with another of the
    five."""
    finger, reduced = Finger.default(), default_reduced()
    other = FingerModel(finger, build(finger, variant=1)).reduce()
    for modulus in GIVEN.moduli_MPa:
        specimen = HalfSpace(modulus)
        scenes = _scenes(reduced, specimen)
        answers = [one for one in scenes if one is not None]
        pairs = [(one, two) for one, two in zip(scenes, _scenes(other, specimen), strict=True) if one and two]
        resolved = [(one, two) for one, two in pairs if one.resolved]
        name = f"half-space of {modulus:g} MPa, {GIVEN.loads_gf[0]:g} to {GIVEN.loads_gf[-1]:g} gf"
        counts = (
            f"{len(resolved)} resolved, {len(answers) - len(resolved)} warned, {len(scenes) - len(answers)} refused"
        )
        away = max((off(one.sd, two.sd) for one, two in resolved), default=np.inf)
        yield Case(
            f"{name}, S_d", f"{counts}: worst resolved S_d, against another mesh (stated: 3 %)", away, GIVEN.stated
        )
        broken = max(max(contact_residuals(reduced, specimen, one)) for one in answers)
        yield Case(
            f"{name}, complementarity", "worst of pressure, gap, product (exactly 0)", broken, GIVEN.complementarity
        )
    light = press(reduced, BLOCK, force=gf_to_newton(GIVEN.loads_gf[0]))
    measure = f"against a point force by adjoint rows (second method); stated: {light.status}"
    yield Case(
        f"{GIVEN.loads_gf[0]:g} gf, S_d per newton",
        measure,
        off(light.sd / light.force, _point_load_sd(reduced)),
        GIVEN.light_bound,
    )


def places() -> Iterator[Case]:
    """Presses beside the apex up to the rim, each on two meshes; refusals and warnings must say so."""
    finger = replace(Finger.default(), patch_radius=GIVEN.patch_mm)
    one, two = (_pressed_at(FingerModel(finger, build(Finger.default(), variant=variant))) for variant in (0, 1))
    for at, ours, theirs in zip(GIVEN.places_mm, one, two, strict=True):
        name = f"{GIVEN.place_gf:g} gf at ({at[0]:g}, {at[1]:g}) mm"
        if isinstance(ours, ContactRangeError) or isinstance(theirs, ContactRangeError):
            error = ours if isinstance(ours, ContactRangeError) else theirs
            yield Case(name, f"refused: {error}", 0.0, 0.0)
            continue
        (found, broken), (other, _) = ours, theirs
        yield Case(
            f"{name}, balance", "worst of pressure, gap, product, force (exactly 0)", broken, GIVEN.complementarity
        )
        away = float(np.abs(found.reading - other.reading).max() / np.abs(found.reading).max())
        said = "resolved" if found.resolved else "warned"
        measure = (
            f"worst reading on another mesh, over the largest ({said}; the status states {PER_CENT * OFF_APEX:g} %)"
        )
        yield Case(f"{name}, readings", measure, away, OFF_APEX)


def _pressed_at(model: FingerModel) -> list[tuple[Press, float] | ContactRangeError]:
    """A press at each of `places_mm` with its residual, or the reason for its refusal."""
    found: list[tuple[Press, float] | ContactRangeError] = []
    for at in GIVEN.places_mm:
        reduced = model.reduce(at)
        try:
            pressed = pressed_by(reduced, GIVEN.place_gf)
        except ContactRangeError as error:
            found.append(error)
        else:
            found.append((pressed, max(*contact_residuals(reduced, BLOCK, pressed), pressed.force_balance)))
    return found


def thin_layer() -> Iterator[Case]:
    """An outer layer of 0.3 mm, thinner than an element: with equal moduli it must have no effect."""
    base = default_model().finger
    shape = base.shape
    assert isinstance(shape, Dome)
    x, y, z = (axis - GIVEN.thin_mm for axis in shape.outer)
    thin = replace(base, shape=replace(shape, interface=(x, y, z)))
    mesh = build(thin)
    quality = float(mean_ratio(mesh.points, mesh.tets).min())
    found, expected = (
        pressed_by(FingerModel(replace(finger, outer=base.inner), on).reduce(), GIVEN.firm_gf)
        for finger, on in ((thin, mesh), (base, default_model().mesh))
    )
    name = f"outer layer of {GIVEN.thin_mm:g} mm (worst cell of mean ratio {quality:.2g})"
    against = f"at {GIVEN.firm_gf} gf with equal moduli, against the layer of 3 mm (same body, other mesh)"
    yield from compared(name, against, found, expected, **GIVEN.thin_bounds)
    yield residual(name, FingerModel(thin, mesh))


def slivers() -> Iterator[Case]:
    """The default mesh with crushed cells, and one with a flat cell."""
    base = default_model()
    ruined = crushed(base.mesh.cell(), GIVEN.slivers)
    ratio = mean_ratio(ruined.points, ruined.tets)
    model = FingerModel(base.finger, mirrored(ruined, base.mesh.mirrors))
    found = pressed_by(model.reduce(), GIVEN.firm_gf)
    sound = pressed_by(default_reduced(), GIVEN.firm_gf)
    name = f"{int((ratio < GIVEN.sliver_ratio).sum())} slivers down to mean ratio {ratio.min():.1g}"
    yield Case(
        f"{name}, S_d",
        f"S_d at {GIVEN.firm_gf} gf, against the sound mesh (stated: 3 %)",
        off(found.sd, sound.sd),
        GIVEN.stated,
    )
    away = off(found.indentation, sound.indentation)
    yield Case(
        f"{name}, indentation",
        f"indentation at {GIVEN.firm_gf} gf, against the sound mesh",
        away,
        GIVEN.crushed_indentation_bound,
    )
    yield residual(name, model)
    yield Case("a flat cell", "0 where the mesh is refused, else 1", float(not _refuses_flat_cell(ruined)), 0.0)


def crushed(cell: LayeredMesh, count: int) -> LayeredMesh:
    """The cell with up to `count` vertices moved to a thousandth of their height over one opposite face.

    Only vertices inside a layer move, no two of one cell, and none that would invert a cell.
    """
    points = cell.points.copy()
    faces, owners = paired_faces(cell.tets)
    fixed = np.unique(np.concatenate([faces[owners[:, 1] < 0].ravel(), cell.boundaries["interface"].ravel()]))
    movable = np.setdiff1d(np.arange(len(points)), fixed)
    taken = np.zeros(len(points), dtype=bool)
    for vertex in np.random.default_rng(1).permutation(movable):
        around = cell.tets[(cell.tets == vertex).any(axis=1)]
        if taken[around].any():
            continue
        face = points[around[0][around[0] != vertex]]
        normal = np.cross(face[1] - face[0], face[2] - face[0])
        normal /= np.linalg.norm(normal)
        before = points[vertex].copy()
        points[vertex] -= (1 - GIVEN.crushed_height) * ((before - face[0]) @ normal) * normal
        if (volumes(points, around) > 0).all():
            taken[around] = True
            count -= 1
        else:
            points[vertex] = before
        if count == 0:
            break
    return replace(cell, points=points)


def _refuses_flat_cell(mesh: LayeredMesh) -> bool:
    points = mesh.points.copy()
    a, b, c, d = mesh.tets[len(mesh.tets) // 2]
    points[d] = (points[a] + points[b] + points[c]) / 3
    try:
        refuse_unusable(replace(mesh, points=points))
    except MeshError:
        return True
    return False


def _scenes(reduced: ReducedFinger, specimen: Specimen) -> list[Press | None]:
    """A press by each of `loads_gf`, None where it is refused."""
    found: list[Press | None] = []
    for force in GIVEN.loads_gf:
        try:
            found.append(pressed_by(reduced, force, specimen))
        except ContactRangeError:
            found.append(None)
    return found


def _point_load_sd(reduced: ReducedFinger) -> float:
    """S_d (microstrain) per newton of a point force at the apex, by one adjoint solve per gauge."""
    model = default_model()
    apex = int(
        np.argmin(np.linalg.norm(model.space.displacement.doflocs.T - [0, 0, model.mesh.points[:, 2].max()], axis=1))
    )
    downwards = sum(-solution[apex, 2] for solution in default_adjoints().values())
    return float(to_microstrain(reduced.gains * downwards).std())
