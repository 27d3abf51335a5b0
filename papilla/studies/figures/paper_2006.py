"""The 2006 paper, section III: impulses of a model corpuscle count the grooves that pass."""

from functools import cache

import numpy as np

from papilla import fem
from papilla.estimators.published.roughness import ImpulseDensity, ImpulseInterval, ShortTimeSpectrum
from papilla.estimators.published.roughness.impulses import Corpuscle
from papilla.finger import Finger
from papilla.logs.quantities import SAMPLE_RATE_HZ
from papilla.specimen import Grating, HalfSpace
from papilla.studies.estimator_bench.scenes import Scene
from papilla.studies.figures.picture import Curve, Panel, Picture
from papilla.studies.figures.registry import Figure
from papilla.studies.reproduce.experiments.gratings import SCENE as GRATINGS
from papilla.studies.reproduce.experiments.presses import OFFSET_MM, RIGID_MPA
from papilla.studies.reproduce.signals import SHARED, answers_to, correlation, lag_ms, noisy_scene
from papilla.textures import MeasuredProfile
from papilla.units import newton_to_gf

GROOVE_MM, GROOVES_MM_S, INTERVAL_S = 1.5, 60.0, 0.050
"""Figure 2: width of both grooves and of the ridge between them, speed, and the printed time between impulses."""
DEPTHS_MM = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
REACTIONS_GF = ((0.2, 0.70), (0.8, 38.37))
"""Printed in section III.B.2: depth in mm, force."""
SETTLED, JUDGED_FROM = 300, 1000
"""Samples after which the window of the impulses is full and the finger has settled; and those of a scene with strokes
that no lag and no step is computed from, a second."""
BOTH = {"synthetic": "{}", "finger by finite elements": "{}, felt by FEM"}
"""The two kinds of signals, with the names of their scenes."""
WAYS = {"const": "const", "strokes": "act1"}


def _scene(way: str, kind: str, wavelength_mm: float, seconds: float) -> Scene:
    name = WAYS[way] if kind == "synthetic" else BOTH[kind].format(way)
    return noisy_scene(name, wavelength_mm, "2006", 3, seconds=seconds)


