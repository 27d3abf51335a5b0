"""Which finger the papers may have had: `papilla/data/published_finger.toml`, and what regression (9) leaves.

Run with `python benchmarks/published_finger.py` (an hour the first time: presses at finite strain and reductions are
kept in the cache); `--write` writes the table of large strain that ships beside the design. S_d is compared with
regression (9) over 10-100 gf at its three moduli, and the indentation with three published points; `PARAMETERS` and
one scale factor are fitted. All else is the default finger: its reference mesh, blocks of 10 mm that stick, and a rigid
flat in the place of the gratings on which depths were measured.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import typer
from scipy.interpolate import BarycentricInterpolator, RegularGridInterpolator
from scipy.optimize import brentq, least_squares

from papilla import fem
from papilla.calibration.fitting.checking import PUBLISHED_POINTS, RIGID_SPECIMEN
from papilla.calibration.fitting.sweep import corrected
from papilla.calibration.published import SPECIMENS_MPA, published_sd
from papilla.core.files import write_text
from papilla.core.units import gf_to_newton
from papilla.fem.finite.strain_tables import PressedFinger, measure_large_strain
from papilla.fem.pressing.large_strain import ALL_SHIPPED, LargeStrain, keep, known, shipped_text
from papilla.fem.reduction.family import FingerFamily, family, with_moduli
from papilla.mesh import DEFAULT_SIZE_MM, build
from papilla.model.finger import Bench, Finger, Gauge
from papilla.model.specimen import STICK_WORD, Friction, Specimen, friction_coefficient
from papilla_papers.claims.experiments.fitted import DEPTH_ERROR, SD_MISFIT, SD_NUMBERS

FORCE_GF, HEAVY = np.arange(10.0, 101.0, 10.0), 2
"""Forces at which (9) is compared, and the first of the 30-100 gf."""
PUBLISHED = published_sd(FORCE_GF[:, None], np.array(SPECIMENS_MPA))
LENGTHS_MM, ANGLES_DEG = (0.2, 1.0, 2.4), (0, 20, 40)
"""Grid lengths between which readings are interpolated, and angles of the default's gauges on one side."""
RATIOS, INNER_MPA = np.geomspace(2.0, 8.0, 7), np.geomspace(0.0265, 0.054, 5)
"""Moduli, outer over inner and inner, between which presses are interpolated."""
TABLE_RATIOS = (2.0, 4.0, 8.0)
"""Ratios of moduli at which presses at finite strain are made."""
LIGHTEST = 0.9
"""F / E_inner (mm2) below which large strain changes nothing."""

CHI_SQUARE_95 = 3.84


@dataclass(frozen=True)
class Parameter:
    """A parameter of the fit: unit, literature range, where it starts, and the width of its prior about that.

    width : in the logarithm; None for what the range alone holds.
    """

    unit: str
    low: float
    high: float
    start: float
    width: float | None = None


HALF_AN_OCTAVE = np.log(2) / 2
PARAMETERS = {
    "outer_modulus": Parameter("MPa", 0.068, 0.272, 0.136, HALF_AN_OCTAVE),
    "inner_modulus": Parameter("MPa", 0.0265, 0.054, 0.034, HALF_AN_OCTAVE),
    "lever": Parameter("mm", -2.0, 1.0, -1.1),
    "grid_length": Parameter("mm", 1.0, 2.4, 1.5),
    "touch_down": Parameter("mm", 0.05, 0.3, 0.155),
}
"""Moduli: epidermis and subcutaneous tissue, within a factor of two, by which batches of one silicone differ (as far as
presses at finite strain go). Lever over gain: of a foil in rubber. Grid: from what the mesh tells, an element, to half
of its backing, which strains as one; foils with shorter grids are made."""


def carrier() -> Finger:
    """The default finger with gauges of all lengths on one side; the other is its mirror image."""
    gauges = [Gauge(f"a{a:g}L{L}", angle_deg=float(a), length_mm=L) for L in LENGTHS_MM for a in ANGLES_DEG]
    return replace(Finger.default(), gauges=tuple(gauges))


