"""Methods of two steps: a source makes impulses of the readings, a reader makes a frequency of the impulses."""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from papilla.estimators.published.roughness.answer import Finding
from papilla.estimators.published.roughness.stream import RoughnessStream


class Source(Protocol):
    """Makes impulses: `fire` of one reading, `fire_all` of many, bit for bit alike."""

    state: Any

    def fire(self, reading: float) -> tuple[int, bool]:
        """The impulse of a reading (0: none), and whether there could be one."""

    def fire_all(self, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same of readings (n,)."""


class Reader(Protocol):
    """Makes a frequency of impulses: `find` after one sample, `find_all` after each of many, bit for bit alike."""

    state: Any

    def find(self, impulse: int, could: bool, speed: float) -> Finding:
        """What is found after a sample: its impulse, whether it could have one, |velocity|."""

    def find_all(self, impulses: np.ndarray, could: np.ndarray, speeds: np.ndarray) -> Finding:
        """The same after each of n samples."""


@dataclass(frozen=True)
class ImpulseMemory:
    """What source and reader remember of the last window."""

    source: Any
    reader: Any


class ImpulseStream(RoughnessStream):
    """Base of the estimators that count or time impulses; they say which source and which reader."""

    @abstractmethod
    def _steps(self) -> tuple[Source, Reader]:
        """A new source and a new reader."""

    def _forget(self) -> None:
        self._source, self._reader = self._steps()

    @property
    def _memory(self) -> ImpulseMemory:
        return ImpulseMemory(self._source.state, self._reader.state)

    @_memory.setter
    def _memory(self, memory: ImpulseMemory) -> None:
        self._source.state, self._reader.state = memory.source, memory.reader

    def _find(self, reading: float, speed: float) -> Finding:
        impulse, could = self._source.fire(reading)
        return self._reader.find(impulse, could, speed)

    def _find_all(self, readings: np.ndarray, speeds: np.ndarray) -> Finding:
        impulses, could = self._source.fire_all(readings)
        return self._reader.find_all(impulses, could, speeds)
