"""The register of objectives: a function of a `Look`, the better direction, its unit, and its requirements."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from papilla.design.look import Look

Better = Literal["less", "more"]


@dataclass(frozen=True)
class Objective:
    """A number that characterises a design in a scene. words : description; gauges : smallest number of gauges."""

    name: str
    better: Better
    unit: str
    words: str
    gauges: int
    of: Callable[[Look], float]

    @property
    def sign(self) -> float:
        """Factor that makes smaller values better."""
        return 1.0 if self.better == "less" else -1.0


OBJECTIVES: dict[str, Objective] = {}


def objective(name: str, better: Better, unit: str, words: str, gauges: int = 1):
    """Register a function of a `Look` under a name that studies use."""

    def register(of: Callable[[Look], float]) -> Callable[[Look], float]:
        OBJECTIVES[name] = Objective(name, better, unit, words, gauges, of)
        return of

    return register
