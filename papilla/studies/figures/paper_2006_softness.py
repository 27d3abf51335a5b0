"""The 2006 paper, section IV: softness from the spread of five gauges."""

import numpy as np

from papilla import fem
from papilla.calibration.published import SPECIMENS_MPA, compare_with_published, published_sd
from papilla.finger import Finger
from papilla.specimen import Block
from papilla.studies.figures.picture import Curve, Panel, Picture, Shade
from papilla.studies.figures.registry import Figure
from papilla.studies.reproduce.experiments.softness import calibrated
from papilla.units import KPA_PER_MPA, PER_CENT, gf_to_newton
from papilla.view.contact_map import contact_profile

FORCE_GF, REACH_MM, PIXELS = 60.0, 10.0, 121
"""Figure 10: of both presses, and half of the width that is shown, in so many points."""
LEVELS_GF = (20.0, 40.0, 60.0, 80.0, 100.0)
"""Forces of figure 11 (b)."""


def contacts() -> Picture:
    """Contact with a hard and a soft specimen: the hard one is touched on less, and pushes harder.

    The default finger is pressed by 60 gf on blocks of 0.72 and 0.089 MPa, 10 mm thick, stuck to them. Left and middle:
    the pressure between them, with the edge of the contact. Right: the pressure along x. Print has a drawing without
    numbers.
    """
    reduced = fem.prepare(Finger.default())
    line = np.linspace(-REACH_MM, REACH_MM, PIXELS)
    grid = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    panels: list[Panel] = []
    curves, words = [], []
    kinds = {"hard": 0.72, "soft": 0.089}
    presses = {
        name: fem.press(reduced, Block(modulus, 10.0), force=gf_to_newton(FORCE_GF), friction="stick")
        for name, modulus in kinds.items()
    }
    top = KPA_PER_MPA * max(press.peak_pressure for press in presses.values())
    for name, press in presses.items():
        modulus = kinds[name]
        profile = contact_profile(reduced, press)
        assert profile is not None
        pressure = KPA_PER_MPA * profile(grid).reshape(PIXELS, PIXELS)
        shade = Shade(line, line, pressure, "kPa", over=pressure > 0, top=top)
        panels.append(Panel(f"({'ab'[len(panels)]}) {name}, {modulus:g} MPa", "x, mm", "y, mm", shade=shade, even=True))
        curves.append(Curve(f"{modulus:g} MPa", line, pressure[PIXELS // 2]))
        words.append(
            f"{press.contact_area:.0f} mm2, {KPA_PER_MPA * press.peak_pressure:.1f} kPa, S_d {press.sd:.0f} ({name})"
        )
    panels.append(Panel("pressure along x", "x, mm", "pressure, kPa", tuple(curves)))
    found = f"Area, greatest pressure and spread of the gauges in microstrain: {'; '.join(words)}."
    return Picture(tuple(panels), columns=3, found=found)


def spread() -> Picture:
    """The spread of the gauges against force and modulus, beside equation (9).

    The calibration of the default finger (presses by finite elements with large strain, stuck) predicts S_d at 10 to
    100 gf. Points: equation (9) as printed, times one factor that fits all of them best, for the unit of S_d is not
    printed and its data are not either. (a) over the force, (b) over the modulus.
    """
    calibration = calibrated(fem.prepare(Finger.default()))
    force = np.linspace(10, 100, 46)
    ours, theirs, scale = compare_with_published(calibration, np.arange(10, 101, 10))
    off = float(np.sqrt(np.mean((scale * ours - theirs) ** 2) / np.mean(theirs**2)))
    specimens = np.array(SPECIMENS_MPA)
    over_force, over_modulus = [], []
    for color, modulus in enumerate(SPECIMENS_MPA):
        sd = calibration.predict(gf_to_newton(force), modulus)
        printed = published_sd(force[::5], modulus) / scale
        over_force += [
            Curve(f"{modulus:g} MPa", force, np.asarray(sd), color=color),
            Curve(f"(9), {modulus:g} MPa", force[::5], printed, "points", origin="printed", color=color),
        ]
    moduli = np.geomspace(0.06, 1.0, 40)
    for color, level in enumerate(LEVELS_GF):
        sd = calibration.predict(gf_to_newton(level), moduli)
        printed = published_sd(level, specimens) / scale
        over_modulus += [
            Curve(f"{level:g} gf", moduli, np.asarray(sd), color=color),
            Curve("", specimens, printed, "points", origin="printed", color=color),
        ]
    hard, soft = ours[-1, 2] / ours[-1, 1], ours[-1, 0] / ours[-1, 1]
    found = (
        f"One factor of {scale:.4g} joins (9) and the model within {PER_CENT * off:.1f} % rms. At 100 gf the hardest "
        f"specimen has {hard:.3f} and the softest {soft:.3f} of the middle one's S_d; (9) has "
        f"{theirs[-1, 2] / theirs[-1, 1]:.3f} and {theirs[-1, 0] / theirs[-1, 1]:.3f}."
    )
    panels = (
        Panel("(a)", "force, gf", "S_d, microstrain", tuple(over_force), x_range=(0, 105)),
        Panel("(b)", "modulus, MPa", "S_d, microstrain", tuple(over_modulus)),
    )
    return Picture(panels, columns=2, found=found)


FIGURES = (
    Figure("fig. 10", contacts, ("A34", "A33"), "softness"),
    Figure("fig. 11", spread, ("A36", "A36b", "A37", "A38"), "softness"),
)
