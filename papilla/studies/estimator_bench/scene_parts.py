"""Parts of scenes: motions, surfaces and disturbances, each a small function that changes a draft.

The defaults of the parameters are the values for tuning; claims draw each parameter around its default.
"""

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import lfilter

from papilla import checks

HARMONICS = 9
ENTRY_RAMP, EXIT_RAMP = 0.08, 0.15
"""Widths of the two flanks of the grating's trapezoid, as fractions of the wavelength."""
SKIN_KERNEL_MM = 0.1
"""Standard deviation of the Gaussian that models the skin's averaging of the profile."""
PASS_BAND = 0.4
"""Harmonics above this fraction of the sampling rate are removed, as an amplifier's anti-aliasing filter does."""


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

    def about(self, value: float, factor: float = 1.5) -> float:
        """A parameter: the value itself for tuning, drawn within this factor of it for claims."""
        return value * factor ** self.rng.uniform(-1, 1) if self.drawn else value

    def phase(self) -> float:
        """A random angle in rad."""
        return self.rng.uniform(0, 2 * math.pi)

    def moves(self, velocity, position) -> None:
        """Set the motion of the finger."""
        self.velocity, self.position, self.skin, self.known = velocity, position, position, velocity

    def everywhere(self, wavelength_mm: float) -> np.ndarray:
        """(n,) this wavelength all along."""
        return np.full(self.time_s.size, wavelength_mm)


# ---- Motions


def constant(draft: Draft, speed_mm_s: float = 100.0) -> None:
    """A constant speed within 3 %: exactly 100 mm/s would give whole numbers of samples per period."""
    speed = draft.about(speed_mm_s) * (1 + draft.rng.uniform(-0.03, 0.03))
    draft.moves(np.full(draft.time_s.size, speed), speed * draft.time_s)


def strokes(draft: Draft, peak_mm_s: float = 100.0, rate_Hz: float = 1.0) -> None:
    """To and fro, a sine."""
    peak, omega = draft.about(peak_mm_s, 1.3), 2 * math.pi * draft.about(rate_Hz, 1.3)
    draft.moves(peak * np.sin(omega * draft.time_s), peak / omega * (1 - np.cos(omega * draft.time_s)))


def hand(draft: Draft) -> None:
    """Strokes of uneven length and speed, like those of a hand: two sines whose period varies."""
    beat = 2 * math.pi * draft.about(0.9, 1.2) * draft.time_s + 0.6 * np.sin(1.7 * draft.time_s + draft.phase())
    place = 18 * (1 - np.cos(beat)) + 5 * np.sin(2.3 * draft.time_s + draft.phase())
    draft.moves(np.gradient(place, 1 / draft.rate_Hz), place)


def turning(draft: Draft, speed_mm_s: float = 90.0, every_s: float = 0.3) -> None:
    """To and fro at a constant speed, with turns of 30 ms; each stroke lasts `every_s`."""
    beat = np.sin(math.pi * draft.time_s / draft.about(every_s, 1.2))
    velocity = draft.about(speed_mm_s, 1.3) * np.clip(beat / math.sin(math.pi * 0.015 / every_s), -1, 1)
    draft.moves(velocity, (np.cumsum(velocity) - (velocity + velocity[0]) / 2) / draft.rate_Hz)


# ---- The skin, before it feels the surface


def play(draft: Draft, lag_mm: float = 0.3, relaxation_mm: float = 0.5) -> None:
    """The skin trails the finger, and settles on the other side after each reversal."""
    draft.skin = sheared(draft.skin, draft.about(lag_mm), relaxation_mm)


def sheared(position, lag_mm: float = 0.3, relaxation_mm: float = 0.5):
    """(n,) place of the skin in mm: it trails the finger by `lag_mm`, and settles over `relaxation_mm` of sliding after
    a reversal."""
    steps = np.diff(position, prepend=position[0])
    lag, trail = lag_mm, np.empty(position.size)
    for row, step in enumerate(steps):
        lag += (math.copysign(lag_mm, step) - lag) * -math.expm1(-abs(step) / relaxation_mm)
        trail[row] = lag
    return position - trail


def anywhere(draft: Draft) -> None:
    """The surface begins at a random place."""
    draft.skin = draft.skin + draft.rng.uniform(0, 60)


