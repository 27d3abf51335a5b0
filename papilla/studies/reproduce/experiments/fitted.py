"""The finger whose five parameters were fitted to what was published: how far it is off each printed figure."""

import numpy as np

from papilla import fem
from papilla.calibrate.job import cached_sweep
from papilla.calibration.published import SPECIMENS_MPA, published_sd
from papilla.finger import Finger
from papilla.specimen import STICK, HalfSpace
from papilla.studies.reproduce.claim import Found, Series
from papilla.units import gf_to_newton, newton_to_gf

FORCES_GF = tuple(range(10, 101, 10))
RIGID_MPA = 1e4
SIMULATED = "fitted to this very figure: it says that the physics can follow it, not that the finger is known"


SCENE = ("",)


def run(tell) -> Found:
    """A finger inside literature ranges, fitted to the published regression and depths.

    The published finger, five parameters of which were fitted, is pressed at 10-100 gf on its three specimens and to
    the printed depths on a rigid flat; S_d is compared with (9) up to one scale factor.
    """
    finger = Finger.published()
    reduced = fem.prepare(finger)
    tell("presses")
    forces = tuple(gf_to_newton(float(force)) for force in FORCES_GF)
    table = cached_sweep(reduced, SPECIMENS_MPA, forces, finger.bench.specimen, STICK)
    order = np.lexsort((table.modulus_MPa, table.force_N))
    ours = table.sd_microstrain[order].reshape(len(forces), -1)
    theirs = published_sd(np.array(FORCES_GF, float)[:, None], np.array(SPECIMENS_MPA))
    early = finger.bench.touch_down
    values: dict = {"early": early, "hard_ratio": ours[-1, 2] / ours[-1, 1]}
    for name, first in (("rms", 0), ("rms_30", 2)):
        own, printed = ours[first:], theirs[first:]
        scale = float((own * printed).sum() / (own**2).sum())
        values[name] = 100 * float(np.sqrt(np.mean((scale * own - printed) ** 2) / np.mean(printed**2)))
        # Each specimen by the scale of the other two: what the fit of one factor owes to it
        alone = [
            (np.delete(own, k, 1) * np.delete(printed, k, 1)).sum() / (np.delete(own, k, 1) ** 2).sum()
            for k in range(3)
        ]
        values[f"{name}_alone"] = 100 * float(np.sqrt(np.mean((own * alone - printed) ** 2) / np.mean(printed**2)))
    for depth in (0.20, 0.80, 1.00):
        force = fem.press(reduced, HalfSpace(RIGID_MPA), indentation=depth - early).force
        values[f"at_{round(100 * depth):03d}"] = float(newton_to_gf(force)) if depth < 1 else force
    scale = float((ours * theirs).sum() / (ours**2).sum())
    series = []
    for column, modulus in enumerate(SPECIMENS_MPA):
        series.append(Series(f"fitted finger, {modulus:g} MPa", FORCES_GF, scale * ours[:, column]))
        series.append(Series(f"(9), {modulus:g} MPa", FORCES_GF, theirs[:, column], "points"))
    title = "The finger fitted to (9): a spread between specimens that grows with force, where (9)'s is the same"
    return Found(values, title, "force, gf", "S_d as printed", tuple(series))
