"""The compared methods, by name: each takes times, readings and velocity, and returns wavelength, sigma, ok.

Besides papilla's own and the published ones these are other methods for a wavelength along a known path: spectra over
the path, MUSIC, and a seeded extended Kalman filter. Each of them gets the velocity, searches 0.4-6 mm like papilla's
pipeline, and says "ok" by the textbook's rule for it.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from papilla.core import settings
from papilla.core.errors import InputError
from papilla.core.units import TINY_DIVISOR
from papilla.estimators import ChirpTracker, Pipeline
from papilla_papers.methods import roughness

GIVEN = settings.parameters(__name__)
LOW_MM, HIGH_MM = GIVEN.low_mm, GIVEN.high_mm
GRID_MM = LOW_MM / GIVEN.cells
SHORT_MM, LONG_MM, LEAST_MM = GIVEN.short_mm, GIVEN.long_mm, GIVEN.least_mm
PRODUCT, VARIANT, RIVAL, PUBLISHED = "product", "product, with more or less stated", "rival", "published"


class Answer(NamedTuple):
    """Answers for n samples: wavelength_mm and sigma_mm (NaN if there is none), and ok : whether they may be used;
    steady : whether the status is "ok, constant speed", None for methods without this status."""

    wavelength_mm: np.ndarray
    sigma_mm: np.ndarray
    ok: np.ndarray
    steady: np.ndarray | None = None


@dataclass(frozen=True)
class Method:
    """run(time_s (n,), readings (n, g), velocity_mm_s (n,)) -> `Answer`; kind : of `PRODUCT` ... `PUBLISHED`.

    path_mm : the path that it remembers, None if its memory is not a path.
    """

    kind: str
    run: Callable[..., Answer]
    path_mm: float | None = None


def _pipeline(time, readings, velocity, **path) -> Answer:
    columns = ("velocity_mm_s",)
    pipeline = Pipeline(None, gauges=readings.shape[1], columns=columns, sample_rate_Hz=_rate(time), **path)
    found = pipeline.process(np.column_stack([time, readings, velocity]))
    ok, steady = (_beginning(found.wavelength_status, words) for words in ("ok", "ok, constant"))
    return Answer(np.asarray(found.wavelength_mm), np.asarray(found.wavelength_sigma_mm), ok, steady)


def _beginning(statuses, words: str) -> np.ndarray:
    """(n,) bool: statuses that begin with these words."""
    return np.array([status.startswith(words) for status in statuses])


def _blind(time, readings, velocity) -> Answer:
    found = ChirpTracker(sample_rate_Hz=_rate(time)).process(np.column_stack([readings[:, 0], velocity]))
    sigma = np.asarray(found.wavelength_sigma_mm)
    return Answer(np.asarray(found.wavelength_mm), sigma, _beginning(found.sentence, "ok"))


def _on_one_gauge(run, time, readings, velocity) -> Answer:
    return Answer(*run(time, readings[:, 0], velocity))


def _published(kind, time, readings, velocity) -> Answer:
    found = kind(variant="as_printed", sample_rate_Hz=_rate(time)).process(np.column_stack([readings[:, 0], velocity]))
    return Answer(found.wavelength_mm, np.full(time.size, np.nan), _beginning(found.sentence, "ok"))


def _rate(time) -> float:
    return round((time.size - 1) / float(time[-1] - time[0]), 6)


def hopping(search: Callable, path_mm: float, time, reading, velocity):
    """Wavelength, sigma and ok (n,) of `search(place, reading)` at every 2 mm of path, held until the next answer."""
    place = np.concatenate([[0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time))])
    travelled = np.cumsum(np.abs(np.diff(place, prepend=0.0)))
    found = np.full((3, time.size), np.nan)
    known = np.isfinite(reading)
    hops = np.searchsorted(travelled, np.arange(LEAST_MM, travelled[-1], GIVEN.hop_mm)).tolist()
    for end, after in zip(hops, [*hops[1:], time.size], strict=True):
        rows = np.arange(np.searchsorted(travelled, travelled[end] - path_mm), end)
        rows = rows[known[rows]]
        wavelength, sigma, ok = search(place[rows], reading[rows])
        held = found[:, end - 1] if math.isnan(wavelength) else (wavelength, sigma, ok)
        found[:, end:after] = np.reshape(held, (3, 1))
    return found[0], found[1], found[2] == 1


def strongest(place, reading, tapered: bool) -> tuple[float, float, bool]:
    """Wavelength, sigma in mm and ok of the largest line of a spectrum over the path, with or without a Hann taper.

    ok: noise of the median's level reaches it more rarely than `false_alarm` in all places together. sigma: Rife &
    Boorstyn (1974), doi:10.1109/TIT.1974.1055282, twice that under the taper.
    """
    weight = np.abs(np.gradient(place))
    if tapered:
        weight = weight * np.sin(np.pi * (np.arange(place.size) + 0.5) / place.size) ** 2
    centred = weight * (reading - np.average(reading, weights=weight + TINY_DIVISOR))
    cell = np.round((place - place.min()) / GRID_MM).astype(int)
    span = GRID_MM * (int(cell.max()) + 1)
    length = 1 << math.ceil(math.log2(8 * max(span, LEAST_MM) / GRID_MM))
    power = np.abs(np.fft.rfft(np.bincount(cell, centred), length)) ** 2
    step = 1 / (length * GRID_MM)
    inside = np.arange(math.ceil(1 / HIGH_MM / step), int(1 / LOW_MM / step))
    top = int(inside[np.argmax(power[inside])])
    over = math.log(2) * power[top] / max(float(np.median(power[inside])), TINY_DIVISOR)
    wavenumber = (top + _vertex(np.log(power[top - 1 : top + 2] + TINY_DIVISOR))) * step
    sigma = (2 if tapered else 1) * math.sqrt(1.5 / over) / (math.pi * span) / wavenumber**2
    places = span * (1 / LOW_MM - 1 / HIGH_MM)
    return 1 / wavenumber, sigma, bool(over > math.log(places / GIVEN.false_alarm))


def _vertex(three) -> float:
    """Vertex of the parabola through three values, in steps from the middle."""
    left, middle, right = three
    bend = left - 2 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0 else 0.0


def music(place, reading) -> tuple[float, float, bool]:
    """The greatest peak of MUSIC's pseudo-spectrum over the last stroke, on an even grid of the path.

    ok: the signal's eigenvalues stand ten times over the noise's. Source: Schmidt (1986), doi:10.1109/TAP.1986.1143830.
    """
    turns = np.flatnonzero(np.diff(place)[1:] * np.diff(place)[:-1] < 0)
    first = int(turns[-1]) + 2 if turns.size else 0
    place, reading = place[first:], reading[first:]
    spacing = GIVEN.decimated * GRID_MM
    if place.size < 2 or np.ptp(place) < LEAST_MM:
        return math.nan, math.nan, False
    order = np.argsort(place, kind="stable")
    grid = np.arange(place.min(), place.max(), spacing)
    even = np.interp(grid, place[order], reading[order])
    snapshots = np.lib.stride_tricks.sliding_window_view(even - even.mean(), GIVEN.order)
    covariance = snapshots.T @ snapshots / len(snapshots)
    values, vectors = np.linalg.eigh(covariance + covariance[::-1, ::-1])
    k = np.linspace(1 / HIGH_MM, 1 / LOW_MM, GIVEN.wavenumbers)
    steering = np.exp(-2j * np.pi * np.outer(k * spacing, np.arange(GIVEN.order)))
    log_pseudo = -np.log(np.sum(np.abs(steering @ vectors[:, : -GIVEN.sources]) ** 2, axis=1) + TINY_DIVISOR)
    top = 1 + int(np.argmax(log_pseudo[1:-1]))
    wavenumber = k[top] + _vertex(log_pseudo[top - 1 : top + 2]) * (k[1] - k[0])
    over = values[-1] / max(float(np.median(values[: -GIVEN.sources])), TINY_DIVISOR)
    sigma = math.sqrt(1.5 / (over * len(snapshots) / GIVEN.order)) / (math.pi * (grid[-1] - grid[0])) / wavenumber**2
    return 1 / wavenumber, sigma, bool(over > GIVEN.stands_out)


def seeded_filter(time, reading, velocity):
    """Wavelength, sigma and ok (n,) of an extended Kalman filter along the path, seeded once by the short spectrum.

    State: phase, wavenumber, offset and the amplitudes of two harmonics; ok: sigma below 2 % of the wavelength.
    """
    seeded, _, sure = hopping(partial(strongest, tapered=True), SHORT_MM, time, reading, velocity)
    begin = int(np.argmax(sure)) if sure.any() else time.size
    found = np.full((2, time.size), np.nan)
    if begin == time.size:
        return *found, np.zeros(time.size, bool)
    noise = 1.4826 * np.nanmedian(np.abs(np.diff(reading))) / math.sqrt(2)
    size = float(np.nanstd(reading[:begin]))
    x = np.array([0.0, 2 * np.pi / seeded[begin], np.nanmean(reading[:begin]), size, 0.0, 0.0])
    P = np.diag([np.pi**2 / 3, (GIVEN.seed_sigma * x[1]) ** 2, size**2, size**2, size**2, size**2])
    walk, wander, swell = GIVEN.walk
    for row in range(begin, time.size):
        step = 0.5 * (velocity[row] + velocity[row - 1]) * (time[row] - time[row - 1])
        F = np.eye(6)
        F[0, 1] = step
        x = F @ x
        P = F @ P @ F.T + np.diag([0.0, walk * x[1] ** 2, wander * size**2, *3 * [swell * size**2]]) * abs(step)
        if np.isfinite(reading[row]):
            c1, c2, s2 = math.cos(x[0]), math.cos(2 * x[0]), math.sin(2 * x[0])
            slope = -x[3] * math.sin(x[0]) - 2 * x[4] * s2 + 2 * x[5] * c2
            H = np.array([slope, 0.0, 1.0, c1, c2, s2])
            S = H @ P @ H + noise**2
            K = P @ H / S
            x = x + K * (reading[row] - x[2] - x[3] * c1 - x[4] * c2 - x[5] * s2)
            P = P - np.outer(K, H @ P)
        found[:, row] = 2 * np.pi / abs(x[1]), 2 * np.pi * math.sqrt(max(P[1, 1], 0.0)) / x[1] ** 2
    return *found, found[1] < GIVEN.sure * found[0]


def _over_path(search, path_mm: float) -> Method:
    return Method(RIVAL, partial(_on_one_gauge, partial(hopping, search, path_mm)), path_mm)


METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "pipeline": Method(PRODUCT, _pipeline, LONG_MM),
        "exact scale": Method(VARIANT, partial(_pipeline, scale_sigma=0.0), LONG_MM),
        "ridges known": Method(VARIANT, partial(_pipeline, ridge_pitch_mm=GIVEN.ridge_pitch_mm)),
        "no velocity": Method(VARIANT, _blind),
        "STFT over the path": _over_path(partial(strongest, tapered=True), SHORT_MM),
        "periodogram": _over_path(partial(strongest, tapered=False), LONG_MM),
        "MUSIC": _over_path(music, SHORT_MM),
        "seeded EKF": Method(RIVAL, partial(_on_one_gauge, seeded_filter)),
        "impulse density (2006)": Method(PUBLISHED, partial(_published, roughness.ImpulseDensity)),
        "impulse interval (2006)": Method(PUBLISHED, partial(_published, roughness.ImpulseInterval)),
        "STFT 200 ms (2006)": Method(PUBLISHED, partial(_published, roughness.ShortTimeSpectrum)),
        "zero crossing (2007)": Method(PUBLISHED, partial(_published, roughness.ZeroCrossing)),
        "STFT 32 ms (2011)": Method(PUBLISHED, partial(_published, roughness.Okamoto)),
    }
)
"""Every method by its name. "exact scale" is the pipeline with an exact scale of the velocity, so that its sigma is
that of the line alone; "ridges known" has the pitch of the finger's ridges; "no velocity" uses the velocity only to
compute the wavelength. The published ones are as printed, and are "ok" whenever they answer."""


def chosen(kind: str, names, known) -> list[str]:
    """The `known` names that contain one of `names`; all if `names` is empty.

    Raises `InputError` for a name that matches none; kind : what the names are, for its message.
    """
    for name in names:
        if not any(name.lower() in own.lower() for own in known):
            raise InputError(f"no {kind} is called {name!r}, there are: {'; '.join(known)}")
    return [own for own in known if not names or any(name.lower() in own.lower() for name in names)]