@lru_cache(maxsize=1)
def relatives(size_mm: float) -> FingerFamily:
    """The family of the carrier on the mesh of the default finger."""
    return family(carrier(), mesh=build(Finger.default(), size_mm=size_mm), progress=print)


def measure_strain(friction: Friction, size_mm: float) -> None:
    """Make what large strain changes for the carrier at a friction, unless it is known."""
    design, stuck = carrier(), friction_coefficient(friction) > 0
    mesh = build(Finger.default(), size_mm=size_mm)
    for ratio in TABLE_RATIOS:
        tables = known(design.strain_sha256)
        if not any((one.friction > 0) == stuck and abs(one.ratio / ratio - 1) < 1e-3 for one in tables):
            inner = design.inner.modulus
            print(f"presses at finite strain, outer over inner modulus {ratio:g}, friction {friction}", flush=True)
            one = measure_large_strain(
                PressedFinger(with_moduli(design, ratio * inner, inner), mesh), friction=friction
            )
            keep(design.strain_sha256, [one])


@dataclass(frozen=True)
class Physics:
    """Under what presses are made."""

    friction: Friction = STICK_WORD
    large_strain: bool = True
    size_mm: float = DEFAULT_SIZE_MM

    def presses(self, ratio: float, inner: float) -> tuple[np.ndarray, np.ndarray]:
        """(forces, moduli, q, gauges) of the carrier's gauges, and depths (k,) in mm at `PUBLISHED_POINTS`."""
        reduced = relatives(self.size_mm).at(ratio * inner, inner)

        def one(specimen: Specimen, force: float) -> fem.Press:
            found = fem.press(reduced, specimen, force=float(force), fidelity="contact", friction=self.friction)
            return corrected(reduced, specimen, found) if self.large_strain and force > LIGHTEST * inner else found

        felt = [[one(Bench().specimen(E), force).values for E in SPECIMENS_MPA] for force in gf_to_newton(FORCE_GF)]
        return np.array(felt), np.array([one(RIGID_SPECIMEN, force).indentation for _, force in PUBLISHED_POINTS])


class Model:
    """S_d and depth of all fingers under some physics, between presses of a grid of moduli."""

    def __init__(self, physics: Physics, ratios: np.ndarray = RATIOS, inner_MPa: np.ndarray = INNER_MPA):
        if physics.large_strain:
            measure_strain(physics.friction, physics.size_mm)
        grid = [[physics.presses(ratio, inner) for inner in inner_MPa] for ratio in ratios]
        felt, depth = (np.array([[one[part] for one in row] for row in grid]) for part in (0, 1))
        axes = (np.log(ratios), np.log(inner_MPa))
        self._felt, self._depth = (
            RegularGridInterpolator(axes, values, method="cubic")
            for values in (felt.reshape(*felt.shape[:-1], len(LENGTHS_MM), -1), depth)
        )

    def sd(self, values: dict[str, float]) -> np.ndarray:
        """S_d (forces, moduli) in microstrain."""
        felt = self._felt(self._place(values))[0]
        weights = BarycentricInterpolator(np.square(LENGTHS_MM), np.eye(len(LENGTHS_MM)))(values["grid_length"] ** 2)
        # The backing, and with it the curvature, is the same for all lengths
        strain, curvature = np.einsum("...la,l->...a", felt[..., 0, :, :], weights), felt[..., 1, -1, :]
        apex, near, far = np.moveaxis(strain + values["lever"] * curvature, -1, 0)
        return 1e6 * np.std([apex, near, near, far, far], axis=0)

    def depths(self, values: dict[str, float]) -> np.ndarray:
        """Depths (k,) in mm at `PUBLISHED_POINTS`, from where the touch-down was told."""
        return self._depth(self._place(values))[0] + values["touch_down"]

    def _place(self, values: dict[str, float]) -> list[float]:
        ratio = np.clip(values["outer_modulus"] / values["inner_modulus"], RATIOS[0], RATIOS[-1])
        return [float(np.log(ratio)), float(np.log(values["inner_modulus"]))]


