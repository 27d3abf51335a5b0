"""Simulated fingers, identified from a few presses: how well is S_d predicted, and is an aged finger noticed.

Run with `python benchmarks/identified_fingers.py presses` or `... ageing`. Moduli are off by up to a factor of two,
gains are 0.01 to 1 of either sign, levers -2 to 1 mm of the gain, zeros up to 20 microstrain, forces 1 % and readings 5
microstrain off. Truths are presses on another mesh than the fit's, or (--family, ageing) its smooth response.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import typer

from papilla import fem
from papilla.core.units import gf_to_newton, to_microstrain
from papilla.fem.pressing.response import Response, response
from papilla.fem.reduction.family import MODULUS_RATIO_ENDS, FingerFamily
from papilla.identification import Identification, compare, diagnose, identify, record
from papilla.identification.posing import family_of
from papilla.logs import PressLog
from papilla.model.finger import Finger
from papilla.model.specimen import Block

SIZE_MM, VARIANT = 1.0, 1
THICKNESS_MM, TOUCH_DOWN_MM = 10.0, 0.15
NOISE, FORCE_ERROR, DEPTH_NOISE_MM, ZERO = 5.0, 0.01, 0.02, 20.0
GAINS = (0.01, 1.0)
DOMAIN_N, DOMAIN_MPA = (gf_to_newton(5.0), gf_to_newton(100.0)), (0.05, 0.72)
COUNTS = (3, 5, 10, 20)

Felt = Callable[[np.ndarray, np.ndarray, float, float], tuple[np.ndarray, np.ndarray]]
"""Forces (n,), moduli (n,), outer and inner modulus -> what gauges feel (n, q, g), indentations (n,) in mm."""


@dataclass(frozen=True)
class Drawn:
    """A finger that was drawn: its parameters by name, and what its gauges feel of a press."""

    design: Finger
    felt: Felt
    values: dict[str, float]

    @classmethod
    def by(
        cls, rng: np.random.Generator, design: Finger, felt: Felt, moduli: tuple[float, float], gains=GAINS
    ) -> "Drawn":
        """One of these moduli (outer, inner), its gauges at random."""
        values = {"outer_modulus_MPa": moduli[0], "inner_modulus_MPa": moduli[1], "touch_down_mm": TOUCH_DOWN_MM}
        for gauge in design.gauges:
            gain = math.exp(rng.uniform(*np.log(gains))) * rng.choice([-1, 1])
            values[f"gain.{gauge.name}"] = gain
            values[f"lever_mm.{gauge.name}"] = gain * rng.uniform(-2, 1)
            values[f"zero_microstrain.{gauge.name}"] = rng.uniform(-ZERO, ZERO)
        return cls(design, felt, values)

    def of(self, name: str) -> np.ndarray:
        """(g,) a parameter of all gauges."""
        return np.array([self.values[f"{name}.{gauge.name}"] for gauge in self.design.gauges])

    def readings(self, force: np.ndarray, modulus: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Readings without zeros (n, g) and indentations (n,) of presses."""
        values, depth = self.felt(force, modulus, self.values["outer_modulus_MPa"], self.values["inner_modulus_MPa"])
        return to_microstrain(self.of("gain") * values[:, 0] + self.of("lever_mm") * values[:, 1]), depth

    def log(self, rng: np.random.Generator, force: np.ndarray, modulus: np.ndarray, depths: bool = True) -> PressLog:
        """The log of presses on a bench."""
        readings, depth = self.readings(force * (1 + FORCE_ERROR * rng.normal(size=len(force))), modulus)
        readings = readings + self.of("zero_microstrain") + NOISE * rng.normal(size=readings.shape)
        measured = np.maximum(depth + TOUCH_DOWN_MM + DEPTH_NOISE_MM * rng.normal(size=len(depth)), 1e-3)
        names = tuple(gauge.name for gauge in self.design.gauges)
        return PressLog(force, modulus, readings, names, measured if depths else None)


