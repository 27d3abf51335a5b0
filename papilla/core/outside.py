"""What comes from outside papilla passes through this module: files, stores, sockets, messages, arrays of workers.

The rule has four parts, and docs/trust.md lists it source by source:

* an owner: a store or cache from which results are used belongs to the user, and nobody else can write to it;
* a type: content is decoded into plain values, never into code (no pickle, no `eval`), by a decoder that is named here;
* an upper bound: of the size in bytes before reading, of nesting and of numbers while decoding;
* a check: every fault becomes one line that names the source, as a `FileAccessError` or a `FileFormatError`.

Nothing listens except `datagram_socket`: at a loopback address, or with a key at an address that the user names. The
test `tests/test_readers_and_writers.py` finds every reader and listener of the package in its syntax trees, and fails
for one that stands elsewhere. What papilla writes goes through `papilla.core.files`, whose test is the same.
"""

import os
import stat
import sys
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, TypeVar

from papilla.core.errors import FileAccessError, FileFormatError, InputError, NotOwnError

if TYPE_CHECKING:
    import socket
    import sqlite3

    import numpy as np

BYTES_PER_MIB = 2**20

DESIGN_BYTES = 4 * BYTES_PER_MIB
"""Most bytes of a file that a person writes (TOML): the largest of the examples has 8 kB."""
KEY_BYTES = 4096
"""Most bytes of a file with a key: 32 random bytes have 64 hexadecimal digits."""
DOCUMENT_BYTES = 256 * BYTES_PER_MIB
"""Most bytes of a document that papilla writes (JSON): a calibration has 0.3 MB."""
BINARY_BYTES = 4096 * BYTES_PER_MIB
"""Most bytes of a binary file, packed or unpacked: a surface of 40 million triangles, a thousand reduced fingers."""
LOG_BYTES = 2**40
"""Most bytes of a log of which only wanted columns are read (Parquet, bags): a bag of a day of cameras has 1e12."""
PACKED_TIMES = 700
"""Most bytes that a packed byte of a log may become: a log that repeats one row has 500, a bomb of zeros 1030."""
PRINTED_PATH_LETTERS = 400
"""Most letters of a path that are printed."""
NUMBER_DIGITS = 400
"""Most digits of a whole number (JSON, TOML): the largest float has 309; time grows with the square of their number."""

Kind = TypeVar("Kind")


def read_bytes(path: str | PathLike, what: str = "", most_bytes: int = DOCUMENT_BYTES) -> bytes:
    """The content of a file; `what` names the kind of file in messages.

    Raises `FileAccessError` if it cannot be read, `FileFormatError` if it has more than `most_bytes`.
    """
    return _content(path, what, most_bytes)


def own_bytes(path: str | PathLike, what: str = "", most_bytes: int = BINARY_BYTES, *, private: bool = False) -> bytes:
    """As `read_bytes`, of a file that belongs to the user and that nobody else can write to; raises `NotOwnError`, too.

    private : refuse a file that others can read, too. The opened file is checked: its name may stand for another file
    by now.
    """

    def check(status: os.stat_result) -> None:
        check_own(Path(path), status)
        if private and hasattr(os, "geteuid") and status.st_mode & (stat.S_IRGRP | stat.S_IROTH):
            raise NotOwnError(f"others can read {path}")

    return _content(path, what, most_bytes, check)


def _content(
    path: str | PathLike, what: str, most_bytes: int, check: Callable[[os.stat_result], None] | None = None
) -> bytes:
    content = bytearray()
    try:
        with open(path, "rb") as file:
            if check is not None:
                check(os.fstat(file.fileno()))
            # In pieces, because `read` takes as much memory as it is allowed to read
            while len(content) <= most_bytes and (
                piece := file.read(min(BYTES_PER_MIB, most_bytes + 1 - len(content)))
            ):
                content += piece
    except NotOwnError:
        raise
    except (OSError, ValueError) as error:
        raise FileAccessError(f"cannot read {what}{' ' * bool(what)}{shown(path)}: {reason(error)}") from error
    if len(content) > most_bytes:
        raise FileFormatError(f"{shown(path)} has more than {most_bytes} bytes, too many for {what or 'such a file'}")
    return bytes(content)


