"""The sensor: shape, layers, bone, gauges and ridges, as frozen values in mm and MPa.

`Finger.default()` is the human-finger-mimetic sensor of the papers; its file, `papilla/data/default_finger.toml`,
lists every assumption. `Finger.published()` is the same with the parameters that come closest to what was published of
it. Axes: origin in the middle of the base plane, z out of the skin at the apex, x across the finger
(the row of gauges), y along it.
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
from papilla.specimen import THICKNESS_MM, Block, Friction, friction_coefficient

if TYPE_CHECKING:
    from papilla.materials import Material

DEFAULT_FINGER = Path(__file__).parent / "data" / "default_finger.toml"
SHIPPED_FINGERS = {
    "default": DEFAULT_FINGER,
    "published": DEFAULT_FINGER.with_name("published_finger.toml"),
    "one-gauge": DEFAULT_FINGER.with_name("one_gauge_finger.toml"),
}
"""Names that `Finger.load` takes instead of a file."""

ROUNDING = 0.005  # Relative difference of a layer's modulus from its material's that three written digits explain


@dataclass(frozen=True)
class Layer:
    """An isotropic layer: small-strain Young's `modulus` in MPa and Poisson's ratio `nu` in [0, 0.5].

    `material` is its hyperelastic card (`papilla.materials`) at finite strain, None for neo-Hookean with `modulus`.
    Raises `InputError` for values out of range and for a card whose small-strain modulus is another one.
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
        """A layer of a hyperelastic material, its modulus E = 2 mu (1 + nu) taken from the card."""
        return cls(_small_strain_modulus(material, checks.poisson("layer nu", nu)), nu, material)


@dataclass(frozen=True)
class Dome:
    """Half ellipsoids about the origin, cut at z = 0; semi-axes (x, y, z) in mm, each nested in the one before."""

    outer: tuple[float, float, float]
    interface: tuple[float, float, float]
    bone: tuple[float, float, float]

    def __post_init__(self) -> None:
        _check_nested(self, ("x", "y", "z"))


@dataclass(frozen=True)
class Slab:
    """A half-elliptic section in x-z, extruded over -depth/2 <= y <= depth/2; semi-axes (x, z) and depth in mm."""

    outer: tuple[float, float]
    interface: tuple[float, float]
    bone: tuple[float, float]
    depth: float = 10.0

    def __post_init__(self) -> None:
        checks.positive("slab depth (mm)", self.depth)
        _check_nested(self, ("x", "z"))


