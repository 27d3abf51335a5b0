"""One kernel source, run as it stands or compiled by numba (extra `fast`): the decisions and answers are the same."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from importlib.util import find_spec
from types import FunctionType, SimpleNamespace

from papilla.errors import MissingExtraError


def numba_available() -> bool:
    """Whether numba is installed; it is not imported to find out."""
    return find_spec("numba") is not None


def kernels(functions: Sequence[Callable], compiled: bool) -> SimpleNamespace:
    """The functions by name, either as they are or compiled; each may call those before it.

    Raises `MissingExtraError` when numba is asked for and missing.
    """
    if compiled and not numba_available():
        raise MissingExtraError("compiled estimators need numba: install papilla[fast], or use compiled=False")
    return _compiled(tuple(functions)) if compiled else SimpleNamespace(**{item.__name__: item for item in functions})


@lru_cache(maxsize=8)
def _compiled(functions: tuple[FunctionType, ...]) -> SimpleNamespace:
    from numba import njit

    made: dict[str, Callable] = {}
    for function in functions:
        # A copy whose globals name the compiled callees: the plain functions stay plain.
        copy = FunctionType(function.__code__, {**function.__globals__, **made}, function.__name__)
        copy.__module__, copy.__qualname__ = function.__module__, function.__qualname__
        made[function.__name__] = njit(copy, error_model="numpy", cache=True)
    return SimpleNamespace(**made)
