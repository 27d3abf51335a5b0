"""The finger's section at y = 0 as a structured, graded, conforming triangle mesh: the same on every machine.

Columns run from the bone to the skin at constant ellipse parameter, evenly spaced in x on the skin that may touch; rows
follow the layers. Ridges are added to the skin. The mesh is symmetric about x = 0.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.mesh.body import patch_radius_mm
from papilla.mesh.layered import BONE_LAYER, INNER_LAYER, OUTER_LAYER
from papilla.model.finger import Dome, Finger, Slab

SECTION_SIZE_MM = 0.1
"""Length (mm) of the skin's elements in the contact patch."""

PATCH_SHARE = 0.5
"""Share of the skin's half width within which contact is possible; the finger's patch radius limits it, too."""

ROW_GROWTH, COARSEST_ROW_MM, COARSEST_RAD = 1.3, 1.5, 0.1
"""Ratio of neighbouring rows and columns away from the contact, and the largest row and column."""

MOST_NODES = 500
"""Largest number of nodes of a contact patch: the condensed matrices are dense in them."""


@dataclass(frozen=True, eq=False)
class Section:
    """Triangles of a section.

    points : (n, 2) x and z in mm. triangles : (m, 3) vertices. layer : (m,) `OUTER`, `INNER`, `BONE`.
    base : (k,) clamped vertices. spans : (e, 2) edges that may touch, left to right: ridge tops, or skin.
    half_width : the patch reaches from -half_width to half_width, mm.
    """

    points: np.ndarray
    triangles: np.ndarray
    layer: np.ndarray
    base: np.ndarray
    spans: np.ndarray
    half_width: float


def section_finger(finger: Finger) -> Finger:
    """The finger extruded from its section at y = 0, in which the gauges must lie.

    Raises `InputError` for surface files, and for a gauge beside the section.
    """
    shape = finger.shape
    if isinstance(shape, Slab):
        slab = shape
    elif isinstance(shape, Dome):
        outer, interface, bone = ((axes[0], axes[2]) for axes in (shape.outer, shape.interface, shape.bone))
        slab = Slab(outer, interface, bone)
    else:
        raise InputError("a sliding scene needs a finger of kind dome or slab: surface files have no exact section")
    for gauge in finger.gauges:
        if gauge.y_mm != 0:
            raise InputError(
                f"gauge {gauge.name} sits at y_mm {gauge.y_mm:g}: a sliding scene knows only the section at y = 0"
            )
    return replace(finger, shape=slab)


def patch_half_width(finger: Finger) -> float:
    """Half width (mm), from the apex, of the part of the section's skin that may touch; raises what `section_finger`
    raises."""
    shape = section_finger(finger).shape
    assert isinstance(shape, Slab)
    return min(patch_radius_mm(finger), PATCH_SHARE * shape.outer[0])


def build_section(finger: Finger, *, size_mm: float = SECTION_SIZE_MM) -> Section:
    """Mesh of the section with elements of `size_mm` at the skin, with the finger's ridges if it has any.

    Raises `InputError` as `section_finger`, and for a patch of more than `MOST_NODES` nodes.
    """
    shape = section_finger(finger).shape
    assert isinstance(shape, Slab)
    checks.positive("size_mm", size_mm)
    half_width = patch_half_width(finger)
    on_skin, tops = _skin_columns(finger, half_width, size_mm)
    angles = _angles(on_skin, shape.outer[0])
    across = _rows(finger, shape, size_mm)
    points, triangles, layer, number = _grid(shape, angles, across, finger.bone is not None)
    points[np.abs(points[:, 1]) < 1e-9, 1] = 0.0
    skin = number[-1]
    base = points[:, 1] == 0
    if finger.bone is None:
        base[number[0]] = True
    first = len(angles) - len(on_skin) >> 1
    patch = skin[first : first + len(on_skin)]
    if tops is None:
        spans = np.column_stack([patch[:-1], patch[1:]])
    else:
        points, triangles, layer, spans = _ridges(finger, points, triangles, layer, patch, tops, size_mm)
        base = np.append(base, np.zeros(len(points) - len(base), dtype=bool))
    if (count := len(np.unique(spans))) > MOST_NODES:
        many = f"{count} nodes in the contact patch, {MOST_NODES} at most"
        raise InputError(f"{many}: take a larger size_mm, or a smaller patch_radius_mm of the finger")
    return Section(points, triangles, layer, np.flatnonzero(base), spans, float(on_skin[-1]))


def _skin_columns(finger: Finger, half_width: float, size: float) -> tuple[np.ndarray, list[tuple[int, int]] | None]:
    """x of the columns in the patch, and first and last column of each ridge (None for a smooth skin)."""
    if finger.ridges is None:
        count = max(4, math.ceil(half_width / size))
        return np.linspace(-half_width, half_width, 2 * count + 1), None
    pitch, width = finger.ridges.pitch, finger.ridges.width
    most = math.floor((half_width - width / 2) / pitch)
    if most < 1:
        raise InputError(f"ridge pitch {pitch:g} mm leaves fewer than three ridges on the contact patch")
    top = np.linspace(-width / 2, width / 2, max(4, math.ceil(width / size)) + 1)
    gap = np.linspace(width / 2, pitch - width / 2, max(2, math.ceil((pitch - width) / size)) + 1)[1:-1]
    columns: list[float] = []
    tops = []
    for k in range(-most, most + 1):
        tops.append((len(columns), len(columns) + len(top) - 1))
        columns += [*(k * pitch + top), *(k * pitch + gap if k < most else ())]
    symmetric = np.array(columns)
    return (symmetric - symmetric[::-1]) / 2, tops


