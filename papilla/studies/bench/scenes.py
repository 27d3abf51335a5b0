"""The presses of the bench: those that errors are taken of, and the thousand that a calibration needs."""

from collections.abc import Callable
from time import perf_counter

import numpy as np

from papilla.fem import ReducedFinger, press
from papilla.specimen import THICKNESS_MM, Block
from papilla.units import gf_to_newton

SPECIMEN = Block(0.51, THICKNESS_MM)
"""The specimen of a sweep, of the middle published modulus (MPa, mm)."""

FORCES_GF = (10, 15, 20, 30, 50, 70, 100)
"""Forces at which the linear fidelities are compared."""

FINITE_FORCES_GF = (10, 30, 100)
"""Forces at which fidelity finite is: a press of it takes seconds."""

QUANTITIES = ("sd", "indentation", "contact_area")

MODULI_MPA = np.geomspace(0.05, 0.72, 25)
SWEEP_FORCES_N = np.linspace(0.05, 1.0, 40)


def answers(pressed: Callable[[float], object], forces_gf: tuple[float, ...], names=QUANTITIES) -> np.ndarray:
    """S_d in microstrain, indentation in mm and contact area in mm2 of what `pressed` by each force gives: (3, forces);
    or other quantities by their `names`."""
    found = [pressed(gf_to_newton(gf)) for gf in forces_gf]
    return np.array([[getattr(scene, name) for scene in found] for name in names])


def thousand(reduced: ReducedFinger, fidelity: str) -> tuple[float, float]:
    """Seconds of all scenes of a sweep (25 moduli x 40 forces), and the median of one."""
    seconds = []
    began = perf_counter()
    for modulus in MODULI_MPA:
        start = None
        for force in SWEEP_FORCES_N:
            specimen = Block(float(modulus), SPECIMEN.thickness)
            scene = press(reduced, specimen, force=float(force), fidelity=fidelity, start=start)
            start = scene.active if fidelity == "contact" else None
            seconds.append(scene.seconds)
    return perf_counter() - began, float(np.median(seconds))


def fastest(work: Callable[[], object], repeats: int = 3) -> float:
    """Seconds of the fastest run: other work on the machine only adds."""
    clock = [perf_counter()]
    for _ in range(repeats):
        work()
        clock.append(perf_counter())
    return float(np.diff(clock).min())
