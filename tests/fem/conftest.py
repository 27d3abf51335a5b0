"""What the tests of fem share: small structured meshes, synthetic contact patches, and the reference finger."""

import dataclasses
import os

import numpy as np
import pytest
from skfem import Basis, ElementTriP1, LinearForm, MeshTet, MeshTri

from papilla.fem import FingerModel, ReducedFinger, prepare
from papilla.fem.discrete.elements import TaylorHood
from papilla.fem.reduction.compliance import half_space_compliance
from papilla.fem.reduction.patch import Patch
from papilla.mesh.cells import paired_faces, volumes
from papilla.mesh.layered import BONE_LAYER, INNER_LAYER, OUTER_LAYER, LayeredMesh, mirrored
from papilla.model.finger import Dome, Finger


@pytest.fixture(scope="session", autouse=True)
def no_solver_choice():
    """These tests choose their solver themselves; what the caller's environment says does not count."""
    before = os.environ.pop("PAPILLA_SOLVER", None)
    yield
    if before is not None:
        os.environ["PAPILLA_SOLVER"] = before


@pytest.fixture(scope="session")
def reference() -> ReducedFinger:
    """The default finger condensed at its apex."""
    return prepare(Finger.default())


@pytest.fixture(scope="session")
def linear_reference() -> ReducedFinger:
    """The same, of which no table of large strain is known: presses without a fidelity are linear."""
    return dataclasses.replace(prepare(Finger.default()), strain_key="", strain_source=None)


def _oriented(points, tets):
    wrong = volumes(points, tets) < 0
    tets[wrong] = tets[wrong][:, [0, 2, 1, 3]]
    return tets


def _between(points, tets, layer):
    """Triangles between outer and inner cells."""
    faces, cells = paired_faces(tets)
    both = cells[:, 1] >= 0
    pair = np.sort(layer[cells[both]], axis=1)
    return faces[both][(pair == [OUTER_LAYER, INNER_LAYER]).all(axis=1)]


