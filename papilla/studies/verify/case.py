"""One row of the verification table."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Case:
    """What a family yields: `error` must not exceed `bound`; an error that is no number does.

    `measure` says what is compared, with which reference; a fraction where it does not name a unit. seconds : that it
    took, by the wall clock; what cases share is counted with the first of them.
    """

    name: str
    measure: str
    error: float
    bound: float
    seconds: float = 0.0

    @property
    def passed(self) -> bool:
        """Whether the error is within its bound."""
        return bool(self.error <= self.bound)

    def to_json(self) -> dict:
        """The documented keys, as plain values."""
        plain = vars(self) | {"error": float(self.error), "bound": float(self.bound), "passed": self.passed}
        return {key: plain[key] for key in ("name", "measure", "error", "bound", "passed", "seconds")}


Family = Callable[[], Iterator[Case]]
"""A family of cases: a generator of those that share what is expensive."""
