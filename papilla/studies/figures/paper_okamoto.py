"""The 2011 paper on remote tactile transmission, section 4: wavelength and power of gratings."""

from functools import cache

import numpy as np

from papilla import fem
from papilla.estimators.published.roughness import Okamoto, fit_amplitude
from papilla.finger import Finger
from papilla.logs.quantities import SAMPLE_RATE_HZ
from papilla.specimen import Grating
from papilla.studies.figures.picture import Curve, Panel, Picture
from papilla.studies.figures.registry import Figure
from papilla.studies.grating_signals import signals_over_gratings
from papilla.studies.reproduce.signals import SHARED, answers_mm, noisy_scene, share_of_noise
from papilla.studies.telepresence.roughness import TESTS_MM
from papilla.telepresence import read_curve

PAPER = "2011_okamoto"
GRATINGS_MM = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0)
PEAK_MM_S, STROKES_HZ = 197.0, 1.07
"""Of the average touch, section 4.1.1."""
SPEEDS_MM_S = (25.0, 50.0, 100.0, 200.0)
"""Of figure 10; those of the print are lost in the text at hand."""
DEPTH_MM = 1.0


def wavelengths() -> Picture:
    """Wavelengths by the greatest line of a spectrum of 32 ms, in natural touch.

    Gratings of 0.5 to 3.0 mm under strokes of 197 sin(2 pi 1.07 t) mm/s, noise at 20 dB. Points are the means of every
    millisecond above 0.3 of the greatest speed, bars their standard deviation; dashed is the truth. Synthetic gauges
    have four seeds; the finger by finite elements (middle gauge, its mean removed, 1 mm deep, friction 0.3) has one
    cycle where the paper has five. Print has no numbers.
    """
    truth = np.array(GRATINGS_MM)
    synthetic = [
        np.concatenate([answers_mm(Okamoto(), noisy_scene("act2", one, PAPER, seed)) for seed in range(4)])
        for one in GRATINGS_MM
    ]
    time = np.arange(round(SAMPLE_RATE_HZ / STROKES_HZ)) / SAMPLE_RATE_HZ
    turn = 2 * np.pi * STROKES_HZ
    velocity, place = PEAK_MM_S * np.sin(turn * time), PEAK_MM_S / turn * (1 - np.cos(turn * time))
    motion, finger = fem.Motion(time, place, SAMPLE_RATE_HZ), Finger.default()
    section, felt = fem.prepare_section(finger), []
    for one in GRATINGS_MM:
        slid = fem.slide(
            finger, Grating(one / 2, one / 2, 0.5), motion, depth=DEPTH_MM, friction=0.3, section=section, length_mm=7.0
        )
        output = slid.amplified[:, 2] - slid.amplified[:, 2].mean()  # An amplifier is balanced in contact
        noise = (
            share_of_noise(SHARED.snr_dB[PAPER]) * output.std() * np.random.default_rng(9).standard_normal(len(output))
        )
        told = np.asarray(Okamoto().process(np.column_stack([output + noise, velocity])).wavelength_mm)
        rows = (np.abs(velocity) > 0.3 * PEAK_MM_S) & (time > 0.1) & np.isfinite(told)
        felt.append(told[rows])
    curves = [Curve("match", truth[[0, -1]], truth[[0, -1]], "dashed", origin="true")]
    for shift, (name, groups) in enumerate((("synthetic", synthetic), ("finger by finite elements", felt))):
        mean, spread = np.array([g.mean() for g in groups]), np.array([g.std() for g in groups])
        curves.append(Curve(name, truth + 0.03 * shift, mean, "points", spread))
    words = "; ".join(
        f"{one.label}: below 2 mm within {np.abs(one.y - truth)[:3].max():.2f} mm, from 2 mm on "
        f"{np.abs(one.y - truth)[3:].max():.2f} mm"
        for one in curves[1:]
    )
    panel = Panel("", "wavelength of the grating, mm", "estimated, mm", tuple(curves), y_range=(0, 5))
    return Picture((panel,), found=f"Greatest error of the mean: {words}.")


@cache
def _powers() -> np.ndarray:
    """(speeds, gratings) power of the fundamental, the mean of five gauges, over the greatest."""
    powers = [
        [
            float(np.mean(one.fundamental**2))
            for one in signals_over_gratings(
                Finger.default(), TESTS_MM, pitches_mm=(1.2,), speed_mm_s=speed, force=None, depth=DEPTH_MM,
                friction=0.0, length_mm=7.0,
            )
        ]
        for speed in SPEEDS_MM_S
    ]  # fmt: skip
    return np.array(powers) / np.max(powers)


def power_over_speed() -> Picture:
    """Power of the gauges' signal against the speed.

    The default finger by finite elements, ridges of 1.2 mm pitch, 1 mm deep on gratings of 0.8 to 2.0 mm, without
    friction; power of the fundamental, the mean of five gauges, over the greatest of all. The paper finds it nearly
    flat, against what it expected of viscosity; its speeds and powers are not printed as numbers.
    """
    powers = _powers()
    curves = tuple(Curve(f"{one:g} mm", np.array(SPEEDS_MM_S), powers[:, k]) for k, one in enumerate(TESTS_MM))
    ratio = powers.max(axis=0) / powers.min(axis=0)
    found = (
        f"From 25 to 200 mm/s a grating's power changes by a factor of {ratio.min():.1f} to {ratio.max():.1f}; between "
        f"gratings at one speed by {(powers.max(axis=1) / powers.min(axis=1)).max():.0f}."
    )
    return Picture(
        (Panel("", "speed, mm/s", "power over the greatest", curves, x_range=(0, 210), log="y"),), found=found
    )


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
    line = np.linspace(place[0], place[-1], 61)
    shipped = np.interp(line, curve.wavelength_mm, curve.power)
    curves = (
        Curve("mean over the speeds", place, mean, "points", powers.std(axis=0), color=0),
        Curve(f"quartic, R² = {fit.r_squared:.2f}", line, np.asarray(fit(line)), color=0),
        Curve("curve that ships, scaled", line, shipped * mean.mean() / shipped.mean(), "dashed", color=2),
        Curve("groove = ridge width", np.full(2, 1.2), np.array([0.0, 1.0]), "dashed", origin="printed"),
    )
    found = (
        f"The power is greatest at {place[np.argmax(mean)]:g} mm; R² of the quartic is {fit.r_squared:.2f} (printed "
        "0.94, for coefficients that are lost)."
    )
    return Picture((Panel("", "wavelength, mm", "power over the greatest", curves),), found=found)


FIGURES = (
    Figure("fig. 9", wavelengths, ("C19", "C21", "C22")),
    Figure("fig. 10", power_over_speed, ("C24", "C27"), "power"),
    Figure("fig. 11", power_over_wavelength, ("C23", "C25"), "power"),
)
