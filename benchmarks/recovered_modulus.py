"""How often the stated 95 % interval of E holds the truth, and how far E is off, on meshes the calibration never saw.

Run with `python benchmarks/recovered_modulus.py [--finger DESIGN.toml]`, the default finger unless told. Truths
are presses with large strain on two other meshes, with friction from none to stick, on blocks of 0.05 to 0.72 MPa,
by 20 to 100 gf; each is felt with 1 % error in force and 5 microstrain a gauge. In half of the scenes the specimen
sticks; in the others friction is one of `FRICTIONS`.
"""

import numpy as np
import typer

from papilla import fem
from papilla.calibration.fitting.sweep import CHECKED_FORCE_N, CHECKED_MODULUS_MPA
from papilla.identification.bench import calibrate
from papilla.model.finger import Finger
from papilla.model.specimen import STICK_WORD, Block

MESHES = (5, 6)
FRICTIONS = (0.0, 0.03, 0.06, 0.1, 0.15, 0.2, STICK_WORD)
BANDS = ((0.05, 0.1), (0.1, 0.3), (0.3, 0.72))
FORCE_ERROR, GAUGE_NOISE = 0.01, 5.0


def truths(meshes, frictions, moduli, forces):
    """(meshes, frictions, moduli, forces, gauges) readings in microstrain of presses with large strain."""
    return np.array(
        [
            [
                [[fem.press(mesh, Block(E, 10), force=f, friction=mu).reading for f in forces] for E in moduli]
                for mu in frictions
            ]
            for mesh in meshes
        ]
    )


def main(
    moduli: int = 12, forces: int = 5, draws: int = 20, finger: str = "default", meshes: list[int] | None = None,
    frictions: list[float] | None = None,
) -> None:  # fmt: skip
    """Calibrate a finger (a design file or one that ships), press, feel, invert, print; --frictions: beside stick."""
    rubbed: tuple[float | str, ...] = (*frictions, STICK_WORD) if frictions else FRICTIONS
    design, random = Finger.load(finger), np.random.default_rng(20)
    calibration = calibrate(design).calibration
    true_MPa, loads = np.geomspace(*CHECKED_MODULUS_MPA, moduli), np.geomspace(*CHECKED_FORCE_N, forces)
    readings = truths(
        [fem.prepare(design, variant=variant) for variant in meshes or MESHES],
        rubbed,
        true_MPa.tolist(),
        loads.tolist(),
    )
    felt = readings[..., None, :] + GAUGE_NOISE * random.normal(size=(*readings.shape[:-1], draws, 5))
    shape = felt.shape[:-1]
    E, force = np.broadcast_to(true_MPa[:, None, None], shape), np.broadcast_to(loads[:, None], shape)
    measured = np.clip(force * (1 + FORCE_ERROR * random.normal(size=shape)), *calibration.domain["force_N"])
    sd_sigma = GAUGE_NOISE / np.sqrt(5)
    answer = calibration.invert(felt.std(axis=-1), measured, sd_sigma=sd_sigma, force_sigma=FORCE_ERROR * measured)
    inside = (answer.lower_MPa <= E) & (answer.upper_MPa >= E)
    weights = np.array([0.5 / (len(rubbed) - 1)] * (len(rubbed) - 1) + [0.5])
    print(f"{inside.size} scenes, dominant: {calibration.dominant}; share inside the stated 95 % interval of E")
    print("friction   " + "".join(f"{low:g}-{high:g} MPa".rjust(16) for low, high in BANDS) + "all".rjust(10))
    shares = np.array([[_share(inside[:, k], E[:, k], band) for band in (*BANDS, (0, 9))] for k in range(len(weights))])
    for name, row in (*zip(rubbed, shares, strict=True), ("drawn", weights @ shares)):
        print(
            f"{name!s:11}" + "".join(f"{100 * share:.1f} %".rjust(16) for share in row[:-1]) + f"{100 * row[-1]:9.1f} %"
        )
    plain = calibration.invert(readings.std(axis=-1), force[..., 0])
    error = np.asarray(plain.modulus_MPa) / E[..., 0] - 1
    for k, name in enumerate(rubbed):
        parts = [error[:, k][(E[:, k, ..., 0] >= low) & (E[:, k, ..., 0] <= high)] for low, high in BANDS]
        told = ", ".join(_rms(part) for part in parts)
        print(f"without noise, friction {name}: rms error of E by band {told}")


def _rms(error: np.ndarray) -> str:
    told = error[~np.isnan(error)]
    rms = f"{100 * np.sqrt(np.mean(told**2)):.1f} %" if told.size else "-"
    return f"{rms} ({1 - told.size / error.size:.0%} none)"


def _share(inside: np.ndarray, modulus: np.ndarray, band: tuple[float, float]) -> float:
    within = (modulus >= band[0]) & (modulus <= band[1])
    return float(inside[within].mean())


if __name__ == "__main__":
    typer.run(main)
