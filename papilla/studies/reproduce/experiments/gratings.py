"""Gratings under the finite-element finger: what its gauges hear of them, and what the published methods make of it."""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from papilla.errors import InputError
from papilla.estimators import find_lines
from papilla.estimators.published.roughness import ImpulseDensity
from papilla.fem.sliding.motion import Motion
from papilla.fem.sliding.reduced_section import ReducedSection, prepare_section
from papilla.fem.sliding.slide import Slide, slide
from papilla.finger import Finger
from papilla.specimen import Grating
from papilla.studies.reproduce.claim import Found, Series
from papilla.studies.reproduce.signals import FIVE_MM
from papilla.telepresence import read_curve
from papilla.textures import MeasuredProfile

GROOVE_MM = 0.5
DEPTHS_MM = (0.2, 0.5, 0.8)
LENGTH_MM = 7.0
"""Along y: it turns forces of the section into newtons, and no reading depends on it."""
FRICTION = 0.3
SIMULATED = "a plane section with ridges and inertia, rigid gratings; gauges read strain"


def run(tell) -> Found:
    """Gratings under the finger by finite elements: what the gauges hear, and what the methods of 2006 tell.

    The plane section of the default finger slides over gratings with groove = ridge, 0.5 mm deep, friction 0.3: five
    wavelengths at 100 mm/s, two of them at three pressing depths, and single scenes for speed, friction, smooth skin, a
    trapezoid, a rough profile and the finest grating. No noise is added.
    """
    finger = Finger.default()
    tell("the section")
    ridged = prepare_section(finger)
    assert finger.ridges is not None
    tell("five gratings at 100 mm/s")
    five = {one: _slide(finger, one, 100.0, 0.7, ridged, depth=0.5) for one in FIVE_MM}
    tell("depths")
    deep = {
        (one, depth): _slide(finger, one, 100.0, 0.7, ridged, depth=depth) for one in (3.0, 0.6) for depth in DEPTHS_MM
    }
    tell("single scenes")
    line = _slide(finger, 3.0, 60.0, 0.8, ridged, depth=0.5)
    lines = find_lines(line.motion.position_mm, line.readings[:, 2:3], wavelength_range_mm=(0.5, 8.0)).lines
    values = {
        "pitch": ridged.ridge_pitch,
        "ridge_width": finger.ridges.width,
        "slid": float(sum(np.isfinite(found.readings).all() for found in five.values())),
        "statuses": "; ".join(f"{one:g} mm {found.status.split(':')[0]}" for one, found in five.items()),
        "groove_ridge": Grating(0.9, 0.9, GROOVE_MM).groove / 0.9,
        "fem_line": lines[0].wavelength_mm if lines else float("nan"),
        "fem_fundamental": lines[0].fundamental_mm if lines else float("nan"),
        **_levels(five),
        **_depths(deep),
        **_scenes(finger, ridged),
        **_curve(),
    }
    rows = slice(300, 600)
    series = tuple(
        Series(f"{one:g} mm", found.motion.position_mm[rows], found.readings[rows, 2] - found.readings[rows, 2].mean())
        for one, found in five.items()
        if one in (3.0, 1.8, 0.6)
    )
    title = "The middle gauge over three gratings at 100 mm/s, 0.5 mm deep (finite elements)"
    return Found(values, title, "path, mm", "strain about its mean, microstrain", series)


def _slide(
    finger: Finger,
    wavelength: float,
    speed: float,
    seconds: float,
    section: ReducedSection,
    *,
    depth: float,
    friction: float = FRICTION,
    dynamics: str = "auto",
) -> Slide:
    grating, motion = Grating(wavelength / 2, wavelength / 2, GROOVE_MM), Motion.steady(speed, seconds)
    return slide(
        finger, grating, motion, depth=depth, friction=friction, dynamics=dynamics, section=section, length_mm=LENGTH_MM
    )


def _density(found: Slide) -> np.ndarray:
    """Answers (n,) in mm of the printed density to the middle gauge, after its window is full."""
    speed = np.full(len(found.readings), found.motion.position_mm[-1] / found.motion.t_s[-1])
    answer = np.asarray(ImpulseDensity().process(np.column_stack([found.readings[:, 2], speed])).wavelength_mm)[300:]
    return answer[np.isfinite(answer)]


def _heard(found: Slide, wavelength: float) -> np.ndarray:
    """Rms (g,) in microstrain of what has the grating's period: its first three harmonics, over the last half."""
    place = found.motion.position_mm
    periods = np.floor(0.5 * np.ptp(place) / wavelength)
    rows = place > place[-1] - periods * wavelength + 1e-9
    readings = found.readings[rows] - found.readings[rows].mean(axis=0)
    turns = np.exp(-2j * np.pi * np.outer(np.arange(1, 4), place[rows]) / wavelength)
    return np.sqrt(2 * (np.abs(turns @ readings / rows.sum()) ** 2).sum(axis=0))


