"""`ReducedFinger`: a finger condensed to the data that contact needs, a few MB that answer every press without a mesh.

The cache on disk has compliances of specimens on its patch. Results of presses are in memory (`kept`) for as long as
their reduced finger lives: a cache in the module would keep the last reduced fingers alive and, with them, their models
and factors, hundreds of MB each.
"""

import json
import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property, partial, wraps
from os import PathLike
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from papilla.core import cache, checks
from papilla.core.errors import ContactRangeError, FileFormatError, InputError
from papilla.core.file_models import first_of, in_words, keys_of, table
from papilla.core.files import replacing
from papilla.core.outside import json_value, read_arrays
from papilla.fem.reduction.compliance import PatchSurface
from papilla.fem.reduction.gauges import GAUGE_QUANTITIES
from papilla.fem.reduction.patch import Patch
from papilla.model.finger import Bench, Finger
from papilla.model.specimen import Specimen

COMPLIANCE_BY = PatchSurface.__module__
"""Module whose code makes the compliance of a specimen."""

Function = TypeVar("Function", bound=Callable[..., Any])

REDUCED_SCHEMA = "papilla.reduced/3"

MOST_KEPT = 400
"""Largest number of patch nodes for which a specimen's compliance is kept in the cache: 12 MB with friction."""

UNLIKE_COMPLIANCE = 1e-6
"""Largest difference, as a share of the largest entry, between the two compliances of a specimen for pressure alone."""

FLAT_TRIANGLE_SHARE, UNLIKE_MASS = 1e-6, math.log(2)
"""Smallest area of a triangle in a file, over the mean, and largest |ln| of a node's mass over the area around it: skin
whose edges are bent has up to 1.5 % more."""

FEW_RESULTS = 8
"""Number of results that `kept` keeps of a function whose results are large."""


_NO_RESULT = object()


def kept(most: int = FEW_RESULTS) -> Callable[[Function], Function]:
    """Decorator: keep the last `most` results of a function with the object that is its first argument, by its other
    arguments.

    The other arguments must be hashable. A `ContactRangeError` is kept, too, and raised again.
    """

    def decorate(function: Function) -> Function:
        """The function with kept results."""
        name = f"_kept_{function.__module__}.{function.__name__}"

        @wraps(function)
        def found(owner: Any, *others: Any) -> Any:
            """The kept result, or a new one, which is then kept with `owner`."""
            results = vars(owner).setdefault(name, {})
            # A hash of the arguments takes longer than all the rest: one to take the result out, one to put it last.
            result = results.pop(others, _NO_RESULT)
            if result is _NO_RESULT:
                try:
                    result = function(owner, *others)
                except ContactRangeError as error:
                    result = error.with_traceback(None)
                if len(results) >= most:
                    del results[next(iter(results))]
            results[others] = result
            if isinstance(result, ContactRangeError):
                raise result
            return result

        return found  # type: ignore[return-value]

    return decorate


