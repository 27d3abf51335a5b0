"""Methods of softness by their names: the calibrated surfaces, and methods that other packages bring.

A package names its methods in its entry points: in the group `papilla.softness` what makes a `SampleMethod`, in
`papilla.softness_by_depth` what makes a `DepthMethod`. `papilla_papers` brings the regressions of the papers so.
"""

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Protocol

import numpy as np

from papilla.calibration import Calibration, SoftnessStatus
from papilla.core.errors import InputError, MissingExtraError
from papilla.estimators.softness import SoftnessEstimate

SURFACES_METHOD = ("gauges", "surface", "sd")
"""The methods of papilla: by the calibrated surfaces of all gauges (old name "surface") or of S_d."""
BY_SAMPLES, BY_DEPTH = "papilla.softness", "papilla.softness_by_depth"
"""Groups of entry points."""


class SampleMethod(Protocol):
    """A modulus from each sample by itself, made of a calibration, `gauge_sigma` (microstrain) and `force_sigma_N`.

    note : what a summary says of such a modulus. state : what is remembered.
    """

    note: str
    state: Any

    def feel(self, readings: tuple[float, ...], force_N: float, found: tuple[int, ...]) -> SoftnessEstimate:
        """The estimate after one more sample; found : its gauges' faults, as `GaugeHealth.check` finds them."""


class DepthMethod(Protocol):
    """A modulus from force and depth, made of the presses of a sweep: force_N, modulus_MPa, depth_mm, each (n,)."""

    def errors_of(self, depth_mm: float, force_N: float) -> Any:
        """The errors that `process` takes, for a log with this noise of depth and force."""

    def process(
        self, force_N: np.ndarray, depth_mm: np.ndarray, errors: Any
    ) -> tuple[np.ndarray, np.ndarray, list[SoftnessStatus]]:
        """Modulus (n,) and its standard deviation in MPa, NaN if there is none, and n statuses."""


@cache
def _brought(group: str) -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=group)}


def softness_names() -> tuple[str, ...]:
    """The names of all methods that take samples."""
    return *SURFACES_METHOD, *_brought(BY_SAMPLES)


def sample_method(name: str, calibration: Calibration, **noise: float) -> SampleMethod:
    """The method of this name, which is not one of `SURFACES_METHOD`; raises `InputError` for an unknown one."""
    if name not in _brought(BY_SAMPLES):
        raise InputError(f"softness must be one of {', '.join(softness_names())}, got {name!r}")
    return _brought(BY_SAMPLES)[name].load()(calibration, **noise)


def depth_method(name: str, force_N: np.ndarray, modulus_MPa: np.ndarray, depth_mm: np.ndarray) -> DepthMethod:
    """The method of this name for the presses of a sweep; raises `MissingExtraError` if no package brings it."""
    if name not in _brought(BY_DEPTH):
        raise MissingExtraError(f"no installed package brings the method {name!r}: papilla_papers does")
    return _brought(BY_DEPTH)[name].load()(force_N, modulus_MPa, depth_mm)
