"""The compared methods, by name: each takes times, readings and velocity, and returns wavelength, sigma, ok."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from papilla.errors import InputError
from papilla.estimators import ChirpTracker, Pipeline
from papilla.estimators.published.roughness import (
    ImpulseDensity,
    ImpulseInterval,
    Okamoto,
    ShortTimeSpectrum,
    ZeroCrossing,
)
from papilla.studies.estimator_bench import other_methods

RIDGE_PITCH_MM = 1.2
"""Ridge pitch of the default finger, used in the scenes "felt by FEM"."""
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
    ok, steady = (
        np.array([words.startswith(begin) for words in found.wavelength_status]) for begin in ("ok", "ok, constant")
    )
    return Answer(np.asarray(found.wavelength_mm), np.asarray(found.wavelength_sigma_mm), ok, steady)


def _blind(time, readings, velocity) -> Answer:
    found = ChirpTracker(sample_rate_Hz=_rate(time)).process(np.column_stack([readings[:, 0], velocity]))
    ok = np.array([words.startswith("ok") for words in found.sentence])
    return Answer(np.asarray(found.wavelength_mm), np.asarray(found.wavelength_sigma_mm), ok)


def _on_one_gauge(run, time, readings, velocity) -> Answer:
    return Answer(*run(time, readings[:, 0], velocity))


def _published(kind, time, readings, velocity) -> Answer:
    found = kind(variant="as_printed", sample_rate_Hz=_rate(time)).process(np.column_stack([readings[:, 0], velocity]))
    ok = np.array([words.startswith("ok") for words in found.sentence])
    return Answer(found.wavelength_mm, np.full(time.size, np.nan), ok)


def _rate(time) -> float:
    return round((time.size - 1) / float(time[-1] - time[0]), 6)


def _over_path(search, path_mm: float) -> Method:
    return Method(RIVAL, partial(_on_one_gauge, partial(other_methods.hopping, search, path_mm)), path_mm)


METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "pipeline": Method(PRODUCT, _pipeline, other_methods.LONG_MM),
        "exact scale": Method(VARIANT, partial(_pipeline, scale_sigma=0.0), other_methods.LONG_MM),
        "ridges known": Method(VARIANT, partial(_pipeline, ridge_pitch_mm=RIDGE_PITCH_MM)),
        "no velocity": Method(VARIANT, _blind),
        "STFT over the path": _over_path(partial(other_methods.strongest, tapered=True), other_methods.SHORT_MM),
        "periodogram": _over_path(partial(other_methods.strongest, tapered=False), other_methods.LONG_MM),
        "MUSIC": _over_path(other_methods.music, other_methods.SHORT_MM),
        "seeded EKF": Method(RIVAL, partial(_on_one_gauge, other_methods.seeded_filter)),
        "impulse density (2006)": Method(PUBLISHED, partial(_published, ImpulseDensity)),
        "impulse interval (2006)": Method(PUBLISHED, partial(_published, ImpulseInterval)),
        "STFT 200 ms (2006)": Method(PUBLISHED, partial(_published, ShortTimeSpectrum)),
        "zero crossing (2007)": Method(PUBLISHED, partial(_published, ZeroCrossing)),
        "STFT 32 ms (2011)": Method(PUBLISHED, partial(_published, Okamoto)),
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
