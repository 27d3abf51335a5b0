"""ROS 1 and 2 bags and MCAP files as tables: a column for each number of a topic's messages, called `/topic:field`.

Topics have their own rates. The rows of the table are the messages of the topic with the most of them; of every other
topic a row has the latest value before it, NaN before the first. `t_s` is the time at which a message was recorded,
from the beginning of the bag; a stamp in a message (`/topic:header.stamp`) counts from there, too.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from papilla.core.errors import FileAccessError, FileFormatError, InputError
from papilla.core.outside import reason
from papilla.core.tables import BLOCK, Table
from papilla.core.units import NS_PER_S, S_PER_NS
from papilla.logs.frames import FrameReader

MOST_CELLS = 64
"""Largest number of elements of an array in a message that become columns."""


class BagReader(FrameReader):
    """Reads topics of a bag; raises `InputError` without the extra `robotics`."""

    def __init__(self, path: Path, wanted: Callable[[str], bool]):
        with _opened(path) as bag:
            firsts: dict[str, Any] = {}
            for connection, _, raw in bag.messages():
                if connection.topic not in firsts:
                    firsts[connection.topic] = bag.deserialize(raw, connection.msgtype)
                if len(firsts) == len(bag.topics):
                    break
            self._counts = {topic: info.msgcount for topic, info in bag.topics.items()}
        names = [f"{topic}:{name}" for topic, message in firsts.items() for name in _fields(message, "")]
        self._loaded: dict[str, np.ndarray] = {}
        super().__init__(dict.fromkeys(["t_s", *names]), wanted, path=path)

    @property
    def _topics(self) -> list[str]:
        """The wanted topics, the one with the most messages first."""
        topics = dict.fromkeys(name.split(":")[0] for name in self.names if ":" in name)
        return sorted(topics, key=lambda topic: -self._counts[topic])

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks for the user, a sentence each; other columns of the messages are not listed."""
        leading, held = self._topics[:1], ", ".join(self._topics[1:])
        rows = (*(f"rows are the messages of {topic}" for topic in leading),)
        return (*rows, f"of {held} each row has the latest value") if held else rows

    def blocks(self, size: int = BLOCK) -> Iterator[Table]:
        """All rows; raises what `FrameReader.blocks` raises."""
        if {*self._loaded} != {*self.names}:
            self._loaded = self._frame = self._load()
        yield from super().blocks(size)

    def _load(self) -> dict[str, np.ndarray]:
        """The wanted columns of the leading topic's messages."""
        by_topic: dict[str, list[str]] = {}
        for name in self.names:
            if ":" in name:
                by_topic.setdefault(name.split(":")[0], []).append(name)
        getters = {topic: [_getter(name.split(":", 1)[1]) for name in names] for topic, names in by_topic.items()}
        times: dict[str, list[int]] = {topic: [] for topic in by_topic}
        rows: dict[str, list[list[float]]] = {topic: [] for topic in by_topic}
        with _opened(self.path) as bag:
            start = bag.start_time
            for connection, time, raw in bag.messages([c for c in bag.connections if c.topic in by_topic]):
                message = bag.deserialize(raw, connection.msgtype)
                times[connection.topic].append(time - start)
                rows[connection.topic].append([get(message, start) for get in getters[connection.topic]])
        lead = np.array(times[self._topics[0]] if by_topic else [], float)
        found = {"t_s": S_PER_NS * lead} if "t_s" in self.names else {}
        for topic, names in by_topic.items():
            latest = np.searchsorted(np.array(times[topic], float), lead, side="right")
            table = np.vstack([np.full(len(names), np.nan), np.reshape(rows[topic], (-1, len(names)))])[latest]
            found |= dict(zip(names, table.T, strict=True))
        return found


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """An open `AnyReader` of rosbags; what it raises becomes an error of this file."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(f"{path}: bags need rosbags: pip install papilla[robotics]") from None
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as bag:
            yield bag
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {reason(error)}") from error
    except FileFormatError:
        raise
    except Exception as error:  # noqa: BLE001 - the reader of a broken bag raises whatever its parts do
        raise FileFormatError(f"{path} is no bag that rosbags can read ({str(error)[:200]})") from error


def _fields(value: Any, name: str) -> Iterator[str]:
    """Names of all numbers in a message: `wrench.force.z`, `data[0]`; a time is one number."""
    if isinstance(value, int | float | np.number) or hasattr(value, "nanosec"):
        yield name
    elif isinstance(value, np.ndarray | list | tuple):
        for number, own in enumerate(value[:MOST_CELLS]):
            yield from _fields(own, f"{name}[{number}]")
    elif hasattr(value, "__dataclass_fields__"):
        for part in value.__dataclass_fields__:
            if not part.startswith("__"):
                yield from _fields(getattr(value, part), f"{name}.{part}".lstrip("."))


def _getter(name: str) -> Callable[[Any, int], float]:
    """A function that takes a number by its name from a message, NaN if it is missing; a time in s since a start in
    ns."""
    steps = [int(part) if part.isdigit() else part for part in re.findall(r"[^.\[\]]+", name)]

    def get(value: Any, start: int) -> float:
        try:
            for step in steps:
                value = value[step] if isinstance(step, int) else getattr(value, step)
        except (IndexError, AttributeError):
            return float("nan")
        return S_PER_NS * (value.sec * NS_PER_S + value.nanosec - start) if hasattr(value, "nanosec") else float(value)

    return get
