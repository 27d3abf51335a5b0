"""Fingers of one's own, identified from presses that papilla did not make: parameters, S_d, E and what is doubted.

`python benchmarks/own_identification.py [--geometry human A slim] [--rings 3] [--draws 11] [--seed 1]`

Truths are paths of `papilla.references.axisymmetric` (finger and block at finite strain). For each geometry `rings`
pairs of a ratio of the moduli (2 to 8) and a friction (stick, none and 0.1) are drawn. A path over all forces
is made at each of a few E / E_inner. With all moduli scaled it is the same: these paths are presses of every finger of
that ratio, but for a polynomial in E / E_inner. `draws` fingers of each pair have an inner modulus of 0.9 to 1.6 of the
design's, gains 0.02 to 0.2 of either sign, levers -2 to 1 mm of the gain, zeros up to 20 microstrain. Noise is 5
microstrain, 1 % of force, 0.02 mm of depth. Forces and moduli are those of the default finger, scaled by E_inner and
height. Each finger is identified with its friction stated and not. E is told from S_d of fresh presses.
`--geometry default` is the finger that ships, whose truth is the model itself: what noise alone does.
"""

import argparse
import json
import math
import sys
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from time import perf_counter

import numpy as np
from identified_fingers import FORCE_ERROR, NOISE, THICKNESS_MM, Drawn, chosen, ln_sd
from own_fingers import DEFAULT_HEIGHT_MM, SCENES, SPECIMEN_NU, Scene, drawn
from scipy.interpolate import BarycentricInterpolator, CubicSpline

from papilla.core import cache
from papilla.core.errors import SolverError
from papilla.core.files import write_text
from papilla.core.units import gf_to_newton
from papilla.fem.pressing.response import response
from papilla.identification import PARAMETERS_BY_NAME, diagnose, identify
from papilla.identification.parameters import kind
from papilla.identification.posing import family_of
from papilla.identification.suggest import suggest_presses
from papilla.logs import PressLog
from papilla.mesh.body import narrowest_mm
from papilla.model.finger import Finger
from papilla.model.specimen import STICK_WORD, Block, Friction, friction_coefficient
from papilla.references.axisymmetric import presses as presses_of
from papilla.references.axisymmetric.bodies import Bodies, Rubber

FRICTIONS: tuple[Friction, ...] = (STICK_WORD, 0.0, 0.1)
GAINS = (0.02, 0.2)
RATIO_ENDS, INNER_FACTORS = (2.0, 8.0), (0.9, 1.6)
DEFAULT, DEFAULT_INNER_MPA = "default", 0.034

HUMAN = Scene("human", (8.0, 7.0), (7.0, 6.0), (3.0, 2.0), 0.136, 0.034, 0.2, 4.0)
"""A dome as large as a fingertip, with a skin of 1 mm and a block of 4 mm."""

SLIM = replace(drawn(1, 7)[0], name="slim")
"""The first scene that the seed 7 draws: half breadth 12.9, height 19.6, skin 4.2 mm, a block of 31 mm."""

GEOMETRIES = {scene.name: scene for scene in (*SCENES, HUMAN, SLIM)}

ON_MPA = (0.089, 0.51, 0.72)
"""Moduli of the specimens that are pressed, on a finger of the default's inner modulus."""
TESTS_MPA, SCENES_OF_E = (0.05, 0.72), 6
"""Moduli of unseen presses, 10 to 100 gf of the default finger, and how many of a finger tell E."""
BOOTSTRAPS = 2000
SUGGESTED_AMONG = 12

GROWTHS = (1.3, 1.2, 1.1)
"""Ratios of an indentation of a path to the one before: the first that converges. S_d differs by 0.1 % at most."""

LOADS = np.geomspace(0.002, 0.086, 28)
"""F / (E_inner H^2) at which the truth is kept."""

HALF_RIGID = 4.0
"""E / E_inner at which a specimen counts as half rigid: what gauges feel is nearly linear in e / (e + this)."""


def rigid(modulus):
    """How nearly rigid a specimen of E / E_inner is, 0 to 1."""
    return modulus / (modulus + HALF_RIGID)


