"""The sliding section beside presses in three dimensions: its length, what its gauges lack, and what a texture changes.

Run with `python benchmarks/section_against_presses.py` (two minutes the first time). Of each finger: the tie at some
forces without friction, and depth and S_d of the section as it was before it was tied (force over the line load at
y = 0). Of the default finger, smooth and linear: how gauges swing while a rigid sine grating, its grooves along y, lies
elsewhere below it, in three dimensions at twelve places, against the tied section's swing.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from scipy.interpolate import LinearNDInterpolator

from papilla import fem
from papilla.fem.sliding.coulomb import Laws, Rubbed, rub
from papilla.fem.sliding.felt_profile import FeltProfile
from papilla.fem.sliding.section import ReducedSection
from papilla.fem.sliding.tying import RIGID_FLAT, tie
from papilla.mesh import DEFAULT_SIZE_MM
from papilla.model.finger import Dome, Finger
from papilla.model.specimen import Grating, Specimen

FORCES_N = (0.1, 0.3, 0.6)
GRATINGS = ((4.0, 0.1), (4.0, 0.3), (6.0, 0.1), (6.0, 0.3), (9.0, 0.2), (12.0, 0.3))
"""Period and depth (mm): finer ones the elements of three dimensions do not see."""
PLACES = 12
BESIDE = (1e-6, 1e-6)
"""Where the finger is reduced: at the apex itself it takes what is symmetric about it alone."""


@dataclass(frozen=True, eq=False)
class Wavy(Specimen):
    """A rigid sine grating along y whose ridge lies `place` mm beside the apex."""

    grating: Grating
    place: float
    nu: float = RIGID_FLAT.nu

    def __post_init__(self):
        """A grating has checked itself."""

    def gap(self, points: np.ndarray) -> np.ndarray:
        """Height (k,) in mm over points (k, 2)."""
        return self.grating.recess(points[:, 0] - self.place)

    @property
    def curvature(self) -> None:
        """It is not Hertz's."""
        return None


def fingers() -> Iterator[Finger]:
    """The default, the published one, and a dome of revolution with the default's moduli."""
    yield Finger.default()
    yield Finger.published()
    dome = Dome((24.0, 24.0, 20.0), (21.0, 21.0, 17.0), (10.0, 10.0, 6.0))
    yield replace(Finger.default(), shape=dome, name="dome 24, 24, 20 / 21, 21, 17 / 10, 10, 6")


def landed(body: ReducedSection, rise: np.ndarray | float, **load: float) -> Rubbed:
    """The section without friction on a surface `rise` (n,) mm lower, by a load (N/mm) or a depth (mm)."""
    n = len(body.x)
    laws = Laws(body.compliance, body.z.max() - body.z + rise, np.zeros(n), 0.0, 0.0, np.zeros(2 * n), **load)
    return rub(laws, np.zeros(n, dtype=np.int64))


def line_load(reduced: fem.ReducedFinger, found: fem.Press) -> float:
    """What a press carries at y = 0, N/mm."""
    xy = np.concatenate([reduced.patch.xy * image for image in reduced.patch.images])
    pressure = np.tile(found.pressure, len(reduced.patch.images))
    along = np.linspace(xy[:, 0].min(), xy[:, 0].max(), 2001)
    _, once = np.unique(xy.round(9), axis=0, return_index=True)
    line = LinearNDInterpolator(xy[once], pressure[once], fill_value=0.0)(along, np.zeros_like(along))
    return float(np.trapezoid(line, along))


def tell_ties(finger: Finger, forces: tuple[float, ...], size_mm: float) -> None:
    """Print the tie of a finger at some forces."""
    body, reduced = fem.prepare_section(finger), fem.prepare(finger, size_mm=size_mm)
    print(f"{finger.name}:")
    for force in forces:
        tied = tie(finger, body, force=force, friction=0.0)
        rest, size = tied.press, np.abs(tied.press.reading).max()
        before = landed(body, 0.0, load=line_load(reduced, rest))
        depth, sd = before.depth / rest.indentation - 1, (body.reading_rows @ before.force).std() / rest.sd - 1
        print(
            f"  {force:g} N: length {tied.length_mm:.2f} mm; lacking {np.round(tied.lacking).tolist()} of "
            f"{np.round(rest.reading).tolist()} microstrain, {100 * np.abs(tied.lacking).max() / size:.0f} % of the "
            f"largest at most; by its line load alone {100 * depth:+.0f} % of depth, {100 * sd:+.0f} % of S_d",
            flush=True,
        )


def tell_swings(forces: tuple[float, ...], size_mm: float, gratings: int, count: int) -> None:
    """Print how gauges swing over gratings, in three dimensions and on the section."""
    finger = replace(Finger.default(), ridges=None)
    body, reduced = fem.prepare_section(finger), fem.prepare(finger, size_mm=size_mm, at=BESIDE)
    ratios = []
    for force in forces:
        flat = fem.press(reduced, RIGID_FLAT, force=force, fidelity="contact")
        load = float(landed(body, 0.0, depth=flat.indentation).force[len(body.x) :].sum())
        for period, depth in GRATINGS[:gratings]:
            grating = Grating(period / 2, period / 2, depth, form="sine")
            reach = (-2 * body.half_width, 2 * body.half_width)
            felt, places = FeltProfile.of(grating, body.hats, reach), np.arange(count) / count * period
            solid = [
                fem.press(reduced, Wavy(RIGID_FLAT.modulus, grating, place), force=force, fidelity="contact").reading
                for place in places
            ]
            plane = [body.reading_rows @ landed(body, felt.recess(body.x - place), load=load).force for place in places]
            true, found = np.std(solid, axis=0), np.std(plane, axis=0)
            ratios.append(found / true)
            print(
                f"  {force:g} N over {period:g} mm, {depth:g} mm deep: swing {true.round().tolist()}, of the section "
                f"{found.round().tolist()} microstrain rms",
                flush=True,
            )
    middle = len(finger.gauges) // 2
    pairs = zip(finger.gauges, np.median(ratios, axis=0), strict=True)
    told = ", ".join(f"{gauge.name} {ratio:.2f}" for gauge, ratio in pairs)
    own = np.array(ratios)[:, middle]
    print(
        f"swing of the section over that in three dimensions: median {told}; middle {own.min():.2f} to {own.max():.2f}"
    )


def main() -> None:
    """Tell all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--forces", type=float, nargs="+", default=FORCES_N, help="N")
    parser.add_argument("--size-mm", type=float, default=DEFAULT_SIZE_MM)
    parser.add_argument("--fingers", type=int, help="the first so many fingers alone")
    parser.add_argument("--gratings", type=int, default=len(GRATINGS), help="the first so many gratings alone")
    parser.add_argument("--places", type=int, default=PLACES, help="places of a grating")
    given = parser.parse_args()
    forces = tuple(given.forces)
    for finger in islice(fingers(), given.fingers):
        tell_ties(finger, forces, given.size_mm)
    print("default finger, smooth, linear, without friction:")
    tell_swings(forces, given.size_mm, given.gratings, given.places)


if __name__ == "__main__":
    main()
