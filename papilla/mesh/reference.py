"""The reference meshes that ship with the package (`papilla.mesh.pin` makes them).

The mesher is not deterministic, so default results could not be reproduced to the digit without them.
"""

from pathlib import Path

import numpy as np

from papilla.finger import DEFAULT_FINGER, Finger
from papilla.mesh.layered import LayeredMesh
from papilla.mesh.packing import unpack

VARIANTS = 5
"""Reference meshes of the default finger: the first is the default, the spread of all five is the mesh scatter."""


def reference_path(variant: int) -> Path:
    """File of a reference mesh."""
    return DEFAULT_FINGER.parent / f"reference_mesh_{variant}.npz"


def reference(finger: Finger, size_mm: float, variant: int) -> LayeredMesh | None:
    """The shipped mesh of this geometry, size and variant; None where none was shipped."""
    path = reference_path(variant)
    if variant >= VARIANTS or not path.exists():
        return None
    with np.load(path, allow_pickle=False) as data:
        if float(data["size_mm"]) != size_mm or str(data["geometry_sha256"]) != finger.geometry_sha256:
            return None
        return unpack(data)
