"""The 2011 paper on remote tactile transmission: wavelength and power of gratings (4), and what its four experiments
displayed (5)."""

from collections.abc import Mapping
from functools import cache

import numpy as np

from papilla import fem
from papilla.model.finger import Finger
from papilla.telepresence import HandMotion, read_curve
from papilla_papers.claims.experiments import gratings
from papilla_papers.claims.experiments.spectra import SPECTRUM_PAPER, SPECTRUM_SCENE, in_strokes
from papilla_papers.claims.signals import SHARED_SIGNALS, RATE_Hz, share_of_noise
from papilla_papers.figures.picture import Curve, Panel, Picture, PrintedTable, dashed
from papilla_papers.grating_signals import signals_over_gratings
from papilla_papers.methods.roughness import Okamoto, fit_amplitude
from papilla_papers.telepresence import NOTICED_MS, TESTS_MM, Condition, experiments_2011

SPECTRUM_FIGURES = SPECTRUM_SCENE.figures
HAND_MOTION = HandMotion()
"""The average touch of section 4.1.1, whose peak speed and rate are the defaults."""


def wavelengths() -> Picture:
    """Wavelengths by the greatest line of a spectrum of 32 ms, in natural touch.

    Gratings of 0.5 to 3.0 mm under strokes of 197 sin(2 pi 1.07 t) mm/s, noise at 20 dB. Points are the means of every
    millisecond above 0.3 of the greatest speed, bars their standard deviation; dashed is the truth. Synthetic gauges
    have four seeds; the finger by finite elements (middle gauge, its mean removed, 1 mm deep, friction 0.3) has one
    cycle where the paper has five. Print has no numbers.
    """
    setup, truth = SPECTRUM_FIGURES.wavelengths, np.array(SPECTRUM_FIGURES.wavelengths.gratings_mm)
    synthetic = [in_strokes(mm) for mm in setup.gratings_mm]
    time, turn = np.arange(round(RATE_Hz / HAND_MOTION.strokes_Hz)) / RATE_Hz, 2 * np.pi * HAND_MOTION.strokes_Hz
    velocity = HAND_MOTION.peak_mm_s * np.sin(turn * time)
    place = HAND_MOTION.peak_mm_s / turn * (1 - np.cos(turn * time))
    motion, section, felt = fem.Motion(time, place, float(RATE_Hz)), fem.prepare_section(Finger.default()), []
    for mm in setup.gratings_mm:
        slid = gratings.default_slide(gratings.grating(mm), motion, depth=SPECTRUM_FIGURES.depth_mm, section=section)
        # The mean is taken away, as by a bridge that is balanced when the finger rests on the grating
        output = slid.amplified[:, gratings.MIDDLE_GAUGE] - slid.amplified[:, gratings.MIDDLE_GAUGE].mean()
        noise = share_of_noise(SHARED_SIGNALS.snr_dB[SPECTRUM_PAPER]) * output.std()
        output = output + noise * np.random.default_rng(setup.seed).standard_normal(len(output))
        estimates = np.asarray(Okamoto().process(np.column_stack([output, velocity])).wavelength_mm)
        fast = (np.abs(velocity) > setup.fast * HAND_MOTION.peak_mm_s) & (time > setup.settled_s)
        felt.append(estimates[fast & np.isfinite(estimates)])
    curves, words = [dashed(truth[[0, -1]], truth[[0, -1]], "match")], []
    for number, (name, groups) in enumerate((("synthetic", synthetic), ("finger by finite elements", felt))):
        mean, spread = np.array([g.mean() for g in groups]), np.array([g.std() for g in groups])
        curves.append(Curve(name, truth + setup.beside_mm * number, mean, "points", spread))
        off = np.abs(mean - truth)
        fine, coarse = off[truth < setup.coarse_mm].max(), off[truth >= setup.coarse_mm].max()
        words.append(f"{name}: below 2 mm within {fine:.2f} mm, from 2 mm on {coarse:.2f} mm")
    panel = Panel("", "wavelength of the grating, mm", "estimated, mm", tuple(curves), y_range=setup.estimated_mm)
    return Picture((panel,), found=f"Greatest error of the mean: {'; '.join(words)}.")


@cache
def _powers() -> np.ndarray:
    """(speeds, gratings) power of the fundamental, the mean of five gauges, over the greatest."""
    how = {"force": None, "depth": SPECTRUM_FIGURES.depth_mm, "friction": 0.0}
    how |= {"length_mm": gratings.GRATING_SCENE.length_mm, "pitches_mm": (gratings.ASSUMED_SLIDE.pitch_mm,)}
    scenes = [
        signals_over_gratings(Finger.default(), TESTS_MM, speed_mm_s=speed, **how)
        for speed in SPECTRUM_FIGURES.power.speeds_mm_s
    ]
    powers = [[float(np.mean(signal.fundamental**2)) for signal in of_speed] for of_speed in scenes]
    return np.array(powers) / np.max(powers)


def power_over_speed() -> Picture:
    """Power of the gauges' signal against the speed.

    The default finger by finite elements, ridges of 1.2 mm pitch, 1 mm deep on gratings of 0.8 to 2.0 mm, without
    friction; power of the fundamental, the mean of five gauges, over the greatest of all. The paper finds it nearly
    flat, against what it expected of viscosity; its speeds and powers are not printed as numbers.
    """
    powers, setup = _powers(), SPECTRUM_FIGURES.power
    curves = tuple(Curve(f"{mm:g} mm", np.array(setup.speeds_mm_s), powers[:, k]) for k, mm in enumerate(TESTS_MM))
    ratio = powers.max(axis=0) / powers.min(axis=0)
    finding = (
        f"From 25 to 200 mm/s a grating's power changes by a factor of {ratio.min():.1f} to {ratio.max():.1f}; between "
        f"gratings at one speed by {(powers.max(axis=1) / powers.min(axis=1)).max():.0f}."
    )
    panel = Panel("", "speed, mm/s", "power over the greatest", curves, x_range=setup.shown_mm_s, log="y")
    return Picture((panel,), found=finding)


