"""Gratings under the finite-element finger: the signals of its gauges, and the results of the published methods."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache as once
from typing import Any, NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from papilla.core import cache
from papilla.estimators import find_lines
from papilla.fem.sliding import slide as sliding
from papilla.fem.sliding.dynamics import LOSS_FACTOR
from papilla.fem.sliding.motion import Motion
from papilla.fem.sliding.section import ReducedSection, prepare_section
from papilla.mesh.section import SECTION_SIZE_MM
from papilla.model.finger import Finger, Gauge, Ridges
from papilla.model.specimen import Grating
from papilla.model.textures import Flat, MeasuredProfile, Texture
from papilla.telepresence import read_curve
from papilla.telepresence.amplitude import PowerCurve
from papilla_papers.claims.claim import Experiment, gathered
from papilla_papers.claims.scenes import scene
from papilla_papers.claims.signals import SHARED_SIGNALS, apart, listed
from papilla_papers.methods.roughness import ImpulseDensity
from papilla_papers.methods.roughness.impulses import Corpuscle

GRATING_SCENE = scene("gratings")
MIDDLE_GAUGE: int = GRATING_SCENE.middle
FINGER_GAUGES: int = GRATING_SCENE.own_gauges
MORE_GRIDS = {float(length): gauge for length, gauge in GRATING_SCENE.more_grids.items()}


@dataclass(frozen=True)
class SlideParameters:
    """Parameters that the papers do not print: pitch of the ridges, grid of the gauge that is read, friction, loss
    factor of the silicone."""

    pitch_mm: float
    grid_mm: float
    friction: float
    loss_factor: float = LOSS_FACTOR

    @property
    def gauge(self) -> int:
        """Number of the gauge that is read."""
        return MORE_GRIDS.get(self.grid_mm, MIDDLE_GAUGE)

    @property
    def gauges(self) -> list[int]:
        """Numbers of the gauges that are read: the finger's own, or the one with another grid."""
        return [*range(FINGER_GAUGES)] if self.gauge == MIDDLE_GAUGE else [self.gauge]


ASSUMED_SLIDE = SlideParameters(**GRATING_SCENE.assumed)


def run(tell, cause: bool = True) -> dict:
    """Gratings under the finger by finite elements: what the gauges read, and what the methods of 2006 answer.

    The plane section of the default finger slides over gratings with groove = ridge, 0.5 mm deep, friction 0.3: five
    wavelengths at 100 mm/s under ridges of two pitches, two of them at three pressing depths, the two grooves of figure
    2 at 60 mm/s, and single scenes for speed, friction, smooth skin, a trapezoid, a rough profile and the finest
    grating. No noise is added.
    """
    tell("five gratings at 100 mm/s")
    values = gathered(
        lambda: _levels(ASSUMED_SLIDE) if cause else {},
        lambda: _finer_ridges(ASSUMED_SLIDE) if cause else {},
        lambda: _depths(ASSUMED_SLIDE, cause),
        lambda: _two_grooves(ASSUMED_SLIDE, cause),
    )
    tell("single scenes")
    return values | gathered(
        lambda: _speeds(ASSUMED_SLIDE) if cause else {},
        lambda: _viscosity(ASSUMED_SLIDE, cause),
        lambda: _stick_slip(cause),
        lambda: _smooth_skin(ASSUMED_SLIDE) if cause else {},
        lambda: _rough(ASSUMED_SLIDE),
        _scenes,
        lambda: _finest(cause),
        lambda: _curve(ASSUMED_SLIDE),
    )


class SceneReadings(NamedTuple):
    """Readings of the gauges over a scene: place_mm (m,) of the finger, readings (m, g) in microstrain, the mean force
    in N, the dynamics, and the status."""

    place_mm: np.ndarray
    readings: np.ndarray
    force_N: float
    dynamics: str
    status: str

    @property
    def speed_mm_s(self) -> float:
        """Mean speed of a scene."""
        return GRATING_SCENE.rate_Hz * float(np.ptp(self.place_mm)) / (len(self.place_mm) - 1)


