"""Parts of scenes: motions, surfaces and disturbances, each a small function that changes a draft.

Their parameters stand in `scenes.toml`: the values for tuning, and how claims draw each of them.
"""

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from papilla.core import checks, settings
from papilla.core.units import MS_PER_S, PER_CENT
from papilla.fem import Motion, slide
from papilla.model.finger import Finger
from papilla.model.specimen import Grating
from papilla.model.textures import MeasuredProfile, Texture

SCENE_HARMONICS = 9
ENTRY_RAMP, EXIT_RAMP = 0.08, 0.15
"""Widths of the two flanks of the grating's trapezoid, as fractions of the wavelength."""
SKIN_KERNEL_MM = 0.1
"""Standard deviation of the Gaussian that models the skin's averaging of the profile."""
SCENE_PASS_BAND = 0.4
"""Harmonics above this fraction of the sampling rate are removed, as an amplifier's anti-aliasing filter does."""
CLEAR_FACTOR = 1.02
"""Harmonics that must be present are below that fraction by this factor."""
FELT_ARGUMENTS = settings.tables(__package__, "scenes")["felt"]
"""How a surface is felt by the finite elements: arguments of `slide`."""
MOST_MULTIPLES, SAME_PERIOD_ERROR = 6, 0.01
"""Two lines have a common period if up to so many wavelengths of one are as many of the other, to this error."""


@dataclass(eq=False)
class Draft:
    """A scene under construction, which motions, surfaces and disturbances read and change.

    rng : of everything random. drawn : whether parameters are. offsets_mm (g,) : of the gauges; asked_mm : the
    wavelength. velocity, position (n,) : of the finger in mm/s and mm; skin (n,) : where its skin is; known (n,) : the
    velocity as it is stated. texture (n, g) : what the surface gives, AC power 1; added (n,) : what else there is.
    wavelength (n,) : truth in mm, NaN where there is no line; others_mm : what is right too; mains_Hz : of hum, or NaN.
    """

    rng: np.random.Generator
    drawn: bool
    rate_Hz: float
    time_s: np.ndarray
    offsets_mm: np.ndarray
    asked_mm: float
    others_mm: tuple[float, ...] = ()
    mains_Hz: float = math.nan
    velocity: np.ndarray = field(init=False)
    position: np.ndarray = field(init=False)
    skin: np.ndarray = field(init=False)
    known: np.ndarray = field(init=False)
    texture: np.ndarray = field(init=False)
    wavelength: np.ndarray = field(init=False)
    added: np.ndarray = field(init=False)

    def __post_init__(self):
        self.added = np.zeros(self.time_s.size)

    def about(self, value: float, factor: float = settings.DRAW_FACTOR) -> float:
        """A parameter that a part draws after other random numbers, as the rule `about` does."""
        return settings.drawn({"own": {"about": value, "within": factor}}, self.rng, vary=self.drawn)["own"]

    def wave(self, rate_Hz: float, phase: float) -> np.ndarray:
        """(n,) a sine over time."""
        return np.sin(2 * math.pi * rate_Hz * self.time_s + phase)

    def moves(self, velocity, position) -> None:
        """Set the motion of the finger."""
        self.velocity, self.position, self.skin, self.known = velocity, position, position, velocity

    def everywhere(self, wavelength_mm: float) -> np.ndarray:
        """(n,) this wavelength all along."""
        return np.full(self.time_s.size, wavelength_mm)


# ---- Motions


def constant(draft: Draft, speed_mm_s: float, off: float) -> None:
    """A constant speed, up to a relative error."""
    speed = speed_mm_s * (1 + off)
    draft.moves(np.full(draft.time_s.size, speed), speed * draft.time_s)


def strokes(draft: Draft, peak_mm_s: float, rate_Hz: float) -> None:
    """To and fro, a sine."""
    omega = 2 * math.pi * rate_Hz
    draft.moves(peak_mm_s * np.sin(omega * draft.time_s), peak_mm_s / omega * (1 - np.cos(omega * draft.time_s)))


