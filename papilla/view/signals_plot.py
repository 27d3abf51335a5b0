"""Signals of the gauges over gratings: signal against wavelength, gauge by gauge, with and without ridges."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from matplotlib.figure import Figure

from papilla.view.style import ACCENTS, FAINT, INK, MUTED, THIN, literal, plain_log, styled, titled


class GratingSignals(Protocol):
    """A scene, as `papilla.studies.grating_signals.signals_over_gratings` returns it."""

    wavelength_mm: float
    pitch_mm: float
    rms: np.ndarray


def signals_figure(
    signals: Sequence[GratingSignals], names: Sequence[str], noise_microstrain: tuple[float, float] = (1.0, 5.0)
) -> Figure:
    """Standard deviation of each gauge's signal against wavelength, a panel for each pitch of the ridges.

    names : of the gauges. noise_microstrain : range of a gauge's noise, drawn as a band.
    """
    pitches = list(dict.fromkeys(scene.pitch_mm for scene in signals))
    largest = max(float(scene.rms.max()) for scene in signals)
    with styled(4.1 * len(pitches) + 0.6, 4.6) as figure:
        for number, pitch in enumerate(pitches):
            width = (1 - 0.13) / len(pitches)
            axes = figure.add_axes((0.085 + number * width, 0.13, width - 0.02, 0.66))
            scenes = sorted((s for s in signals if s.pitch_mm == pitch), key=lambda scene: scene.wavelength_mm)
            wavelengths = [scene.wavelength_mm for scene in scenes]
            axes.axhspan(*noise_microstrain, color=FAINT, zorder=0)
            for gauge, (name, color) in enumerate(zip(names, ACCENTS, strict=False)):
                signal = [scene.rms[gauge] for scene in scenes]
                axes.plot(wavelengths, signal, color=color, marker="o", label=literal(name))
            if pitch:
                axes.axvline(pitch, color=INK, linewidth=THIN, linestyle=":")
            axes.set(yscale="log", ylim=(noise_microstrain[0] / 2, 2 * largest), xlabel="wavelength (mm)")
            plain_log(axes.yaxis, (1.0,))
            axes.text(
                0.98, 0.03, f"ridges of {pitch:g} mm pitch" if pitch else "smooth skin", ha="right", color=MUTED,
                transform=axes.transAxes,
            )  # fmt: skip
            if number:
                axes.tick_params(labelleft=False)
            else:
                axes.set_ylabel("signal, standard deviation (µε)")
                axes.legend(ncols=len(names), loc="upper right", columnspacing=1)
        best = max(signals, key=lambda scene: float(scene.rms.max()))
        loudest = literal(names[int(best.rms.argmax())])
        skin = f"with ridges of {best.pitch_mm:g} mm" if best.pitch_mm else "on smooth skin"
        titled(
            figure, f"{best.wavelength_mm:g} mm gives the largest signal: {best.rms.max():.3g} µε at {loudest}, {skin}",
            f"Grey: noise of {noise_microstrain[0]:g} to {noise_microstrain[1]:g} µε. Dotted: the ridges' pitch.",
        )  # fmt: skip
    return figure