def power_over_wavelength() -> Picture:
    """Power of the gauges' signal against the wavelength, with the fourth-order fit of equation (8).

    The powers of figure 10: points are means over the speeds, bars standard deviations. The line is a quartic through
    them, as equation (8) is, whose coefficients are lost in the text at hand but for the first. Dashed: the curve that
    ships with papilla, scaled to the same mean. The vertical line is twice the printed width of the ridges, 0.6 mm,
    where the paper has its local maximum.
    """
    powers, place = _powers(), np.array(TESTS_MM)
    mean = powers.mean(axis=0)
    fit, curve = fit_amplitude(place, mean), read_curve()
    line = np.linspace(place[0], place[-1], SPECTRUM_FIGURES.power.points)
    shipped = np.interp(line, curve.wavelength_mm, curve.power)
    curves = (
        Curve("mean over the speeds", place, mean, "points", powers.std(axis=0), color=0),
        Curve(f"quartic, R² = {fit.r_squared:.2f}", line, np.asarray(fit(line)), color=0),
        Curve("curve that ships, scaled", line, shipped * mean.mean() / shipped.mean(), "dashed", color=2),
        dashed(2 * gratings.GRATING_SCENE.ridge_mm, (0, 1), "groove = ridge width", origin="printed"),
    )
    finding = (
        f"The power is greatest at {place[np.argmax(mean)]:g} mm; R² of the quartic is {fit.r_squared:.2f} (printed "
        "0.94, for coefficients that are lost)."
    )
    return Picture((Panel("", "wavelength, mm", "power over the greatest", curves),), found=finding)


@cache
def _conditions() -> Mapping[int, Condition]:
    return experiments_2011()


def _name(condition: Condition) -> str:
    return f"{'direct' if condition.display == 'direct' else 'local model'}{', delayed' if condition.delayed else ''}"


def _cues(delayed: bool) -> Picture:
    """Wavelength, intensity and lag of two experiments: direct feedback, then the local model."""
    place, ends, axes, label = np.array(TESTS_MM), np.array(TESTS_MM)[[0, -1]], SPECTRUM_FIGURES.cues, "explored, mm"
    displays = {_name(display): display for display in _conditions().values() if display.delayed == delayed}
    felt = [Curve(name, place, display.felt_mm) for name, display in displays.items()]
    loud = [Curve("", place, display.amplitude_um) for display in displays.values()]
    lags = [Curve("", place, display.lag_ms) for display in displays.values()]
    if not delayed:
        loud.append(dashed(axes.peak_mm, axes.peak_um, "printed: answers peak", origin="printed"))
    felt.insert(0, dashed(ends, ends, "match"))
    lags.append(dashed(ends, NOTICED_MS, "printed: noticed", origin="printed"))
    panels = (
        Panel("frequency", label, "wavelength displayed, mm", tuple(felt), y_range=axes.displayed_mm),
        Panel("intensity", label, "amplitude, µm", tuple(loud), y_range=axes.amplitude_um),
        Panel("lag", label, "behind the hand, ms", tuple(lags), y_range=axes.lag_ms),
    )
    words = "; ".join(
        f"{name} {np.nanmean(np.abs(display.felt_mm - place)):.2f} mm off, "
        f"{np.nanmedian(display.lag_ms):.0f} ms late, "
        f"greatest amplitude at {place[np.argmax(display.amplitude_um)]:g} mm"
        for name, display in displays.items()
    )
    return Picture(panels, columns=len(panels), found=f"Mean over seven gratings: {words}.")


def without_delay() -> Picture:
    """Experiments 1 and 2: what direct feedback and the local model display of seven gratings.

    The simulated loop of hand, link, sensor and display; no person is simulated, so there are no answers, but what a
    person could judge by. Left: the wavelength that the displayed signal has over the hand's own motion. Middle: its
    amplitude. Right: its lag behind the hand. The answers are printed in a picture, their numbers are lost in the text
    at hand but for the peak near 1.4 mm.
    """
    return _cues(delayed=False)


def with_delay() -> Picture:
    """Experiments 3 and 4: the same with a delay of 120 ms (40 ms standard deviation) on the feedback.

    As figure 15; a new delay is drawn every 200 ms. Direct feedback comes late, which all participants noticed, and
    has no steady wavelength over the hand's own motion; the local model follows the hand.
    """
    return _cues(delayed=True)


def signals() -> Picture:
    """The signals behind tables 1 to 4: what is displayed of each grating in the four experiments.

    The values of figures 15 and 16. The answers of the eight participants are lost in the text at hand, and no person
    is simulated.
    """
    rows = tuple(
        (
            f"{n} ({_name(condition)})",
            explored,
            float(condition.felt_mm[k]),
            float(condition.amplitude_um[k]),
            float(condition.lag_ms[k]),
        )
        for n, condition in _conditions().items()
        for k, explored in enumerate(TESTS_MM)
    )
    heads = ("experiment", "explored, mm", "displayed, mm", "amplitude, µm", "lag, ms")
    return Picture(table=PrintedTable(heads, rows))
