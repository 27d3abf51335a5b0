"""Numbers of a layered half-space in place of a finger, pinned: whoever changes one changes a result, and says so in
CHANGELOG.

A half-space with a smooth kernel added to its compliance, on a disc of few rings: presses of all fidelities on it take
milliseconds. What the numbers should be is tested elsewhere; these pins find what bounds of percents let through.
"""

from dataclasses import replace

import numpy as np
import pytest

from papilla.fem import press
from papilla.fem.pressing.contact import contact_shape
from papilla.fem.reduction.compliance import PatchSurface, half_space_compliance, kernel_compliance
from papilla.model.specimen import Block, HalfSpace, Sphere

SOFT = 0.15  # Contact modulus of the skin, MPa


def smooth(r):
    """Displacement of a buried soft layer, mm per N."""
    return 0.9 * np.exp(-((r / 2.5) ** 2))


def sheared(offset):
    """The same for forces and displacements along all axes, a little coupled."""
    size = smooth(np.linalg.norm(offset, axis=-1))
    tensor = size[..., None, None] * np.diag([0.4, 0.4, 1.0])
    tensor[..., :2, 2], tensor[..., 2, :2] = 0.05 * offset * size[..., None], -0.05 * offset * size[..., None]
    return tensor


@pytest.fixture(scope="module")
def layered(disc, stand_in):
    patch = disc(5.0, 9, lambda x, y: x**2 / 24 + y**2 / 32)
    finger, n = stand_in(patch, SOFT), len(patch.xy)
    surface = PatchSurface(patch)
    own = surface.half_space_tractions(0.45) / (SOFT * (1 - 0.45**2)) + surface.green_tractions(sheared)
    turned = np.repeat([1.0, -1.0, -1.0], n)
    compliance = finger.compliance + kernel_compliance(patch, smooth)
    own = turned[:, None] * own * turned
    own[:n, :n] = compliance
    layers = np.array([[2.0, 0.12], [12.0, 0.03]])
    shear_rows = np.concatenate([0.3 * finger.rows, 0.2 * finger.rows], axis=2)
    return replace(finger, compliance=compliance, layers=layers, tangential_source=lambda: (own[:, n:], shear_rows))


PRESSES = {
    "hertz": (Block(0.3, 10), {"force": 0.03, "fidelity": "hertz"}),
    "hertz, light": (Block(0.3, 10), {"force": 1e-4, "fidelity": "hertz"}),
    "hertz, by depth": (Sphere(1.0, 30.0), {"indentation": 0.06, "fidelity": "hertz"}),
    "contact": (HalfSpace(0.3), {"force": 0.05, "fidelity": "contact"}),
    "contact, wide": (HalfSpace(0.3), {"indentation": 0.5, "fidelity": "contact"}),
    "contact, light": (Block(0.3, 10), {"force": 0.004, "fidelity": "contact"}),
    "auto": (Block(2.0, 10), {"indentation": 0.2}),
    "stuck": (Block(0.3, 10), {"force": 0.05, "fidelity": "contact", "friction": "stick"}),
    "friction": (HalfSpace(0.3), {"force": 0.04, "fidelity": "contact", "friction": 0.06}),
}
# S_d in microstrain, indentation in mm, area in mm2, peak pressure in MPa, share of the indentation by the finger
PINNED = {
    "hertz": (8266.45073, 0.160629005, 6.71294032, 0.00677106256, 0.785521901),
    "hertz, light": (46.710316, 0.00332809741, 0.14122939, 0.00106254447, 0.748293517),
    "hertz, by depth": (2938.13193, 0.06, 1.68149916, 0.00659395768, 0.910662007),
    "contact": (10247.2322, 0.233179315, 9.55938066, 0.00778864009, 0.769595912),
    "contact, wide": (47722.9581, 0.499999999, 21.3201233, 0.0105047848, 0.777315166),
    "contact, light": (1612.28158, 0.0403831129, 1.95170399, 0.00616070247, 0.761111987),
    "auto": (11927.2317, 0.2, 8.08886011, 0.00925897058, 0.961556264),
    "stuck": (10312.7971, 0.226234775, 9.53249509, 0.00779615093, 0.793476162),
    "friction": (9532.26372, 0.200424526, 8.18772393, 0.00734819358, 0.767707152),
}
# Area in mm2 and peak pressure over the mean of shapes
SHAPES = {
    (8, 0.4): (20.6385542, 1.88053162),
    (4, 0.3): (18.0705906, 1.56879644),
    (3, -0.5): (23.5594691, 1.1260981),
    (8, -0.5): (21.19717, 1.13566354),
}


@pytest.mark.parametrize("name", PRESSES)
def test_presses(layered, name):
    specimen, options = PRESSES[name]
    found = press(layered, specimen, **options)
    told = found.sd, found.indentation, found.contact_area, found.peak_pressure, found.finger_share
    assert told == pytest.approx(PINNED[name], rel=1e-6)


def test_compliances(disc):
    """Norms of the matrices of a small disc: a smooth kernel, a half-space, its terms for tractions."""
    patch = disc(3.0, 4)
    found = [half_space_compliance(patch), kernel_compliance(patch, smooth)]
    found += [PatchSurface(patch).half_space_tractions(0.3), PatchSurface(patch).green_tractions(sheared)]
    told = [float(np.linalg.norm(one)) for one in found]
    assert told == pytest.approx([3.220381858, 5.971330428, 3.708345465, 6.163932461], rel=1e-8)


@pytest.mark.parametrize("elements, q, expected", [(8, 0.4, None), (4, 0.3, None), (3, -0.5, -0.2), (8, -0.5, -0.2)])
def test_shapes(disc, elements, q, expected):
    """Profiles with so many elements across the radius and a layer term: the fewer, the more its expected value
    counts."""
    patch = disc(4.0, int(elements * 4 / 2.5))
    t = np.sqrt(np.maximum(0, 1 - (patch.xy**2).sum(axis=1) / 2.5**2))
    shape = contact_shape(patch, 1.5 * (1 - q) * t + 2.5 * q * t**3, expected)
    told = shape.area, shape.peak_pressure
    assert shape.elliptic and told == pytest.approx(SHAPES[elements, q], rel=1e-6)


@pytest.mark.parametrize("power, elliptic", [(5.5, True), (6.5, False)])
def test_how_square_an_ellipse_may_be(disc, power, elliptic):
    """Pressures over |x|^power + |y|^power < 2^power, from a circle to a square."""
    patch = disc(4.0, 20)
    shape = contact_shape(patch, np.maximum(0, 1 - (np.abs(patch.xy / 2) ** power).sum(axis=1)) ** 0.25)
    assert shape.elliptic == elliptic


@pytest.mark.parametrize("share, elliptic", [(0.0099, True), (0.0101, False)])
def test_a_hundredth_of_the_peak_at_the_outline_is_no_ellipse(disc, share, elliptic):
    patch = disc(4.0, 20)
    pressure = np.sqrt(np.maximum(0, 1 - (patch.xy**2).sum(axis=1) / 3.8**2))
    pressure[np.flatnonzero(patch.outline)[0]] = share * pressure.max()
    assert contact_shape(patch, pressure).elliptic == elliptic
