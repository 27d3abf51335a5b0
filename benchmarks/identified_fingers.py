"""Simulated fingers, identified from a few presses: do intervals hold what they say, and how well is S_d predicted.

Run with `python benchmarks/identified_fingers.py coverage`, `... presses` or `... ageing`. Moduli are off by up to a
factor of two, gains are 0.01 to 1 of either sign, levers -2 to 1 mm of the gain, zeros up to 20 microstrain, forces 1 %
and readings 5 microstrain off. Truths are presses on another mesh than the fit's, or (--family) its smooth response.
"""

import argparse
from dataclasses import dataclass

import numpy as np

from papilla import fem
from papilla.calibrate.identification import PARAMETERS, Identification, compare, diagnose, identify, record
from papilla.calibrate.identification.parameters import kind
from papilla.calibrate.identification.posing import family_of
from papilla.fem.pressing.response import Response, response
from papilla.fem.reduction.family import RATIOS, FingerFamily
from papilla.finger import Finger
from papilla.logs import PressLog
from papilla.specimen import Block
from papilla.units import gf_to_newton

SIZE_MM, VARIANT, FIT_SIZE_MM = 1.0, 1, 1.0
THICKNESS_MM, TOUCH_DOWN_MM = 10.0, 0.15
NOISE, FORCE_ERROR, DEPTH_NOISE_MM, ZERO = 5.0, 0.01, 0.02, 20.0
DOMAIN_N, DOMAIN_MPA = (gf_to_newton(5.0), gf_to_newton(100.0)), (0.05, 0.72)
COUNTS = (3, 5, 10, 20)


