"""The 2006 paper: impulses of a model corpuscle count the grooves that pass (III); softness from the spread of five
gauges (IV)."""

from functools import cache

import numpy as np

from papilla import fem
from papilla.calibration.published import SPECIMENS_MPA, compare_with_published, published_sd
from papilla.core.units import KPA_PER_MPA, gf_to_newton, newton_to_gf
from papilla.model.finger import Finger
from papilla.model.specimen import Block, HalfSpace
from papilla.model.textures import MeasuredProfile
from papilla.scenes.scenes import Scene
from papilla.view.contact_map import contact_profile
from papilla_papers.claims import signals
from papilla_papers.claims.experiments import gratings, impulses, presses, softness
from papilla_papers.claims.scenes import by_factors, even
from papilla_papers.claims.signals import SHARED_SIGNALS, answers_to, frequencies_Hz, listed, noisy_scene, times
from papilla_papers.figures.picture import Curve, Panel, Picture, Shade, dashed, printed
from papilla_papers.methods.roughness import ImpulseDensity, ImpulseInterval, ShortTimeSpectrum

IMPULSE_FIGURES, SOFTNESS_FIGURES = impulses.IMPULSE_SCENE.figures, softness.SOFTNESS_SCENE.figures
SIGNAL_KINDS = ("synthetic", "finger by finite elements")
"""The two kinds of signals; below, the names of their scenes at constant speed and under strokes."""
STEADY_SCENES, STROKE_SCENES = (
    dict(zip(SIGNAL_KINDS, names, strict=True))
    for names in (IMPULSE_FIGURES.steady.scenes, IMPULSE_FIGURES.strokes.scenes)
)
JUDGED_ROWS = slice(impulses.IMPULSE_SCENE.touch.first_sample, None)
"""Rows of a scene with strokes from which lags and steps are computed."""
STROKES_WINDOW_S: tuple[float, float] = IMPULSE_FIGURES.strokes.window_s


def two_grooves() -> Picture:
    """Impulses at the edges of two grooves.

    Two grooves of 1.5 mm, 1.5 mm apart, pass at 60 mm/s. Left: one point of a skin that follows the edges within 0.2
    mm, which is how the paper explains the method. Right: the middle gauge of the default finger by finite elements,
    0.5 mm deep, without noise. (a) output, (b) its derivative, rectified, with the threshold of 1.5 times its mean of
    200 ms, (c) impulses. Print has one gauge of the sensor, whose contact is narrow enough to feel single edges; here
    each ridge of the skin in the contact feels every edge.
    """
    setup = IMPULSE_FIGURES.two_grooves
    plate = impulses.IMPULSE_SCENE.grooves
    memory = impulses.IMPULSE_SCENE.window_samples
    time, (begin_mm, end_mm) = times(setup.seconds), setup.profile_mm
    x = np.arange(begin_mm, end_mm, setup.point_mm)
    place = plate.speed_mm_s * (time - plate.from_s)
    inside = sum((x > begin) & (x < begin + plate.groove_mm) for begin in (0, 2 * plate.groove_mm))
    motion = fem.Motion.sampled([0, setup.seconds], [place[0], place[-1]], seconds=setup.seconds)
    slid = gratings.default_slide(MeasuredProfile(x, -setup.depth_mm * inside), motion, depth=setup.depth_mm)
    window, columns, fired = (setup.first_s, setup.seconds), [], []
    for source, output, unit in (
        ("skin that follows the edges", impulses.skin_over_grooves(time), "depth of a groove"),
        ("finger by finite elements", slid.readings[:, gratings.MIDDLE_GAUGE], "microstrain"),
    ):
        rate = np.abs(np.diff(output, prepend=output[0])) * SHARED_SIGNALS.rate_Hz
        mean = np.array([rate[max(0, k + 1 - memory) : k + 1].mean() for k in range(len(rate))])
        impulse = impulses.impulses_of(output)
        impulse[time < setup.first_s] = 0.0  # The first window is not full yet
        fired.append(time[impulse > 0])
        measured = Curve("", time[impulse != 0], np.ones(np.count_nonzero(impulse)), "impulses")
        expected = printed("printed: 0.050 s apart", plate.from_s + np.array([0, setup.apart_s]), 1)
        slope = (Curve("", time, rate), Curve("threshold", time, impulses.IMPULSE_SCENE.threshold * mean, "dashed"))
        columns.append(
            (
                Panel(f"(a) output, {source}", "time, s", unit, (Curve("", time, output),), x_range=window),
                Panel("(b) derivative", "time, s", f"{unit} / s", slope, x_range=window),
                Panel(
                    "(c) impulses", "time, s", "impulse", (measured, expected), x_range=window, y_range=setup.impulse
                ),
            )
        )
    apart = f"{fired[0][-1] - fired[0][0]:.3f} s" if len(fired[0]) == 2 else "not two"
    finding = (
        f"Impulses at the two entries are {apart} apart on the skin that follows the edges (printed: 0.050 s, 3.0 mm); "
        f"the finger by finite elements gives {len(fired[1])} impulses."
    )
    panels = tuple(panel for row in zip(*columns, strict=True) for panel in row)
    return Picture(panels, columns=len(columns), found=finding)


