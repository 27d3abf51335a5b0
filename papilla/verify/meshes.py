"""Meshes of the finger: scatter between the shipped ones, meshes moved into other fingers, thin layers, bad cells.

Moved meshes are compared with fresh meshes of these fingers by the mesher (docs/adr/0031). None is drawn here:
`parameters.toml` holds what presses on two fresh meshes gave, the mean of both.
`python benchmarks/moved_meshes.py --stored` draws new ones and prints the table.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from papilla.core import settings
from papilla.core.errors import ContactRangeError, MeshError
from papilla.core.units import gf_to_newton
from papilla.fem import FingerModel, press
from papilla.mesh import build
from papilla.mesh.builder import SHIPPED_VARIANTS
from papilla.mesh.cells import mean_ratio, paired_faces, volumes
from papilla.mesh.finishing import refuse_unusable
from papilla.mesh.layered import LayeredMesh, mirrored
from papilla.model.finger import Dome, Finger, Shape, Slab
from papilla.model.specimen import THICKNESS_MM, Block
from papilla.verify.bodies import apart, compared, off
from papilla.verify.case import Case
from papilla.verify.finger import default_model, default_reduced, pressed_by, residual

MESH_CASES = settings.parameters(__name__)
MOVED_SETTINGS, SCATTER_SETTINGS = MESH_CASES.moved, MESH_CASES.scatter


def scatter() -> Iterator[Case]:
    """Standard deviation over the meshes, relative to the mean; the calibration's intervals contain the same
    scatter."""
    finger, measure = Finger.default(), f"standard deviation of {{}} over its mean, {SHIPPED_VARIANTS} meshes"
    reduced = [FingerModel(finger, build(finger, variant=variant)).reduce() for variant in range(SHIPPED_VARIANTS)]
    for force_gf, bound in zip(SCATTER_SETTINGS.forces_gf, SCATTER_SETTINGS.sd_bounds, strict=True):
        values = [pressed_by(reduced_finger, force_gf).sd for reduced_finger in reduced]
        yield Case(f"S_d at {force_gf} gf", measure.format("S_d"), _spread(values), bound)
    presses = [pressed_by(reduced_finger, SCATTER_SETTINGS.other_gf) for reduced_finger in reduced]
    for key, bound in SCATTER_SETTINGS.other_bounds.items():
        name = key.replace("_", " ")
        spread = _spread([getattr(reduced_finger, key) for reduced_finger in presses])
        yield Case(f"{name} at {SCATTER_SETTINGS.other_gf} gf", measure.format(name), spread, bound)
    highest = float(np.mean([reduced_finger.sd for reduced_finger in presses]))
    worst = max(
        _spread([reduced_finger.reading[k] for reduced_finger in presses], highest) for k in range(len(finger.gauges))
    )
    about = f"standard deviation of the worst gauge's reading over S_d, {SHIPPED_VARIANTS} meshes"
    yield Case(f"readings at {SCATTER_SETTINGS.other_gf} gf", about, worst, SCATTER_SETTINGS.gauge_bound)


def _spread(values, scale: float | None = None) -> float:
    return float(np.std(values, ddof=1) / abs(np.mean(values) if scale is None else scale))


def fingers() -> dict[str, Finger]:
    """A dome of revolution, a dome of half size with gauges elsewhere, and a slab."""
    return {name: _finger(**measures) for name, measures in MOVED_SETTINGS.fingers.items()}


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
    kept_fingers = MOVED_SETTINGS.fingers
    for name, finger in fingers().items():
        answers = pressed(finger, build(finger))
        for answer, stored, force_gf in zip(
            answers, np.array(kept_fingers[name].stored), MOVED_SETTINGS.forces_gf, strict=True
        ):
            errors = {
                "S_d": off(answer[0], stored[0]),
                "gauges": apart(answer[1:6], stored[1:6]),
                "indentation": off(answer[6], stored[6]),
            }
            if force_gf != MOVED_SETTINGS.lightest_gf:
                errors["contact area"] = off(answer[7], stored[7])
            for quantity, error in errors.items():
                slab = (name, quantity) == ("slab", "contact area")
                bound = MOVED_SETTINGS.slab_area_bound if slab else MOVED_SETTINGS.bounds[quantity]
                measure = f"{quantity} on a moved mesh against the mean of two fresh ones"
                yield Case(f"{name}, {force_gf:g} gf, {quantity}", measure, error, bound)


def pressed(
    finger: Finger,
    mesh: LayeredMesh,
    moduli_MPa: Sequence[float] = (MOVED_SETTINGS.modulus_MPa,),
    forces_gf=MOVED_SETTINGS.forces_gf,
) -> np.ndarray:
    """(presses, 8) a row as `stored` for each modulus and force; NaN where the contact would leave its patch."""
    reduced, rows = FingerModel(finger, mesh).reduce(), []
    for modulus, force_gf in product(moduli_MPa, forces_gf):
        block, force = Block(modulus, THICKNESS_MM), gf_to_newton(force_gf)
        try:
            touch = press(reduced, block, force=force, fidelity="contact", friction=0.0)
        except ContactRangeError:
            rows.append([np.nan] * (3 + len(reduced.gauge_names)))
        else:
            rows.append([touch.sd, *touch.reading, touch.indentation, touch.contact_area])
    return np.array(rows)


def thin_layer() -> Iterator[Case]:
    """An outer layer of 0.3 mm, thinner than an element: with equal moduli it must have no effect."""
    base = default_model().finger
    shape = base.shape
    assert isinstance(shape, Dome)
    x, y, z = (axis - MESH_CASES.thin_mm for axis in shape.outer)
    thin = replace(base, shape=replace(shape, interface=(x, y, z)))
    mesh = build(thin)
    quality = float(mean_ratio(mesh.points, mesh.tets).min())
    computed, expected = (
        pressed_by(FingerModel(replace(finger, outer=base.inner), on).reduce(), MESH_CASES.firm_gf)
        for finger, on in ((thin, mesh), (base, default_model().mesh))
    )
    name = f"outer layer of {MESH_CASES.thin_mm:g} mm (worst cell of mean ratio {quality:.2g})"
    against = f"at {MESH_CASES.firm_gf} gf with equal moduli, against the layer of 3 mm (same body, other mesh)"
    yield from compared(name, against, computed, expected, **MESH_CASES.thin_bounds)
    yield residual(name, FingerModel(thin, mesh))


def slivers() -> Iterator[Case]:
    """The default mesh with crushed cells, and one with a flat cell."""
    base = default_model()
    ruined = crushed(base.mesh.cell(), MESH_CASES.slivers)
    ratio = mean_ratio(ruined.points, ruined.tets)
    model = FingerModel(base.finger, mirrored(ruined, base.mesh.mirrors))
    pressed = pressed_by(model.reduce(), MESH_CASES.firm_gf)
    sound = pressed_by(default_reduced(), MESH_CASES.firm_gf)
    name = f"{int((ratio < MESH_CASES.sliver_ratio).sum())} slivers down to mean ratio {ratio.min():.1g}"
    against = f"at {MESH_CASES.firm_gf} gf, against the sound mesh"
    yield Case(f"{name}, S_d", f"S_d {against} (stated: 3 %)", off(pressed.sd, sound.sd), MESH_CASES.stated)
    yield from compared(name, against, pressed, sound, indentation=MESH_CASES.crushed_indentation_bound)
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
        points[vertex] -= (1 - MESH_CASES.crushed_height) * ((before - face[0]) @ normal) * normal
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