def read_text(path: str | PathLike, what: str = "", most_bytes: int = DOCUMENT_BYTES) -> str:
    """The text of a file in UTF-8, with "\\n" at the ends of lines; raises as `read_bytes` does, and `FileFormatError`
    if it is not UTF-8."""
    try:
        return read_bytes(path, what, most_bytes).decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{path} is not a text file in UTF-8") from error


def read_toml(path: str | PathLike, what: str = "") -> dict[str, Any]:
    """The tables of a TOML file of at most `DESIGN_BYTES`; raises as `read_text` does, and `FileFormatError` if it is
    not TOML."""
    return toml(read_text(path, what, DESIGN_BYTES), str(path))


def toml(text: str, name: str) -> dict[str, Any]:
    """The tables of a text in TOML; raises `FileFormatError`, which calls it `name`."""
    import tomllib

    try:
        tables = tomllib.loads(text)
        _check_whole_numbers(tables)
        return tables
    except RecursionError as error:
        raise FileFormatError(f"{name} is not valid TOML: its brackets are nested too deeply") from error
    except ValueError as error:  # TOMLDecodeError is one; so is an integer of thousands of digits
        raise FileFormatError(f"{name} is not valid TOML: {error}") from error


def _check_whole_numbers(value: Any) -> None:
    """Raise `InputError` for an integer of more than `NUMBER_DIGITS`, which can be written in hexadecimal digits."""
    if isinstance(value, dict | list):
        for item in value.values() if isinstance(value, dict) else value:
            _check_whole_numbers(item)
    elif isinstance(value, int) and value.bit_length() > 4 * NUMBER_DIGITS:
        raise InputError("a whole number is too long")


def read_json(path: str | PathLike, what: str = "", most_bytes: int = DOCUMENT_BYTES) -> Any:
    """The value of a JSON file; raises as `read_text` and `json_value` do."""
    return json_value(read_text(path, what, most_bytes), str(path), what)


def json_value(text: str | bytes, name: str, what: str = "", *, finite: bool = True) -> Any:
    """The value of a text in JSON; raises `FileFormatError`, which calls it `name`.

    finite : refuse NaN and Infinity, which JSON does not have, but which papilla writes in some files.
    """
    import json

    try:
        value = json.loads(text, parse_float=_real, parse_int=_whole, parse_constant=_no_number if finite else float)
        if "\\ud" in (text if isinstance(text, str) else text.decode(errors="replace")).lower():
            json.dumps(value, ensure_ascii=False).encode()  # Half a letter, which no file can hold, is a ValueError
        return value
    except (ValueError, RecursionError) as error:
        expected = f"is not a {what}, or was cut short" if what else "was cut short or is damaged"
        raise FileFormatError(f"{name} {expected}: not valid JSON ({error})") from error


def _real(digits: str) -> float:
    value = float(digits)
    if value in (float("inf"), float("-inf")):
        raise InputError(f"{digits[:40]} is too large for a number")
    return value


def _whole(digits: str) -> int:
    if len(digits) > NUMBER_DIGITS:
        raise InputError(f"{digits[:40]}... is too long for a number")
    return int(digits)


def _no_number(name: str) -> float:
    raise InputError(f"{name} is no number of JSON")


def shipped(package: str, *names: str) -> str:
    """The text of a file that comes with papilla: `names` are its folders and its name in a package."""
    from importlib.resources import files

    return files(package).joinpath(*names).read_text(encoding="utf-8")


def binary_stream(path: str | PathLike) -> IO[bytes]:
    """A file or pipe, open for reading; who reads it bounds each piece. Raises `FileAccessError`."""
    try:
        return open(path, "rb")
    except (OSError, ValueError) as error:
        raise FileAccessError(f"cannot read {shown(path)}: {reason(error)}") from error


