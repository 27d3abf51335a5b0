"""What is touched: specimens with their modulus in MPa and their lengths in mm."""

from dataclasses import dataclass

from papilla import checks

THICKNESS_MM = 10.0
"""Thickness of the block that a sweep, a calibration and the commands press on unless another is asked for."""


@dataclass(frozen=True)
class HalfSpace:
    """A flat specimen, thick and wide against the contact.

    Parameters
    ----------
    modulus : Young's modulus in MPa, > 0; `inf` is not accepted, use a large modulus for a rigid flat.
    nu : Poisson's ratio in [0, 0.5].
    """

    modulus: float
    nu: float = 0.495

    def __post_init__(self):
        checks.positive("specimen modulus (MPa)", self.modulus)
        checks.poisson("specimen nu", self.nu)


@dataclass(frozen=True)
class Block:
    """A flat layer of `thickness` mm bonded to a rigid table; a sweep presses on `Block(modulus, 10)` by default."""

    modulus: float
    thickness: float
    nu: float = 0.495

    def __post_init__(self):
        checks.positive("specimen modulus (MPa)", self.modulus)
        checks.positive("specimen thickness (mm)", self.thickness)
        checks.poisson("specimen nu", self.nu)


@dataclass(frozen=True)
class Sphere:
    """A solid ball of `radius` mm; its compliance is that of a half-space (Hertz), its gap is the exact sphere's."""

    modulus: float
    radius: float
    nu: float = 0.495

    def __post_init__(self):
        checks.positive("specimen modulus (MPa)", self.modulus)
        checks.positive("specimen radius (mm)", self.radius)
        checks.poisson("specimen nu", self.nu)


@dataclass(frozen=True)
class Grating:
    """A rigid plate with straight grooves along y: `groove` and `ridge` widths and groove `depth`, in mm."""

    groove: float
    ridge: float
    depth: float

    def __post_init__(self):
        checks.positive("grating groove (mm)", self.groove)
        checks.positive("grating ridge (mm)", self.ridge)
        checks.positive("grating depth (mm)", self.depth)

    @property
    def wavelength(self) -> float:
        """Spatial period in mm: groove + ridge."""
        return self.groove + self.ridge


Specimen = HalfSpace | Block | Sphere
"""The specimens that a press accepts; a `Grating` is for sliding scenes."""
