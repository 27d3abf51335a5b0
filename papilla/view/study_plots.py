"""Figures of the benchmarks and of sliding: wavelength estimators side by side, speed against error, and the signals of
gauges over gratings."""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Protocol

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from papilla.units import PER_CENT
from papilla.view.style import (
    ACCENTS,
    FAINT,
    INK,
    MUTED,
    THICK,
    THIN,
    in_a_row,
    named,
    plain_log,
    styled,
    titled,
    with_formula,
)

Rows = Sequence[Mapping]

PRODUCT, BESIDE = "pipeline", "STFT over the path"
RIGHT, FALSE = ACCENTS[:2]
LIMITS, BOUND = (1e-3, 300.0), 5.0
"""Range of the errors shown, in %, at whose ends errors beyond it are drawn; error that counts as false."""
WIDE_IN, SCENE_IN, AROUND_IN = 10.2, 0.2, 1.9
"""Inches of the comparison of estimators: width, height of a scene, and height of everything else."""
ERRORS, BAR_SHARE = 1.7, 0.72
"""Width of the panel of errors over that of one of shares; height of a bar over that of a scene."""

PRICE_IN = 8.2, 5.2
"""Inches of the figure of speed against error."""
MARKERS = {"hertz": "^", "contact": "o", "finite": "s"}
MARK, RING, ROOM = 7, 11, 0.09
"""Sizes in points of the mark of a mesh, or of the pipeline, and of the ring around a best one; room around all of
them, as a share of the axes."""
LABEL_PLACES = ((-10, -8, "right"), (9, 6, "left"), (0, 10, "center"))
"""Position of the size labels of the first, second and third element: offset in points, and alignment."""
SCENES = 1000
"""Presses whose cost is drawn; from as many seconds on, an axis has the powers of ten alone."""

NOISE = (1.0, 5.0)
"""Range of a gauge's noise, microstrain, drawn as a band."""
PANEL_IN = 4.1
"""Width of a panel of signals, inches."""


def honesty_figure(rows: Rows) -> Figure:
    """One line per scene: shares of rows that the pipeline and a spectrum over the path answer rightly and falsely, and
    the median error in % of every method.

    rows : plain values of scene, method, kind, answered, false, median (fractions) and faults.
    """
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    places = np.arange(len(scenes))[::-1]
    with styled(WIDE_IN, AROUND_IN + SCENE_IN * len(scenes)) as figure:
        left, middle, right = figure.subplots(1, 3, sharey=True, width_ratios=(1, 1, ERRORS))
        for axes, method in ((left, PRODUCT), (middle, BESIDE)):
            _shares(axes, [row for row in rows if row["method"] == method], places)
            axes.set_title(method, fontsize="medium")
        _errors(right, rows, dict(zip(scenes, places.tolist(), strict=True)))
        left.set_yticks(places, labels=scenes, fontsize="small")
        faulty = {row["scene"] for row in rows if row["faults"]}
        for label, scene in zip(left.get_yticklabels(), scenes, strict=True):
            label.set_color(FALSE if scene in faulty else INK)
        left.set_ylim(-BAR_SHARE, len(scenes) - 1 + BAR_SHARE)
        own = [row for row in rows if row["method"] == PRODUCT]
        titled(
            figure, f"The pipeline holds its targets in {sum(not row['faults'] for row in own)} of {len(own)} scenes",
            f"20 dB, 1 kHz, one gauge. Blue: ok and right; orange: ok and off by more than {BOUND:g} %, or without a "
            "line to find. Orange names miss a target",
        )  # fmt: skip
    return figure


def _shares(axes: Axes, own: Rows, places) -> None:
    answered, false = (PER_CENT * np.nan_to_num([row[name] for row in own]) for name in ("answered", "false"))
    wrong = answered * false / PER_CENT
    axes.barh(places, answered - wrong, color=RIGHT, height=BAR_SHARE)
    axes.barh(places, wrong, left=answered - wrong, color=FALSE, height=BAR_SHARE)
    axes.set(xlim=(0, PER_CENT), xlabel="answered from 12 mm on (%)")
    axes.grid(axis="y", visible=False)