def five_gratings() -> Picture:
    """Wavelengths of five gratings at 100 mm/s, from the density of impulses.

    Gratings of 3.0 to 0.6 mm, groove = ridge, slide at 100 mm/s (within 3 %), white noise at 40 dB. Left: a synthetic
    gauge that feels the grating's profile. Right: the middle gauge of the default finger by finite elements, 0.3 N.
    The method is as printed, with a threshold of 1.5 and a window of 200 ms. Dashed: the true wavelengths.
    """
    setup, axis, panels, means = IMPULSE_FIGURES.steady, IMPULSE_FIGURES.levels_mm, [], []
    for letter, (source, name) in zip("ab", STEADY_SCENES.items(), strict=True):
        curves = []
        for color, wavelength in enumerate(SHARED_SIGNALS.five_mm):
            seen = noisy_scene(name, wavelength, "2006", IMPULSE_FIGURES.seed, seconds=setup.seconds)
            estimate, rows = answers_to(ImpulseDensity(), seen)[0], slice(gratings.GRATING_SCENE.window_is_full, None)
            curves += [
                Curve(f"{wavelength:g} mm", seen.time_s[rows], np.asarray(estimate.wavelength_mm)[rows], color=color),
                dashed(seen.time_s[[0, -1]], wavelength, color=color),
            ]
        means.append(listed(np.nanmean(curve.y) for curve in curves[::2]))
        title = f"({letter}) {source}"
        panels.append(Panel(title, "time, s", "wavelength, mm", tuple(curves), x_range=setup.window_s, y_range=axis))
    finding = f"Means of 3.0, 2.4, 1.8, 1.2, 0.6 mm: synthetic {means[0]}; by finite elements {means[1]} mm."
    return Picture(tuple(panels), columns=2, found=finding)


def depths() -> Picture:
    """Wavelengths of two gratings, and the reaction, at pressing depths of 0.2 to 0.8 mm.

    Left: the default finger by finite elements slides over 3.0 and 0.6 mm at 100 mm/s, friction 0.3, the depth held;
    points are medians of the impulse density's wavelength over 0.4 s, bars hold two thirds of it, no noise; dashed
    lines are true. Right: the force on a rigid flat at these depths, with the touch-down offset of 0.155 mm that joins
    the printed points, and without; the two printed forces are points.
    """
    deep, curves = np.array(IMPULSE_FIGURES.depths_mm), []
    for wavelength in (gratings.GRATING_SCENE.depths.coarse_mm, gratings.GRATING_SCENE.depths.fine_mm):
        usual = gratings.GRATING_SCENE.usual
        felt = [gratings.over(gratings.ASSUMED_SLIDE, wavelength, usual, depth_mm=float(mm)) for mm in deep]
        answers = [gratings.density(slide, gratings.MIDDLE_GAUGE) for slide in felt]
        quantiles = [np.quantile(answer, IMPULSE_FIGURES.two_thirds) for answer in answers]
        low, middle, high = np.array(quantiles).T
        points = Curve(f"{wavelength:g} mm", deep, middle, "points", (high - low) / 2)
        curves += [points, dashed(deep[[0, -1]], wavelength)]
    reduced, flat = fem.prepare(Finger.default()), HalfSpace(presses.RIGID_MPA)
    early, late = (
        np.array([newton_to_gf(fem.press(reduced, flat, indentation=d - off).force) for d in deep.tolist()])
        for off in (presses.OFFSET_MM, 0.0)
    )
    reaction = (
        Curve("touch-down 0.155 mm early", deep, early),
        Curve("first contact is zero", deep, late, "dashed"),
        printed("printed", presses.PRINTED_SETTINGS.depths_mm[:2], presses.PRINTED_SETTINGS.forces_gf),
    )
    ratio = curves[0].y / curves[2].y
    finding = (
        f"The longer grating is estimated as {ratio.min():.2f} to {ratio.max():.2f} times the shorter, truly 5: "
        "by finite elements every ridge of the skin feels every edge. "
        f"Forces at 0.2 and 0.8 mm: {early[0]:.3g} and {early[-1]:.3g} gf (printed 0.70 and 38.37)."
    )
    panels = (
        Panel("wavelength", "pressing depth, mm", "wavelength, mm", tuple(curves), y_range=IMPULSE_FIGURES.levels_mm),
        Panel("reaction", "pressing depth, mm", "force, gf", reaction),
    )
    return Picture(panels, columns=2, found=finding)


