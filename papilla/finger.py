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
from typing import TYPE_CHECKING

from papilla import checks
from papilla.errors import FileAccessError, InputError
from papilla.identified import Identified
from papilla.short_repr import html_table
from papilla.specimen import THICKNESS_MM, Block, Friction, HalfSpace, friction_coefficient

if TYPE_CHECKING:
    from papilla.materials import Material

DEFAULT_FINGER = Path(__file__).parent / "data" / "default_finger.toml"
SHIPPED_FINGERS = {
    "default": DEFAULT_FINGER,
    "published": DEFAULT_FINGER.with_name("published_finger.toml"),
    "one-gauge": DEFAULT_FINGER.with_name("one_gauge_finger.toml"),
}
"""Names that `Finger.load` accepts instead of a file."""

ROUNDING = 0.005  # Largest relative difference between a layer's modulus and that of its card: rounding to three digits


@dataclass(frozen=True)
class Layer:
    """An isotropic layer: small-strain Young's `modulus` in MPa and Poisson's ratio `nu` in [0, 0.5].

    `material` is its hyperelastic law at finite strain (`papilla.materials`); None means neo-Hookean with `modulus`.
    Raises `InputError` for values out of range, and for a material whose small-strain modulus differs from `modulus`.
    """

    modulus: float
    nu: float = 0.4999
    material: "Material | None" = None

    def __post_init__(self) -> None:
        checks.positive("layer modulus (MPa)", self.modulus)
        checks.poisson("layer nu", self.nu)
        if self.material is not None:
            own = _small_strain_modulus(self.material, self.nu)
            if abs(self.modulus / own - 1) > ROUNDING:
                raise InputError(
                    f"modulus {self.modulus:g} MPa is not that of its {self.material.kind} material, {own:.4g} MPa: "
                    "leave the modulus out or correct one of them"
                )

    @classmethod
    def of(cls, material: "Material", nu: float = 0.4999) -> "Layer":
        """A layer of a hyperelastic material, with the material's small-strain modulus E = 2 mu (1 + nu)."""
        return cls(_small_strain_modulus(material, checks.poisson("layer nu", nu)), nu, material)


@dataclass(frozen=True)
class Dome:
    """Half ellipsoids z >= 0 about the origin, with semi-axes (x, y, z) in mm; each lies inside the one before."""

    outer: tuple[float, float, float]
    interface: tuple[float, float, float]
    bone: tuple[float, float, float]

    def __post_init__(self) -> None:
        _check_nested(self, ("x", "y", "z"))


@dataclass(frozen=True)
class Slab:
    """A half-elliptic x-z section, extruded over -depth/2 <= y <= depth/2; semi-axes (x, z) and depth in mm."""

    outer: tuple[float, float]
    interface: tuple[float, float]
    bone: tuple[float, float]
    depth: float = 10.0

    def __post_init__(self) -> None:
        checks.positive("slab depth (mm)", self.depth)
        _check_nested(self, ("x", "z"))


@dataclass(frozen=True)
class Surfaces:
    """Three closed surfaces in mm from STL, PLY or VTP files; each lies inside the one before."""

    outer: str
    interface: str
    bone: str

    def __post_init__(self) -> None:
        for name in (self.outer, self.interface, self.bone):
            if "\0" in str(name):
                raise InputError(f"the name of surface file {str(name)!r} holds a NUL character")


Shape = Dome | Slab | Surfaces


@dataclass(frozen=True)
class Gauge:
    """A foil gauge on the interface between the layers.

    Parameters
    ----------
    name : label, used in logs and files.
    angle_deg : site as the ellipse parameter in the x-z section at `y_mm` (0 at the apex); for `Dome` and `Slab`.
    x_mm : site by its x coordinate instead (any shape). Give exactly one of `angle_deg` and `x_mm`.
    y_mm : y coordinate of the site.
    moved_mm : distance of the real gauge from this site, along the interface towards +x, and towards +y.
    direction_deg : grid direction in the tangent plane, from the interface's x-z tangent towards y.
    length_mm, width_mm : of the grid. Strain is the elongation between interface points one length apart, averaged over
        length and width.
    backing_mm : length and width of the foil; the curvature is fitted over it.
    membrane_gain, lever_mm : reading = membrane_gain * strain + lever_mm * curvature change (1/mm).
    """

    name: str
    angle_deg: float | None = None
    x_mm: float | None = None
    y_mm: float = 0.0
    moved_mm: tuple[float, float] = (0.0, 0.0)
    direction_deg: float = 0.0
    length_mm: float = 2.4
    width_mm: float = 2.0
    backing_mm: tuple[float, float] = (4.8, 2.0)
    membrane_gain: float = 1.0
    lever_mm: float = 0.0

    def __post_init__(self) -> None:
        where = f"gauge {self.name}"
        if (self.angle_deg is None) == (self.x_mm is None):
            raise InputError(f"{where}: give exactly one of angle_deg and x_mm")
        if self.angle_deg is not None and not abs(checks.finite(f"{where} angle_deg", self.angle_deg)) < 90:
            raise InputError(
                f"{where} lies outside the interface: angle_deg {self.angle_deg:g} is not between -90 and 90"
            )
        if self.x_mm is not None:
            checks.finite(f"{where} x_mm", self.x_mm)
        for key in ("y_mm", "direction_deg", "membrane_gain", "lever_mm"):
            checks.finite(f"{where} {key}", getattr(self, key))
        for part in self.moved_mm:
            checks.finite(f"{where} moved_mm", part)
        for key in ("length_mm", "width_mm"):
            checks.positive(f"{where} {key}", getattr(self, key))
        for side in self.backing_mm:
            checks.positive(f"{where} backing_mm", side)