def make_box(divisions=(2, 2, 2), low=(0.0, 0.0, 0.0), high=(1.0, 1.0, 1.0), jitter=0.15, split=True) -> LayeredMesh:
    """A box of tetrahedra: skin above, clamped below, the lower half `INNER`; vertices inside are moved about."""
    axes = [np.linspace(a, b, n + 1) for a, b, n in zip(low, high, divisions, strict=True)]
    grid = MeshTet.init_tensor(*axes)
    points, tets = grid.p.T.copy(), grid.t.T.copy()
    low, high = np.array(low), np.array(high)
    middle = axes[2][divisions[2] // 2]
    inside = ((points > low + 1e-9) & (points < high - 1e-9)).all(axis=1) & (np.abs(points[:, 2] - middle) > 1e-9)
    size = (high - low) / divisions
    points[inside] += jitter * size * np.random.default_rng(7).uniform(-1, 1, (inside.sum(), 3))
    tets = _oriented(points, tets)
    layer = np.where(split & (points[tets].mean(axis=1)[:, 2] < middle), INNER_LAYER, OUTER_LAYER)
    faces, cells = paired_faces(tets)
    faces = faces[cells[:, 1] < 0]
    height = points[faces][:, :, 2]
    skin, base = (height > high[2] - 1e-9).all(axis=1), (height < low[2] + 1e-9).all(axis=1)
    boundaries = {"skin": faces[skin], "base": faces[base], "interface": _between(points, tets, layer)}
    return LayeredMesh(points, tets, layer, boundaries, float(size.max()))


@pytest.fixture(scope="session")
def box_space() -> TaylorHood:
    """Taylor-Hood on a small two-layer box."""
    return TaylorHood(make_box((2, 3, 4)))


def make_dome(finger: Finger, divisions: int = 8, outer_layers: int = 2, inner_layers: int = 3) -> LayeredMesh:
    """A mirrored mesh of a dome, coarse and the same everywhere; the bone is meshed where it has a modulus."""
    shape = finger.shape
    assert isinstance(shape, Dome)
    directions, triangles = _octant(divisions)
    bone, interface, outer = (np.array(axes) for axes in (shape.bone, shape.interface, shape.outer))
    axes = [bone + (interface - bone) * t for t in np.linspace(0, 1, inner_layers + 1)]
    axes += [interface + (outer - interface) * t for t in np.linspace(0, 1, outer_layers + 1)[1:]]
    count = len(directions)
    points = np.concatenate([directions * shell for shell in axes])
    tets = np.concatenate([_prisms(triangles + k * count, triangles + (k + 1) * count) for k in range(len(axes) - 1)])
    layer = np.repeat(
        [INNER_LAYER, OUTER_LAYER], [3 * len(triangles) * inner_layers, 3 * len(triangles) * outer_layers]
    )
    if finger.bone is not None:
        points = np.vstack([points, np.zeros(3)])
        core = np.column_stack([triangles, np.full(len(triangles), len(points) - 1)])
        tets, layer = np.vstack([tets, core]), np.append(layer, np.full(len(triangles), BONE_LAYER))
    tets = _oriented(points, tets)
    faces, cells = paired_faces(tets)
    faces = faces[cells[:, 1] < 0]
    base = (points[faces][:, :, 2] == 0).all(axis=1)
    skin = (faces >= count * (len(axes) - 1)).all(axis=1) & (faces < count * len(axes)).all(axis=1)
    if finger.bone is None:
        base |= (faces < count).all(axis=1)
    boundaries = {"skin": faces[skin], "base": faces[base], "interface": _between(points, tets, layer)}
    return mirrored(LayeredMesh(points, tets, layer, boundaries, 4.0), ("x", "y"))


def _octant(n):
    """Unit vectors of the positive octant on a triangular grid with exact zeros in its planes, and its triangles."""
    index = {(i, j): k for k, (i, j) in enumerate((i, j) for i in range(n + 1) for j in range(n + 1 - i))}
    corners = np.array([(i, j, n - i - j) for i, j in index]) / n
    # Tangents spread the vertices evenly, as on the circle between two axes
    spread = np.sin(corners * np.pi / 2)
    triangles = [(index[i, j], index[i + 1, j], index[i, j + 1]) for i in range(n) for j in range(n - i)]
    triangles += [
        (index[i + 1, j], index[i + 1, j + 1], index[i, j + 1]) for i in range(n - 1) for j in range(n - 1 - i)
    ]
    return spread / np.linalg.norm(spread, axis=1)[:, None], np.array(triangles)


def _prisms(below, above):
    """Three tetrahedra a prism; faces are split from the vertex of lowest number, so that neighbours agree."""
    order = np.argsort(below, axis=1)
    a, b = np.take_along_axis(below, order, axis=1).T, np.take_along_axis(above, order, axis=1).T
    parts = [(a[0], a[1], a[2], b[2]), (a[0], a[1], b[1], b[2]), (a[0], b[0], b[1], b[2])]
    return np.concatenate([np.stack(part, axis=1) for part in parts])


@pytest.fixture(scope="session")
def coarse_model() -> FingerModel:
    """The default finger on a coarse structured mesh: what must hold on any mesh is tested here."""
    return FingerModel(Finger.default(), make_dome(Finger.default()))


@pytest.fixture(scope="session")
def coarse(coarse_model) -> ReducedFinger:
    """The coarse finger condensed at its apex."""
    return coarse_model.reduce()


def make_disc(radius: float, rings: int, gap=None, *, quarter: bool = True, grading: float = 1.0) -> Patch:
    """A disc of concentric rings, as its positive quarter with images or whole.

    `gap(x, y)` in mm; `grading` > 1 makes the rings closer towards the middle.
    """
    xy, triangles = _quarter_disc(rings)
    scale = radius * (np.arange(rings + 1) / rings) ** grading
    ring = np.round(np.hypot(*xy.T)).astype(int)
    xy *= (scale[ring] / np.maximum(ring, 1))[:, None]
    images = [[1, 1], [1, -1], [-1, 1], [-1, -1]]
    if not quarter:
        corners = np.concatenate([xy[triangles] * image for image in images]) + 0.0
        xy, triangles = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
        triangles, images = triangles.reshape(-1, 3), [[1, 1]]
    basis = Basis(MeshTri(xy.T.copy(), triangles.T.copy()), ElementTriP1(), intorder=6)
    mass = LinearForm(lambda v, w: v).assemble(basis)
    weak_gap = LinearForm(lambda v, w: v * (0 * w.x[0] if gap is None else gap(*w.x))).assemble(basis)
    rim = np.hypot(*xy.T) > radius * (1 - 1e-9)
    return Patch(xy, triangles, mass, weak_gap, rim, np.array(images))


def _quarter_disc(rings):
    """Nodes on quarter circles of radius 0, 1, 2 ... and their triangles; exact zeros on the axes."""
    nodes, start = [(0.0, 0.0)], [0]
    for k in range(1, rings + 1):
        start.append(len(nodes))
        angle = np.arange(k + 1) / k * np.pi / 2
        x, y = k * np.cos(angle), k * np.sin(angle)
        x[-1], y[0] = 0.0, 0.0
        nodes += list(zip(x, y, strict=True))
    triangles = []
    for k in range(1, rings + 1):
        for j in range(k):
            triangles.append((start[k] + j, start[k] + j + 1, start[k - 1] + min(j, k - 1)))
            if j < k - 1:
                triangles.append((start[k - 1] + j, start[k] + j + 1, start[k - 1] + j + 1))
    return np.array(nodes), np.array(triangles)


def make_stand_in(patch: Patch, e_star: float) -> ReducedFinger:
    """A half-space with the patch's gap in place of a finger; its gauges read force and second moments of pressure.

    Under a pressure p: strain = (int p, int p x^2, int p y^2), curvature = (int p, 0, 0).
    """
    half_space = half_space_compliance(patch)
    basis = Basis(MeshTri(patch.xy.T.copy(), patch.triangles.T.copy()), ElementTriP1(), intorder=6)
    forms = (lambda v, w: v, lambda v, w: v * w.x[0] ** 2, lambda v, w: v * w.x[1] ** 2)
    rows = len(patch.images) * np.stack([LinearForm(form).assemble(basis) for form in forms])
    return ReducedFinger(
        finger_name="half-space",
        finger_sha256="0" * 64,
        mesh_sha256="0" * 64,
        mesh_size_mm=1.0,
        at=(0.0, 0.0),
        gauge_names=("force", "xx", "yy"),
        outer_modulus=e_star,
        patch=patch,
        compliance=half_space / e_star,
        half_space=half_space,
        rows=np.stack([rows, rows * np.array([[1.0], [0.0], [0.0]])]),
        weights=np.array([np.ones(3), np.zeros(3)]),
        layers=np.array([[1e6, e_star]]),
    )


box, dome, disc, stand_in = (
    pytest.fixture(scope="session", name=make.__name__.removeprefix("make_"))(lambda make=make: make)
    for make in (make_box, make_dome, make_disc, make_stand_in)
)
"""Fixtures that give these functions."""
