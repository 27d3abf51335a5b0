"""Gratings under the finite-element finger: the signals of its gauges, and the results of the published methods."""

from dataclasses import dataclass, replace
from functools import cache as once
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from papilla import cache
from papilla.estimators import find_lines
from papilla.estimators.published.roughness import ImpulseDensity
from papilla.estimators.published.roughness.impulses import Corpuscle
from papilla.fem.sliding import slide as sliding
from papilla.fem.sliding.dynamics import LOSS_FACTOR
from papilla.fem.sliding.motion import Motion
from papilla.fem.sliding.reduced_section import ReducedSection, prepare_section
from papilla.finger import Finger, Gauge, Ridges
from papilla.mesh.section import SIZE_MM
from papilla.specimen import Grating
from papilla.studies.reproduce.claim import Found, Series, gathered
from papilla.studies.reproduce.signals import FIVE_MM, apart
from papilla.telepresence import read_curve
from papilla.telepresence.amplitude import PowerCurve
from papilla.textures import Flat, MeasuredProfile, Texture

GROOVE_MM = 0.5
DEPTHS_MM = (0.2, 0.5, 0.8)
LENGTH_MM = 7.0
"""Length along y, which converts forces of the section to newtons; no reading depends on it."""
FRICTION, STATIC = 0.3, 0.4
"""Kinetic friction; static friction, a third more as in A7."""
MIDDLE = 2
"""The gauge at the apex, with a grid of 2.4 mm."""
GRIDS = {2.4: MIDDLE, 1.0: 5, 0.2: 6}
"""Gauges at the apex by the length of their grid in mm: the finger's own, and two more."""
OWN = 5
"""Gauges of the design itself."""
RIDGE_MM = 0.6
"""Width of a ridge (2011 Okamoto 3.2.2), or half of the pitch if that is less."""
OTHER_PITCH_MM = 0.8
FINE_MM = 0.05
"""Size (mm) of the skin's elements for the finest grating."""
OKAMOTO_DEPTH_MM, OKAMOTO_SPEED_MM_S = 1.0, 40.0
"""Pressing depth and speed of the scenes behind the shipped power curve."""
NO_LOSS = 1e-3
"""Loss factor of a finger without viscosity."""


@dataclass(frozen=True)
class Assumed:
    """Parameters that the papers do not print: pitch of the ridges, grid of the gauge that is read, loss factor of the
    silicone, friction."""

    pitch_mm: float = 1.2
    grid_mm: float = 2.4
    loss_factor: float = LOSS_FACTOR
    friction: float = FRICTION

    @property
    def gauge(self) -> int:
        """Number of the gauge that is read."""
        return GRIDS[self.grid_mm]


ASSUMED = Assumed()
SIMULATED = "a plane section with ridges and inertia, rigid gratings; gauges read strain"
SCENE = (
    "gratings (a smooth plate), two grooves (further apart), the difference between static and kinetic friction,"
    " viscosity, other depths",
)


def run(tell, cause: bool = True) -> Found:
    """Gratings under the finger by finite elements: what the gauges hear, and what the methods of 2006 tell.

    The plane section of the default finger slides over gratings with groove = ridge, 0.5 mm deep, friction 0.3: five
    wavelengths at 100 mm/s under ridges of two pitches, two of them at three pressing depths, the two grooves of figure
    2 at 60 mm/s, and single scenes for speed, friction, smooth skin, a trapezoid, a rough profile and the finest
    grating. No noise is added.
    """
    tell("five gratings at 100 mm/s")
    values = gathered(
        lambda: _levels(ASSUMED) if cause else {},
        lambda: _finer_ridges(ASSUMED) if cause else {},
        lambda: _depths(ASSUMED, cause),
        lambda: _two_grooves(ASSUMED, cause),
    )
    tell("single scenes")
    values |= gathered(
        lambda: _speeds(ASSUMED) if cause else {},
        lambda: _viscosity(ASSUMED, cause),
        lambda: _stick_slip(cause),
        lambda: _smooth_skin(ASSUMED) if cause else {},
        lambda: _rough(ASSUMED),
        _scenes,
        lambda: _finest(cause),
        lambda: _curve(ASSUMED),
    )
    rows = slice(300, 600)
    series = []
    for one in (3.0, 1.8, 0.6) if cause else ():
        found = slid(ASSUMED, grating(one), Motion.steady(100.0, 0.7), 0.5)
        middle = found.readings[rows, MIDDLE]
        series.append(Series(f"{one:g} mm", found.place_mm[rows], middle - middle.mean()))
    title = "The middle gauge over three gratings at 100 mm/s, 0.5 mm deep (finite elements)"
    return Found(values, title, "path, mm", "strain about its mean, microstrain", tuple(series))


