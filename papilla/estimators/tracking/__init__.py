"""Trackers of the wavelength over the path: they know the velocity, so there is nothing to lag behind."""

from papilla.estimators.tracking.answer import FusedEstimate, TrackingStatus, WavelengthEstimate
from papilla.estimators.tracking.trackers import FusedTracker, LineTracker, SpaceTracker

__all__ = ["FusedEstimate", "FusedTracker", "LineTracker", "SpaceTracker", "TrackingStatus", "WavelengthEstimate"]
