"""Trackers of the wavelength over the path: they know the velocity, so there is nothing to lag behind.

Read in this order: `trackers` (what a caller sees), `follower` (when to search, and what to believe), `memory` (what it
remembers, what a search is given and what it finds), `line_search` (the steps of a search), `time_lines` (hum),
`refine` (the last step: phases). `chirp` is for readings without a velocity: it follows a fit (`motion_fit`) that
`frequency_search` finds.
"""

from papilla.estimators.wavelength.memory import TrackingStatus
from papilla.estimators.wavelength.trackers import (
    FusedEstimate,
    FusedTracker,
    LineTracker,
    SpaceTracker,
    WavelengthEstimate,
)

__all__ = ["FusedEstimate", "FusedTracker", "LineTracker", "SpaceTracker", "TrackingStatus", "WavelengthEstimate"]