def nodes(low: float, high: float, count: int) -> np.ndarray:
    """Where a polynomial goes through: from low to high, closer at the ends (Chebyshev)."""
    return (low + high) / 2 - (high - low) / 2 * np.cos(np.pi * (np.arange(count) + 0.5) / count) / math.cos(
        np.pi / 2 / count
    )


SHARES = nodes(rigid(0.9), rigid(24.0), 5)
MODULI = HALF_RIGID * SHARES / (1 - SHARES)
"""E / E_inner of the truth's paths."""


def design_of(name: str) -> Finger:
    """The design of a geometry."""
    return Finger.default() if name == DEFAULT else GEOMETRIES[name].finger


@dataclass(frozen=True)
class Bench:
    """What scales with a design: force and modulus over those of the default finger."""

    force: float
    modulus: float

    @classmethod
    def of(cls, design: Finger) -> "Bench":
        """That of a design."""
        modulus = design.inner.modulus / DEFAULT_INNER_MPA
        return cls(modulus * (narrowest_mm(design) / DEFAULT_HEIGHT_MM) ** 2, modulus)

    def unseen(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest force (N) and modulus (MPa) of unseen presses."""
        return self.force * np.array([gf_to_newton(10.0), gf_to_newton(100.0)]), self.modulus * np.array(TESTS_MPA)


@dataclass(frozen=True, eq=False)
class Truth:
    """Presses of the independent code at one friction and ratio of the moduli. values (moduli, loads, 1 + q g):
    indentation over (F/E_inner)^(2/3), and what gauges feel over F/E_inner. loads : F / E_inner in mm2."""

    values: np.ndarray
    loads: np.ndarray

    @classmethod
    @lru_cache
    def of(cls, name: str, friction: Friction, ratio: float, size_mm: float | None) -> "Truth":
        """Those of a geometry, made once and kept in the cache."""
        loads = LOADS * narrowest_mm(design_of(name)) ** 2
        return cls(np.array([along(name, one, ratio, friction, loads, size_mm) for one in MODULI.tolist()]), loads)

    def felt(self, force: np.ndarray, modulus: np.ndarray, outer: float, inner: float) -> tuple[np.ndarray, np.ndarray]:
        """What gauges feel (n, q, g) and indentations (n,) in mm of presses by forces (n,) on moduli (n,); the ratio of
        outer and inner modulus is the truth's."""
        x = force / inner
        if (x < self.loads[0]).any() or (x > self.loads[-1]).any():
            raise ValueError(f"F / E_inner of {x.min():.3g} to {x.max():.3g} mm2 leaves the paths")
        at_shares = BarycentricInterpolator(SHARES, self.values, axis=0)(rigid(modulus / inner))
        table = np.array(
            [CubicSpline(np.log(self.loads), one)(np.log(load)) for one, load in zip(at_shares, x, strict=True)]
        )
        return (table[:, 1:] * x[:, None]).reshape(len(x), 2, -1), table[:, 0] * x ** (2 / 3)


def along(
    name: str, modulus: float, ratio: float, friction: Friction, loads: np.ndarray, size_mm: float | None
) -> np.ndarray:
    """(loads, 1 + q g) of a path, moduli over the inner one; made once and kept in the cache."""
    if name == DEFAULT:
        smooth = response(family_of(Finger.default(), size_mm=size_mm), Block(1.0, THICKNESS_MM), friction=friction)
        felt = smooth.felt(loads, np.full(len(loads), modulus), ratio, 1.0)
        return np.column_stack(
            [felt.indentation / loads ** (2 / 3), felt.values.reshape(len(loads), -1) / loads[:, None]]
        )
    geometry, coefficient = GEOMETRIES[name], friction_coefficient(friction)

    def make() -> dict[str, np.ndarray]:
        """The path, with finer steps where a coarse one does not converge."""
        bodies = Bodies(geometry.shape, [Rubber(ratio), Rubber(1.0), Rubber(modulus, SPECIMEN_NU)])
        began = perf_counter()
        for growth in GROWTHS:
            try:
                path = presses_of.press_path(
                    bodies, geometry.finger.gauges, 1.01 * float(loads[-1]), coefficient, growth=growth
                )
                break
            except SolverError as error:
                print(f"growth {growth:g}: {error}", file=sys.stderr, flush=True)
        else:
            raise SolverError(f"{name}, friction {friction}: no path of the reference on {modulus:.3g} E_inner")
        depth, values = path.at(loads)
        took = f"{perf_counter() - began:.0f} s"
        print(f"{name}, {friction}, {modulus:.3g}, {ratio:.3g}: {took}", file=sys.stderr, flush=True)
        return {"values": np.column_stack([depth / loads ** (2 / 3), values.reshape(len(loads), -1) / loads[:, None]])}

    strains = geometry.shape, geometry.finger.strain_sha256
    key = cache.key(
        presses_of.__name__, *strains, str(coefficient), modulus, ratio, loads, str(presses_of.PRESS_PARAMETERS)
    )
    return cache.fetch("truth", key, make)["values"]


def ring_draws(seed: int, name: str) -> list[tuple[float, Friction]]:
    """Ratios of the moduli, one in each third of the range, each with a friction."""
    rng, count = np.random.default_rng((seed, len(name), *name.encode())), len(FRICTIONS)
    places = (rng.permutation(count) + rng.uniform(size=count)) / count
    ratios = np.exp(np.log(RATIO_ENDS[0]) + places * np.log(RATIO_ENDS[1] / RATIO_ENDS[0]))
    return [(round(ratio, 4), friction) for ratio, friction in zip(ratios.tolist(), FRICTIONS, strict=True)]


@dataclass(frozen=True)
class Outcome:
    """One identification: rms error of S_d of unseen presses; error, half-width and whether it is inside of each
    parameter's interval, by name, in the scale of the fit; errors of E over their sigma; whether it is doubtful, and
    its notes; seconds; chi-square by freedom; sigma of ln S_d of other presses as stated."""

    sd: float
    parameters: dict[str, tuple[float, float, bool]]
    E: list[float]
    doubtful: bool
    notes: tuple[str, ...]
    freed: bool
    seconds: float
    excess: float
    sd_sigma: float


def outcome(drawn: Drawn, log: PressLog, friction: Friction | None, seed: int, size_mm: float | None) -> Outcome:
    """Identify a drawn finger and compare it with what it is."""
    rng, began = np.random.default_rng(seed), perf_counter()
    found = identify(log, drawn.design, friction=friction, size_mm=size_mm)
    told, took = diagnose(found), perf_counter() - began
    forces, moduli = Bench.of(drawn.design).unseen()
    force, modulus = (one.ravel() for one in np.meshgrid(np.geomspace(*forces, 5), np.geomspace(*moduli, 5)))
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
            true, value, low, high = np.log([true, value, low, high]).tolist()
        parameters[name] = float(value - true), float(high - low) / 2, bool(inside)
    fresh = np.exp(rng.uniform(*np.log(forces), SCENES_OF_E))
    E = np.exp(rng.uniform(*np.log(moduli), SCENES_OF_E))
    pressed = fresh * (1 + FORCE_ERROR * rng.normal(size=SCENES_OF_E))
    readings = drawn.readings(pressed, E)[0] + drawn.of("zero_microstrain")
    zeros = np.array([found.values[f"zero_microstrain.{gauge.name}"] for gauge in drawn.design.gauges])
    read = (readings + NOISE * rng.normal(size=readings.shape) - zeros).std(axis=1)
    ln_told, by_force, sigma = ln_sd(found, fresh, E)
    noise = np.hypot(NOISE / math.sqrt(readings.shape[1]) / read, by_force * FORCE_ERROR)
    pulls = (np.log(read) - ln_told) / np.hypot(sigma, noise)
    excess, doubtful = found.chi_square / max(found.freedom, 1e-9), told.status.startswith("doubtful")
    return Outcome(
        float(np.sqrt(np.mean(off**2))),
        parameters,
        pulls.tolist(),
        doubtful,
        told.notes,
        bool(found.asked),
        took,
        excess,
        told.sd_sigma,
    )


PROTOCOLS = ("15", "5", "5 suggested", "3 light")


def presses(protocol: str, design: Finger, size_mm: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Forces (N) and moduli (MPa) of a protocol: 15 presses on three specimens, five on two of them, the five that
    `suggest` names, or three light ones on one specimen, which should be doubted."""
    bench = Bench.of(design)
    on = bench.modulus * np.array(ON_MPA)
    if protocol == PROTOCOLS[0]:
        force, modulus = np.meshgrid(bench.force * np.geomspace(0.05, 0.98, 5), on)
        return force.ravel(), modulus.ravel()
    if protocol == PROTOCOLS[1]:
        force, modulus = chosen(5)
        return bench.force * force, bench.modulus * modulus
    if protocol == PROTOCOLS[3]:
        return bench.force * np.array([0.05, 0.1, 0.2]), np.full(3, on[1])
    forces = bench.force * np.geomspace(0.05, 0.98, SUGGESTED_AMONG)
    told = suggest_presses(design, 5, on.tolist(), forces=forces.tolist(), size_mm=size_mm)
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
    sd, doubt = 100 * np.array([one.sd for one in found]), np.array([one.doubtful for one in found])
    medians = [f"{np.median(some):.2f}" if some.size else "-" for some in (sd, sd[doubt], sd[~doubt])]
    print(
        f"{title}: {len(found)} fingers; S_d of unseen presses, rms: of all {np.sqrt(np.mean(sd**2)):.2f} %, ", end=""
    )
    print(f"median {medians[0]} %, 9 of 10 {np.quantile(sd, 0.9):.1f} %; 95 % intervals hold ", end="")
    print(f"parameters {held([[one[2] for one in each.parameters.values()] for each in found])}, ", end="")
    print(f"E {held([(np.abs(each.E) < 1.96).tolist() for each in found])}; ", end="")
    print(f"doubtful {doubt.sum()}, median with {medians[1]} and without {medians[2]} %; ", end="")
    print(f"a place freed in {sum(one.freed for one in found)}; ", end="")
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
    parser.add_argument("--geometry", nargs="*", default=["human", "A", "slim"], choices=[*GEOMETRIES, DEFAULT])
    parser.add_argument("--size-mm", type=float, help="elements at the contact of the fit")
    parser.add_argument(
        "--rings",
        type=int,
        default=3,
        choices=range(1, len(FRICTIONS) + 1),
        help="ratios of moduli, each at one friction",
    )
    parser.add_argument("--draws", type=int, default=11, help="fingers of each")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--presses", nargs="*", default=PROTOCOLS, choices=PROTOCOLS)
    parser.add_argument("--friction", nargs="*", default=["stated", "open"], choices=["stated", "open"])
    parser.add_argument("--out", type=Path, help="every outcome, as JSON")
    given = parser.parse_args()
    everything: dict[str, list[Outcome]] = {}
    for name in given.geometry:
        design = design_of(name)
        for protocol in given.presses:
            every: dict[str, list[Outcome]] = {}
            pressed = presses(protocol, design, given.size_mm)
            for number in range(given.rings * given.draws):
                draw, ring = divmod(number, given.rings)
                ratio, friction = ring_draws(given.seed, name)[ring]
                rng = np.random.default_rng((given.seed, ring, draw))
                inner = design.inner.modulus * rng.uniform(*INNER_FACTORS)
                felt = Truth.of(name, friction, ratio, given.size_mm).felt
                drawn = Drawn.by(rng, design, felt, (ratio * inner, inner), GAINS)
                log = drawn.log(rng, *pressed)
                for known in given.friction:
                    one = outcome(drawn, log, friction if known == "stated" else None, number, given.size_mm)
                    every.setdefault(known, []).append(one)
                    line = {key: f"{value[0] / value[1]:+.2f}" for key, value in one.parameters.items()}
                    print(
                        f"{number} {ratio:.2f} {friction} {known}: {100 * one.sd:.2f} % {one.excess:.2f}"
                        f" {one.seconds:.1f} s",
                        *(line, "\n   ".join(["", *one.notes]) if one.doubtful else ""),
                        file=sys.stderr,
                        flush=True,
                    )
            for known, outcomes in every.items():
                report(title := f"{name}, {protocol} presses, friction {known}", outcomes)
                everything[title] = outcomes
            if given.out:
                write_text(given.out, json.dumps({key: [asdict(one) for one in v] for key, v in everything.items()}))


if __name__ == "__main__":
    main()