class Felt(NamedTuple):
    """Readings of the gauges over a scene: place_mm (m,) of the finger, readings (m, g) in microstrain, the mean force
    in N, the dynamics, and the status."""

    place_mm: np.ndarray
    readings: np.ndarray
    force_N: float
    dynamics: str
    status: str

    @property
    def speed_mm_s(self) -> float:
        """Mean speed of a scene sampled at 1 kHz."""
        return 1000 * float(np.ptp(self.place_mm)) / (len(self.place_mm) - 1)


def finger_of(assumed: Assumed, smooth: bool = False) -> Finger:
    """The default finger with ridges of a pitch, or none, and two more gauges at the apex."""
    finger = Finger.default()
    assert finger.ridges is not None
    more = tuple(Gauge(f"grid {one:g} mm", angle_deg=0.0, length_mm=one) for one in (1.0, 0.2))
    ridges = Ridges(assumed.pitch_mm, min(RIDGE_MM, assumed.pitch_mm / 2), finger.ridges.height)
    return replace(finger, gauges=(*finger.gauges, *more), ridges=None if smooth else ridges)


@once
def _section(pitch_mm: float, smooth: bool, size_mm: float) -> ReducedSection:
    """The section of the finger with ridges of a pitch, or without; kept in memory."""
    return prepare_section(finger_of(replace(ASSUMED, pitch_mm=pitch_mm), smooth), size_mm=size_mm)


def slid(
    assumed: Assumed, texture: Texture, motion: Motion, depth: float, *, smooth=False, size_mm=SIZE_MM, **how
) -> Felt:
    """A scene at a pressing depth in mm, kept in the cache; `how` as for `papilla.fem.slide`."""
    finger = finger_of(assumed, smooth)
    how = {"friction": assumed.friction, "loss_factor": assumed.loss_factor, "length_mm": LENGTH_MM, **how}

    def make() -> dict[str, np.ndarray]:
        section = _section(assumed.pitch_mm, smooth, size_mm)
        found = sliding.slide(finger, texture, motion, depth=depth, section=section, **how)
        words = np.array([found.dynamics, found.status])
        force = np.array(found.force_N.mean())
        return {"place": found.motion.position_mm, "readings": found.readings, "force": force, "words": words}

    key = cache.key(sliding.__name__, finger.sha256, texture, motion.t_s, motion.position_mm, depth, size_mm, how)
    found = cache.fetch("slide", key, make)
    return Felt(found["place"], found["readings"], float(found["force"]), *found["words"].tolist())


def grating(wavelength_mm: float) -> Grating:
    """A grating with groove = ridge, 0.5 mm deep."""
    return Grating(wavelength_mm / 2, wavelength_mm / 2, GROOVE_MM)


def two_grooves(between_mm: float = 1.5) -> MeasuredProfile:
    """The plate of 2006, figure 2: two grooves of 1.5 mm at this distance."""
    edges = np.cumsum([0.0, 1.5, between_mm, 1.5])
    x = np.concatenate([[-60.0], *([edge - 0.01, edge + 0.01] for edge in edges), [60.0]])
    place = np.sort(np.concatenate([np.arange(-60, 60, 0.1), x]))
    inside = ((place > edges[0]) & (place < edges[1])) | ((place > edges[2]) & (place < edges[3]))
    return MeasuredProfile(np.unique(place), np.where(inside, -GROOVE_MM, 0.0)[np.unique(place, return_index=True)[1]])