def checked_file(path: Path, most_bytes: int = LOG_BYTES) -> Path:
    """The path of a regular file of at most `most_bytes`, for a library that opens files itself.

    Raises `FileAccessError` if it is missing, unreadable or no regular file, `FileFormatError` if it is larger.
    """
    try:
        status = os.stat(path)
    except (OSError, ValueError) as error:
        raise FileAccessError(f"cannot read {shown(path)}: {reason(error)}") from error
    if not stat.S_ISREG(status.st_mode):
        raise FileAccessError(f"cannot read {shown(path)}: it is not a regular file")
    if status.st_size > most_bytes:
        raise FileFormatError(f"{shown(path)} has {status.st_size} bytes; at most {most_bytes} are read")
    binary_stream(path).close()
    return path


def repeatable_stream(path: Path) -> IO[bytes]:
    """A file, pipe or gzip file (.gz), open for reading as often as needed; what cannot be read twice is copied.

    Raises `FileAccessError`, and `FileFormatError` for a gzip file that grows by more than `PACKED_TIMES`.
    """
    import gzip
    import zlib

    stream: Any = binary_stream(path)
    packed = path.suffix == ".gz"
    if not packed and stream.seekable():
        return stream
    try:
        with stream, gzip.open(stream) if packed else stream as once:
            return _copied(
                once,
                path,
                max(64 * BYTES_PER_MIB, PACKED_TIMES * os.fstat(stream.fileno()).st_size) if packed else None,
            )
    except (EOFError, zlib.error) as error:
        raise FileAccessError(f"cannot read {path}: not a whole gzip file ({error})") from error
    except OSError as error:
        raise FileAccessError(f"cannot read {path}: {reason(error)}") from error


def _copied(source: Any, path: Path, most_bytes: int | None) -> IO[bytes]:
    """A temporary file with the content of a stream."""
    import tempfile

    target, size = tempfile.TemporaryFile(), 0  # noqa: SIM115 - the reader closes it
    try:
        while piece := source.read(BYTES_PER_MIB):
            size += len(piece)
            if most_bytes is not None and size > most_bytes:
                raise FileFormatError(f"{path} is no packed log: it unpacks to more than {PACKED_TIMES} times its size")
            target.write(piece)
    except BaseException:
        target.close()
        raise
    target.seek(0)
    return target


def read_arrays(
    source: str | PathLike | IO[bytes], name: str = "", most_bytes: int = BINARY_BYTES
) -> "dict[str, np.ndarray]":
    """The arrays of an .npz file, by name; `name` stands for the source in messages.

    The sizes of all members are added up before the first is unpacked, and arrays of Python objects (pickle) are
    refused. Raises `FileAccessError`; `FileFormatError` for a file that is no .npz file, or larger than `most_bytes`.
    """
    from zipfile import ZipFile

    import numpy as np

    name = name or shown(source)
    try:
        with ZipFile(source) as members:
            size = sum(member.file_size for member in members.infolist())
        if size > most_bytes:
            raise FileFormatError(f"{name} would take {size} bytes in memory; at most {most_bytes} are read")
        if hasattr(source, "seek"):
            source.seek(0)
        with np.load(source, allow_pickle=False) as arrays:
            loaded = {key: arrays[key] for key in arrays.files}
        # NumPy returns the bytes of a member that is no array
        if strange := next((key for key, array in loaded.items() if not isinstance(array, np.ndarray)), None):
            raise FileFormatError(f"{name} is no file of arrays that papilla wrote: {strange!r} is no array")
        for array in loaded.values():
            # A text holds code points, which NumPy does not check
            if array.dtype.kind == "U" and array.size and array.reshape(-1).view(np.uint32).max() > sys.maxunicode:
                raise InputError("a text has a letter that is none")
        return loaded
    except FileFormatError:
        raise
    except OSError as error:
        raise FileAccessError(f"cannot read {name}: {reason(error)}") from error
    except Exception as error:  # Of zip, zlib, and whatever Python raises at a header, which NumPy reads as Python
        cause = " ".join(str(error).split())[:200] or type(error).__name__
        raise FileFormatError(f"{name} is no file of arrays that papilla wrote, or is damaged ({cause})") from error


def message_decoder(
    target: type[Kind] | Any, most_bytes: int, dec_hook: Callable | None = None
) -> Callable[[bytes], Any]:
    """A function that decodes MessagePack of at most `most_bytes` into values of `kind`, whose type states bounds.

    It raises `msgspec.MsgspecError`, another ValueError or RecursionError for anything else.
    """
    import msgspec

    decode = msgspec.msgpack.Decoder(target, dec_hook=dec_hook).decode

    def bounded(data: bytes) -> Any:
        if len(data) > most_bytes:
            raise InputError(f"{len(data)} bytes where at most {most_bytes} are expected")
        return decode(data)

    return bounded


