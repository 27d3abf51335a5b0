"""The 2007 paper: zero crossings of a high-passed gauge, counted over 0.08 s."""

import numpy as np
from scipy.signal import butter, lfilter

from papilla import fem
from papilla.estimators.published.roughness import ZeroCrossing
from papilla.estimators.published.roughness.impulses import UpwardCrossings
from papilla.finger import Finger
from papilla.logs.quantities import SAMPLE_RATE_HZ
from papilla.specimen import Grating
from papilla.studies.figures.picture import Curve, Panel, Picture
from papilla.studies.figures.registry import Figure
from papilla.studies.reproduce.experiments.gratings import SCENE as GRATINGS
from papilla.studies.reproduce.signals import answers_to, noisy_scene
from papilla.textures import MeasuredProfile

CUTOFF_HZ, SPEED_MM_S = 10.0, 100.0
"""Corner of the high-pass (not printed; that of `ZeroCrossing`), and speed of both figures (not printed)."""
BORDER_S, PERIOD_S = 1.0, 0.08
"""When the finger reaches the second grating, and the printed time A."""


def _slid(texture, seconds: float, start_mm: float = 0.0) -> np.ndarray:
    """(n,) of the middle gauge in microstrain, noise at 20 dB."""
    motion = fem.Motion.sampled([0, seconds], [start_mm, start_mm + SPEED_MM_S * seconds], seconds=seconds)
    found = fem.slide(
        Finger.default(), texture, motion, depth=0.5, friction=GRATINGS.friction, length_mm=GRATINGS.length_mm
    )
    output = found.amplified[:, 2]
    return output + 0.1 * output[200:].std() * np.random.default_rng(7).standard_normal(len(output))


def crossings() -> Picture:
    """Impulses where the high-passed gauge goes over zero.

    The middle gauge of the default finger by finite elements over a grating of 3.0 mm at 100 mm/s, 0.5 mm deep, noise
    at 20 dB; a first-order high-pass of 10 Hz (order and corner are not printed). Above the output, below the impulses.
    """
    output = _slid(Grating(1.5, 1.5, 0.5), 0.8)
    time = np.arange(len(output)) / SAMPLE_RATE_HZ
    passed = lfilter(*butter(1, CUTOFF_HZ, "highpass", fs=SAMPLE_RATE_HZ), output - output[0])
    source = UpwardCrossings(80, UpwardCrossings.PRINTED, SAMPLE_RATE_HZ, CUTOFF_HZ)
    fired = np.array([source.fire(float(value)) for value in output]) > 0
    window = (0.4, 0.8)
    inside = fired & (time >= window[0])
    rate = inside.sum() / (window[1] - window[0])
    marks = Curve("over zero", time[inside], np.zeros(inside.sum()), "points", color=1)
    panels = (
        Panel("output", "time, s", "high-passed, microstrain", (Curve("", time, passed), marks), x_range=window),
        Panel("impulses", "time, s", "impulse", (Curve("", time[inside], np.ones(inside.sum()), "impulses"),),
              x_range=window, y_range=(0, 1.3)),
    )  # fmt: skip
    found = f"{rate:.0f} impulses a second; |v| / wavelength is {SPEED_MM_S / 3.0:.1f} Hz."
    return Picture(panels, found=found)


def side_by_side() -> Picture:
    """From a grating of 1 mm onto one of 4 mm.

    Both gratings lie side by side, groove = ridge; at the dashed line the finger's apex reaches the second one, at 100
    mm/s. (a) the middle gauge of the default finger by finite elements, noise at 20 dB; (b) what the paper's count over
    0.08 s makes of it, and of a synthetic gauge that feels the grating at one point. The diamond is the printed answer:
    about 4 mm within 0.08 s.
    """
    x = np.arange(-40.0, 260.0, 0.02)
    first, second = Grating(0.5, 0.5, 0.5).recess(x), Grating(2.0, 2.0, 0.5).recess(x)
    profile = MeasuredProfile(x, -np.where(x < BORDER_S * SPEED_MM_S, first, second))
    output = _slid(profile, 2.0)
    time = np.arange(len(output)) / SAMPLE_RATE_HZ
    felt = np.asarray(ZeroCrossing().process(np.column_stack([output, np.full(len(output), SPEED_MM_S)])).wavelength_mm)
    seen = noisy_scene("const", 1.0, "2007", 2, seconds=2.0, step_to_mm=4.0, step_at_s=BORDER_S)
    told = np.asarray(answers_to(ZeroCrossing(), seen)[0].wavelength_mm)
    window, at = (0.5, 2.0), np.full(2, BORDER_S)
    curves = (
        Curve("true", time, np.where(time < BORDER_S, 1.0, 4.0), "dashed", origin="true"),
        Curve("finger by finite elements", time, felt),
        Curve("synthetic", seen.time_s, told),
        Curve("printed", np.array([BORDER_S + PERIOD_S]), np.array([4.0]), "points", origin="printed"),
    )
    border = Curve("", at, np.quantile(output[time >= window[0]], (0, 1)), "dashed", origin="true")
    answers = (("synthetic", told), ("by finite elements", felt))
    late = {name: _first(one[round(BORDER_S * SAMPLE_RATE_HZ) :]) for name, one in answers}
    words = "; ".join(f"{name}: {value}, then {np.nanmean(one[1200:]):.2f} mm on the mean" for (name, value), one
                      in zip(late.items(), (told, felt), strict=True))  # fmt: skip
    panels = (
        Panel("(a) output", "time, s", "microstrain", (Curve("", time, output), border), x_range=window),
        Panel("(b) wavelength", "time, s", "wavelength, mm", curves, x_range=window, y_range=(0, 8)),
    )
    return Picture(panels, found=f"First within 30 % of 4 mm after the border: {words}.")


def _first(told: np.ndarray) -> str:
    near = np.abs(told / 4.0 - 1) < 0.3
    return f"{int(np.argmax(near))} ms" if near.any() else "never"


FIGURES = (Figure("fig. 3", crossings, ("B3",)), Figure("fig. 5", side_by_side, ("B7",)))