@dataclass(frozen=True, eq=False, repr=False)
class ReducedFinger:
    """A finger condensed at one touch-down point; n patch nodes, g gauges, q quantities of a gauge.

    If the patch is symmetric, only its positive quarter is kept, and `images` gives its mirror images; the force on the
    finger is `len(images)` times the force on the patch.

    compliance : (n, n) weak displacement of the skin against pressure, mm3 / MPa.
    half_space : (n, n) the same of a half-space with E* = 1 MPa.
    rows : (q, g, n) strain and curvature change of the gauges per MPa of nodal pressure, in the order of
        `gauges.QUANTITIES`.
    weights : (q, g) of the quantities in a reading.
    layers : (k, 2) thickness (mm) and Young's modulus (MPa) of the layers below the touch-down point, the skin first.
    outer_modulus : E / (1 - nu^2) of the outer layer, MPa, which determines a vanishing contact.
    tangential_source : computes, when friction needs it, (3n, 2n) weak displacements of the skin (inward, then along
        either axis of the contact plane, mm3 / MPa) and (q, g, 2n) rows of the gauges, against tangential tractions.
    strain_key : `Finger.strain_sha256`, by which tables of large strain are found.
    strain_source : computes, when a press needs it, the table of large strain without friction (False) or stuck (True),
        and keeps it under `strain_key`.
    bench : of the finger: its friction is the default of presses, its specimen the default of sweeps.
    facets : distance (mm) of the facets of a triangulated skin from the smooth surface that they approximate.
    element : with which the finger was solved.
    cached : whether it lies in the cache; what a press computes from it for specimens of any modulus is then kept
        there, too.
    """

    finger_name: str
    finger_sha256: str
    mesh_sha256: str
    mesh_size_mm: float
    at: tuple[float, float]
    gauge_names: tuple[str, ...]
    outer_modulus: float
    patch: Patch
    compliance: np.ndarray
    half_space: np.ndarray
    rows: np.ndarray
    weights: np.ndarray
    layers: np.ndarray
    strain_key: str = ""
    bench: Bench = Bench()
    facets: float = 0.0
    element: str = "Taylor-Hood"
    tangential_source: Callable[[], tuple[np.ndarray, np.ndarray]] | None = None
    strain_source: Callable[[bool], object] | None = None
    cached: bool = False

    def __repr__(self) -> str:
        return (
            f"ReducedFinger({self.finger_name!r} at {self.at} mm, {len(self.patch.xy)} nodes, "
            f"gauges {', '.join(self.gauge_names)}, size_mm {self.mesh_size_mm:g})"
        )

    @property
    def multiplicity(self) -> int:
        """Number of images of the patch."""
        return len(self.patch.images)

    @property
    def strain_rows(self) -> np.ndarray:
        """Gauge strain (g, n) per MPa of nodal pressure."""
        return self.rows[list(GAUGE_QUANTITIES).index("strain")]

    @property
    def gains(self) -> np.ndarray:
        """Weights (g,) of the strain in a reading."""
        return self.weights[list(GAUGE_QUANTITIES).index("strain")]

    @property
    def levers(self) -> np.ndarray:
        """Weights (g,) of the curvature change in a reading, mm."""
        return self.weights[list(GAUGE_QUANTITIES).index("curvature")]

    @property
    def depth(self) -> float:
        """Soft tissue below the touch-down point, mm."""
        return float(self.layers[:, 0].sum())

    @property
    def skin_thickness(self) -> float:
        """Thickness of the outer layer at the touch-down point, mm."""
        return float(self.layers[0, 0])

    @property
    def strained_depth(self) -> float:
        """Indentation (mm) that would strain the softest layer by one if all layers had the same stress."""
        thickness, modulus = self.layers.T
        return float(modulus.min() * (thickness / modulus).sum())

    @cached_property
    def tangential(self) -> tuple[np.ndarray, np.ndarray]:
        """The result of `tangential_source`, computed once. Raises `InputError` for a finger that was saved without
        it."""
        if self.tangential_source is None:
            raise InputError(f"{self!r} has no tangential compliance, which friction needs: reduce or prepare it again")
        return self.tangential_source()

    @cached_property
    def traction_rows(self) -> np.ndarray:
        """Quantities of the gauges (q, g, 3n) per MPa of nodal pressure, then of tangential tractions along both
        axes."""
        return np.concatenate([self.rows, self.tangential[1]], axis=2)

    @cached_property
    def traction_compliance(self) -> np.ndarray:
        """Weak displacement (3n, 3n) of the skin, inward and along both axes, under all tractions, mm3 / MPa."""
        n, tangential = len(self.patch.xy), self.tangential[0]
        return np.block([[np.vstack([self.compliance, tangential[:n].T]), tangential]])

    def specimen_compliance(self, specimen: Specimen, *, tractions: bool = False) -> np.ndarray:
        """Weak compliance (n, n) of a specimen's surface on the patch, mm3 / MPa; (3n, 3n) with tangential tractions.

        That of `specimen.unit` is shared by all presses and read-only. Raises `InputError` if the one with tangential
        tractions does not fit the one for pressure alone.
        """
        unit_compliance = _of_unit(self, specimen.unit, "traction_compliance" if tractions else "compliance")
        modulus = specimen.modulus if specimen.elastic else 1.0
        return unit_compliance if modulus == 1.0 else unit_compliance / modulus

    def specimen_traction_compliance(self, specimen: Specimen) -> np.ndarray:
        """Deprecated name of `specimen_compliance(specimen, tractions=True)`."""
        warnings.warn("it is now specimen_compliance(specimen, tractions=True)", DeprecationWarning, stacklevel=2)
        return self.specimen_compliance(specimen, tractions=True)

    def specimen_displacement(self, specimen: Specimen, pressure: np.ndarray) -> np.ndarray:
        """Weak displacement (n,) of a specimen's surface under nodal pressures (n,) in MPa, mm3."""
        unit_displacement = _of_unit(self, specimen.unit, "compliance") @ pressure
        return unit_displacement / (specimen.modulus if specimen.elastic else 1.0)

    def to_arrays(self, *, tangential: bool = False) -> dict[str, np.ndarray]:
        """All data as named arrays, ready for `numpy.savez`; with `tangential` also those for friction, computed if
        needed."""
        meta = {item.name: getattr(self, item.name) for item in fields(self) if item.name not in _NOT_META}
        meta |= {"schema": REDUCED_SCHEMA, "bench": vars(self.bench)}
        arrays = {name: getattr(self, name) for name in _ARRAYS}
        arrays |= {f"patch_{item.name}": getattr(self.patch, item.name) for item in fields(Patch)}
        if tangential:
            arrays |= dict(zip(_TANGENTIAL, self.tangential, strict=True))
        return arrays | {"meta": np.array(json.dumps(meta))}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> "ReducedFinger":
        """The finger of `to_arrays`; raises `FileFormatError` for anything else."""
        if "meta" not in arrays:
            raise FileFormatError("not a complete file: meta is missing")
        meta = json_value(str(arrays["meta"]), "meta", finite=False)  # The bench of a half-space is infinite
        if not isinstance(meta, dict) or meta.pop("schema", None) != REDUCED_SCHEMA:
            raise FileFormatError(f"the schema is not {REDUCED_SCHEMA}")
        try:
            meta = _META.validate_python(meta)
        except ValidationError as error:
            raise FileFormatError(f"meta: {in_words(first_of(error))}") from error
        checked = _checked(arrays, len(meta["gauge_names"]))
        patch = Patch(**{item.name: checked[f"patch_{item.name}"] for item in fields(Patch)})
        values: dict[str, Any] = {name: checked[name] for name in _ARRAYS}
        if _TANGENTIAL[0] in checked:
            values["tangential_source"] = partial(tuple, [checked[name] for name in _TANGENTIAL])
        return cls(patch=patch, **values, **meta)

    def save(self, path: str | PathLike) -> None:
        """Write the finger with all its data as .npz (no pickle); the file appears whole or not at all."""
        with replacing(path) as temporary, open(temporary, "wb") as stream:
            np.savez(stream, allow_pickle=False, **self.to_arrays(tangential=self.tangential_source is not None))

    @classmethod
    def load(cls, path: str | PathLike) -> "ReducedFinger":
        """Read a finger that `save` wrote; raises `FileFormatError` or `FileAccessError`."""
        arrays = read_arrays(path, f"reduced finger {path}")
        try:
            return cls.from_arrays(arrays)
        except FileFormatError as error:
            raise FileFormatError(f"{path} is not a reduced finger: {error}") from error


