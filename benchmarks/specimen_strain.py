"""What large strain in the specimen changes, which papilla's presses leave out, by the axisymmetric reference.

`python benchmarks/specimen_strain.py [--draws N --seed S] [--out FILE]`

Pressed are drawn domes of `own_fingers` on bonded blocks of 1.5 to 15 E_inner, once with a neo-Hookean block and once
with one that stays linear; in both the finger is at finite strain and the pressure acts along the deformed surfaces.
Printed are, by ranges of the mean pressure over the block's modulus, the change of ln S_d (rms and worst, %), its rms
over that ratio, and the change of the gauges (rms over the largest reading of their press, %).
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
from papilla.mesh.body import narrowest_mm
from papilla.model.specimen import STICK_WORD, friction_coefficient
from papilla.references.axisymmetric.presses import press_path

BLOCK_MODULUS_RATIOS = (1.5, 15.0)
"""Range of E / E_inner of the blocks, drawn evenly on a logarithmic scale."""

PRESSURE_EDGES = (0.0, 0.02, 0.03, 0.045, 0.06, 0.08, 0.1, math.inf)


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
        area = math.pi * float(np.interp(load, full.force, full.radius)) ** 2
        gauges = (strain - before) / np.abs(before).max()
        rows.append(
            {
                "scene": asdict(scene),
                "stuck": bool(friction),
                "pressure": load / area / scene.block_MPa,
                "sd": math.log(strain.std() / before.std()),
                "gauge": float(np.sqrt((gauges**2).mean())),
            }
        )
    return rows


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
    pressure, sd, gauge, stuck = (np.array([row[key] for row in rows]) for key in ("pressure", "sd", "gauge", "stuck"))
    for friction, name in ((False, "without friction"), (True, "stuck")):
        for low, high in zip(PRESSURE_EDGES, PRESSURE_EDGES[1:], strict=False):
            here = (stuck == friction) & (pressure >= low) & (pressure < high)
            if here.any():
                print(
                    f"{name}, p/E {low:g} to {high:g}: {here.sum()} presses; S_d {100 * rms(sd[here]):.2f} rms, "
                    f"{100 * np.abs(sd[here]).max():.2f} worst; over p/E {rms(sd[here] / pressure[here]):.3f}; "
                    f"gauges {100 * rms(gauge[here]):.2f}"
                )


if __name__ == "__main__":
    main()
