"""`ReducedFinger`: the finger condensed to what contact needs, a few MB that answer every press without a mesh."""

import json
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any

import numpy as np

from papilla.errors import FileFormatError
from papilla.fem.reduction.compliance import kernel_compliance
from papilla.fem.reduction.patch import Patch
from papilla.references import BondedLayerKernel
from papilla.specimen import Block, Specimen

SCHEMA = "papilla.reduced/1"


@dataclass(frozen=True, eq=False)
class ReducedFinger:
    """A finger condensed at one touch-down point; n patch nodes, g gauges.

    Where the patch is symmetric only its positive quarter is kept and `images` repeats it, so a force on the finger is
    `len(images)` times the force on the patch.

    compliance : (n, n) weak displacement of the skin against pressure, mm3 / MPa.
    half_space : (n, n) the same of a half-space with E* = 1 MPa.
    strain_rows, curvature_rows : (g, n) gauge strain, and curvature change in 1/mm, per MPa of nodal pressure.
    gains, levers : (g,) reading = gain * strain + lever (mm) * curvature change.
    depth : soft tissue below the touch-down point, mm.
    outer_modulus : E / (1 - nu^2) of the outer layer, MPa: what a vanishing contact feels.
    element : that the finger was solved with.
    """

    finger_name: str
    finger_sha256: str
    mesh_sha256: str
    mesh_size_mm: float
    at: tuple[float, float]
    gauge_names: tuple[str, ...]
    gains: np.ndarray
    levers: np.ndarray
    depth: float
    outer_modulus: float
    patch: Patch
    compliance: np.ndarray
    half_space: np.ndarray
    strain_rows: np.ndarray
    curvature_rows: np.ndarray
    element: str = "Taylor-Hood"

    @property
    def multiplicity(self) -> int:
        """How many times the patch is repeated."""
        return len(self.patch.images)

    def specimen_compliance(self, specimen: Specimen) -> np.ndarray:
        """Weak compliance (n, n) of a specimen's surface on the patch, mm3 / MPa."""
        compliance = self.half_space * ((1 - specimen.nu**2) / specimen.modulus)
        if isinstance(specimen, Block):
            compliance = compliance + _layer_correction(self, specimen.thickness, specimen.nu) / specimen.modulus
        return compliance

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Everything as named arrays, ready for `numpy.savez`."""
        meta = {
            "schema": SCHEMA,
            "finger_name": self.finger_name,
            "finger_sha256": self.finger_sha256,
            "mesh_sha256": self.mesh_sha256,
            "mesh_size_mm": self.mesh_size_mm,
            "at": list(self.at),
            "gauge_names": list(self.gauge_names),
            "depth": self.depth,
            "outer_modulus": self.outer_modulus,
            "element": self.element,
        }
        arrays = {name: getattr(self, name) for name in _ARRAYS}
        arrays |= {f"patch_{item.name}": getattr(self.patch, item.name) for item in fields(Patch)}
        return arrays | {"meta": np.array(json.dumps(meta))}

    @classmethod
    def from_arrays(cls, arrays) -> "ReducedFinger":
        """The finger of `to_arrays`; raises `FileFormatError` for anything else."""
        try:
            meta = json.loads(str(arrays["meta"]))
            if meta.pop("schema") != SCHEMA:
                raise FileFormatError(f"reduced finger: the schema is not {SCHEMA}")
            patch = Patch(**{item.name: np.asarray(arrays[f"patch_{item.name}"]) for item in fields(Patch)})
            meta["at"], meta["gauge_names"] = tuple(meta["at"]), tuple(meta["gauge_names"])
            values: dict[str, Any] = {name: np.asarray(arrays[name]) for name in _ARRAYS}
            return cls(patch=patch, **values, **meta)
        except (KeyError, TypeError, json.JSONDecodeError) as error:
            raise FileFormatError(f"reduced finger: not a complete file ({error})") from error

    def save(self, path) -> None:
        """Write the finger as .npz (no pickle); the file appears whole or not at all."""
        from papilla.files import replacing

        with replacing(path) as temporary, open(temporary, "wb") as stream:
            np.savez(stream, allow_pickle=False, **self.to_arrays())

    @classmethod
    def load(cls, path) -> "ReducedFinger":
        """Read a finger that `save` wrote; raises `FileFormatError` or `FileAccessError`."""
        from zipfile import BadZipFile

        from papilla.errors import FileAccessError

        try:
            with open(path, "rb") as stream:
                arrays = np.load(stream, allow_pickle=False)
                if not isinstance(arrays, np.lib.npyio.NpzFile):
                    raise FileFormatError(f"{path} is not a reduced finger: one array, where an .npz was expected")
                return cls.from_arrays(dict(arrays))
        except OSError as error:
            raise FileAccessError(f"cannot read reduced finger {path}: {error.strerror or error}") from error
        except FileFormatError:
            raise
        except (ValueError, BadZipFile, EOFError) as error:
            raise FileFormatError(f"{path} is not a reduced finger: {error}") from error


_ARRAYS = ("gains", "levers", "compliance", "half_space", "strain_rows", "curvature_rows")


@lru_cache(maxsize=8)
def _layer_correction(reduced: ReducedFinger, thickness: float, nu: float) -> np.ndarray:
    """What bonding to a rigid table at `thickness` mm changes in a half-space of unit modulus."""
    return kernel_compliance(reduced.patch, BondedLayerKernel(thickness, nu))
