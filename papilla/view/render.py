"""Renders surfaces to an image with pyvista, offscreen; the same projection places lines and labels.

Without a GL library VTK does not raise an error, it ends the process. So each kind of offscreen window is tried once in
a separate process.
"""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
import pyvista as pv
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from papilla.core.workers import run_program
from papilla.view.style import DIVERGING_COLORS, styled

SUPERSAMPLE_PIXELS = 2  # Rendered pixels per shown pixel, in each direction, for smooth edges
MARGIN_MM = 1.5  # Margin around the content of a picture
AWAY_MM = 500  # Distance of the camera and the lights
PIXELS_PER_MM = 18.0
AROUND_IN = 1.75  # Height of a figure for its title and the colour bar, inches


SKIN_LIGHT = {"ambient": 0.35, "diffuse": 0.75, "specular": 0.05}
SHADE_LIGHT = {"ambient": 0.65, "diffuse": 0.4, "specular": 0.05}
"""Light of plain surfaces, and the softer one of surfaces whose shades must match the colour bar."""


@dataclass(frozen=True, eq=False)
class PaintedSurface:
    """A surface to render: coloured by its point data `scalars` within +-`limit`, red above zero, or with the one
    colour `color`."""

    surface: pv.PolyData
    color: str = "white"
    scalars: str | None = None
    limit: float = 1.0
    opacity: float = 1.0
    lit: bool = True


@dataclass(frozen=True)
class View:
    """A parallel projection: `elevation` above the horizon and `turn` about z in degrees, seen from -y at turn 0.

    centre (mm) is in the middle of the picture, which shows `width_mm` x `height_mm`.
    """

    elevation: float
    turn: float
    centre: tuple[float, ...] = (0.0, 0.0, 0.0)
    width_mm: float = 1.0
    height_mm: float = 1.0

    def axes(self) -> np.ndarray:
        """Unit vectors (3, 3): right, up, and towards the viewer."""
        elevation, turn = np.radians([self.elevation, self.turn])
        toward = np.array([np.sin(turn) * np.cos(elevation), -np.cos(turn) * np.cos(elevation), np.sin(elevation)])
        right = np.array([np.cos(turn), np.sin(turn), 0.0])
        return np.stack([right, np.cross(toward, right), toward])

    def project(self, points: np.ndarray) -> np.ndarray:
        """Positions (..., 2) in mm, to the right and up from the picture's middle, of points (..., 3)."""
        return (np.asarray(points) - np.array(self.centre)) @ self.axes()[:2].T

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of the picture in the coordinates of `project`."""
        return -self.width_mm / 2, self.width_mm / 2, -self.height_mm / 2, self.height_mm / 2


def fitted(view: View, points: np.ndarray) -> View:
    """`view` enlarged to show all `points`, with a margin."""
    flat = points @ view.axes()[:2].T
    low, high = flat.min(axis=0) - MARGIN_MM, flat.max(axis=0) + MARGIN_MM
    centre = (low + high) / 2 @ view.axes()[:2]
    return replace(view, centre=tuple(centre), width_mm=float(high[0] - low[0]), height_mm=float(high[1] - low[1]))


@contextmanager
def framed(view: View, width: float, panels: int = 1) -> Iterator[tuple[Figure, list[Axes]]]:
    """A new figure `width` inches wide, with axes next to each other in the coordinates of `View.project`, and room for
    a title and a bar."""
    with styled(width, width / panels * view.height_mm / view.width_mm + AROUND_IN) as figure:
        frames = list(figure.subplots(1, panels, squeeze=False)[0])
        for axes in frames:
            axes.set(xlim=view.extent[:2], ylim=view.extent[2:], aspect="equal")
            axes.axis("off")
        yield figure, frames


def draw(axes: Axes, parts: list[PaintedSurface], view: View) -> None:
    """Draw rendered parts on axes of `framed`; the caller has made sure that a window exists."""
    axes.imshow(render(parts, view), extent=view.extent, interpolation="antialiased")


def render(parts: list[PaintedSurface], view: View) -> np.ndarray:
    """An RGB image (rows, columns, 3) of the parts on white; the caller has made sure that a window exists."""
    size = [round(SUPERSAMPLE_PIXELS * PIXELS_PER_MM * length) for length in (view.width_mm, view.height_mm)]
    plotter = pv.Plotter(off_screen=True, window_size=size, lighting="none")
    try:
        plotter.background_color = "white"
        _light(plotter, view)
        for painted in parts:
            if painted.surface.n_points:
                _add(plotter, painted)
        _aim(plotter, view)
        return np.asarray(plotter.screenshot(None, return_img=True))
    finally:
        plotter.close()


def _add(plotter: pv.Plotter, painted: PaintedSurface) -> None:
    shading: dict[str, Any] = {"lighting": painted.lit, "smooth_shading": painted.lit, "opacity": painted.opacity}
    if painted.lit:
        shading |= SKIN_LIGHT if painted.scalars is None else SHADE_LIGHT
    if painted.scalars is None:
        plotter.add_mesh(painted.surface, color=painted.color, **shading)
        return
    plotter.add_mesh(
        painted.surface,
        scalars=painted.scalars,
        clim=(-painted.limit, painted.limit),
        cmap=colormaps[DIVERGING_COLORS],
        interpolate_before_map=True,
        show_scalar_bar=False,
        **shading,
    )


def _light(plotter: pv.Plotter, view: View) -> None:
    right, up, toward = view.axes()
    for direction, intensity in ((toward + up - 0.6 * right, 0.8), (toward + right, 0.25)):
        plotter.add_light(pv.Light(position=tuple(direction * AWAY_MM), intensity=intensity, light_type="scene light"))


def _aim(plotter: pv.Plotter, view: View) -> None:
    _, up, toward = view.axes()
    centre = np.array(view.centre)
    plotter.camera.focal_point = tuple(centre)
    plotter.camera.position = tuple(centre + AWAY_MM * toward)
    plotter.camera.up = tuple(up)
    plotter.camera.enable_parallel_projection()
    plotter.camera.parallel_scale = view.height_mm / 2
    plotter.renderer.reset_camera_clipping_range()


WINDOW_VARIABLE = "VTK_DEFAULT_OPENGL_WINDOW"
"""The environment variable that tells VTK which window to open; a value that the user sets is the only one tried."""

HEADLESS_WINDOWS = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")
"""Kinds that need no display (Linux), in the order tried."""
PROBE_SECONDS = 60
_PROBE = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(8, 8)
window.AddRenderer(vtkRenderer())
window.Render()
raise SystemExit(not window.SupportsOpenGL())
"""


@lru_cache(maxsize=1)
def use_offscreen_window() -> bool:
    """Set the window kind for this process; False if VTK cannot render here at all."""
    for window in _candidates():
        if _works(window):
            if window is not None:
                os.environ[WINDOW_VARIABLE] = window
            return True
    return False


def _candidates() -> tuple[str | None, ...]:
    if os.environ.get(WINDOW_VARIABLE):
        return (os.environ[WINDOW_VARIABLE],)
    return HEADLESS_WINDOWS if sys.platform.startswith("linux") else (None,)


def _works(window: str | None) -> bool:
    environment = os.environ if window is None else {**os.environ, WINDOW_VARIABLE: window}
    silent: Any = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return run_program([sys.executable, "-c", _PROBE], PROBE_SECONDS, env=environment, **silent) == 0
