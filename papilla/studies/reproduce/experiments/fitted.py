"""The finger whose five parameters were fitted to published data: its difference from each printed figure, and that of
a fit without this figure."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import BarycentricInterpolator
from scipy.optimize import least_squares

from papilla import fem
from papilla.calibration.published import SPECIMENS_MPA, published_sd
from papilla.finger import Finger, Layer
from papilla.specimen import HalfSpace
from papilla.studies.reproduce.claim import Found, Series
from papilla.studies.reproduce.experiments.presses import PRINTED_N, RIGID_MPA
from papilla.studies.reproduce.experiments.softness import (
    COMPARED_GF,
    HEAVY,
    by_force,
    scaled_to_9,
    sweep,
    with_lever,
)
from papilla.units import gf_to_newton, newton_to_gf

MISFIT, NUMBERS = 0.03, 5
"""Assumed error of (9) relative to the rms of its values, and number of independent values: its coefficients."""
DEPTH_ERROR = 0.01
"""Relative error of a published depth."""
PRIORS_MPA, PRIOR_WIDTH = (0.136, 0.034), float(np.log(2) / 2)
"""Moduli of epidermis and subcutaneous tissue; one sigma of their logarithm, half an octave."""
SKINS, STIFFER = (0.7, 1.0, 1.4), (0.8, 1.0, 1.25)
"""Outer over inner modulus, and both, as factors of the fitted finger's, between which presses are interpolated."""
DEPTH_FORCES_N = np.geomspace(0.003, 0.95, 30)
"""Forces of the presses on a rigid flat that give the force at a depth."""
LEVERS_MM = (-1.0, 0.0)
"""Levers of the presses between which readings are interpolated; they are linear in the lever."""
LOWEST, HIGHEST = (-2.0, 0.05), (1.0, 0.3)
"""Bounds of lever and touch-down, mm."""
SIMULATED = "fitted to this very figure: it says that the physics can follow it, not that the finger is known"


SCENE = ("",)


def run(tell) -> Found:
    """A finger inside literature ranges, fitted to the published regression and depths.

    The published finger, five parameters of which were fitted, is pressed at 10-100 gf on its three specimens and to
    the printed depths on a rigid flat; S_d is compared with (9) up to one scale factor. Beside each figure stands what
    a fit without it gives: both moduli, the lever and the touch-down are fitted again to the other specimens and
    depths, by presses interpolated between nine fingers; the length of the grid stays at the end of its range, where
    the fit has it.
    """
    finger = Finger.published()
    reduced = fem.prepare(finger)
    tell("presses")
    forces = [gf_to_newton(float(force)) for force in COMPARED_GF]
    ours = by_force(sweep(reduced, SPECIMENS_MPA, forces))
    early = finger.bench.touch_down
    (scale, rms), (_, heavy) = (scaled_to_9(ours, first) for first in (0, HEAVY))
    values = {"early": early, "hard_ratio": ours[-1, 2] / ours[-1, 1], "rms": rms, "rms_30": heavy}
    for depth in PRINTED_N:
        force = fem.press(reduced, HalfSpace(RIGID_MPA), indentation=depth - early).force
        values[f"at_{round(100 * depth):03d}"] = float(newton_to_gf(force)) if depth < 1 else force
    tell("fits without one specimen or depth")
    values |= _left_out(finger)
    series = []
    for column, modulus in enumerate(SPECIMENS_MPA):
        series.append(Series(f"fitted finger, {modulus:g} MPa", COMPARED_GF, scale * ours[:, column]))
        series.append(Series(f"(9), {modulus:g} MPa", COMPARED_GF, _printed()[:, column], "points"))
    title = "The finger fitted to (9): a spread between specimens that grows with force, where (9)'s is the same"
    return Found(values, title, "force, gf", "S_d as printed", tuple(series))


def _printed() -> np.ndarray:
    """S_d (forces, specimens) of (9)."""
    return published_sd(np.array(COMPARED_GF, float)[:, None], np.array(SPECIMENS_MPA))


