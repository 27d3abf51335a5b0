"""The section during sliding, as a movie: pressure, strain and the gauges' signals."""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.animation import PillowWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.tri import Triangulation
from skfem import Basis, ElementTriP2, ElementVector

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.files import replacing
from papilla.core.units import PER_CENT, TINY_DIVISOR
from papilla.fem.sliding.section import SectionModel
from papilla.fem.sliding.slide import Slide
from papilla.mesh.section import build_section
from papilla.model.finger import Finger
from papilla.model.textures import Texture
from papilla.view.style import (
    ACCENT_COLORS,
    DIVERGING_COLORS,
    INK_COLOR,
    MUTED_COLOR,
    RIGID_COLOR,
    in_a_row,
    named,
    styled,
)

MOVIE_FRAMES, FRAMES_A_SECOND, MOVIE_DPI = 60, 12, 90
MOVIE_HEIGHT_IN = 6.0
"""Height of the movie, inches."""
HALF_WIDTH_RATIO, DEPTH_BELOW_RATIO, OVER_MM = 1.6, 0.8, 3.0
"""Half width of the picture over that of the contact; depth below the skin over this; mm of texture above the skin."""
BARS_MM = 0.6, 2.8
"""Where the bars of pressure begin and end above the skin, mm."""
COMMON_PER_CENT = 99.7
"""Per cent of the strains, and of the signals, that lie within the limits: about three sigmas."""
TEXTURE_POINTS = 1200
"""Points of the texture across the picture."""
SIGNAL_S = 0.25
"""Seconds of signal before each frame."""


def write_slide_movie(
    path: str | Path, finger: Finger, texture: Texture, slide: Slide, frames: int = MOVIE_FRAMES
) -> None:
    """Write a GIF of a slide with `frames` evenly spaced samples.

    Each frame shows the strain along x of the deformed section under the instantaneous forces (without inertia), the
    texture, the nodal pressure, and each gauge's signal. Raises `InputError` unless the path ends in .gif and the
    finger has the ridges of the slide, and `FileAccessError`.
    """
    if Path(path).suffix.lower() != ".gif":
        raise InputError(f"{path}: a moving picture is written as .gif")
    if finger.ridge_pitch_mm != slide.ridge_pitch_mm:
        raise InputError(
            f"the finger has ridges every {finger.ridge_pitch_mm:g} mm, the one that slid every "
            f"{slide.ridge_pitch_mm:g} mm (0 is none): give the finger that slid"
        )
    samples = np.unique(np.linspace(0, len(slide.readings) - 1, frames).round().astype(int))
    model = SectionModel(finger, build_section(finger))
    moved, strain = _fields(model, slide, samples)
    points, triangles = model.section.points, model.section.triangles
    width, top = HALF_WIDTH_RATIO * model.section.half_width, points[:, 1].max()
    limit = PER_CENT * float(np.percentile(np.abs(strain), COMMON_PER_CENT))
    with styled(height=MOVIE_HEIGHT_IN) as figure, replacing(path) as temporary:
        FigureCanvasAgg(figure)
        body, signal = figure.subplots(2, 1, height_ratios=(2, 1))
        writer = PillowWriter(fps=FRAMES_A_SECOND)
        with (
            matplotlib.rc_context({"savefig.dpi": MOVIE_DPI}),
            writer.saving(figure, f"{temporary}.gif", dpi=MOVIE_DPI),
        ):
            for frame, sample in enumerate(samples):
                body.clear()
                mesh = Triangulation(*(points + moved[frame]).T, triangles)
                body.tripcolor(mesh, PER_CENT * strain[frame], cmap=DIVERGING_COLORS, vmin=-limit, vmax=limit)
                _draw_texture(body, texture, slide, sample, top, width)
                body.set(
                    xlim=(-width, width), ylim=(top - DEPTH_BELOW_RATIO * width, top + OVER_MM), aspect=1,
                    ylabel="z (mm)",
                    xlabel="x (mm)",
                )  # fmt: skip
                scene = f"{slide.motion.t_s[sample]:.3f} s, {slide.force_N[sample]:.2g} N"
                body.set_title(f"{scene}; strain along x to ±{limit:.2g} %", fontsize="small")
                _draw_signals(signal, slide, sample)
                if frame == 0:
                    # Axes stay where the first frame has them
                    figure.draw_without_rendering()
                    figure.set_layout_engine("none")
                writer.grab_frame()
        Path(f"{temporary}.gif").replace(temporary)


def _fields(model: SectionModel, slide: Slide, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (f, vertices, 2) in mm and strain along x in each triangle (f, m) of the samples."""
    means, _ = model.patch_weights
    forces = np.concatenate([slide.rubbing[samples], slide.pressing[samples]], axis=1)
    fields = model.solve(means.T @ forces.T)
    vertices = model.scalar.nodal_dofs[0]
    moved = np.stack([fields[model.component[c][vertices]].T for c in (0, 1)], axis=-1)
    third = np.full((2, 1), 1 / 3)
    middle = Basis(model.mesh, ElementVector(ElementTriP2()), quadrature=(third, np.array([0.5])))
    strain = np.stack([middle.interpolate(field).grad[0, 0, :, 0] for field in fields.T])
    return moved, strain


def _draw_texture(axes, texture: Texture, slide: Slide, sample: int, top: float, width: float) -> None:
    x = np.linspace(-width, width, TEXTURE_POINTS)
    place = np.clip(x + slide.motion.position_mm[sample] + slide.carried_mm[sample], *texture.span)
    under = top - slide.depth_mm[sample] + texture.recess(place)
    axes.fill_between(x, under, top + OVER_MM, color=RIGID_COLOR, linewidth=0)
    pressure = slide.pressing[sample] / max(float(slide.pressing.max()), TINY_DIVISOR)
    low, high = BARS_MM
    axes.vlines(slide.x_mm, top + low, top + low + (high - low) * pressure, color=INK_COLOR)
    axes.text(width, top + high, "pressure ", ha="right", va="top", fontsize="small", color=MUTED_COLOR)


def _draw_signals(axes, slide: Slide, sample: int) -> None:
    axes.clear()
    rows = slice(max(0, sample - round(SIGNAL_S * slide.motion.rate_Hz)), sample + 1)
    change = slide.readings - slide.readings.mean(axis=0)
    for name, color, signal in zip(slide.gauge_names, ACCENT_COLORS, change[rows].T, strict=False):
        axes.plot(slide.motion.t_s[rows], signal, color=color, label=named(name))
    reach = max(float(np.percentile(np.abs(change), COMMON_PER_CENT)), checks.ROUNDING_SHARE)
    axes.set(ylim=(-reach, reach), xlabel="time (s)", ylabel="change (µε)")
    end = max(slide.motion.t_s[sample], min(SIGNAL_S, slide.motion.t_s[-1]))
    axes.set_xlim(max(end - SIGNAL_S, 0.0), end)
    axes.legend(ncols=in_a_row(slide.gauge_names), loc="upper left")
