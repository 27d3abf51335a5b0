"""Modulus recovered from noise-free presses: on the calibrated mesh, and on meshes that the calibration never saw.

Run with `python benchmarks/recovered_modulus.py`. The calibration takes its mesh scatter from three meshes; a fourth
and a fifth are pressed between the grid points of the sweep.
"""

import numpy as np

from papilla import calibrate, fem
from papilla.calibrate.job import CHECKED_FORCE_N, CHECKED_MODULUS_MPA
from papilla.finger import Finger
from papilla.specimen import Block

PRESSES = 400
SHOWN_MPA = (0.05, 0.089, 0.2, 0.51, 0.72)


def main() -> None:
    """Calibrate, press, invert, and print."""
    finger = Finger.default()
    meshes = [fem.prepare(finger, variant=variant) for variant in range(5)]
    sweeps = [calibrate.sweep(reduced) for reduced in meshes[:4]]
    calibration = calibrate.fit(sweeps[0], scatter=sweeps[1:])
    random = np.random.default_rng(20)
    modulus = np.exp(random.uniform(*np.log(CHECKED_MODULUS_MPA), PRESSES))
    force = random.uniform(*CHECKED_FORCE_N, PRESSES)
    for name, reduced in (("same mesh", meshes[0]), ("unseen mesh", meshes[4])):
        scenes = zip(modulus, force, strict=True)
        sd = [fem.press(reduced, Block(float(E), 10), force=float(f)).sd for E, f in scenes]
        answer = calibration.invert(np.array(sd), force)
        error = 100 * (np.asarray(answer.modulus_MPa) / modulus - 1)
        inside = np.mean((np.asarray(answer.lower_MPa) <= modulus) & (modulus <= np.asarray(answer.upper_MPa)))
        print(
            f"{name:>12}: error of E max {np.nanmax(np.abs(error)):.2f} %, rms {np.sqrt(np.nanmean(error**2)):.2f} %; "
            f"{100 * inside:.1f} % inside the stated 95 % interval; {np.isnan(error).sum()} of {PRESSES} unanswered"
        )
    middle = float(np.sqrt(np.prod(CHECKED_FORCE_N)))
    scatter = calibration.surface.uncertainty.scatter_at(middle)
    print(f"at {middle:.2f} N, scatter of S_d {100 * scatter:.2f} %:")
    for E in SHOWN_MPA:
        _, _, slope = calibration.surface.point.evaluate(np.log(middle), np.log(E))
        print(f"  {E:5.3g} MPa: dlnS_d/dlnE {slope:.4f}, so {100 * scatter / slope:.1f} % in E")


if __name__ == "__main__":
    main()
