"""Kinetic and static coefficient of friction in both directions, with the offset of the tangential force."""

from papilla.estimators.friction.answer import FrictionEstimate, FrictionStatus
from papilla.estimators.friction.estimator import STATIC_HZ, Friction, FrictionState

__all__ = ["STATIC_HZ", "Friction", "FrictionEstimate", "FrictionState", "FrictionStatus"]
