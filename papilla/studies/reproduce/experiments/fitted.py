"""The finger whose five parameters were fitted to what was published: how far it is off each printed figure."""

import numpy as np

from papilla import fem
from papilla.calibrate.job import cached_sweep
from papilla.calibration.published import SPECIMENS_MPA, published_sd
from papilla.finger import Finger
from papilla.specimen import STICK, HalfSpace
from papilla.studies.reproduce.claim import Claim, Experiment, Found, Series, below, near
from papilla.units import gf_to_newton, newton_to_gf

FORCES_GF = tuple(range(10, 101, 10))
RIGID_MPA = 1e4
PUBLISHED = "papilla calibrate --finger published"
FITTED = "fitted to this very figure: it says that the physics can follow it, not that the finger is known"

CLAIMS = (
    Claim("A38b", "2006 eq. (9)", "(9) over 10-100 gf, by the finger fitted to what was published", 0.0, below(4.0),
          "% rms, one scale factor", "rms", PUBLISHED,
          "{rms_30:.2f} % over 30-100 gf; five parameters inside literature ranges; {FITTED}"),
    Claim("A36c", "2006 fig. 11(a)", "0.72 MPa gives 4 % more S_d than 0.51 MPa at 100 gf, by the fitted finger",
          1.040, near(1.040, by=0.015), "ratio", "hard_ratio", PUBLISHED, "(9) is additive in E, contact is not"),
    Claim("A21c", "2006 III.B.2", "38.37 gf at 0.80 mm, by the fitted finger", 38.37, near(38.37, percent=5), "gf",
          "at_080", "papilla press --finger published", "touch told {early:.3f} mm early; {FITTED}"),
    Claim("A21d", "2006 III.B.2", "0.70 gf at 0.20 mm, by the fitted finger", 0.70, near(0.70, by=0.2), "gf",
          "at_020", "papilla press --finger published", "{FITTED}"),
    Claim("C16b", "2011 Okamoto 3.2.3", "About 0.6 N at 1 mm, by the fitted finger", 0.6, near(0.6, percent=5), "N",
          "at_100", "papilla press --finger published", "joins two sensors; {FITTED}"),
)  # fmt: skip


def run(tell) -> Found:
    """Presses of the published finger on the specimens of its bench."""
    finger = Finger.published()
    reduced = fem.prepare(finger)
    tell("presses")
    forces = tuple(gf_to_newton(float(force)) for force in FORCES_GF)
    table = cached_sweep(reduced, SPECIMENS_MPA, forces, finger.bench.specimen, STICK)
    order = np.lexsort((table.modulus_MPa, table.force_N))
    ours = table.sd_microstrain[order].reshape(len(forces), -1)
    theirs = published_sd(np.array(FORCES_GF, float)[:, None], np.array(SPECIMENS_MPA))
    early = finger.bench.touch_down
    values: dict = {"FITTED": FITTED, "early": early, "hard_ratio": ours[-1, 2] / ours[-1, 1]}
    for name, first in (("rms", 0), ("rms_30", 2)):
        own, printed = ours[first:], theirs[first:]
        scale = float((own * printed).sum() / (own**2).sum())
        values[name] = 100 * float(np.sqrt(np.mean((scale * own - printed) ** 2) / np.mean(printed**2)))
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


EXPERIMENT = Experiment(
    "fitted", "A finger inside literature ranges, fitted to the published regression and depths", CLAIMS, run, FITTED
)
