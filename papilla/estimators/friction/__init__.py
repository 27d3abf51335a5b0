"""Kinetic and static coefficient of friction in both directions, with the offset of the tangential force."""

from papilla.estimators.friction.estimator import STATIC_HZ, Friction, FrictionEstimate, FrictionState, FrictionStatus

__all__ = ["STATIC_HZ", "Friction", "FrictionEstimate", "FrictionState", "FrictionStatus"]
