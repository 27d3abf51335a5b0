"""The estimators that are compared, by name: how each is made for a wavelength range."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

from papilla.errors import InputError
from papilla.estimators.published import ImpulseDensity, ImpulseInterval, Okamoto, ShortTimeSpectrum, ZeroCrossing
from papilla.estimators.tracking import ReciprocalCounter, SpaceTracker, WavenumberBank

PUBLISHED = {
    "impulse density (2006)": ImpulseDensity,
    "interval (2006)": ImpulseInterval,
    "STFT 200 ms (2006)": ShortTimeSpectrum,
    "zero crossing (2007)": ZeroCrossing,
    "STFT 32 ms (2011)": Okamoto,
}


def _of_variant(kind, variant: str) -> Callable:
    return lambda: kind(variant=variant)


COMPETITORS: Mapping[str, Callable] = MappingProxyType(
    {f"{name}, as printed": _of_variant(kind, "as_printed") for name, kind in PUBLISHED.items()}
    | {f"{name}, corrected": _of_variant(kind, "corrected") for name, kind in PUBLISHED.items()}
    | {
        "reciprocal in space": ReciprocalCounter,
        "wavenumber bank": WavenumberBank,
        "space tracker, 200 ms": lambda: SpaceTracker(memory_s=0.2),
        "space tracker, 500 ms": SpaceTracker,
    }
)
"""Name -> a function that makes a new estimator at 1 kHz for 0.4-6 mm, every setting its default."""


def chosen(names) -> dict[str, Callable]:
    """The competitors whose names contain one of `names` (all of them when there are none).

    Raises `InputError` for a name that fits none.
    """
    wanted = list(names)
    for name in wanted:
        if not any(name.lower() in known.lower() for known in COMPETITORS):
            raise InputError(f"no estimator is called {name!r}, there are: {'; '.join(COMPETITORS)}")
    return {
        known: make
        for known, make in COMPETITORS.items()
        if not wanted or any(name.lower() in known.lower() for name in wanted)
    }
