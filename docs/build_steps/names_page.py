"""The pages of Python names, a page a package: signatures and docstrings of what the packages export."""

import ast
import importlib
import inspect
from enum import Enum
from pathlib import Path
from types import ModuleType
from typing import Any

from pages import markdown
from pages import write as write_page

PACKAGES = (
    "papilla",
    "papilla.model",
    "papilla.logs",
    "papilla.mesh",
    "papilla.fem",
    "papilla.view",
    "papilla.scenes",
    "papilla.calibration",
    "papilla.estimators",
    "papilla.identification",
    "papilla.design",
    "papilla.verify",
    "papilla.telepresence",
    "papilla.references",
    "papilla_papers.methods",
)
WIDTH = 100
"""Characters of a signature that stands on one line."""


def write(folder: Path) -> None:
    """Write names/<package>.md for every package."""
    for package in PACKAGES:
        module = importlib.import_module(package)
        named = [(name, getattr(module, name)) for name in sorted(exported(module), key=str.lower)]
        shown = [_entry(name, value) for name, value in named if not isinstance(value, ModuleType)]
        head = f"# {package}\n\n{markdown(module.__doc__)}\n"
        write_page(folder / "names" / f"{package}.md", head + "\n".join(shown))


def exported(module: ModuleType) -> list[str]:
    """Names of a package: those of its stub where it has one, else its `__all__`."""
    stub = Path(str(module.__file__)).with_suffix(".pyi")
    if stub.is_file():
        body = ast.parse(stub.read_text(encoding="utf-8")).body
        return [str(name.asname) for node in body if isinstance(node, ast.ImportFrom) for name in node.names]
    return list(module.__all__)


def _entry(name: str, value: Any) -> str:
    if not (inspect.isclass(value) or callable(value)):
        return f"## {name}\n\n`{value!r}`\n"
    text = f"## {name}\n\n{_signature(name, value)}\n{markdown(inspect.getdoc(value))}\n"
    if inspect.isclass(value) and not issubclass(value, Enum | Exception):
        text += "".join(_member(name, key, one) for key, one in vars(value).items() if not key.startswith("_"))
    return text


def _member(owner: str, name: str, value: Any) -> str:
    """A public method or property with a docstring; fields are explained by the class."""
    inner = value.__func__ if isinstance(value, classmethod | staticmethod) else value
    inner = getattr(inner, "func", inner)  # A cached property
    said = inspect.getdoc(inner.fget if isinstance(inner, property) else inner)
    is_function = inspect.isfunction(inner)
    if not said or not (is_function or isinstance(value, property) or inner is not value):
        return ""
    shown = _signature(f"{owner}.{name}", inner) if inspect.isfunction(inner) and inner is value else ""
    return f"\n### {owner}.{name}\n\n{shown}{markdown(said)}\n"


def _signature(name: str, value: Any) -> str:
    try:
        signature = inspect.signature(value)
    except ValueError:
        return ""
    parts, bare = [], False
    for one in signature.parameters.values():
        if one.name in ("self", "cls"):
            continue
        if one.kind is one.KEYWORD_ONLY and not bare:
            parts.append("*")
        bare = bare or one.kind in (one.KEYWORD_ONLY, one.VAR_POSITIONAL)
        parts.append(str(one.replace(annotation=one.empty)))
    joined = f"{name}({', '.join(parts)})"
    if len(joined) > WIDTH:
        joined = f"{name}(\n    " + ",\n    ".join(parts) + ",\n)"
    return f"```python\n{joined}\n```\n\n"
