"""`Case`: one checked value of any study, with the interval in which it must lie, and the verdict."""

import math
from dataclasses import dataclass
from enum import StrEnum

Interval = tuple[float, float]
"""Smallest and largest value that a bound allows; an open end is infinite."""


class Verdict(StrEnum):
    """Result of a case."""

    WITHIN = "within the bound"
    OUTSIDE = "outside the bound"
    UNTESTED = "not tested"


@dataclass(frozen=True)
class Case:
    """One checked value.

    what : the case in words.
    cause : meaning of the value and its comparison, or the reason for a missing value.
    value : a number, a fraction if `cause` names no unit; None if there is none.
    bound : the allowed interval, or the largest value.
    seconds : wall-clock time; work that cases share counts with the first of them.
    """

    what: str
    cause: str
    value: float | None
    bound: Interval | float
    seconds: float = 0.0

    @property
    def interval(self) -> Interval:
        """The bound with both ends."""
        return self.bound if isinstance(self.bound, tuple) else (-math.inf, self.bound)

    @property
    def verdict(self) -> Verdict:
        """Whether the value lies within its bound; NaN does not."""
        if self.value is None:
            return Verdict.UNTESTED
        low, high = self.interval
        return Verdict.WITHIN if low <= self.value <= high else Verdict.OUTSIDE

    @property
    def passed(self) -> bool:
        """Whether there is a value within the bound."""
        return self.verdict == Verdict.WITHIN