# ---- Surfaces


@lru_cache(maxsize=64)
def profile_amplitudes(wavelength_mm: float, duty: float = 0.5, skin_mm: float = SKIN_KERNEL_MM) -> np.ndarray:
    """(HARMONICS,) complex Fourier amplitudes of the felt grating, AC power 1; duty: ridge over wavelength."""
    wavelength = checks.positive("wavelength (mm)", wavelength_mm)
    # Sum of four ramps: the Fourier integral of a piecewise linear period is exact from its corners.
    corners = np.array([0.0, ENTRY_RAMP, duty, duty + EXIT_RAMP])
    slopes = np.array([1 / ENTRY_RAMP, 0.0, -1 / EXIT_RAMP, 0.0])
    turns = 2 * math.pi * np.arange(1, HARMONICS + 1)
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
    order = np.arange(1, HARMONICS + 1)
    present = np.abs(draft.velocity[rows, None]) * order / wavelength < PASS_BAND * draft.rate_Hz
    turns = 2 * math.pi * (draft.skin[rows, None] + draft.offsets_mm) / wavelength
    waves = np.exp(-1j * turns[:, :, None] * order) * present[:, None, :]
    return np.real(waves @ amplitudes)


def grating(
    draft: Draft, *, duty: float = 0.5, skin_mm: float = SKIN_KERNEL_MM, missing: int = 0, times: float = 1.0
) -> None:
    """A grating: groove = ridge unless `duty` says otherwise, `times` the wavelength asked for.

    Without its first `missing` harmonics it is as long as it takes for two others to pass the amplifier: one alone is
    a grating of its own.
    """
    wavelength = times * draft.asked_mm
    if missing:
        slowest = float(np.abs(draft.velocity).min())
        wavelength = max(wavelength, 1.02 * (missing + 2) * slowest / (PASS_BAND * draft.rate_Hz))
    amplitudes = profile_amplitudes(wavelength, duty, skin_mm)
    if missing:
        amplitudes = _of_power_one(amplitudes * (np.arange(HARMONICS) >= missing))
    draft.texture, draft.wavelength = _felt(draft, wavelength, amplitudes), draft.everywhere(wavelength)


def hollow(draft: Draft, times: float = 1.8) -> None:
    """A period without its fundamental, `times` the wavelength asked for: harmonics 2 and 3 and, weaker, 4 and 5; for
    claims two of 2 to 5 that have no common divisor, and faint others in every second draw."""
    sizes = np.array([0.0, 1.0, 0.8, 0.1, 0.3])
    if draft.drawn:
        first, second = ((2, 3), (2, 5), (3, 4), (3, 5))[draft.rng.integers(4)]
        sizes = draft.rng.uniform(0, 0.2, 5) * (np.arange(5) > 0) * draft.rng.integers(2)
        sizes[[first - 1, second - 1]] = draft.rng.uniform(0.3, 1.0, 2)
    # Two harmonics at least must pass the amplifier.
    wavelength = max(
        times * draft.asked_mm, 1.02 * 5 * float(np.abs(draft.velocity).min()) / (PASS_BAND * draft.rate_Hz)
    )
    waves = sizes * np.exp(1j * draft.rng.uniform(0, 2 * math.pi, sizes.size))
    draft.texture = _felt(draft, wavelength, _of_power_one(np.pad(waves, (0, HARMONICS - sizes.size))))
    draft.wavelength = draft.everywhere(wavelength)


def out_of_range(draft: Draft, wavelength_mm: float = 12.0) -> None:
    """A grating with twice the longest wavelength of the search range: any answer is false."""
    grating(draft, times=draft.about(wavelength_mm, 1.2) / draft.asked_mm)
    draft.wavelength = draft.everywhere(math.nan)


def step(draft: Draft, to_mm: float | None = None, at_s: float | None = None) -> None:
    """A grating whose wavelength changes on the way: to the far end of 0.6-4 mm where nothing else is said."""
    grating(draft)
    after = draft.time_s >= (0.5 * draft.time_s[-1] if at_s is None else at_s)
    wavelength = checks.positive("step_to_mm", to_mm or (4.0 if draft.asked_mm < 1.5 else 0.7))
    draft.wavelength[after] = wavelength
    draft.texture[after] = _felt(draft, wavelength, profile_amplitudes(wavelength), after)