_TANGENTIAL = ("tangential_compliance", "tangential_rows")
_ARRAYS = ("compliance", "half_space", "rows", "weights", "layers")
_NOT_META = (*_ARRAYS, "patch", "tangential_source", "strain_source", "cached")
_POSITIVE, _NOT_NEGATIVE = (
    Annotated[float, Field(ge=low, le=checks.LARGEST_READING)] for low in (1 / checks.LARGEST_READING, 0)
)
_BENCH: Any = {"friction": float | str | None, "thickness": Annotated[float, Field(allow_inf_nan=True)]}
_META: TypeAdapter[dict[str, Any]] = TypeAdapter(
    table(
        dict,
        dict.fromkeys(("finger_name", "finger_sha256", "mesh_sha256"), str)
        | dict.fromkeys(("mesh_size_mm", "outer_modulus"), _POSITIVE)
        | {"at": Annotated[tuple[float, float], Field(strict=False)]}
        | {"gauge_names": Annotated[tuple[str, ...], Field(strict=False, min_length=1)]}
        | {"strain_key": (str, ""), "element": (str, "Taylor-Hood"), "facets": (_NOT_NEGATIVE, 0.0)}
        | {"bench": (table(Bench, keys_of(Bench, **_BENCH), strict_keys=True), Bench())},
        strict_keys=True,
    )
)


