"""Presses of fingers that papilla was not made on, by default physics, against a code that shares nothing with it.

`python benchmarks/own_fingers.py [--draws N --seed S] [--geometry A B C] [--frictions MU ...] [--intervals] [--out F]`

The truth is `papilla.references.axisymmetric`: finger and neo-Hookean block at finite strain, the pressure along their
deformed surfaces. Pressed are three domes of revolution, or with `--draws` as many drawn ones: 0.3 to 2 times as high
as the default, height over half breadth 0.6 to 1.7, skin 8 to 25 % of the height, moduli 1 to 16 to 1, bonded blocks
0.5 to 2 heights thick of 1.5 E_inner to rigid, and F / (E_inner H^2) from 0.0036 to 0.072: 5 to 100 gf of the default.

Printed are errors over the presses of a path, in %: of S_d rms and worst, of the gauges' strains rms over the largest
strain of their press, and of the indentation rms; and the block's share: what its own large strain changes in S_d, by
the reference with a block that stays linear. `--intervals` also calibrates each finger, with its friction stated and
not, and prints how many of the reference's presses are answered, how many stated 95 % intervals of E contain the
block's modulus, and the intervals' median width. `--out` writes all presses as JSON.
"""

import argparse
import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from papilla import Finger, fem
from papilla.calibration import SoftnessStatus
from papilla.calibration.fitting.job import calibrate_finger
from papilla.core.errors import ContactRangeError, SolverError
from papilla.core.files import write_text
from papilla.core.units import PER_CENT, STRAIN_PER_MICROSTRAIN
from papilla.mesh import DEFAULT_SIZE_MM
from papilla.mesh.body import narrowest_mm
from papilla.model.finger import Bench, Layer
from papilla.model.specimen import STICK_WORD, Block, Friction, friction_coefficient
from papilla.references.axisymmetric.bodies import Bodies, Rubber, Shape
from papilla.references.axisymmetric.presses import press_path
from papilla.verify.revolution import finger_of

SCALED_FORCES = tuple(np.geomspace(0.0036, 0.072, 5).tolist())
"""F / (E_inner H^2)."""

FRICTIONS: tuple[Friction, ...] = (STICK_WORD, 0.0)
SPECIMEN_NU, RIGID_MPA = 0.495, 1e3
FRICTION_STATEMENTS = ("stated", "unstated")
"""What a calibration knows of the friction."""
DEFAULT_HEIGHT_MM = 20.0


@dataclass(frozen=True)
class Scene:
    """A dome of revolution, half axes (r, z) in mm, and the block that is pressed on it."""

    name: str
    outer: tuple[float, float]
    interface: tuple[float, float]
    bone: tuple[float, float]
    outer_MPa: float
    inner_MPa: float
    block_MPa: float
    block_mm: float

    @property
    def size(self) -> float:
        """Its smaller half axis over the default finger's."""
        return min(self.outer) / DEFAULT_HEIGHT_MM

    @property
    def finger(self) -> Finger:
        """The design, with the default finger's gauges on its interface, as large as the finger has them."""
        base, k = finger_of(Shape(self.outer, self.interface, self.bone)), self.size
        sizes = {"length_mm": 2.4 * k, "width_mm": 2.0 * k, "backing_mm": (4.8 * k, 2.0 * k)}
        gauges = tuple(replace(gauge, **sizes) for gauge in base.gauges)
        layers = {"outer": Layer(self.outer_MPa), "inner": Layer(self.inner_MPa)}
        return replace(base, name=self.name, gauges=gauges, patch_radius=None, bench=Bench(self.block_mm), **layers)

    @property
    def shape(self) -> Shape:
        """Finger and block of the independent code, and its cells."""
        # Fine cells as far as contact may come, and a block so wide that its sides are out of reach
        near = 2 / math.pi * math.asin(0.5 * min(self.outer) / self.outer[0])
        width = 1.9 * self.outer[0] + 1.5 * self.block_mm
        return Shape(self.outer, self.interface, self.bone, self.block_mm, width, (48, 6, 9, 10), near)

    def bodies(self, linear_block: bool = False) -> Bodies:
        """Finger and block of the independent code."""
        modulus = math.inf if self.block_MPa >= RIGID_MPA else self.block_MPa
        block = Rubber(modulus, SPECIMEN_NU, linear=linear_block)
        return Bodies(self.shape, [Rubber(self.outer_MPa), Rubber(self.inner_MPa), block])


