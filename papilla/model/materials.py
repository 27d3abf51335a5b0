"""Hyperelastic rubbers: energy, derivatives and closed forms of the three classical tests, in MPa.

A material gives the energy per reference volume of an isochoric deformation. The change of volume is described by the
Poisson's ratio of the finger's layer.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike

from papilla.core import checks
from papilla.core.errors import InputError

TEST_MODES = ("uniaxial", "equibiaxial", "pure_shear")
"""Tests with a closed form; a stretch below 1 is compression."""

_FREE_EXPONENT = {"uniaxial": -0.5, "equibiaxial": -2.0, "pure_shear": -1.0}
"""Test -> exponent: the principal stretch in the stress-free direction is stretch ** exponent."""

POSITIVE_RANGE, ANY_SIGN = (1e-6, 1e4), (-1e4, 1e4)
"""Ranges of a parameter in a fit, relative to the shear modulus of a neo-Hookean fit. No fit starts at that modulus
itself: a parameter that ended there would look like one that the fit never moved."""


CHECKED_I1 = (3.05, 3.4, 4.0)
"""First invariants at which the derivatives of a user's material are compared with differences: uniaxial stretches of
1.1 to 1.7."""
INVARIANT_STEP, SAME_SLOPE = 1e-4, 1e-4
"""Half of a difference of I1, and the relative difference of slopes up to which they agree."""


class _Material(ABC):
    kind: ClassVar[str] = ""
    in_MPa: ClassVar[tuple[str, ...]] = ()

    @property
    @abstractmethod
    def shear_modulus(self) -> float:
        """Small-strain shear modulus, MPa."""

    @property
    def modulus(self) -> float:
        """Small-strain Young's modulus of the incompressible material, MPa."""
        return 3 * self.shear_modulus

    def nominal_stress(self, stretch: ArrayLike, mode: str) -> np.ndarray:
        """Nominal stress (force per reference area, MPa; shape of `stretch` > 0) of the incompressible material.

        P = dW/dl1 - (l3/l1) dW/dl3 with l3 the stress-free principal stretch (Ogden 1997, Non-Linear Elastic
        Deformations, section 4.4). Raises `InputError` for a mode not in `TEST_MODES` or a stretch that is not
        positive."""
        stretch, free = principal_pair(stretch, mode)
        return self._stretch_slope(stretch, stretch, free, mode) - free / stretch * self._stretch_slope(
            free, stretch, free, mode
        )

    @abstractmethod
    def stability(self, stretches: ArrayLike) -> np.ndarray:
        """Smallest curvature (...) of W / mu over isochoric logarithmic strains, at principal stretches (..., 3).

        The material is stable in Hill's sense where it is positive (1958, doi:10.1016/0022-5096(58)90029-2).
        """

    @abstractmethod
    def _stretch_slope(self, at, stretch, free, mode) -> np.ndarray:
        """dW/dl at the principal stretch `at`, in a test with the principal stretches `stretch` and `free`."""

    def describe(self) -> dict:
        """Kind and parameters as plain values."""
        return {"kind": self.kind, **{item.name: getattr(self, item.name) for item in fields(self)}}  # type: ignore[arg-type]


