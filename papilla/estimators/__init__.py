"""Online estimators: `update(sample)` in a loop, `process(block)` over a log, `reset()` before something new."""

from papilla.estimators.softness import Softness, SoftnessEstimate, SoftnessState

__all__ = ["Softness", "SoftnessEstimate", "SoftnessState"]
