"""Pinned results: what functions gave when a file was written, and the comparison with what they give now.

A pin proves nothing: it notices that a number moved. Other tests compare with closed forms, independent code and
published values; pins cover the arithmetic between them, on made-up inputs that cost milliseconds. Whoever moves a
number on purpose writes the file anew and reads the difference.
"""

import dataclasses
import enum
import json
import math
import re
from pathlib import Path

import numpy as np

LINE = 400
"""Largest length of a line of a file: a curve stands on one line."""


NUMBER = re.compile(r"[-+]?[0-9]+(?:\.[0-9]+)?(?:e[-+]?[0-9]+)?")


def plain(value):
    """Words and numbers; of an array how many numbers it has, its ends and a sum that weights each one differently."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {str(name): plain(one) for name, one in value.items()}
    if isinstance(value, np.ndarray) and value.dtype.kind in "fiub":
        flat = value.ravel().astype(float)
        if flat.size <= 3:
            return flat.tolist()
        return {"n": list(value.shape), "ends": flat[[0, -1]].tolist(), "sum": weighted(flat)}
    if isinstance(value, list | tuple | range | np.ndarray):
        parts = [plain(one) for one in value]
        return plain(np.array(parts)) if len(parts) > 3 and all(isinstance(one, float) for one in parts) else parts
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, enum.Enum):
        return str(value)
    return value if value is None or isinstance(value, bool | int | float | str) else type(value).__name__


def weighted(flat: np.ndarray) -> float:
    """A sum in which no two numbers have the same weight, and places without a number count too."""
    known = np.where(np.isfinite(flat), flat, 0.37)
    return float(known @ (1 + 0.5 * np.cos(np.arange(flat.size))))


def differences(found, kept, at: str = "") -> list[str]:
    """Where two results differ by more than rounding, and how."""
    if isinstance(found, dict) and isinstance(kept, dict):
        names = dict.fromkeys([*found, *kept])
        return [line for name in names for line in differences(found.get(name), kept.get(name), f"{at}/{name}")]
    if isinstance(found, list) and isinstance(kept, list) and len(found) == len(kept):
        return [
            line
            for k, (one, other) in enumerate(zip(found, kept, strict=True))
            for line in differences(one, other, f"{at}/{k}")
        ]
    if type(found) is not bool and isinstance(found, int | float) and isinstance(kept, int | float):
        if math.isclose(found, kept, rel_tol=1e-5, abs_tol=1e-10) or (math.isnan(found) and math.isnan(kept)):
            return []
    elif isinstance(found, str) and isinstance(kept, str):
        # Numbers inside a text are rounded differently on another processor, too
        if NUMBER.split(found) == NUMBER.split(kept):
            pairs = zip(NUMBER.findall(found), NUMBER.findall(kept), strict=True)
            return [line for one, other in pairs for line in differences(float(one), float(other), at)]
    elif found == kept:
        return []
    return [f"{at}: {found!r}, kept {kept!r}"]


def same(found, file: Path, name: str) -> list[str]:
    """Where a result differs from what a file keeps under a name."""
    kept = json.loads(file.read_text(encoding="utf-8"))
    return differences(json.loads(json.dumps(plain(found))), kept[name])


def update(parts: dict, file: Path, only: list[str]) -> None:
    """Write what the parts (name -> function of a monkeypatch) give now; `only` some, or all."""
    import pytest

    kept = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    for name, part in parts.items():
        if not only or name in only:
            with pytest.MonkeyPatch.context() as patch:
                kept[name] = plain(part(patch))
    file.write_text(_laid_out({name: kept[name] for name in parts}) + "\n", encoding="utf-8")


def _laid_out(value, deep: int = 0) -> str:
    """JSON with each part of a line's length on a line of its own."""
    line = json.dumps(value, ensure_ascii=False)
    if len(line) + deep < LINE or not isinstance(value, dict | list):
        return line
    lead = " " * (deep + 1)
    if isinstance(value, list):
        return "[\n" + ",\n".join(lead + _laid_out(one, deep + 1) for one in value) + "\n" + " " * deep + "]"
    rows = (f"{lead}{json.dumps(name, ensure_ascii=False)}: {_laid_out(one, deep + 1)}" for name, one in value.items())
    return "{\n" + ",\n".join(rows) + "\n" + " " * deep + "}"
