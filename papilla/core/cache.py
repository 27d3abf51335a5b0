"""A cache of named arrays on disk: keyed by the code and the values behind them, locked, atomic, checked on reading.

The environment variable `PAPILLA_CACHE` names its folder; without it, it lies in the user's cache folder.
`PAPILLA_CACHE_PATIENCE_S` replaces the seconds for which a process waits for another before it says so. If a result
cannot be stored (full disk, no permission), papilla warns once and computes it each time.

papilla uses what an entry says, so nobody else may be able to write one. The cache folder, the folder of a kind, the
opened entry and links to any of them must belong to the user, and group and others must not be able to write to them;
otherwise the cache is not used. Parent folders are not checked: who can write there can move the cache away or replace
it, but cannot create a file that belongs to this user. Windows has no such permission bits, so nothing is checked.

Each entry is sealed with a secret of the user, which lies in the user's data folder (`secret_file`). A folder that
somebody else made, or an entry that was edited and sealed again, has another seal and is not used.
"""

import ast
import hashlib
import hmac
import io
import os
import re
import secrets
import stat
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import fields, is_dataclass
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import resolve_name
from pathlib import Path

import numpy as np
from filelock import FileLock, Timeout
from platformdirs import user_cache_dir, user_data_dir

from papilla.core.errors import FileAccessError, FileFormatError, InputError, NotOwnError
from papilla.core.files import check_writable, replacing
from papilla.core.outside import check_own, own_bytes, read_arrays, read_bytes, reason

CACHE_VARIABLE, PATIENCE_VARIABLE = "PAPILLA_CACHE", "PAPILLA_CACHE_PATIENCE_S"
"""Environment variables: the folder of the cache, and what replaces `LOCK_PATIENCE_S`."""

USER_VARIABLES = ("XDG_CACHE_HOME", "HOME", "USERPROFILE", "LOCALAPPDATA")
"""Environment variables on which the user's cache folder depends."""

LOCK_PATIENCE_S, GIVE_UP_S = 5.0, 1800.0
"""Times (s) for which another process may hold an entry: after the first this process says that it waits, after the
second it computes the entry itself."""

DISTRIBUTION_NAMES = {
    "numpy": "numpy",
    "scipy": "scipy",
    "skfem": "scikit-fem",
    "rslab": "rslab",
    "pyvista": "pyvista",
    "vtkmodules": "vtk",
    "matplotlib": "matplotlib",
}
"""Packages that influence results, by the name that is imported. Their versions count for the code that imports them.
pytetwild is not among them: it only makes meshes, and results depend on the content of the mesh."""

PRIVATE_FILE, PRIVATE_FOLDER = stat.S_IRUSR | stat.S_IWUSR, stat.S_IRWXU
"""Permissions of an entry and of its folder: the user's alone."""

SECRET_BYTES = 32
"""Length of the user's secret: that of the hash that it keys."""

_SEAL = re.compile(rb"(?:([0-9a-f]{16}) )?[0-9a-f]{64}\n")
"""First line of an entry: a name of the secret, which older papilla did not write, and the seal."""

_ROOT = Path(__file__).parents[2]
_PACKAGES = ("papilla", "papilla_papers")
"""The packages whose code is hashed, and the folder in which they stand."""

Arrays = Mapping[str, np.ndarray]


def key(maker: str, *values: object) -> str:
    """The key of a result that the module `maker` (its `__name__`) computes from `values`.

    The key contains the code of `maker` and of every papilla module that it imports, directly or indirectly, at the top
    or in a function, without docstrings, comments and formatting; the versions of those `DISTRIBUTION_NAMES` that this
    code imports; and the values: numbers, text, bytes, arrays, None, dataclasses, and tuples, lists and dicts of these.
    Raises `InputError` for other values."""
    return _hash(_code(maker), [_content(value) for value in values])


def versioned_key(name: str, version: int, *values: object) -> str:
    """The key of a result `name` that depends on `values` and on a version raised by hand, but on no code."""
    return _hash(name, version, [_content(value) for value in values])


def folder() -> Path:
    """The cache's folder (it need not exist)."""
    return _folder(os.environ.get(CACHE_VARIABLE), *map(os.environ.get, USER_VARIABLES))


@lru_cache(maxsize=8)
def _folder(chosen: str | None, *_user: str | None) -> Path:
    """`folder`, kept for each state of the environment."""
    return Path(chosen or user_cache_dir("papilla", appauthor=False))


def entry(category: str, key: str) -> Path:
    """The file of an entry (it need not exist)."""
    return folder() / category / f"{key}.entry"


def fetch(category: str, key: str, make: Callable[[], Arrays], give_up_s: float = GIVE_UP_S) -> dict[str, np.ndarray]:
    """The arrays of entry `key` of `kind`. If there is no such entry, `make()` computes them and they are stored.

    A second process that asks for the same entry waits for the first, at most `give_up_s`. A damaged entry causes a
    warning and is computed again. Raises whatever `make` raises, and stores nothing then. Arrays of Python objects are
    refused (no pickle).
    """
    arrays = find(category, key)
    if arrays is None:
        with _locked(entry(category, key), give_up_s):
            arrays = find(category, key, report=True)
            if arrays is None:
                arrays = {name: np.asarray(array) for name, array in make().items()}
                keep(category, key, arrays)
    return arrays


