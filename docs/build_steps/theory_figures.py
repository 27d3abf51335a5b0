"""One figure for each page of the theory, computed with papilla when the site is built."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.interpolate import LinearNDInterpolator

import papilla
from papilla import Block, Finger, fem
from papilla.scenes.scenes import scene
from papilla.view import contact_figure, plots, png
from papilla.view.style import ACCENT_COLORS, GAUGE_COLOR, INK_COLOR, MUTED_COLOR, plain_log, styled
from papilla_papers.methods import ShortTimeSpectrum

WIDTH, HEIGHT = 7.2, 3.6
DPI = 130
FORCES = np.geomspace(0.05, 1.0, 10)
MODULUS_MPA = 0.2
"""Specimen of the figures that show one specimen."""


def write(folder: Path) -> None:
    """Write figures/<page>.png for each page."""
    target = folder / "figures"
    target.mkdir(parents=True, exist_ok=True)
    finger = Finger.default()
    reduced = fem.prepare(finger)
    for name, draw in FIGURES.items():
        figure = draw(finger, reduced)
        (target / f"{name}.png").write_bytes(png(figure, DPI))


@contextmanager
def _axes(height: float = HEIGHT) -> Iterator[tuple[Figure, Axes]]:
    """A figure of this height (inches) and its axes."""
    with styled(WIDTH, height) as figure:
        axes = figure.subplots()
        yield figure, axes


def section(finger: Finger, _) -> Figure:
    """Layers, bone and gauges in the plane of the gauges."""
    colors = {"outer": "#f3c9a5", "interface": "#fbe6d3", "bone": "#c9ced6"}
    angle = np.linspace(-np.pi / 2, np.pi / 2, 200)
    with _axes(4.2) as (figure, axes):
        for name, color in colors.items():
            a, _, c = getattr(finger.shape, name)
            axes.fill(a * np.sin(angle), c * np.cos(angle), facecolor=color, edgecolor=INK_COLOR, linewidth=0.8)
        a, _, c = finger.shape.interface
        for gauge in finger.gauges:
            at = np.deg2rad(gauge.angle_deg)
            place = np.array([a * np.sin(at), c * np.cos(at)])
            along = np.array([a * np.cos(at), -c * np.sin(at)]) * gauge.length_mm / 2 / np.hypot(a, c) * 1.4
            axes.plot(
                *np.stack([place - along, place + along]).T, color=GAUGE_COLOR, linewidth=5, solid_capstyle="butt"
            )
            axes.annotate(gauge.name, place * 0.86, ha="center", va="center", fontsize=9)
        for text, height in (("outer layer", 18.5), ("inner layer", 10.5), ("bone", 2.5)):
            axes.annotate(text, (0, height), ha="center", va="center", fontsize=9, color=MUTED_COLOR)
        axes.set(aspect="equal", xlabel="x across the finger (mm)", ylabel="z (mm)", ylim=(-1, 22))
    return figure


def reduction(finger: Finger, _) -> Figure:
    """What each gauge feels of one millinewton at a place of the skin: a row of the reduced finger."""
    fields = fem.receptive_fields(fem.FingerModel(finger, papilla.mesh.build(finger)))
    points = fields.mesh.points[fields.vertices]
    x = np.linspace(-15, 15, 121)
    with _axes() as (figure, axes):
        for gauge, values, color in zip(finger.gauges, fields.strain_per_newton, ACCENT_COLORS, strict=False):
            along = LinearNDInterpolator(points[:, :2], 1e3 * values)(x, np.zeros_like(x))
            axes.plot(x, along, color=color, label=gauge.name)
        axes.axhline(0, color=MUTED_COLOR, linewidth=0.8)
        axes.set(xlabel="place of the load, x (mm)", ylabel="strain per force (µε/mN)")
        axes.legend(ncols=5, loc="upper center", bbox_to_anchor=(0.5, 1.16))
    return figure


def contact(_, reduced) -> Figure:
    """Pressure of a press, node by node and smooth."""
    return contact_figure(reduced, fem.press(reduced, Block(MODULUS_MPA, 10), force=0.5))


def _sd(reduced, thickness: float = 10.0, **how) -> np.ndarray:
    block = Block(MODULUS_MPA, thickness)
    return np.array([fem.press(reduced, block, force=force, **how).sd for force in FORCES])


def large_strain(_, reduced) -> Figure:
    """What friction and large strain change in S_d."""
    linear = _sd(reduced, fidelity="contact", friction=0)
    curves = {
        "large strain alone": _sd(reduced, friction=0),
        "stick alone": _sd(reduced, fidelity="contact", friction="stick"),
        "both, the default": _sd(reduced),
    }
    return _changes({name: sd / linear - 1 for name, sd in curves.items()}, "against linear, frictionless (%)")


def _changes(curves: dict[str, np.ndarray], against: str) -> Figure:
    with _axes() as (figure, axes):
        for (name, change), color in zip(curves.items(), ACCENT_COLORS, strict=False):
            axes.plot(FORCES, 100 * change, color=color, label=name)
        axes.axhline(0, color=MUTED_COLOR, linewidth=0.8)
        axes.set(xscale="log", xlabel="force (N)", ylabel=f"change of $S_d$\n{against}")
        plain_log(axes.xaxis)
        axes.set_ylim(axes.get_ylim()[0], 1.5 * axes.get_ylim()[1] + 1)
        axes.legend(ncols=2, loc="upper left")
    return figure


def gauges(_, __) -> Figure:
    """Strain part and bending part of the readings of the published finger."""
    reduced = fem.prepare(Finger.published())
    press = fem.press(reduced, Block(0.51, 10), force=0.5)
    strain, curvature = (
        1e6 * weight * value for weight, value in zip(reduced.weights[:2], press.values[:2], strict=True)
    )
    place = np.arange(len(strain))
    with _axes() as (figure, axes):
        axes.bar(place - 0.2, strain, 0.2, color=ACCENT_COLORS[0], label="gain × strain")
        axes.bar(place, curvature, 0.2, color=ACCENT_COLORS[1], label="lever × curvature change")
        axes.bar(place + 0.2, strain + curvature, 0.2, color=INK_COLOR, label="reading")
        axes.axhline(0, color=MUTED_COLOR, linewidth=0.8)
        axes.set(xticks=place, xticklabels=reduced.gauge_names, ylabel="µε")
        axes.legend()
    return figure


def calibration(_, reduced) -> Figure:
    """S_d against the modulus: it saturates."""
    modulus, forces = np.geomspace(0.02, 5, 16), [0.1, 0.3, 0.6, 1.0]
    sd = np.array([[fem.press(reduced, Block(one, 10), force=force).sd for one in modulus] for force in forces])
    return plots.sd_against_modulus(modulus, forces, sd)


def identification(finger: Finger, reduced) -> Figure:
    """Each parameter changes S_d over force in a way of its own, which is how presses tell them apart."""
    harder = {
        f"{name} layer 20 % harder": fem.prepare(replace(finger, **{name: replace(layer, modulus=1.2 * layer.modulus)}))
        for name, layer in (("outer", finger.outer), ("inner", finger.inner))
    }
    before = _sd(reduced)
    curves = {name: _sd(other) / before - 1 for name, other in harder.items()}
    curves["block of 12 mm for 10"] = _sd(reduced, thickness=12) / before - 1
    curves["no friction for stick"] = _sd(reduced, friction=0) / before - 1
    return _changes(curves, "(%)")


def estimators(_, __) -> Figure:
    """A wavelength by a spectrum over time, and by the phase over the path, under a hand that strokes."""
    slide = scene("act1", 1.8, snr_dB=20, seed=1)
    rows = slide.block()
    methods = {
        "spectrum over 200 ms of time": ShortTimeSpectrum(variant="corrected"),
        "phase over the path": papilla.estimators.SpaceTracker(),
    }
    with _axes() as (figure, axes):
        for (name, method), color in zip(methods.items(), (ACCENT_COLORS[1], ACCENT_COLORS[0]), strict=True):
            axes.plot(slide.time_s, method.process(rows).wavelength_mm, color=color, linewidth=1.4, label=name)
        axes.axhline(1.8, color=INK_COLOR, linewidth=0.8, linestyle=":")
        axes.set(ylim=(0, 5), xlabel="time (s)", ylabel="wavelength (mm)")
        axes.legend()
    return figure


def bounds(_, reduced) -> Figure:
    """The least error of a wavelength over the length of the window, and of a modulus for 1 % error of the force."""
    windows, moduli, step = np.geomspace(0.04, 1, 9), np.geomspace(0.03, 2, 10), 1.2
    slide = scene("act1", 1.8, snr_dB=20, seed=1)

    def sd(modulus: float, force: float) -> float:
        return fem.press(reduced, Block(modulus, 10), force=force).sd

    with styled(WIDTH, HEIGHT) as figure:
        left, right = figure.subplots(1, 2)
        left.loglog(
            windows, [100 * slide.bound(window) for window in windows], color=ACCENT_COLORS[0], marker="o", ms=4
        )
        left.set(xlabel="window (s)", ylabel="least error of the wavelength (%)")
        for force, color in ((0.2, ACCENT_COLORS[0]), (0.6, ACCENT_COLORS[1])):
            of_force = [np.log(sd(one, force * step) / sd(one, force / step)) for one in moduli]
            of_modulus = [np.log(sd(one * step, force) / sd(one / step, force)) for one in moduli]
            right.loglog(moduli, np.divide(of_force, of_modulus), color=color, label=f"{force} N")
        right.set(xlabel="modulus (MPa)", ylabel="error of E (%) for 1 % of force")
        for axis in (left.xaxis, left.yaxis, right.xaxis, right.yaxis):
            plain_log(axis)
        right.legend()
    return figure


FIGURES: dict[str, Callable[..., Figure]] = {
    "finger": section,
    "reduction": reduction,
    "contact": contact,
    "large_strain": large_strain,
    "gauges": gauges,
    "calibration": calibration,
    "identification": identification,
    "estimators": estimators,
    "bounds": bounds,
}
