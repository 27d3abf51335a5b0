"""The finger whose five parameters were fitted to published data: its difference from each printed figure, and that of
a fit without this figure."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import BarycentricInterpolator

from papilla import fem
from papilla.calibration.published import SPECIMENS_MPA, published_sd
from papilla.core.errors import SolverError
from papilla.core.least_squares import least_squares
from papilla.core.units import PER_CENT, gf_to_newton, newton_to_gf
from papilla.model.finger import Finger, Layer
from papilla.model.specimen import HalfSpace
from papilla_papers.claims.claim import Experiment
from papilla_papers.claims.experiments import softness
from papilla_papers.claims.experiments.presses import DEPTH_NAMES, PRINTED_N, RIGID_MPA
from papilla_papers.claims.scenes import by_factors, scene

FITTED_SCENE = scene("fitted")
SD_MISFIT, SD_NUMBERS, DEPTH_ERROR = FITTED_SCENE.misfit, FITTED_SCENE.numbers, FITTED_SCENE.depth_error
PRIOR_WIDTH = float(np.log(2) / 2)
"""One sigma of a modulus' logarithm: half an octave."""
LEVER_PLACE, LEAST_SLOPE = 2, 1e-3
"""Place of the lever among the unknowns; and change of the weighted misfits by one scale of the lever below which the
lever is not determined: on the published finger it is 3."""
SKIN_FACTORS, STIFF_FACTORS, LEVERS_MM = (np.array(FITTED_SCENE[name]) for name in ("skins", "stiffer", "levers_mm"))
DEPTH_FORCES_N = by_factors(FITTED_SCENE.forces_N)


def run(tell) -> dict:
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
    ours = softness.by_force(softness.sweep(reduced, SPECIMENS_MPA, gf_to_newton(softness.SD_FORCES_GF)))
    early = finger.bench.touch_down
    (scale, rms), (_, heavy) = (softness.scaled_to_9(ours, first) for first in (0, softness.SOFTNESS_SCENE.heavy))
    values = {"early": early, "hard_ratio": ours[-1, 2] / ours[-1, 1], "rms": rms, "rms_30": heavy}
    for depth, name in zip(PRINTED_N, DEPTH_NAMES, strict=True):
        force = fem.press(reduced, HalfSpace(RIGID_MPA), indentation=depth - early).force
        values[f"at_{name}"] = float(newton_to_gf(force)) if depth < 1 else force
    tell("fits without one specimen or depth")
    values |= _left_out(finger)
    return values


def _printed() -> np.ndarray:
    """S_d (forces, specimens) of (9)."""
    return published_sd(softness.SD_FORCES_GF[:, None], np.array(SPECIMENS_MPA))


