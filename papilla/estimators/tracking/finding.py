"""Result of a search in the latest path."""

from dataclasses import dataclass

from papilla.estimators.tracking.answer import TrackingStatus


@dataclass
class Finding:
    """status : of this search alone. wavenumber (1/mm) and its sigma, 0 before the first; extent : mm of path that was
    used.

    lines : (wavelength_mm, ratio, chance) of the lines in the range, strongest first. late_s, late_variance : of the
    path. phase, phase_sigma : per gauge, cycles of the fundamental at path 0, NaN where unknown. amplitude, noise : of
    the fundamental in the last stroke, from path 0 on, and variance of a sample about it. kept : share of the amplitude
    that is left in the newest periods, and its sigma. hums_Hz : lines over time; mixed : True if a louder line that was
    not removed may be one. other : other possible wavenumber of the surface, 0 for none.
    """

    status: TrackingStatus = TrackingStatus.SEARCHING
    wavenumber: float = 0.0
    sigma: float = 0.0
    extent: float = 0.0
    lines: tuple[tuple[float, float, float], ...] = ()
    late_s: float = 0.0
    late_variance: float = 0.0
    phase: tuple[float, ...] = ()
    phase_sigma: tuple[float, ...] = ()
    amplitude: tuple[complex, ...] = ()
    noise: tuple[float, ...] = ()
    kept: float = 1.0
    kept_sigma: float = 0.0
    score: float = 0.0
    hums_Hz: tuple[float, ...] = ()
    mixed: bool = False
    other: float = 0.0
