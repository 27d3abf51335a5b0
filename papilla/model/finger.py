"""The sensor: shape, layers, bone, gauges and ridges, as frozen values in mm and MPa.

`Finger.default()` is the human-finger-mimetic sensor of the papers; its file, `papilla/data/default_finger.toml`,
lists every assumption. `Finger.published()` has the parameters that come closest to the published measurements.
Axes: the origin is in the middle of the base plane, z points out of the skin at the apex, x runs across the finger (the
row of gauges), y along it.
"""

import hashlib
import json
import math
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.core.outside import BINARY_BYTES, read_bytes
from papilla.core.short_repr import html_table
from papilla.model.parts import Bench, Dome, Gauge, Identified, Layer, Ridges, Shape, Slab, Surfaces

__all__ = [
    "Bench", "DEFAULT_FINGER", "Dome", "Finger", "Gauge", "Identified", "Layer", "Ridges", "SHIPPED_FINGERS", "Shape",
    "Slab", "Surfaces",
]  # fmt: skip

DEFAULT_FINGER = Path(__file__).parents[1] / "data" / "default_finger.toml"
SHIPPED_FINGERS = {
    "default": DEFAULT_FINGER,
    "published": DEFAULT_FINGER.with_name("published_finger.toml"),
    "one-gauge": DEFAULT_FINGER.with_name("one_gauge_finger.toml"),
}
"""Names that `Finger.load` accepts instead of a file."""


@dataclass(frozen=True)
class Finger:
    """A two-layer soft finger over a bone.

    `bone` is a `Layer`, or None for a rigid bone (its surface is then clamped, like the base plane). `patch_radius` is
    the largest distance (mm) of the contact from the touch-down point; None lets it follow from the shape
    (`papilla.mesh.body.patch_radius_mm`). `bench` and `identified` record how the finger was measured; they are not
    part of the finger, and no hash contains them.
    """

    name: str
    shape: Shape
    outer: Layer
    inner: Layer
    gauges: tuple[Gauge, ...]
    bone: Layer | None = None
    patch_radius: float | None = None
    ridges: Ridges | None = None
    bench: Bench = Bench()
    identified: Identified | None = None

    def __post_init__(self) -> None:
        checks.name("name of the finger", self.name)
        if self.patch_radius is not None:
            checks.positive("patch_radius (mm)", self.patch_radius)
        if not self.gauges:
            raise InputError("a finger needs at least one gauge")
        names = [gauge.name for gauge in self.gauges]
        if len(set(names)) != len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise InputError(f"gauge names must differ, got {twice} twice")
        for gauge in self.gauges:
            _check_site(gauge, self.shape)
        if self.identified is not None and len(self.identified.zeros_microstrain) != len(self.gauges):
            raise InputError(f"identified zeros_microstrain must hold {len(self.gauges)} numbers, one per gauge")

    @classmethod
    def default(cls) -> "Finger":
        """The human-finger-mimetic sensor of the papers; its file lists every assumption."""
        return cls.load(DEFAULT_FINGER)

    @classmethod
    def published(cls) -> "Finger":
        """The finger that comes closest to the published regression and depths (`benchmarks/published_finger.py`)."""
        return cls.load(SHIPPED_FINGERS["published"])

    @classmethod
    def load(cls, path: str | Path) -> "Finger":
        """A finger from a TOML design file, or a shipped one by its name in `SHIPPED_FINGERS`.

        Raises `FileAccessError` if the file cannot be read, `FileFormatError` if it is not a finger; the message names
        the file and the key.
        """
        from papilla.model.file import read_design

        return read_design(cls, SHIPPED_FINGERS.get(str(path)) or Path(path))

    def save(self, path: str | Path) -> None:
        """Write the design file atomically; raises `FileAccessError`."""
        from papilla.model.file import write_design

        write_design(self, Path(path))

    @property
    def ridge_pitch_mm(self) -> float:
        """Pitch of the ridges (mm), 0 for a smooth skin."""
        return self.ridges.pitch if self.ridges else 0.0

    def __repr__(self) -> str:
        """Name, shape, layers and number of gauges: the whole design is in `describe()`."""
        layers = f"{self.outer.modulus:g} over {self.inner.modulus:g} MPa"
        return f"Finger({self.name!r}, {type(self.shape).__name__.lower()}, {layers}, {len(self.gauges)} gauges)"

    def _repr_html_(self) -> str:
        """Shape, layers and gauges as a table, for notebooks."""
        shape = ", ".join(f"{name} {value}" for name, value in asdict(self.shape).items())
        rows = [("shape", f"{type(self.shape).__name__.lower()}: {shape} (mm)")]
        for name, layer in (("outer", self.outer), ("inner", self.inner), ("bone", self.bone)):
            rows.append((name, "rigid" if layer is None else f"{layer.modulus:g} MPa, nu {layer.nu:g}"))
        for gauge in self.gauges:
            at = f"{gauge.angle_deg:g} degrees" if gauge.x_mm is None else f"x {gauge.x_mm:g} mm"
            reads = f"{gauge.membrane_gain:.4g} x strain {gauge.lever_mm:+.4g} mm x curvature change"
            rows.append((gauge.name, f"at {at}, y {gauge.y_mm:g} mm; reads {reads}"))
        return html_table(self.name, rows)

    def describe(self) -> dict:
        """The design as plain nested values for JSON; a `Surfaces` shape is described by its file names."""
        layers = {name: _describe(getattr(self, name)) for name in ("outer", "inner", "bone")}
        described = {name: value for name, value in asdict(self).items() if name not in ("bench", "identified")}
        # Without a `moved_mm` of zero, so that the hashes of older designs stay the same
        described["gauges"] = tuple(
            {key: value for key, value in gauge.items() if key != "moved_mm" or any(value)}
            for gauge in described["gauges"]
        )
        return {**described, **layers, "shape": {"kind": type(self.shape).__name__.lower(), **asdict(self.shape)}}

    @cached_property
    def sha256(self) -> str:
        """Hash of the whole design; for `Surfaces` it contains the bytes of the files, not their names."""
        return _digest({**self.describe(), "shape": self._shape_content()})

    @cached_property
    def geometry_sha256(self) -> str:
        """Hash of what the mesh depends on: shape, patch radius, gauge sites, and whether the bone is meshed."""
        sites = [
            [gauge.angle_deg, gauge.x_mm, gauge.y_mm, *(gauge.moved_mm if any(gauge.moved_mm) else ())]
            for gauge in self.gauges
        ]
        bone = self.bone is not None
        return _digest({"shape": self._shape_content(), "patch": self.patch_radius, "sites": sites, "bone": bone})

    @cached_property
    def strain_sha256(self) -> str:
        """Hash that selects the tables of large strain.

        With force and moduli over E_inner, strain depends on E_outer / E_inner, which the tables have as a variable,
        and on what is hashed here: geometry, gauge sites, Poisson's ratios, the material laws over their shear modulus,
        and E_bone / E_inner. `moved_mm` of a gauge is left out: the table of its designed site serves it.
        """
        layers = {name: _describe_shape(getattr(self, name)) for name in ("outer", "inner")}
        bone = self.bone and [round(self.bone.modulus / self.inner.modulus, 9), self.bone.nu]
        reads = ("name", "membrane_gain", "lever_mm", "moved_mm")
        sites = [{key: value for key, value in asdict(gauge).items() if key not in reads} for gauge in self.gauges]
        return _digest({"shape": self._shape_content(), "layers": layers, "bone": bone, "sites": sites})

    def _shape_content(self) -> dict:
        if not isinstance(self.shape, Surfaces):
            return {"kind": type(self.shape).__name__.lower(), **asdict(self.shape)}
        return {"kind": "surfaces", **{key: _file_digest(path) for key, path in asdict(self.shape).items()}}


