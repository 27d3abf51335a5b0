"""Makes the reference meshes anew: `python -m papilla.mesh.pin`. Default results change with them."""

import numpy as np

from papilla.files import replacing
from papilla.finger import Finger
from papilla.mesh.builder import DEFAULT_SIZE_MM, VARIANTS, mesh_finger, reference_path
from papilla.mesh.layered import pack


def pin() -> None:
    """Mesh the default finger `VARIANTS` times and write the files."""
    finger = Finger.default()
    for variant in range(VARIANTS):
        mesh = mesh_finger(finger, DEFAULT_SIZE_MM, variant=variant)
        arrays = {"geometry_sha256": np.array(finger.geometry_sha256), **pack(mesh)}
        path = reference_path(variant)
        with replacing(path) as temporary, temporary.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)
        print(f"{path.name}: {len(mesh.tets)} tetrahedra, {len(mesh.points)} vertices, {path.stat().st_size} bytes")


if __name__ == "__main__":
    pin()