def _levels(five: dict[float, Slide]) -> dict:
    answers = [_density(found) for found in five.values()]
    apart = [
        float(one.mean() - other.mean() > one.std() + other.std()) if one.size and other.size else 0.0
        for one, other in zip(answers, answers[1:], strict=False)
    ]
    told = []
    for found in five.values():
        rows = slice(100, None)
        lines = find_lines(found.motion.position_mm[rows], found.readings[rows], wavelength_range_mm=(0.5, 8.0)).lines
        told.append(lines[0].fundamental_mm if lines else float("nan"))
    right = [abs(one / true - 1) < 0.02 for one, true in zip(told, five, strict=True)]
    return {
        "fem_levels": float(np.mean(apart)),
        "fem_levels_mm": ", ".join(f"{one.mean():.2f}" if one.size else "none" for one in answers) + " mm",
        "lines_right": float(np.mean(right)),
        "lines_mm": ", ".join(f"{one:.3f}" for one in told),
    }


def _depths(deep: dict[tuple[float, float], Slide]) -> dict:
    means = {key: float(_density(found).mean()) if _density(found).size else np.nan for key, found in deep.items()}
    ratios = [means[3.0, depth] / means[0.6, depth] for depth in DEPTHS_MM]
    weakest = {key: float(_heard(found, key[0]).min()) for key, found in deep.items()}
    return {
        "depths_apart": float(np.min(ratios)),
        "depths_mm": ", ".join(f"{means[3.0, d]:.2f} and {means[0.6, d]:.2f} mm at {d:g} mm" for d in DEPTHS_MM),
        "weakest": min(weakest.values()),
        "weakest_each": ", ".join(f"{value:.0f}" for value in weakest.values()),
    }


def _scenes(finger: Finger, ridged) -> dict:
    """Periods, speeds, friction, wavelengths, a trapezoid, and the finest grating."""
    slow = _slide(finger, 1.8, 20.0, 0.6, ridged, depth=0.5, dynamics="quasi-static", friction=0.0)
    period = round(1.8 / 20.0 * 1000)
    signal = slow.readings[-2 * period :, 2]
    repeats = np.sqrt(np.mean((signal[:period] - signal[period:]) ** 2)) / signal.std()
    speeds = [_slide(finger, 1.2, speed, 0.5, ridged, depth=0.5, friction=0.0) for speed in (40.0, 160.0)]
    power = [float(one.readings[200:, 2].var()) for one in speeds]
    spectra = []
    for friction in (0.0, FRICTION):
        found = _slide(finger, 1.8, 20.0, 0.6, ridged, depth=0.5, dynamics="quasi-static", friction=friction)
        part = found.readings[-3 * period :, 2]
        spectra.append(np.abs(np.fft.rfft(part - part.mean())))
    smooth = prepare_section(_smooth(finger))
    own = _smooth(finger)
    rms = [
        float(_heard(_slide(own, one, 20.0, 0.8, smooth, depth=0.5, dynamics="quasi-static"), one)[2])
        for one in (3.0, 1.8)
    ]
    trapezoid = slide(
        finger,
        Grating(0.9, 0.9, GROOVE_MM, flank=0.1),
        Motion.steady(20.0, 0.2),
        depth=0.5,
        section=ridged,
        length_mm=7.0,
    )
    try:
        finest = _slide(finger, 0.2, 20.0, 0.3, ridged, depth=0.5, dynamics="quasi-static")
        heard: float | str = float(_heard(finest, 0.2).max())
    except InputError as error:
        heard = f"the section does not resolve it: {error}"
    rough, pitch = _rough(finger, ridged), ridged.ridge_pitch
    lines = find_lines(rough.motion.position_mm, rough.readings, wavelength_range_mm=(0.3, 2.0)).lines
    waves = [line.wavelength_mm for line in lines]
    return {
        "rough_lines": float(sum(min(abs(pitch / k / one - 1) for k in (1, 2, 3, 4)) > 0.03 for one in waves)),
        "rough_mm": ", ".join(f"{one:.3f}" for one in waves) or "none",
        "rough_uE": float(rough.readings[200:, 2].std()),
        "repeats": float(repeats),
        "speed_ratio": power[1] / power[0],
        "speed_dynamics": ", ".join(one.dynamics for one in speeds),
        "stick_slip": float(np.linalg.norm(spectra[1] - spectra[0]) / np.linalg.norm(spectra[0])),
        "grows": rms[0] / rms[1],
        "trapezoid": float(np.isfinite(trapezoid.readings).all()),
        "finest": heard,
    }


def _rough(finger: Finger, section: ReducedSection) -> Slide:
    """A scene on a rough profile without a period: noise through a Gaussian of 0.1 mm."""
    place = np.arange(-25.0, 45.0, 0.02)
    height = gaussian_filter1d(np.random.default_rng(60).standard_normal(place.size), 5.0)
    profile = MeasuredProfile(place, 0.02 * height / height.std())
    return slide(finger, profile, Motion.steady(20.0, 1.0), depth=0.5, section=section, length_mm=LENGTH_MM)


def _smooth(finger: Finger) -> Finger:
    from dataclasses import replace

    return replace(finger, ridges=None)


def _curve() -> dict:
    """The power curve that ships, of sliding scenes."""
    curve = read_curve()
    power, place = np.asarray(curve.power), np.asarray(curve.wavelength_mm)
    inside = [k for k in range(1, len(power) - 1) if power[k] > max(power[k - 1], power[k + 1])]
    nearest = min((float(place[k]) for k in inside), key=lambda one: abs(one - 1.2), default=float("nan"))
    return {
        "r_squared": curve.as_printed.r_squared,
        "curve_peak": nearest,
        "peaks": ", ".join(f"{place[k]:.1f}" for k in inside),
    }
