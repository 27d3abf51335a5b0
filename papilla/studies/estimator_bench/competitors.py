"""The estimators that are compared, by name: how each is made, what it knows, and the memory it declares."""

import inspect
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from papilla.errors import InputError
from papilla.estimators.published.roughness import (
    ImpulseDensity,
    ImpulseInterval,
    Okamoto,
    ShortTimeSpectrum,
    ZeroCrossing,
)
from papilla.estimators.published.roughness.reciprocal import ReciprocalCounter
from papilla.estimators.tracking import FusedTracker, SpaceTracker, WavelengthEstimate
from papilla.estimators.tracking.blind import ChirpTracker

AS_PRINTED, CORRECTED, TRACKER, BLIND = "as printed", "corrected", "velocity known", "velocity blind"
FAMILIES = (AS_PRINTED, CORRECTED, TRACKER, BLIND)
GAUGES_MM = tuple(21.0 * math.sin(math.radians(angle)) for angle in (-40, -20, 0, 20, 40))
"""Places of the default finger's gauges along the sliding direction: ellipse parameters on an interface 21 mm wide."""


class ByPhase(FusedTracker):
    """The fused tracker's other answer: the wavelength from the phases between gauges, whatever the velocity says."""

    def process(self, block) -> WavelengthEstimate:
        """Wavelength by phase after each row of a block (n, g + 1)."""
        found = super().process(block)
        speed = np.abs(np.asarray(block, float)[:, -1])
        by_phase, sigma = found.wavelength_by_phase_mm, found.wavelength_by_phase_sigma_mm
        return WavelengthEstimate(by_phase, sigma, speed / by_phase, found.status)


@dataclass(frozen=True)
class Competitor:
    """One line of the comparison.

    kind, options : the estimator's class and its options; family : one of `FAMILIES`. memory_s : what it declares to
    remember, None where that is no time. gauges_mm : where its gauges are. snrs_dB : the only noises it is run at, None
    for all (five gauges take five times as long).
    """

    name: str
    kind: type
    family: str
    memory_s: float | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    gauges_mm: tuple[float, ...] = (0.0,)
    snrs_dB: tuple[float, ...] | None = None

    def make(self, **more):
        """A new estimator at 1 kHz for 0.4-6 mm."""
        return self.kind(**self.options, **more)

    @property
    def compiles(self) -> bool:
        """Whether its kernel can be compiled (option `compiled`)."""
        known = inspect.signature(self.kind).parameters
        return "compiled" in known


_KINDS: Mapping[str, type] = {
    "impulse density (2006)": ImpulseDensity,
    "interval (2006)": ImpulseInterval,
    "STFT 200 ms (2006)": ShortTimeSpectrum,
    "zero crossing (2007)": ZeroCrossing,
    "STFT 32 ms (2011)": Okamoto,
}


def _published() -> list[Competitor]:
    made = []
    for variant, family in (("as_printed", AS_PRINTED), ("corrected", CORRECTED)):
        for name, kind in _KINDS.items():
            one = kind(variant=variant)
            # An interval is as long as a period of the grating: its window is the threshold's alone.
            memory = None if kind is ImpulseInterval else one.window_samples / one.sample_rate_Hz
            made.append(Competitor(f"{name}, {family}", kind, family, memory, {"variant": variant}))
    return made


def _trackers() -> list[Competitor]:
    # The scenes' velocities are exact, unless a row says otherwise: what is compared is the sigma of the rest.
    exact = {"scale_sigma": 0.0}
    fused = {"gauge_positions_mm": GAUGES_MM} | exact
    return [
        Competitor("reciprocal in space", ReciprocalCounter, TRACKER),
        Competitor("space tracker", SpaceTracker, TRACKER, 0.5, exact),
        Competitor("five gauges", FusedTracker, TRACKER, 0.5, fused, GAUGES_MM, (20.0, -6.0)),
        Competitor("five gauges, by phase", ByPhase, TRACKER, None, fused, GAUGES_MM, (20.0,)),
        Competitor("chirp tracker", ChirpTracker, BLIND),
    ]


PUBLISHED = tuple(item.name for item in _published())
COMPETITORS: Mapping[str, Competitor] = MappingProxyType({item.name: item for item in (*_published(), *_trackers())})
"""Name -> competitor; settings that are not in the name are the defaults of the classes."""


def chosen(names) -> dict[str, Competitor]:
    """The competitors whose names contain one of `names` (all of them when there are none).

    Raises `InputError` for a name that fits none.
    """
    wanted = [name.lower() for name in names]
    for name in wanted:
        if not any(name in known.lower() for known in COMPETITORS):
            raise InputError(f"no estimator is called {name!r}, there are: {'; '.join(COMPETITORS)}")
    return {
        known: competitor
        for known, competitor in COMPETITORS.items()
        if not wanted or any(name in known.lower() for name in wanted)
    }