def _density(found: Felt, gauge: int) -> np.ndarray:
    """Answers (n,) in mm of the printed density for a gauge, after its window is full."""
    block = np.column_stack([found.readings[:, gauge], np.full(len(found.readings), found.speed_mm_s)])
    answer = np.asarray(ImpulseDensity().process(block).wavelength_mm)[300:]
    return answer[np.isfinite(answer)]


def _heard(found: Felt, wavelength: float, harmonics: int = 3) -> np.ndarray:
    """Rms (g,) in microstrain of the part with the grating's period: its first harmonics, over the last half."""
    place = found.place_mm
    periods = np.floor(0.5 * np.ptp(place) / wavelength)
    rows = place > place[-1] - periods * wavelength + 1e-9
    readings = found.readings[rows] - found.readings[rows].mean(axis=0)
    turns = np.exp(-2j * np.pi * np.outer(np.arange(1, harmonics + 1), place[rows]) / wavelength)
    return np.sqrt(2 * (np.abs(turns @ readings / rows.sum()) ** 2).sum(axis=0))


def _levels(assumed: Assumed) -> dict:
    """The five levels by the printed density, and by the path's spectrum."""
    five = {one: slid(assumed, grating(one), Motion.steady(100.0, 0.7), 0.5) for one in FIVE_MM}
    levels = [_density(found, assumed.gauge) for found in five.values()]
    told = []
    for found in five.values():
        readings = found.readings[100:, :OWN]
        lines = find_lines(found.place_mm[100:], readings, wavelength_range_mm=(0.5, 8.0)).lines
        told.append(lines[0].fundamental_mm if lines else float("nan"))
    right = [abs(one / true - 1) < 0.02 for one, true in zip(told, five, strict=True)]
    return {
        "fem_levels": apart(levels),
        "fem_levels_mm": ", ".join(f"{one.mean():.2f}" if one.size else "none" for one in levels) + " mm",
        "fem_right": float(np.mean(right)),
        "fem_mm": ", ".join(f"{one:.3f}" for one in told),
        "slid": float(sum(np.isfinite(found.readings).all() for found in five.values())),
        "statuses": "; ".join(f"{one:g} mm {found.status.split(':')[0]}" for one, found in five.items()),
    }


def _finer_ridges(assumed: Assumed) -> dict:
    """The five levels under ridges of another pitch."""
    found = _levels(replace(assumed, pitch_mm=OTHER_PITCH_MM))
    return {name.replace("fem", "finer"): value for name, value in found.items() if name.startswith("fem")}


def _depths(assumed: Assumed, cause: bool = True) -> dict:
    """Two gratings at three pressing depths: the answers, and the smallest signal of a gauge."""
    textures, motion = {one: grating(one) if cause else Flat() for one in (3.0, 0.6)}, Motion.steady(100.0, 0.7)
    deep = {(one, depth): slid(assumed, textures[one], motion, depth) for one in textures for depth in DEPTHS_MM}
    answers = {key: _density(found, assumed.gauge) for key, found in deep.items()}
    means = {key: float(one.mean()) if one.size else np.nan for key, one in answers.items()}
    heard = {key: _heard(found, key[0])[:OWN] for key, found in deep.items()}
    weakest = {key: float(own.min()) for key, own in heard.items()}
    first, last = DEPTHS_MM[0], DEPTHS_MM[-1] if cause else DEPTHS_MM[0]
    deeper = {one: float(heard[one, last][MIDDLE] / heard[one, first][MIDDLE]) for one in textures}
    pressed = deep[3.0, DEPTHS_MM[-1]].force_N / deep[3.0, first].force_N
    return {
        "deeper": deeper[3.0],
        "deeper_fine": deeper[0.6],
        "force_exponent": float(np.log(deeper[3.0]) / np.log(pressed)),
        "depths_apart": float(np.min([means[3.0, depth] / means[0.6, depth] for depth in DEPTHS_MM])),
        "depths_mm": ", ".join(f"{means[3.0, d]:.2f} and {means[0.6, d]:.2f} mm at {d:g} mm" for d in DEPTHS_MM),
        "weakest": min(weakest.values()),
        "weakest_each": ", ".join(f"{value:.0f}" for value in weakest.values()),
    }


