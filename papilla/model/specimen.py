"""Specimens: their modulus in MPa, lengths in mm, and the mechanics that a press needs.

A press uses a specimen's `gap`, `compliance`, `curvature` and limits. A specimen of your own derives from `Specimen`
and overrides what differs from a flat half-space.
"""

import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, Protocol

from papilla.core import checks
from papilla.core.errors import ContactRangeError, InputError
from papilla.core.units import PER_CENT

if TYPE_CHECKING:
    import numpy as np

THICKNESS_MM = 10.0
"""Default thickness of the block of sweeps, calibrations and commands."""

DEFAULT_NU = 0.495
"""Default Poisson's ratio of a specimen."""

GAP_BESIDE_RADII = 1e3
"""Gap beside a ball, in ball radii: far beyond any contact."""

LARGEST_BLOCK_SHARE = 0.5
"""Largest share of a bonded block's thickness that a press may take."""

EXTREME_SIZE = 1e100
"""Moduli (MPa) and lengths (mm) above this, or below its inverse, are refused, because their squares exceed
floating-point numbers."""


STICK_WORD = "stick"
"""The friction with which nothing slips."""

Friction = float | str
"""Coulomb's coefficient between finger and specimen, 0 for none, or `STICK_WORD`."""


def friction_words(friction: float) -> Friction:
    """The `friction` of a coefficient: infinite is `STICK_WORD`."""
    return STICK_WORD if math.isinf(friction) else friction


def friction_coefficient(friction: Friction) -> float:
    """Coulomb's coefficient of a `friction`, infinite for `STICK_WORD`; raises `InputError` for anything else."""
    if friction == STICK_WORD:
        return math.inf
    try:
        value = checks.finite("friction", friction)
    except InputError:
        value = -1.0
    if value < 0:
        raise InputError(f'friction must be a number of at least 0 or "{STICK_WORD}", got {friction!r}')
    return value


def physics_words(specimen: "Specimen", friction: Friction, large_strain: bool) -> str:
    """The physics of a press in the words that every command uses: the specimen, the friction (Coulomb's coefficient,
    infinite for stick, or a word), and whether large strain is included."""
    strain = "included" if large_strain else "not included"
    friction_word = friction if isinstance(friction, str) else friction_words(friction)
    return f"{specimen.words}, friction {friction_word}, large strain {strain}"


class ContactSurface(Protocol):
    """The patch on which a specimen computes its compliance; n nodes."""

    @property
    def half_space(self) -> "np.ndarray":
        """(n, n) weak compliance of a half-space with E / (1 - nu^2) = 1 MPa, in mm3 / MPa."""

    def kernel(self, kernel: Callable[["np.ndarray"], "np.ndarray"], /) -> "np.ndarray":
        """(n, n) weak compliance of a smooth kernel: mm of displacement per N at a distance in mm."""

    def half_space_tractions(self, nu: float, /) -> "np.ndarray":
        """(3n, 3n) weak compliance of a half-space of 1 MPa against pressure and tangential tractions, in mm3 / MPa."""

    def green_tractions(self, green: Callable[["np.ndarray"], "np.ndarray"], /) -> "np.ndarray":
        """(3n, 3n) the same of a smooth Green's tensor (..., 3, 3), in mm / N, of offsets (..., 2) in mm."""


_OF_THE_MODULUS = {"compliance", "traction_compliance", "contact_modulus", "gap", "curvature"}
"""Members that may depend on the modulus in another way if a user's class overrides them."""


