"""Map of the pressure between finger and specimen, seen along the contact's normal."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from contourpy import contour_generator
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure
from matplotlib.tri import Triangulation
from scipy.interpolate import LinearNDInterpolator

from papilla.core.errors import InputError
from papilla.core.units import KPA_PER_MPA
from papilla.fem.pressing.contact import contact_shape
from papilla.fem.pressing.ellipses import SHARPEST_Q, layer_factor, peak_over_mean
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.model.specimen import Specimen
from papilla.view.style import (
    INK_COLOR,
    MUTED_COLOR,
    SEQUENTIAL_COLORS,
    THIN_PT,
    color_bar,
    friction_text,
    nice_limit,
    styled,
    titled,
)

BAR_IN, PRESSURE_MAP_IN, MAP_HEIGHT_IN = 1.4, 4.4, 5.6  # Inches of a picture: width of the bar and of a map; height
MAP_ROOM = 1.3  # Half width of a map over the reach of the contact
MAP_PIXELS = 301  # Points across a map, and around a contact
NODE_DOT_AREA = 12  # Area of the dot of a nodal pressure, square points
LAYER_TERMS = np.linspace(-0.5, SHARPEST_Q, 76)  # From the profile with the smallest peak to the sharpest
CONTACT_EDGE = 0.02  # Share of the peak pressure at the edge of a contact that is not an ellipse


def whole_patch(reduced: ReducedFinger, press: Press) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The patch of a press of `reduced` with all mirror images: xy (n, 2) mm, triangles (t, 3), pressure (n,) MPa.

    Nodes on mirror planes occur once in each image.
    """
    patch = reduced.patch
    if press.pressure.shape != (len(patch.xy),):
        raise InputError(f"the press has {len(press.pressure)} pressure nodes, the reduced finger {len(patch.xy)}")
    xy = np.concatenate([patch.xy * image for image in patch.images])
    triangles = np.concatenate([patch.triangles + number * len(patch.xy) for number in range(len(patch.images))])
    return xy, triangles, np.tile(press.pressure, len(patch.images))