def finger_of(assumed: SlideParameters, smooth: bool = False) -> Finger:
    """The default finger with ridges of a pitch, or none, and two more gauges at the apex."""
    finger = Finger.default()
    assert finger.ridges is not None
    more = tuple(Gauge(f"grid {length:g} mm", angle_deg=0.0, length_mm=length) for length in MORE_GRIDS)
    ridges = Ridges(assumed.pitch_mm, min(GRATING_SCENE.ridge_mm, assumed.pitch_mm / 2), finger.ridges.height)
    return replace(finger, gauges=(*finger.gauges, *more), ridges=None if smooth else ridges)


@once
def _section(pitch_mm: float, smooth: bool, size_mm: float) -> ReducedSection:
    """The section of the finger with ridges of a pitch, or without; kept in memory."""
    return prepare_section(finger_of(replace(ASSUMED_SLIDE, pitch_mm=pitch_mm), smooth), size_mm=size_mm)


def slid(
    assumed: SlideParameters,
    texture: Texture,
    motion: Motion,
    depth: float,
    *,
    smooth=False,
    size_mm=SECTION_SIZE_MM,
    **how,
) -> SceneReadings:
    """A scene at a pressing depth in mm, kept in the cache; `how` as for `papilla.fem.slide`."""
    finger = finger_of(assumed, smooth)
    how = {"length_mm": GRATING_SCENE.length_mm, **how}
    how = {"friction": assumed.friction, "loss_factor": assumed.loss_factor, **how}

    def make() -> dict[str, np.ndarray]:
        section = _section(assumed.pitch_mm, smooth, size_mm)
        stored = sliding.slide(finger, texture, motion, depth=depth, section=section, **how)
        words = np.array([stored.dynamics, stored.status])
        force = np.array(stored.force_N.mean())
        return {"place": stored.motion.position_mm, "readings": stored.readings, "force": force, "words": words}

    key = cache.key(sliding.__name__, finger.sha256, texture, motion.t_s, motion.position_mm, depth, size_mm, how)
    stored = cache.fetch("slide", key, make)
    return SceneReadings(stored["place"], stored["readings"], float(stored["force"]), *stored["words"].tolist())


def default_slide(texture: Texture, motion: Motion, friction: float = GRATING_SCENE.friction, **how):
    """The default finger over a texture; `how` as for `papilla.fem.slide`."""
    return sliding.slide(Finger.default(), texture, motion, friction=friction, length_mm=GRATING_SCENE.length_mm, **how)


def over(assumed: SlideParameters, texture: Texture | float, setting: Mapping[str, Any], **how) -> SceneReadings:
    """A slide over a texture, or a grating of this wavelength in mm: `speed_mm_s`, `seconds` and `depth_mm` of the
    setting; its other values, and `how`, as for `slid`."""
    how = {**setting, **how}
    motion, depth = Motion.steady(how.pop("speed_mm_s"), how.pop("seconds")), how.pop("depth_mm")
    return slid(assumed, grating(texture) if isinstance(texture, float) else texture, motion, depth, **how)


def grating(wavelength_mm: float) -> Grating:
    """A grating with groove = ridge, 0.5 mm deep."""
    return Grating(wavelength_mm / 2, wavelength_mm / 2, GRATING_SCENE.groove_mm)


def two_grooves(between_mm: float) -> MeasuredProfile:
    """The plate of 2006, figure 2: two grooves at this distance."""
    plate = GRATING_SCENE.two_grooves
    end, flank = plate.half_plate_mm, plate.flank_mm
    edges = np.cumsum([0.0, plate.groove_mm, between_mm, plate.groove_mm])
    x = np.concatenate([[-end], *([edge - flank, edge + flank] for edge in edges), [end]])
    place = np.unique(np.concatenate([np.arange(-end, end, plate.point_mm), x]))
    return MeasuredProfile(place, np.where(np.searchsorted(edges, place) % 2 == 1, -GRATING_SCENE.groove_mm, 0.0))


def density(slide: SceneReadings, gauge: int) -> np.ndarray:
    """Answers (n,) in mm of the printed density for a gauge, after its window is full."""
    block = np.column_stack([slide.readings[:, gauge], np.full(len(slide.readings), slide.speed_mm_s)])
    answer = np.asarray(ImpulseDensity().process(block).wavelength_mm)[GRATING_SCENE.window_is_full :]
    return answer[np.isfinite(answer)]


