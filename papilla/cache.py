"""A cache of named arrays on disk: keyed by the code and the values behind them, locked, atomic, checked on reading.

It lies in the user's cache folder, or where the environment variable `PAPILLA_CACHE` says. What cannot be kept there
(a full disk, no permission) is computed all the same, with one warning.
"""

import hashlib
import io
import os
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from filelock import FileLock, Timeout
from platformdirs import user_cache_dir

from papilla.errors import InputError
from papilla.files import reason, replacing

ENVIRONMENT = "PAPILLA_CACHE"

PATIENCE_S, GIVE_UP_S = 5.0, 1800.0
"""How long another process may hold an entry before this one says that it waits, and before it goes on by itself."""

PACKAGES = ("numpy", "scipy", "scikit-fem", "rslab", "pytetwild", "pyvista", "vtk", "matplotlib")
"""Other packages whose version a result depends on."""

_ROOT = Path(__file__).parent
_LAYERS = ("mesh", "fem", "view", "calibrate")
"""Packages whose results are kept, each of which imports those before it."""

_NOTHING_KEPT = ("estimators", "telepresence", "studies", "cli")

Arrays = Mapping[str, np.ndarray]


def key(maker: str, *values: object) -> str:
    """The key of a result that module `maker` (its `__name__`) makes from `values`: all that it depends on.

    The code counts with that of all modules of papilla that `maker` may import, those of its package and of the layers
    below, and with the versions of `PACKAGES`. Values are numbers, text, bytes, arrays, None, dataclasses, and tuples,
    lists and dicts of these; raises `InputError` for others.
    """
    return hashlib.sha256(repr((_code(maker), [_content(value) for value in values])).encode()).hexdigest()


def folder() -> Path:
    """The cache's folder (it need not exist)."""
    chosen = os.environ.get(ENVIRONMENT)
    return Path(chosen) if chosen else Path(user_cache_dir("papilla", appauthor=False))


def entry(kind: str, key: str) -> Path:
    """The file of an entry (it need not exist)."""
    return folder() / kind / f"{key}.entry"


def fetch(kind: str, key: str, make: Callable[[], Arrays]) -> dict[str, np.ndarray]:
    """The arrays of entry `key` of `kind`; made by `make()`, and kept, where there are none.

    A second process that wants the same entry waits for the first. A damaged entry is reported by a warning and made
    again. Raises whatever `make` raises; nothing is kept then. Arrays of Python objects are refused (no pickle).
    """
    found = find(kind, key)
    if found is None:
        with _locked(entry(kind, key)):
            found = find(kind, key, report=True)
            if found is None:
                found = {name: np.asarray(array) for name, array in make().items()}
                keep(kind, key, found)
    return found


def find(kind: str, key: str, report: bool = False) -> dict[str, np.ndarray] | None:
    """The arrays of an entry, None where it is missing or damaged; `report` warns of the latter."""
    try:
        content = entry(kind, key).read_bytes()
    except OSError:
        return None
    seal, body = content[:65], content[65:]
    if seal == _seal(kind, key, body):
        try:
            with np.load(io.BytesIO(body), allow_pickle=False) as data:
                return {name: data[name] for name in data.files}
        except (OSError, ValueError, EOFError, BadZipFile):
            pass
    if report:
        warnings.warn(f"cache entry {entry(kind, key)} is damaged: it is not used", RuntimeWarning, stacklevel=3)
    return None


def keep(kind: str, key: str, arrays: Arrays) -> None:
    """Write an entry, in place of what it was; a cache that cannot be written is one warning a process."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    body, path = buffer.getvalue(), entry(kind, key)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as temporary:
            temporary.write_bytes(_seal(kind, key, body) + body)
    except OSError as error:
        _go_on_without(error.__cause__ or error)


def _seal(kind: str, key: str, body: bytes) -> bytes:
    """What an entry begins with: the hash of its body, of its kind and of its key, so that none stands for another."""
    return hashlib.sha256(f"{kind} {key}\n".encode() + body).hexdigest().encode() + b"\n"


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """The lock of an entry for the time of a block, which runs without it where there is none to be had."""
    lock = FileLock(f"{path}.lock")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            lock.acquire(timeout=PATIENCE_S)
        except Timeout:
            warnings.warn(f"waiting for another process that makes {path}", RuntimeWarning, stacklevel=4)
            lock.acquire(timeout=GIVE_UP_S)
    except (OSError, NotImplementedError) as error:
        _go_on_without(error)
    try:
        yield
    finally:
        lock.release()


_told: set[str] = set()


def _go_on_without(error: BaseException) -> None:
    message = f"cannot use the cache folder {folder()} ({reason(error)}): going on without it; make room there, or set "
    message += f"{ENVIRONMENT} to another folder"
    if message not in _told:
        _told.add(message)
        warnings.warn(message, RuntimeWarning, stacklevel=4)


@lru_cache(maxsize=32)
def _code(maker: str) -> str:
    """Hashes of the sources that a module may run through, and the versions of other packages."""
    sources, (_, package, *inside) = _sources(), maker.split(".")
    if not {"/".join([package, *inside]) + ending for ending in (".py", "/__init__.py")} & {*sources}:
        raise InputError(f"{maker} is no module of papilla: a cached result names the one that makes it")
    above = {*_NOTHING_KEPT, *_LAYERS[_LAYERS.index(package) + 1 if package in _LAYERS else 0 :]}
    below = [(name, digest) for name, digest in sources.items() if name.split("/")[0] not in above]
    return repr((below, [(name, _version(name)) for name in PACKAGES]))


@lru_cache(maxsize=1)
def _sources() -> dict[str, str]:
    """Hash of each file of papilla's code, by its path in the package."""
    files = sorted(_ROOT.rglob("*.py"))
    return {file.relative_to(_ROOT).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


def _version(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return "absent"


def _content(value: object) -> object:
    """A value as plain text and numbers that differ wherever it does."""
    if isinstance(value, np.ndarray):
        return (value.dtype.str, value.shape, hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest())
    if isinstance(value, np.generic):
        return value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, bytes):
        return hashlib.sha256(value).digest()
    if isinstance(value, tuple | list):
        return [_content(item) for item in value]
    if isinstance(value, Mapping):
        return [(_content(name), _content(item)) for name, item in value.items()]
    if is_dataclass(value) and not isinstance(value, type):
        return (type(value).__qualname__, [_content(getattr(value, item.name)) for item in fields(value)])
    raise InputError(f"a cached result cannot depend on a {type(value).__name__}")