def two_lines(draft: Draft, ratio: float = 0.62, factor: float = 1.1) -> None:
    """Two superposed gratings of equal power: either wavelength is right, and so is a common period."""
    second = draft.about(ratio, factor) * draft.asked_mm
    grating(draft)
    draft.texture = (draft.texture + _felt(draft, second, profile_amplitudes(second))) / math.sqrt(2)
    draft.others_mm = (second, *common_period(draft.asked_mm, second))


def common_period(first: float, second: float) -> tuple[float, ...]:
    """The smallest multiple of a wavelength that is a multiple of another to 1 %; () if there is none up to the sixth
    of both."""
    for count in range(1, 7):
        other = count * first / second
        if round(other) <= 6 and abs(other / max(round(other), 1) - 1) < 0.01:
            return (count * first,)
    return ()


def rough(draft: Draft, skin_mm: float = 0.15, slope: float = 0.0) -> None:
    """A rough surface without a line, averaged by a Gaussian skin: amplitudes fall with the wavenumber to the power
    `-slope`."""
    spacing, reach = 0.01, draft.skin[:, None] + draft.offsets_mm
    count = 2 * math.ceil((np.ptp(reach) / spacing + 8000) / 2)
    spectrum = np.fft.rfft(draft.rng.normal(size=count))
    spectrum *= np.maximum(np.fft.rfftfreq(count, spacing), 1 / 30) ** -slope
    surface = gaussian_filter1d(np.fft.irfft(spectrum, count), draft.about(skin_mm, 2.0) / spacing)
    felt = np.interp(reach - reach.min() + 20, np.arange(count) * spacing, surface - surface.mean())
    draft.texture, draft.wavelength = felt / felt.std(), draft.everywhere(math.nan)


def smooth(draft: Draft) -> None:
    """A smooth surface: no texture."""
    draft.texture = np.zeros((draft.time_s.size, draft.offsets_mm.size))
    draft.wavelength = draft.everywhere(math.nan)


# ---- Disturbances


def hum(draft: Draft, rms: float = 2.0, mains_Hz: float = 50.0) -> None:
    """The mains at so many times the texture's RMS, with a quarter of its third harmonic.

    At a constant speed an answer is asked for only where the drawn frequencies are far enough apart for a spectrum to
    tell the texture from the hum (`Scene.tellable`).
    """
    draft.mains_Hz = float(draft.rng.choice([50.0, 60.0])) if draft.drawn else mains_Hz
    turns = 2 * math.pi * draft.mains_Hz * draft.time_s + draft.phase()
    draft.added += draft.about(rms) * math.sqrt(2) * (np.sin(turns) + 0.25 * np.sin(3 * turns))


def motor(draft: Draft, frequency_Hz: float = 47.0, rms: float = 1.0) -> None:
    """A sine over time that is not the mains': a motor's, 25 to 90 Hz."""
    draft.added += (
        rms * math.sqrt(2) * np.sin(2 * math.pi * draft.about(frequency_Hz, 1.9) * draft.time_s + draft.phase())
    )


def ripple(draft: Draft, wavelength_mm: float = 20.0, size: float = 6.0) -> None:
    """A component over the path, far longer than the range, many times stronger than the texture."""
    draft.added += draft.about(size, 2.0) * np.sin(2 * math.pi * draft.skin / draft.about(wavelength_mm, 1.1))


def spikes(draft: Draft, share: float = 0.004, size: float = 20.0) -> None:
    """Single samples with large errors of either sign."""
    hit = draft.rng.uniform(size=draft.time_s.size) < share
    draft.added += hit * draft.about(size, 2.0) * draft.rng.choice([-1, 1], draft.time_s.size)


def lost(draft: Draft, every_s: float = 0.9, away_s: float = 0.25, offset: float = 8.0) -> None:
    """Contact is lost and found again: in the air there is neither texture nor the offset of the press."""
    away = (draft.time_s + draft.rng.uniform(0, every_s)) % draft.about(every_s) < draft.about(away_s)
    press = gaussian_filter1d(np.where(away, 0.0, 1.0), 0.004 * draft.rate_Hz)
    draft.texture *= press[:, None]
    draft.added += draft.about(offset) * press


