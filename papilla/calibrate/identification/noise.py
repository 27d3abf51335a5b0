"""Errors of measured presses by their cause: stated, or estimated from repeated presses."""

from dataclasses import dataclass, fields

from papilla import checks
from papilla.units import PER_CENT


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the errors that are not in the model, each independent from press to press.

    readings_microstrain : of a gauge. force : relative; all gauges of a press share it. indentation_mm : of the stage.
    model, depth : relative errors of the model in gauge strain (twice as much in curvature) and in indentation, besides
    the error of the response; they are similar in all presses (`problem.PATTERNS`). On a user's dome, strain differed
    from an independent code at finite strain by 0.1 to 1.7 %, curvature by 0.2 to 4 %, indentation by 0.5 to 2 %,
    mostly because of the mesh of 1 mm.
    beyond : added to `model` if a press strains the finger more than the range of large strain that was measured.
    repeats : degrees of freedom of repeated presses from which the first three were estimated; 0 if they are stated.
    """

    readings_microstrain: float = 5.0
    force: float = 0.01
    indentation_mm: float = 0.02
    model: float = 0.008
    depth: float = 0.01
    beyond: float = 0.02
    repeats: int = 0

    def __post_init__(self) -> None:
        for item in fields(self):
            if item.name != "repeats":
                checks.positive(f"noise {item.name}", getattr(self, item.name))

    @property
    def words(self) -> str:
        """The noise in words, and whether it is stated or estimated."""
        parts = f"readings {self.readings_microstrain:.3g} µε, force {PER_CENT * self.force:.2g} %"
        return f"{parts}, {f'estimated from {self.repeats} repeats' if self.repeats else 'as stated'}"