def entries() -> dict[Path, int]:
    """The files of all entries, of papilla's present code or an older one, and their sizes in bytes."""
    sizes = {}
    for path in sorted(folder().glob("*/*.entry")):
        with suppress(OSError):  # Another process may remove it
            sizes[path] = path.stat().st_size
    return sizes


def secret_file() -> Path:
    """The file of the secret with which this user's entries are sealed; it is made when the first entry is written."""
    return Path(user_data_dir("papilla", appauthor=False)) / "cache.secret"


def usable() -> bool:
    """Whether entries can be written here and are trusted: nobody but this user may write to the folder, and the secret
    that seals them can be read."""
    try:
        folder().mkdir(mode=PRIVATE_FOLDER, parents=True, exist_ok=True)
        _check_own(entry("probe", "probe"))
        check_writable(folder())
        _secret(secret_file())
    except OSError:
        return False
    return True


def clean() -> None:
    """Remove all entries and their locks; what is needed again is computed again. Raises `FileAccessError`."""
    for path in (*entries(), *folder().glob("*/*.entry.lock")):
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise FileAccessError(f"cannot remove cache entry {path}: {reason(error)}") from error


def find(category: str, key: str, report: bool = False) -> dict[str, np.ndarray] | None:
    """The arrays of an entry; None if it is missing, sealed with another secret, or damaged.

    report : a damaged one causes a warning.
    """
    path = entry(category, key)
    try:
        _check_own(path)
        content = own_bytes(path)
        secret = _secret(secret_file())
    except (NotOwnError, NoSecretError) as error:
        _go_on_without(error)
        return None
    except OSError:
        return None
    line, end, body = content.partition(b"\n")
    if hmac.compare_digest(line + end, _seal(secret, category, key, body)):
        with suppress(FileFormatError):
            return read_arrays(io.BytesIO(body), f"cache entry {path}")
    stated = _SEAL.fullmatch(line + end)
    if report and (stated is None or stated[1] == _name(secret)):
        warnings.warn(f"cache entry {path} is damaged: it is not used", RuntimeWarning, stacklevel=3)
    return None


