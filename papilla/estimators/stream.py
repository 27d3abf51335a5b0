"""What every streaming estimator is: `update` one sample, `process` a block, `reset`, and a `state` to keep or set; and
long computations that are spread over many samples, so that none of them waits long.

A long computation is a generator that yields after each piece of work. A generator cannot be copied or pickled, but a
state must be: `SpreadTask` remembers how many pieces are done, and a copy does them again when it goes on.
"""

import copy
import math
from abc import ABC, abstractmethod
from collections.abc import Generator
from functools import partial
from typing import Any, ClassVar, TypeVar

import numpy as np

from papilla.core.checks import LARGEST_READING, believable
from papilla.core.errors import InputError

INTEGER_FIELDS = ("status", "gauges", "left_out", "channels")
"""Which values of an estimate are whole numbers."""

Result = TypeVar("Result")
Pieces = Generator[None, None, Result]
"""A computation in pieces of less than a tenth of a millisecond each, which returns its result at the end."""


class Stream(ABC):
    """Base of estimators that remember one object, `_memory`; they define `columns`, `answer`, `_fresh` and `_take`.

    columns : names of the values of a sample, of which the last `optional` may be left out. answer : the NamedTuple of
    an estimate; all but `INTEGER_FIELDS` and `texts`, which are words, are floats. What no sensor gives comes to
    `_take` as NaN."""

    columns: tuple[str, ...]
    optional: ClassVar[int] = 0
    texts: ClassVar[tuple[str, ...]] = ()
    answer: ClassVar[Any]
    _memory: Any
    _arguments: tuple[tuple, dict[str, Any]]

    def __new__(cls, *arguments: Any, **options: Any):
        """Keep the arguments, for copies."""
        stream = super().__new__(cls)
        stream._arguments = arguments, options
        return stream

    def __reduce__(self) -> tuple:
        """A copy or pickle has the arguments and the state: it computes all else from the arguments again, and goes on
        bit for bit."""
        arguments, options = self._arguments
        return partial(type(self), *arguments, **options), (), self.state

    def __setstate__(self, state: Any) -> None:
        self.state = state

    @abstractmethod
    def _fresh(self) -> Any:
        """The memory before the first sample."""

    @abstractmethod
    def _take(self, sample: tuple[float, ...]) -> tuple:
        """The estimate after one more sample."""

    def reset(self) -> None:
        """Forget everything."""
        self._remember(self._fresh())

    def _remember(self, memory) -> None:
        self._memory = memory

    @property
    def state(self) -> Any:
        """All that is remembered, to be kept or to be set again."""
        return copy.deepcopy(self._memory)

    @state.setter
    def state(self, state) -> None:
        self._remember(copy.deepcopy(state))

    def update(self, sample):
        """The estimate after one more sample, in the order of `columns`; a number is a sample of one value.

        Raises `InputError` for another length.
        """
        sample = sample if hasattr(sample, "__len__") else (sample,)
        if not len(self.columns) - self.optional <= len(sample) <= len(self.columns):
            raise InputError(f"a sample must be {self._sample()}, got {len(sample)} values")
        return self._take(tuple([value if abs(value) <= LARGEST_READING else math.nan for value in map(float, sample)]))

    def process(self, block):
        """Estimates after each row of a block (n, columns), or (n,) of single values, as arrays (n,); bit for bit
        what `update` gives.

        Raises `InputError` for a block of another shape.
        """
        rows = believable(np.asarray(block, float))
        rows = rows[:, None] if rows.ndim == 1 else rows
        widths = range(len(self.columns) - self.optional, len(self.columns) + 1)
        if rows.ndim != 2 or rows.shape[1] not in widths:
            shape = " x ".join(map(str, rows.shape))
            raise InputError(f"a block must be n x {' or '.join(map(str, widths))} ({self._sample()}), got {shape}")
        answers = [self._take(tuple(sample)) for sample in rows.tolist()]
        names = self.answer._fields
        columns = zip(names, zip(*answers, strict=True) if answers else [()] * len(names), strict=True)
        return self.answer._make(
            list(column) if name in self.texts else np.array(column, int if name in INTEGER_FIELDS else float)
            for name, column in columns
        )

    def _sample(self) -> str:
        """What a sample is, in words."""
        needed = len(self.columns) - self.optional
        return ", ".join(self.columns[:needed]) + "".join(f"[, {name}]" for name in self.columns[needed:])


def completed(pieces: Pieces[Result]) -> Result:
    """The result of a computation, all pieces at once."""
    while True:
        try:
            next(pieces)
        except StopIteration as end:
            return end.value


class SpreadTask:
    """A computation under way. task : an object whose `run` returns its `Pieces`, and that does not change meanwhile;
    done : pieces that are done."""

    def __init__(self, task: Any, done: int = 0):
        self.task, self.done = task, done
        self._pieces: Pieces | None = None

    def __reduce__(self):
        """A copy starts the task again and repeats the pieces that are done: a generator cannot be copied."""
        return SpreadTask, (self.task, self.done)

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
