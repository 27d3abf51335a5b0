"""From a finger's design to its `ReducedFinger` through the cache: the way that commands take."""

import hashlib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

from papilla import cache, checks
from papilla.fem.reduction.finger_model import FingerModel
from papilla.fem.reduction.reduced import SCHEMA, ReducedFinger
from papilla.finger import Finger
from papilla.mesh import DEFAULT_SIZE_MM, LayeredMesh, build


def prepare(
    finger: Finger,
    *,
    size_mm: float = DEFAULT_SIZE_MM,
    at: tuple[float, float] = (0.0, 0.0),
    variant: int = 0,
    progress: Callable[[str], None] | None = None,
) -> ReducedFinger:
    """The finger reduced at touch-down point `at` (x, y in mm) on its mesh number `variant`; cached by content.

    Raises what `papilla.mesh.build` and `FingerModel.reduce` raise, and `FileAccessError` for an unusable cache.
    """
    mesh = build(finger, size_mm=size_mm, variant=variant, progress=progress)
    x, y = (checks.finite(f"at {axis} (mm)", value) for axis, value in zip("xy", at, strict=True))
    key = cache.digest(SCHEMA, code_sha256(), finger.sha256, mesh.sha256, x, y)

    def make():
        if progress is not None:
            progress("factorising and reducing the finger")
        return _reduce(finger, mesh, (x, y)).to_arrays()

    return ReducedFinger.from_arrays(cache.fetch("reduced", key, make))


def _reduce(finger: Finger, mesh: LayeredMesh, at: tuple[float, float]) -> ReducedFinger:
    return FingerModel(finger, mesh).reduce(at)


@lru_cache(maxsize=1)
def code_sha256() -> str:
    """Hash of the code that reduces and presses: what was cached before a change of it must not be used after."""
    files = sorted(Path(__file__).parents[1].rglob("*.py"))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()
