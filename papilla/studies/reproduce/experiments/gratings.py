"""Gratings under the finite-element finger: what its gauges hear of them, and what the published methods make of it."""

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from papilla.estimators import find_lines
from papilla.estimators.published.roughness import ImpulseDensity
from papilla.estimators.published.roughness.impulses import Corpuscle
from papilla.fem.sliding.motion import Motion
from papilla.fem.sliding.reduced_section import ReducedSection, prepare_section
from papilla.fem.sliding.slide import Slide, slide
from papilla.finger import Finger, Gauge, Ridges
from papilla.specimen import Grating
from papilla.studies.reproduce.claim import Found, Series, gathered
from papilla.studies.reproduce.signals import FIVE_MM, apart
from papilla.telepresence import read_curve
from papilla.textures import Flat, MeasuredProfile, Texture

GROOVE_MM = 0.5
DEPTHS_MM = (0.2, 0.5, 0.8)
LENGTH_MM = 7.0
"""Along y: it turns forces of the section into newtons, and no reading depends on it."""
FRICTION, STATIC = 0.3, 0.4
"""Kinetic friction; static friction, a third more as in A7."""
MIDDLE = 2
"""The gauge at the apex, with a grid of 2.4 mm."""
GRIDS_MM = (1.0, 0.2)
"""Of two more gauges there, for the sensitivity to what is not printed."""
LOSSES = (0.3, 1.0)
OTHER_PITCH_MM = 0.8
FINE_MM = 0.05
"""Elements of the skin, mm, for the finest grating; 0.1 elsewhere."""
SIMULATED = "a plane section with ridges and inertia, rigid gratings; gauges read strain"
SCENE = ("gratings (a smooth plate), two grooves (further apart), the difference between static and kinetic friction",)


def run(tell, cause: bool = True) -> Found:
    """Gratings under the finger by finite elements: what the gauges hear, and what the methods of 2006 tell.

    The plane section of the default finger slides over gratings with groove = ridge, 0.5 mm deep, friction 0.3: five
    wavelengths at 100 mm/s under ridges of two pitches, two of them at three pressing depths, the two grooves of figure
    2 at 60 mm/s, and single scenes for speed, friction, smooth skin, a trapezoid, a rough profile and the finest
    grating. Two more gauges with shorter grids and other loss factors tell how rows depend on what is not printed. No
    noise is added.
    """
    more = tuple(Gauge(f"grid {one:g} mm", angle_deg=0.0, length_mm=one) for one in GRIDS_MM)
    finger = replace(Finger.default(), gauges=(*Finger.default().gauges, *more))
    tell("the section")
    ridged = prepare_section(finger)
    tell("five gratings at 100 mm/s")
    five = _five(finger, ridged) if cause else {}
    tell("depths and single scenes")
    values = gathered(
        lambda: _levels(five, "fem") if cause else {},
        lambda: _finer_ridges(finger) if cause else {},
        lambda: _depths(finger, ridged, cause),
        lambda: _two_grooves(finger, ridged, cause),
        lambda: _speeds(finger, ridged) if cause else {},
        lambda: _stick_slip(finger, ridged, cause),
        lambda: _smooth_skin(finger) if cause else {},
        lambda: _scenes(finger, ridged),
        lambda: _finest(finger, cause),
        _curve,
    )
    rows = slice(300, 600)
    series = tuple(
        Series(f"{one:g} mm", found.motion.position_mm[rows], found.readings[rows, 2] - found.readings[rows, 2].mean())
        for one, found in five.items()
        if one in (3.0, 1.8, 0.6)
    )
    title = "The middle gauge over three gratings at 100 mm/s, 0.5 mm deep (finite elements)"
    return Found(values, title, "path, mm", "strain about its mean, microstrain", series)


def grating(wavelength_mm: float) -> Grating:
    """With groove = ridge, 0.5 mm deep."""
    return Grating(wavelength_mm / 2, wavelength_mm / 2, GROOVE_MM)


