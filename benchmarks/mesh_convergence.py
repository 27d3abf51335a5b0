"""S_d, indentation, area and peak pressure of a finger against a mesh of half the element size.

Run with `python benchmarks/mesh_convergence.py [--finger DESIGN.toml]`, the default finger unless told. The finer
mesh takes a minute to make and reduce the first time; it is kept in the cache. The five reference meshes
differ by what is called mesh scatter.
"""

import numpy as np
import typer

from papilla import fem
from papilla.cli.speed.measure import COMPARED_QUANTITIES, SWEEP_SPECIMEN, answers
from papilla.core.errors import ContactRangeError
from papilla.mesh import DEFAULT_SIZE_MM
from papilla.mesh.builder import SHIPPED_VARIANTS
from papilla.model.finger import Finger

FORCES_GF = (5, 10, 20, 50, 60, 100)
NAMES = (*COMPARED_QUANTITIES, "peak_pressure")


def presses(finger: Finger, size_mm: float, forces_gf, variant: int = 0, fidelity: str = "contact") -> np.ndarray:
    """(quantities, forces) of presses on one mesh; NaN where it is too coarse for the fidelity."""
    reduced = fem.prepare(finger, size_mm=size_mm, variant=variant)
    try:
        return answers(
            lambda force: fem.press(reduced, SWEEP_SPECIMEN, force=force, fidelity=fidelity), forces_gf, NAMES
        )
    except ContactRangeError:
        return np.full((len(NAMES), len(forces_gf)), np.nan)


def main(
    finger: str = "default",
    size_mm: float = DEFAULT_SIZE_MM,
    meshes: int = SHIPPED_VARIANTS,
    forces_gf: list[float] | None = None,
) -> None:
    """Print the table of a finger: a design file (TOML), or one that ships."""
    forces = tuple(forces_gf or FORCES_GF)
    design = Finger.load(finger)
    fine = presses(design, size_mm / 2, forces)
    contact, hertz = (
        np.array([presses(design, size_mm, forces, variant, fidelity) for variant in range(meshes)])
        for fidelity in ("contact", "hertz")
    )
    print(f"{design.name}, block of 0.51 MPa, 10 mm; {size_mm} mm against {size_mm / 2} mm, percent")
    lines = {"force (gf)": forces}
    for row, name in enumerate(NAMES):
        lines[f"{name}, default mesh"] = 100 * (contact[0, row] / fine[row] - 1)
        lines[f"{name}, worst of {meshes}"] = 100 * np.abs(contact[:, row] / fine[row] - 1).max(axis=0)
        lines[f"{name}, hertz, worst"] = 100 * np.abs(hertz[:, row] / fine[row] - 1).max(axis=0)
    lines[f"sd, scatter of {meshes} (1 sigma)"] = 100 * contact[:, 0].std(axis=0, ddof=1) / contact[:, 0].mean(axis=0)
    for name, values in lines.items():
        print(f"{name:>28}" + "".join(f"{value:8.2f}" for value in values))


if __name__ == "__main__":
    typer.run(main)