def check_own(path: Path, status: os.stat_result | None = None) -> None:
    """Raise `NotOwnError` if another user owns a place, or what it is a link to, or can write to it. A missing place
    passes.

    status : of the opened file, to check it instead of its name, which may stand for another file by now. Windows has
    no such permission bits, so nothing is checked there.
    """
    if not hasattr(os, "geteuid"):
        return
    if status is None:
        try:
            statuses = [path.lstat(), path.stat()]
        except FileNotFoundError:
            return
    else:
        statuses = [status]
    for place_status in statuses:
        if place_status.st_uid != os.geteuid():
            raise NotOwnError(f"{path} belongs to another user")
        if not stat.S_ISLNK(place_status.st_mode) and place_status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
            raise NotOwnError(f"others can write to {path}")


def own_database(path: Path, patience_s: float) -> "sqlite3.Connection":
    """A connection to an SQLite file that belongs to the user alone; a new one is made for this user alone.

    patience_s : time that a transaction waits for one of another client. Raises `NotOwnError`, `OSError` if the file
    cannot be made, and `sqlite3.Error`.
    """
    import sqlite3

    os.close(os.open(path, os.O_CREAT | os.O_RDWR, stat.S_IRUSR | stat.S_IWUSR))
    for ending in ("", "-wal", "-shm", "-journal"):  # SQLite takes over what an interrupted writer left beside the file
        check_own(path.with_name(path.name + ending))
    return sqlite3.connect(path, timeout=patience_s, isolation_level=None)


def read_key(path: Path) -> bytes:
    """A secret of at most `KEY_BYTES`, without white space at its ends, from a file that the user alone can read and
    write.

    Raises as `read_bytes` does, and `NotOwnError`. Windows has no such permission bits, so nothing is checked there.
    """
    with binary_stream(path) as file:
        status = os.fstat(file.fileno())
        if hasattr(os, "geteuid") and status.st_mode & (stat.S_IRWXG | stat.S_IRWXO):
            raise NotOwnError(f"others can read or write {path}, so it is no key: make a new one, with chmod 600")
        check_own(path, status)
        content = file.read(KEY_BYTES + 1)
    if len(content) > KEY_BYTES:
        raise FileFormatError(f"{path} has more than {KEY_BYTES} bytes, too many for a key")
    return content.strip()


def is_this_machine(address: tuple) -> bool:
    """Whether no other machine reaches an address (numeric host, port, ...)."""
    from ipaddress import ip_address

    return ip_address(str(address[0]).partition("%")[0]).is_loopback


def datagram_socket(family: int, address: tuple, keyed: bool) -> "socket.socket":
    """A UDP socket that listens at an address (numeric host, port, ...), without blocking.

    keyed : whether a key proves who sends. Raises `InputError` for an address off this machine without a key, `OSError`
    if the address cannot be used.
    """
    import socket

    if not keyed and not is_this_machine(address):
        raise InputError(
            f"listening at {address[0]}, which other machines reach, needs a key (--key-file): without one, anybody "
            "there can send messages; 127.0.0.1 needs none"
        )
    listener = socket.socket(family, socket.SOCK_DGRAM)
    try:
        listener.bind(address)
    except OSError:
        listener.close()
        raise
    listener.setblocking(False)
    return listener


def shown(path: object) -> str:
    """A path as it is printed: in one line, the middle of a long one left out."""
    text = "".join(sign if sign.isprintable() else sign.encode("unicode_escape").decode() for sign in str(path))
    text = text.replace("\\x00", "\\0")
    return (
        text
        if len(text) <= PRINTED_PATH_LETTERS
        else f"{text[: PRINTED_PATH_LETTERS // 2]}...{text[-PRINTED_PATH_LETTERS // 2 :]}"
    )


def reason(error: BaseException) -> str:
    """Why a file could not be used, as the operating system says it."""
    return str(getattr(error, "strerror", None) or error)
