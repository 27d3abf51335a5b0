"""Presses of three fingers of one's own by default physics, against a code that shares nothing with papilla's.

`python benchmarks/own_fingers.py [--geometry A B C] [--moduli MPA ...] [--frictions MU ...] [--forces-gf F ...]`

Three domes of revolution, none of them the one that ships; bonded blocks of 10 mm, 5 to 100 gf, stuck, mu 0.1 and
without friction. The truth is `papilla.references.axisymmetric`: finger and neo-Hookean block at finite strain. The
first run of a geometry makes its tables of large strain (`papilla.fem.finite.strain_tables`). Printed are the largest
errors: of S_d and indentation, relative; of the gauges' strains over the largest strain of the press.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from papilla import Finger, fem
from papilla.core import units
from papilla.core.errors import ContactRangeError
from papilla.mesh import DEFAULT_SIZE_MM
from papilla.model.finger import Layer
from papilla.model.specimen import STICK_WORD, Block, Friction, friction_coefficient
from papilla.references.axisymmetric.bodies import Bodies, Rubber, Shape
from papilla.references.axisymmetric.presses import press_path
from papilla.verify.revolution import finger_of

FORCES_GF = (5.0, 10.0, 20.0, 50.0, 100.0)
FRICTIONS: tuple[Friction, ...] = (STICK_WORD, 0.1, 0.0)
SPECIMEN_NU = 0.495


@dataclass(frozen=True)
class Geometry:
    """A dome of revolution; gauge_size : of its gauges, in those of the default finger."""

    shape: Shape
    outer_MPa: float
    inner_MPa: float
    patch_radius: float
    gauge_size: float = 1.0

    @property
    def finger(self) -> Finger:
        """The design, with the default finger's gauges on its interface."""
        base, k = finger_of(self.shape), self.gauge_size
        sizes = {"length_mm": 2.4 * k, "width_mm": 2.0 * k, "backing_mm": (4.8 * k, 2.0 * k)}
        gauges = tuple(replace(gauge, **sizes) for gauge in base.gauges)
        layers = {"outer": Layer(self.outer_MPa), "inner": Layer(self.inner_MPa)}
        return replace(base, name="own", gauges=gauges, patch_radius=self.patch_radius, **layers)

    def bodies(self, modulus: float) -> Bodies:
        """Finger and block of the independent code."""
        rubbers = [Rubber(self.outer_MPa), Rubber(self.inner_MPa), Rubber(modulus, SPECIMEN_NU)]
        return Bodies(self.shape, rubbers)


GEOMETRIES = {
    "A": Geometry(Shape((24.0, 20.0), (21.0, 17.0), (10.0, 6.0)), 0.136, 0.034, 15.0),
    "B": Geometry(Shape((17.0, 23.0), (15.0, 21.0), (6.0, 9.0), near=0.32, width=32.0), 0.136, 0.034, 10.0),
    "C": Geometry(Shape((14.0, 12.0), (12.0, 10.0), (6.0, 3.5), near=0.38, width=26.0), 0.34, 0.085, 9.0, 0.5),
}
"""Skin of 3 mm on a round dome; a slim one with a skin of 2 mm; one of about half the size, 2.5 times as hard."""


def errors(
    geometry: Geometry, reduced: fem.ReducedFinger, modulus: float, friction: Friction, forces_gf: Sequence[float]
) -> np.ndarray:
    """(presses, 3) errors of S_d, the worst gauge and the indentation, as far as tables of large strain reach."""
    finger = geometry.finger
    loads = units.gf_to_newton(np.array(forces_gf))
    path = press_path(
        geometry.bodies(modulus), finger.gauges, 1.02 * float(loads.max()), friction_coefficient(friction)
    )
    rows = []
    for load in loads.tolist():
        depth, values = path.at(load)
        try:
            found = fem.press(reduced, Block(modulus, thickness=10.0), force=load, friction=friction)
        except ContactRangeError:
            break
        if not found.large_strain:
            break
        true, strain = values[0], found.values[0]
        sd = strain.std() / true.std() - 1
        rows.append((sd, np.abs(strain - true).max() / np.abs(true).max(), found.indentation / float(depth) - 1))
    return np.array(rows).reshape(-1, 3)


def friction_of(text: str) -> Friction:
    """A coefficient, or stick."""
    return STICK_WORD if text == STICK_WORD else float(text)


def main() -> None:
    """Press by papilla and by the independent code, and print the largest errors."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--geometry", nargs="*", default=list(GEOMETRIES), choices=list(GEOMETRIES))
    parser.add_argument("--moduli", nargs="*", type=float, default=[0.05, 0.2, 0.72])
    parser.add_argument("--size-mm", type=float, default=DEFAULT_SIZE_MM)
    parser.add_argument("--forces-gf", nargs="*", type=float, default=FORCES_GF)
    parser.add_argument("--frictions", nargs="*", type=friction_of, default=FRICTIONS)
    given = parser.parse_args()
    print("geometry, friction: MPa, presses with large strain of all, largest error of S_d, gauge, indentation in %")
    for name in given.geometry:
        geometry = GEOMETRIES[name]
        reduced = fem.prepare(geometry.finger, size_mm=given.size_mm)
        for friction in given.frictions:
            for modulus in given.moduli:
                off = errors(geometry, reduced, modulus, friction, given.forces_gf)
                worst = " ".join(f"{100 * value:5.2f}" for value in np.abs(off).max(axis=0, initial=0.0))
                print(f"{name}, {friction}: {modulus:g} MPa, {len(off)} of {len(given.forces_gf)}: {worst}", flush=True)


if __name__ == "__main__":
    main()