def _angles(on_skin: np.ndarray, half_axis: float) -> np.ndarray:
    """Ellipse parameters of all columns, growing from the patch to the base plane on either side."""
    inside = np.arcsin(on_skin / half_axis)
    outside = _graded(math.pi / 2 - inside[-1], inside[-1] - inside[-2], COARSEST_RAD)[1:]
    right = inside[-1] + outside
    right[-1] = math.pi / 2
    return np.concatenate([-right[::-1], inside, right])


def _graded(length: float, first: float, largest: float) -> np.ndarray:
    """Positions from 0 to `length` whose steps grow from about `first` to at most about `largest`."""
    steps = [first]
    while sum(steps) < length:
        steps.append(min(steps[-1] * ROW_GROWTH, largest))
    places = np.concatenate([[0.0], np.cumsum(steps)])
    return places * (length / places[-1])


def _rows(finger: Finger, shape: Slab, size: float) -> list[tuple[int, np.ndarray, tuple, tuple]]:
    """Rows from the inside out: layer, relative positions across it, and the semi-axes between which it lies."""
    skin, soft = shape.outer[1] - shape.interface[1], shape.interface[1] - shape.bone[1]
    down = _graded(skin, size, COARSEST_ROW_MM / 2)
    deep = _graded(soft, down[-1] - down[-2], COARSEST_ROW_MM)
    rows = [
        (INNER_LAYER, 1 - deep[::-1] / soft, shape.bone, shape.interface),
        (OUTER_LAYER, 1 - down[::-1] / skin, shape.interface, shape.outer),
    ]
    if finger.bone is not None:
        rows.insert(0, (BONE_LAYER, np.linspace(0, 1, 6), (0.0, 0.0), shape.bone))
    return rows


def _grid(shape: Slab, angles: np.ndarray, rows, with_core: bool):
    """Points, triangles and layers of the smooth section, and the vertex numbers (rows, columns)."""
    sides = np.stack([np.sin(angles), np.cos(angles)], axis=1)
    sides[[0, -1]] = [[-1.0, 0.0], [1.0, 0.0]]
    curves: list[np.ndarray] = []
    of_row: list[int] = []
    for layer, shares, inside, outside in rows:
        start = 0 if not curves else 1
        for share in shares[start:]:
            curves.append(sides * ((1 - share) * np.array(inside) + share * np.array(outside)))
        of_row += [layer] * (len(shares) - 1)
    flat = np.concatenate(curves)
    number = np.arange(len(flat)).reshape(len(curves), len(angles))
    if with_core:
        number[0] = number[0, 0]
    triangles, layer = [], []
    for index, layer_number in enumerate(of_row):
        cells = _split(number[index], number[index + 1], angles)
        triangles.append(cells)
        layer.append(np.full(len(cells), layer_number))
    cells, kinds = np.concatenate(triangles), np.concatenate(layer)
    distinct = cells[:, 0] != cells[:, 1]  # all but those along the innermost row of a core, which is one point
    cells, kinds = cells[distinct], kinds[distinct]
    used, compact = np.unique(cells, return_inverse=True)
    place = np.full(len(flat), -1)
    place[used] = np.arange(len(used))
    return flat[used], compact.reshape(cells.shape), kinds, place[number]


def _split(below: np.ndarray, above: np.ndarray, across: np.ndarray) -> np.ndarray:
    """Two triangles per cell between two rows; the diagonals are mirrored about the middle column."""
    a, b, c, d = below[:-1], below[1:], above[1:], above[:-1]
    left_half = (across[:-1] + across[1:] < 0)[:, None]
    first = np.where(left_half, np.column_stack([a, b, c]), np.column_stack([a, b, d]))
    second = np.where(left_half, np.column_stack([a, c, d]), np.column_stack([b, c, d]))
    return np.concatenate([first, second])


def _ridges(finger: Finger, points, triangles, layer, patch, tops, size):
    """The mesh with a block of the outer layer on the columns of each ridge, and the edges of the ridge tops."""
    assert finger.ridges is not None
    levels = np.linspace(0, finger.ridges.height, max(2, math.ceil(finger.ridges.height / size)) + 1)[1:]
    all_points, cells, spans = [points], [triangles], []
    count = len(points)
    for first, last in tops:
        below = patch[first : last + 1]
        foot = points[below]
        for level in levels:
            above = count + np.arange(len(foot))
            count += len(foot)
            all_points.append(foot + [0.0, level])
            cells.append(_split(below, above, foot[:, 0]))
            below = above
        spans.append(np.column_stack([below[:-1], below[1:]]))
    new = np.concatenate(cells)
    kinds = np.append(layer, np.full(len(new) - len(layer), OUTER_LAYER))
    return np.concatenate(all_points), new, kinds, np.concatenate(spans)
