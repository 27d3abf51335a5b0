"""One row of the verification table."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """What a family of cases yields: `error` must not exceed `bound`.

    `measure` says what is compared, with which reference; a fraction where it does not name a unit.
    """

    name: str
    measure: str
    error: float
    bound: float


@dataclass(frozen=True)
class Case(Check):
    """A check with the wall-clock seconds that it took; what cases share is counted with the first of them."""

    seconds: float

    @property
    def passed(self) -> bool:
        """Whether the error is within its bound; an error that is no number is not."""
        return bool(self.error <= self.bound)

    def to_json(self) -> dict:
        """The documented keys, as plain values."""
        error, bound = float(self.error), float(self.bound)
        own = {"name": self.name, "measure": self.measure, "error": error, "bound": bound}
        return own | {"passed": self.passed, "seconds": self.seconds}


Family = Callable[[], Iterator[Check]]
"""A family of cases: a generator of checks that share what is expensive."""
