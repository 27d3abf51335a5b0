"""The figure of sliding: the signals of gauges over gratings."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from matplotlib.figure import Figure

from papilla.view import style

NOISE_BAND_MICROSTRAIN = (1.0, 5.0)
"""Range of a gauge's noise, microstrain, drawn as a band."""
SIGNAL_PANEL_IN = 4.1
"""Width of a panel of signals, inches."""


class GratingSignals(Protocol):
    """A scene, as `papilla_papers.grating_signals.signals_over_gratings` returns it."""

    wavelength_mm: float
    pitch_mm: float
    rms: np.ndarray


def signals_figure(signals: Sequence[GratingSignals], names: Sequence[str]) -> Figure:
    """Standard deviation of each named gauge's signal against wavelength, a panel for each pitch of the ridges."""
    low, high = NOISE_BAND_MICROSTRAIN
    pitches = list(dict.fromkeys(scene.pitch_mm for scene in signals))
    largest = max(float(scene.rms.max()) for scene in signals)
    with style.styled(SIGNAL_PANEL_IN * len(pitches)) as figure:
        panels = figure.subplots(1, len(pitches), sharey=True, squeeze=False)[0]
        for axes, pitch in zip(panels, pitches, strict=True):
            scenes = sorted((s for s in signals if s.pitch_mm == pitch), key=lambda scene: scene.wavelength_mm)
            wavelengths = [scene.wavelength_mm for scene in scenes]
            axes.axhspan(low, high, color=style.FAINT_COLOR, zorder=0)
            for gauge, (name, color) in enumerate(zip(names, style.ACCENT_COLORS, strict=False)):
                signal = [scene.rms[gauge] for scene in scenes]
                axes.plot(wavelengths, signal, color=color, marker="o", label=style.named(name))
            if pitch:
                axes.axvline(pitch, color=style.INK_COLOR, linewidth=style.THIN_PT, linestyle=":")
            axes.set(yscale="log", ylim=(low / 2, 2 * largest), xlabel="wavelength (mm)")
            style.plain_log(axes.yaxis, (1.0,))
            axes.set_title(f"ridges of {pitch:g} mm pitch" if pitch else "smooth skin", fontsize="medium")
        panels[0].set_ylabel("signal, standard deviation (µε)")
        panels[0].legend(ncols=style.in_a_row(names), loc="upper right", columnspacing=1)
        best = max(signals, key=lambda scene: float(scene.rms.max()))
        loudest = style.named(names[int(best.rms.argmax())])
        skin = f"with ridges of {best.pitch_mm:g} mm" if best.pitch_mm else "on smooth skin"
        style.titled(
            figure, f"{best.wavelength_mm:g} mm gives the largest signal: {best.rms.max():.3g} µε at {loudest}, {skin}",
            f"Grey: noise of {low:g} to {high:g} µε. Dotted: the ridges' pitch.",
        )  # fmt: skip
    return figure
