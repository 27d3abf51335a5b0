"""The register of objectives: a function of a `DesignInScene`, the better direction, its unit, and its requirements."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from papilla.design.in_scene import DesignInScene

Better = Literal["less", "more"]


@dataclass(frozen=True)
class Objective:
    """A number that characterises a design in a scene. words : description; gauges : smallest number of gauges."""

    name: str
    better: Better
    unit: str
    words: str
    gauges: int
    of: Callable[[DesignInScene], float]

    @property
    def sign(self) -> float:
        """Factor that makes smaller values better."""
        return 1.0 if self.better == "less" else -1.0


OBJECTIVES: dict[str, Objective] = {}


def objective(name: str, better: Better, unit: str, words: str, gauges: int = 1):
    """Register a function of a `DesignInScene` under a name that studies use."""

    def register(of: Callable[[DesignInScene], float]) -> Callable[[DesignInScene], float]:
        OBJECTIVES[name] = Objective(name, better, unit, words, gauges, of)
        return of

    return register