def _two_grooves(assumed: Assumed, cause: bool = True) -> dict:
    """Two grooves at 60 mm/s: time after which the signal of the first one repeats, and impulses during the passage."""
    readings = slid(
        assumed, two_grooves(1.5 if cause else 2.5), Motion.sampled([0.0, 0.8], [-24.0, 24.0]), 0.5
    ).readings
    signal = readings[:, assumed.gauge] - np.median(readings[:, assumed.gauge])
    related = np.correlate(signal, signal, "full")[len(signal) - 1 :]
    lags = np.arange(len(related))
    peaks = [k for k in lags[1:-1] if related[k] > max(related[k - 1], related[k + 1]) and 0.02 <= k / 1000 <= 0.15]
    fired = np.nan_to_num([*map(Corpuscle(200, Corpuscle.PRINTED).fire, readings[:, assumed.gauge].tolist())])
    return {
        "groove_s": max(peaks, key=lambda k: related[k]) / 1000 if peaks else float("nan"),
        "groove_impulses": int(np.abs(fired[100:-100]).sum()),
    }


def _at_speeds(assumed: Assumed, **how) -> tuple[float, str]:
    """Ratio of the gauge's power at 160 to that at 40 mm/s on 1.2 mm without friction, and the dynamics."""
    both = [slid(assumed, grating(1.2), Motion.steady(v, 0.5), 0.5, friction=0.0, **how) for v in (160.0, 40.0)]
    fast, slow = (one.readings[200:, assumed.gauge].var() for one in both)
    return float(fast / slow), ", ".join(one.dynamics for one in both)


def _speeds(assumed: Assumed) -> dict:
    """Effect of the speed, with ridges."""
    ratio, dynamics = _at_speeds(assumed)
    return {"speed_ratio": ratio, "speed_dynamics": dynamics}


def _viscosity(assumed: Assumed, cause: bool = True) -> dict:
    """The same on smooth skin; without its cause there is no viscosity."""
    own = assumed if cause else replace(assumed, loss_factor=NO_LOSS)
    return {"falls": _at_speeds(own, smooth=True, dynamics="modal")[0]}


def _stick_slip(cause: bool) -> dict:
    """Change of the spectrum from kinetic to static friction, over that from one stretch of a slide to the next."""
    spectra, static = {}, STATIC if cause else FRICTION
    for friction in (FRICTION, static):
        found = slid(ASSUMED, grating(1.8), Motion.steady(100.0, 0.65), 0.5, friction=friction)
        for number, part in enumerate(np.split(found.readings[200:632, MIDDLE], 2)):
            spectra[friction, number] = np.abs(np.fft.rfft(part - part.mean()))
    own = [spectra[FRICTION, 0], spectra[FRICTION, 1]]
    scatter = np.linalg.norm(own[1] - own[0])
    change = np.linalg.norm(spectra[static, 1] - own[0])
    return {"stick_slip": float(change / scatter), "stick_change": float(change / np.linalg.norm(own[0]))}


def _smooth_skin(assumed: Assumed) -> dict:
    """Ratio of the signal of 3.0 mm to that of 1.8 mm on smooth skin."""
    slow = {"smooth": True, "dynamics": "quasi-static"}
    coarse, fine = (
        _heard(slid(assumed, grating(one), Motion.steady(20.0, 0.8), 0.5, **slow), one)[assumed.gauge]
        for one in (3.0, 1.8)
    )
    return {"grows": float(coarse / fine)}