@cache
def _strokes() -> dict[str, Scene]:
    setup = IMPULSE_FIGURES.strokes
    return {
        source: noisy_scene(
            name, impulses.IMPULSE_SCENE.wavelength_mm, "2006", IMPULSE_FIGURES.seed, seconds=setup.seconds
        )
        for source, name in STROKE_SCENES.items()
    }


def _frequencies(make) -> tuple[list[Curve], dict[str, np.ndarray]]:
    """Curves of a method's frequency for both kinds of signals after the true one, and the columns by kind."""
    frequencies = {source: frequencies_Hz(make(), seen) for source, seen in _strokes().items()}
    seen = _strokes()[SIGNAL_KINDS[0]]
    curves = [dashed(seen.time_s, seen.frequency_Hz, "|v| / wavelength")]
    return curves + [Curve(source, seen.time_s, frequency) for source, frequency in frequencies.items()], frequencies


def _over_time(title: str, quantity: str, curves, y_range: tuple[float, float] | None = None) -> Panel:
    return Panel(title, "time, s", quantity, tuple(curves), x_range=STROKES_WINDOW_S, y_range=y_range)


def natural_touch() -> Picture:
    """Natural touch: speed, frequency by impulses, and wavelength.

    A grating of 1.8 mm under strokes of 1 Hz and 100 mm/s at 40 dB, as a synthetic gauge feels it and as the middle
    gauge of the default finger by finite elements does (0.3 N). (a) speed, (b) frequency by the density of impulses as
    printed, (c) |v| / f. Dashed: what is true, which the paper draws, too.
    """
    setup, (curves, frequencies) = IMPULSE_FIGURES.strokes, _frequencies(ImpulseDensity)
    seen = _strokes()[SIGNAL_KINDS[0]]
    lengths = [Curve(source, seen.time_s, np.abs(seen.velocity_mm_s) / hertz) for source, hertz in frequencies.items()]
    true = dashed(STROKES_WINDOW_S, impulses.IMPULSE_SCENE.wavelength_mm, "1.8 mm")
    lags = {
        source: signals.lag_ms(hertz[JUDGED_ROWS], seen.frequency_Hz[JUDGED_ROWS], seen.sample_rate_Hz)
        for source, hertz in frequencies.items()
    }
    words = ", ".join(f"{lag:.0f} ms {source}" for source, lag in lags.items())
    panels = (
        _over_time("(a) speed of the finger", "speed, mm/s", [Curve("", seen.time_s, seen.velocity_mm_s)]),
        _over_time("(b) frequency", "frequency, Hz", curves, setup.density_Hz),
        _over_time("(c) wavelength", "wavelength, mm", [true, *lengths], setup.wavelength_mm),
    )
    return Picture(panels, found=f"Lag of the best correlation: {words} (printed: about 100 ms).")


def against_spectrum() -> Picture:
    """Density of impulses against a short-time spectrum, under natural touch.

    The grating and the strokes of figure 7. (a) density of impulses, (b) the greatest line of a spectrum of 200 ms,
    both as printed, beside |v| / wavelength (dashed).
    """
    methods = {"(a) density of impulses": ImpulseDensity, "(b) spectrum of 200 ms": ShortTimeSpectrum}
    both = {title: _frequencies(method) for title, method in methods.items()}
    truth = _strokes()[SIGNAL_KINDS[0]].frequency_Hz[JUDGED_ROWS]
    (_, density), (_, lines) = both.values()
    words = [
        f"{source} {signals.correlation(density[source][JUDGED_ROWS], truth):.2f} (density), "
        f"{signals.correlation(lines[source][JUDGED_ROWS], truth):.2f} (spectrum)"
        for source in SIGNAL_KINDS
    ]
    y_range = IMPULSE_FIGURES.strokes.density_Hz
    panels = tuple(_over_time(title, "frequency, Hz", curves, y_range) for title, (curves, _) in both.items())
    return Picture(panels, found=f"Correlation with |v| / wavelength, lag included: {'; '.join(words)}.")


def single_intervals() -> Picture:
    """A frequency from single intervals of impulses flickers.

    The grating and the strokes of figure 7; one over the time between two impulses, equation (5) as printed. With two
    impulses a groove it reads up to twice the frequency.
    """
    (true, *curves), intervals = _frequencies(ImpulseInterval)
    density = _frequencies(ImpulseDensity)[1]
    both = [answer[SIGNAL_KINDS[0]][JUDGED_ROWS] for answer in (intervals, density)]
    steps = [float(np.sqrt(np.nanmean(np.diff(frequency) ** 2))) for frequency in both]
    finding = (
        f"Rms step from sample to sample: {steps[0]:.1f} Hz by intervals, {steps[1]:.1f} Hz by density (synthetic)."
    )
    panels = tuple(
        _over_time(f"({letter}) {curve.label}", "frequency, Hz", (true, curve), IMPULSE_FIGURES.strokes.intervals_Hz)
        for letter, curve in zip("ab", curves, strict=True)
    )
    return Picture(panels, found=finding)


