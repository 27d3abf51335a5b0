"""Fingers of one's own, identified from presses that papilla did not make: parameters, S_d, E and what is doubted.

`python benchmarks/own_identification.py [--geometry A] [--fingers 12] [--seed 1] [--presses 15 5]`

Truths are paths of `papilla.references.axisymmetric` (finger and block at finite strain) over forces, at a few
moduli and ratios, between which a polynomial goes. Of each finger the inner
modulus is 0.9 to 1.6 of the design's, the outer 2 to 8 times that, gains 0.02 to 0.2 of either sign, levers -2 to 1 mm
of the gain, zeros up to 20 microstrain; its presses stick, have a friction of 0.1 or none, in turn. Noise is 5
microstrain, 1 % of force, 0.02 mm of depth. Each is identified with its friction told and not told. E is told from S_d
of fresh presses. `--geometry default` is the finger that ships, whose truth is the model itself: what noise alone does.
"""

import argparse
import math
import sys
from dataclasses import dataclass
from functools import lru_cache
from time import perf_counter

import numpy as np
from identified_fingers import FORCE_ERROR, NOISE, THICKNESS_MM, Drawn, ln_sd
from own_fingers import SCENES, SPECIMEN_NU
from scipy.interpolate import BarycentricInterpolator, CubicSpline

from papilla.core import cache
from papilla.core.errors import SolverError
from papilla.core.units import gf_to_newton
from papilla.fem.pressing.response import response
from papilla.identification import PARAMETERS_BY_NAME, diagnose, identify
from papilla.identification.parameters import kind
from papilla.identification.posing import family_of
from papilla.identification.suggest import suggest_presses
from papilla.logs import PressLog
from papilla.model.finger import Finger
from papilla.model.specimen import STICK_WORD, Block, Friction, friction_coefficient
from papilla.references.axisymmetric import presses as presses_of
from papilla.references.axisymmetric.bodies import Bodies, Rubber

FRICTIONS: tuple[Friction, ...] = (STICK_WORD, 0.1, 0.0)
GAINS = (0.02, 0.2)
DEFAULT = "default"
GEOMETRIES = {scene.name: scene for scene in SCENES}
ON_MPA = (0.089, 0.51, 0.72)
"""Moduli of the specimens that are pressed."""
TESTS_MPA, SCENES = (0.05, 0.72), 6
"""Moduli of unseen presses, 10 to 100 gf, and how many of a finger tell E."""
BOOTSTRAPS = 2000

STEPS = ((0.04, 1.3), (0.03, 1.25), (0.04, 1.2), (0.1, 1.3), (0.1, 1.2))
"""First indentation (mm) of a path and the ratio of the next to it: the first two that converge. S_d at 5 to 100 gf
differs by 0.1 % with ratios of 1.3 and 1.1."""

LOADS = np.geomspace(0.5, 34.0, 28)
"""F / E_inner in mm2 at which the truth is kept."""


HALF = 4.0
"""E / E_inner at which a specimen counts as half rigid: what gauges feel is nearly linear in e / (e + this)."""


def nodes(low: float, high: float, count: int) -> np.ndarray:
    """Where a polynomial goes through: from low to high, closer at the ends (Chebyshev)."""
    return (low + high) / 2 - (high - low) / 2 * np.cos(np.pi * (np.arange(count) + 0.5) / count) / math.cos(
        np.pi / 2 / count
    )


def rigid(modulus):
    """How nearly rigid a specimen of E / E_inner is, 0 to 1."""
    return modulus / (modulus + HALF)


SHARES, LN_RATIOS = nodes(rigid(0.85), rigid(24.0), 4), nodes(math.log(2.0), math.log(8.0), 3)
MODULI, RATIOS = HALF * SHARES / (1 - SHARES), np.exp(LN_RATIOS)
"""E / E_inner and E_outer / E_inner of the truth's paths."""


FEW = [0, 2, 3], [0, 2]
"""Those of them at which the small change by friction between none and stick is told."""


@dataclass(frozen=True, eq=False)
class Truth:
    """Presses of the independent code at one friction; values (loads, moduli, ratios, 1 + q g): indentation over
    (F/E_inner)^(2/3), and what gauges feel over F/E_inner."""

    values: np.ndarray

    @classmethod
    @lru_cache
    def of(cls, name: str, friction: Friction, size_mm: float | None) -> "Truth":
        """Those of a geometry, made once and kept in the cache."""
        slips = 0 < friction_coefficient(friction) < math.inf
        at = FEW if slips else (slice(None), slice(None))
        rows = [
            [along(name, one, other, friction, size_mm) for other in RATIOS[at[1]].tolist()]
            for one in MODULI[at[0]].tolist()
        ]
        values = np.moveaxis(np.array(rows), 2, 0)
        if not slips:
            return cls(values)
        free = cls.of(name, 0.0, size_mm).values
        changed = values - free[:, at[0]][:, :, at[1]]
        changed = BarycentricInterpolator(SHARES[at[0]], changed, axis=1)(SHARES)
        return cls(free + BarycentricInterpolator(LN_RATIOS[at[1]], changed, axis=2)(LN_RATIOS))

    def felt(self, force: np.ndarray, modulus: np.ndarray, outer: float, inner: float) -> tuple[np.ndarray, np.ndarray]:
        """What gauges feel (n, q, g) and indentations (n,) in mm of presses by forces (n,) on moduli (n,)."""
        x, found = force / inner, []
        by_ratio = BarycentricInterpolator(LN_RATIOS, self.values, axis=2)(math.log(outer / inner))
        for one, share in zip(x, rigid(modulus / inner), strict=True):
            found.append(
                CubicSpline(np.log(LOADS), BarycentricInterpolator(SHARES, by_ratio, axis=1)(share))(np.log(one))
            )
        table = np.array(found)
        return (table[:, 1:] * x[:, None]).reshape(len(x), 2, -1), table[:, 0] * x ** (2 / 3)