def _grating_rms(slide: SceneReadings, wavelength: float, harmonics: tuple[int, ...] = (1, 2, 3)) -> np.ndarray:
    """Rms (g,) in microstrain of the part with the grating's period: its first harmonics, over the last half."""
    place = slide.place_mm
    periods = np.floor(0.5 * np.ptp(place) / wavelength)
    rows = place > place[-1] - periods * wavelength + GRATING_SCENE.rounding_mm
    readings = slide.readings[rows] - slide.readings[rows].mean(axis=0)
    turns = np.exp(-2j * np.pi * np.outer(harmonics, place[rows]) / wavelength)
    return np.sqrt(2 * (np.abs(turns @ readings / rows.sum()) ** 2).sum(axis=0))


def _levels(assumed: SlideParameters) -> dict:
    """Wavelengths of the five gratings, as the printed impulse density and the spectrum over the path estimate them."""
    lines_in = GRATING_SCENE.levels
    five = {wavelength: over(assumed, wavelength, GRATING_SCENE.usual) for wavelength in SHARED_SIGNALS.five_mm}
    levels = [density(slide, assumed.gauge) for slide in five.values()]
    estimates, rows = [], slice(lines_in.first_sample, None)
    for slide in five.values():
        readings = slide.readings[rows, :FINGER_GAUGES]
        lines = find_lines(slide.place_mm[rows], readings, wavelength_range_mm=lines_in.wavelength_range_mm).lines
        estimates.append(lines[0].fundamental_mm if lines else float("nan"))
    right = [abs(estimate / true - 1) < lines_in.tolerance for estimate, true in zip(estimates, five, strict=True)]
    return {
        "fem_levels": apart(levels),
        "fem_levels_mm": ", ".join(f"{level.mean():.2f}" if level.size else "none" for level in levels) + " mm",
        "fem_right": float(np.mean(right)),
        "fem_mm": listed(estimates, ".3f"),
        "slid": float(sum(np.isfinite(slide.readings).all() for slide in five.values())),
        "statuses": "; ".join(f"{wavelength:g} mm {slide.status.split(':')[0]}" for wavelength, slide in five.items()),
    }


def _finer_ridges(assumed: SlideParameters) -> dict:
    """The five levels under ridges of another pitch."""
    values = _levels(replace(assumed, pitch_mm=GRATING_SCENE.other_pitch_mm))
    return {name.replace("fem", "finer"): value for name, value in values.items() if name.startswith("fem")}


def _depths(assumed: SlideParameters, cause: bool = True) -> dict:
    """Two gratings at three pressing depths: the answers, and the smallest signal of a gauge."""
    depths, coarse, fine = GRATING_SCENE.depths.each_mm, GRATING_SCENE.depths.coarse_mm, GRATING_SCENE.depths.fine_mm
    textures = {wavelength: wavelength if cause else Flat() for wavelength in (coarse, fine)}
    deep = {
        (wavelength, depth): over(assumed, texture, GRATING_SCENE.usual, depth_mm=depth)
        for wavelength, texture in textures.items()
        for depth in depths
    }
    answers = {key: density(slide, assumed.gauge) for key, slide in deep.items()}
    means = {key: float(answer.mean()) if answer.size else np.nan for key, answer in answers.items()}
    rms = {key: _grating_rms(slide, key[0])[:FINGER_GAUGES] for key, slide in deep.items()}
    weakest = [float(signal.min()) for signal in rms.values()]
    first, last = depths[0], depths[-1] if cause else depths[0]
    deeper = {mm: float(rms[mm, last][MIDDLE_GAUGE] / rms[mm, first][MIDDLE_GAUGE]) for mm in textures}
    pressed = deep[coarse, depths[-1]].force_N / deep[coarse, first].force_N
    return {
        "deeper": deeper[coarse],
        "deeper_fine": deeper[fine],
        "force_exponent": float(np.log(deeper[coarse]) / np.log(pressed)),
        "depths_apart": float(np.min([means[coarse, depth] / means[fine, depth] for depth in depths])),
        "depths_mm": ", ".join(f"{means[coarse, d]:.2f} and {means[fine, d]:.2f} mm at {d:g} mm" for d in depths),
        "weakest": min(weakest),
        "weakest_each": listed(weakest, ".0f"),
    }