@dataclass(frozen=True, eq=False)
class Fit:
    """Values by name, scale (published S_d per microstrain), weighted misfit, and its parts.

    rms, rms_heavy : of S_d from (9) over 10-100 and 30-100 gf, of the rms of its values there. depths : (k,) mm.
    differences : (forces, moduli) of scaled S_d from (9), in its unit.
    """

    values: dict[str, float]
    cost: float
    scale: float
    rms: float
    rms_heavy: float
    depths: np.ndarray
    differences: np.ndarray


def scaled(sd: np.ndarray) -> tuple[float, np.ndarray]:
    """The factor that brings S_d closest to (9), and what is left (forces, moduli)."""
    scale = float((sd * PUBLISHED).sum() / (sd**2).sum())
    return scale, scale * sd - PUBLISHED


def relative(differences: np.ndarray, first: int = 0) -> float:
    """Root mean square of differences from (9), of that of its values, from force number `first` on."""
    return float(np.sqrt((differences[first:] ** 2).sum() / (PUBLISHED[first:] ** 2).sum()))


def fit(model: Model, fixed: dict[str, float] | None = None, start: dict[str, float] | None = None) -> Fit:
    """The best values of all parameters but the `fixed` ones, from their own starts or those of another fit."""
    fixed = fixed or {}
    free = [name for name in PARAMETERS if name not in fixed]

    def values_of(unknowns: np.ndarray) -> dict[str, float]:
        return fixed | dict(zip(free, unknowns.tolist(), strict=True))

    def residuals(unknowns: np.ndarray) -> np.ndarray:
        """What the fit makes small, each over its sigma: misfits of S_d and depths, and distances from the priors."""
        values = values_of(unknowns)
        _, left = scaled(model.sd(values))
        regression = left.ravel() / np.sqrt((PUBLISHED**2).mean()) / SD_MISFIT * np.sqrt(SD_NUMBERS / PUBLISHED.size)
        published = np.array([depth for depth, _ in PUBLISHED_POINTS])
        depth = (model.depths(values) / published - 1) / DEPTH_ERROR
        priors = [np.log(values[n] / p.start) / p.width for n, p in PARAMETERS.items() if p.width]
        ratio = np.log(values["outer_modulus"] / values["inner_modulus"])
        beyond = (ratio - np.clip(ratio, np.log(RATIOS[0]), np.log(RATIOS[-1]))) / 0.01
        return np.concatenate([regression, depth, priors, [beyond]])

    limits = np.array([(PARAMETERS[name].low, PARAMETERS[name].high) for name in free]).T
    inside = 1e-3 * (limits[1] - limits[0])
    begin = np.clip([start[n] if start else PARAMETERS[n].start for n in free], limits[0] + inside, limits[1] - inside)
    found = least_squares(residuals, begin, bounds=limits, x_scale=np.abs(begin), diff_step=1e-4)
    values = values_of(found.x)
    scale, left = scaled(model.sd(values))
    rms = relative(left), relative(left, HEAVY)
    return Fit(values, 2 * float(found.cost), scale, *rms, model.depths(values), left)


def interval(model: Model, best: Fit, name: str) -> tuple[float, float]:
    """Where a parameter's profile stays within the 95 % of one degree of freedom; its range where that ends first."""

    def above(value: float) -> float:
        return fit(model, {name: value}, best.values).cost - best.cost - CHI_SQUARE_95

    one, middle = PARAMETERS[name], best.values[name]
    ends = []
    for end in (one.low, one.high):
        inside = abs(middle - end) < 1e-6 * (one.high - one.low) or above(end) < 0
        ends.append(end if inside else brentq(above, *sorted((middle, end)), xtol=2e-3 * (one.high - one.low)))
    return ends[0], ends[1]