def along(name: str, modulus: float, ratio: float, friction: Friction, size_mm: float | None) -> np.ndarray:
    """(loads, 1 + q g) of a path, moduli over the inner one; made once and kept in the cache."""
    if name == DEFAULT:
        smooth = response(family_of(Finger.default(), size_mm=size_mm), Block(1.0, THICKNESS_MM), friction=friction)
        felt = smooth.felt(LOADS, np.full(len(LOADS), modulus), ratio, 1.0)
        return np.column_stack(
            [felt.indentation / LOADS ** (2 / 3), felt.values.reshape(len(LOADS), -1) / LOADS[:, None]]
        )
    geometry, coefficient = GEOMETRIES[name], friction_coefficient(friction)

    def make() -> dict[str, np.ndarray]:
        """The path, with finer steps where a coarse one does not converge."""
        bodies = Bodies(geometry.shape, [Rubber(ratio), Rubber(1.0), Rubber(modulus, SPECIMEN_NU)])
        began = perf_counter()
        for first, growth in STEPS:
            try:
                path = presses_of.press_path(
                    bodies, geometry.finger.gauges, 1.01 * LOADS[-1], coefficient, first=first, growth=growth
                )
                break
            except SolverError as error:
                print(f"{first:g}, {growth:g}: {error}", file=sys.stderr, flush=True)
        depth, values = path.at(LOADS)
        print(
            f"{name}, {friction}, {modulus:.3g}, {ratio:.3g}: {perf_counter() - began:.0f} s",
            file=sys.stderr,
            flush=True,
        )
        return {"values": np.column_stack([depth / LOADS ** (2 / 3), values.reshape(len(LOADS), -1) / LOADS[:, None]])}

    strains = geometry.shape, geometry.finger.strain_sha256
    key = cache.key(
        presses_of.__name__, *strains, str(coefficient), modulus, ratio, LOADS, str(presses_of.PRESS_PARAMETERS)
    )
    return cache.fetch("truth", key, make)["values"]


@dataclass(frozen=True)
class Outcome:
    """One identification: rms error of S_d of unseen presses; error and half-width of each parameter's interval, by
    name, in the scale of the fit; errors of E over their sigma; what was freed; seconds; chi-square by freedom."""

    sd: float
    parameters: dict[str, tuple[float, float, bool]]
    E: np.ndarray
    freed: str
    seconds: float
    excess: float


def outcome(drawn: Drawn, log: PressLog, friction: Friction | None, seed: int, size_mm: float | None) -> Outcome:
    """Identify a drawn finger and compare it with what it is."""
    rng, began = np.random.default_rng(seed), perf_counter()
    found = identify(log, drawn.design, friction=friction, size_mm=size_mm)
    told, took = diagnose(found), perf_counter() - began
    force, modulus = (
        one.ravel() for one in np.meshgrid(gf_to_newton(np.geomspace(10.0, 100.0, 5)), np.geomspace(*TESTS_MPA, 5))
    )
    sd = drawn.readings(force, modulus)[0].std(axis=1)
    off = np.exp(ln_sd(found, force, modulus)[0]) / sd - 1
    parameters = {}
    for name in found.names:
        if name not in drawn.values:
            continue
        low, high = told.intervals[name]
        true, value = drawn.values[name], found[name][0]
        inside = low <= true <= high
        if PARAMETERS_BY_NAME[kind(name)].logarithmic:
            true, value, low, high = np.log([true, value, low, high])
        parameters[name] = float(value - true), float(high - low) / 2, bool(inside)
    fresh = np.exp(rng.uniform(np.log(gf_to_newton(10.0)), np.log(gf_to_newton(100.0)), SCENES))
    E = np.exp(rng.uniform(*np.log(TESTS_MPA), SCENES))
    readings = drawn.readings(fresh * (1 + FORCE_ERROR * rng.normal(size=SCENES)), E)[0] + drawn.of("zero_microstrain")
    zeros = np.array([found.values[f"zero_microstrain.{gauge.name}"] for gauge in drawn.design.gauges])
    read = (readings + NOISE * rng.normal(size=readings.shape) - zeros).std(axis=1)
    ln_told, by_force, sigma = ln_sd(found, fresh, E)
    noise = np.hypot(NOISE / math.sqrt(readings.shape[1]) / read, by_force * FORCE_ERROR)
    pulls = (np.log(read) - ln_told) / np.hypot(sigma, noise)
    excess = found.chi_square / max(found.freedom, 1e-9)
    return Outcome(float(np.sqrt(np.mean(off**2))), parameters, pulls, found.asked, took, excess)