class FirstInvariantMaterial(_Material):
    """A material whose energy is a function of I1 = l1^2 + l2^2 + l3^2 of the isochoric deformation.

    A rubber of the user is a frozen dataclass of this class with `energy` and `slopes`, accepted wherever `NeoHookean`
    is; its slopes are compared with differences of its energy (`checked_material`).

    >>> @dataclass(frozen=True)
    ... class Gent(FirstInvariantMaterial):
    ...     mu: float
    ...     limit: float
    ...     def energy(self, i1):
    ...         return -self.mu * self.limit / 2 * np.log(1 - (np.asarray(i1) - 3) / self.limit)
    ...     def slopes(self, i1):
    ...         first = self.mu / 2 / (1 - (np.asarray(i1) - 3) / self.limit)
    ...         return first, 2 * first**2 / (self.mu * self.limit)
    """

    @abstractmethod
    def energy(self, i1: ArrayLike) -> np.ndarray:
        """W (MPa) of the isochoric first invariant, any shape."""

    @abstractmethod
    def slopes(self, i1: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """dW/dI1 and d2W/dI1^2 (MPa), each of the shape of `i1`."""

    @property
    def shear_modulus(self) -> float:
        """Small-strain shear modulus, MPa."""
        return 2 * float(self.slopes(3.0)[0])

    def describe(self) -> dict:
        """Name, parameters and some energies as plain values: another law has another description."""
        plain = {name: value for name, value in vars(self).items() if isinstance(value, bool | int | float | str)}
        return {"kind": type(self).__qualname__, **plain, "energy_MPa": np.asarray(self.energy(CHECKED_I1)).tolist()}

    def stability(self, stretches: ArrayLike) -> np.ndarray:
        """Least curvature (...) of the energy over logarithmic strains, over mu, at stretches (..., 3)."""
        square = np.asarray(stretches, float) ** 2
        first, second = (slope[..., None, None] for slope in self.slopes(square.sum(axis=-1)))
        slope = 2 * (square[..., :2] - square[..., 2:])
        bend = first * _log_curvature(square, 4.0) + second * slope[..., :, None] * slope[..., None, :]
        return _least(bend) / self.shear_modulus

    def _stretch_slope(self, at, stretch, free, mode):
        third = {"uniaxial": free, "equibiaxial": stretch, "pure_shear": np.ones_like(stretch)}[mode]
        return 2 * at * self.slopes(stretch**2 + third**2 + free**2)[0]


class _Polynomial(FirstInvariantMaterial):
    @property
    @abstractmethod
    def polynomial(self) -> Polynomial:
        """W (MPa) of I1 - 3."""

    @property
    def shear_modulus(self) -> float:
        """Small-strain shear modulus, MPa."""
        return 2 * float(self.polynomial.coef[1])

    def energy(self, i1: ArrayLike) -> np.ndarray:
        """W (MPa) of the isochoric first invariant, any shape."""
        return self.polynomial(np.asarray(i1) - 3)

    def slopes(self, i1: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """dW/dI1 and d2W/dI1^2 (MPa), each of the shape of `i1`."""
        x, slope = np.asarray(i1) - 3, self.polynomial.deriv()
        return slope(x), slope.deriv()(x)

    def describe(self) -> dict:
        """Kind and parameters as plain values."""
        return _Material.describe(self)


@dataclass(frozen=True)
class NeoHookean(_Polynomial):
    """W = mu/2 (I1 - 3), `mu` in MPa, > 0 (Treloar 1943, doi:10.1039/TF9433900241)."""

    mu: float
    kind: ClassVar[str] = "neo-hookean"
    in_MPa: ClassVar[tuple[str, ...]] = ("mu",)
    fit_from: ClassVar[dict[str, tuple[float, float, float]]] = {"mu": (0.7, *POSITIVE_RANGE)}

    def __post_init__(self):
        checks.positive("neo-Hookean mu (MPa)", self.mu)

    @property
    def polynomial(self) -> Polynomial:
        """W (MPa) of I1 - 3."""
        return Polynomial([0.0, self.mu / 2])


@dataclass(frozen=True)
class Yeoh(_Polynomial):
    """W = c1 (I1 - 3) + c2 (I1 - 3)^2 + c3 (I1 - 3)^3 in MPa, c1 > 0 (Yeoh 1993, doi:10.5254/1.3538343)."""

    c1: float
    c2: float = 0.0
    c3: float = 0.0
    kind: ClassVar[str] = "yeoh"
    in_MPa: ClassVar[tuple[str, ...]] = ("c1", "c2", "c3")
    fit_from: ClassVar[dict[str, tuple[float, float, float]]] = {
        "c1": (0.5, *POSITIVE_RANGE),
        "c2": (0.0, *ANY_SIGN),
        "c3": (0.0, *ANY_SIGN),
    }

    def __post_init__(self):
        checks.positive("Yeoh c1 (MPa)", self.c1)
        checks.finite("Yeoh c2 (MPa)", self.c2)
        checks.finite("Yeoh c3 (MPa)", self.c3)

    @property
    def polynomial(self) -> Polynomial:
        """W (MPa) of I1 - 3."""
        return Polynomial([0.0, self.c1, self.c2, self.c3])


@dataclass(frozen=True)
class Ogden(_Material):
    """W = 2 mu/alpha^2 (l1^alpha + l2^alpha + l3^alpha - 3), `mu` in MPa, > 0, `alpha` not 0.

    One term of Ogden (1972, doi:10.1098/rspa.1972.0026), written so that mu is the small-strain shear modulus.
    """

    mu: float
    alpha: float
    kind: ClassVar[str] = "ogden"
    in_MPa: ClassVar[tuple[str, ...]] = ("mu",)
    fit_from: ClassVar[dict[str, tuple[float, float, float]]] = {
        "mu": (1.0, *POSITIVE_RANGE),
        "alpha": (2.0, 0.1, 30.0),
    }

    def __post_init__(self):
        checks.positive("Ogden mu (MPa)", self.mu)
        if checks.finite("Ogden alpha", self.alpha) == 0:
            raise InputError("Ogden alpha must not be 0")

    @property
    def shear_modulus(self) -> float:
        """Small-strain shear modulus, MPa."""
        return self.mu

    def energy(self, stretches: ArrayLike) -> np.ndarray:
        """W (MPa), shape (...), of isochoric principal stretches (..., 3)."""
        return 2 * self.mu / self.alpha**2 * (np.asarray(stretches) ** self.alpha - 1).sum(axis=-1)

    def stability(self, stretches: ArrayLike) -> np.ndarray:
        """Least curvature (...) of the energy over logarithmic strains, over mu, at stretches (..., 3)."""
        return _least(_log_curvature(np.asarray(stretches, float) ** self.alpha, 2.0))

    def _stretch_slope(self, at, stretch, free, mode):
        return 2 * self.mu / self.alpha * at ** (self.alpha - 1)


def _log_curvature(powers: np.ndarray, factor: float) -> np.ndarray:
    """Second derivatives (..., 2, 2) of (factor / a^2) sum l^a by the first two logarithmic strains, from l^a (..., 3).

    The third logarithmic strain is minus the sum of the two; a = 2 for the first invariant.
    """
    both = np.broadcast_to(powers[..., 2, None, None], (*powers.shape[:-1], 2, 2)).copy()
    both[..., [0, 1], [0, 1]] += powers[..., :2]
    return factor * both


def _least(matrices: np.ndarray) -> np.ndarray:
    """Smallest eigenvalue (...) of symmetric (..., 2, 2) relative to the norm e1^2 + e2^2 + (e1 + e2)^2 of a strain."""
    # Inverse square root of the matrix of that norm
    root = np.array([[np.sqrt(3) + 1, 1 - np.sqrt(3)], [1 - np.sqrt(3), np.sqrt(3) + 1]]) / (2 * np.sqrt(3))
    return np.linalg.eigvalsh(root @ matrices @ root)[..., 0]


Material = FirstInvariantMaterial | Ogden

MATERIALS_BY_KIND: dict[str, type[NeoHookean] | type[Yeoh] | type[Ogden]] = {
    cls.kind: cls for cls in (NeoHookean, Yeoh, Ogden)
}
"""Name of a material in a design file -> its class. `in_MPa` names its parameters that are moduli; `fit_from` has the
start, lowest and highest value of each parameter in a fit, moduli over the shear modulus of a neo-Hookean fit."""


def checked_material(what: str, material: object) -> Material:
    """The material; raises `InputError`, which names `what` is made of it, for anything else, and for a user's material
    whose slopes are not those of its energy."""
    if not isinstance(material, Material):
        names = ", ".join(cls.__name__ for cls in MATERIALS_BY_KIND.values())
        custom = "a subclass of FirstInvariantMaterial"
        raise InputError(f"{what} must be {names} or {custom}, got {type(material).__name__}")
    if type(material) not in MATERIALS_BY_KIND.values():
        _check_slopes(f"{what} {type(material).__qualname__}", material)
    return material


def _check_slopes(what: str, material: Any) -> None:
    """Compare the slopes of a user's material with differences; raises `InputError` for the first that differs."""
    if not material.shear_modulus > 0:
        raise InputError(f"{what}: its shear modulus, 2 dW/dI1 at I1 = 3, must be greater than 0")
    for i1 in CHECKED_I1:
        (low, high), ends = (
            material.energy(np.array([i1 - INVARIANT_STEP, i1 + INVARIANT_STEP])),
            (i1 - INVARIANT_STEP, i1 + INVARIANT_STEP),
        )
        first, second = map(float, material.slopes(i1))
        less, more = (float(material.slopes(end)[0]) for end in ends)
        rows = (
            ("dW/dI1", first, (high - low) / (2 * INVARIANT_STEP)),
            ("d2W/dI1^2", second, (more - less) / (2 * INVARIANT_STEP)),
        )
        for name, stated, difference in rows:
            if not abs(stated - difference) <= SAME_SLOPE * max(abs(difference), abs(first)):
                mismatch = f"is {stated:.6g} MPa by `slopes`, {difference:.6g} MPa by differences"
                raise InputError(f"{what}: {name} at I1 = {i1:g} {mismatch}")


def material_class(name: str) -> type[NeoHookean] | type[Yeoh] | type[Ogden]:
    """The class with the name `kind`; raises `InputError` if it is not in `MATERIALS_BY_KIND`."""
    if name not in MATERIALS_BY_KIND:
        raise InputError(f"material must be one of {', '.join(MATERIALS_BY_KIND)}, got {name!r}")
    return MATERIALS_BY_KIND[name]


def principal_pair(stretch: ArrayLike, mode: str) -> tuple[np.ndarray, np.ndarray]:
    """The imposed stretch and the stretch in the stress-free direction, in a test of an incompressible material.

    Raises `InputError` for a mode not in `TEST_MODES`, or a stretch that is not finite and positive.
    """
    if mode not in _FREE_EXPONENT:
        raise InputError(f"test mode must be one of {', '.join(TEST_MODES)}, got {mode!r}")
    stretch = np.asarray(stretch, dtype=float)
    usable = np.isfinite(stretch) & (stretch > 0)
    if not usable.all():
        raise InputError(f"stretch must be finite and greater than 0, got {stretch[~usable].ravel()[0]:g}")
    return stretch, stretch ** _FREE_EXPONENT[mode]