def slid(
    finger: Finger, texture: Texture, speed: float, seconds: float, section: ReducedSection, depth: float, **how
) -> Slide:
    """A scene at a constant speed and pressing depth."""
    how = {"friction": FRICTION, "length_mm": LENGTH_MM, **how}
    return slide(finger, texture, Motion.steady(speed, seconds), depth=depth, section=section, **how)


def two_grooves(between_mm: float = 1.5) -> MeasuredProfile:
    """The plate of 2006, figure 2: two grooves of 1.5 mm, so far apart."""
    edges = np.cumsum([0.0, 1.5, between_mm, 1.5])
    x = np.concatenate([[-60.0], *([edge - 0.01, edge + 0.01] for edge in edges), [60.0]])
    place = np.sort(np.concatenate([np.arange(-60, 60, 0.1), x]))
    inside = ((place > edges[0]) & (place < edges[1])) | ((place > edges[2]) & (place < edges[3]))
    return MeasuredProfile(np.unique(place), np.where(inside, -GROOVE_MM, 0.0)[np.unique(place, return_index=True)[1]])


def _five(finger: Finger, section: ReducedSection) -> dict[float, Slide]:
    """Slides over the five gratings of 2006."""
    return {one: slid(finger, grating(one), 100.0, 0.7, section, 0.5) for one in FIVE_MM}


def _density(found: Slide, gauge: int = MIDDLE) -> np.ndarray:
    """Answers (n,) in mm of the printed density to a gauge, after its window is full."""
    speed = np.full(len(found.readings), found.motion.position_mm[-1] / found.motion.t_s[-1])
    answer = np.asarray(ImpulseDensity().process(np.column_stack([found.readings[:, gauge], speed])).wavelength_mm)[
        300:
    ]
    return answer[np.isfinite(answer)]


def _heard(found: Slide, wavelength: float) -> np.ndarray:
    """Rms (g,) in microstrain of what has the grating's period: its first three harmonics, over the last half."""
    place = found.motion.position_mm
    periods = np.floor(0.5 * np.ptp(place) / wavelength)
    rows = place > place[-1] - periods * wavelength + 1e-9
    readings = found.readings[rows] - found.readings[rows].mean(axis=0)
    turns = np.exp(-2j * np.pi * np.outer(np.arange(1, 4), place[rows]) / wavelength)
    return np.sqrt(2 * (np.abs(turns @ readings / rows.sum()) ** 2).sum(axis=0))


def _levels(five: dict[float, Slide], name: str) -> dict:
    """The five levels by the printed density, gauge by gauge at the apex, and by the path's spectrum."""
    groups = {gauge: [_density(found, gauge) for found in five.values()] for gauge in (MIDDLE, -2, -1)}
    told = []
    for found in five.values():
        readings = found.readings[100:, :5]
        lines = find_lines(found.motion.position_mm[100:], readings, wavelength_range_mm=(0.5, 8.0)).lines
        told.append(lines[0].fundamental_mm if lines else float("nan"))
    right = [abs(one / true - 1) < 0.02 for one, true in zip(told, five, strict=True)]
    others = zip(GRIDS_MM, (-2, -1), strict=True)
    return {
        f"{name}_levels": apart(groups[MIDDLE]),
        f"{name}_levels_mm": ", ".join(f"{one.mean():.2f}" if one.size else "none" for one in groups[MIDDLE]) + " mm",
        f"{name}_grids": ", ".join(f"{apart(groups[gauge]):.0%} with a grid of {one:g} mm" for one, gauge in others),
        f"{name}_right": float(np.mean(right)),
        f"{name}_mm": ", ".join(f"{one:.3f}" for one in told),
        "slid": float(sum(np.isfinite(found.readings).all() for found in five.values())),
        "statuses": "; ".join(f"{one:g} mm {found.status.split(':')[0]}" for one, found in five.items()),
    }


def _finer_ridges(finger: Finger) -> dict:
    """The five levels under ridges of another pitch."""
    assert finger.ridges is not None
    ridges = Ridges(OTHER_PITCH_MM, OTHER_PITCH_MM / 2, finger.ridges.height)
    other = replace(finger, ridges=ridges)
    found = _levels(_five(other, prepare_section(other)), "finer")
    return {name: value for name, value in found.items() if name.startswith("finer")}


