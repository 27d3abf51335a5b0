"""From a finger's design to its `ReducedFinger` through the cache: the way that commands take."""

from collections.abc import Callable

from papilla import cache, checks
from papilla.fem.reduction.finger_model import FingerModel
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.finger import Finger
from papilla.mesh import DEFAULT_SIZE_MM, build


def prepare(
    finger: Finger,
    *,
    size_mm: float = DEFAULT_SIZE_MM,
    at: tuple[float, float] = (0.0, 0.0),
    variant: int = 0,
    progress: Callable[[str], None] | None = None,
) -> ReducedFinger:
    """The finger reduced at touch-down point `at` (x, y in mm) on its mesh number `variant`; cached by content.

    Raises what `papilla.mesh.build` and `FingerModel.reduce` raise.
    """
    mesh = build(finger, size_mm=size_mm, variant=variant, progress=progress)
    x, y = (checks.finite(f"at {axis} (mm)", value) for axis, value in zip("xy", at, strict=True))
    key = cache.key(__name__, finger.sha256, mesh.sha256, x, y)

    def make():
        if progress is not None:
            progress("factorising and reducing the finger")
        return FingerModel(finger, mesh).reduce((x, y)).to_arrays()

    return ReducedFinger.from_arrays(cache.fetch("reduced", key, make))
