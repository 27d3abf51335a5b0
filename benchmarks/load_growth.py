"""Presses at finite strain that stick, by the growth of the load between steps: S_d against time.

`python benchmarks/load_growth.py [--geometry A] [--growths 1.3 1.7 2.2] [--finest 1.06]`

Pressed is a dome of `own_fingers` on the mesh of its tables, by the five forces of a table on blocks of 0.8 and 10
E_inner. Printed are, for each growth, seconds of a processor over those of the finest, and the difference of S_d (%,
rms and worst).
"""

import argparse
from time import process_time

import numpy as np
from own_fingers import SCENES

from papilla.core.units import PER_CENT
from papilla.fem.finite.strain_tables import FEW_FORCES, RELATIVE_ELEMENT_SIZE, RELATIVE_TABLE_FORCES, PressedFinger
from papilla.mesh import build
from papilla.mesh.body import narrowest_mm, sharpest_mm
from papilla.model.specimen import STICK_WORD

MODULUS_RATIOS = (0.8, 10.0)


def main() -> None:
    """Press with each growth and print the differences."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--geometry", default="A", choices=[scene.name for scene in SCENES])
    parser.add_argument("--growths", nargs="*", type=float, default=[1.3, 1.7, 2.2])
    parser.add_argument("--finest", type=float, default=1.06)
    given = parser.parse_args()
    finger = next(scene.finger for scene in SCENES if scene.name == given.geometry)
    inner = finger.inner.modulus
    pressed = PressedFinger(finger, build(finger, RELATIVE_ELEMENT_SIZE * sharpest_mm(finger)))
    forces = [RELATIVE_TABLE_FORCES[k] * inner * narrowest_mm(finger) ** 2 for k in FEW_FORCES]
    moduli = [ratio * inner for ratio in MODULUS_RATIOS]
    finest: tuple[float, np.ndarray] | None = None
    for growth in (given.finest, *given.growths):
        began = process_time()
        sd = np.array([press.sd for press in pressed.presses(forces, moduli, STICK_WORD, growth=growth)])
        took = process_time() - began
        finest = finest or (took, sd)
        off = PER_CENT * (sd / finest[1] - 1)
        print(
            f"growth {growth:g}: {took / finest[0]:.2f} of the time; S_d {np.sqrt(np.mean(off**2)):.2f} rms, "
            f"{np.abs(off).max():.2f} worst",
            flush=True,
        )


if __name__ == "__main__":
    main()
