"""How a long job says how far it is: one kind of callback, which takes a line of text, for all jobs."""

from collections.abc import Callable

from papilla.core import seams

Progress = Callable[[str], None]
"""Called with what a job does now, such as "meshing, 3 s"; a `CountedStep` where the job counts."""


class CountedStep(str):
    """A line of text that says what a job does now, with the number of steps that are done, and of all."""

    done: int
    total: int

    def __new__(cls, text: str, done: int = 0, total: int = 0) -> "CountedStep":
        """The line with its counts; they go with it to other processes."""
        step = super().__new__(cls, text)
        step.done, step.total = done, total
        return step


def silent(stage: str) -> None:
    """Show nothing."""


def counted(progress: Progress, name: str) -> Progress:
    """A `Progress` for the steps of a job that is called by a name: says how many are done, and about how long the rest
    takes."""
    began = seams.now_s()

    def tell(step: str) -> None:
        assert isinstance(step, CountedStep)
        seconds_left = (seams.now_s() - began) * (step.total - step.done) / max(step.done, 1)
        rest = f", about {seconds_left:.0f} s left" if step.done < step.total else ""
        progress(CountedStep(f"{name}: {step.done} of {step.total}{rest}", step.done, step.total))

    return tell