@dataclass(frozen=True, eq=False)
class Relatives:
    """Presses of fingers close to the fitted one, by the logarithms of two factors: of the ratio of outer to inner
    modulus, and of both moduli.

    readings : (skins, stiffnesses, levers, forces, specimens, gauges). depths : (skins, stiffnesses, 30) in mm on a
    rigid flat, at `DEPTH_FORCES_N`.
    """

    finger: Finger
    readings: np.ndarray
    depths: np.ndarray

    @classmethod
    def of(cls, finger: Finger) -> "Relatives":
        """Press nine fingers. A finger that is k times as stiff responds to E and F like this one to E / k and F / k,
        so only another ratio of the moduli needs a new reduction."""
        readings, depths = [], []
        for skin in SKINS:
            own = fem.prepare(replace(finger, outer=Layer(skin * finger.outer.modulus, finger.outer.nu)))
            levers = [with_lever(own, lever) for lever in LEVERS_MM]
            for k in STIFFER:
                moduli, forces = np.array(SPECIMENS_MPA) / k, gf_to_newton(np.array(COMPARED_GF, float)) / k
                tables = [sweep(one, moduli, forces) for one in levers]
                order = np.lexsort((tables[0].modulus_MPa, tables[0].force_N))
                readings.append([one.reading[order].reshape(len(forces), len(moduli), -1) for one in tables])
                flat = HalfSpace(RIGID_MPA)
                depths.append([fem.press(own, flat, force=float(force) / k).indentation for force in DEPTH_FORCES_N])
        shape = (len(SKINS), len(STIFFER))
        felt = np.array(readings).reshape(*shape, *np.shape(readings[0]))
        return cls(finger, felt, np.array(depths).reshape(*shape, -1))

    def press(self, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """S_d (forces, specimens), and depth (mm) at `DEPTH_FORCES_N`, of logarithms of the two factors, lever and
        touch-down in mm."""
        skin, stiff, lever, early = unknowns
        places = zip((SKINS, STIFFER), (skin, stiff), strict=True)
        weights = [BarycentricInterpolator(np.log(nodes), np.eye(3))(place) for nodes, place in places]
        both = np.einsum("r,s,rs...->...", *weights, self.readings)
        share = (lever - LEVERS_MM[1]) / (LEVERS_MM[0] - LEVERS_MM[1])
        readings = share * both[0] + (1 - share) * both[1]
        return readings.std(axis=-1), np.einsum("r,s,rs...->...", *weights, self.depths) + early

    @property
    def start(self) -> np.ndarray:
        """The fitted finger itself."""
        return np.array([0.0, 0.0, self.finger.gauges[0].lever_mm, self.finger.bench.touch_down])

    def fit(self, specimens: list[int], depths: list[float]) -> np.ndarray:
        """The unknowns of `press` from a fit to these specimens and depths, weighted like the published finger's
        fit."""
        printed, moduli = _printed()[:, specimens], (self.finger.outer.modulus, self.finger.inner.modulus)

        def residuals(unknowns: np.ndarray) -> np.ndarray:
            sd, depth = self.press(unknowns)
            own = sd[:, specimens]
            left = (own * printed).sum() / (own**2).sum() * own - printed
            of_9 = left.ravel() / np.sqrt(np.mean(_printed() ** 2)) / MISFIT * np.sqrt(NUMBERS / _printed().size)
            found = [np.interp(np.log(PRINTED_N[one]), np.log(DEPTH_FORCES_N), depth) / one - 1 for one in depths]
            priors = np.log(np.array(moduli) * np.exp([unknowns[:2].sum(), unknowns[1]]) / PRIORS_MPA) / PRIOR_WIDTH
            return np.concatenate([of_9, np.array(found) / DEPTH_ERROR, priors])

        low, high = np.log([[SKINS[k], STIFFER[k]] for k in (0, -1)])
        bounds = ([*low, *LOWEST], [*high, *HIGHEST])
        return least_squares(residuals, self.start, bounds=bounds, x_scale=(0.1, 0.1, 0.1, 0.01)).x


def _left_out(finger: Finger) -> dict:
    """Each printed figure, predicted by a fit to the others."""
    family, all_three, depths = Relatives.of(finger), [0, 1, 2], list(PRINTED_N)
    values, missed, printed = {}, [], _printed()
    for one in all_three:
        others = [k for k in all_three if k != one]
        sd, _ = family.press(family.fit(others, depths))
        scale = (sd * printed)[:, others].sum() / (sd[:, others] ** 2).sum()
        missed.append(scale * sd[:, one] - printed[:, one])
        if one == all_three[-1]:
            values["hard_ratio_alone"] = float(sd[-1, 2] / sd[-1, 1])
    values["rms_alone"] = 100 * float(np.sqrt(np.mean(np.square(missed)) / np.mean(printed**2)))
    for depth in depths:
        _, reached = family.press(family.fit(all_three, [one for one in depths if one != depth]))
        force = float(np.exp(np.interp(depth, reached, np.log(DEPTH_FORCES_N))))
        values[f"at_{round(100 * depth):03d}_alone"] = float(newton_to_gf(force)) if depth < 1 else force
    again = family.fit(all_three, depths) - family.start
    return values | {"again": float(np.abs(again).max())}