def _two_grooves(assumed: SlideParameters, cause: bool = True) -> dict:
    """Two grooves at 60 mm/s: time after which the signal of the first one repeats, and impulses during the passage."""
    plate, rate = GRATING_SCENE.two_grooves, GRATING_SCENE.rate_Hz
    texture = two_grooves(plate.apart_mm if cause else plate.without_cause_mm)
    readings = slid(assumed, texture, Motion.sampled([*plate.times_s], [*plate.places_mm]), plate.depth_mm).readings
    signal = readings[:, assumed.gauge] - np.median(readings[:, assumed.gauge])
    related = np.correlate(signal, signal, "full")[len(signal) - 1 :]
    least, most = plate.lags_s
    peaks = [k for k in _maxima(related) if least <= k / rate <= most]
    corpuscle = Corpuscle(plate.window_samples, Corpuscle.PRINTED)
    fired = np.nan_to_num([*map(corpuscle.fire, readings[:, assumed.gauge].tolist())])
    return {
        "groove_s": max(peaks, key=lambda k: related[k]) / rate if peaks else float("nan"),
        "groove_impulses": int(np.abs(fired[plate.ends_left_out : -plate.ends_left_out]).sum()),
    }


def _maxima(column: np.ndarray) -> list[int]:
    """Places of the local maxima of a column (n,), its ends left out."""
    return [k for k in range(1, len(column) - 1) if column[k] > max(column[k - 1], column[k + 1])]


def _speeds(assumed: SlideParameters, **how) -> dict:
    """Effect of the speed, with ridges: ratio of the gauge's power at the fast to that at the slow speed without
    friction, and the dynamics."""
    setting = dict(GRATING_SCENE.speeds)
    wavelength, speeds = setting.pop("wavelength_mm"), setting.pop("each_mm_s")
    both = [over(assumed, wavelength, setting, speed_mm_s=speed, **how) for speed in speeds]
    fast, slow = (slide.readings[GRATING_SCENE.slides_after :, assumed.gauge].var() for slide in both)
    return {"speed_ratio": float(fast / slow), "speed_dynamics": ", ".join(slide.dynamics for slide in both)}


def _viscosity(assumed: SlideParameters, cause: bool = True) -> dict:
    """The same on smooth skin; without its cause there is no viscosity."""
    rubber = assumed if cause else replace(assumed, loss_factor=GRATING_SCENE.no_loss)
    return {"falls": _speeds(rubber, smooth=True, dynamics="modal")["speed_ratio"]}


def _stick_slip(cause: bool) -> dict:
    """Change of the spectrum from kinetic to static friction, over that from one stretch of a slide to the next."""
    setting, kinetic = dict(GRATING_SCENE.stick_slip), GRATING_SCENE.friction
    wavelength, samples = setting.pop("wavelength_mm"), slice(*setting.pop("samples"))
    spectra, static = {}, GRATING_SCENE.static_friction if cause else kinetic
    for friction in (kinetic, static):
        slide = over(ASSUMED_SLIDE, wavelength, setting, friction=friction)
        for number, stretch in enumerate(np.split(slide.readings[samples, MIDDLE_GAUGE], 2)):
            spectra[friction, number] = np.abs(np.fft.rfft(stretch - stretch.mean()))
    halves = [spectra[kinetic, 0], spectra[kinetic, 1]]
    scatter = np.linalg.norm(halves[1] - halves[0])
    change = np.linalg.norm(spectra[static, 1] - halves[0])
    return {"stick_slip": float(change / scatter), "stick_change": float(change / np.linalg.norm(halves[0]))}


def _smooth_skin(assumed: SlideParameters) -> dict:
    """Ratio of the signal of 3.0 mm to that of 1.8 mm on smooth skin."""
    setting = dict(GRATING_SCENE.smooth_skin)
    coarse, fine = (_grating_rms(over(assumed, mm, setting), mm)[assumed.gauge] for mm in setting.pop("wavelengths_mm"))
    return {"grows": float(coarse / fine)}


