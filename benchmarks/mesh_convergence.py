"""S_d, indentation, area and peak pressure of the default finger against a mesh of half the element size.

Run with `python benchmarks/mesh_convergence.py`. The finer mesh takes a minute to make and reduce the first time; it is
kept in the cache. The five reference meshes differ by what is called mesh scatter.
"""

import numpy as np

from papilla import fem
from papilla.finger import Finger
from papilla.mesh import DEFAULT_SIZE_MM
from papilla.mesh.builder import VARIANTS
from papilla.specimen import THICKNESS_MM, Block
from papilla.units import gf_to_newton

FORCES_GF = (5, 10, 20, 50, 60, 100)
SPECIMEN = Block(0.51, THICKNESS_MM)
QUANTITIES = ("sd", "indentation", "contact_area", "peak_pressure")


def presses(size_mm: float, variant: int = 0, fidelity: str = "contact") -> np.ndarray:
    """(quantities, forces) of presses on one mesh."""
    reduced = fem.prepare(Finger.default(), size_mm=size_mm, variant=variant)
    found = [fem.press(reduced, SPECIMEN, force=gf_to_newton(gf), fidelity=fidelity) for gf in FORCES_GF]
    return np.array([[getattr(scene, name) for scene in found] for name in QUANTITIES])


def main() -> None:
    """Print the table."""
    fine = presses(DEFAULT_SIZE_MM / 2)
    every = np.array([presses(DEFAULT_SIZE_MM, variant) for variant in range(VARIANTS)])
    hertz = np.array([presses(DEFAULT_SIZE_MM, variant, "hertz") for variant in range(VARIANTS)])
    off, hertz_off = (100 * (found / fine - 1) for found in (every, hertz))
    print(f"block of 0.51 MPa, 10 mm; {DEFAULT_SIZE_MM} mm against {DEFAULT_SIZE_MM / 2} mm, percent")
    print(f"{'force (gf)':>28}" + "".join(f"{gf:>8}" for gf in FORCES_GF))
    for number, name in enumerate(QUANTITIES):
        print(f"{name + ', default mesh':>28}" + "".join(f"{value:8.2f}" for value in off[0, number]))
        for title, found in ((", worst of 5", off), (", hertz, worst", hertz_off)):
            worst = np.abs(found[:, number]).max(axis=0)
            print(f"{name + title:>28}" + "".join(f"{value:8.2f}" for value in worst))
    scatter = 100 * every[:, 0].std(axis=0, ddof=1) / every[:, 0].mean(axis=0)
    print(f"{'sd, scatter of 5 (1 sigma)':>28}" + "".join(f"{value:8.2f}" for value in scatter))


if __name__ == "__main__":
    main()