@dataclass(frozen=True, eq=False)
class Specimen:
    """A flat, thick and wide specimen of Young's `modulus` (MPa); the base of all specimens.

    Results that a press computes for a specimen are kept for the next press. Two specimens of one class are equal if
    all their fields are equal; array fields are equal only if they are the same object.
    """

    modulus: float
    nu = DEFAULT_NU
    elastic: ClassVar[bool] = True
    """Whether compliances are proportional to 1 / modulus and the shape does not depend on it: then a press computes
    both once, for 1 MPa. A class that overrides one of them and does not state `elastic` gets False: a press computes
    both for every modulus."""

    def __init_subclass__(cls, **others):
        super().__init_subclass__(**others)
        if _OF_THE_MODULUS & vars(cls).keys() and "elastic" not in vars(cls):
            cls.elastic = False

    @cached_property
    def unit(self) -> "Specimen":
        """The same specimen of 1 MPa, whose compliances over `modulus` are this one's."""
        return replace(self, modulus=1.0) if self.elastic else self

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Specimen) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    @cached_property
    def _content(self) -> tuple:
        values = (getattr(self, item.name) for item in fields(self))
        return type(self), *(value if isinstance(value, Hashable) else id(value) for value in values)

    def __post_init__(self):
        """Refuse a value that is not a positive number, or a Poisson's ratio outside [0, 0.5]."""
        for name, value in vars(self).items():
            if isinstance(value, bool):
                continue
            if name == "nu":
                checks.poisson("specimen nu", value)
            else:
                label = f"specimen {name} ({'MPa' if name == 'modulus' else 'mm'})"
                checks.within(label, checks.positive(label, value), 1 / EXTREME_SIZE, EXTREME_SIZE)

    @property
    def contact_modulus(self) -> float:
        """E / (1 - nu^2) in MPa: what a vanishing contact feels."""
        return self.modulus / (1 - self.nu**2)

    def gap(self, points: "np.ndarray") -> "np.ndarray":
        """Height (k,) in mm of the undeformed surface over points (k, 2) of the contact plane; 0 at the origin."""
        return 0.0 * points[:, 0]

    def slope(self, points: "np.ndarray") -> "np.ndarray":
        """Derivatives (k, 2) of the gap along x and y at points (k, 2), by central differences."""
        import numpy as np

        step = 1e-6 * float(np.abs(points).max() or 1.0)
        sides = [[self.gap(points + sign * step * axis) for sign in (1, -1)] for axis in np.eye(2)]
        return np.stack([(above - below) / (2 * step) for above, below in sides], axis=1)

    @property
    def curvature(self) -> tuple[float, float] | None:
        """Second derivatives (1/mm) of the gap along x and y at the origin; None if Hertz's law does not apply."""
        flat = type(self).gap is Specimen.gap
        return (0.0, 0.0) if flat else None

    @property
    def detail(self) -> float:
        """The largest element (mm) of a patch that resolves the specimen's shape and compliance."""
        return math.inf

    def compliance(self, surface: ContactSurface) -> "np.ndarray":
        """Weak compliance (n, n) of the specimen on a patch, mm3 / MPa."""
        return surface.half_space / self.contact_modulus

    def traction_compliance(self, surface: ContactSurface) -> "np.ndarray":
        """Weak compliance (3n, 3n) against pressure, then tangential tractions along x and y, mm3 / MPa.

        Only friction asks for it; its first (n, n) block is `compliance`.
        """
        return surface.half_space_tractions(self.nu) / self.modulus

    @property
    def has_traction_compliance(self) -> bool:
        """Whether `traction_compliance` belongs to the specimen's `compliance`: then its own deformation turns the
        pressure at finite strain. It does not where a class replaces the latter alone."""
        pressed, dragged = (
            next(owner for owner in type(self).__mro__ if name in vars(owner))
            for name in ("compliance", "traction_compliance")
        )
        return issubclass(dragged, pressed)

    def refuse(self, taken: float, radius: float) -> None:
        """Raise `ContactRangeError` if the specimen's law does not hold for an indentation of `taken` mm into it, or
        for a contact `radius` (mm)."""

    @property
    def words(self) -> str:
        """The specimen in words, without its modulus."""
        return type(self).__name__


@dataclass(frozen=True, eq=False)
class HalfSpace(Specimen):
    """A flat specimen, thick and wide against the contact.

    Parameters
    ----------
    modulus : Young's modulus in MPa, > 0; `inf` is not accepted, use a large modulus for a rigid flat.
    nu : Poisson's ratio in [0, 0.5].
    """

    nu: float = DEFAULT_NU

    @property
    def words(self) -> str:
        """The specimen in words."""
        return "half-space"


@dataclass(frozen=True, eq=False)
class Block(Specimen):
    """A flat layer of `thickness` mm on a rigid table, bonded to it or sliding; a sweep presses on `THICKNESS_MM`."""

    thickness: float
    nu: float = DEFAULT_NU
    bonded: bool = True
    elastic: ClassVar[bool] = True

    @property
    def detail(self) -> float:
        """Elements of 2.5 thicknesses resolve the layer's compliance to 1.4 %."""
        return 2.5 * self.thickness

    def compliance(self, surface: ContactSurface) -> "np.ndarray":
        """Weak compliance (n, n) of the layer, mm3 / MPa: that of a half-space plus a smooth kernel."""
        from papilla.references import LayerKernel

        layer = surface.kernel(LayerKernel(self.thickness, self.nu, self.bonded))
        return super().compliance(surface) + layer / self.modulus

    def traction_compliance(self, surface: ContactSurface) -> "np.ndarray":
        """Weak compliance (3n, 3n) of the layer under all tractions, mm3 / MPa; raises `InputError` for a sliding
        block, which nothing holds."""
        from papilla.references import BondedLayerGreen

        if not self.bonded:
            raise InputError("friction needs a block that is bonded to its table: nothing holds a sliding one")
        bonded = surface.green_tractions(BondedLayerGreen(self.thickness, self.nu)) / self.modulus
        return super().traction_compliance(surface) + bonded

    @property
    def has_traction_compliance(self) -> bool:
        """A block that slides on its table has none."""
        return self.bonded and super().has_traction_compliance

    def refuse(self, taken: float, radius: float) -> None:
        """Raise `ContactRangeError` if the press takes more than half of the block's thickness."""
        if taken > LARGEST_BLOCK_SHARE * self.thickness:
            raise ContactRangeError(
                f"the press takes {taken:.3g} mm off a block of {self.thickness:g} mm: "
                f"more than {PER_CENT * LARGEST_BLOCK_SHARE:g} % is beyond the model"
            )

    @property
    def words(self) -> str:
        """The block in words, without its modulus."""
        return f"block {self.thickness:g} mm thick" + ("" if self.bonded else ", sliding on its table")