SCENES = (
    Scene("A", (24.0, 20.0), (21.0, 17.0), (10.0, 6.0), 0.136, 0.034, 0.05, 10.0),
    Scene("B", (17.0, 23.0), (15.0, 21.0), (6.0, 9.0), 0.136, 0.034, 0.2, 10.0),
    Scene("C", (14.0, 12.0), (12.0, 10.0), (6.0, 3.5), 0.34, 0.085, 0.72, 10.0),
)
"""Skin of 3 mm on a round dome; a slim one with a skin of 2 mm; one of about half the size, 2.5 times as hard."""


def drawn(draws: int, seed: int) -> list[Scene]:
    """Scenes of the family, drawn evenly, lengths and moduli on a logarithmic scale."""
    rng, scenes = np.random.default_rng(seed), []
    for number in range(1, draws + 1):
        height = DEFAULT_HEIGHT_MM * float(np.exp(rng.uniform(*np.log([0.3, 2.0]))))
        breadth = height / float(np.exp(rng.uniform(*np.log([0.6, 1.7]))))
        skin, core = height * float(rng.uniform(0.08, 0.25)), float(rng.uniform(0.25, 0.5))
        inner = float(np.exp(rng.uniform(*np.log([0.02, 0.1]))))
        ratio, soft = (float(np.exp(rng.uniform(0, np.log(end)))) for end in (16.0, 100.0))
        within = (breadth - skin, height - skin)
        bone = (core * within[0], core * within[1])
        thickness = height * float(np.exp(rng.uniform(*np.log([0.5, 2.0]))))
        block = RIGID_MPA if rng.random() < 0.1 else 1.5 * inner * soft
        scenes.append(Scene(f"{number}", (breadth, height), within, bone, ratio * inner, inner, block, thickness))
    return scenes


def presses(scene: Scene, friction: Friction, size_mm: float) -> list[dict]:
    """A row for each press of a path: force (N), true and pressed S_d, errors, and the block's share."""
    finger = scene.finger
    loads = np.array(SCALED_FORCES) * scene.inner_MPa * narrowest_mm(finger) ** 2
    coefficient = friction_coefficient(friction)
    paths = [
        press_path(scene.bodies(linear), finger.gauges, 1.02 * float(loads[-1]), coefficient)
        for linear in (False, True)[: 1 if scene.block_MPa >= RIGID_MPA else 2]
    ]
    reduced, rows = fem.prepare(finger, size_mm=size_mm * scene.size), []
    for load in loads.tolist():
        (depth, values), *linear = (path.at(load) for path in paths)
        true = values[0]
        share = linear[0][1][0].std() / true.std() - 1 if linear else 0.0
        row = {"scene": scene.name, "friction": friction, "force": load, "block_share": float(share)}
        row["true_sd"] = float(true.std() / STRAIN_PER_MICROSTRAIN)
        try:
            press = fem.press(reduced, Block(scene.block_MPa, scene.block_mm), force=load, friction=friction)
        except ContactRangeError as error:
            rows.append({**row, "refused": str(error)})
            continue
        strain = press.values[0]
        gauges = (strain - true) / np.abs(true).max()
        rows.append(
            {
                **row,
                "sd": float(strain.std() / true.std() - 1),
                "gauge": float(np.sqrt((gauges**2).mean())),
                "depth": float(press.indentation / depth - 1),
                "indentation": press.indentation,
                "area": press.contact_area,
                "large_strain": press.large_strain,
                "status": press.status,
            }
        )
    return rows