def keep(category: str, key: str, arrays: Arrays) -> None:
    """Write an entry, replacing an older one. If the cache cannot be written, a process warns once."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    body, path = buffer.getvalue(), entry(category, key)
    try:
        _make_folders(path)
        seal = _seal(_secret(secret_file()), category, key, body)
        with replacing(path) as temporary:
            temporary.touch(PRIVATE_FILE)
            temporary.write_bytes(seal + body)
    except NoSecretError as error:
        _go_on_without(error)
    except OSError as error:
        _go_on_without(error.__cause__ or error)


def _seal(secret: bytes, category: str, key: str, body: bytes) -> bytes:
    """First line of an entry: the name of the secret, and a hash, keyed by it, of kind, key and body, so that no entry
    can stand for another."""
    seal = hmac.new(secret, f"{category} {key}\n".encode() + body, hashlib.sha256)
    return _name(secret) + b" " + seal.hexdigest().encode() + b"\n"


def _name(secret: bytes) -> bytes:
    """What stands for a secret in an entry, and does not tell it."""
    return hmac.new(secret, b"name", hashlib.sha256).hexdigest()[:16].encode()


class NoSecretError(FileAccessError):
    """The secret that seals the entries can neither be read nor made."""


@cache
def _secret(path: Path) -> bytes:
    """The secret in a file, which is made if it is missing: one for all processes. Raises `NoSecretError`."""
    try:
        if not path.exists():
            path.parent.mkdir(mode=PRIVATE_FOLDER, parents=True, exist_ok=True)
            with FileLock(f"{path}.lock", mode=PRIVATE_FILE, timeout=_patience_s()):
                if not path.exists():
                    with replacing(path) as temporary:
                        temporary.touch(PRIVATE_FILE)
                        temporary.write_bytes(secrets.token_bytes(SECRET_BYTES))
        secret = own_bytes(path, "the secret", SECRET_BYTES, private=True)
    except (OSError, NotImplementedError, FileFormatError) as error:
        raise NoSecretError(f"no secret to seal its entries: {error}") from error
    if len(secret) != SECRET_BYTES:
        raise NoSecretError(f"no secret to seal its entries: {path} has {len(secret)} bytes, not {SECRET_BYTES}")
    return secret


def _patience_s() -> float:
    """Seconds to wait without a word; raises `InputError` if the environment has no number."""
    stated = os.environ.get(PATIENCE_VARIABLE) or LOCK_PATIENCE_S
    try:
        return float(stated)
    except ValueError as error:
        raise InputError(f"{PATIENCE_VARIABLE} must be a number of seconds, got {stated!r}") from error


@contextmanager
def _locked(path: Path, give_up_s: float) -> Iterator[None]:
    """Hold the lock of an entry during a block; the block runs without it if the lock cannot be had."""
    lock = FileLock(f"{path}.lock", mode=PRIVATE_FILE)
    try:
        _make_folders(path)
        try:
            lock.acquire(timeout=_patience_s())
        except Timeout:
            warnings.warn(f"waiting for another process that makes {path}", RuntimeWarning, stacklevel=4)
            lock.acquire(timeout=give_up_s)
    except (OSError, NotImplementedError) as error:
        _go_on_without(error)
    try:
        yield
    finally:
        lock.release()


def _make_folders(path: Path) -> None:
    """Make the folders of an entry, for the user alone; raises `NotOwnError` if others can write there."""
    folder().mkdir(mode=PRIVATE_FOLDER, parents=True, exist_ok=True)
    path.parent.mkdir(mode=PRIVATE_FOLDER, exist_ok=True)
    _check_own(path)


def _check_own(path: Path) -> None:
    for place in (folder(), path.parent, path):
        check_own(place)


_warned: set[str] = set()
"""Folders for which this process has warned that it cannot use them."""


def _go_on_without(error: BaseException) -> None:
    """Warn, once for each folder, that the cache cannot be used."""
    place = str(folder())
    if place not in _warned:
        _warned.add(place)
        advice = f"make room there, or set {CACHE_VARIABLE} to another folder"
        if isinstance(error, NotOwnError):
            advice = f"set {CACHE_VARIABLE} to a folder that only you can write to, or empty this one and chmod go-w it"
        elif isinstance(error, NoSecretError):
            advice = f"make {secret_file().parent} a folder of yours that you can write to, or remove a broken secret"
        message = f"cannot use the cache folder {place} ({reason(error)}): going on without it; {advice}"
        warnings.warn(message, RuntimeWarning, stacklevel=4)


@cache
def _code(maker: str) -> str:
    """Hash of the code that a module may run, and the versions of the packages that this code imports.

    Parsing takes a few tenths of a second. So the result is cached, with the bytes of all source files as its key.
    """
    if _file(maker) is None:
        raise InputError(f"{maker} is no module of papilla: a cached result must name the module that computes it")
    meaning = fetch("code", _hash(maker, _sources(), sys.version_info[:2]), lambda: _meaning(maker))
    return repr((str(meaning["code"]), [(name, _version(name)) for name in meaning["packages"].tolist()]))


def _meaning(maker: str) -> Arrays:
    """Hash of the code of `maker` and of every papilla module that it imports, and the `DISTRIBUTION_NAMES` among the
    imports."""
    reached, waiting, packages = {}, [maker], set()
    while waiting:
        name = waiting.pop()
        if (file := _file(name)) is None:
            packages |= {DISTRIBUTION_NAMES[top] for top in [name.split(".")[0]] if top in DISTRIBUTION_NAMES}
        elif name not in reached:
            reached[name], imported = _parsed(name, file, _sources()[file])
            waiting += imported
    return {"code": np.array(_hash(*sorted(reached.items()))), "packages": np.array(sorted(packages), dtype=str)}


@cache
def _parsed(name: str, file: str, _content: str) -> tuple[str, list[str]]:
    """Hash of a module's syntax tree without docstrings, and what it imports, also inside functions."""
    path, imported = _ROOT / file, []
    trees = [ast.parse(read_bytes(path))]
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    if (stub := path.with_suffix(".pyi")).exists():  # Names of a package that are imported on first use
        trees.append(ast.parse(read_bytes(stub)))
    for node in (node for tree in trees for node in ast.walk(tree)):
        if isinstance(node, ast.Import):
            imported += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            home = resolve_name("." * node.level + (node.module or ""), package)
            imported += [home, *(f"{home}.{alias.name}" for alias in node.names)]
        if isinstance(lines := getattr(node, "body", None), list):
            node.body = [line for line in lines if not _is_text(line)]  # type: ignore[attr-defined]
    return _hash(*map(ast.dump, trees)), imported


def _is_text(line: ast.AST) -> bool:
    """Whether a statement is only text: a docstring, also one after a constant."""
    return isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant) and isinstance(line.value.value, str)


def _file(module: str) -> str | None:
    """The file of a papilla module; None for any other name, and for papilla itself, which has no code."""
    inside = module.replace(".", "/")
    named = (f"{inside}.py", f"{inside}/__init__.py") if module != "papilla" else ()
    return next((file for file in named if file in _sources()), None)


@cache
def _sources() -> dict[str, str]:
    """Hash of each file of papilla's code, by its path."""
    folders = [_ROOT / name for name in _PACKAGES]
    files = sorted(file for folder in folders for pattern in ("*.py", "*.pyi") for file in folder.rglob(pattern))
    return {file.relative_to(_ROOT).as_posix(): hashlib.sha256(read_bytes(file)).hexdigest() for file in files}


def _hash(*parts: object) -> str:
    return hashlib.sha256(repr(parts).encode()).hexdigest()


@cache
def _version(distribution: str) -> str:
    try:
        return version(distribution)
    except PackageNotFoundError:
        return "absent"


def _content(value: object) -> object:
    """A value as plain text and numbers; two different values give different results."""
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
