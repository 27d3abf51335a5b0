"""The presses of the bench: those whose errors are measured, and the thousand that a calibration needs."""

from collections.abc import Callable
from time import perf_counter, process_time

import numpy as np

from papilla.fem import ReducedFinger, press
from papilla.specimen import THICKNESS_MM, Block
from papilla.units import gf_to_newton

SPECIMEN = Block(0.51, THICKNESS_MM)
"""The specimen of a sweep, of the middle published modulus (MPa, mm)."""

FORCES_GF = (10, 15, 20, 30, 50, 70, 100)
"""Forces at which the linear fidelities are compared."""

FINITE_FORCES_GF = (10, 30, 100)
"""Forces at which fidelity finite is compared; one press takes seconds."""

QUANTITIES = ("sd", "indentation", "contact_area")

MODULI_MPA, DRAWN_GF = (0.05, 0.72), (5.0, 100.0)
"""Ranges of moduli (MPa), log-uniform, and forces (gf), uniform, from which presses are drawn."""


def answers(pressed: Callable[[float], object], forces_gf: tuple[float, ...], names=QUANTITIES) -> np.ndarray:
    """S_d in microstrain, indentation in mm and contact area in mm2 from `pressed` at each force: (3, forces); or other
    quantities by their `names`."""
    found = [pressed(gf_to_newton(gf)) for gf in forces_gf]
    return np.array([[getattr(scene, name) for scene in found] for name in names])


def drawn(reduced: ReducedFinger, count: int, seed: int = 0, **how) -> list[float]:
    """Processor seconds of each of `count` scenes, each with its own modulus and force; `how` : further arguments of
    `press`."""
    rng, seconds = np.random.default_rng(seed), []
    moduli = MODULI_MPA[0] * (MODULI_MPA[1] / MODULI_MPA[0]) ** rng.uniform(size=count)
    for modulus, force_gf in zip(moduli, rng.uniform(*DRAWN_GF, count), strict=True):
        specimen = Block(float(modulus), SPECIMEN.thickness)
        began = process_time()
        press(reduced, specimen, force=float(gf_to_newton(force_gf)), **how)
        seconds.append(process_time() - began)
    return seconds


def thousand(reduced: ReducedFinger, fidelity: str) -> tuple[float, float]:
    """Seconds of a thousand drawn scenes, and the median of one."""
    began = perf_counter()
    seconds = drawn(reduced, 1000, fidelity=fidelity)
    return perf_counter() - began, float(np.median(seconds))
