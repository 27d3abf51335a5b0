"""What large strain in the specimen changes, which papilla's presses have as a term, by the axisymmetric reference.

`python benchmarks/specimen_strain.py [--draws N --seed S] [--out FILE]`

Pressed are drawn domes of `own_fingers` on bonded blocks of 1.5 to 15 E_inner, once with a neo-Hookean block and once
with one that stays linear; in both the finger is at finite strain and the pressure acts along the deformed surfaces.
Printed are, by ranges of the mean pressure over the block's modulus, the change of ln S_d (rms and worst, %), what
`papilla.fem.pressing.specimen_strain` leaves of it, that over the stated sigma, and the change of the gauges (rms over
the largest reading of their press, %). Last come the coefficients that these presses would give, and what remains of
presses of fingers that were left out of such a fit.
"""

import argparse
import json
import math
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from own_fingers import SCALED_FORCES, Scene, drawn

from papilla.core.errors import SolverError
from papilla.core.files import write_text
from papilla.core.units import PER_CENT
from papilla.fem.pressing.specimen_strain import specimen_change
from papilla.mesh.body import narrowest_mm
from papilla.model.specimen import STICK_WORD, friction_coefficient
from papilla.references.axisymmetric.presses import press_path

BLOCK_MODULUS_RATIOS = (1.5, 15.0)
"""Range of E / E_inner of the blocks, drawn evenly on a logarithmic scale."""

PRESSURE_EDGES = (0.0, 0.02, 0.03, 0.045, 0.06, 0.08, 0.1, math.inf)
KEYS_OF_FIT = ("hindered", "radius", "pressure", "sd")


def changes(scene: Scene, friction: float) -> list[dict]:
    """A row for each force: mean pressure over the block's modulus, and the changes by its large strain."""
    finger = scene.finger
    loads = np.array(SCALED_FORCES) * scene.inner_MPa * narrowest_mm(finger) ** 2
    full, linear = (
        press_path(scene.bodies(linear), finger.gauges, 1.02 * float(loads[-1]), friction) for linear in (False, True)
    )
    rows = []
    for load in loads.tolist():
        strain, before = (path.at(load)[1][0] for path in (full, linear))
        radius = float(np.interp(load, full.force, full.radius))
        pressure, skin_mm = load / (math.pi * radius**2) / scene.block_MPa, scene.outer[1] - scene.interface[1]
        change, error = specimen_change(pressure, scene.block_MPa, radius, (skin_mm, scene.outer_MPa), friction)
        gauges = (strain - before) / np.abs(before).max()
        sd = math.log(strain.std() / before.std())
        rows.append(
            {
                "scene": asdict(scene),
                "stuck": bool(friction),
                "pressure": pressure,
                "hindered": pressure * scene.outer_MPa / (scene.outer_MPa + scene.block_MPa),
                "radius": radius / skin_mm,
                "sd": sd,
                "left": sd - change,
                "sigma": error,
                "gauge": float(np.sqrt((gauges**2).mean())),
            }
        )
    return rows


def fitted(rows: list[dict]) -> str:
    """Coefficients of the term by the presses that stick, weighted by 1 / sqrt(p/E), and the change that remains of a
    finger that is left out."""
    hindered, radius, pressure, sd = (np.array([row[key] for row in rows]) for key in KEYS_OF_FIT)
    number = np.unique([row["scene"]["name"] for row in rows], return_inverse=True)[1]
    weight = 1 / np.sqrt(pressure)
    terms = weight[:, None] * np.column_stack([hindered, hindered * radius])
    left = np.zeros(len(rows))
    for finger in range(number.max() + 1):
        others = number != finger
        left[~others] = (weight * sd - terms @ np.linalg.lstsq(terms[others], (weight * sd)[others])[0])[~others]
    first, second = np.linalg.lstsq(terms, weight * sd)[0]
    near = pressure < PRESSURE_EDGES[-2] + 0.01
    left = (left / weight)[near]
    return (
        f"stuck, fitted to these: {first:.3f} {second:+.3f} a/skin; of fingers left out, p/E up to 0.11: "
        f"{PER_CENT * rms(sd[near]):.2f} % before, {PER_CENT * rms(left):.2f} after, {rms(left / hindered[near]):.3f} "
        "over the hindered strain"
    )


def rms(values: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt((values**2).mean()))


def main() -> None:
    """Press drawn scenes and print the changes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=7)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    rng, rows = np.random.default_rng(given.seed), []
    for scene in drawn(given.draws, given.seed):
        ratio = float(np.exp(rng.uniform(*np.log(BLOCK_MODULUS_RATIOS))))
        for friction in (0.0, friction_coefficient(STICK_WORD)):
            try:
                rows += changes(replace(scene, block_MPa=ratio * scene.inner_MPa), friction)
            except SolverError as error:
                print(f"scene {scene.name}, friction {friction:g}: {error}", flush=True)
        if given.out:
            write_text(given.out, json.dumps(rows))
    columns = ("pressure", "sd", "left", "sigma", "gauge", "stuck")
    pressure, sd, left, sigma, gauge, stuck = (np.array([row[key] for row in rows]) for key in columns)
    for friction, name in ((False, "without friction"), (True, "stuck")):
        for low, high in zip(PRESSURE_EDGES, PRESSURE_EDGES[1:], strict=False):
            here = (stuck == friction) & (pressure >= low) & (pressure < high)
            if here.any():
                print(
                    f"{name}, p/E {low:g} to {high:g}: {here.sum()} presses; S_d {PER_CENT * rms(sd[here]):.2f} rms, "
                    f"{PER_CENT * np.abs(sd[here]).max():.2f} worst; left {PER_CENT * rms(left[here]):.2f} and "
                    f"{PER_CENT * np.abs(left[here]).max():.2f}, {rms((left / sigma)[here]):.2f} sigma; gauges "
                    f"{PER_CENT * rms(gauge[here]):.2f}"
                )
    print(fitted([row for row in rows if row["stuck"]]))


if __name__ == "__main__":
    main()