def _errors(axes: Axes, rows: Rows, places: Mapping[str, int]) -> None:
    """Dots of the median errors: the published methods in grey, every other one in its own colour."""
    single = dict.fromkeys(row["method"] for row in rows if row["kind"] != "published")
    colors = dict(zip(single, ACCENTS, strict=False))
    for method in reversed(dict.fromkeys(row["method"] for row in rows)):
        own = [row for row in rows if row["method"] == method and row["median"] == row["median"]]
        at = [min(max(PER_CENT * row["median"], LIMITS[0]), LIMITS[1]) for row in own]
        style: dict = {"color": colors[method], "label": method} if method in colors else {"color": FAINT}
        if method == PRODUCT:
            style["markersize"] = MARK  # These dots lie over the others
        axes.plot(at, [places[row["scene"]] for row in own], "o", clip_on=False, **style)
    axes.axvline(BOUND, color=MUTED, linewidth=THIN, linestyle="--")
    axes.set(xscale="log", xlim=LIMITS, xlabel="median error, ok or not (%)")
    plain_log(axes.xaxis, (1.0,))
    handles, _ = axes.get_legend_handles_labels()
    grey = Line2D([], [], color=FAINT, marker="o", linestyle="none", label="published")
    handles = [*handles[::-1], *([grey] if any(row["kind"] == "published" for row in rows) else [])]
    axes.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.5, 1), ncols=-(-len(handles) // 2))


def price_figure(rows: Sequence[Mapping], reference_mm: float) -> Figure:
    """Error of S_d in % against seconds, both logarithmic, a curve over the meshes for each fidelity and element.

    rows : fidelity, element, size_mm, seconds_thousand (set-up and 1000 scenes), error_sd (a fraction), pareto. Rows
    without an error, such as the reference, are left out.
    """
    shown = [row for row in rows if row["error_sd"] > 0]
    colors = dict(zip(dict.fromkeys(row["element"] for row in shown), ACCENTS, strict=False))
    with styled(*PRICE_IN) as figure:
        axes = figure.subplots()
        for fidelity, marker in MARKERS.items():
            for place, (element, color) in zip(cycle(LABEL_PLACES), colors.items(), strict=False):
                belong = [row for row in shown if (row["fidelity"], row["element"]) == (fidelity, element)]
                _curve(axes, belong, marker, color, place)
        front = sorted((row for row in shown if row["pareto"]), key=lambda row: row["seconds_thousand"])
        ring: dict = {"marker": "o", "markersize": RING, "markerfacecolor": "none", "markeredgewidth": THIN}
        (best,) = axes.step(*_points(front), where="post", color=INK, linestyle=":", zorder=1, **ring)
        best.set_label("Pareto front of hertz and contact")
        axes.set(
            xscale="log",
            yscale="log",
            xlabel="set-up and 1000 scenes (s)",
            ylabel=r"worst error of $S_d$, 10-100 gf (%)",
        )
        with_formula(axes.yaxis.label)
        axes.margins(ROOM)
        plain_log(axes.xaxis, *[(1.0,)] * (max(row["seconds_thousand"] for row in shown) > SCENES))
        plain_log(axes.yaxis)
        fidelities = {row["fidelity"] for row in shown}
        marks = [
            Line2D([], [], color=MUTED, marker=marker, linestyle="none", markersize=MARK, label=f"fidelity {fidelity}",
                   markerfacecolor=MUTED if fidelity == "contact" else "white", markeredgewidth=THICK)
            for fidelity, marker in MARKERS.items() if fidelity in fidelities
        ]  # fmt: skip
        lines = [Line2D([], [], color=color, linewidth=THICK, label=element) for element, color in colors.items()]
        axes.legend(handles=[*marks, *lines, best])
        note = f"Numbers: element size (mm). Errors: to fidelity contact, Taylor-Hood, {reference_mm:g} mm"
        if "finite" in fidelities:
            note += "; finite: to itself on a finer mesh"
        least = min(front, key=lambda row: row["error_sd"])
        price = (
            f"{PER_CENT * least['error_sd']:.2g} % in $S_d$ for {least['seconds_thousand']:.2g} s a thousand presses"
        )
        titled(figure, f"{price}: {least['fidelity']}, {least['element']}, {least['size_mm']:g} mm", note, formula=True)
    return figure


def _points(rows: Sequence[Mapping]) -> tuple[list[float], list[float]]:
    """Seconds, and errors in %."""
    return [row["seconds_thousand"] for row in rows], [PER_CENT * row["error_sd"] for row in rows]


def _curve(axes: Axes, rows: list[Mapping], marker: str, color: str, place: tuple[float, float, str]) -> None:
    ordered = sorted(rows, key=lambda row: -row["size_mm"])
    seconds, errors = _points(ordered)
    face = color if marker == MARKERS["contact"] else "white"
    style: dict = {"marker": marker, "markersize": MARK, "markerfacecolor": face, "markeredgewidth": THICK}
    axes.plot(seconds, errors, color=color, **style)
    right, up, align = place
    for row, x, y in zip(ordered, seconds, errors, strict=True):
        axes.annotate(
            f"{row['size_mm']:g}", (x, y), xytext=(right, up), textcoords="offset points", ha=align, fontsize="small",
            color=color,
        )  # fmt: skip


class GratingSignals(Protocol):
    """A scene, as `papilla.studies.grating_signals.signals_over_gratings` returns it."""

    wavelength_mm: float
    pitch_mm: float
    rms: np.ndarray


def signals_figure(signals: Sequence[GratingSignals], names: Sequence[str]) -> Figure:
    """Standard deviation of each named gauge's signal against wavelength, a panel for each pitch of the ridges."""
    pitches = list(dict.fromkeys(scene.pitch_mm for scene in signals))
    largest = max(float(scene.rms.max()) for scene in signals)
    with styled(PANEL_IN * len(pitches)) as figure:
        panels = figure.subplots(1, len(pitches), sharey=True, squeeze=False)[0]
        for axes, pitch in zip(panels, pitches, strict=True):
            scenes = sorted((s for s in signals if s.pitch_mm == pitch), key=lambda scene: scene.wavelength_mm)
            wavelengths = [scene.wavelength_mm for scene in scenes]
            axes.axhspan(*NOISE, color=FAINT, zorder=0)
            for gauge, (name, color) in enumerate(zip(names, ACCENTS, strict=False)):
                signal = [scene.rms[gauge] for scene in scenes]
                axes.plot(wavelengths, signal, color=color, marker="o", label=named(name))
            if pitch:
                axes.axvline(pitch, color=INK, linewidth=THIN, linestyle=":")
            axes.set(yscale="log", ylim=(NOISE[0] / 2, 2 * largest), xlabel="wavelength (mm)")
            plain_log(axes.yaxis, (1.0,))
            axes.set_title(f"ridges of {pitch:g} mm pitch" if pitch else "smooth skin", fontsize="medium")
        panels[0].set_ylabel("signal, standard deviation (µε)")
        panels[0].legend(ncols=in_a_row(names), loc="upper right", columnspacing=1)
        best = max(signals, key=lambda scene: float(scene.rms.max()))
        loudest = named(names[int(best.rms.argmax())])
        skin = f"with ridges of {best.pitch_mm:g} mm" if best.pitch_mm else "on smooth skin"
        titled(
            figure, f"{best.wavelength_mm:g} mm gives the largest signal: {best.rms.max():.3g} µε at {loudest}, {skin}",
            f"Grey: noise of {NOISE[0]:g} to {NOISE[1]:g} µε. Dotted: the ridges' pitch.",
        )  # fmt: skip
    return figure
