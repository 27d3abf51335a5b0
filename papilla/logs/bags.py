"""ROS 1 and 2 bags and MCAP files as tables: a column for each number of a topic's messages, called `/topic:field`.

Topics have their own rates. The rows of the table are the messages of the topic with the most of them; of every other
topic a row has the latest value before it, NaN before the first. `t_s` is the time at which a message was recorded,
from the beginning of the bag; a stamp in a message (`/topic:header.stamp`) counts from there, too.
"""

import bz2
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from papilla.core.errors import FileAccessError, FileFormatError, InputError, PapillaError
from papilla.core.memory import refuse_beyond
from papilla.core.outside import BYTES_PER_MIB, DESIGN_BYTES, checked_file, reason
from papilla.core.rows import BLOCK_ROWS, Table
from papilla.core.units import NS_PER_S, S_PER_NS
from papilla.logs.frames import FrameReader
from papilla.logs.parquet import MOST_ELEMENTS, MOST_FIELDS

NUMBER_BYTES = 100
"""Memory of a number while a bag is read: a Python object in a list, and its places in two arrays."""
MOST_TOPICS, DEFINITION_CHARACTERS = 2000, 2**18
"""Largest number of topics of a bag, and of characters of the definition of a type: large ones have some thousand."""
MOST_MEMBERS = 4096
"""Largest number of members in fixed arrays of texts or messages: the decoder has a line of code for each."""
CHUNK_BYTES = 256 * BYTES_PER_MIB
"""Most bytes of an unpacked chunk of a bag: recorders write chunks of 1 to 100 MiB."""