def drawn(rng: np.random.Generator, relatives: FingerFamily, smooth: Response | None) -> Drawn:
    """A finger of the default geometry, whose presses are those of a family, or of its smooth response."""
    design = Finger.default()
    while True:
        outer, inner = (layer.modulus * 2 ** rng.uniform(-1, 1) for layer in (design.outer, design.inner))
        if MODULUS_RATIO_ENDS[0] <= outer / inner <= MODULUS_RATIO_ENDS[1]:
            break

    def felt(force, modulus, *moduli):
        if smooth is not None:
            told = smooth.felt(force, modulus, *moduli)
            return told.values, told.indentation
        member, pairs = relatives.at(*moduli), zip(force.tolist(), modulus.tolist(), strict=True)
        presses = [fem.press(member, Block(e, THICKNESS_MM), force=f) for f, e in pairs]
        return np.array([one.values for one in presses]), np.array([one.indentation for one in presses])

    return Drawn.by(rng, design, felt, (outer, inner))


def ln_sd(found: Identification, force: np.ndarray, modulus: np.ndarray) -> tuple[np.ndarray, ...]:
    """ln S_d of the identified finger, its slope by ln force, and one sigma of what identification and mesh leave."""
    g = len(found.problem.gauges)
    modelled = found.problem.of(force, modulus).modelled(found.vector)
    zeros = np.array([found.values[f"zero_microstrain.{gauge.name}"] for gauge in found.problem.finger.gauges])
    readings = modelled.values[:, :g] - zeros
    about = readings - readings.mean(axis=1, keepdims=True)
    square = (about**2).sum(axis=1)
    slopes = np.einsum("ng,ngf->nf", about, modelled.by_free[:, :g]) / square[:, None]
    mesh = np.sqrt(((about * modelled.unsure[:, :g]) ** 2).sum(axis=1)) / square
    sigma = np.hypot(np.sqrt(np.einsum("nf,fe,ne->n", slopes, found.covariance, slopes)), mesh)
    by_force = (about * modelled.by_ln_force[:, :g]).sum(axis=1) / square
    return 0.5 * np.log(square / g), by_force, sigma


