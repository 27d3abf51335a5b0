"""The presses of the bench: those that errors are taken of, and the thousand that a calibration needs."""

from time import perf_counter

import numpy as np

from papilla.fem import ReducedFinger, press, press_finite
from papilla.finger import Finger
from papilla.mesh.layered import LayeredMesh
from papilla.specimen import THICKNESS_MM, Block
from papilla.units import gf_to_newton

SPECIMEN = Block(0.51, THICKNESS_MM)
"""The specimen of a sweep, of the middle published modulus (MPa, mm)."""

FORCES_GF = (10, 15, 20, 30, 50, 70, 100)
"""Forces at which the linear rungs are compared."""

FINITE_FORCES_GF = (10, 30, 100)
"""Forces at which rung finite is: a press of it takes seconds."""

QUANTITIES = ("sd", "indentation", "contact_area")

MODULI_MPA = np.geomspace(0.05, 0.72, 25)
SWEEP_FORCES_N = np.linspace(0.05, 1.0, 40)


def answers(reduced: ReducedFinger, fidelity: str, forces_gf: tuple[float, ...] = FORCES_GF) -> np.ndarray:
    """S_d in microstrain, indentation in mm and contact area in mm2 of the reduced finger: (3, forces)."""
    found = [press(reduced, SPECIMEN, force=gf_to_newton(gf), fidelity=fidelity) for gf in forces_gf]
    return np.array([[getattr(scene, name) for scene in found] for name in QUANTITIES])


def finite_answers(
    finger: Finger, mesh: LayeredMesh, forces_gf: tuple[float, ...] = FINITE_FORCES_GF
) -> tuple[np.ndarray, list[float]]:
    """The same of rung finite, and the seconds of each press."""
    found = [press_finite(finger, mesh, SPECIMEN, force=gf_to_newton(gf)) for gf in forces_gf]
    return np.array([[getattr(scene, name) for scene in found] for name in QUANTITIES]), [s.seconds for s in found]


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