def _scenes() -> dict:
    """A repeated period, a trapezoid; what the design states."""
    ridges = Finger.default().ridges
    assert ridges is not None
    slow = slid(ASSUMED, grating(1.8), Motion.steady(20.0, 0.6), 0.5, dynamics="quasi-static", friction=0.0)
    period = round(1.8 / 20.0 * 1000)
    signal = slow.readings[-2 * period :, MIDDLE]
    repeats = np.sqrt(np.mean((signal[:period] - signal[period:]) ** 2)) / signal.std()
    trapezoid = slid(ASSUMED, Grating(0.9, 0.9, GROOVE_MM, flank=0.1), Motion.steady(20.0, 0.2), 0.5)
    return {
        "pitch": ridges.pitch,
        "ridge_width": ridges.width,
        "groove_ridge": grating(1.8).groove / 0.9,
        "repeats": float(repeats),
        "trapezoid": float(np.isfinite(trapezoid.readings).all()),
    }


def _finest(cause: bool) -> dict:
    """Signals of the gauges over 0.2 mm, on a section whose elements resolve it."""
    finest = slid(
        ASSUMED, grating(0.2) if cause else Flat(), Motion.steady(20.0, 0.1), 0.5,
        size_mm=FINE_MM, dynamics="quasi-static",
    )  # fmt: skip
    heard = _heard(finest, 0.2)[:OWN]
    return {"finest": float(heard.max()), "finest_each": ", ".join(f"{one:.0f}" for one in heard)}


def _rough(assumed: Assumed) -> dict:
    """Lines in a scene on a rough profile without a period (noise through a Gaussian of 0.1 mm), those of ridges left
    out."""
    place = np.arange(-25.0, 45.0, 0.02)
    height = gaussian_filter1d(np.random.default_rng(60).standard_normal(place.size), 5.0)
    profile = MeasuredProfile(place, 0.02 * height / height.std())
    rough = slid(assumed, profile, Motion.steady(20.0, 1.0), 0.5, friction=0.0)
    heard = [*range(OWN)] if assumed.gauge == MIDDLE else [assumed.gauge]
    lines = find_lines(rough.place_mm, rough.readings[:, heard], wavelength_range_mm=(0.3, 2.0)).lines
    waves = [line.wavelength_mm for line in lines]
    own = [assumed.pitch_mm / k for k in (1, 2, 3, 4)]
    return {
        "rough_lines": float(sum(min(abs(ridge / one - 1) for ridge in own) > 0.03 for one in waves)),
        "rough_mm": ", ".join(f"{one:.3f}" for one in waves) or "none",
        "rough_uE": float(rough.readings[200:, MIDDLE].std()),
    }


def _curve(assumed: Assumed) -> dict:
    """The shipped power curve, from sliding scenes, or one from other scenes: whether it is higher at 1.2 mm than
    beside it, and the places of its maxima."""
    curve = read_curve()
    if assumed != ASSUMED:
        curve = PowerCurve(curve.wavelength_mm, _powers(assumed, curve.wavelength_mm))
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


def _powers(assumed: Assumed, wavelengths_mm) -> tuple[float, ...]:
    """Power of the fundamental over its greatest: mean of the five gauges, or of the one with another grid."""
    motion = Motion.steady(OKAMOTO_SPEED_MM_S, 0.8)
    scenes = [slid(assumed, grating(one), motion, OKAMOTO_DEPTH_MM, friction=0.0) for one in wavelengths_mm]
    heard = np.array([_heard(found, one, 1) for found, one in zip(scenes, wavelengths_mm, strict=True)])
    power = heard[:, : OWN if assumed.gauge == MIDDLE else None] ** 2
    power = power if assumed.gauge == MIDDLE else power[:, [assumed.gauge]]
    return tuple((power / power.max(axis=0)).mean(axis=1).tolist())


VARIED = {
    "groove_s": _two_grooves,
    "fem_levels": _levels,
    "fem_right": _levels,
    "finer_levels": _finer_ridges,
    "depths_apart": _depths,
    "speed_ratio": _speeds,
    "falls": _viscosity,
    "grows": _smooth_skin,
    "rough_lines": _rough,
    "r_squared": _curve,
    "at_ridge": _curve,
}