@dataclass
class Drawn:
    """A finger that was drawn: its parameters by name, and where it comes from."""

    values: dict[str, float]
    relatives: FingerFamily
    smooth: Response | None

    @classmethod
    def by(cls, rng: np.random.Generator, relatives: FingerFamily, smooth: Response | None) -> "Drawn":
        """One at random."""
        design = Finger.default()
        while True:
            outer, inner = (layer.modulus * 2 ** rng.uniform(-1, 1) for layer in (design.outer, design.inner))
            if RATIOS[0] <= outer / inner <= RATIOS[1]:
                break
        values = {"outer_modulus_MPa": outer, "inner_modulus_MPa": inner, "touch_down_mm": TOUCH_DOWN_MM}
        values["stick_share"] = 1.0  # as presses have it that nobody told of friction
        for gauge in design.gauges:
            gain = np.exp(rng.uniform(np.log(0.01), 0.0)) * rng.choice([-1, 1])
            values[f"gain.{gauge.name}"] = gain
            values[f"lever_mm.{gauge.name}"] = gain * rng.uniform(-2, 1)
            values[f"zero_microstrain.{gauge.name}"] = rng.uniform(-ZERO, ZERO)
        return cls(values, relatives, smooth)

    def of(self, name: str) -> np.ndarray:
        """(g,) a parameter of all gauges."""
        return np.array([self.values[f"{name}.{gauge.name}"] for gauge in self.relatives.finger.gauges])

    def felt(self, force: np.ndarray, modulus: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Readings without zeros (n, g) and indentations (n,) of presses."""
        moduli = self.values["outer_modulus_MPa"], self.values["inner_modulus_MPa"]
        if self.smooth is not None:
            told = self.smooth.felt(force, modulus, *moduli)
            values, depth = told.values, told.indentation
        else:
            member, pairs = self.relatives.at(*moduli), zip(force.tolist(), modulus.tolist(), strict=True)
            presses = [fem.press(member, Block(e, THICKNESS_MM), force=f) for f, e in pairs]
            values, depth = np.array([one.values for one in presses]), np.array([one.indentation for one in presses])
        return 1e6 * (self.of("gain") * values[:, 0] + self.of("lever_mm") * values[:, 1]), depth

    def log(self, rng: np.random.Generator, force: np.ndarray, modulus: np.ndarray, depths: bool) -> PressLog:
        """The log of presses on a bench."""
        readings, depth = self.felt(force * (1 + FORCE_ERROR * rng.normal(size=len(force))), modulus)
        readings = readings + self.of("zero_microstrain") + NOISE * rng.normal(size=readings.shape)
        measured = depth + TOUCH_DOWN_MM + DEPTH_NOISE_MM * rng.normal(size=len(depth))
        names = tuple(gauge.name for gauge in self.relatives.finger.gauges)
        return PressLog(force, modulus, readings, names, np.maximum(measured, 1e-3) if depths else None)


def pulls(found: Identification, truth: Drawn) -> dict[str, list[float]]:
    """Errors of the free parameters over their sigma, by kind."""
    gathered: dict[str, list[float]] = {}
    for name in found.names:
        value, sigma = found[name]
        true = truth.values[name]
        off = np.log(value / true) if PARAMETERS[kind(name)].logarithmic else value - true
        gathered.setdefault(kind(name), []).append(float(off / sigma))
    return gathered


def ln_sd(found: Identification, force: np.ndarray, modulus: np.ndarray) -> tuple[np.ndarray, ...]:
    """ln S_d of the identified finger, its slope by ln force, and one sigma of what identification and mesh leave."""
    g = found.problem.gauge_count
    modelled = found.other_presses(force, modulus).modelled(found.vector)
    zeros = np.array([found.values[f"zero_microstrain.{gauge.name}"] for gauge in found.problem.finger.gauges])
    readings = modelled.values[:, :g] - zeros
    about = readings - readings.mean(axis=1, keepdims=True)
    square = (about**2).sum(axis=1)
    slopes = np.einsum("ng,ngf->nf", about, modelled.by_free[:, :g]) / square[:, None]
    mesh = np.sqrt(((about * modelled.unsure[:, :g]) ** 2).sum(axis=1)) / square
    sigma = np.hypot(np.sqrt(np.einsum("nf,fe,ne->n", slopes, found.covariance, slopes)), mesh)
    by_force = (about * modelled.by_ln_force[:, :g]).sum(axis=1) / square
    return 0.5 * np.log(square / g), by_force, sigma


def coverage(draws: int, smooth: bool) -> None:
    """Shares of parameters, and of moduli inverted from S_d of fresh presses, inside their intervals."""
    finger = Finger.default()
    relatives = family_of(finger, size_mm=SIZE_MM, variant=VARIANT)
    other = response(relatives, Block(1.0, THICKNESS_MM)) if smooth else None
    force, modulus = (one.ravel() for one in np.meshgrid(np.geomspace(0.05, 0.98, 5), (0.089, 0.51, 0.72)))
    gathered: dict[str, list[float]] = {}
    for seed in range(draws):
        rng = np.random.default_rng(seed)
        truth = Drawn.by(rng, relatives, other)
        found = identify(truth.log(rng, force, modulus, True), finger, size_mm=FIT_SIZE_MM)
        for name, values in pulls(found, truth).items():
            gathered.setdefault(name, []).extend(values)
        fresh, E = np.exp(rng.uniform(*np.log((0.2, 0.98)), 1)), np.exp(rng.uniform(*np.log(DOMAIN_MPA), 1))
        readings = truth.felt(fresh * (1 + FORCE_ERROR * rng.normal(size=1)), E)[0] + truth.of("zero_microstrain")
        zeros = np.array([found.values[f"zero_microstrain.{gauge.name}"] for gauge in finger.gauges])
        sd = (readings + NOISE * rng.normal(size=readings.shape) - zeros).std(axis=1)
        told, by_force, sigma = ln_sd(found, fresh, E)
        noise = np.hypot(NOISE / np.sqrt(readings.shape[1]) / sd, by_force * FORCE_ERROR)
        gathered.setdefault("E from S_d", []).append(float(((np.log(sd) - told) / np.hypot(sigma, noise))[0]))
    print(f"{draws} fingers, {len(force)} presses each, {'smooth response' if smooth else 'presses'} of another mesh")
    for name, values in gathered.items():
        size = np.abs(values)
        n = len(values)
        parts = [
            f"{100 * (size < half).mean():.1f} % in {level} % (+- {3 * spread(level / 100, draws):.1f})"
            for half, level in ((0.994, 68), (1.96, 95))
        ]
        print(f"{name:20} {n:6} values: {'; '.join(parts)}; rms pull {np.sqrt(np.mean(size**2)):.2f}")


def spread(share: float, count: int) -> float:
    """Binomial standard error of a share, in percent."""
    return 100 * float(np.sqrt(share * (1 - share) / count))


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


def few_presses(draws: int, smooth: bool, depths: bool) -> None:
    """Error of S_d over the whole domain against the number of presses: identified, quadratic, Gaussian process."""
    import warnings

    warnings.simplefilter("ignore")  # the process warns of length scales at their bounds
    finger = Finger.default()
    relatives = family_of(finger, size_mm=SIZE_MM, variant=VARIANT)
    other = response(relatives, Block(1.0, THICKNESS_MM)) if smooth else None
    force, modulus = (one.ravel() for one in np.meshgrid(np.geomspace(*DOMAIN_N, 7), np.geomspace(*DOMAIN_MPA, 6)))
    print("presses   " + "".join(name.rjust(24) for name in ("identified", "quadratic", "Gaussian process")))
    for count in COUNTS:
        errors = []
        for seed in range(draws):
            rng = np.random.default_rng(1000 + seed)
            truth = Drawn.by(rng, relatives, other)
            log = truth.log(rng, *chosen(count), depths)
            sd = truth.felt(force, modulus)[0].std(axis=1)
            told = (
                np.exp(ln_sd(identify(log, finger, size_mm=FIT_SIZE_MM), force, modulus)[0]),
                quadratic(log, force, modulus),
                gaussian_process(log, force, modulus),
            )
            errors.append([np.sqrt(np.mean((one / sd - 1) ** 2)) for one in told])
        middle, high = np.median(errors, axis=0), np.quantile(errors, 0.9, axis=0)
        cells = (f"{100 * m:.1f} % (9 of 10: {100 * h:.0f} %)" for m, h in zip(middle, high, strict=True))
        print(f"{count:7}   " + "".join(cell.rjust(24) for cell in cells))


def ageing(draws: int) -> None:
    """Share of unchanged fingers that are called changed, and of changed ones that are not, by a fingerprint of two."""
    finger = Finger.default()
    relatives = family_of(finger, size_mm=SIZE_MM, variant=VARIANT)
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
        truth = Drawn.by(rng, relatives, other)
        found = identify(truth.log(rng, force, modulus, True), finger, size_mm=FIT_SIZE_MM)
        stored = found.with_record(record(found, diagnose(found), "block"))
        for name, change in changes.items():
            later = Drawn(change(truth.values), relatives, other).log(rng, *few, True)
            alarms[name].append(not compare(stored, later, size_mm=FIT_SIZE_MM).same)
    for name, called in alarms.items():
        print(f"{name:40} recalibrate in {100 * np.mean(called):.0f} % of {len(called)} fingers, from two presses")


def main() -> None:
    """Run the study that is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study", choices=("coverage", "presses", "ageing"))
    parser.add_argument("--fingers", type=int, default=200)
    parser.add_argument("--family", action="store_true")
    parser.add_argument("--depths", action="store_true", help="presses measure the indentation too")
    asked = parser.parse_args()
    if asked.study == "coverage":
        coverage(asked.fingers, asked.family)
    elif asked.study == "ageing":
        ageing(asked.fingers)
    else:
        few_presses(asked.fingers, asked.family, asked.depths)


if __name__ == "__main__":
    main()