def two_grooves() -> Picture:
    """Impulses at the edges of two grooves.

    Two grooves of 1.5 mm, 1.5 mm apart, pass at 60 mm/s. Left: one point of a skin that follows the edges within 0.2
    mm, which is how the paper explains the method. Right: the middle gauge of the default finger by finite elements,
    0.5 mm deep, without noise. (a) output, (b) its derivative, rectified, with the threshold of 1.5 times its mean of
    200 ms, (c) impulses. Print has one gauge of the sensor, whose contact is narrow enough to feel single edges; here
    each ridge of the skin in the contact feels every edge.
    """
    time = np.arange(500) / SAMPLE_RATE_HZ
    place = GROOVES_MM_S * (time - 0.3)
    followed = sum((-1) ** k * np.clip((place - GROOVE_MM * k) / 0.2, 0, 1) for k in range(4))
    x = np.arange(-40.0, 60.0, 0.02)
    grooves = MeasuredProfile(x, -0.5 * (((x > 0) & (x < 1.5)) | ((x > 3.0) & (x < 4.5))))
    motion = fem.Motion.sampled([0, 0.5], [place[0], place[-1]], seconds=0.5)
    slid = fem.slide(
        Finger.default(), grooves, motion, depth=0.5, friction=GRATINGS.friction, length_mm=GRATINGS.length_mm
    )
    panels: list[Panel] = []
    fired = []
    for kind, output, unit in (
        ("skin that follows the edges", followed, "depth of a groove"),
        ("finger by finite elements", slid.readings[:, 2], "microstrain"),
    ):
        rate = np.abs(np.diff(output, prepend=output[0])) * SAMPLE_RATE_HZ
        level = 1.5 * np.array([rate[max(0, k - 199) : k + 1].mean() for k in range(len(rate))])
        model = Corpuscle(200, Corpuscle.PRINTED)
        impulse = np.nan_to_num([model.fire(float(value)) for value in output])
        impulse[: SETTLED // 3] = 0.0  # The first window is not full yet
        fired.append(time[impulse > 0])
        shown = Curve("", time[impulse != 0], np.ones(int((impulse != 0).sum())), "impulses")
        printed = Curve("printed: 0.050 s apart", 0.3 + np.array([0, INTERVAL_S]), np.ones(2), "points",
                        origin="printed")  # fmt: skip
        window = (0.1, 0.5)
        panels += [
            Panel(f"(a) output, {kind}", "time, s", unit, (Curve("", time, output),), x_range=window),
            Panel("(b) derivative", "time, s", f"{unit} / s",
                  (Curve("", time, rate), Curve("threshold", time, level, "dashed")), x_range=window),
            Panel("(c) impulses", "time, s", "impulse", (shown, printed), x_range=window, y_range=(0, 1.4)),
        ]  # fmt: skip
    apart = f"{fired[0][-1] - fired[0][0]:.3f} s" if len(fired[0]) == 2 else "not two"
    found = (
        f"Impulses at the two entries are {apart} apart on the skin that follows the edges (printed: 0.050 s, 3.0 mm); "
        f"the finger by finite elements gives {len(fired[1])} impulses."
    )
    return Picture((panels[0], panels[3], panels[1], panels[4], panels[2], panels[5]), columns=2, found=found)


def five_gratings() -> Picture:
    """Wavelengths of five gratings at 100 mm/s, from the density of impulses.

    Gratings of 3.0 to 0.6 mm, groove = ridge, slide at 100 mm/s (within 3 %), white noise at 40 dB. Left: a synthetic
    gauge that feels the grating's profile. Right: the middle gauge of the default finger by finite elements, 0.3 N.
    The method is as printed, with a threshold of 1.5 and a window of 200 ms. Dashed: the true wavelengths.
    """
    panels, told = [], []
    for number, kind in enumerate(BOTH):
        curves = []
        for color, wavelength in enumerate(SHARED.five_mm):
            seen = _scene("const", kind, wavelength, 1.5)
            found = answers_to(ImpulseDensity(), seen)[0]
            rows = slice(SETTLED, None)
            curves += [
                Curve(f"{wavelength:g} mm", seen.time_s[rows], np.asarray(found.wavelength_mm)[rows], color=color),
                Curve("", seen.time_s[[0, -1]], np.full(2, wavelength), "dashed", origin="true", color=color),
            ]
        told.append(", ".join(f"{np.nanmean(one.y):.2f}" for one in curves[::2]))
        panels.append(Panel(f"({'ab'[number]}) {kind}", "time, s", "wavelength, mm", tuple(curves),
                            x_range=(0.3, 1.5), y_range=(0, 5)))  # fmt: skip
    found = f"Means of 3.0, 2.4, 1.8, 1.2, 0.6 mm: synthetic {told[0]}; by finite elements {told[1]} mm."
    return Picture(tuple(panels), columns=2, found=found)


def depths() -> Picture:
    """Wavelengths of two gratings, and the reaction, at pressing depths of 0.2 to 0.8 mm.

    Left: the default finger by finite elements slides over 3.0 and 0.6 mm at 100 mm/s, friction 0.3, the depth held;
    points are medians of the impulse density's wavelength over 0.4 s, bars hold two thirds of it, no noise; dashed
    lines are true. Right: the force on a rigid flat at these depths, with the touch-down offset of 0.155 mm that joins
    the printed points, and without; the two printed forces are points.
    """
    finger = Finger.default()
    section, curves = fem.prepare_section(finger), []
    for wavelength in (3.0, 0.6):
        mean, spread = [], []
        for depth in DEPTHS_MM:
            grating, motion = Grating(wavelength / 2, wavelength / 2, 0.5), fem.Motion.steady(100.0, 0.7)
            slid = fem.slide(
                finger,
                grating,
                motion,
                depth=depth,
                friction=GRATINGS.friction,
                section=section,
                length_mm=GRATINGS.length_mm,
            )
            told = ImpulseDensity().process(np.column_stack([slid.readings[:, 2], np.full(700, 100.0)])).wavelength_mm
            low, middle, high = np.nanquantile(np.asarray(told)[SETTLED:], (0.16, 0.5, 0.84))
            mean.append(float(middle))
            spread.append(float(high - low) / 2)
        curves.append(Curve(f"{wavelength:g} mm", np.array(DEPTHS_MM), np.array(mean), "points", np.array(spread)))
        curves.append(Curve("", np.array(DEPTHS_MM)[[0, -1]], np.full(2, wavelength), "dashed", origin="true"))
    reduced, deep = fem.prepare(finger), np.arange(0.2, 0.81, 0.1)
    forces = [
        [newton_to_gf(fem.press(reduced, HalfSpace(RIGID_MPA), indentation=d - off).force) for d in deep.tolist()]
        for off in (OFFSET_MM, 0.0)
    ]
    printed = np.array(REACTIONS_GF).T
    reaction = (
        Curve("touch-down 0.155 mm early", deep, np.array(forces[0], float)),
        Curve("first contact is zero", deep, np.array(forces[1], float), "dashed"),
        Curve("printed", printed[0], printed[1], "points", origin="printed"),
    )
    ratio, shown = curves[0].y / curves[2].y, [f"{force:.3g}" for force in (forces[0][0], forces[0][-1])]
    found = (
        f"The longer grating is estimated as {ratio.min():.2f} to {ratio.max():.2f} times the shorter, truly 5: "
        "by finite elements every ridge of the skin feels every edge. "
        f"Forces at 0.2 and 0.8 mm: {' and '.join(shown)} gf (printed 0.70 and 38.37)."
    )
    panels = (
        Panel("wavelength", "pressing depth, mm", "wavelength, mm", tuple(curves), y_range=(0, 5)),
        Panel("reaction", "pressing depth, mm", "force, gf", reaction),
    )
    return Picture(panels, columns=2, found=found)


@cache
def _strokes() -> dict[str, Scene]:
    return {kind: _scene("strokes", kind, 1.8, 3.0) for kind in BOTH}


def _frequencies(make) -> tuple[list[Curve], dict[str, np.ndarray]]:
    """Curves of a method's frequency for both kinds of signals after the true one, and the columns by kind."""
    scenes = _strokes()
    told = {kind: np.asarray(answers_to(make(), seen)[0].frequency_Hz) for kind, seen in scenes.items()}
    seen = scenes["synthetic"]
    curves = [Curve("|v| / wavelength", seen.time_s, seen.frequency_Hz, "dashed", origin="true")]
    curves += [Curve(kind, seen.time_s, told[kind]) for kind in BOTH]
    return curves, told


WINDOW = (1.0, 3.0)
"""Seconds of a stroke that are shown: two periods."""


def natural_touch() -> Picture:
    """Natural touch: speed, frequency by impulses, and wavelength.

    A grating of 1.8 mm under strokes of 1 Hz and 100 mm/s at 40 dB, as a synthetic gauge feels it and as the middle
    gauge of the default finger by finite elements does (0.3 N). (a) speed, (b) frequency by the density of impulses as
    printed, (c) |v| / f. Dashed: what is true, which the paper draws, too.
    """
    curves, told = _frequencies(ImpulseDensity)
    seen = _strokes()["synthetic"]
    speed = Curve("", seen.time_s, seen.velocity_mm_s)
    lengths = [Curve(kind, seen.time_s, np.abs(seen.velocity_mm_s) / told[kind]) for kind in BOTH]
    true = Curve("1.8 mm", np.array(WINDOW), np.full(2, 1.8), "dashed", origin="true")
    rows = slice(JUDGED_FROM, None)
    lags = [lag_ms(told[kind][rows], seen.frequency_Hz[rows], seen.sample_rate_Hz) for kind in BOTH]
    words = ", ".join(f"{lag:.0f} ms {kind}" for lag, kind in zip(lags, BOTH, strict=True))
    found = f"Lag of the best correlation: {words} (printed: about 100 ms)."
    panels = (
        Panel("(a) speed of the finger", "time, s", "speed, mm/s", (speed,), x_range=WINDOW),
        Panel("(b) frequency", "time, s", "frequency, Hz", tuple(curves), x_range=WINDOW, y_range=(0, 160)),
        Panel("(c) wavelength", "time, s", "wavelength, mm", (true, *lengths), x_range=WINDOW, y_range=(0, 6)),
    )
    return Picture(panels, found=found)


def against_spectrum() -> Picture:
    """Density of impulses against a short-time spectrum, under natural touch.

    The grating and the strokes of figure 7. (a) density of impulses, (b) the greatest line of a spectrum of 200 ms,
    both as printed, beside |v| / wavelength (dashed).
    """
    density, told = _frequencies(ImpulseDensity)
    spectrum, lines = _frequencies(ShortTimeSpectrum)
    rows, truth = slice(JUDGED_FROM, None), _strokes()["synthetic"].frequency_Hz
    words = [
        f"{kind} {correlation(told[kind][rows], truth[rows]):.2f} (density), "
        f"{correlation(lines[kind][rows], truth[rows]):.2f} (spectrum)"
        for kind in BOTH
    ]
    panels = tuple(
        Panel(title, "time, s", "frequency, Hz", tuple(curves), x_range=WINDOW, y_range=(0, 160))
        for title, curves in (("(a) density of impulses", density), ("(b) spectrum of 200 ms", spectrum))
    )
    return Picture(panels, found=f"Correlation with |v| / wavelength, lag included: {'; '.join(words)}.")


def single_intervals() -> Picture:
    """A frequency from single intervals of impulses flickers.

    The grating and the strokes of figure 7; one over the time between two impulses, equation (5) as printed. With two
    impulses a groove it reads up to twice the frequency.
    """
    curves, told = _frequencies(ImpulseInterval)
    density = _frequencies(ImpulseDensity)[1]
    steps = [float(np.sqrt(np.nanmean(np.diff(one["synthetic"][JUDGED_FROM:]) ** 2))) for one in (told, density)]
    found = f"Rms step from sample to sample: {steps[0]:.1f} Hz by intervals, {steps[1]:.1f} Hz by density (synthetic)."
    panels = tuple(
        Panel(
            f"({'ab'[k]}) {one.label}", "time, s", "frequency, Hz", (curves[0], one), x_range=WINDOW, y_range=(0, 250)
        )
        for k, one in enumerate(curves[1:])
    )
    return Picture(panels, found=found)


FIGURES = (
    Figure("fig. 2", two_grooves, ("A16", "A16b")),
    Figure("fig. 5", five_gratings, ("A19", "A19b")),
    Figure("fig. 6", depths, ("A20", "A21", "A21b")),
    Figure("fig. 7", natural_touch, ("A22", "A23"), "strokes"),
    Figure("fig. 8", against_spectrum, ("A24", "A25", "A26"), "strokes"),
    Figure("fig. 9", single_intervals, ("A28",), "strokes"),
)
