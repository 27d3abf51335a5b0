"""By what factor presses that were suggested beat as many evenly spaced ones, for a finger of which nothing is known.

Run with `python benchmarks/suggested_presses.py`. Fingers are drawn from the priors' ranges (moduli off by up to a
factor of two, gains 0.02 to 1, levers over gains -2 to 1 mm, zeros of 20 microstrain), pressed with 1 % error in force
and 5 microstrain a gauge, all stuck, and identified with that friction stated; the finger found is asked for S_d over
20-100 gf x 0.05-0.72 MPa. Evenly spaced: forces from 5 to 100 gf, on the specimens in turn.
"""

from dataclasses import replace

import numpy as np
import typer

from papilla.calibration.fitting.sweep import CHECKED_FORCE_N, CHECKED_MODULUS_MPA
from papilla.fem.pressing.response import response
from papilla.fem.reduction.family import family
from papilla.identification import identify
from papilla.identification.suggest import SUGGESTED_FORCES_N, suggest_presses
from papilla.logs import PressLog
from papilla.model.finger import Bench, Finger
from papilla.model.specimen import STICK_WORD, THICKNESS_MM, Block

MODULI = (0.089, 0.51, 0.72)
FORCE_ERROR, NOISE = 0.01, 5.0
LEAST_SLOPE = 0.02
"""As in `papilla.identification.suggest`: E is told no better than this slope of ln S_d lets it."""


def drawn(random, design):
    """Moduli (outer, inner), gains, levers and zeros of a finger."""
    inner = design.inner.modulus * 2 ** random.uniform(-1, 1)
    ratio = design.outer.modulus / design.inner.modulus * 2 ** random.uniform(-1, 1)
    gains = np.exp(random.uniform(np.log(0.02), 0, 5))
    return (ratio * inner, inner), gains, gains * random.uniform(-2, 1, 5), random.normal(0, 20, 5)


def readings(told, moduli, gains, levers, zeros, force, modulus):
    """(n, 5) in microstrain, without noise."""
    felt = told.felt(force, modulus, *moduli).values
    return 1e6 * (gains * felt[:, 0] + levers * felt[:, 1]) + zeros


def missed(told, finger, found, force, modulus):
    """Relative errors (m,) of S_d, and of E as it is told from S_d."""
    moduli, gains, levers, _ = finger
    true = readings(told, moduli, gains, levers, 0.0, force, modulus).std(axis=1)
    other = found.finger
    layers = other.outer.modulus, other.inner.modulus
    seen = ([one.membrane_gain for one in other.gauges], [one.lever_mm for one in other.gauges])
    zeros = finger[3] - [found.values[f"zero_microstrain.{one.name}"] for one in other.gauges]
    step = 1e-3
    read = [readings(told, layers, *map(np.array, seen), -zeros, force, modulus * (1 + k * step)) for k in (0, 1)]
    slope = np.log(read[1].std(axis=1) / read[0].std(axis=1)) / step
    off = np.log(read[0].std(axis=1) / true)
    return off, off / np.maximum(np.abs(slope), LEAST_SLOPE)


def main(fingers: int = 100, presses: int = 5, size: float = 1.0) -> None:
    """Draw, press, identify on a mesh of elements of `size` (mm), and print."""
    design, random = replace(Finger.default(), bench=Bench(friction=STICK_WORD)), np.random.default_rng(7)
    told = response(family(design, size_mm=size), Block(1.0, THICKNESS_MM))
    best = suggest_presses(design, presses, MODULI, size_mm=size)
    print(
        "suggested: "
        + ", ".join(f"{f:.3f} N on {E:g} MPa" for f, E in zip(best.force_N, best.modulus_MPa, strict=True))
    )
    even = np.linspace(SUGGESTED_FORCES_N[0], SUGGESTED_FORCES_N[-1], presses), np.resize(MODULI, presses)
    designs = {"suggested": (np.array(best.force_N), np.array(best.modulus_MPa)), "evenly spaced": even}
    places = np.meshgrid(np.geomspace(*CHECKED_FORCE_N, 6), np.geomspace(*CHECKED_MODULUS_MPA, 6))
    domain = [axis.ravel() for axis in places]
    errors = {name: [] for name in designs}
    for _ in range(fingers):
        finger = drawn(random, design)
        slips, noise = random.normal(0, FORCE_ERROR, presses), random.normal(0, NOISE, (presses, 5))
        for name, (force, modulus) in designs.items():
            read = readings(told, *finger, force * (1 + slips), modulus) + noise
            log = PressLog(force, modulus, read, tuple(gauge.name for gauge in design.gauges))
            found = identify(log, design, size_mm=size)
            errors[name].append([np.sqrt(np.mean(one**2)) for one in missed(told, finger, found, *domain)])
    table = {name: np.median(rows, axis=0) for name, rows in errors.items()}
    for name, (sd, modulus) in table.items():
        print(f"{presses} {name}: {100 * sd:.2f} % of S_d, {100 * modulus:.0f} % of E (rms, median finger)")
    ratio = table["evenly spaced"] / table["suggested"]
    print(f"suggested presses are better by {ratio[0]:.2f} in S_d, {ratio[1]:.2f} in E")


if __name__ == "__main__":
    typer.run(main)