@dataclass(frozen=True, eq=False)
class Sphere(Specimen):
    """A solid ball of `radius` mm; its compliance is that of a half-space (Hertz), its gap is the exact sphere's."""

    radius: float
    nu: float = DEFAULT_NU
    elastic: ClassVar[bool] = True

    def gap(self, points: "np.ndarray") -> "np.ndarray":
        """Height (k,) in mm of the ball over points (k, 2); beside it there is nothing to touch."""
        import numpy as np

        x, y = points.T / self.radius
        square = x**2 + y**2
        under = square < 1
        return self.radius * np.where(under, square / (1 + np.sqrt(np.where(under, 1 - square, 1.0))), GAP_BESIDE_RADII)

    def slope(self, points: "np.ndarray") -> "np.ndarray":
        """Derivatives (k, 2) of the ball's height; zero beside it."""
        import numpy as np

        scaled = points / self.radius
        square = (scaled**2).sum(axis=1)[:, None]
        return np.where(square < 1, scaled / np.sqrt(np.where(square < 1, 1 - square, 1.0)), 0.0)

    @property
    def curvature(self) -> tuple[float, float]:
        """1 / radius along x and y."""
        return 1 / self.radius, 1 / self.radius

    @property
    def detail(self) -> float:
        """Elements of half a radius resolve a ball."""
        return self.radius / 2

    def refuse(self, taken: float, radius: float) -> None:
        """Raise `ContactRangeError` if the ball's face would be steeper than 45 degrees at the contact's edge."""
        if radius > self.radius / math.sqrt(2):
            raise ContactRangeError(
                f"a contact of {radius:.3g} mm radius is too wide for a ball of {self.radius:g} mm radius: "
                "its face is steeper than 45 degrees there, beyond the model"
            )

    @property
    def words(self) -> str:
        """The ball in words, without its modulus."""
        return f"ball of {self.radius:g} mm radius"


SPECIMEN_KINDS: dict[str, Callable[..., Specimen]] = {"half-space": HalfSpace, "block": Block, "sphere": Sphere}
"""Name of a specimen in files and options -> its class, which takes a modulus and its length, if it has one."""


@dataclass(frozen=True)
class Grating:
    """A rigid plate with straight grooves along y: `groove` and `ridge` widths and groove `depth`, in mm.

    Its section is a trapezoid whose flanks, `flank` mm wide each, belong to the groove; or with `form` "sine" a sine of
    the same period and depth. The middle of a ridge is at x = 0. Gratings are for sliding scenes; a press refuses them.
    Raises `InputError` for lengths that are not positive, and flanks that do not fit into the groove.
    """

    groove: float
    ridge: float
    depth: float
    form: str = "trapezoid"
    flank: float = 0.0

    def __post_init__(self):
        checks.positive("grating groove (mm)", self.groove)
        checks.positive("grating ridge (mm)", self.ridge)
        checks.positive("grating depth (mm)", self.depth)
        checks.within("grating flank (mm)", self.flank, 0.0, self.groove / 2)
        if self.form not in ("trapezoid", "sine"):
            raise InputError(f"grating form must be trapezoid or sine, got {self.form!r}")

    @property
    def wavelength(self) -> float:
        """Spatial period in mm: groove + ridge."""
        return self.groove + self.ridge

    @property
    def span(self) -> tuple[float, float]:
        """It has no ends."""
        return -math.inf, math.inf

    def recess(self, x: "np.ndarray") -> "np.ndarray":
        """How far (k,) in mm the surface lies below its ridges at x (k,) in mm."""
        import numpy as np

        period = self.wavelength
        if self.form == "sine":
            return self.depth / 2 * (1 - np.cos(2 * math.pi * x / period))
        into = np.abs((x + period / 2) % period - period / 2) - self.ridge / 2
        if self.flank == 0:
            return self.depth * np.heaviside(into, 0.5)
        return self.depth * np.clip(into / self.flank, 0.0, 1.0)