@dataclass(frozen=True, eq=False)
class Relatives:
    """Presses of fingers close to the fitted one, by the logarithms of two factors: of the ratio of outer to inner
    modulus, and of both moduli.

    readings : (skins, stiffnesses, levers, forces, specimens, gauges). depths : (skins, stiffnesses, forces) in mm on a
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
        for skin in SKIN_FACTORS:
            reduced = fem.prepare(replace(finger, outer=Layer(skin * finger.outer.modulus, finger.outer.nu)))
            levers = [softness.with_lever(reduced, lever) for lever in LEVERS_MM]
            for k in STIFF_FACTORS:
                moduli, forces = np.array(SPECIMENS_MPA) / k, gf_to_newton(softness.SD_FORCES_GF) / k
                tables = [softness.sweep(levered, moduli, forces) for levered in levers]
                order = np.lexsort((tables[0].modulus_MPa, tables[0].force_N))
                readings.append([table.reading[order].reshape(len(forces), len(moduli), -1) for table in tables])
                flat = HalfSpace(RIGID_MPA)
                depths.append([fem.press(reduced, flat, force=float(F) / k).indentation for F in DEPTH_FORCES_N])
        shape = (len(SKIN_FACTORS), len(STIFF_FACTORS))
        felt = np.array(readings).reshape(*shape, *np.shape(readings[0]))
        return cls(finger, felt, np.array(depths).reshape(*shape, -1))

    def press(self, unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """S_d (forces, specimens), and depth (mm) at `DEPTH_FORCES_N`, of logarithms of the two factors, lever and
        touch-down in mm."""
        skin, stiff, lever, early = unknowns
        places = zip((SKIN_FACTORS, STIFF_FACTORS), (skin, stiff), strict=True)
        weights = [BarycentricInterpolator(np.log(nodes), np.eye(len(nodes)))(place) for nodes, place in places]
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
            """Misfits of S_d, depths and priors (r,), each over its sigma."""
            sd, depth = self.press(unknowns)
            ours = sd[:, specimens]
            misfit = (ours * printed).sum() / (ours**2).sum() * ours - printed
            rms, weight = np.sqrt(np.mean(_printed() ** 2)), np.sqrt(SD_NUMBERS / _printed().size)
            of_9 = misfit.ravel() / rms / SD_MISFIT * weight
            depth_errors = [np.interp(np.log(PRINTED_N[mm]), np.log(DEPTH_FORCES_N), depth) / mm - 1 for mm in depths]
            layers = np.array(moduli) * np.exp([unknowns[:2].sum(), unknowns[1]])
            priors = np.log(layers / FITTED_SCENE.priors_MPa) / PRIOR_WIDTH
            return np.concatenate([of_9, np.array(depth_errors) / DEPTH_ERROR, priors])

        low, high = np.log([[SKIN_FACTORS[k], STIFF_FACTORS[k]] for k in (0, -1)])
        bounds = ([*low, *FITTED_SCENE.lowest_mm], [*high, *FITTED_SCENE.highest_mm])
        # Readings change sign with the lever, S_d does not: there is a second minimum, 21 times as high, at a lever
        # beyond which S_d rises again. So the descent starts on both sides.
        starts = [self.start, *(replaced(self.start, LEVER_PLACE, lever) for lever in FITTED_SCENE.other_levers_mm)]
        best = least_squares(residuals, *starts, bounds=bounds, x_scale=FITTED_SCENE.scales)
        by_lever = best.jacobian[:, LEVER_PLACE] * FITTED_SCENE.scales[LEVER_PLACE]
        if np.linalg.norm(by_lever) < LEAST_SLOPE:
            raise SolverError("these specimens and depths do not determine the lever: any lever gives the same misfit")
        return best.vector


def replaced(vector: np.ndarray, place: int, value: float) -> np.ndarray:
    """A vector with another value at one place."""
    changed = vector.copy()
    changed[place] = value
    return changed


def _left_out(finger: Finger) -> dict:
    """Each printed figure, predicted by a fit to the others."""
    family, all_three, depths = Relatives.of(finger), [*range(len(SPECIMENS_MPA))], list(PRINTED_N)
    values, missed, printed = {}, [], _printed()
    for specimen in all_three:
        others = [k for k in all_three if k != specimen]
        sd, _ = family.press(family.fit(others, depths))
        scale = (sd * printed)[:, others].sum() / (sd[:, others] ** 2).sum()
        missed.append(scale * sd[:, specimen] - printed[:, specimen])
        if specimen == all_three[-1]:
            values["hard_ratio_alone"] = float(sd[-1, 2] / sd[-1, 1])
    values["rms_alone"] = PER_CENT * float(np.sqrt(np.mean(np.square(missed)) / np.mean(printed**2)))
    for depth, name in zip(PRINTED_N, DEPTH_NAMES, strict=True):
        _, reached = family.press(family.fit(all_three, [mm for mm in depths if mm != depth]))
        force = float(np.exp(np.interp(depth, reached, np.log(DEPTH_FORCES_N))))
        values[f"at_{name}_alone"] = float(newton_to_gf(force)) if depth < 1 else force
    again = family.fit(all_three, depths) - family.start
    return values | {"again": float(np.abs(again).max())}


experiment = Experiment.of(run)
