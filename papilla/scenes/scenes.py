"""Sliding scenes with a known truth: a motion, a surface and disturbances (`scene_parts`), in white noise.

Synthetic on purpose: the truth is exact and a Cramér-Rao bound exists. The sign of the velocity is the sign of motion.
Tuning sees every parameter as it stands in `scenes.toml`; claims, from the seed `FIRST_CLAIM_SEED` on, draw them about
that."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from papilla.core import checks, settings
from papilla.core.errors import InputError
from papilla.core.units import SAMPLE_RATE_HZ
from papilla.references.bounds import wavelength_bound
from papilla.scenes import parts as parts
from papilla.scenes.parts import SCENE_HARMONICS, SCENE_PASS_BAND, Draft, profile_amplitudes

WAVELENGTHS_MM = (0.6, 1.2, 1.8, 2.4, 3.0)
FIRST_CLAIM_SEED = 100
"""First seed of claims; smaller ones are for tuning."""
SCENE_MAINS_HZ = (50.0, 60.0)
HIDDEN_HARMONICS, SEPARATE_RESOLUTIONS = 6, 3.0
"""Number of harmonics of a fundamental that may be hidden by hum; and resolutions that separate a line from a louder
one."""
SCENE_RULES = settings.tables(__package__, "scenes")


class Part(NamedTuple):
    """A function of `scene_parts`, by name, with parameters other than those of its rules."""

    name: str
    changes: Mapping[str, Any] = MappingProxyType({})

    @classmethod
    def of(cls, entry: str | Mapping[str, Any]) -> "Part":
        """The part of an entry of the file: its name, or a table."""
        arguments = {"part": entry} if isinstance(entry, str) else dict(entry)
        return cls(arguments.pop("part"), arguments)

    def __call__(self, draft: Draft) -> None:
        """Change the draft. A number in place of a rule changes the value that the rule draws about."""
        rules = dict(SCENE_RULES["parts"].get(self.name, {}))
        for key, change in self.changes.items():
            rules[key] = {**rules[key], "about": change} if _rules(rules.get(key)) and not _rules(change) else change
        getattr(parts, self.name)(draft, **settings.drawn(rules, draft.rng, vary=draft.drawn))


def _rules(entry: Any) -> bool:
    return isinstance(entry, Mapping)


class Recipe(NamedTuple):
    """A motion, a surface, disturbances in their order, a motion of the skin relative to the finger, seconds, and
    samples per second."""

    motion: Part
    surface: Part = Part("grating")
    disturbances: tuple[Part, ...] = ()
    skin: Part | None = None
    seconds: float = 4.0
    rate_Hz: float = SAMPLE_RATE_HZ

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> "Recipe":
        """The recipe of a table of the file."""
        parts = {key: Part.of(table[key]) for key in ("motion", "surface", "skin") if key in table}
        return cls(**{**table, **parts, "disturbances": tuple(map(Part.of, table.get("disturbances", ())))})

    @property
    def clean(self) -> bool:
        """Whether noise is the only error, so that the Cramér-Rao bound holds for the scene."""
        return self.surface == Part("grating", {}) and not self.disturbances and self.skin is None

    @property
    def lined(self) -> bool:
        """Whether there is a line to find."""
        return self.surface.name not in ("smooth", "rough", "out_of_range", "felt_edges")

    @property
    def hums(self) -> bool:
        """Whether the hum is louder than the surface."""
        return Part("hum", {}) in self.disturbances


SCENES_BY_NAME: Mapping[str, Recipe] = MappingProxyType(
    {name: Recipe.of(table) for name, table in SCENE_RULES["scenes"].items()}
    | {
        f"{way}, {name}": Recipe.of({"motion": motion, **table})
        for name, table in SCENE_RULES["both_ways"].items()
        for way, motion in (("const", "constant"), ("strokes", "strokes"))
    }
)
"""Every scene by its name."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A sliding scene, row by row.

    Parameters
    ----------
    name : one of `SCENES_BY_NAME`.
    time_s, velocity_mm_s, position_mm : (n,) what the finger does; position is the integral of velocity.
    known_mm_s : (n,) the velocity as it is stated.
    signal : (n, g) readings of each gauge without noise.
    readings : (n, g) the same with noise.
    wavelength_mm : (n,) truth, NaN where there is no line to be found; others_mm: what is right too.
    mains_Hz : frequency of its hum, or NaN.
    noise_sd : standard deviation of the noise of a sample.
    sample_rate_Hz : samples a second.
    """

    name: str
    time_s: np.ndarray
    velocity_mm_s: np.ndarray
    position_mm: np.ndarray
    known_mm_s: np.ndarray
    signal: np.ndarray
    readings: np.ndarray
    wavelength_mm: np.ndarray
    others_mm: tuple[float, ...]
    mains_Hz: float
    noise_sd: float
    sample_rate_Hz: float

    @property
    def frequency_Hz(self) -> np.ndarray:
        """(n,) true temporal frequency, |v| / wavelength."""
        return np.abs(self.velocity_mm_s) / self.wavelength_mm

    @property
    def travelled_mm(self) -> np.ndarray:
        """(n,) path since the first row."""
        return np.cumsum(np.abs(np.diff(self.position_mm, prepend=self.position_mm[0])))

    def judged(self, settle_s: float = 1.0, slow: float = 0.3) -> np.ndarray:
        """(n,) bool: rows with t > `settle_s` and |v| > `slow` times its peak."""
        speed = np.abs(self.velocity_mm_s)
        return (self.time_s > settle_s) & (speed > slow * speed.max())

    def tellable(self, path_mm: np.ndarray) -> np.ndarray:
        """(n,) bool: rows at which a spectrum over this path (n,) can separate the surface's line from one over time;
        all rows if the speed changes or there is no line.

        At a constant speed v a line at wavenumber k and one at the frequency k v are the same readings. With the
        resolution v / path, the line's frequency must be more than one from each harmonic of 50 and 60 Hz, whether
        they are there or not; and under hum, which is louder, more than three (the flanks of two tapered lines and a
        dip), as must be the fundamental of which the line might be the second to sixth harmonic.
        """
        line = self.frequency_Hz[:, None]
        without_line = np.isnan(line[:, 0])
        if np.ptp(self.velocity_mm_s) > 0 or without_line.all():
            return np.ones(self.time_s.size, bool)
        resolution = np.abs(self.velocity_mm_s) / np.maximum(path_mm, 1e-9)
        harmonics = np.concatenate([np.arange(mains, 0.5 * self.sample_rate_Hz, mains) for mains in SCENE_MAINS_HZ])
        apart = np.abs(line - harmonics).min(axis=1, initial=math.inf) > resolution
        if not math.isnan(self.mains_Hz):
            hidden = np.abs(line / np.arange(1, HIDDEN_HARMONICS + 1) - self.mains_Hz).min(axis=1)
            apart &= hidden > SEPARATE_RESOLUTIONS * resolution
        return without_line | apart

    def block(self, delay_samples: int = 0, gain: float = 1.0) -> np.ndarray:
        """(n, g + 1): readings, then the velocity as it is stated: `gain` times that, `delay_samples` later still."""
        return np.column_stack([self.readings, parts.delayed(gain * self.known_mm_s, delay_samples)])

    def bound(self, window_s: float | None = None, path_mm: float | None = None, count: int = 50) -> float:
        """Relative Cramér-Rao bound of the wavelength (a fraction) of a clean grating, groove = ridge.

        It is the median over about `count` windows that end in judged rows and hold so much time, or so much path.
        Several gauges have noise and amplitudes of their own, so their informations add up. Raises `InputError` for a
        window that does not fit into the scene.
        """
        along, size = (self.time_s, window_s) if path_mm is None else (self.travelled_mm, path_mm)
        ends = np.flatnonzero(self.judged() & (along >= (size or 0.0)))
        if not len(ends):
            raise InputError(f"a window of {size:g} does not fit into the scene of {along[-1]:g}")
        amplitudes = profile_amplitudes(float(self.wavelength_mm[-1]))
        present = self.frequency_Hz[:, None] * np.arange(1, SCENE_HARMONICS + 1) < SCENE_PASS_BAND * self.sample_rate_Hz
        bounds = []
        for end in ends[:: max(1, len(ends) // count)]:
            rows = slice(int(np.searchsorted(along, along[end] - (size or 0.0) - 1e-9)), int(end))
            path, wavelength = self.position_mm[rows], float(self.wavelength_mm[end])
            bounds.append(wavelength_bound(path, wavelength, amplitudes, self.noise_sd, present[rows]))
        return float(np.median(bounds)) / math.sqrt(self.signal.shape[1])


def scene(
    name: str,
    wavelength_mm: float,
    *,
    snr_dB: float = 20.0,
    seed: int = 0,
    seconds: float | None = None,
    gauge_positions_mm: Sequence[float] = (0.0,),
    step_to_mm: float | None = None,
    step_at_s: float = 2.0,
    sample_rate_Hz: float | None = None,
    drawn: bool = False,
) -> Scene:
    """A scene of `SCENES_BY_NAME` on a grating; with `step_to_mm` the wavelength changes at `step_at_s`.

    `gauge_positions_mm` are along the sliding direction; the noise of gauges is independent. The grating starts at a
    random place; drawn: so is every parameter, as for claims. Raises `InputError` for an unknown name or values that
    are not positive.
    """
    if name not in SCENES_BY_NAME:
        raise InputError(f"scene must be one of {'; '.join(SCENES_BY_NAME)}, got {name!r}")
    recipe = SCENES_BY_NAME[name]
    rate = checks.positive("sample_rate_Hz", recipe.rate_Hz if sample_rate_Hz is None else sample_rate_Hz)
    length = checks.positive("seconds", recipe.seconds if seconds is None else seconds)
    time, offsets = np.arange(round(length * rate)) / rate, np.asarray(gauge_positions_mm, float)
    asked = checks.positive("wavelength (mm)", wavelength_mm)
    draft = Draft(np.random.default_rng(seed), drawn, rate, time, offsets, asked)
    surface = recipe.surface if step_to_mm is None else Part("step", {"to_mm": step_to_mm, "at_s": step_at_s})
    for change in (recipe.motion, recipe.skin, Part("anywhere"), surface, *recipe.disturbances):
        if change is not None:
            change(draft)
    noise_sd = 10 ** (-checks.finite("snr_dB", snr_dB) / 20)
    signal = draft.texture + draft.added[:, None]
    readings = signal + noise_sd * draft.rng.standard_normal(signal.shape)
    return Scene(
        name, draft.time_s, draft.velocity, draft.position, draft.known, signal, readings, draft.wavelength,
        draft.others_mm, draft.mains_Hz, noise_sd, rate,
    )  # fmt: skip
