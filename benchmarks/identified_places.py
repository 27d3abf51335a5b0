"""Simulated fingers whose row of gauges was glued beside its place, pressed at several places, on a tilted mount.

Run with `python benchmarks/identified_places.py`. Truths are contacts solved at each place on another mesh than the
fit's, of gauges meshed where they were glued; large strain as at the apex. Three fingers, each with many draws of
gains, zeros, and noise as in `identified_fingers.py`: do intervals hold what they say, and what does holding places at
0 cost?
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from papilla import fem
from papilla.calibrate.identification import PARAMETERS, identify
from papilla.calibrate.identification.parameters import MOVES, kind
from papilla.calibrate.identification.posing import family_of
from papilla.fem.pressing.off_apex import MoveLimits
from papilla.finger import Finger
from papilla.logs import PressLog
from papilla.specimen import STICK, Block

VARIANT = 1
NOISE, FORCE_ERROR, ZERO = 5.0, 0.01, 20.0
THICKNESS_MM, TOUCH_DOWN_MM, DEPTH_NOISE_MM = 10.0, 0.15, 0.02
PLACES = ((0.0, 0.0), (3.0, 0.0), (-2.5, 1.0), (0.0, -2.5))
FORCES, MODULI = (0.1, 0.3, 0.9), (0.089, 0.51)
FINGERS = (
    {"outer_modulus_MPa": 0.136, "inner_modulus_MPa": 0.034, "row_along_mm": 0.8, "tilt_y_deg": 0.0},
    {"outer_modulus_MPa": 0.2, "inner_modulus_MPa": 0.03, "row_along_mm": -0.5, "tilt_y_deg": 1.0},
    {"outer_modulus_MPa": 0.1, "inner_modulus_MPa": 0.05, "row_along_mm": 0.3, "tilt_y_deg": -1.0},
)
FREE = ("row_along_mm", "tilt_y_deg")


@dataclass
class Solved:
    """What gauges feel (n, q, g) of the presses of one finger, and how deep they go (n,)."""

    truth: dict[str, float]
    felt: np.ndarray
    depth: np.ndarray

    @classmethod
    def of(cls, truth: dict[str, float], size_mm: float) -> "Solved":
        """Contacts solved where each press touches the tilted finger."""
        design = Finger.default()
        inner, ratio = truth["inner_modulus_MPa"], truth["outer_modulus_MPa"] / truth["inner_modulus_MPa"]
        moved = [replace(gauge, moved_mm=(truth["row_along_mm"], 0.0)) for gauge in design.gauges]
        relatives = family_of(replace(design, gauges=tuple(moved)), size_mm=size_mm, variant=VARIANT)
        model, unit = relatives.model(ratio), relatives.finger.inner.modulus
        apex = relatives.at(truth["outer_modulus_MPa"], inner)
        rolled = -np.radians(truth["tilt_y_deg"]) * MoveLimits.of(relatives).rolling[0]
        felt, depth = [], []
        for x, y in PLACES:
            there = model.reduce((x + rolled, y))
            for force, modulus in _scenes():
                block = Block(modulus, THICKNESS_MM)
                whole, linear = (
                    fem.press(apex, block, force=force, friction=STICK, **one) for one in ({}, {"fidelity": "contact"})
                )
                # The family's members have the design's inner modulus, which all strains go with
                same = Block(modulus * unit / inner, THICKNESS_MM)
                beside = fem.press(there, same, force=force * unit / inner, friction=STICK, fidelity="contact")
                felt.append(whole.values + beside.values - linear.values)
                depth.append(whole.indentation + beside.indentation - linear.indentation)
        return cls(truth, np.array(felt), np.array(depth))

    def drawn(self, rng: np.random.Generator) -> tuple[PressLog, dict[str, float]]:
        """A log of the presses by gauges that are drawn, and all parameters."""
        names = [gauge.name for gauge in Finger.default().gauges]
        g, n = len(names), len(self.depth)
        gain = np.exp(rng.uniform(np.log(0.05), 0.0, g)) * rng.choice([-1, 1], g)
        lever, zero = gain * rng.uniform(-2, 1, g), rng.uniform(-ZERO, ZERO, g)
        clean = 1e6 * (gain * self.felt[:, 0] + lever * self.felt[:, 1])
        # An error of force moves what a press measures about as a power of 0.8 of the force
        off = 1 + 0.8 * FORCE_ERROR * rng.normal(size=(n, 1))
        force, modulus = np.array(list(_scenes()) * len(PLACES)).T
        x, y = np.repeat(PLACES, len(FORCES) * len(MODULI), axis=0).T
        readings = clean * off + zero + NOISE * rng.normal(size=clean.shape)
        deep = self.depth * off[:, 0] + TOUCH_DOWN_MM + DEPTH_NOISE_MM * rng.normal(size=n)
        truth = dict(self.truth)
        for key, values in (("gain", gain), ("lever_mm", lever), ("zero_microstrain", zero)):
            truth |= {f"{key}.{name}": float(value) for name, value in zip(names, values, strict=True)}
        return PressLog(force, modulus, readings, tuple(names), np.maximum(deep, 1e-3), x, y), truth


def _scenes() -> Iterator[tuple[float, float]]:
    yield from ((force, modulus) for modulus in MODULI for force in FORCES)


def spread(share: float, count: int) -> float:
    """Binomial standard error of a share, in percent."""
    return 100 * float(np.sqrt(share * (1 - share) / count))


def _rms(pulls: dict[str, list[float]]) -> str:
    return ", ".join(f"{name} {np.sqrt(np.mean(np.square(one))):.2f}" for name, one in pulls.items())


def main() -> None:
    """Shares of parameters inside their intervals, and errors of the moduli with places free and held."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=30, help="of gauges and noise, for each of three fingers")
    parser.add_argument("--size-mm", type=float, default=1.0, help="of elements at the contact")
    given = parser.parse_args()
    draws, size_mm = given.draws, given.size_mm
    design, held = Finger.default(), {name: 0.0 for name in MOVES}
    pulls: dict[str, list[float]] = {}
    errors: dict[str, list[float]] = {"places free": [], "places held at 0": []}
    for number, truth in enumerate(FINGERS):
        solved = Solved.of(truth, size_mm)
        for seed in range(draws):
            log, values = solved.drawn(np.random.default_rng(100 * number + seed))
            found = identify(log, design, free=FREE, size_mm=size_mm)
            for name in ("outer_modulus_MPa", "inner_modulus_MPa", *FREE):
                value, sigma = found[name]
                off = np.log(value / values[name]) if PARAMETERS[kind(name)].logarithmic else value - values[name]
                pulls.setdefault(name, []).append(off / sigma)
            still = identify(log, design, fix=held, size_mm=size_mm)
            for key, one in zip(errors, (found, still), strict=True):
                errors[key].append(one["inner_modulus_MPa"][0] / values["inner_modulus_MPa"] - 1)
        print(f"finger {number + 1} of {len(FINGERS)} done, rms pulls {_rms(pulls)}", flush=True)
    n = len(FINGERS) * draws
    print(f"{n} fingers, {len(PLACES) * len(FORCES) * len(MODULI)} presses each")
    for name, drawn in pulls.items():
        size = np.abs(drawn)
        shares = "; ".join(
            f"{100 * (size < half).mean():.0f} % in {level} % (+- {3 * spread(level / 100, n):.0f})"
            for half, level in ((0.994, 68), (1.96, 95))
        )
        print(f"{name:20} {shares}; rms pull {np.sqrt(np.mean(size**2)):.2f}")
    for key, off in errors.items():
        print(f"{key}: inner modulus {100 * np.sqrt(np.mean(np.square(off))):.1f} % rms off")


if __name__ == "__main__":
    main()
