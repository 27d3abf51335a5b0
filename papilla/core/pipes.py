"""Standard input as lines of text that come one by one, the first of which can be read again."""

import codecs
import os
import select
import sys
from collections.abc import Iterator
from pathlib import Path

PIPE = Path("-")
"""The name of standard input, or output, where a file is expected."""

CHUNK = 2**16


class LiveText:
    """Lines of a pipe as they come; until `once` is called, `seek(0)` begins again."""

    def __init__(self, descriptor: int | None = None):
        self._descriptor = sys.stdin.fileno() if descriptor is None else descriptor
        self._decoder = codecs.getincrementaldecoder("utf-8-sig")()
        self._rest, self._ended = "", False
        self._ready: list[str] = []
        self._kept: list[str] | None = []
        self._next = 0

    def once(self) -> None:
        """Begin again with the first line. From then on lines are no longer kept, so this is the last new beginning."""
        self._ready = (self._kept or []) + self._ready
        self._kept = None

    def seek(self, place: int) -> None:
        """Begin again with the first line, while lines are kept; `place` must be 0."""
        assert place == 0
        if self._kept is not None:
            self._next = 0

    def readline(self, limit: int = -1) -> str:
        """The next line, "" at the end; waits for it. A line longer than `limit` comes in parts."""
        if self._kept is not None and self._next < len(self._kept):
            self._next += 1
            return self._kept[self._next - 1]
        while not self._ready and not self._ended:
            self._read(limit)
        line = self._ready.pop(0) if self._ready else ""
        if line and self._kept is not None:
            self._kept.append(line)
            self._next = len(self._kept)
        return line

    def pending(self) -> bool:
        """Whether a whole line is there without waiting."""
        if self._kept is not None and self._next < len(self._kept):
            return True
        if not self._ready and not self._ended and select.select([self._descriptor], [], [], 0)[0]:
            self._read()
        return bool(self._ready)

    def close(self) -> None:
        """Nothing: standard input stays open."""

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        if line := self.readline():
            return line
        raise StopIteration

    def _read(self, limit: int = -1) -> None:
        data = os.read(self._descriptor, CHUNK)
        text = self._rest + self._decoder.decode(data, not data)
        *lines, self._rest = text.split("\n")
        self._ready += [line + "\n" for line in lines]
        if 0 < limit <= len(self._rest):
            self._ready.append(self._rest[:limit])
            self._rest = self._rest[limit:]
        if not data:
            self._ended = True
            if self._rest:
                self._ready.append(self._rest)
                self._rest = ""