def judge_intervals(scene: Scene, rows: Sequence[dict], size_mm: float) -> None:
    """Add to each press what a calibration makes of its true S_d, where its friction is stated and where it is not: the
    ends of the interval over the block's modulus, None where there is no answer."""
    stated = dict.fromkeys(row["friction"] for row in rows)
    calibrations = {
        friction: calibrate_finger(scene.finger, friction=friction, size_mm=size_mm * scene.size).calibration
        for friction in (None, *stated)
    }
    for row in rows:
        for name, friction in (("unstated", None), ("stated", row["friction"])):
            answer = calibrations[friction].invert(row["true_sd"], row["force"])
            ends = [float(end) / scene.block_MPa for end in (answer.lower_MPa, answer.upper_MPa)]
            row[name] = ends if answer.status is SoftnessStatus.OK else None
            row[f"{name}_doubt"] = calibrations[friction].doubt


def intervals_line(rows: Sequence[dict], name: str) -> str:
    """How the intervals of presses hold the modulus, with the friction "stated" or "unstated"."""
    asked = [row[name] for row in rows if name in row]
    ends = np.array([answer for answer in asked if answer is not None]).reshape(-1, 2)
    inside = int(((ends[:, 0] <= 1) & (ends[:, 1] >= 1)).sum())
    with np.errstate(divide="ignore"):
        # An interval without a lower end is infinitely wide
        width = PER_CENT * (float(np.median(np.sqrt(ends[:, 1] / ends[:, 0]))) - 1) if len(ends) else math.nan
    doubts = sum(bool(row[f"{name}_doubt"]) for row in rows if name in row)
    return (
        f"friction {name}: {len(ends)} of {len(asked)} answered, {inside} inside, half width {width:.0f} % in the "
        f"median, {doubts} of calibrations in doubt"
    )


def friction_of(text: str) -> Friction:
    """A coefficient, or stick."""
    return STICK_WORD if text == STICK_WORD else float(text)


def line_of(rows: Sequence[dict]) -> str:
    """The errors of some presses, in %."""
    answered = [row for row in rows if row.get("large_strain")]
    if not answered:
        return f"0 of {len(rows)} with large strain"
    sd, gauge, depth = (np.array([row[key] for row in answered]) for key in ("sd", "gauge", "depth"))
    share = max(abs(row["block_share"]) for row in answered)
    rms = [float(np.sqrt((column**2).mean())) for column in (sd, gauge, depth)]
    return (
        f"{len(answered)} of {len(rows)} with large strain; S_d {100 * rms[0]:.2f} rms, {100 * np.abs(sd).max():.2f} "
        f"worst; gauges {100 * rms[1]:.2f}; depth {100 * rms[2]:.2f}; block's share {100 * share:.2f}"
    )


def main() -> None:
    """Press by papilla and by the independent code, and print the errors."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--geometry", nargs="*", default=[scene.name for scene in SCENES])
    parser.add_argument("--size-mm", type=float, default=DEFAULT_SIZE_MM, help="of a finger 20 mm high")
    parser.add_argument("--frictions", nargs="*", type=friction_of, default=FRICTIONS)
    parser.add_argument("--intervals", action="store_true")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    scenes = drawn(given.draws, given.seed) if given.draws else [one for one in SCENES if one.name in given.geometry]
    everything: list[dict] = []
    for scene in scenes:
        print(scene, flush=True)
        pressed: list[dict] = []
        for friction in given.frictions:
            try:
                rows = presses(scene, friction, given.size_mm)
            except SolverError as error:
                print(f"  {friction}: {error}", flush=True)
                continue
            pressed += rows
            print(f"  {friction}: {line_of(rows)}", flush=True)
        if given.intervals and scene.block_MPa < RIGID_MPA:
            judge_intervals(scene, pressed, given.size_mm)
            print(*(f"  {intervals_line(pressed, name)}" for name in FRICTION_STATEMENTS), sep="\n", flush=True)
        everything += pressed
        if given.out:
            write_text(given.out, json.dumps({"scenes": [asdict(s) for s in scenes], "presses": everything}))
    small = [row for row in everything if abs(row["block_share"]) < 0.003]
    print(f"all: {line_of(everything)}\nblock's share below 0.3 %: {line_of(small)}")
    if given.intervals:
        print(*(intervals_line(everything, name) for name in FRICTION_STATEMENTS), sep="\n")


if __name__ == "__main__":
    main()