def hand(
    draft: Draft, beat_Hz, swing_rad, swing_rad_s, swing_phase, reach_mm, second_mm, second_rad_s, second_phase
) -> None:
    """Strokes of uneven length and speed, like those of a hand: two sines whose period varies."""
    beat = 2 * math.pi * beat_Hz * draft.time_s + swing_rad * np.sin(swing_rad_s * draft.time_s + swing_phase)
    place = reach_mm * (1 - np.cos(beat)) + second_mm * np.sin(second_rad_s * draft.time_s + second_phase)
    draft.moves(np.gradient(place, 1 / draft.rate_Hz), place)


def turning(draft: Draft, every_s: float, speed_mm_s: float, half_turn: float) -> None:
    """To and fro at a constant speed; each stroke lasts `every_s`, and this share of it is half a turn."""
    beat = np.sin(math.pi * draft.time_s / every_s)
    velocity = speed_mm_s * np.clip(beat / math.sin(math.pi * half_turn), -1, 1)
    draft.moves(velocity, (np.cumsum(velocity) - velocity / 2) / draft.rate_Hz)


# ---- The skin, before it feels the surface


def play(draft: Draft, lag_mm: float, relaxation_mm: float) -> None:
    """The skin trails the finger, and settles on the other side after each reversal."""
    draft.skin = sheared(draft.skin, lag_mm, relaxation_mm)


def sheared(position, lag_mm: float, relaxation_mm: float):
    """(n,) place of the skin in mm: it trails the finger by `lag_mm`, and settles over `relaxation_mm` of sliding after
    a reversal."""
    steps = np.diff(position, prepend=position[0])
    lag, trail = lag_mm, np.empty(position.size)
    for index, step in enumerate(steps):
        lag += (math.copysign(lag_mm, step) - lag) * -math.expm1(-abs(step) / relaxation_mm)
        trail[index] = lag
    return position - trail


def anywhere(draft: Draft, begin_mm: float) -> None:
    """The surface begins at another place."""
    draft.skin = draft.skin + begin_mm


# ---- Surfaces


@lru_cache(maxsize=64)
def profile_amplitudes(wavelength_mm: float, duty: float = 0.5, skin_mm: float = SKIN_KERNEL_MM) -> np.ndarray:
    """(HARMONICS,) complex Fourier amplitudes of the felt grating, AC power 1; duty: ridge over wavelength."""
    wavelength = checks.positive("wavelength (mm)", wavelength_mm)
    # Sum of four ramps: the Fourier integral of a piecewise linear period is exact from its corners.
    corners = np.array([0.0, ENTRY_RAMP, duty, duty + EXIT_RAMP])
    slopes = np.array([1 / ENTRY_RAMP, 0.0, -1 / EXIT_RAMP, 0.0])
    turns = 2 * math.pi * np.arange(1, SCENE_HARMONICS + 1)
    bends = np.diff(slopes, prepend=slopes[-1])
    coefficients = -2 * (np.exp(1j * np.outer(turns, corners)) @ bends) / turns**2
    felt = coefficients * np.exp(-0.5 * (turns * skin_mm / wavelength) ** 2)
    return _of_power_one(felt)


def _of_power_one(amplitudes):
    amplitudes = amplitudes * math.sqrt(2 / np.sum(np.abs(amplitudes) ** 2))
    amplitudes.flags.writeable = False
    return amplitudes


def _felt(draft: Draft, wavelength: float, amplitudes, rows=slice(None)) -> np.ndarray:
    """(m, g) texture signal of the gauges over a grating in these rows, after the anti-aliasing filter."""
    order = np.arange(1, SCENE_HARMONICS + 1)
    present = np.abs(draft.velocity[rows, None]) * order / wavelength < SCENE_PASS_BAND * draft.rate_Hz
    turns = 2 * math.pi * (draft.skin[rows, None] + draft.offsets_mm) / wavelength
    waves = np.exp(-1j * turns[:, :, None] * order) * present[:, None, :]
    return np.real(waves @ amplitudes)


def _passed(draft: Draft, order: int) -> float:
    """The shortest wavelength (mm) of which the amplifier passes a harmonic at the lowest speed."""
    return CLEAR_FACTOR * order * float(np.abs(draft.velocity).min()) / (SCENE_PASS_BAND * draft.rate_Hz)


