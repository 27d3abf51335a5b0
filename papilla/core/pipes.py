"""Lines of text, none of which is too long: of files, and of standard input, where they come one by one and the first
can be read again."""

import codecs
import io
import os
import select
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from papilla.core.errors import FileFormatError

PIPE_NAME = Path("-")
"""The name of standard input, or output, where a file is expected."""

PIPE_CHUNK_BYTES = 2**16
LONGEST_TABLE_LINE = 2**18
"""Most bytes of a line of a table: 1000 columns of 260 characters. A file without line ends is no table."""


def _too_long(path: Path, line: int) -> FileFormatError:
    return FileFormatError(f"{path}, line {line}: longer than {LONGEST_TABLE_LINE} bytes; this is no table")


class ShortLines(io.BufferedIOBase):
    """The bytes of a file, for a decoder of text; raises `FileFormatError` at a line of more than
    `LONGEST_TABLE_LINE`."""

    def __init__(self, source: IO[bytes], path: Path):
        self._source, self._path = source, path
        self._lines, self._length = 0, 0

    def readable(self) -> bool:
        """Yes."""
        return True

    def seekable(self) -> bool:
        """Yes."""
        return True

    def seek(self, place: int, whence: int = 0) -> int:
        """Go to a place, at which a line is taken to begin."""
        self._lines = self._length = 0
        return self._source.seek(place, whence)

    def tell(self) -> int:
        """The place in the file."""
        return self._source.tell()

    def read1(self, size: int = PIPE_CHUNK_BYTES) -> bytes:
        """The next bytes, `size` of them or less."""
        content = self._source.read(size)
        last_end = max(content.rfind(b"\n"), content.rfind(b"\r"))
        self._length = self._length + len(content) if last_end < 0 else len(content) - last_end - 1
        self._lines += content.count(b"\n")
        if self._length > LONGEST_TABLE_LINE:
            raise _too_long(self._path, self._lines + 1)
        return content

    def read(self, size: int | None = PIPE_CHUNK_BYTES) -> bytes:
        """The next bytes, `size` of them or less, and never more than `PIPE_CHUNK_BYTES`."""
        return self.read1(min(size or PIPE_CHUNK_BYTES, PIPE_CHUNK_BYTES))

    def line_without_text(self) -> int:
        """Number of the first line that is not UTF-8; of the last one if all are."""
        self.seek(0)
        decoder, line = codecs.getincrementaldecoder("utf-8")(), 1
        try:
            while content := self.read1():
                decoder.decode(content)
                line += content.count(b"\n")
            decoder.decode(b"", final=True)
        except UnicodeDecodeError as error:
            line += error.object[: error.start].count(b"\n")
        return line

    def close(self) -> None:
        """Close the file."""
        self._source.close()
        super().close()


class LiveText:
    """Lines of a pipe as they come; until `once` is called, `seek(0)` begins again.

    Raises `FileFormatError` for a line of more than `LONGEST_TABLE_LINE`.
    """

    def __init__(self, descriptor: int | None = None):
        self._descriptor = sys.stdin.fileno() if descriptor is None else descriptor
        self._decoder = codecs.getincrementaldecoder("utf-8-sig")()
        self._rest, self._ended = "", False
        self._ready: list[str] = []
        self._kept: list[str] | None = []
        self._next, self._lines = 0, 0

    def once(self) -> None:
        """Begin again with the first line. From then on lines are no longer kept, so this is the last new beginning."""
        self._ready = (self._kept or []) + self._ready
        self._kept = None

    def seek(self, place: int) -> None:
        """Begin again with the first line, while lines are kept; `place` must be 0."""
        assert place == 0
        if self._kept is not None:
            self._next = 0

    def readline(self) -> str:
        """The next line, "" at the end; waits for it."""
        if self._kept is not None and self._next < len(self._kept):
            self._next += 1
            return self._kept[self._next - 1]
        while not self._ready and not self._ended:
            self._read()
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

    def _read(self) -> None:
        data = os.read(self._descriptor, PIPE_CHUNK_BYTES)
        text = self._rest + self._decoder.decode(data, not data)
        *lines, self._rest = text.split("\n")
        self._ready += [line + "\n" for line in lines]
        self._lines += len(lines)
        if len(self._rest) > LONGEST_TABLE_LINE:
            raise _too_long(PIPE_NAME, self._lines + 1)
        if not data:
            self._ended = True
            if self._rest:
                self._ready.append(self._rest)
                self._rest = ""