def _describe(layer: Layer | None) -> dict | None:
    """A layer as plain values, without `material` if it has none, so that the hashes of older designs stay the same."""
    if layer is None:
        return None
    card = {} if layer.material is None else {"material": layer.material.describe()}
    return {"modulus": layer.modulus, "nu": layer.nu, **card}


def _describe_shape(layer: Layer) -> dict:
    """A layer without its stiffness: Poisson's ratio, and its material law divided by the shear modulus."""
    if layer.material is None or layer.material.kind == "neo-hookean":
        return {"nu": layer.nu, "kind": "neo-hookean"}
    mu, card, moduli = layer.material.shear_modulus, layer.material.describe(), layer.material.in_MPa
    return {"nu": layer.nu} | {key: round(value / mu, 9) if key in moduli else value for key, value in card.items()}


def _digest(value: dict) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def _file_digest(path: str) -> str:
    return hashlib.sha256(read_bytes(path, "surface file", BINARY_BYTES)).hexdigest()


def _check_site(gauge: Gauge, shape: Shape) -> None:
    """Refuse a gauge that is not on the interface of a dome or slab; surfaces from files are checked by the mesher."""
    if isinstance(shape, Surfaces):
        if gauge.x_mm is None:
            raise InputError(f"gauge {gauge.name}: a finger from surface files needs x_mm, not angle_deg")
        return
    half_width, reach = shape.interface[0], shape.depth / 2 if isinstance(shape, Slab) else shape.interface[1]
    if abs(gauge.y_mm) >= reach:
        raise InputError(f"gauge {gauge.name} lies outside the interface: |y_mm| {abs(gauge.y_mm):g} >= {reach:g}")
    if isinstance(shape, Dome):
        half_width *= math.sqrt(1 - (gauge.y_mm / reach) ** 2)
    if gauge.x_mm is not None and abs(gauge.x_mm) >= half_width:
        raise InputError(f"gauge {gauge.name} lies outside the interface: |x_mm| {abs(gauge.x_mm):g} >= {half_width:g}")