def grating(
    draft: Draft, *, duty: float = 0.5, skin_mm: float = SKIN_KERNEL_MM, missing: int = 0, times: float = 1.0
) -> None:
    """A grating: groove = ridge unless `duty` says otherwise, `times` the wavelength asked for.

    Without its first `missing` harmonics it is as long as it takes for two others to pass the amplifier: one alone is
    a grating of its own.
    """
    wavelength = times * draft.asked_mm
    if missing:
        wavelength = max(wavelength, _passed(draft, missing + 2))
    amplitudes = profile_amplitudes(wavelength, duty, skin_mm)
    if missing:
        amplitudes = _of_power_one(amplitudes * (np.arange(SCENE_HARMONICS) >= missing))
    draft.texture, draft.wavelength = _felt(draft, wavelength, amplitudes), draft.everywhere(wavelength)


def hollow(draft: Draft, times: float, sizes, pairs, faint: float, strong) -> None:
    """A period without its fundamental, `times` the wavelength asked for, with harmonics of these relative sizes; for
    claims one of `pairs` with sizes of `strong`, and others of up to `faint` in every second draw."""
    count = len(sizes)
    if draft.drawn:
        first, second = pairs[draft.rng.integers(len(pairs))]
        sizes = draft.rng.uniform(0, faint, count) * (np.arange(count) > 0) * draft.rng.integers(2)
        sizes[[first - 1, second - 1]] = draft.rng.uniform(strong[0], strong[1], 2)
    # Two harmonics at least must pass the amplifier.
    wavelength = max(times * draft.asked_mm, _passed(draft, count))
    waves = np.asarray(sizes) * np.exp(1j * draft.rng.uniform(0, 2 * math.pi, count))
    draft.texture = _felt(draft, wavelength, _of_power_one(np.pad(waves, (0, SCENE_HARMONICS - count))))
    draft.wavelength = draft.everywhere(wavelength)


def out_of_range(draft: Draft, wavelength_mm: float) -> None:
    """A grating with a wavelength that is not searched for."""
    grating(draft, times=wavelength_mm / draft.asked_mm)
    draft.wavelength = draft.everywhere(math.nan)


def step(
    draft: Draft,
    short_mm: float,
    long_mm: float,
    short_from_mm: float,
    to_mm: float | None = None,
    at_s: float | None = None,
) -> None:
    """A grating whose wavelength changes on the way: halfway, to a short or to a long one where nothing else is
    said."""
    grating(draft)
    after = draft.time_s >= (0.5 * draft.time_s[-1] if at_s is None else at_s)
    wavelength = checks.positive("step_to_mm", to_mm or (long_mm if draft.asked_mm < short_from_mm else short_mm))
    draft.wavelength[after] = wavelength
    draft.texture[after] = _felt(draft, wavelength, profile_amplitudes(wavelength), after)


def two_lines(draft: Draft, ratio: float) -> None:
    """Two superposed gratings of equal power: either wavelength is right, and so is a common period."""
    second = ratio * draft.asked_mm
    grating(draft)
    draft.texture = (draft.texture + _felt(draft, second, profile_amplitudes(second))) / math.sqrt(2)
    draft.others_mm = (second, *common_period(draft.asked_mm, second))


def common_period(first: float, second: float) -> tuple[float, ...]:
    """The smallest multiple of a wavelength that is a multiple of another to `SAME_PERIOD_ERROR`; () if there is none
    up to `MOST_MULTIPLES` of both."""
    for count in range(1, MOST_MULTIPLES + 1):
        multiple = count * first / second
        if round(multiple) <= MOST_MULTIPLES and abs(multiple / max(round(multiple), 1) - 1) < SAME_PERIOD_ERROR:
            return (count * first,)
    return ()


