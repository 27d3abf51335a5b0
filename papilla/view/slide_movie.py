"""The section during sliding, as a movie: pressure, strain and the gauges' signals."""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.animation import PillowWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.tri import Triangulation
from skfem import Basis, ElementTriP2, ElementVector

from papilla.errors import InputError
from papilla.fem.sliding.section_model import SectionModel
from papilla.fem.sliding.slide import Slide
from papilla.files import replacing
from papilla.finger import Finger
from papilla.mesh.section import build_section
from papilla.textures import Texture
from papilla.units import PER_CENT, TINY
from papilla.view.style import ACCENTS, DIVERGING, INK, MUTED, literal, styled

FRAMES, FRAMES_A_SECOND = 60, 12
SIGNAL_S = 0.25
"""Seconds of signal before each frame."""


def write_slide_movie(path: str | Path, finger: Finger, texture: Texture, found: Slide, frames: int = FRAMES) -> None:
    """Write a GIF of a slide with `frames` evenly spaced samples.

    Each frame shows the strain along x of the deformed section under the instantaneous forces (without inertia), the
    texture, the nodal pressure, and each gauge's signal. Raises `InputError` unless the path ends in .gif, and
    `FileAccessError`.
    """
    if Path(path).suffix.lower() != ".gif":
        raise InputError(f"{path}: a moving picture is written as .gif")
    samples = np.unique(np.linspace(0, len(found.readings) - 1, frames).round().astype(int))
    model = SectionModel(finger, build_section(finger, ridges=found.ridge_pitch_mm > 0))
    moved, strain = _fields(model, found, samples)
    points, triangles = model.section.points, model.section.triangles
    width = 1.6 * model.section.half_width
    limit = float(np.percentile(np.abs(strain), 99.5))
    with styled(7.2, 6.0) as figure, replacing(path) as temporary:
        FigureCanvasAgg(figure)
        body, signal = figure.add_axes((0.12, 0.43, 0.85, 0.5)), figure.add_axes((0.12, 0.09, 0.85, 0.24))
        writer = PillowWriter(fps=FRAMES_A_SECOND)
        with matplotlib.rc_context({"savefig.dpi": 90}), writer.saving(figure, f"{temporary}.gif", dpi=90):
            for row, sample in enumerate(samples):
                body.clear()
                body.set(
                    xlim=(-width, width), ylim=(points[:, 1].max() - 0.8 * width, points[:, 1].max() + 3), aspect=1
                )
                mesh = Triangulation(*(points + moved[row]).T, triangles)
                body.tripcolor(
                    mesh, PER_CENT * strain[row], cmap=DIVERGING, vmin=-PER_CENT * limit, vmax=PER_CENT * limit
                )
                _draw_texture(body, texture, found, sample, points[:, 1].max(), width)
                body.set(ylabel="z (mm)", xlabel="x (mm)")
                body.set_title(
                    f"{found.motion.t_s[sample]:.3f} s, {found.force_N[sample]:.2g} N; strain along x to "
                    f"±{PER_CENT * limit:.2g} %", fontsize="small",
                )  # fmt: skip
                _draw_signals(signal, found, sample)
                writer.grab_frame()
        Path(f"{temporary}.gif").replace(temporary)


def _fields(model: SectionModel, found: Slide, samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Displacements (f, vertices, 2) in mm and strain along x in each triangle (f, m) of the samples."""
    means, _ = model.patch_weights
    forces = np.concatenate([found.rubbing[samples], found.pressing[samples]], axis=1)
    fields = model.solve(means.T @ forces.T)
    vertices = model.scalar.nodal_dofs[0]
    moved = np.stack([fields[model.component[c][vertices]].T for c in (0, 1)], axis=-1)
    middle = Basis(model.mesh, ElementVector(ElementTriP2()), quadrature=(np.full((2, 1), 1 / 3), np.array([0.5])))
    strain = np.stack([middle.interpolate(field).grad[0, 0, :, 0] for field in fields.T])
    return moved, strain


def _draw_texture(axes, texture: Texture, found: Slide, sample: int, top: float, width: float) -> None:
    x = np.linspace(-width, width, 1200)
    place = np.clip(x + found.motion.position_mm[sample] + found.carried_mm[sample], *texture.span)
    under = top - found.depth_mm[sample] + texture.recess(place)
    axes.fill_between(x, under, top + 3, color="#c9ced6", linewidth=0, zorder=3)
    pressure = found.pressing[sample] / max(float(found.pressing.max()), TINY)
    axes.vlines(found.x_mm, top + 0.6, top + 0.6 + 2.2 * pressure, color=INK, zorder=4)
    axes.text(0.99, 0.93, "pressure", transform=axes.transAxes, ha="right", fontsize="small", color=MUTED, zorder=5)


def _draw_signals(axes, found: Slide, sample: int) -> None:
    axes.clear()
    rows = slice(max(0, sample - round(SIGNAL_S * found.motion.rate_Hz)), sample + 1)
    change = found.readings - found.readings.mean(axis=0)
    for name, color, signal in zip(found.gauge_names, ACCENTS, change[rows].T, strict=False):
        axes.plot(found.motion.t_s[rows], signal, color=color, label=literal(name))
    reach = max(1.05 * float(np.percentile(np.abs(change), 99.8)), 1e-9)
    axes.set(ylim=(-reach, reach), xlabel="time (s)", ylabel="change (µε)")
    end = max(found.motion.t_s[sample], min(SIGNAL_S, found.motion.t_s[-1]))
    axes.set_xlim(max(end - SIGNAL_S, 0.0), end)
    axes.legend(ncols=len(found.gauge_names), loc="upper left")