def _checked(arrays: Mapping[str, np.ndarray], gauges: int) -> dict[str, np.ndarray]:
    """The arrays of a reduced finger; raises `FileFormatError` for one that is missing, not finite, or of another shape
    or range."""
    nodes = len(_numbers(arrays, "patch_xy"))
    shapes = {
        "patch_xy": (nodes, 2), "patch_triangles": (None, 3), "patch_mass": (nodes,), "patch_gap": (nodes,),
        "patch_rim": (nodes,), "patch_images": (None, 2), "compliance": (nodes, nodes), "half_space": (nodes, nodes),
        "rows": (len(GAUGE_QUANTITIES), gauges, nodes), "weights": (len(GAUGE_QUANTITIES), gauges), "layers": (None, 2),
    }  # fmt: skip
    if any(name in arrays for name in _TANGENTIAL):
        side = (3 * nodes, 2 * nodes), (len(GAUGE_QUANTITIES), gauges, 2 * nodes)
        shapes |= dict(zip(_TANGENTIAL, side, strict=True))
    checked = {name: _numbers(arrays, name) for name in shapes}
    for name, shape in shapes.items():
        stated = checked[name].shape
        same = len(stated) == len(shape) and all(b in (a, None) for a, b in zip(stated, shape, strict=True))
        if not same or 0 in stated:
            expected = " x ".join("n" if side is None else str(side) for side in shape)
            raise FileFormatError(f"{name} must have the shape {expected}, has {' x '.join(map(str, stated))}")
    images, triangles, rim = (checked[f"patch_{name}"] for name in ("images", "triangles", "rim"))
    if triangles.dtype.kind not in "iu" or triangles.min() < 0 or triangles.max() >= nodes:
        raise FileFormatError(f"patch_triangles must hold whole numbers from 0 to {nodes - 1}")
    corners = checked["patch_xy"][triangles]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    around = np.bincount(triangles.ravel(), np.repeat(area / 3, 3), nodes)
    if (area <= FLAT_TRIANGLE_SHARE * area.mean()).any() or (around <= 0).any():
        raise FileFormatError("patch_triangles must not be flat, and have every node as a corner")
    if not (np.abs(np.log(np.maximum(checked["patch_mass"], 1 / checks.LARGEST_READING) / around)) < UNLIKE_MASS).all():
        raise FileFormatError("patch_mass must be the area of the triangles around each node")
    if len(images) > 4 or (np.abs(images) != 1).any():
        raise FileFormatError("patch_images must hold up to four pairs of 1 and -1")
    if rim.dtype != bool:
        raise FileFormatError("patch_rim must hold true and false")
    if (checked["layers"] < 1 / checks.LARGEST_READING).any():
        raise FileFormatError("layers must hold numbers above 0")
    for name in ("compliance", "half_space"):
        matrix = checked[name]
        skew = np.abs(matrix - matrix.T).max()
        if skew > UNLIKE_COMPLIANCE * np.abs(matrix).max() or np.linalg.eigvalsh(matrix)[0] <= 0:
            raise FileFormatError(f"{name} must be symmetric and positive definite")
    return checked


def _numbers(arrays: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    if name not in arrays:
        raise FileFormatError(f"not a complete file: {name} is missing")
    array = np.asarray(arrays[name])
    if array.dtype.kind not in "fiub" or array.ndim == 0 or not (np.abs(array) <= checks.LARGEST_READING).all():
        raise FileFormatError(f"{name} must be an array of numbers up to {checks.LARGEST_READING:g}")
    return array


@kept()
def _of_unit(reduced: ReducedFinger, unit: Specimen, name: str) -> np.ndarray:
    """The compliance on the patch by the method `name` of a specimen of 1 MPa, or of one whose compliance is not
    proportional to 1 / modulus. It takes a second, so for papilla's own specimens on a patch that is not large it is
    kept in the cache."""

    def make() -> dict[str, np.ndarray]:
        return {name: np.asarray(getattr(unit, name)(PatchSurface(reduced.patch, reduced.half_space)))}

    cacheable = type(unit).__module__ == Specimen.__module__ and len(reduced.patch.xy) <= MOST_KEPT
    key = cache.key(COMPLIANCE_BY, name, reduced.patch, repr(unit)) if cacheable else ""
    compliance = (cache.fetch("specimen", key, make) if cacheable else make())[name]
    if name == "traction_compliance":
        n, normal = len(reduced.patch.xy), _of_unit(reduced, unit, "compliance")
        if np.abs(compliance[:n, :n] - normal).max() > UNLIKE_COMPLIANCE * normal.max():
            raise InputError(
                f"{unit.words}: traction_compliance, which friction needs, does not fit compliance: override both"
            )
    shared = compliance.view()
    shared.flags.writeable = False
    return shared


def fetch_tangential(
    category: str, key: str, make: Callable[[], tuple[np.ndarray, np.ndarray]]
) -> tuple[np.ndarray, np.ndarray]:
    """The compliance and rows of `ReducedFinger.tangential` from an entry of the cache, which `make()` fills."""
    arrays = cache.fetch(category, key, lambda: dict(zip(("compliance", "rows"), make(), strict=True)))
    return arrays["compliance"], arrays["rows"]


def needs_reduced(finger: object) -> None:
    """Raise `InputError` for a finger that was not reduced; the message says how to reduce it."""
    if isinstance(finger, Finger):
        raise InputError("a ReducedFinger is needed, got a Finger: papilla.fem.prepare(finger) makes one")