def rough(draft: Draft, skin_mm: float, slope: float, spacing_mm: float, spare_mm: float, longest_mm: float) -> None:
    """A rough surface without a line, averaged by a Gaussian skin: amplitudes fall with the wavenumber to the power
    `-slope`, from the longest wavelength on."""
    reach = draft.skin[:, None] + draft.offsets_mm
    count = 2 * math.ceil((np.ptp(reach) / spacing_mm + round(4 * spare_mm / spacing_mm)) / 2)
    spectrum = np.fft.rfft(draft.rng.normal(size=count))
    spectrum *= np.maximum(np.fft.rfftfreq(count, spacing_mm), 1 / longest_mm) ** -slope
    surface = gaussian_filter1d(np.fft.irfft(spectrum, count), draft.about(skin_mm, 2.0) / spacing_mm)
    felt = np.interp(reach - reach.min() + spare_mm, np.arange(count) * spacing_mm, surface - surface.mean())
    draft.texture, draft.wavelength = felt / felt.std(), draft.everywhere(math.nan)


def smooth(draft: Draft) -> None:
    """A smooth surface: no texture."""
    draft.texture = np.zeros((draft.time_s.size, draft.offsets_mm.size))
    draft.wavelength = draft.everywhere(math.nan)


def felt_grating(draft: Draft, depth_mm: float) -> None:
    """A grating of the requested wavelength, groove = ridge, as the finger's sliding section reads it.

    Surfaces felt by `papilla.fem.slide` contain harmonics, beats with the ridges, effects of the contact's edges and
    the section's own oscillation. Only the middle gauge of the default finger is used; its AC power is 1.
    """
    half = draft.asked_mm / 2
    draft.wavelength = draft.everywhere(draft.asked_mm)
    _feel(draft, Grating(half, half, depth_mm))


def felt_edges(draft: Draft, depth_mm: float, between_mm: float, step_mm: float, beside_mm: float) -> None:
    """Single steps up and down at random places: there is no line, but one ridge after the other feels every step."""
    low, high = draft.skin.min() - beside_mm, draft.skin.max() + beside_mm
    x = np.arange(low, high, step_mm)
    steps = np.cumsum(draft.rng.exponential(between_mm, size=math.ceil(4 * (high - low) / between_mm) + 9))
    draft.wavelength = draft.everywhere(math.nan)
    _feel(draft, MeasuredProfile(x, depth_mm * (np.searchsorted(steps, x - low) % 2)))


