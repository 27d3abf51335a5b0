"""What touches the finger, as drawn: the specimen's solid, and the outline of the contact on the skin. In mm."""

import numpy as np
import pyvista as pv
from scipy.interpolate import LinearNDInterpolator

from papilla.fem.fields import Field
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.patch import Frame
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.finger import Finger
from papilla.mesh.surfaces import surfaces_of
from papilla.specimen import Specimen, Sphere
from papilla.view.contact_map import contact_edge

DRAWN_THICKNESS = 10.0  # mm of a half-space, or of a thicker block, that are drawn


def contact_frame(finger: Finger, at: tuple[float, float]) -> Frame:
    """The contact plane at touch-down point `at` (x, y)."""
    return Frame.at(surfaces_of(finger)["skin"], *at)


def specimen_solid(
    specimen: Specimen, field: Field, frame: Frame, press: Press, half_width: float, scale: float
) -> pv.PolyData:
    """The specimen's closed surface; where the finger bulges into it, its face follows the skin.

    `scale` multiplies the approach, as it does the finger's displacement.
    """
    approach = scale * press.indentation
    if isinstance(specimen, Sphere):
        solid = pv.Sphere(
            radius=specimen.radius, center=(0, 0, specimen.radius - approach), theta_resolution=120, phi_resolution=120
        ).clean()
    else:
        thickness = min(getattr(specimen, "thickness", DRAWN_THICKNESS), DRAWN_THICKNESS)
        x, y, level = np.meshgrid(*[np.linspace(-half_width, half_width, 81)] * 2, [0.0, 1.0], indexing="ij")
        skin = _skin_height(field, frame, scale)(x[:, :, 0], y[:, :, 0])
        height = specimen.gap(np.column_stack([x[:, :, 0].ravel(), y[:, :, 0].ravel()])).reshape(skin.shape)
        face = np.fmin(np.fmax(height - approach, skin), thickness - approach)
        z = np.where(level > 0, thickness - approach, face[:, :, None])
        solid = pv.StructuredGrid(x, y, z).extract_surface(algorithm="dataset_surface").triangulate().clean()
    solid.points = solid.points @ frame.axes + frame.origin
    return solid


def contact_outline(field: Field, reduced: ReducedFinger, press: Press, frame: Frame, scale: float) -> list[np.ndarray]:
    """Closed lines (k, 3) around the contact, on the deformed skin."""
    height = _skin_height(field, frame, scale)
    lines = contact_edge(reduced, press)
    return [np.column_stack([line, height(line)]) @ frame.axes + frame.origin for line in lines]


def _skin_height(field: Field, frame: Frame, scale: float) -> LinearNDInterpolator:
    """Local height of the deformed skin that faces the contact plane, over local (x, y); NaN beside it."""
    vertices = np.unique(field.mesh.boundaries["skin"])
    local = frame.local(field.mesh.points[vertices] + scale * field.displacement[vertices])
    # The far side of a closed skin may lie below the same (x, y): keep the sheet above the frame's horizon.
    upper = local[:, 2] > 0.9 * local[:, 2].min()
    return LinearNDInterpolator(local[upper, :2], local[upper, 2])
