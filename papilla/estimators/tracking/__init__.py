"""Trackers of the wavelength over the path: they know the velocity, so there is nothing to lag behind.

Read in this order: `trackers` (what a caller sees), `follower` (when to search, and what to believe; its state is in
`memory`), `line_search` (the steps of a search; what it is given and finds is in `search_task`), `time_lines` (hum),
`refine` (the last step: phases). `chirp` is for readings without a velocity: it follows a fit (`motion_fit`) that
`frequency_search` finds.
"""

from papilla.estimators.tracking.search_task import TrackingStatus
from papilla.estimators.tracking.trackers import (
    FusedEstimate,
    FusedTracker,
    LineTracker,
    SpaceTracker,
    WavelengthEstimate,
)

__all__ = ["FusedEstimate", "FusedTracker", "LineTracker", "SpaceTracker", "TrackingStatus", "WavelengthEstimate"]