def chosen(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Forces and moduli of so many presses, on two specimens in turn, light and heavy ones."""
    force = np.geomspace(0.1, 0.98, count)
    return force, np.where(np.arange(count) % 2 == 0, 0.51, 0.089)


def quadratic(log: PressLog, force: np.ndarray, modulus: np.ndarray) -> np.ndarray:
    """S_d by the published form through the same presses."""

    def terms(f: np.ndarray, e: np.ndarray) -> np.ndarray:
        return np.column_stack([f**2, f, e**2, e, np.ones_like(f)])

    best = np.linalg.lstsq(terms(log.force_N, log.modulus_MPa), log.sd_microstrain)[0]
    return terms(force, modulus) @ best


def gaussian_process(log: PressLog, force: np.ndarray, modulus: np.ndarray) -> np.ndarray:
    """S_d by a Gaussian process for its logarithm over ln force and ln modulus."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

    kernel = ConstantKernel(1.0, (1e-2, 1e2)) * RBF([1.0, 1.0], (0.1, 30)) + WhiteKernel(1e-3, (1e-6, 1e-1))
    fitted = GaussianProcessRegressor(kernel, normalize_y=True, n_restarts_optimizer=3, random_state=0)
    fitted.fit(np.log(np.column_stack([log.force_N, log.modulus_MPa])), np.log(log.sd_microstrain))
    return np.exp(fitted.predict(np.log(np.column_stack([force, modulus]))))


def few_presses(draws: int, smooth: bool, depths: bool, size_mm: float, variant: int, counts: Sequence[int]) -> None:
    """Error of S_d over the whole domain against the number of presses: identified, quadratic, Gaussian process."""
    import warnings

    warnings.simplefilter("ignore")  # the process warns of length scales at their bounds
    finger = Finger.default()
    relatives = family_of(finger, size_mm=size_mm, variant=variant)
    other = response(relatives, Block(1.0, THICKNESS_MM)) if smooth else None
    force, modulus = (one.ravel() for one in np.meshgrid(np.geomspace(*DOMAIN_N, 7), np.geomspace(*DOMAIN_MPA, 6)))
    print("presses   " + "".join(name.rjust(24) for name in ("identified", "quadratic", "Gaussian process")))
    for count in counts:
        errors = []
        for seed in range(draws):
            rng = np.random.default_rng(1000 + seed)
            truth = drawn(rng, relatives, other)
            log = truth.log(rng, *chosen(count), depths)
            sd = truth.readings(force, modulus)[0].std(axis=1)
            told = (
                np.exp(ln_sd(identify(log, finger, size_mm=size_mm), force, modulus)[0]),
                quadratic(log, force, modulus),
                gaussian_process(log, force, modulus),
            )
            errors.append([np.sqrt(np.mean((one / sd - 1) ** 2)) for one in told])
        middle, high = np.median(errors, axis=0), np.quantile(errors, 0.9, axis=0)
        cells = (f"{100 * m:.1f} % (9 of 10: {100 * h:.0f} %)" for m, h in zip(middle, high, strict=True))
        print(f"{count:7}   " + "".join(cell.rjust(24) for cell in cells))


def ageing(draws: int, size_mm: float, variant: int) -> None:
    """Share of unchanged fingers that are called changed, and of changed ones that are not, by a fingerprint of two."""
    finger = Finger.default()
    relatives = family_of(finger, size_mm=size_mm, variant=variant)
    other = response(relatives, Block(1.0, THICKNESS_MM))
    force, modulus = (one.ravel() for one in np.meshgrid(np.geomspace(0.05, 0.98, 5), (0.089, 0.51, 0.72)))
    few = np.array([0.4, 0.9]), np.array([0.089, 0.51])
    changes = {
        "nothing": lambda values: values,
        "inner layer 15 % softer": lambda values: values | {"inner_modulus_MPa": 0.85 * values["inner_modulus_MPa"]},
        "outer layer 30 % softer": lambda values: values | {"outer_modulus_MPa": 0.7 * values["outer_modulus_MPa"]},
        "g3 reads 10 % less": lambda values: values | {name: 0.9 * values[name] for name in ("gain.g3", "lever_mm.g3")},
        "zero of g1 drifts by 60 microstrain": lambda values: (
            values | {"zero_microstrain.g1": values["zero_microstrain.g1"] + 60}
        ),
    }
    alarms: dict[str, list[bool]] = {name: [] for name in changes}
    for seed in range(draws):
        rng = np.random.default_rng(5000 + seed)
        truth = drawn(rng, relatives, other)
        found = identify(truth.log(rng, force, modulus), finger, size_mm=size_mm)
        stored = found.with_record(record(found, diagnose(found), "block"))
        for name, change in changes.items():
            later = replace(truth, values=change(truth.values)).log(rng, *few)
            alarms[name].append(not compare(stored, later, size_mm=size_mm).same)
    for name, called in alarms.items():
        print(f"{name:40} recalibrate in {100 * np.mean(called):.0f} % of {len(called)} fingers, from two presses")


def main(
    study: Literal["presses", "ageing"], fingers: int = 200, family: bool = False, depths: bool = False,
    size_mm: float = SIZE_MM, variant: int = VARIANT, counts: list[int] | None = None,
) -> None:  # fmt: skip
    """Run the study of so many fingers; --depths: presses measure the indentation too; --variant: mesh of the truths;
    --counts: presses of a log."""
    if study == "ageing":
        ageing(fingers, size_mm, variant)
    else:
        few_presses(fingers, family, depths, size_mm, variant, counts or COUNTS)


if __name__ == "__main__":
    typer.run(main)