@dataclass(frozen=True)
class Surfaces:
    """Three closed surfaces from STL, PLY or VTP files in mm, each nested in the one before."""

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
    """A foil gauge on the interface of the layers.

    Parameters
    ----------
    name : label, used in logs and files.
    angle_deg : site as the ellipse parameter in the x-z section at `y_mm` (0 at the apex); for `Dome` and `Slab`.
    x_mm : site by its x instead (any shape); exactly one of `angle_deg` and `x_mm` is given.
    y_mm : site along the finger.
    moved_mm : how far it was glued from that site, along the interface towards greater x, and towards greater y.
    direction_deg : grid direction in the tangent plane, from the interface's x-z tangent towards y.
    length_mm, width_mm : of the grid, over which strain is the mean: the elongation between interface points a length
        apart, averaged over the width.
    backing_mm : length and width of the foil over which the curvature is fitted.
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
    """Ridges of the skin, along y, in mm: only sliding scenes use them."""

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
    """How a finger was pressed when its parameters were told, and is again unless something else is asked for.

    thickness : of the blocks (mm). friction : Coulomb's coefficient, "stick", or None where it is not known.
    touch_down : what depths of the bench exceed the indentation by (mm), its touch being told that much early.
    """

    thickness: float = THICKNESS_MM
    friction: Friction | None = None
    touch_down: float = 0.0

    def __post_init__(self) -> None:
        checks.positive("bench thickness (mm)", self.thickness)
        checks.finite("bench touch_down (mm)", self.touch_down)
        if self.friction is not None:
            friction_coefficient(self.friction)

    def specimen(self, modulus: float) -> Block:
        """The block of a modulus (MPa) that is pressed."""
        return Block(modulus, self.thickness)


@dataclass(frozen=True)
class Finger:
    """A two-layer soft finger over a bone.

    `bone` is a `Layer`, or None where the bone is rigid (its surface is then clamped, like the base plane).
    `patch_radius` (mm) is how far from the touch-down point contact may spread. `bench` and `identified`, what presses
    of the real finger told of it, are no part of the finger, and of none of its hashes.
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
            raise InputError(f"identified zeros_microstrain must hold {len(self.gauges)} numbers, one a gauge")

    @classmethod
    def default(cls) -> "Finger":
        """The human-finger-mimetic sensor of the papers (every assumption is listed in its file)."""
        return cls.load(DEFAULT_FINGER)

    @classmethod
    def published(cls) -> "Finger":
        """The finger that comes closest to the published regression and depths (`benchmarks/published_finger.py`)."""
        return cls.load(SHIPPED_FINGERS["published"])

    @classmethod
    def load(cls, path: str | Path) -> "Finger":
        """A finger from its TOML design file, or that of a name of `SHIPPED_FINGERS`.

        Raises `FileAccessError` where the file cannot be read, `FileFormatError` where it is not a finger; the
        message names the file and the key.
        """
        from papilla.finger_file import read_design

        return read_design(SHIPPED_FINGERS.get(str(path)) or Path(path))

    def save(self, path: str | Path) -> None:
        """Write the design file, whole or not at all; raises `FileAccessError`."""
        from papilla.finger_file import write_design

        write_design(self, Path(path))

    @property
    def ridge_pitch_mm(self) -> float:
        """Pitch of its ridges, 0 for a smooth skin."""
        return self.ridges.pitch if self.ridges else 0.0

    def __repr__(self) -> str:
        """Name, shape, layers and number of gauges: the whole design is in `describe()`."""
        layers = f"{self.outer.modulus:g} over {self.inner.modulus:g} MPa"
        return f"Finger({self.name!r}, {type(self.shape).__name__.lower()}, {layers}, {len(self.gauges)} gauges)"

    def describe(self) -> dict:
        """The design as plain nested values, ready for JSON; `Surfaces` shapes name their files."""
        layers = {name: _describe(getattr(self, name)) for name in ("outer", "inner", "bone")}
        own = {name: value for name, value in asdict(self).items() if name not in ("bench", "identified")}
        own["gauges"] = tuple(map(_describe_gauge, self.gauges))
        return {**own, **layers, "shape": {"kind": type(self.shape).__name__.lower(), **asdict(self.shape)}}

    @cached_property
    def sha256(self) -> str:
        """Content hash of the whole design; of `Surfaces`, the files' bytes count, not their names."""
        return _digest({**self.describe(), "shape": self._shape_content()})

    @cached_property
    def geometry_sha256(self) -> str:
        """Content hash of what a mesh depends on: shape, patch radius, gauge sites, and whether the bone is meshed."""
        sites = [
            [gauge.angle_deg, gauge.x_mm, gauge.y_mm, *(gauge.moved_mm if any(gauge.moved_mm) else ())]
            for gauge in self.gauges
        ]
        bone = self.bone is not None
        return _digest({"shape": self._shape_content(), "patch": self.patch_radius, "sites": sites, "bone": bone})

    @cached_property
    def strain_sha256(self) -> str:
        """Content hash of what all strains depend on besides the ratio of the layers, force and specimen being in units
        of the inner one: geometry, gauge sites, Poisson's ratios, the shape of the cards, bone over inner layer. Gauges
        that were moved a little feel what large strain changes as where they were meant to be."""
        layers = {name: _describe_shape(getattr(self, name)) for name in ("outer", "inner")}
        bone = self.bone and [round(self.bone.modulus / self.inner.modulus, 9), self.bone.nu]
        reads = ("name", "membrane_gain", "lever_mm", "moved_mm")
        sites = [{key: value for key, value in asdict(gauge).items() if key not in reads} for gauge in self.gauges]
        return _digest({"shape": self._shape_content(), "layers": layers, "bone": bone, "sites": sites})

    def _shape_content(self) -> dict:
        if not isinstance(self.shape, Surfaces):
            return {"kind": type(self.shape).__name__.lower(), **asdict(self.shape)}
        return {"kind": "surfaces", **{key: _file_digest(path) for key, path in asdict(self.shape).items()}}


def _small_strain_modulus(material: "Material", nu: float) -> float:
    from papilla.materials import NeoHookean, Ogden, Yeoh

    if not isinstance(material, NeoHookean | Yeoh | Ogden):
        raise InputError(f"layer material must be NeoHookean, Yeoh or Ogden, got {type(material).__name__}")
    return 2 * material.shear_modulus * (1 + nu)


def _describe_gauge(gauge: Gauge) -> dict:
    """A gauge as plain values; where it was not moved there is no word of it, so that hashes stay what they were."""
    return {key: value for key, value in asdict(gauge).items() if key != "moved_mm" or any(value)}


def _describe(layer: Layer | None) -> dict | None:
    """A layer as plain values; without a card there is no word of one, so that hashes stay what they were."""
    if layer is None:
        return None
    card = {} if layer.material is None else {"material": layer.material.describe()}
    return {"modulus": layer.modulus, "nu": layer.nu, **card}


def _describe_shape(layer: Layer) -> dict:
    """A layer without its stiffness: Poisson's ratio, and its card over its shear modulus."""
    if layer.material is None or layer.material.kind == "neo-hookean":
        return {"nu": layer.nu, "kind": "neo-hookean"}
    mu, card = layer.material.shear_modulus, layer.material.describe()
    return {"nu": layer.nu} | {
        key: round(value / mu, 9) if key.startswith(("mu", "c")) else value for key, value in card.items()
    }


def _digest(value: dict) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def _file_digest(path: str) -> str:
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError as error:
        raise FileAccessError(f"cannot read surface file {path}: {error.strerror}") from error


def _check_nested(shape: Dome | Slab, axes: tuple[str, ...]) -> None:
    """Each surface must lie strictly inside the one before, or a layer would be thicker than the finger."""
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


def _check_site(gauge: Gauge, shape: Shape) -> None:
    """A gauge of an analytic shape must sit on the interface, away from its edge; files are checked when meshed."""
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