def stick_slip(draft: Draft, slip_mm: float = 1.5, scatter: float = 0.3, rms: float = 1.0) -> None:
    """A saw tooth over the path, each tooth with its own length: lognormal, with this relative scatter."""
    travelled = np.cumsum(np.abs(np.diff(draft.position, prepend=draft.position[0])))
    mean, spread = draft.about(slip_mm), draft.about(scatter)
    teeth = np.cumsum(mean * np.exp(spread * draft.rng.normal(size=math.ceil(3 * travelled[-1] / mean) + 99)))
    place = np.interp(travelled, np.concatenate([[0.0], teeth]), np.arange(teeth.size + 1.0)) % 1
    draft.added += rms * math.sqrt(12) * (place - 0.5) * np.sign(draft.velocity)


def drift(draft: Draft, size: float = 2.0) -> None:
    """A slow baseline."""
    draft.added += size * np.sin(2 * math.pi * draft.about(0.3) * draft.time_s + draft.phase())


def steps(draft: Draft, smallest: float = 1.5, largest: float = 4.0) -> None:
    """Pressing steps every 0.7 s with ramps of 20 ms."""
    for start in np.arange(0.35, draft.time_s[-1], draft.about(0.7)):
        size = draft.rng.uniform(smallest, largest) * draft.rng.choice([-1, 1])
        draft.added += size * np.clip((draft.time_s - start) / 0.02, 0, 1)


def fading(draft: Draft, depth: float = 0.4) -> None:
    """The texture's amplitude drifts."""
    swell = np.sin(2 * math.pi * draft.about(0.37) * draft.time_s + draft.phase())
    draft.texture *= (1 + depth * swell)[:, None]


def friction(draft: Draft, size: float = 3.0) -> None:
    """A friction force that changes sign with the velocity."""
    draft.added += draft.about(size) * np.tanh(draft.velocity / 5)


def force(draft: Draft, size: float = 6.0, depth: float = 0.3) -> None:
    """A pressing force that varies below 3 Hz: it changes the gauge's reading, and the texture's amplitude follows
    it."""
    waver = gaussian_filter1d(draft.rng.normal(size=draft.time_s.size + 1000), 0.1 * draft.rate_Hz)[500:-500]
    waver = waver / waver.std()
    draft.texture *= np.clip(1 + depth * waver, 0.1, None)[:, None]
    draft.added += draft.about(size) * waver


def late(draft: Draft, ms: float) -> None:
    """The encoder is late; the first velocity is repeated."""
    samples = max(round(draft.about(ms, 1.3) * draft.rate_Hz / 1000), 1)
    draft.known = np.concatenate([np.full(samples, draft.known[0]), draft.known[:-samples]])


def scaled(draft: Draft, percent: float) -> None:
    """The velocity's scale has this error; for claims at least two thirds of it, with either sign."""
    off = draft.rng.choice([-1, 1]) * 1.5 ** -draft.rng.uniform() if draft.drawn else 1.0
    draft.known = draft.known * (1 + off * percent / 100)


def counted(draft: Draft, count_mm: float = 0.05) -> None:
    """The velocity is the difference of an encoder's counts."""
    count = draft.about(count_mm)
    counts = np.floor(draft.position / count)
    draft.known = np.diff(counts, prepend=counts[0]) * count * draft.rate_Hz


def smoothed(draft: Draft, over_s: float = 0.05) -> None:
    """The velocity passes a first-order low-pass with this time constant."""
    share = -math.expm1(-1 / (draft.about(over_s, 1.2) * draft.rate_Hz))
    draft.known = lfilter([share], [1, share - 1], draft.known)


def stamped(draft: Draft, every_s: float = 0.01) -> None:
    """Samples carry the time of the packet in which they arrived."""
    draft.time_s = np.floor(draft.time_s / every_s + 1e-9) * every_s


def dropped(draft: Draft, every_s: float = 0.4, length_s: float = 0.01) -> None:
    """Bursts of missing readings."""
    gone = (draft.time_s + draft.rng.uniform(0, every_s)) % draft.about(every_s) < draft.about(length_s)
    draft.added += np.where(gone, np.nan, 0.0)