class BagReader(FrameReader):
    """Reads topics of a bag; raises `InputError` without the extra `robotics`."""

    def __init__(self, path: Path, wanted: Callable[[str], bool]):
        self.unusable: dict[str, str] = {}
        self._fields: dict[str, tuple[str, str]] = {}
        with _opened(path) as bag:
            self._counts = {topic: info.msgcount for topic, info in bag.topics.items()}
            kinds = [f"{topic} ({str(info.msgtype).replace('/msg/', '/')})" for topic, info in bag.topics.items()]
            for topic, info in bag.topics.items():
                for connection, _, raw in islice(bag.messages(info.connections), 1 if info.msgcount else 0):
                    try:
                        fields = [*islice(_fields(_decoded(bag, connection, raw, path), ""), MOST_FIELDS)]
                    except FileFormatError as fault:
                        self.unusable[topic] = str(fault)
                        continue
                    self._fields |= {f"{topic}:{field}": (topic, field) for field in fields}
        if len(self._fields) > MOST_FIELDS:
            raise FileFormatError(f"{path} has more than {MOST_FIELDS} numbers in its messages")
        if not self._fields:
            why = next(iter(self.unusable.values()), f"{path}: no numbers in these topics: {', '.join(kinds)}")
            raise FileFormatError(why if kinds else f"{path} has no topics")
        self._loaded: dict[str, np.ndarray] = {}
        self.rows = max(self._counts.values())
        super().__init__(dict.fromkeys(["t_s", *self._fields]), wanted, path=path)

    @property
    def _topics(self) -> list[str]:
        """The wanted topics, the one with the most messages first."""
        topics = dict.fromkeys(self._fields[name][0] for name in self.names if name in self._fields)
        return sorted(topics, key=lambda topic: -self._counts[topic])

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks for the user, a sentence each; other columns of the messages are not listed."""
        leading, latest = self._topics[:1], ", ".join(self._topics[1:])
        rows = (*(f"rows are the messages of {topic}" for topic in leading),)
        rows += (f"of {latest} each row has the latest value",) if latest else ()
        return (*rows, *self.unusable.values())

    def blocks(self, size: int = BLOCK_ROWS) -> Iterator[Table]:
        """All rows; raises what `FrameReader.blocks` raises, and `MemoryEstimateError` for more than memory holds."""
        if {*self._loaded} != {*self.names}:
            self._loaded = self._frame = self._load()
        yield from super().blocks(size)

    def _load(self) -> dict[str, np.ndarray]:
        """The wanted columns of the leading topic's messages."""
        by_topic: dict[str, list[str]] = {}
        for name in self.names:
            if name in self._fields:
                by_topic.setdefault(self._fields[name][0], []).append(name)
        numbers = sum(self._counts[topic] * (1 + len(names)) for topic, names in by_topic.items())
        job = f"reading {numbers} numbers of {self.path}"
        refuse_beyond(NUMBER_BYTES * numbers, job, lambda free: "name fewer fields in a map")
        getters = {topic: [_getter(self._fields[name][1]) for name in names] for topic, names in by_topic.items()}
        times: dict[str, list[int]] = {topic: [] for topic in by_topic}
        rows: dict[str, list[list[float]]] = {topic: [] for topic in by_topic}
        with _opened(self.path) as bag:
            start = bag.start_time
            connections = [c for c in bag.connections if c.topic in by_topic]
            for connection, time, raw in bag.messages(connections) if connections else ():
                topic = connection.topic
                if len(times[topic]) == self._counts[topic]:
                    raise FileFormatError(f"{self.path} has more messages of {topic} than its index says")
                message = _decoded(bag, connection, raw, self.path)
                times[topic].append(time - start)
                rows[topic].append([get(message, start) for get in getters[topic]])
            lead = np.array(times[self._topics[0]] if by_topic else [], float)
            columns = {"t_s": S_PER_NS * lead} if "t_s" in self.names else {}
            for topic, names in by_topic.items():
                latest = np.searchsorted(np.array(times[topic], float), lead, side="right")
                table = np.vstack([np.full(len(names), np.nan), np.reshape(rows[topic], (-1, len(names)))])[latest]
                columns |= dict(zip(names, table.T, strict=True))
        return columns


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """An open `AnyReader` of rosbags; what it raises becomes an error of this file.

    rosbags writes a program for each type of message from its definition in the bag, and runs it: the definitions are
    checked before. Names and sizes are all that it takes from them, which its parsers restrict to letters and digits.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(f"{path}: bags need rosbags: pip install papilla[robotics]") from None
    if path.is_dir():
        checked_file(path / "metadata.yaml", DESIGN_BYTES)
    for file in path.iterdir() if path.is_dir() else [path]:
        checked_file(file)
    try:
        bag = AnyReader([path], default_typestore=get_typestore(Stores.LATEST))
        for reader in bag.readers:
            with reader:
                _check_definitions(path, reader.connections)
        with bag:
            for reader in bag.readers:
                _bound_chunks(getattr(reader, "chunks", {}))
            yield bag
    except InputError as error:
        raise error if isinstance(error, FileFormatError) else FileFormatError(f"{path}: {error}") from error
    except PapillaError:
        raise
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {reason(error)}") from error
    except Exception as error:  # noqa: BLE001 - the reader of a broken bag raises whatever its parts do
        raise FileFormatError(f"{path} is no bag that rosbags can read ({_said(error)})") from error


def _check_definitions(path: Path, connections: list[Any]) -> None:
    """Raise `FileFormatError` for a topic whose definition is none, or would keep the decoder busy for hours."""
    from rosbags.interfaces import MessageDefinitionFormat, Nodetype
    from rosbags.typesys import get_types_from_idl, get_types_from_msg

    if len(connections) > MOST_TOPICS:
        raise FileFormatError(f"{path} has {len(connections)} topics; at most {MOST_TOPICS} are read")
    checked = set()
    for connection in connections:
        language, text = connection.msgdef.format, connection.msgdef.data
        if (connection.msgtype, text) in checked or language == MessageDefinitionFormat.NONE:
            continue
        checked.add((connection.msgtype, text))
        try:
            if len(text) > DEFINITION_CHARACTERS:
                raise InputError(f"its definition has {len(text)} characters; at most {DEFINITION_CHARACTERS} are read")
            if language == MessageDefinitionFormat.MSG:
                types = get_types_from_msg(text, connection.msgtype)
            else:
                _check_nesting(text)
                parts = re.split(r"^=+\nIDL: .*\n", text, flags=re.MULTILINE)
                types = {
                    name: definition
                    for section in parts
                    if section
                    for name, definition in get_types_from_idl(section).items()
                }
            fields = [field for _, members in types.values() for _, field in members]
            arrays = [field[1] for field in fields if field[0] == Nodetype.ARRAY]
            members = sum(size for inner, size in arrays if inner[0] != Nodetype.BASE or inner[1][0] == "string")
            if members > MOST_MEMBERS:
                raise InputError(f"{members} members of fixed arrays; at most {MOST_MEMBERS} are read")
        except Exception as error:  # noqa: BLE001 - the parser raises whatever its parts do
            raise _undecodable(connection.topic, path, error) from error


def _check_nesting(idl: str) -> None:
    """Raise `InputError` for brackets in brackets, on which the parser of IDL spends 64 times the time for each."""
    code = re.sub(r'"(?:[^"\\]|\\.)*"|//[^\n]*|/\*.*?\*/', "", idl, flags=re.DOTALL)
    if re.search(r"\([^()]*\(", code):
        raise InputError("its definition has brackets inside brackets")


def _bound_chunks(chunks: Any) -> None:
    """Let the packed chunks of a ROS 1 bag unpack to at most `CHUNK_BYTES`."""
    import lz4.frame

    bounded = {bz2.decompress: bz2.BZ2Decompressor, lz4.frame.decompress: lz4.frame.LZ4FrameDecompressor}
    for place, chunk in chunks.items() if isinstance(chunks, dict) else ():
        if chunk.decompressor in bounded:
            chunks[place] = chunk._replace(decompressor=partial(_unpacked, bounded[chunk.decompressor]))


def _unpacked(unpacker: Callable[[], Any], packed: bytes) -> bytes:
    content = unpacker().decompress(packed, max_length=CHUNK_BYTES + 1)
    if len(content) > CHUNK_BYTES:
        raise InputError(f"a chunk unpacks to more than {CHUNK_BYTES} bytes")
    return content


def _decoded(bag: Any, connection: Any, raw: bytes, path: Path) -> Any:
    """A message; raises `FileFormatError`, which names its topic."""
    try:
        return bag.deserialize(raw, connection.msgtype)
    except Exception as error:  # noqa: BLE001 - the decoder of a broken message raises whatever its parts do
        raise _undecodable(connection.topic, path, error) from error


def _undecodable(topic: str, path: Path, error: Exception) -> FileFormatError:
    return FileFormatError(f"cannot decode topic {topic} of {path}: {_said(error)}")


def _said(error: Exception) -> str:
    """What an error of rosbags says, with the name of one of Python's own, which says less."""
    named = type(error).__module__.startswith(("rosbags", "papilla"))
    return str(error)[:200] if named else f"{type(error).__name__} {error}"[:200].strip()


def _fields(value: Any, name: str) -> Iterator[str]:
    """Names of all numbers in a message: `wrench.force.z`, `data[0]`; a time is one number."""
    if isinstance(value, int | float | np.number) or hasattr(value, "nanosec"):
        yield name
    elif isinstance(value, np.ndarray | list | tuple):
        for number, element in enumerate(value[:MOST_ELEMENTS]):
            yield from _fields(element, f"{name}[{number}]")
    elif hasattr(value, "__dataclass_fields__"):
        for member in value.__dataclass_fields__:
            if not member.startswith("__"):
                yield from _fields(getattr(value, member), f"{name}.{member}".lstrip("."))


def _getter(name: str) -> Callable[[Any, int], float]:
    """A function that takes a number by its name from a message, NaN if it is missing; a time in s since a start in
    ns."""
    steps = [int(token) if token.isdigit() else token for token in re.findall(r"[^.\[\]]+", name)]

    def get(value: Any, start: int) -> float:
        try:
            for step in steps:
                value = value[step] if isinstance(step, int) else getattr(value, step)
        except (IndexError, AttributeError):
            return float("nan")
        return S_PER_NS * (value.sec * NS_PER_S + value.nanosec - start) if hasattr(value, "nanosec") else float(value)

    return get