@dataclass(frozen=True)
class Ridges:
    """Ridges of the skin, parallel to y, in mm; only sliding scenes use them."""

    pitch: float
    width: float
    height: float

    def __post_init__(self) -> None:
        for key in ("pitch", "width", "height"):
            checks.positive(f"ridge {key} (mm)", getattr(self, key))
        if self.width >= self.pitch:
            raise InputError(f"ridge width {self.width:g} mm must be smaller than the pitch {self.pitch:g} mm")


@dataclass(frozen=True)
class Bench:
    """The bench on which a finger was identified: specimen and friction that presses and sweeps use by default.

    thickness : of the blocks, mm; infinite where the specimens are half-spaces. friction : Coulomb coefficient,
    "stick", or None if unknown. touch_down : by how much a depth measured on the bench exceeds the indentation (mm),
    because the bench reports the touch too early.
    """

    thickness: float = THICKNESS_MM
    friction: Friction | None = None
    touch_down: float = 0.0

    def __post_init__(self) -> None:
        if self.thickness != math.inf:
            checks.positive("bench thickness (mm)", self.thickness)
        checks.finite("bench touch_down (mm)", self.touch_down)
        if self.friction is not None:
            friction_coefficient(self.friction)

    def specimen(self, modulus: float) -> Block | HalfSpace:
        """The block, or half-space, of this bench with a modulus (MPa)."""
        return HalfSpace(modulus) if self.thickness == math.inf else Block(modulus, self.thickness)


@dataclass(frozen=True)
class Finger:
    """A two-layer soft finger over a bone.

    `bone` is a `Layer`, or None for a rigid bone (its surface is then clamped, like the base plane). `patch_radius` is
    the largest distance (mm) of the contact from the touch-down point. `bench` and `identified` record how the finger
    was measured; they are not part of the finger, and no hash contains them.
    """

    name: str
    shape: Shape
    outer: Layer
    inner: Layer
    gauges: tuple[Gauge, ...]
    bone: Layer | None = None
    patch_radius: float = 15.0
    ridges: Ridges | None = None
    bench: Bench = Bench()
    identified: Identified | None = None

    def __post_init__(self) -> None:
        checks.positive("patch_radius (mm)", self.patch_radius)
        if not self.gauges:
            raise InputError("a finger needs at least one gauge")
        names = [gauge.name for gauge in self.gauges]
        if len(set(names)) != len(names):
            raise InputError(f"gauge names must differ, got {', '.join(names)}")
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
        from papilla.finger_file import read_design

        return read_design(cls, SHIPPED_FINGERS.get(str(path)) or Path(path))

    def save(self, path: str | Path) -> None:
        """Write the design file atomically; raises `FileAccessError`."""
        from papilla.finger_file import write_design

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
        own = {name: value for name, value in asdict(self).items() if name not in ("bench", "identified")}
        own["gauges"] = tuple(map(_describe_gauge, self.gauges))
        return {**own, **layers, "shape": {"kind": type(self.shape).__name__.lower(), **asdict(self.shape)}}

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


def _describe_gauge(gauge: Gauge) -> dict:
    """A gauge as plain values, without a `moved_mm` of zero, so that the hashes of older designs stay the same."""
    return {key: value for key, value in asdict(gauge).items() if key != "moved_mm" or any(value)}


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
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError as error:
        raise FileAccessError(f"cannot read surface file {path}: {error.strerror}") from error


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


def _small_strain_modulus(material: "Material", nu: float) -> float:
    from papilla.materials import checked_material

    return 2 * checked_material("layer material", material).shear_modulus * (1 + nu)


def _check_nested(shape: Dome | Slab, axes: tuple[str, ...]) -> None:
    """Refuse semi-axes that are not smaller than those of the surface around them."""
    for surface in ("outer", "interface", "bone"):
        for axis, value in zip(axes, getattr(shape, surface), strict=True):
            checks.positive(f"{surface} semi-axis {axis} (mm)", value)
    for inside, around in (("interface", "outer"), ("bone", "interface")):
        for axis, small, large in zip(axes, getattr(shape, inside), getattr(shape, around), strict=True):
            if small >= large:
                raise InputError(
                    f"{inside} semi-axis {axis} {small:g} mm must be smaller than {around}'s {large:g} mm: "
                    "the layer would be thicker than what it covers"
                )
