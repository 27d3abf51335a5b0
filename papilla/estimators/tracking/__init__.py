"""Trackers of the wavelength in the position domain: they know the velocity, so there is nothing to lag behind."""

from papilla.estimators.tracking.answer import TrackerState, TrackingStatus, WavelengthEstimate
from papilla.estimators.tracking.bank import WavenumberBank
from papilla.estimators.tracking.fusion import FusedEstimate, FusedTracker
from papilla.estimators.tracking.reciprocal import CrossingState, ReciprocalCounter
from papilla.estimators.tracking.space_ekf import SpaceTracker

__all__ = [
    "CrossingState",
    "FusedEstimate",
    "FusedTracker",
    "ReciprocalCounter",
    "SpaceTracker",
    "TrackerState",
    "TrackingStatus",
    "WavelengthEstimate",
    "WavenumberBank",
]