def _scenes() -> dict:
    """A repeated period, a trapezoid; what the design states."""
    ridges = Finger.default().ridges
    assert ridges is not None
    wavelength = GRATING_SCENE.flank.wavelength_mm
    slow = over(ASSUMED_SLIDE, wavelength, GRATING_SCENE.repeats)
    period = round(wavelength / GRATING_SCENE.repeats.speed_mm_s * GRATING_SCENE.rate_Hz)
    signal = slow.readings[-2 * period :, MIDDLE_GAUGE]
    repeats = np.sqrt(np.mean((signal[:period] - signal[period:]) ** 2)) / signal.std()
    flanked = replace(grating(wavelength), flank=GRATING_SCENE.flank.flank_mm)
    trapezoid = over(ASSUMED_SLIDE, flanked, GRATING_SCENE.trapezoid)
    return {
        "pitch": ridges.pitch,
        "ridge_width": ridges.width,
        "groove_ridge": grating(wavelength).groove / (wavelength / 2),
        "repeats": float(repeats),
        "trapezoid": float(np.isfinite(trapezoid.readings).all()),
    }


def _finest(cause: bool) -> dict:
    """Signals of the gauges over 0.2 mm, on a section whose elements resolve it."""
    setting = dict(GRATING_SCENE.finest)
    wavelength = setting.pop("wavelength_mm")
    rms = _grating_rms(over(ASSUMED_SLIDE, wavelength if cause else Flat(), setting), wavelength)[:FINGER_GAUGES]
    return {"finest": float(rms.max()), "finest_each": listed(rms, ".0f")}


def _rough(assumed: SlideParameters) -> dict:
    """Lines in a scene on a rough profile without a period, those of ridges left out."""
    setup = GRATING_SCENE.profile
    place = np.arange(setup.from_mm, setup.to_mm, setup.point_mm)
    height = gaussian_filter1d(np.random.default_rng(setup.seed).standard_normal(place.size), setup.blur_points)
    rough = over(assumed, MeasuredProfile(place, setup.rms_mm * height / height.std()), GRATING_SCENE.rough)
    readings = rough.readings[:, assumed.gauges]
    lines = find_lines(rough.place_mm, readings, wavelength_range_mm=setup.wavelength_range_mm).lines
    waves = [line.wavelength_mm for line in lines]
    ridges = [assumed.pitch_mm / k for k in setup.ridge_harmonics]
    return {
        "rough_lines": float(sum(min(abs(ridge / wave - 1) for ridge in ridges) > setup.tolerance for wave in waves)),
        "rough_mm": listed(waves, ".3f") or "none",
        "rough_uE": float(rough.readings[GRATING_SCENE.slides_after :, MIDDLE_GAUGE].std()),
    }


def _curve(assumed: SlideParameters) -> dict:
    """The shipped power curve, from sliding scenes, or one from other scenes: whether it is higher at 1.2 mm than
    on both sides of it, and the places of its maxima."""
    curve = read_curve()
    if assumed != ASSUMED_SLIDE:
        curve = PowerCurve(curve.wavelength_mm, _powers(assumed, curve.wavelength_mm))
    power, place = np.asarray(curve.power), np.asarray(curve.wavelength_mm)
    middle = int(np.argmin(np.abs(place - GRATING_SCENE.maximum.ridge_mm)))
    samples = slice(None, None, GRATING_SCENE.maximum.every)
    return {
        "r_squared": curve.as_printed.r_squared,
        "at_ridge": float(power[middle] / max(power[middle - 1], power[middle + 1])),
        "peaks": listed(place[_maxima(power)], ".1f"),
        "on_samples": float(place[samples][int(np.argmax(power[samples]))]),
    }


def _powers(assumed: SlideParameters, wavelengths_mm) -> tuple[float, ...]:
    """Power of the fundamental over its greatest: mean of the five gauges, or of the one with another grid."""
    scenes = [over(assumed, mm, GRATING_SCENE.curve) for mm in wavelengths_mm]
    rms = np.array([_grating_rms(slide, mm, (1,)) for slide, mm in zip(scenes, wavelengths_mm, strict=True)])
    power = rms[:, assumed.gauges] ** 2
    return tuple((power / power.max(axis=0)).mean(axis=1).tolist())


experiment = Experiment.of(
    run,
    ASSUMED_SLIDE,
    groove_s=_two_grooves,
    fem_levels=_levels,
    fem_right=_levels,
    finer_levels=_finer_ridges,
    depths_apart=_depths,
    speed_ratio=_speeds,
    falls=_viscosity,
    grows=_smooth_skin,
    rough_lines=_rough,
    r_squared=_curve,
    at_ridge=_curve,
)
