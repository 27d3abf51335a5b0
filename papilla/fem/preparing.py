"""`prepare`: the reduced finger of a design, in one call, with all that its presses may need later.

The cache on disk has reduced fingers and the effect of tangential tractions on them. The finite elements are imported
only if one of these, or a table of large strain, is missing.
"""

from dataclasses import replace
from functools import partial

from papilla.core import cache, checks
from papilla.core.progress import Progress, silent
from papilla.fem.reduction.reduced import ReducedFinger, fetch_tangential
from papilla.mesh import LayeredMesh, build
from papilla.model.finger import Finger

REDUCED_BY = "papilla.fem.reduction.finger_model"
"""Module whose code makes a reduced finger."""


def prepare(
    finger: Finger,
    *,
    size_mm: float | None = None,
    at: tuple[float, float] = (0.0, 0.0),
    variant: int = 0,
    progress: Progress = silent,
) -> ReducedFinger:
    """The finger reduced at touch-down point `at` (x, y in mm) on its mesh number `variant`; cached by content.

    If no table of large strain ships or is known, the first press that includes large strain makes it, in about half a
    minute (`papilla.fem.finite.strain_tables`); `progress` is called then, too.

    Raises what `papilla.mesh.build` and `FingerModel.reduce` raise.
    """
    mesh = build(finger, size_mm=size_mm, variant=variant, progress=progress)
    x, y = checks.place("at", at)
    key = cache.key(REDUCED_BY, finger.sha256, mesh.sha256, x, y)

    def make():
        progress("factorising and reducing the finger")
        return _model(finger, mesh).reduce((x, y)).to_arrays()

    reduced = ReducedFinger.from_arrays(cache.fetch("reduced", key, make))
    return replace(
        reduced,
        bench=finger.bench,
        tangential_source=partial(_cached_tangential, finger, mesh, (x, y)),
        strain_source=partial(_strain_table, finger, progress),
        cached=True,
    )


def _model(finger: Finger, mesh: LayeredMesh):
    """The model of a finger. Its import takes a third of a second, so a press of a cached finger does without it."""
    from papilla.fem.reduction.finger_model import model_of

    return model_of(finger, mesh)


def _cached_tangential(finger: Finger, mesh: LayeredMesh, at: tuple[float, float]):
    """The effect of tangential tractions on the finger (`ReducedFinger.tangential`), from the cache."""
    key = cache.key(REDUCED_BY, "tangential", finger.sha256, mesh.sha256, *at)
    return fetch_tangential("tangential", key, lambda: _model(finger, mesh).reduce_tangential(at))


def _strain_table(finger: Finger, progress: Progress, stuck: bool) -> None:
    from papilla.fem.finite.strain_tables import ensure_large_strain

    ensure_large_strain(finger, (stuck,), progress=progress)