def _depths(finger: Finger, section: ReducedSection, cause: bool) -> dict:
    """Two gratings at three pressing depths: their answers, and the least that any gauge hears."""
    scenes = [(one, depth) for one in (3.0, 0.6) for depth in DEPTHS_MM]
    textures = {one: grating(one) if cause else Flat() for one in (3.0, 0.6)}
    deep = {(one, depth): slid(finger, textures[one], 100.0, 0.7, section, depth) for one, depth in scenes}
    answers = {key: _density(found) for key, found in deep.items()}
    means = {key: float(one.mean()) if one.size else np.nan for key, one in answers.items()}
    weakest = {key: float(_heard(found, key[0])[:5].min()) for key, found in deep.items()}
    return {
        "depths_apart": float(np.min([means[3.0, depth] / means[0.6, depth] for depth in DEPTHS_MM])),
        "depths_mm": ", ".join(f"{means[3.0, d]:.2f} and {means[0.6, d]:.2f} mm at {d:g} mm" for d in DEPTHS_MM),
        "weakest": min(weakest.values()),
        "weakest_each": ", ".join(f"{value:.0f}" for value in weakest.values()),
    }


def _two_grooves(finger: Finger, section: ReducedSection, cause: bool) -> dict:
    """Two grooves at 60 mm/s: after what time the signal of the first comes again, and impulses while they pass."""
    texture = two_grooves(1.5 if cause else 2.5)
    motion = Motion.sampled([0.0, 0.8], [-24.0, 24.0])
    found = slide(finger, texture, motion, depth=0.5, friction=FRICTION, section=section, length_mm=LENGTH_MM)
    signal = found.readings[:, MIDDLE] - np.median(found.readings[:, MIDDLE])
    related = np.correlate(signal, signal, "full")[len(signal) - 1 :]
    lags = np.arange(len(related))
    peaks = [k for k in lags[1:-1] if related[k] > max(related[k - 1], related[k + 1]) and 0.02 <= k / 1000 <= 0.15]
    fired = np.nan_to_num([*map(Corpuscle(200, Corpuscle.PRINTED).fire, found.readings[:, MIDDLE].tolist())])
    return {
        "groove_s": max(peaks, key=lambda k: related[k]) / 1000 if peaks else float("nan"),
        "groove_impulses": int(np.abs(fired[100:-100]).sum()),
    }


def _speeds(finger: Finger, section: ReducedSection) -> dict:
    """Power at the middle gauge at 160 over 40 mm/s, with the assumed loss factor and with others."""
    ratios = {}
    for loss in (None, *LOSSES):
        both = [slid(finger, grating(1.2), v, 0.5, section, 0.5, friction=0.0, loss_factor=loss) for v in (40.0, 160.0)]
        ratios[loss] = float(np.divide(*[one.readings[200:, MIDDLE].var() for one in both[::-1]]))
    return {
        "speed_ratio": ratios[None],
        "speed_losses": ", ".join(f"{ratios[loss]:.2f} with {loss:g}" for loss in LOSSES),
        "speed_dynamics": ", ".join(one.dynamics for one in both),
    }


def _stick_slip(finger: Finger, section: ReducedSection, cause: bool) -> dict:
    """Change of the spectrum from kinetic to static friction, over that from one stretch of a slide to the next."""
    spectra = {}
    for friction in (FRICTION, STATIC if cause else FRICTION):
        found = slid(finger, grating(1.8), 100.0, 0.65, section, 0.5, friction=friction)
        for number, part in enumerate(np.split(found.readings[200:632, MIDDLE], 2)):
            spectra[friction, number] = np.abs(np.fft.rfft(part - part.mean()))
    own = [spectra[FRICTION, 0], spectra[FRICTION, 1]]
    scatter = np.linalg.norm(own[1] - own[0])
    change = np.linalg.norm(spectra[STATIC if cause else FRICTION, 1] - own[0])
    return {"stick_slip": float(change / scatter), "stick_change": float(change / np.linalg.norm(own[0]))}


