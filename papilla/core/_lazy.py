"""Packages whose names are imported on first use; the names are listed once, in the package's `__init__.pyi`.

Type checkers and editors read that stub, so a misspelt name is an error there too.
"""

import re
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from papilla.core.outside import read_text

_IMPORT = re.compile(r"^from (\.\S*) import (?:(\w+) as \2|\(([^)]*)\))", re.MULTILINE)


def attach(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """`__getattr__`, `__dir__` (PEP 562) and `__all__` of a package with a stub `from .module import name as name`."""
    homes: dict[str, str] = {}
    for home, single, several in _IMPORT.findall(read_text(Path(file).with_suffix(".pyi"))):
        homes |= dict.fromkeys([single] if single else re.findall(r"(\w+) as", several), home)

    def load(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        home = homes[name]
        module = f"{home.removesuffix('.')}.{name}"
        try:
            value = import_module(module, package) if home == "." else getattr(import_module(home, package), name)
        except AttributeError:
            value = import_module(module, package)  # A module of a room, as `papilla.errors`
        setattr(sys.modules[package], name, value)
        return value

    return load, lambda: sorted(sys.modules[package].__all__), [*homes]
