"""A long computation that is spread over many samples, so that none of them waits long.

The computation is a generator that yields after each piece of work. A generator cannot be copied or pickled, but a
state must be: `Spread` remembers how many pieces are done, and a copy does them again when it goes on.
"""

from collections.abc import Generator
from typing import Any, TypeVar

Result = TypeVar("Result")
Pieces = Generator[None, None, Result]
"""A computation in pieces of less than a tenth of a millisecond each, which returns its result at the end."""


def completed(pieces: Pieces[Result]) -> Result:
    """The result of a computation, all pieces at once."""
    while True:
        try:
            next(pieces)
        except StopIteration as end:
            return end.value


class Spread:
    """A computation under way. task : an object whose `run` returns its `Pieces`, and that does not change meanwhile;
    done : pieces that are done."""

    def __init__(self, task: Any, done: int = 0):
        self.task, self.done = task, done
        self._pieces: Pieces | None = None

    def __reduce__(self):
        """A copy starts the task again and repeats the pieces that are done: a generator cannot be copied."""
        return Spread, (self.task, self.done)

    def advance(self, *owner: Any) -> Any:
        """Do the next piece of `task.run(*owner)`: the result after the last one, None before. The owner is what the
        task needs and a state does not hold."""
        if self._pieces is None:
            self._pieces = self.task.run(*owner)
            for _ in range(self.done):
                next(self._pieces)
        self.done += 1
        try:
            next(self._pieces)
        except StopIteration as end:
            return end.value
        return None
