"""Young's modulus from force and depth: the method that the 2006 paper's estimate from strains replaces.

Equations (6) to (8) of that paper divide the approach w of two equal spheres as w_o / w_f = E_f / E_o. A layered finger
on a block is not such a pair. So the depths of the calibration's sweep, which contain w_f and w_o of this finger and
specimen, are used instead: E is the modulus whose depth at this force is the measured one. For specimens much harder
than the finger w is nearly w_f, and E is not identifiable.
"""

from dataclasses import dataclass

import numpy as np

from papilla.calibration import IDENTIFIABLE_SIGMA, SoftnessStatus
from papilla.core.errors import InputError

DEPTH_TABLE_POINTS = 400
"""Moduli and forces of the look-up table: the error of linear interpolation between them is less than 1e-4."""


@dataclass(frozen=True)
class DepthErrors:
    """Standard deviations.

    depth_mm, force_N : noise of the log. contact_mm : of the depth at which contact begins, as a stage finds it.
    model : relative, of the depth that the sweep predicts; the bound of `papilla verify` is 0.5 %.
    """

    depth_mm: float = 1e-3
    force_N: float = 1e-3
    contact_mm: float = 0.005
    model: float = 0.005


class ForceDepth:
    """Modulus from force (N) and depth (mm) since contact; the specimen has the thickness of the sweep's.

    force_N, modulus_MPa, depth_mm : (n,) of the presses of a sweep, a full grid. Raises `InputError` if it is not full.
    """

    def __init__(self, force_N: np.ndarray, modulus_MPa: np.ndarray, depth_mm: np.ndarray):
        from scipy.interpolate import RectBivariateSpline

        forces, moduli = np.unique(force_N), np.unique(modulus_MPa)
        if len(forces) * len(moduli) != len(depth_mm) or min(len(forces), len(moduli)) < 4:
            raise InputError("the sweep must hold the depth of each force on each modulus, 4 or more of each")
        table = depth_mm[np.lexsort((modulus_MPa, force_N))].reshape(len(forces), len(moduli))
        pressed = np.isfinite(table).all(axis=0)
        spline = RectBivariateSpline(np.log(forces), np.log(moduli[pressed]), np.log(table[:, pressed]))
        self.force_N = float(forces[0]), float(forces[-1])
        self._force = np.linspace(np.log(forces[0]), np.log(forces[-1]), DEPTH_TABLE_POINTS)
        self._modulus = np.linspace(np.log(moduli[pressed][0]), np.log(moduli[pressed][-1]), DEPTH_TABLE_POINTS)
        # Rising along both axes: a softer specimen, last, has a larger depth
        self._depth = spline(self._force, self._modulus)[:, ::-1]

    def errors_of(self, depth_mm: float, force_N: float) -> DepthErrors:
        """The errors for a log with this noise of depth and force, which is rarely the smallest error."""
        floor = DepthErrors()
        return DepthErrors(depth_mm=max(depth_mm, floor.depth_mm), force_N=max(force_N, floor.force_N))

    def process(
        self, force_N: np.ndarray, depth_mm: np.ndarray, errors: DepthErrors
    ) -> tuple[np.ndarray, np.ndarray, list[SoftnessStatus]]:
        """Modulus (n,) and its standard deviation in MPa, NaN if there is none, and n statuses."""
        low, high = self.force_N
        finite = np.isfinite(force_N) & np.isfinite(depth_mm)
        force = np.log(np.clip(np.where(finite, force_N, low), low, high))
        with np.errstate(divide="ignore", invalid="ignore"):
            depth = np.log(np.where(finite, depth_mm, np.nan))
        place = np.clip((force - self._force[0]) / (self._force[1] - self._force[0]), 0, DEPTH_TABLE_POINTS - 1.001)
        lower, weight = place.astype(int), place % 1
        curves = (1 - weight)[:, None] * self._depth[lower] + weight[:, None] * self._depth[lower + 1]
        cell = np.clip((curves < depth[:, None]).sum(axis=1) - 1, 0, DEPTH_TABLE_POINTS - 2)
        presses = np.arange(len(cell))
        steps = curves[presses, cell + 1] - curves[presses, cell]
        share = (depth - curves[presses, cell]) / steps
        modulus = np.exp(self._modulus[::-1][cell] - share * (self._modulus[1] - self._modulus[0]))
        # d ln E = d ln depth / (d ln depth / d ln E), and the depth's change with the force besides
        steep = steps / (self._modulus[1] - self._modulus[0])
        by_force = (self._depth[lower + 1, cell] - self._depth[lower, cell]) / (self._force[1] - self._force[0])
        noise = np.hypot(errors.depth_mm, errors.contact_mm) / np.maximum(depth_mm, 1e-9)
        sigma = modulus / steep * np.sqrt(noise**2 + (by_force * errors.force_N / np.exp(force)) ** 2 + errors.model**2)
        status = np.select(
            [~finite, force_N <= 0, force_N < low * (1 - 1e-9), force_N > high * (1 + 1e-9), ~(depth > curves[:, 0]),
             depth > curves[:, -1], sigma > IDENTIFIABLE_SIGMA * modulus],
            [SoftnessStatus[name] for name in (
                "BAD_INPUT", "NO_CONTACT", "FORCE_BELOW", "FORCE_ABOVE", "HARDER", "SOFTER", "NOT_IDENTIFIABLE")],
            SoftnessStatus.OK,
        )  # fmt: skip
        answered = (status == SoftnessStatus.OK) | (status == SoftnessStatus.NOT_IDENTIFIABLE)
        modulus, sigma = (np.where(answered, column, np.nan) for column in (modulus, sigma))
        return modulus, sigma, [SoftnessStatus(code) for code in status.tolist()]
