"""One kernel source, run as it stands or compiled by numba (extra `fast`): the decisions and answers are the same.

What numba made is kept on disk: below `NUMBA_CACHE_DIR` or `PAPILLA_CACHE` where one is set and no one else can write
there, else in the user's cache folder; under a name that follows the sources, so that a change of any kernel is seen.
numba keeps pickles and machine code, which can do anything: they are loaded only from a folder of the user's own, and
only if their digest is the one that was written with them.
"""

import hashlib
import os
import warnings
from collections.abc import Callable, Sequence
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType, SimpleNamespace
from typing import Any, cast

import numpy as np
from platformdirs import user_cache_dir

from papilla.errors import MissingExtraError
from papilla.files import private, reason, write_text

SEAL = "sealed.sha256"
"""File with the digest of what numba keeps beside it."""


def numba_available() -> bool:
    """Whether numba is installed; it is not imported to find out."""
    return find_spec("numba") is not None


def scalars(count: int, compiled: bool) -> Any:
    """Room for numbers that a kernel reads and writes one by one: an array for the compiler, else a list, which is
    three times as fast as an array then."""
    return np.zeros(count) if compiled else [0.0] * count


def kernels(functions: Sequence[Callable], compiled: bool, apart: Sequence[Callable] = ()) -> SimpleNamespace:
    """The functions by name, either as they are or compiled; each may call those before it, the last is the entry.

    Where they are compiled, the loops of `vectors.LOOPS` stand in for their NumPy forms, and all but the entry and
    those `apart` become part of what calls them: to hand over the arrays costs as much as the arithmetic.

    Raises `MissingExtraError` when numba is asked for and missing.
    """
    if compiled and not numba_available():
        raise MissingExtraError("compiled estimators need numba: install papilla[fast], or use compiled=False")
    if compiled:
        return _compiled(tuple(functions), frozenset(apart))
    return SimpleNamespace(**{item.__name__: item for item in functions})


def kernel_cache(functions: Sequence[Callable]) -> Path:
    """The folder for what numba makes of these functions: its name follows their source files (it need not exist)."""
    files = sorted({cast(FunctionType, function).__code__.co_filename for function in functions} | {__file__})
    digest = hashlib.sha256(b"".join(Path(file).read_bytes() for file in files)).hexdigest()[:16]
    own = Path(user_cache_dir("papilla", appauthor=False)) / "kernels" / digest
    chosen = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("PAPILLA_CACHE")
    wanted = Path(chosen) / "kernels" / digest if chosen else own
    return wanted if private(wanted) else own


@lru_cache(maxsize=8)
def _compiled(functions: tuple[Callable, ...], apart: frozenset[Callable]) -> SimpleNamespace:
    import numba

    config: Any = numba.core.config
    compiler: Any = numba.njit
    made: dict[str, Any] = {}
    for function in functions:
        source = cast(FunctionType, function)
        # A copy whose globals name the compiled callees: the plain functions stay plain.
        copy = FunctionType(source.__code__, {**source.__globals__, **made}, function.__name__)
        copy.__module__, copy.__qualname__ = function.__module__, function.__qualname__
        # Kernels allocate nothing: without numba's reference counts they compile in a third of the time.
        inline = function is not functions[-1] and function not in apart
        made[function.__name__] = compiler(copy, error_model="numpy", _nrt=False, forceinline=inline)
    entry = made[functions[-1].__name__]
    before = config.CACHE_DIR
    try:
        folder = kernel_cache(functions)
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        config.CACHE_DIR = str(folder)
        if private(folder):
            # Only the entry is kept: it holds its callees.
            entry._cache = _sealed_cache(entry.py_func, folder)
    except OSError as error:
        _not_kept(folder, error)
    finally:
        config.CACHE_DIR = before
    return SimpleNamespace(**made)


def _sealed_cache(function: Callable, folder: Path) -> Any:
    """numba's cache of a function in `folder`, which loads nothing but what it wrote."""
    from numba.core.caching import FunctionCache

    class SealedCache(FunctionCache):
        def load_overload(self, *args: Any) -> Any:
            _remove_unless_sealed(folder)
            return super().load_overload(*args)

        def save_overload(self, *args: Any) -> None:
            _remove_unless_sealed(folder)
            try:
                super().save_overload(*args)
                write_text(folder / SEAL, _digest(folder))
            except OSError as error:
                _not_kept(folder, error)

    return SealedCache(function)


def _not_kept(folder: Path, error: OSError) -> None:
    warnings.warn(f"compiled code cannot be kept in {folder} ({reason(error)})", RuntimeWarning, stacklevel=5)


def _remove_unless_sealed(folder: Path) -> None:
    """Remove what numba kept in `folder` where it is not, to the bit, what was sealed."""
    kept, seal = _kept(folder), folder / SEAL
    if kept and not (seal.is_file() and seal.read_bytes() == _digest(folder).encode()):
        warnings.warn(f"compiled code in {folder} is damaged: compiling again", RuntimeWarning, stacklevel=4)
        for file in kept:
            file.unlink(missing_ok=True)


def _kept(folder: Path) -> list[Path]:
    return sorted(file for file in folder.rglob("*") if file.suffix in (".nbi", ".nbc"))


def _digest(folder: Path) -> str:
    found = [(str(file.relative_to(folder)), hashlib.sha256(file.read_bytes()).hexdigest()) for file in _kept(folder)]
    return hashlib.sha256(repr(found).encode()).hexdigest()
