"""The errors of measured presses by their cause: stated, or estimated from presses that were repeated."""

from dataclasses import dataclass, fields

from papilla import checks


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the errors that are not in the model, each independent from press to press.

    readings_microstrain : of a gauge. force : relative; all gauges of a press share it. indentation_mm : of the stage.
    model, depth : relative errors of the model in what gauges feel (twice as much in curvature) and in an indentation,
    besides the response's own error; they are alike in all presses (`problem.PATTERNS`). On a dome of one's own strain
    was 0.1 to 1.7 % off an independent code at finite strain, curvature 0.2 to 4 %, an indentation 0.5 to 2 %, most of
    it by the mesh of 1 mm.
    beyond : added to `model` where a press strains the finger more than was measured at finite strain.
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
        """In words, and where it is from."""
        parts = f"readings {self.readings_microstrain:.3g} µε, force {100 * self.force:.2g} %"
        return f"{parts}, {f'estimated from {self.repeats} repeats' if self.repeats else 'as stated'}"