def _smooth_skin(finger: Finger) -> dict:
    """Signal of 3.0 over that of 1.8 mm on smooth skin, by the length of the grid."""
    own = replace(finger, ridges=None)
    section = prepare_section(own)
    coarse, fine = (
        _heard(slid(own, grating(one), 20.0, 0.8, section, 0.5, dynamics="quasi-static"), one) for one in (3.0, 1.8)
    )
    ratios = coarse / fine
    return {
        "grows": float(ratios[MIDDLE]),
        "grows_grids": ", ".join(
            f"{ratio:.2f} with {one:g} mm" for one, ratio in zip(GRIDS_MM, ratios[-2:], strict=True)
        ),
    }


def _scenes(finger: Finger, section: ReducedSection) -> dict:
    """A repeated period, a trapezoid, a rough profile; what the design states."""
    assert finger.ridges is not None
    slow = slid(finger, grating(1.8), 20.0, 0.6, section, 0.5, dynamics="quasi-static", friction=0.0)
    period = round(1.8 / 20.0 * 1000)
    signal = slow.readings[-2 * period :, MIDDLE]
    repeats = np.sqrt(np.mean((signal[:period] - signal[period:]) ** 2)) / signal.std()
    trapezoid = slid(finger, Grating(0.9, 0.9, GROOVE_MM, flank=0.1), 20.0, 0.2, section, 0.5)
    rough, pitch = _rough(finger, section), section.ridge_pitch
    lines = find_lines(rough.motion.position_mm, rough.readings[:, :5], wavelength_range_mm=(0.3, 2.0)).lines
    waves = [line.wavelength_mm for line in lines]
    return {
        "pitch": pitch,
        "ridge_width": finger.ridges.width,
        "groove_ridge": grating(1.8).groove / 0.9,
        "rough_lines": float(sum(min(abs(pitch / k / one - 1) for k in (1, 2, 3, 4)) > 0.03 for one in waves)),
        "rough_mm": ", ".join(f"{one:.3f}" for one in waves) or "none",
        "rough_uE": float(rough.readings[200:, MIDDLE].std()),
        "repeats": float(repeats),
        "trapezoid": float(np.isfinite(trapezoid.readings).all()),
    }


def _finest(finger: Finger, cause: bool) -> dict:
    """What the gauges hear of 0.2 mm, on a section whose elements resolve it."""
    section = prepare_section(finger, size_mm=FINE_MM)
    finest = slid(finger, grating(0.2) if cause else Flat(), 20.0, 0.1, section, 0.5, dynamics="quasi-static")
    heard = _heard(finest, 0.2)[:5]
    return {"finest": float(heard.max()), "finest_each": ", ".join(f"{one:.0f}" for one in heard)}


def _rough(finger: Finger, section: ReducedSection) -> Slide:
    """A scene on a rough profile without a period: noise through a Gaussian of 0.1 mm."""
    place = np.arange(-25.0, 45.0, 0.02)
    height = gaussian_filter1d(np.random.default_rng(60).standard_normal(place.size), 5.0)
    return slid(finger, MeasuredProfile(place, 0.02 * height / height.std()), 20.0, 1.0, section, 0.5, friction=None)


def _curve() -> dict:
    """The power curve that ships, of sliding scenes: is it higher at 1.2 mm than beside it, where are its maxima?"""
    curve = read_curve()
    power, place = np.asarray(curve.power), np.asarray(curve.wavelength_mm)
    inside = [k for k in range(1, len(power) - 1) if power[k] > max(power[k - 1], power[k + 1])]
    middle = int(np.argmin(np.abs(place - 1.2)))
    on_samples = place[::2][int(np.argmax(power[::2]))]
    return {
        "r_squared": curve.as_printed.r_squared,
        "at_ridge": float(power[middle] / max(power[middle - 1], power[middle + 1])),
        "peaks": ", ".join(f"{place[k]:.1f}" for k in inside),
        "on_samples": float(on_samples),
    }
