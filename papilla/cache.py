"""A cache of named arrays on disk, by content key: locked, written atomically, checked on reading.

It lies in the user's cache folder, or where the environment variable `PAPILLA_CACHE` says. Meshes, reduced fingers and
pictures are kept in it.
"""

import hashlib
import io
import os
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from filelock import FileLock
from platformdirs import user_cache_dir

from papilla.errors import FileAccessError
from papilla.files import replacing

ENVIRONMENT = "PAPILLA_CACHE"
_HEADER = 65
"""An entry starts with the SHA-256 of the rest in hexadecimal and a line feed."""

Arrays = Mapping[str, np.ndarray]


def folder() -> Path:
    """The cache's folder (it need not exist)."""
    chosen = os.environ.get(ENVIRONMENT)
    return Path(chosen) if chosen else Path(user_cache_dir("papilla", appauthor=False))


def digest(*parts: object) -> str:
    """A key from the `repr` of values that a result depends on (numbers, strings, tuples of these)."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()


def entry(kind: str, key: str) -> Path:
    """The file of an entry (it need not exist)."""
    return folder() / kind / f"{key}.entry"


def fetch(kind: str, key: str, make: Callable[[], Arrays]) -> dict[str, np.ndarray]:
    """The arrays of entry `key` of `kind`; made by `make()`, and kept, where there are none.

    A second process that wants the same entry waits for the first. A damaged entry is reported by a warning and made
    again. Raises `FileAccessError` where the cache cannot be used (not writable, disk full) and whatever `make` raises;
    nothing is kept then. Arrays of Python objects are refused by NumPy (no pickle).
    """
    path = entry(kind, key)
    try:
        found = _read(path)
        if found is not None:
            return found
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = FileLock(f"{path}.lock")
        lock.acquire()
    except OSError as error:
        raise _unusable(path, error) from error
    try:
        found = _read_after_waiting(path)
        if found is None:
            found = {name: np.asarray(array) for name, array in make().items()}
            _write(path, found)
        return found
    finally:
        lock.release()


def _read_after_waiting(path: Path) -> dict[str, np.ndarray] | None:
    try:
        return _read(path, report=True)
    except OSError as error:
        raise _unusable(path, error) from error


def _read(path: Path, report: bool = False) -> dict[str, np.ndarray] | None:
    """The arrays of an entry, None where it is missing or damaged; `report` warns of the latter."""
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        return None
    stated, body = content[: _HEADER - 1], content[_HEADER:]
    if hashlib.sha256(body).hexdigest().encode() != stated:
        if report:
            warnings.warn(f"cache entry {path} is damaged; making it again", RuntimeWarning, stacklevel=4)
        return None
    with np.load(io.BytesIO(body), allow_pickle=False) as data:
        return {name: data[name] for name in data.files}


def _write(path: Path, arrays: Arrays) -> None:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    body = buffer.getvalue()
    try:
        with replacing(path) as temporary:
            temporary.write_bytes(hashlib.sha256(body).hexdigest().encode() + b"\n" + body)
    except OSError as error:
        raise _unusable(path, error.__cause__ or error) from error


def _unusable(path: Path, error: BaseException) -> FileAccessError:
    reason = getattr(error, "strerror", None) or error
    return FileAccessError(
        f"cannot use the cache folder {path.parent} ({reason}): make room there, or set {ENVIRONMENT} to another folder"
    )