def contacts() -> Picture:
    """Contact with a hard and a soft specimen: the hard one is touched on less, and pushes harder.

    The default finger is pressed by 60 gf on blocks of 0.72 and 0.089 MPa, 10 mm thick, stuck to them. Left and middle:
    the pressure between them, with the edge of the contact. Right: the pressure along x. Print has a drawing without
    numbers.
    """
    reduced, line = fem.prepare(Finger.default()), even(SOFTNESS_FIGURES.across_mm)
    grid = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    panels, curves, words = [], [], []
    force, thickness = gf_to_newton(presses.PRESS_SCENE.force_gf), presses.PRESS_SCENE.thickness_mm
    pressed = {
        name: fem.press(reduced, Block(modulus, thickness), force=force, friction="stick")
        for name, modulus in (("hard", presses.HARD_MODULUS_MPA), ("soft", presses.SOFT_MODULUS_MPA))
    }
    top = KPA_PER_MPA * max(press.peak_pressure for press in pressed.values())
    for letter, (name, press) in zip("ab", pressed.items(), strict=True):
        profile = contact_profile(reduced, press)
        assert profile is not None
        pressure = KPA_PER_MPA * profile(grid).reshape(len(line), len(line))
        modulus = f"{press.modulus:g} MPa"
        shade = Shade(line, line, pressure, "kPa", over=pressure > 0, top=top)
        panels.append(Panel(f"({letter}) {name}, {modulus}", "x, mm", "y, mm", shade=shade, even=True))
        curves.append(Curve(modulus, line, pressure[len(line) // 2]))
        words.append(
            f"{press.contact_area:.0f} mm2, {KPA_PER_MPA * press.peak_pressure:.1f} kPa, S_d {press.sd:.0f} ({name})"
        )
    panels.append(Panel("pressure along x", "x, mm", "pressure, kPa", tuple(curves)))
    finding = f"Area, greatest pressure and spread of the gauges in microstrain: {'; '.join(words)}."
    return Picture(tuple(panels), columns=len(panels), found=finding)


def spread() -> Picture:
    """The spread of the gauges against force and modulus, beside equation (9).

    The calibration of the default finger (presses by finite elements with large strain, stuck) predicts S_d at 10 to
    100 gf. Points: equation (9) as printed, times one factor that fits all of them best, for the unit of S_d is not
    printed and its data are not either. (a) over the force, (b) over the modulus.
    """
    calibration = softness.calibrated(fem.prepare(Finger.default()))
    force = even(SOFTNESS_FIGURES.force_gf)
    moduli = by_factors(SOFTNESS_FIGURES.modulus_MPa)
    specimens = np.array(SPECIMENS_MPA)
    some = force[:: SOFTNESS_FIGURES.every]
    ours, theirs, _ = compare_with_published(calibration.predict, softness.SD_FORCES_GF)
    scale, off = softness.scaled_to_9(ours)
    over_force, over_modulus = [], []
    for color, modulus in enumerate(SPECIMENS_MPA):
        sd = np.asarray(calibration.predict(gf_to_newton(force), modulus))
        over_force += [
            Curve(f"{modulus:g} MPa", force, sd, color=color),
            printed(f"(9), {modulus:g} MPa", some, published_sd(some, modulus) / scale, color),
        ]
    for color, level in enumerate(softness.SOFTNESS_SCENE.forces_gf):
        sd = np.asarray(calibration.predict(gf_to_newton(level), moduli))
        over_modulus += [
            Curve(f"{level:g} gf", moduli, sd, color=color),
            printed("", specimens, published_sd(level, specimens) / scale, color),
        ]
    (soft, middle, hard), (printed_soft, printed_middle, printed_hard) = ours[-1], theirs[-1]
    finding = (
        f"One factor of {scale:.4g} joins (9) and the model within {off:.1f} % rms. At 100 gf the hardest "
        f"specimen has {hard / middle:.3f} and the softest {soft / middle:.3f} of the middle one's S_d; (9) has "
        f"{printed_hard / printed_middle:.3f} and {printed_soft / printed_middle:.3f}."
    )
    panels = (
        Panel("(a)", "force, gf", "S_d, microstrain", tuple(over_force), x_range=SOFTNESS_FIGURES.shown_gf),
        Panel("(b)", "modulus, MPa", "S_d, microstrain", tuple(over_modulus)),
    )
    return Picture(panels, columns=2, found=finding)