def as_regression(sd: np.ndarray) -> np.ndarray:
    """S_d (forces, moduli) as the form of (9) has it: its least-squares fit, which is additive in force and modulus."""
    force, modulus = np.broadcast_arrays(FORCE_GF[:, None], np.array(SPECIMENS_MPA))
    columns = np.stack([force**2, force, modulus**2, modulus, np.ones_like(force)], axis=-1).reshape(-1, 5)
    return (columns @ np.linalg.lstsq(columns, sd.ravel(), rcond=None)[0]).reshape(sd.shape)


def told(found: Fit) -> str:
    """A fit in a line."""
    values = ", ".join(f"{name} {value:.4g} {PARAMETERS[name].unit}" for name, value in found.values.items())
    depths = ", ".join(f"{depth:.3f}" for depth in found.depths)
    return f"{100 * found.rms:.2f} % rms, {100 * found.rms_heavy:.2f} % over 30-100 gf; {values}; depths {depths} mm"


def published_tables(grid_length: float) -> list[LargeStrain]:
    """What large strain changes for five gauges of a grid length (mm), between those of the carrier."""
    design = carrier()
    names = [gauge.name for gauge in design.gauges]
    weights = BarycentricInterpolator(np.square(LENGTHS_MM), np.eye(len(LENGTHS_MM)))(grid_length**2)
    pick = np.zeros((5, len(names)))
    for row, angle in enumerate((40, 20, 0, 20, 40)):
        for length, weight in zip(LENGTHS_MM, weights, strict=True):
            pick[row, names.index(f"a{angle}L{length}")] = weight

    def between(values: np.ndarray) -> np.ndarray:
        gauges = values[:, 3:].reshape(len(values), -1, len(names)) @ pick.T
        return np.hstack([values[:, :3], gauges.reshape(len(values), -1)])

    tables = known(design.strain_sha256)
    return [replace(one, linear=between(one.linear), finite=between(one.finite)) for one in tables]


def main(write: bool = False, quick: bool = False) -> None:
    """Fit, tell, and write the table that ships beside the design if asked to; --quick: small strain without friction,
    a coarse mesh and few moduli, which says only that all runs."""
    if quick:
        few = (np.geomspace(axis[0], axis[-1], 4) for axis in (RATIOS, INNER_MPA))
        model = Model(Physics(0.0, False, 2 * DEFAULT_SIZE_MM), *few)
    else:
        model = Model(Physics())
    best = fit(model)
    print(f"the fit: {told(best)}; scale {best.scale:.4f}")
    print("left of S_d, in the unit of (9), from 10 to 100 gf, softest to hardest specimen:")
    print(np.array2string(best.differences, precision=0, suppress_small=True))
    each = best.differences / PUBLISHED
    whole, heavy = (100 * float(np.sqrt(np.mean(part**2))) for part in (each, each[HEAVY:]))
    print(f"press by press, each over its own value of (9): {whole:.1f} % rms, {heavy:.1f} % over 30-100 gf")
    through = scaled(as_regression(model.sd(best.values)))[1]
    print(
        f"the same S_d put through the form of (9) first: {100 * relative(through):.2f} % rms, "
        f"{100 * relative(through, HEAVY):.2f} % over 30-100 gf"
    )
    for name in PARAMETERS:
        low, high = interval(model, best, name)
        print(f"{name}: {best.values[name]:.4g}, {low:.4g} to {high:.4g} {PARAMETERS[name].unit}", flush=True)
    if write and not quick:
        measure_strain(0.0, DEFAULT_SIZE_MM)
        design = Finger.published()
        tables = published_tables(design.gauges[0].length_mm)
        write_text(ALL_SHIPPED[1], shipped_text(design.strain_sha256, tables))
        print(f"wrote {ALL_SHIPPED[1]}")


if __name__ == "__main__":
    typer.run(main)