def _feel(draft: Draft, texture: Texture) -> None:
    finger = Finger.default()
    motion = Motion(draft.time_s, draft.skin, draft.rate_Hz)
    felt = slide(finger, texture, motion, **FELT_ARGUMENTS)
    middle = felt.amplified[:, [len(finger.gauges) // 2]]
    varied = middle - middle.mean(axis=0)
    draft.texture = np.repeat(varied / varied.std(), len(draft.offsets_mm), axis=1)


# ---- Disturbances


def hum(draft: Draft, mains_Hz: float, phase: float, rms: float, third: float) -> None:
    """The mains at so many times the texture's RMS, with this share of its third harmonic.

    At a constant speed an answer is asked for only where the drawn frequencies are far enough apart for a spectrum to
    tell the texture from the hum (`Scene.tellable`).
    """
    draft.mains_Hz = mains_Hz
    turns = 2 * math.pi * mains_Hz * draft.time_s + phase
    draft.added += rms * math.sqrt(2) * (np.sin(turns) + third * np.sin(3 * turns))


def motor(draft: Draft, rms: float, frequency_Hz: float, phase: float) -> None:
    """A sine over time that is not the mains'."""
    draft.added += rms * math.sqrt(2) * draft.wave(frequency_Hz, phase)


def ripple(draft: Draft, size: float, wavelength_mm: float) -> None:
    """A component over the path."""
    draft.added += size * np.sin(2 * math.pi * draft.skin / wavelength_mm)


def spikes(draft: Draft, share: float, size: float) -> None:
    """Single samples with large errors of either sign."""
    hit = draft.rng.uniform(size=draft.time_s.size) < share
    draft.added += hit * draft.about(size, 2.0) * draft.rng.choice([-1, 1], draft.time_s.size)


def lost(draft: Draft, begin_s: float, every_s: float, away_s: float, offset: float, edge_s: float) -> None:
    """Contact is lost and found again: in the air there is neither texture nor the offset of the press."""
    away = (draft.time_s + begin_s) % every_s < away_s
    press = gaussian_filter1d(np.where(away, 0.0, 1.0), edge_s * draft.rate_Hz)
    draft.texture *= press[:, None]
    draft.added += offset * press


def stick_slip(draft: Draft, slip_mm: float, scatter: float, rms: float) -> None:
    """A saw tooth over the path, each tooth with its own length: lognormal, with this relative scatter."""
    travelled = np.cumsum(np.abs(np.diff(draft.position, prepend=draft.position[0])))
    # Three times as many teeth as the path has on average, and some for a short path.
    lengths = draft.rng.normal(size=math.ceil(3 * travelled[-1] / slip_mm) + 99)
    teeth = np.cumsum(slip_mm * np.exp(scatter * lengths))
    place = np.interp(travelled, np.concatenate([[0.0], teeth]), np.arange(teeth.size + 1.0)) % 1
    draft.added += rms * math.sqrt(12) * (place - 0.5) * np.sign(draft.velocity)


def drift(draft: Draft, rate_Hz: float, phase: float, size: float) -> None:
    """A slow baseline."""
    draft.added += size * draft.wave(rate_Hz, phase)


def steps(draft: Draft, every_s: float, first_s: float, sizes, ramp_s: float) -> None:
    """Pressing steps with ramps, of sizes in a range."""
    for start in np.arange(first_s, draft.time_s[-1], every_s):
        size = draft.rng.uniform(sizes[0], sizes[1]) * draft.rng.choice([-1, 1])
        draft.added += size * np.clip((draft.time_s - start) / ramp_s, 0, 1)


def fading(draft: Draft, rate_Hz: float, phase: float, depth: float) -> None:
    """The texture's amplitude drifts."""
    draft.texture *= (1 + depth * draft.wave(rate_Hz, phase))[:, None]


def friction(draft: Draft, size: float, turn_mm_s: float) -> None:
    """A friction force that changes sign with the velocity."""
    draft.added += size * np.tanh(draft.velocity / turn_mm_s)


def force(draft: Draft, size: float, depth: float, slowness_s: float, least: float) -> None:
    """A pressing force that varies slowly: it changes the gauge's reading, and the texture's amplitude follows it."""
    spare = 500  # samples at both ends, of which the filter knows one side only
    waver = draft.rng.normal(size=draft.time_s.size + 2 * spare)
    waver = gaussian_filter1d(waver, slowness_s * draft.rate_Hz)[spare:-spare]
    waver = waver / waver.std()
    draft.texture *= np.clip(1 + depth * waver, least, None)[:, None]
    draft.added += draft.about(size) * waver


def delayed(values: np.ndarray, samples: int) -> np.ndarray:
    """Values (n,) this number of samples later; the first one is repeated."""
    return np.concatenate([np.full(samples, values[0]), values[: len(values) - samples]])


def late(draft: Draft, ms: float) -> None:
    """The encoder is late; the first velocity is repeated."""
    draft.known = delayed(draft.known, max(round(ms * draft.rate_Hz / MS_PER_S), 1))


def scaled(draft: Draft, percent: float) -> None:
    """The velocity's scale has this error; for claims at least two thirds of it, with either sign."""
    off = draft.rng.choice([-1, 1]) * 1.5 ** -draft.rng.uniform() if draft.drawn else 1.0
    draft.known = draft.known * (1 + off * percent / PER_CENT)


def counted(draft: Draft, count_mm: float) -> None:
    """The velocity is the difference of an encoder's counts."""
    counts = np.floor(draft.position / count_mm)
    draft.known = np.diff(counts, prepend=counts[0]) * count_mm * draft.rate_Hz


def smoothed(draft: Draft, over_s: float) -> None:
    """The velocity passes a first-order low-pass with this time constant."""
    share = -math.expm1(-1 / (over_s * draft.rate_Hz))
    draft.known = lfilter([share], [1, share - 1], draft.known)


def stamped(draft: Draft, every_s: float) -> None:
    """Samples carry the time of the packet in which they arrived."""
    draft.time_s = np.floor(draft.time_s / every_s + 1e-9) * every_s


def dropped(draft: Draft, begin_s: float, every_s: float, length_s: float) -> None:
    """Bursts of missing readings."""
    gone = (draft.time_s + begin_s) % every_s < length_s
    draft.added += np.where(gone, np.nan, 0.0)
