"""The 2007 paper: zero crossings of a high-passed gauge, counted over 0.08 s."""

import numpy as np
from scipy.signal import butter, lfilter

from papilla import fem
from papilla.model.textures import MeasuredProfile
from papilla_papers.claims.experiments import gratings
from papilla_papers.claims.experiments.counts import COUNT_SCENE
from papilla_papers.claims.signals import SHARED_SIGNALS, answers_to, noisy_scene, share_of_noise
from papilla_papers.figures.picture import Curve, Panel, Picture, dashed, printed
from papilla_papers.methods.roughness import ZeroCrossing
from papilla_papers.methods.roughness.impulses import UpwardCrossings

COUNT_FIGURES = COUNT_SCENE.figures
RATE_HZ: int = SHARED_SIGNALS.rate_Hz


def _slid(texture, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) and the middle gauge (n,) in microstrain, with noise."""
    motion = fem.Motion.sampled([0, seconds], [0.0, COUNT_FIGURES.speed_mm_s * seconds], seconds=seconds)
    output = gratings.default_slide(texture, motion, depth=COUNT_FIGURES.depth_mm).amplified[:, gratings.MIDDLE_GAUGE]
    noise = share_of_noise(SHARED_SIGNALS.snr_dB["2007"]) * output[gratings.GRATING_SCENE.slides_after :].std()
    random = np.random.default_rng(COUNT_FIGURES.seed).standard_normal(len(output))
    return np.arange(len(output)) / RATE_HZ, output + noise * random


def crossings() -> Picture:
    """Impulses where the high-passed gauge goes over zero.

    The middle gauge of the default finger by finite elements over a grating of 3.0 mm at 100 mm/s, 0.5 mm deep, noise
    at 20 dB; a first-order high-pass of 10 Hz (order and corner are not printed). Above the output, below the impulses.
    """
    setup, printed_window = COUNT_FIGURES.crossings, round(COUNT_SCENE.printed_s * RATE_HZ)
    time, output = _slid(gratings.grating(setup.wavelength_mm), setup.window_s[1])
    passed = lfilter(*butter(1, COUNT_SCENE.cutoff_Hz, "highpass", fs=RATE_HZ), output - output[0])
    source = UpwardCrossings(printed_window, UpwardCrossings.PRINTED, RATE_HZ, COUNT_SCENE.cutoff_Hz)
    fired = np.array([source.fire(float(value)) for value in output]) > 0
    at = time[fired & (time >= setup.window_s[0])]
    train, marks = Curve("", at, np.ones(len(at)), "impulses"), Curve("over zero", at, 0 * at, "points", color=1)
    panels = (
        Panel(
            "output", "time, s", "high-passed, microstrain", (Curve("", time, passed), marks), x_range=setup.window_s
        ),
        Panel("impulses", "time, s", "impulse", (train,), x_range=setup.window_s, y_range=setup.impulse),
    )
    finding = (
        f"{len(at) / np.ptp(setup.window_s):.0f} impulses a second; |v| / wavelength is "
        f"{COUNT_FIGURES.speed_mm_s / setup.wavelength_mm:.1f} Hz."
    )
    return Picture(panels, found=finding)


def side_by_side() -> Picture:
    """From a grating of 1 mm onto one of 4 mm.

    Both gratings lie side by side, groove = ridge; at the dashed line the finger's apex reaches the second one, at 100
    mm/s. (a) the middle gauge of the default finger by finite elements, noise at 20 dB; (b) what the paper's count over
    0.08 s makes of it, and of a synthetic gauge that feels the grating at one point. The diamond is the printed answer:
    about 4 mm within 0.08 s.
    """
    setup, step, border_s = COUNT_FIGURES.side_by_side, COUNT_SCENE.step, COUNT_FIGURES.side_by_side.border_s
    begin_mm, end_mm = setup.profile_mm
    x = np.arange(begin_mm, end_mm, setup.point_mm)
    first, second = (gratings.grating(wavelength).recess(x) for wavelength in (step.from_mm, step.to_mm))
    end_s = setup.window_s[1]
    time, output = _slid(MeasuredProfile(x, -np.where(x < border_s * COUNT_FIGURES.speed_mm_s, first, second)), end_s)
    block = np.column_stack([output, np.full(len(output), COUNT_FIGURES.speed_mm_s)])
    felt = ZeroCrossing().process(block).wavelength_mm
    how = {"seconds": end_s, "step_to_mm": step.to_mm, "step_at_s": border_s}
    seen = noisy_scene("const", step.from_mm, "2007", setup.seed, **how)
    synthetic = np.asarray(answers_to(ZeroCrossing(), seen)[0].wavelength_mm)
    curves = (
        dashed(time, np.where(time < border_s, step.from_mm, step.to_mm), "true"),
        Curve("finger by finite elements", time, np.asarray(felt)),
        Curve("synthetic", seen.time_s, synthetic),
        printed("printed", border_s + COUNT_SCENE.printed_s, step.to_mm),
    )
    visible = output[time >= setup.window_s[0]]
    border = dashed(border_s, (visible.min(), visible.max()))
    answers = (("synthetic", synthetic), ("by finite elements", np.asarray(felt)))
    words = "; ".join(
        f"{name}: {_first(wavelength[round(border_s * RATE_HZ) :])}, then "
        f"{np.nanmean(wavelength[round(setup.settled_s * RATE_HZ) :]):.2f} mm on the mean"
        for name, wavelength in answers
    )
    panels = (
        Panel("(a) output", "time, s", "microstrain", (Curve("", time, output), border), x_range=setup.window_s),
        Panel(
            "(b) wavelength", "time, s", "wavelength, mm", curves, x_range=setup.window_s, y_range=setup.wavelength_mm
        ),
    )
    return Picture(panels, found=f"First within 30 % of 4 mm after the border: {words}.")


def _first(wavelength_mm: np.ndarray) -> str:
    near = np.abs(wavelength_mm / COUNT_SCENE.step.to_mm - 1) < COUNT_FIGURES.side_by_side.near
    return f"{int(np.argmax(near))} ms" if near.any() else "never"