def presses(count: int, design: Finger, size_mm: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Forces (N) and moduli (MPa) of 15 presses on three specimens, or of fewer that `suggest` names for the design."""
    if count == 15:
        force, modulus = np.meshgrid(np.geomspace(0.05, 0.98, 5), ON_MPA)
        return force.ravel(), modulus.ravel()
    told = suggest_presses(design, count, ON_MPA, size_mm=size_mm)
    return np.array(told.force_N), np.array(told.modulus_MPa)


def held(groups: list[list[bool]], seed: int = 0) -> str:
    """The share that is true of all, and 95 % of it over drawing the groups (fingers) again."""
    counts = np.array([(sum(one), len(one)) for one in groups], float)
    drawn = np.random.default_rng(seed).integers(len(groups), size=(BOOTSTRAPS, len(groups)))
    shares = counts[drawn, 0].sum(axis=1) / counts[drawn, 1].sum(axis=1)
    low, high = np.quantile(shares, (0.025, 0.975))
    return f"{100 * counts[:, 0].sum() / counts[:, 1].sum():.1f} % ({100 * low:.0f} to {100 * high:.0f})"


def report(title: str, found: list[Outcome]) -> None:
    """Print what identifications came to."""
    sd = 100 * np.array([one.sd for one in found])
    print(f"{title}: {len(found)} fingers; S_d of unseen presses, rms: median {np.median(sd):.2f} %, ", end="")
    print(f"9 of 10 {np.quantile(sd, 0.9):.1f} %; 95 % intervals hold ", end="")
    print(f"parameters {held([[one[2] for one in each.parameters.values()] for each in found])}, ", end="")
    print(f"E {held([(np.abs(each.E) < 1.96).tolist() for each in found])}; ", end="")
    print(f"a place freed in {sum(bool(one.freed) for one in found)}; ", end="")
    print(f"{np.median([one.seconds for one in found]):.1f} s each; ", end="")
    print(f"chi-square by freedom {np.median([one.excess for one in found]):.2f}")
    kinds: dict[str, list[tuple[float, float, bool]]] = {}
    for each in found:
        for name, one in each.parameters.items():
            kinds.setdefault(kind(name), []).append(one)
    for name, values in kinds.items():
        error, half, inside = np.array(values, float).T
        rms = math.sqrt(np.mean((error / half) ** 2))
        wide = np.median(half) / (1.96 * math.sqrt(np.mean(error**2)))
        print(
            f"    {name:18} {100 * inside.mean():5.1f} % inside, rms error {math.sqrt(np.mean(error**2)):.3g}, ", end=""
        )
        print(f"in half-widths {rms:.2f}; median half-width over 1.96 rms {wide:.2f}", flush=True)


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--geometry", nargs="*", default=["A"], choices=[*GEOMETRIES, DEFAULT])
    parser.add_argument("--size-mm", type=float, help="elements at the contact of the fit")
    parser.add_argument("--fingers", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--presses", nargs="*", type=int, default=[15, 5])
    parser.add_argument("--friction", nargs="*", default=["told", "open"], choices=["told", "open"])
    given = parser.parse_args()
    for name in given.geometry:
        design = Finger.default() if name == DEFAULT else GEOMETRIES[name].finger
        for count in given.presses:
            every: dict[str, list[Outcome]] = {}
            for number in range(given.fingers):
                rng = np.random.default_rng((given.seed, number))
                friction = FRICTIONS[number % len(FRICTIONS)]
                inner = design.inner.modulus * rng.uniform(0.9, 1.6)
                outer = inner * math.exp(rng.uniform(math.log(2.0), math.log(8.0)))
                drawn = Drawn.by(rng, design, Truth.of(name, friction, given.size_mm).felt, (outer, inner), GAINS)
                log = drawn.log(rng, *presses(count, design, given.size_mm))
                for known in given.friction:
                    one = outcome(drawn, log, friction if known == "told" else None, number, given.size_mm)
                    every.setdefault(known, []).append(one)
                    every.setdefault(f"{known}, {friction}", []).append(one)
                    line = {key: f"{value[0] / value[1]:+.2f}" for key, value in one.parameters.items()}
                    print(
                        f"{number} {friction} {known}: {100 * one.sd:.2f} % {one.excess:.2f} {one.seconds:.1f} s",
                        *(line, one.freed),
                        file=sys.stderr,
                        flush=True,
                    )
            for known, outcomes in every.items():
                report(f"{name}, {count} presses, friction {known}", outcomes)


if __name__ == "__main__":
    main()
