"""The pressure between finger and specimen, seen along the contact's normal."""

import numpy as np
from contourpy import contour_generator
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from scipy.interpolate import LinearNDInterpolator

from papilla.errors import InputError
from papilla.fem.pressing.contact import contact_shape
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.view.style import INK, MUTED, SEQUENTIAL, color_bar, nice_limit, styled, titled

KPA = 1000.0
CONTACT_EDGE = 0.02  # Share of the peak pressure whose contour is the edge of a contact that is no ellipse


def whole_patch(reduced: ReducedFinger, press: Press) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The patch of a press of `reduced` with all mirror images: xy (n, 2) mm, triangles (t, 3), pressure (n,) MPa.

    Nodes on mirror planes occur once an image.
    """
    patch = reduced.patch
    if press.pressure.shape != (len(patch.xy),):
        raise InputError(f"the press has {len(press.pressure)} pressure nodes, the reduced finger {len(patch.xy)}")
    xy = np.concatenate([patch.xy * image for image in patch.images])
    triangles = np.concatenate([patch.triangles + number * len(patch.xy) for number in range(len(patch.images))])
    return xy, triangles, np.tile(press.pressure, len(patch.images))


def contact_edge(reduced: ReducedFinger, press: Press) -> list[np.ndarray]:
    """Lines (k, 2) around the contact, in the contact plane.

    An ellipse of the stated area with the axis ratio of the pressure's second moments, which is as smooth as the gauge
    rows; where the contact is no ellipse, the contour of a small share of the peak pressure.
    """
    xy, _, pressure = whole_patch(reduced, press)
    mass = np.tile(reduced.patch.mass, reduced.multiplicity)
    share = mass * pressure / (mass @ pressure)
    centre = share @ xy
    away = xy - centre
    square, axes = np.linalg.eigh(away.T @ (share[:, None] * away))
    ratio = np.sqrt(square / np.sqrt(square.prod()))
    angle = np.linspace(0, 2 * np.pi, 181)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ellipse = centre + np.sqrt(press.contact_area / np.pi) * (circle * ratio) @ axes.T
    inside = (ellipse >= xy.min(axis=0)).all() and (ellipse <= xy.max(axis=0)).all()
    if inside and (press.fidelity == "hertz" or contact_shape(reduced.patch, press.pressure).elliptic):
        return [ellipse]
    x, y = np.meshgrid(*[np.linspace(xy.min(), xy.max(), 241)] * 2)
    generator = contour_generator(x, y, np.nan_to_num(LinearNDInterpolator(xy, pressure)(x, y)), line_type="Separate")
    lines: list[np.ndarray] = generator.lines(CONTACT_EDGE * float(pressure.max()))  # type: ignore[assignment]
    return lines


def contact_figure(reduced: ReducedFinger, press: Press) -> Figure:
    """Map of the contact pressure in kPa over the contact plane, x across the finger, y along it."""
    xy, triangles, pressure = whole_patch(reduced, press)
    edges = contact_edge(reduced, press)
    reach = 1.3 * max(float(np.abs(line).max()) for line in edges)
    limit = nice_limit(KPA * float(pressure.max()))
    with styled(5.6, 5.2) as figure:
        axes = figure.add_axes((0.12, 0.1, 0.66, 0.72))
        mesh = Triangulation(*xy.T, triangles)
        shades = axes.tripcolor(
            mesh, KPA * pressure, shading="gouraud", cmap=SEQUENTIAL, vmin=0, vmax=limit, rasterized=True
        )
        axes.triplot(mesh, color=MUTED, linewidth=0.3, alpha=0.5)
        for line in edges:
            axes.plot(*line.T, color=INK, linewidth=1.4, linestyle=(0, (4, 1.5)))
        axes.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
        axes.set(xlabel="x across the finger (mm)", ylabel="y along the finger (mm)")
        axes.grid(False)
        color_bar(figure, shades, (0.83, 0.1, 0.03, 0.72), "contact pressure (kPa)")
        what = f"{press.force:.3g} N on {press.modulus:.3g} MPa: peak {KPA * press.peak_pressure:.3g} kPa"
        facts = f"contact area {press.contact_area:.3g} mm² (dashed), indentation {press.indentation:.3g} mm"
        titled(figure, what, facts + "; mesh in grey" + ", too coarse" * (not press.resolved))
    return figure
