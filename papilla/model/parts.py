"""Parts of a finger: layers, shapes, gauges, ridges, bench, and the record of an identification, as frozen values.

Lengths are in mm, moduli in MPa. `papilla.model.finger` puts them together, `papilla.model.file` reads and writes them.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from papilla.core import checks
from papilla.core.errors import InputError
from papilla.model.specimen import THICKNESS_MM, Block, Friction, HalfSpace, friction_coefficient

if TYPE_CHECKING:
    from papilla.model.materials import Material

MODULUS_ROUNDING = (
    0.005  # Largest relative difference between a layer's modulus and that of its card: rounding to three digits
)


@dataclass(frozen=True)
class Layer:
    """An isotropic layer: small-strain Young's `modulus` in MPa and Poisson's ratio `nu` in [0, 0.5].

    `material` is its hyperelastic law at finite strain (`model.materials`); None means neo-Hookean with `modulus`.
    Raises `InputError` for values out of range, and for a material whose small-strain modulus differs from `modulus`.
    """

    modulus: float
    nu: float = 0.4999
    material: "Material | None" = None

    def __post_init__(self) -> None:
        checks.positive("layer modulus (MPa)", self.modulus)
        checks.poisson("layer nu", self.nu)
        if self.material is not None:
            card_modulus = _small_strain_modulus(self.material, self.nu)
            if abs(self.modulus / card_modulus - 1) > MODULUS_ROUNDING:
                name = self.material.kind or type(self.material).__qualname__
                raise InputError(
                    f"modulus {self.modulus:g} MPa is not that of its {name} material, {card_modulus:.4g} MPa: "
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
        where = f"gauge {checks.name('name of a gauge', self.name)}"
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
        for shift in self.moved_mm:
            checks.finite(f"{where} moved_mm", shift)
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
class Identified:
    """Parameters of a finger fitted to measured presses, their covariance, and the zeros of its bench.

    Parameters
    ----------
    status : one sentence. presses : number of fitted presses. specimen, friction : of these presses.
    zeros_microstrain : (g,) readings of the gauges in the air. touch_down_mm : measured indentation less the approach.
        A `Press` contains neither.
    parameters : (p,) names. values, lower, upper : (p,) values and ends of the 95 % intervals, in their units.
    logarithmic : (p,) whether `covariance` (p, p) is that of the parameter's logarithm.
    chi_square, freedom : of the weighted residuals, and its degrees of freedom.
    force_error, noise_microstrain : standard deviations of the force (relative) and of a reading, as stated or
        estimated from repeated presses.
    notes : weaknesses of the fit, a sentence each.
    relaxation_shares, relaxation_times_s : Prony series of the silicone; empty if no hold was measured.
    crept : lowest and highest ratio of equivalent force to force in the fitted touches (creep), or empty.

    Raises `InputError` if the lists do not fit together or a number is not finite.
    """

    status: str
    presses: int
    specimen: str
    friction: float | str
    zeros_microstrain: tuple[float, ...]
    touch_down_mm: float
    parameters: tuple[str, ...]
    logarithmic: tuple[bool, ...]
    values: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    chi_square: float
    freedom: float
    force_error: float
    noise_microstrain: float
    notes: tuple[str, ...] = ()
    relaxation_shares: tuple[float, ...] = ()
    relaxation_times_s: tuple[float, ...] = ()
    crept: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        count = len(self.parameters)
        lists = ("logarithmic", "values", "lower", "upper", "covariance")
        for name in lists:
            if len(getattr(self, name)) != count:
                raise InputError(f"identified {name} must hold {count} entries, one a parameter")
        if any(len(covariances) != count for covariances in self.covariance):
            raise InputError(f"identified covariance must be {count} x {count}")
        numbers = (
            *self.values,
            *self.lower,
            *self.upper,
            *(value for covariances in self.covariance for value in covariances),
        )
        if not all(map(math.isfinite, (*numbers, *self.zeros_microstrain, self.touch_down_mm))):
            raise InputError("identified numbers must be finite")
        if any(covariances[place] < 0 for place, covariances in enumerate(self.covariance)):
            raise InputError("identified covariance has a negative variance")
        if len(self.relaxation_shares) != len(self.relaxation_times_s):
            raise InputError("identified relaxation_shares and relaxation_times_s must be as many")
        if len(self.crept) not in (0, 2) or not all(map(math.isfinite, self.crept)):
            raise InputError(f"identified crept must be two numbers, lowest and highest, got {list(self.crept)}")
        for name, value, logarithmic in zip(self.parameters, self.values, self.logarithmic, strict=True):
            if logarithmic and value <= 0:
                raise InputError(f"identified {name} must be greater than 0, got {value:g}")

    def sigma(self, name: str) -> float:
        """Standard deviation of a parameter in its unit; relative if the parameter is logarithmic."""
        place = self.parameters.index(name)
        return math.sqrt(self.covariance[place][place])


def _small_strain_modulus(material: "Material", nu: float) -> float:
    from papilla.model.materials import checked_material

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
