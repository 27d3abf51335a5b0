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

from papilla import checks
from papilla.errors import FileAccessError, InputError
from papilla.finger_parts import Bench as Bench
from papilla.finger_parts import Dome as Dome
from papilla.finger_parts import Gauge as Gauge
from papilla.finger_parts import Layer as Layer
from papilla.finger_parts import Ridges as Ridges
from papilla.finger_parts import Shape as Shape
from papilla.finger_parts import Slab as Slab
from papilla.finger_parts import Surfaces as Surfaces
from papilla.identified import Identified

DEFAULT_FINGER = Path(__file__).parent / "data" / "default_finger.toml"
SHIPPED_FINGERS = {
    "default": DEFAULT_FINGER,
    "published": DEFAULT_FINGER.with_name("published_finger.toml"),
    "one-gauge": DEFAULT_FINGER.with_name("one_gauge_finger.toml"),
}
"""Names that `Finger.load` takes instead of a file."""


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

        return read_design(cls, SHIPPED_FINGERS.get(str(path)) or Path(path))

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
