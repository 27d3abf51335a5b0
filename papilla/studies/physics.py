"""Effects on a bench that a calibration does not contain: the change of S_d, and of the modulus that follows from it.

Each effect is a press with it compared with the same press without it, linear and on one mesh, so that the error of the
mesh cancels. The modulus follows from the S_d of presses without the effect over the modulus.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator

from papilla.errors import ContactRangeError, PapillaError
from papilla.fem.pressing.contact import contact_press
from papilla.fem.pressing.effects import FoiledModel, adhesive_press, weight_readings
from papilla.fem.pressing.fidelity import press
from papilla.fem.pressing.press import Press
from papilla.fem.reduction.finger_model import FingerModel
from papilla.fem.reduction.reduced import ReducedFinger
from papilla.finger import Finger, Layer
from papilla.mesh import DEFAULT_SIZE_MM, build
from papilla.specimen import THICKNESS_MM, Block
from papilla.units import gf_to_newton

FORCES_GF, MODULI_MPA = (5.0, 38.0, 100.0), (0.1, 0.51)
"""The scenes: a light, a middle and a firm press on a soft and on a hard block."""

MODELLED = 0.01
"""Change of S_d above which an effect should be modelled, not only named."""

CURVE_MPA = np.geomspace(0.02, 20.0, 25)
"""Moduli at which S_d without the effect is computed."""


@dataclass(frozen=True)
class Effect:
    """One effect, its size in words, the part of papilla that models it, and S_d (forces, moduli) with it over that
    without."""

    name: str
    size: str
    modelled_by: str
    sd_ratio: np.ndarray
    modulus_ratio: np.ndarray

    @property
    def worst(self) -> float:
        """The largest relative change of S_d."""
        return float(np.nanmax(np.abs(self.sd_ratio - 1)))

    def to_json(self) -> dict:
        """Plain values; None if the press leaves the model or if no modulus has this S_d."""
        words = {"effect": self.name, "size": self.size, "modelled_by": self.modelled_by}
        ratios = {"sd_ratio": self.sd_ratio, "modulus_ratio": self.modulus_ratio}
        return words | {
            name: [[None if np.isnan(x) else float(x) for x in row] for row in table] for name, table in ratios.items()
        }


@dataclass(frozen=True)
class TiltedBlock(Block):
    """A block that is turned by `tilt_deg` about y."""

    tilt_deg: float = 1.0

    def gap(self, points: np.ndarray) -> np.ndarray:
        """Height (k,) in mm over points (k, 2) of the contact plane; negative on the side that comes nearer."""
        return points[:, 0] * math.tan(math.radians(self.tilt_deg))


@dataclass(frozen=True, eq=False)
class Bench:
    """A finger on one mesh, and the models that the effects need."""

    finger: Finger
    size_mm: float = DEFAULT_SIZE_MM

    @cached_property
    def model(self) -> FingerModel:
        """The finger, factorised."""
        return FingerModel(self.finger, build(self.finger, size_mm=self.size_mm))

    @cached_property
    def reduced(self) -> ReducedFinger:
        """The finger condensed at its apex."""
        return self.model.reduce()

    @cached_property
    def whole(self) -> ReducedFinger:
        """The same without symmetry, for specimens without symmetry."""
        return self.model.reduce((1e-6, 1e-6))

    def plain(self, force_N: float, modulus: float) -> Press:
        """The linear, frictionless press on a bonded block, without the ellipse's correction, like all presses of the
        comparison."""
        return contact_press(self.reduced, Block(modulus, THICKNESS_MM), (force_N, None), 0.0)

    def effect(self, name: str, size: str, modelled_by: str, sd: Callable[[float, float], float]) -> Effect:
        """The change of S_d by `sd(force_N, modulus)` in microstrain, and the modulus that follows from it."""
        forces = [gf_to_newton(gf) for gf in FORCES_GF]
        ratio, modulus = np.full((2, len(forces), len(MODULI_MPA)), np.nan)
        for i, force in enumerate(forces):
            for j, true in enumerate(MODULI_MPA):
                try:
                    found = sd(force, true)
                except ContactRangeError:
                    continue
                ratio[i, j] = found / self.plain(force, true).sd
                modulus[i, j] = self._read(force, found) / true
        return Effect(name, size, modelled_by, ratio, modulus)

    def _read(self, force: float, sd: float) -> float:
        """The modulus (MPa) whose press without the effect has this S_d; NaN beyond the curve."""
        if force not in self._curves:
            known = [(modulus, self._plain_or_nan(force, modulus)) for modulus in CURVE_MPA]
            moduli, curve = np.array([pair for pair in known if pair[1] == pair[1]]).T
            rising = np.append(True, curve[1:] > np.maximum.accumulate(curve)[:-1])
            moduli, curve = moduli[rising], curve[rising]
            self._curves[force] = PchipInterpolator(curve, np.log(moduli), extrapolate=False)
        return float(np.exp(self._curves[force](sd)))

    def _plain_or_nan(self, force: float, modulus: float) -> float:
        try:
            return self.plain(force, modulus).sd
        except PapillaError:
            return math.nan

    @cached_property
    def _curves(self) -> dict[float, PchipInterpolator]:
        return {}


def physics(finger: Finger, size_mm: float, progress: Callable[[str], None]) -> list[Effect]:
    """All effects on a finger, on its mesh of elements of `size_mm`."""
    bench = Bench(finger, size_mm)
    found = []
    for name, size, modelled_by, sd in _effects(bench):
        progress(name)
        found.append(bench.effect(name, size, modelled_by, sd))
    return sorted(found, key=lambda effect: -effect.worst)


def _effects(bench: Bench):
    """Name, size in words, model, and S_d as a function of force (N) and modulus (MPa), for each effect."""
    finger, thick = bench.finger, THICKNESS_MM

    def on(reduced: Callable[[], ReducedFinger], friction: float = 0.0):
        return lambda force, E: contact_press(reduced(), Block(E, thick), (force, None), friction).sd

    def specimen(make, reduced=lambda: bench.reduced):
        return lambda force, E: contact_press(reduced(), make(E), (force, None), 0.0).sd

    def strained(force: float, E: float) -> float:
        small, large = (
            press(bench.reduced, Block(E, thick), force_N=force, fidelity=fidelity, friction=0.0)
            for fidelity in ("contact", None)
        )
        return bench.plain(force, E).sd * large.sd / small.sd

    def offset(readings: Callable[[], np.ndarray]):
        return lambda force, E: float((bench.plain(force, E).reading + readings()).std())

    yield (
        "large strain",
        "neo-Hookean layers",
        "press",
        strained,
    )
    yield "friction", "stick", "press --friction", on(lambda: bench.reduced, math.inf)
    yield "thickness of the block", f"8 mm, {thick:g} assumed", "--thickness", specimen(lambda E: Block(E, 8.0))
    yield (
        "block not bonded",
        "slides on its table",
        "Block(bonded=False)",
        specimen(lambda E: Block(E, thick, bonded=False)),
    )
    for tilt in (1.0, 5.0):
        yield (
            "tilt of the block",
            f"{tilt:g} degrees",
            "its own gap",
            specimen(lambda E, tilt=tilt: TiltedBlock(E, thick, tilt_deg=tilt), lambda: bench.whole),
        )
    yield (
        "adhesion",
        "0.05 J/m2",
        "adhesive_press",
        lambda force, E: adhesive_press(bench.reduced, Block(E, thick), 0.05, force_N=force).sd,
    )
    weight = cache(lambda: weight_readings(bench.model))
    yield "finger turned over", "since the gauges were zeroed", "weight_readings", offset(lambda: 2 * weight())
    preload = cache(lambda: bench.plain(0.01, 0.51).reading)
    yield "zero under load", "0.01 N on 0.51 MPa", "touch-down", offset(lambda: -preload())
    boned = cache(lambda: FingerModel(with_bone(finger), build(with_bone(finger), size_mm=bench.size_mm)).reduce())
    yield "elastic bone", "3 GPa, bonded", "bone modulus", on(boned)
    foiled = cache(lambda: FoiledModel(finger, bench.model.mesh, 300.0, 0.25).reduce())
    yield "foils in the gauges", "polyimide, 0.1 mm, read as strain", "FoiledModel", on(foiled)


def with_bone(finger: Finger) -> Finger:
    """The finger on a bone of acrylic."""
    return replace(finger, bone=Layer(3000.0, 0.37))