@dataclass(frozen=True)
class Profile:
    """The smooth pressure with the force, area and peak of a press.

    centre : (2,) mm. axes : (2, 2), each column from the centre to the edge, mm. mean : pressure, MPa. layer_term : as
    in `papilla.fem.pressing.hertz`.
    """

    centre: np.ndarray
    axes: np.ndarray
    mean: float
    layer_term: float

    def edge(self) -> np.ndarray:
        """Points (n, 2) of the closed line around the contact, mm."""
        angle = np.linspace(0, 2 * np.pi, MAP_PIXELS)
        return self.centre + np.stack([np.cos(angle), np.sin(angle)], axis=1) @ self.axes.T

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Pressure (n,) in MPa at points (n, 2)."""
        square = ((points - self.centre) @ np.linalg.inv(self.axes).T) ** 2
        return self.mean * layer_factor(np.sqrt(np.maximum(0.0, 1 - square.sum(axis=1))), self.layer_term)


def contact_profile(reduced: ReducedFinger, press: Press) -> Profile | None:
    """The profile of a press; its axes follow from the second moments of the pressure. None if the contact is not an
    ellipse."""
    xy, _, pressure = whole_patch(reduced, press)
    mass = np.tile(reduced.patch.mass, reduced.multiplicity)
    share = mass * pressure / (mass @ pressure)
    centre = share @ xy
    away = xy - centre
    square, axes = np.linalg.eigh(away.T @ (share[:, None] * away))
    radii = np.sqrt(press.contact_area / np.pi * square / np.sqrt(square.prod()))
    mean = press.force / press.contact_area
    sharpness = np.array([peak_over_mean(q) for q in LAYER_TERMS])
    profile = Profile(centre, axes * radii, mean, float(np.interp(press.peak_pressure / mean, sharpness, LAYER_TERMS)))
    inside = (profile.edge() >= xy.min(axis=0)).all() and (profile.edge() <= xy.max(axis=0)).all()
    elliptic = press.fidelity == "hertz" or contact_shape(reduced.patch, press.pressure).elliptic
    return profile if inside and elliptic else None


def contact_edge(reduced: ReducedFinger, press: Press) -> list[np.ndarray]:
    """Lines (k, 2) around the contact, in the contact plane: its ellipse or, if it is not an ellipse, the contour of a
    small share of the peak pressure."""
    profile = contact_profile(reduced, press)
    if profile is not None:
        return [profile.edge()]
    xy, _, pressure = whole_patch(reduced, press)
    x, y = np.meshgrid(*[np.linspace(xy.min(), xy.max(), MAP_PIXELS)] * 2)
    generator = contour_generator(x, y, np.nan_to_num(LinearNDInterpolator(xy, pressure)(x, y)), line_type="Separate")
    lines: list[np.ndarray] = generator.lines(CONTACT_EDGE * float(pressure.max()))  # type: ignore[assignment]
    return lines


def contact_figure(
    reduced: ReducedFinger, press: Press, specimen: Specimen | None = None, beside: tuple[Press, Specimen] | None = None
) -> Figure:
    """Map of the contact pressure in kPa over the contact plane, x across the finger, y along it, around the touch-down
    point; two presses are drawn beside each other on one scale.

    The shade is the smooth profile, dots are the nodal pressures; a contact that is not an ellipse has only dots.
    """
    scenes = [(press, specimen), *([] if beside is None else [beside])]
    edges = [line for pressed, _ in scenes for line in contact_edge(reduced, pressed)]
    reach = MAP_ROOM * max(float(np.abs(line).max()) for line in edges)
    peaks = [max(float(pressed.pressure.max()), pressed.peak_pressure) for pressed, _ in scenes]
    limit = nice_limit(KPA_PER_MPA * max(peaks))
    with styled(BAR_IN + PRESSURE_MAP_IN * len(scenes), MAP_HEIGHT_IN) as figure:
        panels = figure.subplots(1, len(scenes), sharey=True, squeeze=False)[0]
        for axes, (pressed, touched) in zip(panels, scenes, strict=True):
            shades = _pressure_map(axes, reduced, pressed, reach, limit)
            if beside is not None and touched is not None:
                axes.set_title(f"{touched.modulus:.3g} MPa {touched.words}", fontsize="medium")
            axes.set_xlabel("x across the finger (mm)")
        panels[0].set_ylabel("y along the finger (mm)")
        color_bar(shades, panels, "contact pressure (kPa)")
        if beside is None:
            on = f"{press.modulus:.3g} MPa {specimen.words}" if specimen else f"{press.modulus:.3g} MPa"
        else:
            on = " and on ".join(f"{pressed.modulus:.3g} MPa" for pressed, _ in scenes)
        peak = " and ".join(f"{KPA_PER_MPA * pressed.peak_pressure:.3g} kPa" for pressed, _ in scenes)
        area = " and ".join(f"{pressed.contact_area:.3g} mm²" for pressed, _ in scenes)
        depth = " and ".join(f"{pressed.indentation:.3g} mm" for pressed, _ in scenes)
        at = f"touched at x {reduced.at[0]:g}, y {reduced.at[1]:g} mm; " if any(reduced.at) else ""
        titled(
            figure,
            f"{press.force:.3g} N on {on}, {friction_text(press.friction)}",
            f"peak {peak}; contact area {area} (dashed); indentation {depth}; {at}{press.status}",
        )
    return figure


def _pressure_map(axes: Axes, reduced: ReducedFinger, press: Press, reach: float, limit: float) -> ScalarMappable:
    """Draw the pressure of a press on axes of finger coordinates, `reach` mm around the touch-down point; returns the
    colours."""
    xy, triangles, pressure = whole_patch(reduced, press)
    profile, at = contact_profile(reduced, press), np.array(reduced.at)
    shading: dict[str, Any] = {"cmap": SEQUENTIAL_COLORS, "vmin": 0, "vmax": limit}
    mesh = Triangulation(*(xy + at).T, triangles)
    if profile is None:
        smoothed: Any = {"shading": "gouraud", "rasterized": True}
        shades: ScalarMappable = axes.tripcolor(mesh, KPA_PER_MPA * pressure, **smoothed, **shading)
    else:
        grid = np.stack(np.meshgrid(*[np.linspace(-reach, reach, MAP_PIXELS)] * 2), axis=-1)
        smooth = KPA_PER_MPA * profile(grid.reshape(-1, 2)).reshape(MAP_PIXELS, MAP_PIXELS)
        ends = (at[0] - reach, at[0] + reach, at[1] - reach, at[1] + reach)
        shades = axes.imshow(smooth, origin="lower", extent=ends, **shading)
        touching = pressure > 0
        dots: Any = {"s": NODE_DOT_AREA, "edgecolors": MUTED_COLOR, "linewidths": THIN_PT / 2}
        x, y = (xy[touching] + at).T
        axes.scatter(x, y, c=KPA_PER_MPA * pressure[touching], **dots, **shading)
    axes.triplot(mesh, color=MUTED_COLOR, linewidth=THIN_PT / 2, alpha=0.5)
    for line in contact_edge(reduced, press):
        axes.plot(*(line + at).T, color=INK_COLOR, linestyle="--")
    axes.set(xlim=(at[0] - reach, at[0] + reach), ylim=(at[1] - reach, at[1] + reach), aspect="equal")
    axes.grid(False)
    return shades
