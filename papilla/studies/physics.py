"""Effects on a bench that a calibration does not contain: the change of S_d, and of the modulus that follows from it.

Each effect is a press with it compared with the same press without it, linear and on one mesh, so that the error of the
mesh cancels. The modulus follows from the S_d of presses without the effect over the modulus.
"""

import math
from collections.abc import Callable
from contextlib import suppress
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
from papilla.studies.parameters import parameters
from papilla.units import gf_to_newton

GIVEN = parameters(__name__)
FORCES_GF, MODULI_MPA, MODELLED = GIVEN.forces_gf, GIVEN.moduli_MPa, GIVEN.modelled


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

    tilt_deg: float = 0.0

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
        return self.model.reduce((GIVEN.beside_mm, GIVEN.beside_mm))

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
            known = []
            softest, hardest = GIVEN.curve_MPa
            for modulus in np.geomspace(softest, hardest, GIVEN.curve_points):
                with suppress(PapillaError):
                    known.append((modulus, self.plain(force, modulus).sd))
            moduli, curve = np.array(known).T
            rising = np.append(True, curve[1:] > np.maximum.accumulate(curve)[:-1])
            self._curves[force] = PchipInterpolator(curve[rising], np.log(moduli[rising]), extrapolate=False)
        return float(np.exp(self._curves[force](sd)))

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


def _effects(bench: Bench) -> list[tuple[str, str, str, Callable[[float, float], float]]]:
    """Name, size in words, model, and S_d as a function of force (N) and modulus (MPa), for each effect."""
    finger, size_mm, thick = bench.finger, bench.size_mm, THICKNESS_MM

    def block(modulus: float) -> Block:
        return Block(modulus, thick)

    def on(make: Callable[[float], Block] = block, reduced=lambda: bench.reduced, friction: float = 0.0):
        return lambda force, E: contact_press(reduced(), make(E), (force, None), friction).sd

    def strained(force: float, E: float) -> float:
        small, large = (
            press(bench.reduced, block(E), force_N=force, fidelity=fidelity, friction=0.0)
            for fidelity in ("contact", None)
        )
        return bench.plain(force, E).sd * large.sd / small.sd

    def offset(readings: Callable[[], np.ndarray]):
        return lambda force, E: float((bench.plain(force, E).reading + readings()).std())

    def tilted(degrees: float) -> tuple:
        made = on(lambda E: TiltedBlock(E, thick, tilt_deg=degrees), lambda: bench.whole)
        return "tilt of the block", f"{degrees:g} degrees", "its own gap", made

    def adhesive(force: float, E: float) -> float:
        return adhesive_press(bench.reduced, block(E), GIVEN.adhesion_J_m2, force_N=force).sd

    weight = cache(lambda: weight_readings(bench.model))
    preload = cache(lambda: bench.plain(GIVEN.preload_N, MODULI_MPA[-1]).reading)
    boned = cache(lambda: FingerModel(with_bone(finger), build(with_bone(finger), size_mm=size_mm)).reduce())
    foiled = cache(lambda: FoiledModel(finger, bench.model.mesh, GIVEN.foil_N_per_mm, GIVEN.foil_bending_N_mm).reduce())
    thin, loose = on(lambda E: Block(E, GIVEN.thin_mm)), on(lambda E: Block(E, thick, bonded=False))
    return [
        ("large strain", "neo-Hookean layers", "press", strained),
        ("friction", "stick", "press --friction", on(friction=math.inf)),
        ("thickness of the block", f"{GIVEN.thin_mm:g} mm, {thick:g} assumed", "--thickness", thin),
        ("block not bonded", "slides on its table", "Block(bonded=False)", loose),
        *map(tilted, GIVEN.tilts_deg),
        ("adhesion", f"{GIVEN.adhesion_J_m2:g} J/m2", "adhesive_press", adhesive),
        ("finger turned over", "since the gauges were zeroed", "weight_readings", offset(lambda: 2 * weight())),
        ("zero under load", "0.01 N on 0.51 MPa", "touch-down", offset(lambda: -preload())),
        ("elastic bone", "3 GPa, bonded", "bone modulus", on(reduced=boned)),
        ("foils in the gauges", "polyimide, 0.1 mm, read as strain", "FoiledModel", on(reduced=foiled)),
    ]


def with_bone(finger: Finger) -> Finger:
    """The finger on a bone of acrylic."""
    return replace(finger, bone=Layer(*GIVEN.bone_MPa_and_nu))
