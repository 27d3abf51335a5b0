"""A made-up press for tests of pictures: a contact, a finger that is cut, and fields of its gauges."""

import math
from types import SimpleNamespace

import numpy as np
import pyvista as pv

from papilla.model.finger import Finger
from papilla.view import section, strain_field

FINGER = Finger.default()
AREA = math.pi * 4.0 * 2.0
"""Of the made-up contact: an ellipse of 4 mm along y and 2 mm along x."""


def press(**changes):
    """A press of 0.5 N with five readings."""
    reading = np.array([-100.0, 250.0, 1500.0, 250.0, -100.0])
    given = {
        "force": 0.5, "modulus": 0.2, "friction": 0.0, "sd": 577.0, "reading": reading, "strain": reading * 1e-6,
        "indentation": 0.75, "contact_area": AREA, "peak_pressure": 1.5 * 0.5 / AREA, "fidelity": "hertz",
        "resolved": True, "status": "a made-up press",
    }  # fmt: skip
    return SimpleNamespace(**given | changes)


def reduced(at=(0.0, 0.0), sharpness=0.5):
    """A quarter of a patch with Hertz's pressure over the ellipse, and its press."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 6, 61), np.linspace(0, 6, 61)))
    pressure = np.maximum(1 - (x / 2) ** 2 - (y / 4) ** 2, 0) ** sharpness
    mass = 0.01 * np.where(x == 0, 0.5, 1.0) * np.where(y == 0, 0.5, 1.0)
    images = np.array([(1, 1), (-1, 1), (1, -1), (-1, -1)])
    triangles = np.array([(0, 1, 61), (1, 62, 61)])
    patch = SimpleNamespace(xy=np.column_stack([x, y]), triangles=triangles, mass=mass, images=images)
    scale = 0.5 / (4 * mass @ pressure)
    found = SimpleNamespace(patch=patch, multiplicity=4, at=at, finger_sha256=FINGER.sha256)
    return found, press(pressure=scale * pressure, peak_pressure=scale)


SPECIMEN = SimpleNamespace(modulus=0.2, words="block 4 mm thick")


def cube():
    """A field on a cube of side 2 around the origin, 3 x 3 x 3 points, moved by (0.1 z, 0, 0.05 x)."""
    grid = pv.ImageData(dimensions=(3, 3, 3), origin=(-1, -1, -1)).to_tetrahedra(5)
    points, tets = np.array(grid.points), grid.cells.reshape(-1, 5)[:, 1:]
    faces = pv.UnstructuredGrid({pv.CellType.TETRA: tets}, points).extract_surface(algorithm="dataset_surface")
    skin = faces.point_data["vtkOriginalPointIds"][faces.regular_faces]
    top = skin[(points[skin][:, :, 2] == 1).all(axis=1)]
    mesh = SimpleNamespace(
        points=points, tets=tets, layer=np.where(points[tets].mean(axis=1)[:, 2] > 0, 0, 1),
        boundaries={"skin": skin, "interface": top},
    )  # fmt: skip
    moved = np.column_stack([0.1 * points[:, 2], 0 * points[:, 0], 0.05 * points[:, 0]])
    return SimpleNamespace(mesh=mesh, displacement=moved)


def drawn_parts():
    """A cut with one face, bars of gauges and a bone; a block; and the line around a contact."""
    points = np.array([[-10.0, 0, 0], [10, 0, 0], [0, 0, 10]])
    faces = (section.Face(points, np.array([[0, 1, 2]]), np.array([-1.0, 2.0, 4.6])),)
    bars = np.array([[[x - 1, 0, 5], [x + 1, 0, 5]] for x in (-6.0, -3.0, 0.0, 3.0, 6.0)])
    ring = np.array([[-2.0, 0, 0], [2, 0, 0], [0, 0, 2]])
    cut = section.Section(faces, {"skin": [points[[0, 2, 1]]], "interface": [bars[:, 0]]}, [ring], bars)
    solid = pv.Box((-4, 4, 0, 4, 10, 14)).triangulate()
    outline = [np.array([[-2.0, 0, 10], [2, 0, 10]])]
    return cut, solid, outline


def drawn(scene, reduced, finger, shown="strain", scale=1.0):
    """`papilla.view.strain_field.drawn` of any scene: always the same parts."""
    cut, solid, outline = drawn_parts()
    touched = np.array([1.0, 0, 9.0]) if any(reduced.at) else None
    return strain_field.Drawn(cut, pv.Sphere(radius=3.0), solid, outline, touched)


def bump():
    """Fields on a dome of points: a bump above g2, stretched by 2e-4 per newton times 1e3."""
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-20, 20, 21), np.linspace(-25, 25, 21)))
    outer = np.array(FINGER.shape.outer)
    points = np.column_stack([x, y, outer[2] * np.sqrt(np.maximum(1 - (x / outer[0]) ** 2 - (y / outer[1]) ** 2, 0))])
    triangles = pv.PolyData(points).delaunay_2d().regular_faces
    fields = np.array([sign * 0.25 * np.exp(-((x - at) ** 2 + y**2) / 20) for sign, at in
                       ((1, -16), (1, -8), (-1, 0), (1, 8), (1, 16))])  # fmt: skip
    mesh = SimpleNamespace(points=points, boundaries={"skin": triangles})
    return SimpleNamespace(mesh=mesh, vertices=np.arange(len(points)), strain_per_newton=fields)


def dome():
    """A field on the upper part of the default finger, in two layers of cells, pressed in by 0.5 mm around the apex."""
    across = np.linspace(-2, 2, 17)
    u, v = np.meshgrid(across, across, indexing="ij")
    rays = np.stack([u, v, np.ones_like(u)], axis=-1) / np.sqrt(u**2 + v**2 + 1)[..., None]
    shape = FINGER.shape
    points = np.concatenate(
        [(rays * np.array(one)).reshape(-1, 3) for one in (shape.bone, shape.interface, shape.outer)]
    )
    number = np.arange(len(points)).reshape(3, 17, 17)
    tets, layer = [], []
    # Kuhn's six tetrahedra of each cell: the ways from one corner to the opposite one along three edges
    for below in range(2):
        low = np.stack(np.meshgrid([below], range(16), range(16), indexing="ij"), axis=-1).reshape(-1, 3)
        for way in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)):
            corners = [low]
            for axis in way:
                corners.append(corners[-1] + np.eye(3, dtype=int)[axis])
            cells = np.stack([number[tuple(corner.T)] for corner in corners], axis=1)
            sides = points[cells[:, 1:]] - points[cells[:, :1]]
            tets.append(np.where((np.linalg.det(sides) < 0)[:, None], cells[:, [0, 2, 1, 3]], cells))
            layer.append(np.full(len(cells), 1 - below))
    tets = np.concatenate(tets)

    def surface(number):
        a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
        return np.concatenate([np.stack(three, axis=-1).reshape(-1, 3) for three in ((a, b, c), (a, c, d))])

    boundaries = {"skin": surface(number[2]), "interface": surface(number[1])}
    mesh = SimpleNamespace(points=points, tets=tets, layer=np.concatenate(layer), boundaries=boundaries)
    moved = np.zeros_like(points)
    moved[:, 2] = -0.5 * np.exp(-(points[:, 0] ** 2 + points[:, 1] ** 2) / 16) * points[:, 2] / 20
    moved[:, 0] = 0.01 * points[:, 0]
    x, _, z = points[tets].mean(axis=1).T
    strain = np.zeros((len(tets), 3, 3))
    strain[:, 0, 0], strain[:, 2, 2], strain[:, 0, 2] = 0.01 * np.exp(-((x / 6) ** 2)), -0.02, 0.001 * x
    strain[:, 2, 0] = strain[:, 0, 2]
    return SimpleNamespace(
        mesh=mesh, displacement=moved, strain=strain, stress=0.1 * strain * (1 + z / 20)[:, None, None]
    )
